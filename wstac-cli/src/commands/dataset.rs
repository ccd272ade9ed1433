//! `wstac dataset` makes a training set of simulated slides or recordings.

mod lerobot;
pub(super) mod random;
pub(super) mod recorded;

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::builder::{ArgPredicate, PathBufValueParser, TypedValueParser};
use wstac_core::model::file::Input;

use super::files::{Outputs, check_ending, ends};
use super::output::{Stop, note};
use super::progress::ProgressLine;
use super::signals::{self, Ending, finishing};
use super::units;
use super::values::{fraction, sample};
use wstac_host::atomic_write::AtomicFile;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_train::dataset::sweep::Sweep;
use wstac_train::dataset::{Facts, Outcome, arrays, check, each_sample};

/// Make a training set of simulated slides or recordings, for NumPy or LeRobot
///
/// Every event of a recording is a sample. In a simulation, every slide is a stream with its own baseline, and its
/// first event is a sample. Slides without an event, or with an incomplete sample, are counted and left out. Samples
/// that are cut off or not reliable are counted and kept. The same sweep gives the same bytes with any number of
/// threads.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// A sweep of simulated slides, or recordings
    ///
    /// A sweep is a TOML file, described below. Recordings (wstac record) are files, or folders of them. Without any,
    /// the slides are 12000 random ones, along the path.
    #[arg(value_name = "SWEEP|RECORDING", value_parser = PathBufValueParser::new().try_map(not_merge))]
    sources: Vec<PathBuf>,

    /// The samples: over time (frames, taxels), or along the path of a touch
    ///
    /// For models of any speed, direction and length, use path. Then a sweep is of random slides, with keys of its own.
    /// The default is frames, and without a source path.
    #[arg(long, value_parser = sample())]
    input: Option<Input>,

    /// Write the samples to this new file
    #[arg(
        short,
        long,
        value_name = "FILE.npz",
        required = false,
        required_unless_present = "lerobot",
        default_value_if("lerobot", ArgPredicate::IsPresent, "-")
    )]
    output: PathBuf,

    /// Write a data set of LeRobot v3.0 to this new folder
    ///
    /// It needs ffmpeg and the Python package: install the wheel with [lerobot] (docs/SETS.md). Each recording or scene
    /// is an episode, as described below.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["output", "input", "units", "threads", "test", "force"])]
    lerobot: Option<PathBuf>,

    /// Make only the slides or recordings from number A on, below number B
    ///
    /// The first one has number 0. Parts of a set, put together in order, are the whole set.
    #[arg(long, value_name = "A..B", value_parser = units::range)]
    units: Option<Range<u32>>,

    /// Number of threads; by default, one per processor
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Fraction of every specimen's recordings that is for tests
    ///
    /// The array split says which. A recording is never split.
    #[arg(long, value_name = "FRACTION", default_value = "0.2", value_parser = fraction())]
    test: f64,

    /// Read the configuration from this TOML file
    ///
    /// It replaces the configurations of recordings.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Overwrite FILE.npz
    #[arg(long)]
    force: bool,

    // The last, because its heading is for all options behind it.
    #[command(flatten)]
    of_episodes: lerobot::Options,
}

impl Arguments {
    fn sample(&self) -> Input {
        self.input.unwrap_or(if self.sources.is_empty() { Input::Path } else { Input::Frames })
    }
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
  direction  int64 (n,): degrees, counterclockwise; 0 is right along
             the rows; float64 if one is no integer
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

With --input path (the default without a source), taxel-path or taxels:
  A sweep is of random slides; these are the keys and their defaults:
    specimens = ["Fla0", …]   # the same ten
    slides = 12000            # of all specimens together
    speeds = [50, 300]        # mm/s, from and to; even in the logarithm
    directions = [0, 360]     # degrees, from and to
    lengths = [60, 120]       # mm, from and to
    sensors = 500             # different simulated sensors
    first_sensor = 0          # the first; 1000 has none of the others
    seed = 1                  # by default first_sensor + 1, so that other
                              # sensors have other slides
    test = 0.2                # fraction of the sensors for tests
  Without a file the defaults hold, which takes about a minute on two
  processors. Slides have random gains of 0.6 to 1.4, too.
  X_path, X_taxel_path or X_taxels takes the place of X. A path is zero
  if there is no velocity or too little of it. X_taxels has the shape
  (n, 25, 70): taxels row by row, over 70 frames. Further arrays:
  length, period and depth in mm, sensor, measured_speed,
  measured_direction, split.
  direction is float64. Recordings keep their arrays. With the label
  sensor in all of them, there is an array sensor, too.

With --lerobot, for policies:
  wstac dataset --lerobot set FOLDER --arm arm.toml
  The task is the label task, or else is made of the label specimen. The
  columns of a frame:
    observation.images.tactile   the picture, as video
    observation.tactile.taxels   25 fractions of full scale, row by row
    observation.tactile.features five rows, five columns, in logarithms
    observation.tactile.motion   x to the right and y up in mm/s; nan
                                 where none is known (motion_known)
    observation.tactile.slip     whether a held part began to slip
    observation.state, action    of the arm
    tactile.time_s               when the light came, from the first row
    tactile.lost                 frames lost just before; they have no row
  timestamp is frame_index / fps, as LeRobot demands. Above 45 frames
  per second, features and motion are of round(fps / 30) frames added:
  rows repeat the last ones. They are nan before the first, and from a
  loss to the next.
  ARM.toml has the tables [state] and [action], or one of them:
    file = "{name}.csv"    # beside ARM.toml; {name} is the recording's
                           # name without ending. Or .parquet, .mcap
    topic = "/joint_states"    # of .mcap: JointState of ROS 2
    columns = ["j1", "j2"] # columns or joints; by default all
    field = "position"     # of .mcap; or "velocity", "effort"
    time = "time"          # the column of times; of .mcap
                           # "header.stamp" (default) or "log_time"
    unit = "s"             # of times; or "ms", "us", "ns"
    clock = "wall"         # times are since 1970; "driver": the clock of
                           # the camera's driver; "start": from the
                           # recording's first frame
    join = "linear"        # between two rows; or "nearest", which angles
                           # that wrap need
    within_ms = 20         # the nearest row is no farther away
  Frames more than within_ms before the arm's first row or after its last
  have no row. A gap or a missing number in between is an error.

In Python:
  set = numpy.load("FILE.npz")
  X = set["X"]    # by --input X_path, X_taxel_path or X_taxels; X_path
                  # without a source
  X = X.reshape(len(X), -1) * set["scale"]
  model.fit(X, set["y_specimen"])

In parts, on many machines (docs/MANY.md):
  wstac dataset sweep.toml --units 0..500 -o 0.npz
  wstac dataset sweep.toml --units 500..1000 -o 500.npz
  A unit is a slide of a sweep, or a recording in the order of names.
  The seed of a slide follows from its number in the whole set. So
  numpy.concatenate of the same array of all parts, in order, is that
  array of the whole set. All recordings must be there for every part:
  their labels decide which are for tests.
  A command that is stopped leaves no file. Start it again, or make a
  large set in parts. A process keeps its slides in memory, 1.5 kB each,
  3.6 kB of taxels.
  Exit code: 0 if there is a sample, 1 if there is none or a file cannot
  be used, 2 for wrong arguments, 130 after Ctrl-C, 143 after SIGTERM.
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    if let Some(folder) = &arguments.lerobot {
        return lerobot::run(arguments, folder);
    }
    check_ending(&arguments.output, &["npz"])?;
    outputs(arguments).check([&arguments.output])?;
    match &arguments.sources[..] {
        [] => random::run(arguments, None),
        [sweep] if ends(sweep, "toml") && !sweep.is_dir() => match arguments.sample() {
            Input::Frames => simulated(arguments, sweep),
            _ => random::run(arguments, Some(sweep)),
        },
        [one] if !one.is_dir() && !ends(one, "mcap") => {
            Err(not_a_source(one, "sweep", "a .toml file, recordings (.mcap) or a folder of them").into())
        }
        all => match all.iter().find(|source| ends(source, "toml")) {
            Some(sweep) => {
                let message = "is a sweep among other sources, expected a single sweep, or recordings";
                Err(Error::new(ErrorKind::Usage, sweep.display(), message).into())
            }
            None => recorded::run(arguments),
        },
    }
}

/// Refuses the name of a command that was removed, unless it is a file's.
fn not_merge(source: PathBuf) -> Result<PathBuf, &'static str> {
    if source == Path::new("merge") && !source.exists() { Err("was removed") } else { Ok(source) }
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
    let outputs = outputs(arguments);
    let units = units::chosen(arguments.units.as_ref(), sweep.count() as usize, "slides")?;
    let outcomes = make(&sweep, &config, units, arguments.threads)?;
    let samples = tell(&outcomes);
    if samples == 0 && arguments.units.is_none() {
        let message = format_args!("none of {} slides became a sample, expected at least 1", outcomes.len());
        return Err(Error::new(ErrorKind::Data, sweep_file.display(), message).into());
    }
    write_all(&outputs, &arguments.output, |file| arrays::write(file, &sweep, &outcomes))?;
    note(format_args!("{}: {}", arguments.output.display(), counted(samples, "sample")));
    Ok(())
}

/// Prints what is unusual about the outcomes of slides, and returns the number of samples.
fn tell(outcomes: &[(u32, Outcome)]) -> usize {
    let outcomes = || outcomes.iter().map(|(_, outcome)| outcome);
    let slides = outcomes().count();
    for (kind, why) in [(Outcome::NoEvent, "had no event"), (Outcome::Incomplete, "had an incomplete sample")] {
        let left_out = outcomes().filter(|outcome| **outcome == kind).count();
        if left_out > 0 {
            note(format_args!("left out: {left_out} of {slides} slides {why}"));
        }
    }
    let facts = outcomes().filter_map(|outcome| match outcome {
        Outcome::Sample(_, facts) => Some(*facts),
        Outcome::NoEvent | Outcome::Incomplete => None,
    });
    let facts: Vec<Facts> = facts.collect();
    tell_facts(&facts);
    facts.len()
}

/// Prints how many samples are not reliable or have no duration.
fn tell_facts(facts: &[Facts]) {
    let all = counted(facts.len(), "sample");
    let unreliable = facts.iter().filter(|facts| !facts.reliable).count();
    if unreliable > 0 {
        let why = "the baseline was not quiet, or too many frames were lost (array reliable)";
        note(format_args!("{unreliable} of {all}: not reliable: {why}"));
    }
    let without_duration = facts.iter().filter(|facts| facts.duration.is_none()).count();
    if without_duration > 0 {
        let why = "the slide is cut off or never lit (array duration)";
        note(format_args!("{without_duration} of {all}: without a duration: {why}"));
    }
}

fn outputs(arguments: &Arguments) -> Outputs {
    Outputs::new(arguments.force).reading(&arguments.sources).reading(&arguments.config)
}

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

/// Makes the slides of these numbers, in order.
fn make(sweep: &Sweep, config: &Config, units: Range<u32>, threads: Option<u16>) -> Result<Vec<(u32, Outcome)>, Stop> {
    finishing(Ending::InTime);
    let numbers: Vec<u32> = units.collect();
    let mut outcomes = Vec::with_capacity(numbers.len());
    let mut progress = ProgressLine::new("slides", numbers.len());
    pool(threads)?.install(|| {
        each_sample(
            &numbers,
            |number| sweep.script(number),
            config,
            |number, outcome| {
                outcomes.push((number, outcome));
                progress.one_more();
                signals::check()
            },
        )
    })?;
    outcomes.sort_unstable_by_key(|(number, _)| *number);
    Ok(outcomes)
}
