//! `wstac record`: a source into a file.

mod guide;

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::SIGHUP;

use super::output::{Form, LossReport, Records, Stop, check_new, note, text_of};
use super::run::interruptions;
use super::source_arguments::{SourceArguments, doubts_of_textures};
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::output::{DisturbedBaseline, Output, OutputOptions};
use wstac_host::record::about::About;
use wstac_host::record::{Recorder, Written};
use wstac_host::session::{Observer, Processor, Session, Step};
use wstac_host::source::Labels;
use wstac_host::source::{FramePolicy, Lag, SourceEvent, StreamInfo};
use wstac_host::texture::Textures;
use wstac_train::dataset::recordings::{NAMES, check};

/// Output a source: its frames and everything that became of them, for viewers, for wstac run and for wstac dataset
///
/// Every frame goes to the file as it came, with the driver's time stamp and number, and so do lost frames, taxels,
/// features, events, the camera's controls, the configuration and the labels. Ctrl-C ends a recording; SIGTERM and SIGHUP do, too.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// /dev/videoN, scene:…, FILE.y4m, -, a folder of PNGs or FILE.mcap, as wstac run has them
    source: String,

    /// Write this new file; with --guide, a folder of them
    #[arg(short, long, value_name = "FILE.mcap")]
    output: PathBuf,

    /// Lead a person through the slides of this plan, described below: one event a file, in the folder that -o names
    #[arg(long, value_name = "PLAN.toml", conflicts_with_all = ["frames", "duration", "events", "force"])]
    guide: Option<PathBuf>,

    /// Say what is recorded, such as specimen=Saw3, speed=150, direction=90; wstac dataset reads these three
    #[arg(long = "label", value_name = "NAME=VALUE", value_parser = label)]
    labels: Vec<(String, String)>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model, as wstac run does
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Print events as JSON Lines instead of text
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    options: SourceArguments,

    /// End after this many frames, lost ones included
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,

    /// End after this many seconds of frames
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<f64>,

    /// End after this many events
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    events: Option<u64>,

    /// Write over FILE.mcap
    #[arg(long)]
    force: bool,
}

const HELP: &str = r#"The file is MCAP, uncompressed. Rerun opens it as it is; its schemas are Foxglove's:
  /camera       every frame: foxglove.RawImage, or foxglove.CompressedImage with the JPEG as
                the camera sent it. The bytes are the camera's own; of formats that viewers have
                no name for, planes and numbers of 10 to 16 bits are shown as gray
  /taxels       5 × 5 shares of full scale: foxglove.RawImage, 32FC1
  /features     the ten features of every frame: std_msgs/msg/Float64MultiArray (ROS 2, CDR)
  /events       events in words: foxglove.Log; /events/json has the lines of wstac run --json
  /faults       lost frames and what happened to the source: foxglove.Log; /faults/json
  metadata      wstac.stream (size, format, color, rate, version), wstac.camera (who it is,
                its controls, and which are not locked), wstac.layout, wstac.configuration
                (TOML, in full), wstac.labels
  Times are the driver's time stamps, of a file frames / rate; a frame's number is the driver's.
  wstac run FILE.mcap gives the very events of the recorded run, with its configuration unless
  --config gives another. Textures are named by the models that --model gives there: without,
  events have none, and it is said which models the recording was made with.
  Taxel-only scenes (fidelity = "taxel") have no frames to record.

Guided (--guide PLAN.toml -o FOLDER):
  specimens = ["Saw3", "Fla0"]    # what is slid over the sensor
  speeds = [100, 150]             # mm/s; left out: no label speed
  directions = [0, 90]            # degrees; left out: no label direction
  count = 10                      # slides of every combination
  Labels that the plan gives cannot be given by --label, too.
  For every slide it says which, and waits for a line on standard input: Enter starts, r takes
  the last one once more (its file is replaced when the new one is whole), s skips, q quits.
  Where standard input ends, a camera's session ends; of a file or a scene, which waits for
  nobody, the slides that are left are taken at once. A
  baseline that is not quiet is taken again; then it says to slide, and the event goes to
  FOLDER/Saw3-150mm_s-90deg-01.mcap with its labels. Slides that have a file are left out, so
  the same command goes on after a stop. wstac dataset FOLDER -o set.npz makes a training set.

When something goes wrong:
  Ctrl-C, SIGTERM, SIGHUP and a source that fails end the file properly. Room for the end of the
  file is reserved as it grows, so a full disk ends it properly, too (exit code 1), where the
  file system can reserve room: ext4, XFS, Btrfs and tmpfs can. After kill -9 or a crash:
  wstac recover FILE.mcap -o WHOLE.mcap brings back every frame that was written. Frames wait for
  a slow disk in memory, up to 256 MiB; at the end it is said how many did, and whether the
  driver dropped any meanwhile.
  Exit code: 1 where the source or the file cannot be used, 2 for wrong arguments, otherwise 0.

Examples:
  wstac record /dev/video0 -o saw3.mcap --label specimen=Saw3 --label speed=150 --events 10
  wstac record scene:Saw3@150 -o scene.mcap --label specimen=Saw3
  wstac record /dev/video0 --guide plan.toml -o session
  wstac run saw3.mcap --model builtin:svm
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    if let Some(plan) = &arguments.guide {
        return guide::run(arguments, plan);
    }
    let labels = labels(&arguments.labels)?;
    check_new(&arguments.output, arguments.force)?;
    refuse_own(&arguments.source, &arguments.output)?;
    let (source, info, config) =
        arguments.options.open_configured(&arguments.source, FramePolicy::Every, arguments.config.as_deref())?;
    let files = ModelFile::open_all(&arguments.models)?;
    let wanted = OutputOptions { features: true, samples: false };
    let session = Session::builder(source).info(info.clone()).config(config.clone()).outputs(wanted);
    let mut session = session.textures(Textures::new(&files)?).build()?;
    let models = files.iter().map(|file| file.about().to_owned()).collect();
    let about = About::new(&info, &config, labels, models)?;
    note(&info.about);
    if let Some(doubt) = doubts_of_textures(&info, &files) {
        note(doubt);
    }
    let interrupted = signals()?;
    let file = create(&arguments.output, arguments.force)?;
    let recorder = Recorder::new(file, &arguments.output, &about, session.processor())?;
    let form = if arguments.json { Form::Json } else { Form::Text };
    let shown = Shown { records: Some(Records::new(form)), events: 0 };
    let limits = Limits { frames: frame_limit(arguments, &info), events: arguments.events };
    let mut recording = Recording { recorder, shown, losses: LossReport::default(), frames: 0 };
    let ended = read(&mut session, &mut recording, limits, &interrupted);
    recording.losses.say(note);
    let events = recording.shown.events;
    let written = recording.recorder.finish();
    say(&arguments.output, written.as_ref().ok(), session.lag(), events);
    // Both matter; a file that is not whole matters most.
    if let (Err(error), Err(_)) = (&ended, &written) {
        note(error);
    }
    written?;
    Ok(ended?)
}

/// When a recording ends by itself.
#[derive(Clone, Copy)]
struct Limits {
    frames: Option<u64>,
    events: Option<u64>,
}

/// Records on standard output, as long as somebody reads them: a recording goes on without.
struct Shown {
    records: Option<Records>,
    events: u64,
}

impl Shown {
    fn show(&mut self, record: &Output) {
        self.events += u64::from(matches!(record, Output::Event(_)));
        if let Output::BaselineDisturbed { .. } = record {
            note(DisturbedBaseline);
        } else if !matches!(record, Output::Features(_))
            && self.records.as_mut().is_some_and(|records| records.write(record).is_err())
        {
            self.records = None;
        }
    }
}

/// Records and shows everything that passes through a session.
struct Recording {
    recorder: Recorder,
    shown: Shown,
    losses: LossReport,
    /// Frames that have passed, lost ones included.
    frames: u64,
}

impl Observer for Recording {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        match event {
            SourceEvent::Frame(_) => self.frames += 1,
            SourceEvent::Lost { frames, reason } => {
                self.frames += frames;
                self.losses.add(*frames, reason);
            }
            _ => {}
        }
        self.recorder.source_event(event);
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        self.recorder.output(&output, &text_of(&output));
        self.shown.show(&output);
        Ok(())
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        self.recorder.processed(event, processor)
    }
}

/// Reads until the source ends or fails, a limit is reached, the disk is full, or a signal asks for the end.
fn read(
    session: &mut Session,
    recording: &mut Recording,
    limits: Limits,
    interrupted: &AtomicBool,
) -> Result<(), Error> {
    loop {
        let enough = limits.frames.is_some_and(|limit| recording.frames >= limit)
            || limits.events.is_some_and(|limit| recording.shown.events >= limit);
        if interrupted.load(Ordering::Relaxed) || enough {
            return session.finish(recording);
        }
        if session.step(recording)? == Step::Over {
            return Ok(());
        }
    }
}

/// What was recorded, and how far anything was behind.
fn say(path: &Path, written: Option<&Written>, lag: Lag, events: u64) {
    let Some(written) = written else { return };
    let megabytes = written.bytes as f64 / 1e6;
    let (frames, waiting) = (written.frames, written.most_waiting);
    note(format_args!("{}: {frames} frames, {events} events, {megabytes:.1} MB", path.display()));
    note(format_args!("at most {waiting} frames waited for the disk, {} for the program", lag.most));
    if written.waits > 0 {
        note(format_args!("the disk was too slow {} times: frames may have been dropped meanwhile", written.waits));
    }
}

/// `name=value`.
fn label(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().into(), value.trim().into()))
        }
        _ => Err(format!("{text:?} is no label, expected NAME=VALUE such as specimen=Saw3")),
    }
}

/// Labels by name, each once.
fn labels(given: &[(String, String)]) -> Result<Labels, Error> {
    let mut labels = Labels::new();
    for (name, value) in given {
        if let Some(other) = labels.insert(name.clone(), value.clone()) {
            let message = format_args!("{name} is {other:?} and {value:?}, expected one value");
            return Err(Error::new("--label", message));
        }
    }
    check(&labels).map_err(|message| Error::new("--label", message))?;
    for name in labels.keys().filter(|name| !NAMES.contains(&name.as_str())) {
        note(format_args!("label {name} is kept; wstac dataset reads {} alone", NAMES.join(", ")));
    }
    Ok(labels)
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| *seconds > 0.0 && *seconds <= 1e9);
    seconds.ok_or_else(|| format!("{text:?} is no duration, expected seconds such as 2.5"))
}

/// The frames after which a recording ends.
fn frame_limit(arguments: &Arguments, info: &StreamInfo) -> Option<u64> {
    let rate = info.rate.per_second();
    let of_time = arguments.duration.map(|seconds| (seconds * rate).ceil() as u64);
    arguments.frames.into_iter().chain(of_time).min()
}

/// Refuses to write over what is read: a file by any of its names, standard input, a scene's file, a picture of a folder.
fn refuse_own(source: &str, new: &Path) -> Result<(), Error> {
    let refused = || Err(Error::new(new.display(), "is the source itself, expected a new file"));
    let source = Path::new(if source == "-" { "/dev/stdin" } else { source.strip_prefix("scene:").unwrap_or(source) });
    if is_same(source, new) {
        return refused();
    }
    let is_picture = new.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    let folder = new.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if is_picture && new.exists() && is_same(source, folder) { refused() } else { Ok(()) }
}

/// Whether two paths lead to the same file or folder.
pub(super) fn is_same(one: &Path, other: &Path) -> bool {
    let of = |path: &Path| fs::metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()));
    of(one).is_some_and(|one| of(other) == Some(one))
}

/// The new file.
pub(super) fn create(path: &Path, force: bool) -> Result<File, Error> {
    check_new(path, force)?;
    let file = if force { File::create(path) } else { File::create_new(path) };
    file.map_err(|error| Error::new(path.display(), error))
}

/// A flag that a signal sets; a closed terminal ends a recording as Ctrl-C does.
fn signals() -> Result<Arc<AtomicBool>, Error> {
    let flag = interruptions()?;
    signal_hook::flag::register(SIGHUP, Arc::clone(&flag)).map_err(|error| Error::new("signals", error))?;
    Ok(flag)
}
