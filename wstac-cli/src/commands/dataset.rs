//! `wstac dataset` makes a training set of simulated slides or recordings.

pub(super) mod progress;
pub(super) mod random;
pub(super) mod recorded;
mod shard;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use self::progress::Progress;
use super::files::{Outputs, check_ending};
use super::model_arguments::Sample;
use super::output::{Stop, note};
use super::signals::{Ending, finishing, number};
use wstac_host::atomic_write::AtomicFile;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_train::dataset::part::{Part, fingerprint};
use wstac_train::dataset::sweep::Sweep;
use wstac_train::dataset::{arrays, check, each_sample};

/// Make a training set of simulated slides or recordings, for NumPy
///
/// Every event of a recording is a sample. In a simulation, every slide is a stream with its own baseline, and its
/// first event is a sample. Slides without an event, or with an incomplete sample, are counted and left out. Samples
/// that are cut off or not reliable are counted and kept. The same sweep gives the same bytes with any number of
/// threads.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,

    /// A sweep of simulated slides, or recordings
    ///
    /// A sweep is a TOML file, described below. Recordings (wstac record) are files, or folders of them. Without any, the
    /// slides are 12000 random ones, along the path.
    #[arg(value_name = "SWEEP|RECORDING")]
    sources: Vec<PathBuf>,

    /// The samples: over time, or along the path of a touch
    ///
    /// For models of any speed, direction and length, use path. Then a sweep is of random slides, with keys of its own.
    /// The default is frames, and without a source path.
    #[arg(long, value_enum)]
    input: Option<Sample>,

    /// Write the samples to this new file
    #[arg(short, long, value_name = "FILE.npz", required = true)]
    output: Option<PathBuf>,

    /// Make only shard K of N of the set
    ///
    /// wstac dataset merge makes the set of all N shards. A shard that is already there, and whole, stays.
    #[arg(long, value_name = "K/N", value_parser = super::shards::numbers)]
    shard: Option<[u32; 2]>,

    /// Number of threads; by default, one per processor
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Fraction of every specimen's recordings that is for tests
    ///
    /// The array split says which. A recording is never split.
    #[arg(long, value_name = "FRACTION", default_value = "0.2", value_parser = fraction)]
    test: f64,

    /// Read the configuration from this TOML file
    ///
    /// It replaces the configurations of recordings.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Overwrite FILE.npz
    ///
    /// It also starts anew if FILE.npz.part is of another sweep.
    #[arg(long)]
    force: bool,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Merge(shard::Arguments),
}

impl Arguments {
    /// Returns the file to write.
    fn output(&self) -> &Path {
        // Only a subcommand goes without it.
        self.output.as_deref().unwrap_or(Path::new(""))
    }

    /// Returns the wanted samples.
    fn sample(&self) -> Sample {
        self.input.unwrap_or(if self.sources.is_empty() { Sample::Path } else { Sample::Frames })
    }

    /// Returns what the samples are made of.
    fn source(&self) -> Result<Source<'_>, Error> {
        let ends = |path: &Path, with: &str| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(with));
        match &self.sources[..] {
            [] => Ok(Source::Random(None)),
            [one] if !one.is_dir() && !ends(one, "mcap") => {
                if !ends(one, "toml") {
                    let expected = "a .toml file, recordings (.mcap) or a folder of them";
                    return Err(not_a_source(one, "sweep", expected));
                }
                Ok(if self.sample() == Sample::Frames { Source::Sweep(one) } else { Source::Random(Some(one)) })
            }
            all => match all.iter().find(|source| ends(source, "toml")) {
                Some(sweep) => {
                    let message = "is a sweep among other sources, expected a single sweep, or recordings";
                    Err(Error::new(ErrorKind::Usage, sweep.display(), message))
                }
                None => Ok(Source::Recordings),
            },
        }
    }
}

/// What samples are made of.
#[derive(Clone, Copy, Debug)]
enum Source<'a> {
    /// A sweep over time.
    Sweep(&'a Path),
    /// Random slides: a sweep's file, or the defaults.
    Random(Option<&'a Path>),
    /// Recordings.
    Recordings,
}

const HELP: &str = r#"Recordings:
  wstac dataset saw3.mcap fla0.mcap -o set.npz
  wstac dataset FOLDER -o set.npz
  Every recording needs the label specimen (wstac record --label
  specimen=Saw3). The labels speed (mm/s) and direction (whole degrees,
  0 to 359) are used if they are there. Each recording is read with its
  own configuration. If two configurations make features of different
  meaning, the command fails. Notes report cameras that were not locked,
  and differences of layouts and formats.

The sweep, every key optional; these are the defaults:
  specimens = ["Fla0", "Sin2", "Sin3", "Sin4", "Saw2",
               "Saw3", "Saw4", "Tri2", "Tri3", "Tri4"]
                          # "Sphere" needs [scene.whisker] overlap_mm 0.4
  speeds = [150]          # mm/s, 1 to 1000
  directions = [0]        # degrees, any
  slides = 100            # of every specimen, up to 1000000 in all
  seed = 1                # of the first slide; each slide has the next
  [scene]                 # any other key and table of a scene's file,
                          # for all slides (wstac scene --help):
  fidelity = "taxel"      # or "rendered": every pixel, much slower
  Slide k of a specimen (from 0) has speed k mod n of n speeds, and
  direction (k / n) mod m of m directions. For all combinations, have at
  least n · m slides.
  An empty file means these defaults: 1000 slides to the right at
  150 mm/s. For a model of other slides, set more speeds and directions.
  For a test set, use the same keys with seed = 100001, so that no slide
  is in both.

The arrays of FILE.npz, n samples in the order of their slides:
  X          int16 (n, 10, 70): features, five rows, then five columns,
             over 70 frames; X * scale are natural logarithms
  scale      float64 (): 1/2048
  y_specimen str (n,): "Saw3"
  y_pattern  str (n,): "Fla", "Sin", "Saw", "Tri" or "Sphere"
  y_depth    int64 (n,): mm, the radius of a Sphere; float64 if
             one is no integer
  speed      float64 (n,): mm/s
  direction  int64 (n,): degrees, counterclockwise in the picture;
             float64 if one is no integer
  seed       uint64 (n,): of the slide's scene
  reliable   bool (n,): baseline quiet and at most 7 frames filled
  duration   int64 (n,): of the event in frames; -1 if it is cut off or
             never lit
  source     str (n,): "scene: Saw3 at 150 mm/s, 90 degrees, seed 7"
  fps        float64 (): the camera's frames per second, or those of the
             first recording

Data sets of recordings have no seed, and two more arrays:
  recording  str (n,): "saw3.mcap"; group by it for splits of your own
  split      str (n,): "train" or "test" (--test), the same for all
             samples of a recording
  Their direction is int64. Without such a label, speed is nan and
  direction -1. y_depth is nan if the specimen's name has no depth.

With --input path or taxel-path:
  A sweep is of random slides; these are the keys and their defaults:
    specimens = ["Fla0", …]   # the same ten
    slides = 12000            # of all specimens together
    speeds = [50, 300]        # mm/s, from and to; even in the logarithm
    directions = [0, 360]     # degrees, from and to
    lengths = [60, 120]       # mm, from and to
    sensors = 500             # different simulated sensors
    first_sensor = 0          # the first; 1000 has none of the others
    seed = 1
    test = 0.2                # fraction of the sensors for tests
  Without a file the defaults hold, which takes about a minute on two
  processors. Slides have random gains of 0.6 to 1.4, too.
  X_path or X_taxel_path takes the place of X. It is zero if there is
  no velocity or too little of the path. Further arrays: length, period
  and depth in mm, sensor, measured_speed, measured_direction, split.
  direction is float64. Recordings keep their arrays. With the label
  sensor in all of them, there is an array sensor, too.

In Python:
  set = numpy.load("FILE.npz")
  X = set["X"].reshape(len(set["X"]), -1) * set["scale"]
  model.fit(X, set["y_specimen"])

On many machines (docs/MANY.md):
  wstac dataset sweep.toml --shard 1/2 -o 1.shard
  wstac dataset sweep.toml --shard 2/2 -o 2.shard
  wstac dataset merge 1.shard 2.shard -o set.npz
  The set equals that of one process, byte for byte: of a sweep, with
  any --input, or of recordings. Shard K has every Nth slide or
  recording from the Kth on. A process that is killed leaves no shard:
  start the same command again. Recordings need the same names on all
  machines; the merge does not read them.

Interrupted runs:
  FILE.npz.part keeps the finished slides. After Ctrl-C or a crash, the
  same command continues from there.
  Exit code: 0 if there is a sample, 1 if there is none or a file cannot
  be used, 2 for wrong arguments, 130 after Ctrl-C, 143 after SIGTERM.
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    if let Some(Command::Merge(arguments)) = &arguments.command {
        return shard::merge_all(arguments);
    }
    if let Some(numbers) = arguments.shard {
        return shard::run(arguments, numbers);
    }
    check_ending(arguments.output(), &["npz"])?;
    match arguments.source()? {
        Source::Sweep(file) => simulated(arguments, file),
        Source::Random(file) => random::run(arguments, file),
        Source::Recordings => recorded::run(arguments),
    }
}

/// The endings of videos, which `wstac record` reads, but which have no labels.
const VIDEOS: [&str; 6] = ["avi", "mkv", "mov", "mp4", "webm", "y4m"];

/// Returns the error of a path that is none of the sources of slides: it is missing, a video, or something else.
pub(super) fn not_a_source(path: &Path, what: &str, expected: &str) -> Error {
    if let Err(error) = path.metadata() {
        return Error::io(path.display(), error);
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let name = path.display();
    let message = if VIDEOS.contains(&ending.as_str()) {
        let recording = path.with_extension("mcap");
        format!(
            "is a video, expected {expected}; help: record it first: wstac record {name} -o {} --label specimen=NAME",
            recording.display()
        )
    } else {
        format!("is no {what}, expected {expected}")
    };
    Error::new(ErrorKind::Usage, name, message)
}

/// Makes the data set of a sweep.
fn simulated(arguments: &Arguments, sweep_file: &Path) -> Result<(), Stop> {
    let config = arguments.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    let sweep = Sweep::read(sweep_file)?;
    // All slides have the same camera.
    check(&sweep.script(0), &config).map_err(|error| Error::new(ErrorKind::Config, sweep_file.display(), error))?;
    let output = arguments.output();
    let outputs = outputs(arguments);
    outputs.check([output])?;
    finishing(Ending::InTime);
    let signal = number();
    let path = beside(output, ".part");
    let mut part = Part::open(&path, fingerprint(&sweep, &config), sweep.count(), arguments.force)?;
    let (there, count) = (part.tally().done(), sweep.count());
    if there > 0 {
        note(format_args!("{}: {there} of {count} slides are already done", path.display()));
    }
    make(&sweep, &config, &mut part, arguments.threads, &signal).inspect_err(|stop| {
        if matches!(stop, Stop::Interrupted(_)) {
            let (done, path) = (part.tally().done(), path.display());
            note(format_args!("stopped after {done} of {count} slides; the same command continues from {path}"));
        }
    })?;
    finish(&outputs, output, &sweep, part, sweep_file)
}

/// Writes the finished data set of a sweep, which `subject` names, and removes the part.
fn finish(outputs: &Outputs, output: &Path, sweep: &Sweep, part: Part, subject: &Path) -> Result<(), Stop> {
    let count = sweep.count();
    let tally = part.tally();
    for (slides, why) in [(tally.no_event, "had no event"), (tally.incomplete, "had an incomplete sample")] {
        if slides > 0 {
            note(format_args!("left out: {slides} of {count} slides {why}"));
        }
    }
    for (samples, why) in [
        (tally.unreliable, "not reliable: the baseline was not quiet, or too many frames were lost (array reliable)"),
        (tally.without_duration, "without a duration: the slide is cut off or never lit (array duration)"),
    ] {
        if samples > 0 {
            note(format_args!("{samples} of {}: {why}", counted(tally.samples, "sample")));
        }
    }
    if tally.samples == 0 {
        part.remove()?;
        let message = format_args!("none of {count} slides became a sample, expected at least 1");
        return Err(Error::new(ErrorKind::Data, subject.display(), message).into());
    }
    write_all(outputs, output, |file| arrays::write(file, sweep, &part))?;
    part.remove()?;
    note(format_args!("{}: {}", output.display(), counted(tally.samples, "sample")));
    Ok(())
}

/// Returns what the command may write.
fn outputs(arguments: &Arguments) -> Outputs {
    Outputs::new(arguments.force).reading(&arguments.sources).reading(&arguments.config)
}

/// Creates the threads that compute.
pub(super) fn pool(threads: Option<u16>) -> Result<rayon::ThreadPool, Error> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from)).build();
    pool.map_err(|error| Error::with_cause(ErrorKind::Usage, "--threads", error))
}

/// Writes the file completely or not at all.
fn write_all(
    outputs: &Outputs,
    output: &Path,
    write: impl FnOnce(&mut AtomicFile) -> std::io::Result<()>,
) -> Result<(), Error> {
    let mut new = outputs.create(output)?;
    write(&mut new.file).map_err(|error| Error::io(output.display(), error))?;
    new.commit()
}

/// Reads a fraction of something, from 0 to below 1.
pub(super) fn fraction(text: &str) -> Result<f64, String> {
    let fraction = text.parse().ok().filter(|fraction| (0.0..1.0).contains(fraction));
    fraction.ok_or_else(|| format!("{text:?} is no fraction, expected at least 0 and below 1"))
}

/// Makes the slides that are missing.
fn make(
    sweep: &Sweep,
    config: &Config,
    part: &mut Part,
    threads: Option<u16>,
    signal: &AtomicUsize,
) -> Result<(), Stop> {
    let pool = pool(threads)?;
    let missing = part.missing();
    let mut progress = Progress::new("slides", part.tally().done(), sweep.count());
    pool.install(|| {
        each_sample(
            &missing,
            |number| sweep.script(number),
            config,
            |number, outcome| {
                part.append(number, &outcome)?;
                progress.say(part.tally().done());
                match signal.load(Ordering::Relaxed) {
                    0 => Ok(()),
                    signal => Err(Stop::Interrupted(signal as u8)),
                }
            },
        )
    })
}

/// Returns the path with a suffix.
fn beside(path: &Path, more: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(more);
    name.into()
}
