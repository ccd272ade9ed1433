//! `wstac run` prints the events of one source, or of several at once.

pub(super) mod board;
mod no_event;
mod range;
mod read;

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;

use self::read::{Opened, Run};
use super::csv::Table;
use super::files::{Outputs, check_ending};
use super::output::{Stop, note};
use super::records::{Destination, Form};
use super::signals;
use super::source_arguments::{SourceArguments, at_least, open_models};
use wstac_host::error::{Error, ErrorKind as Kind};
use wstac_host::monitor::pictures::port_of;
use wstac_host::plural::counted;
use wstac_host::source::names::{SensorSpec, sensors};

/// Print the tactile events of a source
///
/// Frames become 25 taxel sums, ten features and events. An event has the kind of a touch, and speed and direction of what
/// slides, as soon as they are certain: often half a second after the first light, at the latest after 70 frames. The first 25 frames (0.8 s at 30 frames per second) are the baseline: nothing may
/// touch the sensor during them. Ctrl-C ends a camera.
#[derive(Debug, clap::Args)]
#[command(after_long_help = help())]
#[expect(clippy::struct_excessive_bools, reason = "each is an argument of its own")]
pub(super) struct Arguments {
    /// Camera, recording, scene or board, or several as NAME=SOURCE
    ///
    /// Sources are /dev/videoN, rpicam:, scene:Saw3@150[,90deg][,60mm][,seed=N], scene:FILE.toml, FILE.y4m, - (Y4M on standard input),
    /// FILE.mcap, a video such as FILE.mp4, a folder of pictures, and a board such as /dev/ttyACM0; see Sources below.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    ///
    /// It is builtin, the best of those that were trained on simulated slides, another name of wstac model list, a file
    /// (see wstac model --help), or none. Give one for each of specimens, patterns and depths if they have models of their
    /// own. By default, a scene has builtin if [speed] estimator is "wave", at about 30 processed frames per second.
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Print JSON Lines; short for --output-format json
    #[arg(long, conflicts_with = "output_format")]
    json: bool,

    /// Form of the records; by default that of the name of -o, or text
    #[arg(long, value_name = "FORM")]
    output_format: Option<Form>,

    /// Write the records to this .jsonl, .json (one array), .csv or .txt file
    ///
    /// The file takes its name when the source ends. Until then, a hidden file beside it has the records. - is standard
    /// output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Overwrite the file of -o
    #[arg(long, requires = "output")]
    force: bool,

    /// Print no notes on standard error, only errors
    #[arg(short, long)]
    quiet: bool,

    /// Also print the ten features of every frame
    #[arg(long)]
    features: bool,

    /// Also print speed and direction of every frame while something slides
    ///
    /// For most slides (docs/ANSWERS.md), the first is printed at most three frames after the leading edge has crossed
    /// all whiskers. Of a ball, coin, corner or narrow block one is printed, as soon as it has left.
    #[arg(long)]
    motion: bool,

    /// Also print the sample of every event, 10 × 70 numbers (JSON only)
    #[arg(long)]
    samples: bool,

    /// Also report a board's state about once per second, on standard error
    ///
    /// It says how long the board runs, its frame rate, overruns, restarts, stack and temperature, as far as
    /// the board knows them.
    #[arg(long)]
    status: bool,

    /// Bits per second of a board's serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    baud: Option<u32>,

    #[command(flatten)]
    options: SourceArguments,

    /// End after this many frames, lost ones included
    ///
    /// Of several sources, each ends after as many frames.
    #[arg(long, value_name = "N", value_parser = at_least(1_u64))]
    frames: Option<u64>,

    /// Print only records from this time on, in seconds of the source
    ///
    /// All frames are read, and the baseline is that of the first frames. So the records are the same as without the
    /// option. A record's time is its time_s, from the first frame on; that of an event is its touch.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    since: Option<f64>,

    /// Print only records before this time, in seconds of the source
    ///
    /// Reading ends when no record before this time can follow: after the last sample and the last touch that began
    /// before it.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    until: Option<f64>,

    /// Take the baseline from the frames at this time, in seconds
    ///
    /// It is for a file that is touched in its first 25 frames: the file is read twice, first to this time, where nothing may
    /// touch the sensor for 25 frames. Touches that begin in the first 10 frames are not whole. Cameras, boards, pipes and
    /// standard input can be read only once.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    baseline_at: Option<f64>,

    /// Write the bytes of every frame to a new file (one source only)
    ///
    /// Bytes are written as they are summed: JPEG and PNG are decoded first. Lost frames leave no bytes.
    #[arg(long, value_name = "FILE")]
    save_raw: Option<PathBuf>,
}

impl Arguments {
    /// Returns the file of the records; `None` for standard output.
    fn file(&self) -> Option<&Path> {
        self.output.as_deref().filter(|path| *path != Path::new("-"))
    }
}

const HELP: &str = r#"Sources:
  /dev/videoN      a V4L2 camera (wstac devices lists them); --format,
                   --size and --fps choose one of its modes
  rpicam:          a Raspberry Pi's camera, which rpicam-vid reads;
                   rpicam:1 is the second. Controls are shutter in µs;
                   gain, red_gain and blue_gain in hundredths; and
                   lens_position in hundredths of a diopter.
  scene:Saw3@150   a simulated slide: Fla0, or Sin, Saw or Tri with a
                   depth of 2, 3 or 4 mm; then @ and 1 to 1000 mm/s;
                   then any of ,90deg ,60mm ,seed=N
  scene:FILE.toml  simulated slides with any property of specimen,
                   whiskers, light and camera (see wstac scene --help)
  FILE.y4m, -      Y4M, from a file or standard input
  FILE.mp4         a video, also .mkv, .mov, .avi, .webm and others; it
                   is decoded by ffmpeg, which must be installed. Range
                   and matrix are those that the file states. By time
                   stamps, missing frames count as lost, and events
                   with frames that come unevenly are not reliable.
  FILE.mcap        a recording of wstac record: it gives the same events
                   again, with its own configuration unless --config
                   gives another; textures need --model, and a note
                   says if the recording was made with a model. Of
                   several sensors all are read, or the one that
                   --sensor NAME chooses.
  FOLDER           PNG or JPEG files of one size, 2.png before 10.png, at
                   the rate of the times in their names (seconds such as
                   1700000000.25, dates, times of day, milliseconds to
                   nanoseconds since 1970), or 30 per second; --fps gives
                   another rate. A damaged picture is a lost frame, and
                   so is one that the names leave out. Pictures are
                   turned as their Exif data say. PNG files beside JPEG
                   files, and two series of names such as left_1 and
                   right_1, are refused.
  /dev/ttyACM0     a board, which finds the events itself, at a serial
                   device; also tcp:HOST:PORT, and board:FILE with the
                   bytes that a board sent (board:- is standard input).
                   --features, --samples and --motion are requested of
                   it. Notes say what it is and what was lost. A serial
                   device that disappears is waited for.
  NAME=SOURCE      any of these with a name, to read several at once:
                   wstac run left=/dev/video0 right=/dev/video2
                   A file whose name has = is ./NAME=FILE.
                   A name has letters, digits, - and _. All sources
                   share options, configuration and models. Each has its
                   own baseline, frames and end. If one fails, the
                   others continue.
  Exit code: 1 if a source or file cannot be used or no frame of it can, 2
  for wrong arguments, otherwise 0, also after Ctrl-C.

Camera faults and recovery:
  If the program is slower than the camera, it skips older frames for the
  newest one. Skipped frames count as lost, so time does not shift. With
  --save-raw no frame is skipped.
  If the stream stops (unplugged, failed or silent), the program waits
  for the same camera. It finds it by its serial number or its port,
  restarts it with the same settings and continues. The time in between
  counts as lost frames.
  Each fault is reported once:
    disconnected   the stream stopped
    reconnected    the camera is back and its stream runs
    refused        the camera is there, but does not start yet
    no-signal      the input has no signal
    signal         the signal is back
    slow           fewer than 90 % of the agreed frames arrive
    in-time        frames arrive at the agreed rate again
    rate           the rate is more than 2 % too low
    fast           the rate is more than 2 % too high: until in-time,
                   events are not reliable
    controls       controls have other values than before the fault
    decoder        a JPEG picture is refused: the first one says why
  A camera that comes back with another format, size or rate ends the
  stream with exit code 1.

Meaning of the answers:
  An event is a touch within a sample of 70 frames (2.3 s at 30 frames per
  second). A touch that lasts longer is one event, too.
  contact  slide: something arrives at one side and leaves at the other.
           press: all whiskers are reached at once, or left at once.
           poke: one or two whiskers are touched.
           unclear: none of these, or none for certain; a speed from
           about 700 mm/s on, a tilted press, a slide that starts or
           stops on the sensor.
  Only a slide has speed, direction and texture. They come from the times
  at which light reaches each row and column. So the length of the
  specimen does not matter, and any direction will do. Each has a
  standard deviation; most errors are smaller (docs/ANSWERS.md).
  Directions are counterclockwise in the picture: 0° is right, 90° up.
  A straight edge shows only the motion across itself. If an edge arrives
  at an angle, speed and direction are those across the edge.
  "reliable" means that the baseline was quiet, that at most 7 frames
  were filled, that the kind of touch is clear, and that speed and
  direction hold within their standard deviations.
  Light that never leaves, such as a lamp that is switched on, is a touch
  that does not end: no event follows. Start again then.
  A calibrated model says "known":false, without names, for a touch that
  is unlike those of its training. Other models always answer with one of
  their own textures. wstac model inspect says which a model is.
  A model needs about the frame rate that it was trained at. The models
  that come with wstac were trained at 30 frames per second.
  builtin:path-… take the sample along the path of the slide: they hold
  from 50 to 300 mm/s, in any direction, and need 28 mm of path;
  those that end in -16mm need 16 mm.
  builtin:taxel-path-… are right more often: they take 25 taxels instead
  of ten sums. They give no answer if a frame of the sample was lost.
  builtin is builtin:taxel-path-svm.
  builtin:svm, forest and boosted take the sample over time: they hold
  from 100 to 200 mm/s in four directions, and are often wrong elsewhere.
  With law = "published" under [speed], speed and direction are those of
  the publication: from the duration for which a slide is lit, in four
  directions, without a kind of touch, and a new event every 70 frames.
  Its speed law was fitted from 100 to 200 mm/s at 30 frames per second,
  for specimens of the published length (105 mm in the simulation).
  Answers outside are marked "extrapolated" and may be far off. For
  another length, fit the law to its slides (wstac.fit_speed in Python).

Output to a file or as a table:
  -o slide.jsonl, slide.csv or slide.txt says the form by its name, and
  --output-format says it for standard output or another name.
  slide.json has the records as one array. The file
  takes its name when the source ends, fails or is stopped with Ctrl-C.
  It is not there if a record cannot be written (a full disk).
  CSV has one kind of record: events, or with --features the features,
  or with --motion the motion of every frame. The first line has the
  names of JSON below, with _ between those of a field in a field:
  speed_mm_s, texture_specimen, why_speed. A length is place_mm with
  place_sd_mm, as in C and Python. Features are r1 to r5 and c1
  to c5, and every row has time_s. A field that JSON has not, or as
  null, is an empty cell. Faults and the end are notes on standard error.
    wstac run slide.mcap -o slide.csv
    python3 -c 'import pandas; print(pandas.read_csv("slide.csv"))'
  --since 2 --until 4 prints the records from 2 s on and before 4 s, by
  their time_s, as they are without the options: every frame from the
  first is read, so the baseline is the same. The end is printed, too,
  and says how many frames were read.

Output with --json, one object per line (wrapped here):
  {"kind":"features","frame":0,"time_ns":0,"f":[…10 numbers…]}
  {"kind":"motion","frame":51,"time_ns":1700000000,"time_s":1.7,
   "contact":"slide","speed":{"mm_s":148.0,"sd":6.1},
   "direction":{"deg":90.8,"sd":2.4}}
  {"kind":"event","frame":35,"frames":70,"time_ns":1533333333,
   "completed_ns":2066666666,"touch_frame":46,"end_frame":null,
   "time_s":1.5333,"completed_s":2.0667,
   "stamp":"2026-11-22T10:00:01.500Z","contact":"slide",
   "duration_frames":null,"speed":{"mm_s":150.2,"sd":1.3},
   "direction":{"deg":90.5,"sd":0.5},"basis":"edge","contacts":1,
   "texture":{"specimen":"Saw3",…,"confidence":0.97,"known":true},
   "frames_filled":0,"reliable":true}
  {"kind":"contact_end","frame":75,"event_frame":35,
   "time_ns":2500000000,"time_s":2.5}
  {"kind":"slip","frame":131,"time_ns":4366666666,"onset_frame":129,
   "held_since_frame":96,"strength":0.4}
  {"kind":"texture","frame":137,"time_ns":4566666666,"frames":40,
   "texture":{…}}
  {"kind":"incomplete","frame":300,"time_ns":10000000000,"frames":12}
  {"kind":"note","note":"default-layout","message":"…"}   also "rate"
  {"kind":"fault","frame":300,"time_ns":10000000000,
   "fault":"disconnected","message":"…"}
  {"kind":"end","frames":900,"dropped":0,"baseline":"complete",
   "incomplete":null,"time_ns":29966666666,"clock":"frames"}
  A texture also has pattern ("Saw") and depth_mm (3.0).
  With NAME=SOURCE, each object starts with "sensor":"NAME", and each
  sensor has its own end.
  time_ns     is the time of "frame" in nanoseconds, of an event that of
              its first touch, "touch_frame", and of the end that of
              the last frame. "clock" in the end record says by which
              clock. driver: the driver's monotonic clock, which all
              cameras of a machine share; recordings keep it. board: a
              board's clock, matched with the monotonic clock. frames:
              the source states no times, so they count from 0 by
              frame number and rate. A lost frame has a time between
              those of its neighbors. A fault comes before its frame,
              so its time is that of the frame before it and the rate.
              null: no frame came yet, or a board's clock is not known.
              With several camera frames in one, the first counts.
  readout_ms  in the end record is the time in which the camera reads its
              rows, as --readout, [sensor] or the source states it; null
              if none does, and then speeds allow for up to a frame. It is
              not there for a global shutter (0) and a board.
  stamp       is the wall-clock time of the same frame, in UTC. Only
              cameras, their recordings and boards have it; an event of
              another source has null. It is off by at most
              "stamp_within_ms" milliseconds.
  features    "f" has rows r1 to r5, then columns c1 to c5: natural logs,
              exact multiples of 1/2048.
  motion      is printed with --motion, for every frame while something
              slides and its speed is known.
  event       "frame" is the first of the sample, 10 before the window
              that fired. "touch_frame" is the first lit frame of the
              touch, "end_frame" the first dark one behind it, or null
              if the light has not left. "time_s" and "stamp" are the
              time of "touch_frame", "completed_s" and "completed_ns"
              that of the frame with which the answer was complete:
              seconds from the first frame, nanoseconds of the clock,
              and UTC where the source knows it. What only the end of
              the touch tells is null if that was before it. Its sample
              has 70 "frames". "sd" is a standard deviation.
              With the estimator "wave", "basis" is "edge" if an edge
              covers the sensor, so that only the motion across it is
              known, or else "outline". If 25 taxels tell the velocity,
              "place_mm" is the middle of the touch to the left of its
              motion, from the sensor's middle, and "width_mm" its width,
              each as {"value","sd"} and only if it is known. "contacts"
              counts objects side by side. "acceleration" of an edge has
              "mm_s2" and "sd". "period_mm" is that of the texture.
              speed, direction and texture are null if there is no
              answer, and "why" gives the reason. Its "reliable" says
              why the touch is unclear or the answers are not
              reliable, and its "texture" also if the speed is
              outside of those that a model that comes with wstac
              knows. Models of other classes answer with "class".
              "confidence" is the probability that the names are
              right if the texture is one of the training's.
              "known" is false for a sample that is unlike those of the
              training, by its texture or by its speed: then there are
              no names.
              Both are null for a model that does not tell.
              --samples adds "sample": 10 lists of 70 numbers like "f".
              With law = "published" the fields from "touch_frame" to
              "contact" are missing, "time_ns" is the time of "frame",
              "speed" has "extrapolated" and "direction" has
              "confidence" instead of "sd", and "speed_at_most" is an
              upper bound of the speed of an event that is cut off.
  contact_end says that the light of an event's touch has left.
  slip        says that a part that was pressed on and held begins to
              slip: "onset_frame" is the first frame with light of the
              motion, "held_since_frame" that of the press, or the one in
              which the last slip came to rest, and "strength" the most
              light of a frame since the onset as a fraction of that of
              the press. Only the estimator wave gives it.
  texture     is printed as soon as a model that needs fewer than 70
              frames has them. The event that follows has the same.
  incomplete  is an event that lost frames or the stream's end cut off.
  fault       does not end the source.
  note        comes first if nothing says where the taxels are: the
              configuration has no layout, and the source is no scene.
  end         "dropped" counts camera frames, "dropped_by" those of each
              reason if there are any. "baseline" is "incomplete"
              if the stream was too short for it. "incomplete" is
              {"frame","frames"} if the stream ended inside an event.
  Frames are counted from 0. Above 45 frames per second, round(fps/30)
  camera frames are added up to one.

Configuration (--config), every key optional; these are the defaults:
"#;

/// Returns the text at the end of `wstac run --help`.
fn help() -> String {
    let configuration = wstac_host::config::DEFAULT_CONFIGURATION.replace('\n', "\n  ");
    format!("{HELP}  {}", configuration.trim_end())
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let sensors = sensors(&arguments.sources)?;
    if sensors.len() > 1 && sensors.iter().any(|sensor| sensor.name.is_none()) {
        conflict("several sources need names, expected NAME=SOURCE for each");
    }
    if sensors.len() > 1 && arguments.save_raw.is_some() {
        conflict("--save-raw is for one source");
    }
    let form = form(arguments)?;
    let table = table(arguments, form);
    if arguments.samples && form != Form::Json {
        conflict(&format!("--samples needs JSON, expected --json: the records are {}", form.name()));
    }
    if let (Some(since), Some(until)) = (arguments.since, arguments.until)
        && since >= until
    {
        conflict(&format!("--since is {since} and --until is {until}, expected --since before --until"));
    }
    let is_board = |sensor: &SensorSpec<'_>| port_of(sensor.source).is_some();
    if (arguments.status || arguments.baud.is_some()) && !sensors.iter().any(is_board) {
        let subject = sensors[0].source.display();
        return Err(Error::new(Kind::Usage, subject, "is no board, expected no --status or --baud").into());
    }
    let outputs = Outputs::new(arguments.force).reading(&arguments.config).reading(&arguments.models);
    let outputs = sensors.iter().fold(outputs, |outputs, sensor| outputs.source(sensor.source));
    if let Some(file) = arguments.file() {
        outputs.check([file].into_iter().chain(arguments.save_raw.as_deref()))?;
    }
    let given = open_models(&arguments.models)?;
    let interrupted = signals::flag();
    let recorded = recorded(arguments, &sensors)?;
    let parts: Vec<_> =
        recorded.iter().map(|name| SensorSpec { name: Some(name), source: sensors[0].source }).collect();
    let is_recorded = !parts.is_empty();
    let sensors = if is_recorded { parts } else { sensors };
    let file = arguments.file().map(|path| outputs.create(path)).transpose()?;
    let has_names = sensors.iter().any(|sensor| sensor.name.is_some());
    let is_array = arguments.file().and_then(Path::extension).is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let destination = Destination::new(file, (form == Form::Csv).then(|| table.head(has_names)), is_array);
    let run = Run {
        arguments,
        form,
        table,
        destination: &destination,
        given: given.as_deref(),
        interrupted: &interrupted,
        is_recorded,
    };
    let read = match &sensors[..] {
        [only] => run.open(only).and_then(Opened::read),
        _ => run.all(&sensors),
    };
    let written = destination.finish()?;
    if let Some((path, records)) = written.filter(|_| !arguments.quiet) {
        note(format_args!("{}: {}", path.display(), counted(records, "record")));
    }
    read
}

/// Returns the names of a recording's sensors if all of them are to be read; none for other sources.
fn recorded(arguments: &Arguments, sensors: &[SensorSpec<'_>]) -> Result<Vec<String>, Error> {
    let [SensorSpec { name: None, source }] = sensors else { return Ok(Vec::new()) };
    let names = arguments.options.sensors_in(source)?;
    if !names.is_empty() && arguments.save_raw.is_some() {
        conflict("--save-raw is for one sensor, expected --sensor NAME");
    }
    Ok(names)
}

/// Returns the form of the records: the one that is given, or that of the file's name, or text.
fn form(arguments: &Arguments) -> Result<Form, Error> {
    let stated = arguments.output_format.or(arguments.json.then_some(Form::Json));
    let Some(path) = arguments.file() else { return Ok(stated.unwrap_or_default()) };
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    let named = ENDINGS.iter().find(|(_, endings)| endings.contains(&&*ending)).map(|(form, _)| *form);
    let refused = |message: String| Err(Error::new(Kind::Usage, path.display(), message));
    match (stated, named) {
        (Some(stated), Some(named)) if stated != named => {
            let given = if arguments.json { "--json".to_owned() } else { format!("--output-format {}", stated.name()) };
            refused(format!("its name ends in .{ending}, but {given} is given"))
        }
        (Some(form), None) => {
            let endings = ENDINGS.iter().find(|(known, _)| *known == form).map_or(&[][..], |(_, endings)| endings);
            check_ending(path, endings).map(|()| form)
        }
        (Some(form), _) | (None, Some(form)) => Ok(form),
        (None, None) => {
            refused("its name says no form, expected .jsonl, .json, .csv or .txt, or --output-format".to_owned())
        }
    }
}

const ENDINGS: [(Form, &[&str]); 3] =
    [(Form::Json, &["jsonl", "json", "ndjson"]), (Form::Csv, &["csv"]), (Form::Text, &["txt"])];

/// Returns the kind of record of a table: events, or the one that was asked for.
fn table(arguments: &Arguments, form: Form) -> Table {
    match (arguments.features, arguments.motion) {
        (true, true) if form == Form::Csv => {
            conflict("a CSV table has one kind of record, expected --features or --motion, or JSON for both");
            Table::Features
        }
        (true, _) => Table::Features,
        (false, true) => Table::Motion,
        (false, false) => Table::Events,
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds >= 0.0);
    seconds.ok_or_else(|| "expected seconds from the first frame on, such as 2.5".to_owned())
}

/// Ends the process because of arguments that contradict each other.
fn conflict(message: &str) {
    super::wrong_arguments(ErrorKind::ArgumentConflict, message).exit();
}
