//! `wstac record` writes a source to a file.

mod guide;
mod to_file;

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::files::Outputs;
use super::output::{Stop, note};
use super::records::Records;
use super::source_arguments::SourceArguments;
use super::values::{at_least, within};
use wstac_host::atomic_write::lock_existing;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::files::has_name;
use wstac_host::output::{DisturbedBaseline, Output};
use wstac_host::plural::counted;
use wstac_host::record::labels::{self, NAMES, by_name};
use wstac_host::record::{Compression, Written, first_free_file};
use wstac_host::source::names::{SensorSpec, sensors};
use wstac_host::source::{Crop, Labels, StreamInfo};

/// Record frames, events and settings of a source to a file
///
/// Every frame is written as it came, with the driver's time stamp and number. So are lost frames, taxels, features,
/// events, the camera's controls, the configuration and the labels. Viewers, wstac run and wstac dataset read the
/// file. Ctrl-C, SIGTERM and SIGHUP end a recording.
#[derive(Debug, Default, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// The source, as for wstac run, or several as NAME=SOURCE
    ///
    /// Several sensors, at most 20, are recorded to one file, each with its own topics.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Write this new file; with --guide, the folder for the recordings
    #[arg(short, long, value_name = "FILE.mcap")]
    output: PathBuf,

    /// Guide a person through the slides of a plan, described below
    ///
    /// Each slide becomes a file in the folder that -o names.
    #[arg(long, value_name = "PLAN.toml", conflicts_with_all = ["frames", "duration", "events", "force"])]
    guide: Option<PathBuf>,

    /// A label of the recording, such as specimen=Saw3
    ///
    /// wstac dataset reads specimen, speed, direction and sensor; for LeRobot also task.
    #[arg(long = "label", value_name = "NAME=VALUE", value_parser = labels::parse)]
    labels: Vec<(String, String)>,

    /// Compress the file
    ///
    /// If the program is killed, up to a second of frames is lost then. A build without the feature compression cannot
    /// do it.
    #[arg(long, value_name = "zstd|lz4", value_parser = compression)]
    compress: Option<Compression>,

    /// Record only the part around the taxels
    ///
    /// PIXELS is the margin around them, 16 if left out. The file is read as before: what is outside is black. Other
    /// taxels must lie inside.
    #[arg(long, value_name = "PIXELS", num_args = 0..=1, require_equals = true, default_missing_value = MARGIN)]
    crop: Option<u16>,

    /// Record taxel sums and features, and no pictures
    ///
    /// wstac run, dataset and plot give the same touches again, as long as [layout] and [green] stay. What needs pixels
    /// (wstac calibrate, --save-raw, another layout) is refused.
    #[arg(long, conflicts_with = "crop")]
    features_only: bool,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Print events as JSON Lines instead of text
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    options: SourceArguments,

    /// End after this many frames, lost ones included
    #[arg(long, value_name = "N", value_parser = at_least(1_u64))]
    frames: Option<u64>,

    /// End after this many seconds of frames
    #[arg(long, value_name = "SECONDS", value_parser = within(f64::MIN_POSITIVE..=1e9, "seconds such as 2.5"))]
    duration: Option<f64>,

    /// End after this many events
    #[arg(long, value_name = "N", value_parser = at_least(1_u64))]
    events: Option<u64>,

    /// Overwrite FILE.mcap
    ///
    /// The recording is called FILE.mcap.new until it is whole, or FILE.mcap.2.new if that name is taken.
    #[arg(long)]
    force: bool,
}

impl Arguments {
    /// Returns those of a guided session that records the slides of a plan to a folder.
    pub(super) fn guided(
        source: OsString,
        output: PathBuf,
        plan: PathBuf,
        config: PathBuf,
        options: SourceArguments,
    ) -> Self {
        let (sources, guide, config) = (vec![source], Some(plan), Some(config));
        Self { sources, output, guide, config, options, ..Self::default() }
    }
}

/// The margin around the taxels of a part, in pixels.
const MARGIN: &str = "16";

const HELP: &str = r#"Content of the file:
  MCAP with the schemas of Foxglove; Rerun opens it. It is uncompressed
  unless --compress says zstd or lz4.
  /camera     every frame: foxglove.RawImage, or foxglove.CompressedImage
              with the JPEG that the camera sent. The bytes are the
              camera's own. Formats that viewers do not know (planes, and
              numbers of 10 to 16 bits) are shown as gray.
              With --crop it is the part around the taxels: raw, even if
              the camera sends JPEG. wstac.stream says where it was.
  /taxels/sums  with --features-only, in place of /camera: the 25 sums
              of every frame, std_msgs/msg/UInt32MultiArray (ROS 2, CDR)
  /taxels     5 × 5 fractions of full scale: foxglove.RawImage, 32FC1
  /features   the ten features of every frame:
              std_msgs/msg/Float64MultiArray (ROS 2, CDR)
  /events     events in words: foxglove.Log; /events/json has the lines
              of wstac run --json
  /faults     lost frames and faults of the source: foxglove.Log, and as
              JSON in /faults/json
  /sums/json  a checksum of every frame with all that belongs to it, and
              its place in the stream: how damage is found
  metadata    wstac.stream (size, format, color, rate, version),
              wstac.camera (its identity, its controls, and which are not
              locked), wstac.layout, wstac.configuration (all of it, as
              TOML), wstac.labels
  /clock/json the wall-clock time of a frame, for the first one and
              whenever the clock was set or has drifted by 0.25 ms
  Times are the driver's time stamps. If there are none, they count from
  0 by the frame rate. Log and publish time are those of the frame; an
  event's are those of its first touch. Frame numbers are the driver's.
  wstac run FILE.mcap gives the same events again, with the recording's
  configuration unless --config gives another. Textures need --model
  there. Without it, events have none, and a note names the models of the
  recording. Taxel-only scenes (fidelity = "taxel") have no frames and
  can be recorded with --features-only alone.

Several sensors, as NAME=SOURCE, in one file, at most 20:
  Each has its own topics (/left/camera, /left/features, …), its own
  baseline and its own end. Frames of files and scenes are in the order
  of their times, those of cameras in the order in which they came. All
  need one clock: cameras together, or files and scenes together. They
  share options, configuration, models and labels. wstac run, view and
  dataset read all sensors of the file; --sensor NAME chooses one, which
  plot needs. --guide is for one sensor. --events counts those of all.
  If the source of one sensor fails, the recording ends for all. Files
  and scenes end at the same frames every time: those up to the last
  frame of the sensor that failed, or up to the frame that completed
  the last event.

Size, for 720p in gray at 30 frames per second:
  all of it 28 MB per second, --crop 15 MB, --features-only 0.02 MB.
  --compress makes a file smaller by what its pictures allow.

Guided (--guide PLAN.toml -o FOLDER):
  specimens = ["Saw3", "Fla0"]    # what slides over the sensor
  speeds = [100, 150]             # mm/s; if left out: no such label
  directions = [0, 90]            # degrees; if left out: no such label
  count = 10                      # slides of every combination
  The plan's own labels cannot be given with --label, too.
  For every slide the program prints which it is and waits for a line on
  standard input: Enter starts, r repeats the last slide (its file is
  replaced when the new one is whole), s skips, q quits. A camera's
  session ends when standard input ends. A file or a scene does not wait
  then: its remaining slides are taken at once.
  If the baseline is not quiet, it is taken again. Then the program asks
  for the slide, which goes to FOLDER/Saw3-150mm_s-90deg-01.mcap with its
  labels. A press or a poke is dropped, and the slide is asked for again.
  Slides that have a file are left out, so the same command continues
  after a stop. wstac dataset FOLDER -o set.npz makes a training set of
  the folder.

If something goes wrong:
  Ctrl-C, SIGTERM, SIGHUP and a source that fails end the file properly.
  A full disk does, too (exit code 1), if the file system can reserve
  room for the file's end: ext4, XFS, Btrfs and tmpfs can.
  After kill -9 or a crash, wstac recover FILE.mcap -o WHOLE.mcap brings
  back every frame that was written. With --force on an older recording,
  the new one is FILE.mcap.new until it is whole.
  Up to 256 MiB of frames wait in memory for a slow disk. At its end the
  program prints how many waited, and whether the driver dropped any.
  If somebody removes, moves or replaces the file meanwhile, it is not
  saved under its name: the error says so at the end.
  Exit code: 1 if the source or the file cannot be used, 2 for wrong
  arguments, otherwise 0.

Examples:
  wstac record /dev/video0 -o saw3.mcap --label specimen=Saw3 \
    --label speed=150 --events 10
  wstac record scene:Saw3@150 -o scene.mcap --label specimen=Saw3
  wstac record /dev/video0 --guide plan.toml -o session
  wstac record left=/dev/video0 right=/dev/video2 -o both.mcap
  wstac run saw3.mcap --model builtin
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let given = sensors(&arguments.sources)?;
    match (&arguments.guide, &given[..]) {
        (None, _) => to_file::run(arguments, &arguments.options.every_sensor(&given)?),
        (Some(plan), [SensorSpec { name: None, source }]) => guide::run(arguments, source, plan),
        _ => Err(Error::new(ErrorKind::Usage, "--guide", "is for one sensor, expected a plain source").into()),
    }
}

/// Creates the file, beside an older recording that it will replace.
fn create(arguments: &Arguments, outputs: &Outputs) -> Result<(File, Option<Replacement>), Error> {
    let path = &arguments.output;
    let old = if arguments.force { lock_existing(path)? } else { None };
    let Some(old) = old else { return Ok((outputs.create_at_once(path)?, None)) };
    // The old recording stays until the new one is whole.
    let (file, beside) = first_free_file(|number| match number {
        1 => path.with_added_extension("new"),
        _ => path.with_added_extension(format!("{number}.new")),
    })?;
    let own = file.try_clone().map_err(|error| Error::io(beside.display(), error))?;
    Ok((file, Some(Replacement { beside, path: path.clone(), old, own })))
}

/// Returns the stream as it is recorded: whole, a part of it, or its taxel sums.
fn kept(arguments: &Arguments, info: &StreamInfo, config: &Config) -> Result<StreamInfo, Error> {
    let mut kept = info.clone();
    if info.taxels_only && !arguments.features_only {
        let expected = "gives taxel sums and no frames, expected fidelity = \"rendered\", or --features-only";
        return Err(Error::new(ErrorKind::Unsupported, &info.about, expected));
    }
    if arguments.features_only {
        (kept.taxels_only, kept.crop) = (true, None);
    } else if let Some(margin) = arguments.crop {
        let around = Crop::around(config.geometry(info)?.layout(), margin);
        let crop = info.crop.map_or(Some(around), |known| known.intersection(&around));
        kept.crop = crop;
        if let Some(crop) = crop {
            let ([x, y], size) = (crop.at(), crop.size());
            let (width, height) = (size.width(), size.height());
            let margin = counted(u64::from(margin), "pixel");
            note(format_args!("recorded part: {width} x {height} pixels at ({x}, {y}), {margin} around the taxels"));
        }
    }
    Ok(kept)
}

/// A recording that takes the place of an older one when it is whole.
struct Replacement {
    beside: PathBuf,
    path: PathBuf,
    /// The lock of the old recording: nobody else records to it or replaces it meanwhile.
    old: File,
    /// The new recording.
    own: File,
}

impl Replacement {
    /// Replaces the old recording if the new one is whole.
    fn finish(self, is_whole: bool, outputs: &Outputs) -> Result<(), Error> {
        let Self { beside, path, old, own } = self;
        if !is_whole {
            // Somebody may have removed it.
            if has_name(&own, &beside) {
                note(format_args!("{} has what was recorded", beside.display()));
            }
            if has_name(&old, &path) {
                note(format_args!("{} is as it was", path.display()));
            }
            return Ok(());
        }
        outputs.check_one(&path)?;
        // The name may have gone to another file, which somebody records to.
        drop(old);
        let _old =
            lock_existing(&path).inspect_err(|_| note(format_args!("{} has what was recorded", beside.display())))?;
        fs::rename(&beside, &path).map_err(|error| Error::io(path.display(), error))
    }
}

/// Records on standard output while somebody reads them. The recording continues without a reader.
struct Shown {
    records: Records<'static>,
    is_read: bool,
}

impl Shown {
    fn new(records: Records<'static>) -> Self {
        Self { records, is_read: true }
    }

    fn show(&mut self, record: &Output) {
        if let Output::BaselineDisturbed { .. } = record {
            self.records.note(DisturbedBaseline);
        } else if !matches!(record, Output::Features(_)) {
            self.is_read = self.is_read && self.records.write(record).is_ok();
        }
    }
}

/// Reports what was recorded, and the largest delays. Only a live source may have lost frames while the disk was slow.
fn say(path: &Path, written: Option<&Written>, lag: u32, events: u64, is_live: bool) {
    let Some(written) = written else { return };
    let megabytes = written.bytes as f64 / 1e6;
    let (frames, waiting) = (written.frames, written.most_waiting);
    let (frames, events) = (counted(frames, "frame"), counted(events, "event"));
    note(format_args!("{}: {frames}, {events}, {megabytes:.1} MB", path.display()));
    note(format_args!("at most {} waited for the disk, {lag} for the program", counted(waiting, "frame")));
    if written.waits > 0 && is_live {
        let times = counted(written.waits, "time");
        note(format_args!("the disk was too slow {times}: the driver may have dropped frames"));
    }
}

/// Returns labels by name, each once.
fn labels(given: &[(String, String)]) -> Result<Labels, Error> {
    let labels = by_name(given.to_vec()).map_err(|message| Error::new(ErrorKind::Usage, "--label", message))?;
    for name in labels.keys().filter(|name| !NAMES.contains(&name.as_str())) {
        note(format_args!("label {name} is kept; wstac dataset reads only {}", NAMES.join(", ")));
    }
    Ok(labels)
}

fn compression(text: &str) -> Result<Compression, String> {
    let found = [Compression::Zstd, Compression::Lz4].into_iter().find(|compression| compression.name() == text);
    found.ok_or_else(|| format!("{text:?} is no compression, expected zstd or lz4"))
}

fn frame_limit(arguments: &Arguments, info: &StreamInfo) -> Option<u64> {
    let rate = info.rate.per_second();
    let of_time = arguments.duration.map(|seconds| (seconds * rate).ceil() as u64);
    arguments.frames.into_iter().chain(of_time).min()
}
