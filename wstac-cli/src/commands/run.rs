//! `wstac run` prints the events of one source, or of several at once.

mod no_event;
mod range;
mod read;

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{Arg, ArgAction};

use self::read::{Reading, Run};
use super::csv::Table;
use super::files::{Outputs, check_ending, ends};
use super::output::{Stop, note};
use super::records::{Destination, Form};
use super::signals;
use super::source_arguments::{SourceArguments, open_models};
use super::values::{at_least, within};
use wstac_host::error::{Error, ErrorKind as Kind};
use wstac_host::monitor::port::port_of;
use wstac_host::plural::counted;
use wstac_host::source::names::{SensorSpec, sensors};

/// Print the tactile events of a source
///
/// Frames become 25 taxel sums, ten features and events. An event has the kind of a touch, and speed and direction of
/// what slides, as soon as they are certain: often half a second after the first light, at the latest after 70 frames.
/// The first 25 frames (0.8 s at 30 frames per second) are the baseline: nothing may touch the sensor during them.
/// Ctrl-C ends a camera.
#[derive(Debug, Default, clap::Args)]
#[command(disable_help_flag = true, arg = help_flag(), after_help = help())]
#[expect(clippy::struct_excessive_bools, reason = "each is an argument of its own")]
pub(super) struct Arguments {
    /// Camera, recording, scene or board, or several as NAME=SOURCE
    ///
    /// Sources are /dev/videoN, rpicam:, scene:Saw3@150[,90deg][,60mm][,seed=N], scene:FILE.toml, FILE.y4m, - (Y4M on
    /// standard input), FILE.mcap, a video such as FILE.mp4, a folder of pictures, and a board such as /dev/ttyACM0;
    /// see wstac help sources.
    #[arg(required = true, value_name = "SOURCE")]
    pub(super) sources: Vec<OsString>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    ///
    /// It is builtin, the best of those that were trained on simulated slides, another name of wstac model list --all,
    /// a file (see wstac model --help), or none. Give one for each of specimens, patterns and depths if they have
    /// models of their own. By default, a scene has builtin if [speed] estimator is "wave", at about 30 processed
    /// frames per second.
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Print JSON Lines; short for --output-format json
    #[arg(long, conflicts_with = "output_format")]
    pub(super) json: bool,

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
    pub(super) features: bool,

    /// Also print speed and direction of every frame while something slides
    ///
    /// For most slides (docs/ANSWERS.md), the first is printed at most three frames after the leading edge has crossed
    /// all whiskers. Of a ball, coin, corner or narrow block one is printed, as soon as it has left.
    #[arg(long)]
    pub(super) motion: bool,

    /// Also print the sample of every event, 10 × 70 numbers (JSON only)
    ///
    /// Events come after 70 frames then.
    #[arg(long)]
    pub(super) samples: bool,

    /// Also report a board's state about once per second, on standard error
    ///
    /// It says how long the board runs, its frame rate, overruns, restarts, stack and temperature, as far as
    /// the board knows them.
    #[arg(long)]
    pub(super) status: bool,

    /// Bits per second of a board's serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    pub(super) baud: Option<u32>,

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
    #[arg(long, value_name = "SECONDS", value_parser = seconds())]
    since: Option<f64>,

    /// Print only records before this time, in seconds of the source
    ///
    /// Reading ends when no record before this time can follow: after the last sample and the last touch that began
    /// before it.
    #[arg(long, value_name = "SECONDS", value_parser = seconds())]
    until: Option<f64>,

    /// Take the baseline from the frames at this time, in seconds
    ///
    /// It is for a file that is touched in its first 25 frames: the file is read twice, first to this time, where
    /// nothing may touch the sensor for 25 frames. Touches that begin in the first 10 frames are not whole. Cameras,
    /// boards, pipes and standard input can be read only once.
    #[arg(long, value_name = "SECONDS", value_parser = seconds())]
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
  /dev/videoN      a V4L2 camera (wstac devices lists them)
  rpicam:          a Raspberry Pi's camera; rpicam:1 is the second
  scene:Saw3@150   a simulated slide: Fla0, or Sin, Saw or Tri with a
                   depth of 2, 3 or 4 mm; then @ and 1 to 1000 mm/s;
                   then any of ,90deg ,60mm ,seed=N
  scene:FILE.toml  simulated touches of any kind (wstac help scene)
  FILE.y4m, -      Y4M, from a file or standard input
  FILE.mp4         a video that ffmpeg decodes, also .mkv, .mov and others
  FILE.mcap        a recording of wstac record
  FOLDER           PNG or JPEG files of one size
  /dev/ttyACM0     a board at a serial device; also tcp:HOST:PORT, and a
                   file with the bytes that a board sent
  NAME=SOURCE      any of these with a name, to read several at once
  wstac help sources describes each, and how faults are handled.

Answers:
  An event is one touch: a slide, a press, a poke, or unclear. Only a slide
  has speed, direction and texture. 0° is to the right along the sensor's
  rows, 90° up. "reliable" means that most speeds and directions hold
  within their standard deviations. A part that slips in a grasp is a
  slip, while the touch lasts.
  wstac help answers says more, also about models.

Output:
  -o slide.jsonl, slide.json, slide.csv or slide.txt says the form by its
  name. wstac help json describes tables and every field of JSON.
  Exit code: 1 if a source or file cannot be used or no frame of it can, 2
  for wrong arguments, otherwise 0, also after Ctrl-C.

Configuration:
  These are the most used keys; wstac help config has all.

@@KEYS@@
More:
  wstac help run says more about each option.
"#;

/// Returns the text at the end of `wstac run --help`.
fn help() -> String {
    HELP.replace("@@KEYS@@\n", &super::topics::keys(&["preset", "margin", "readout_ms", "estimator"]))
}

/// Returns the options `-h` and `--help`, which print one line an option; `wstac help run` describes each.
fn help_flag() -> Arg {
    Arg::new("help").short('h').long("help").action(ArgAction::HelpShort).help("Print help").display_order(999)
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let sensors = sensors(&arguments.sources)?;
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
        return Err(Error::new(Kind::Usage, subject, "is no board; leave --status and --baud out").into());
    }
    let outputs = Outputs::new(arguments.force).reading(&arguments.config).reading(&arguments.models);
    let outputs = sensors.iter().fold(outputs, |outputs, sensor| outputs.source(sensor.source));
    if let Some(file) = arguments.file() {
        outputs.check([file].into_iter().chain(arguments.save_raw.as_deref()))?;
    }
    let given = open_models(&arguments.models)?;
    let interrupted = signals::flag();
    let sensors = arguments.options.every_sensor(&sensors)?;
    if sensors.len() > 1 && arguments.save_raw.is_some() {
        conflict("--save-raw is for one sensor: give one source, or --sensor NAME of a recording");
    }
    let file = arguments.file().map(|path| outputs.create(path)).transpose()?;
    let has_names = sensors.iter().any(|sensor| sensor.name.is_some());
    let is_array = arguments.file().is_some_and(|path| ends(path, "json"));
    let destination = Destination::new(file, (form == Form::Csv).then(|| table.head(has_names)), is_array);
    let run =
        Run { arguments, form, table, destination: &destination, given: given.as_deref(), interrupted: &interrupted };
    let read = match &sensors[..] {
        [only] => run.open(only).and_then(Reading::read),
        _ => run.all(&sensors),
    };
    let written = destination.finish()?;
    if let Some((path, records)) = written.filter(|_| !arguments.quiet) {
        note(format_args!("{}: {}", path.display(), counted(records, "record")));
    }
    read
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

fn seconds() -> impl Fn(&str) -> Result<f64, String> + Clone {
    within(0.0..=f64::MAX, "seconds from the first frame on, such as 2.5")
}

/// Ends the process because of arguments that contradict each other.
fn conflict(message: &str) {
    super::wrong_arguments(ErrorKind::ArgumentConflict, message).exit();
}
