//! `wstac run`: the events of one source, or of several at once.

mod read;
mod sensors;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use clap::error::ErrorKind;
use signal_hook::consts::{SIGINT, SIGTERM};

use self::read::Run;
use self::sensors::sensors;
use super::output::Stop;
use super::source_arguments::SourceArguments;
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;

/// Print the tactile events of a source
///
/// Frames become 25 taxel sums, 10 log features, and events: samples of 70 frames around each contact, with sliding
/// speed and direction. The first 25 frames are the baseline: nothing may touch the sensor during them (0.8 s at
/// 30 frames a second). Ctrl-C ends a camera.
#[derive(Debug, clap::Args)]
#[command(after_long_help = help())]
pub(super) struct Arguments {
    /// /dev/videoN, scene:Saw3@150[,90deg][,seed=N], scene:FILE.toml, FILE.y4m, - (Y4M on standard input), a
    /// folder of PNGs, or FILE.mcap; or several, each as cam:NAME=SOURCE
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<String>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model file (wstac model --help), or with builtin:svm, builtin:forest or builtin:boosted, which
    /// were trained on simulated slides; once for each model, where specimens, patterns and depths have their own
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Print JSON Lines instead of text
    #[arg(long)]
    json: bool,

    /// Print the ten features of every frame, too
    #[arg(long)]
    features: bool,

    /// Print every event's sample, 10 × 70 numbers, too (with --json)
    #[arg(long, requires = "json")]
    samples: bool,

    #[command(flatten)]
    options: SourceArguments,

    /// End after this many frames, lost ones included; of several sources, after as many of each
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,

    /// Write the bytes of every frame, as they are summed (JPEG and PNG decoded), to a new file; lost frames leave no
    /// bytes. One source only
    #[arg(long, value_name = "FILE")]
    save_raw: Option<PathBuf>,
}

const HELP: &str = r#"Sources:
  /dev/videoN      a V4L2 camera (wstac devices lists them): --format, --size and --fps choose
                   among what it offers
  scene:Saw3@150   a simulated slide: Fla0, or Sin, Saw or Tri with a depth of 2, 3 or 4 mm, at
                   1 to 1000 mm/s, then any of ,0deg ,90deg ,180deg ,270deg and ,seed=N
  scene:FILE.toml  the same from a file, with every property of specimen, whiskers, light and
                   camera (wstac scene --help lists them), or several slides
  FILE.y4m, -      Y4M; for other videos:
                   ffmpeg -i FILE -pix_fmt yuv420p -f yuv4mpegpipe - | wstac run -
  FILE.mcap        a recording (wstac record): the very events of the recorded run, with its
                   configuration unless --config gives another; textures only with --model, also
                   where it was recorded with models (which is said then)
  FOLDER           its PNGs, 2.png before 10.png; 30 frames a second unless --fps says otherwise
  cam:NAME=SOURCE  any of these under a name, several at once (a name has letters, digits, - and
                   _): wstac run cam:left=/dev/video0 cam:right=/dev/video2
                   Options, configuration and models are those of all. Each has its own
                   baseline, frames and end; where one fails, the others go on to their ends.
  Exit code: 1 where a source or file cannot be used, 2 for wrong arguments, otherwise 0.

A camera on a bad day:
  Where the program is slower than the camera, older frames are skipped for the newest and
  count as lost, so that time does not shift (not with --save-raw: every frame counts there).
  Where the stream breaks off (unplugged, a failed stream, silence), it waits for the same
  camera, by its serial number or its place, starts it as it was and goes on; the time that
  passed counts as lost frames. Each is told as a fault, once: "disconnected", "reconnected",
  "refused" (it is there and does not start yet), "no-signal", "signal", "slow" (fewer than 90 %
  of the frames agreed on), "in-time", "controls" (other values than before the break).
  A camera that comes back with another format, size or rate ends the stream, exit code 1.

What the answers mean:
  An event is a sample of 70 frames (2.3 s at 30 frames a second). A slide that lasts
  longer, one slower than about 70 mm/s, is cut, or becomes several events: their speeds,
  bounds and directions may be wrong.
  Speed was fitted from 100 to 200 mm/s, for specimens about as long as the paper's (105 mm
  in the simulation) at 30 frames a second; one frame is 4 % of it. An answer outside is
  marked "extrapolated" and may be far off. Another length: [speed] law = "physical", with
  track_mm its length and the whiskers' span of 16 mm.
  Directions are counter-clockwise in the picture: 0° is right, 90° up.
  "reliable" says that the baseline was quiet and that at most 7 frames were filled, no
  more.
  A texture is always one of the model's, however little of it was seen: what is none of
  them, or no longer whole, is named all the same. Do not rely on that of a cut-off event
  (no speed, and "why" says so). A model knows slides at about the rate that it was trained
  at, those that come with wstac at 30 frames a second.

Output with --json, one object a line:
  {"kind":"features","frame":0,"f":[…10 numbers…]}
  {"kind":"event","frame":137,"frames":70,"duration_frames":38,
   "speed":{"mm_s":102.0,"extrapolated":false},"direction":{"deg":90,"confidence":0.93},
   "texture":{"specimen":"Saw3","pattern":"Saw","depth_mm":3.0},
   "frames_filled":0,"reliable":true}
  {"kind":"texture","frame":137,"frames":40,"texture":{…}}
  {"kind":"incomplete","frame":300,"frames":12}     an event that a gap of lost frames ended
  {"kind":"fault","frame":300,"fault":"disconnected","message":"…"}     the source goes on
  {"kind":"end","frames":900,"dropped":0,"baseline":"complete","incomplete":null}
  With cam:NAME=SOURCE, each starts with "sensor":"NAME", and each sensor has its end.
  "f" is five rows, then five columns: natural logarithms, exact multiples of 1/2048.
  --samples adds "sample" to events: 10 lists of 70 such numbers.
  "frame" of an event is the first of its sample, 10 before the window that fired. Frames
  are counted from 0; above 45 a second, round(fps/30) camera frames are added up to one.
  "dropped" counts camera frames.
  speed, direction.deg and texture are null where there is no answer, and "why" says why.
  "texture" has null for what no model tells, and "class" from models of other classes. A
  record of that kind comes as soon as a model's frames have arrived, where the model needs
  fewer than 70; the event that follows says the same.
  "speed_at_most" is what the law makes of the part of a cut-off event that was seen.
  "baseline" is "incomplete" where the stream was too short for it; "incomplete" is
  {"frame","frames"} where the stream ended inside an event.

Configuration (--config), every key optional; these are the defaults:
"#;

/// What `wstac run --help` ends with.
fn help() -> String {
    let configuration = wstac_host::config::DEFAULT_CONFIGURATION.replace('\n', "\n  ");
    format!("{HELP}  {}", configuration.trim_end())
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let sensors = sensors(&arguments.sources)?;
    if sensors.len() > 1 && sensors.iter().any(|sensor| sensor.name.is_none()) {
        conflict("several sources need names, expected cam:NAME=SOURCE for each");
    }
    if sensors.len() > 1 && arguments.save_raw.is_some() {
        conflict("--save-raw is for one source");
    }
    let files = ModelFile::open_all(&arguments.models)?;
    let interrupted = Arc::new(AtomicBool::new(false));
    let run = Run { arguments, files: &files, interrupted: &interrupted };
    if let [only] = &sensors[..] {
        let opened = run.open(only)?;
        // Not before: opening a pipe that nobody writes to ends with the first Ctrl-C.
        on_interruption(&interrupted)?;
        return opened.read();
    }
    on_interruption(&interrupted)?;
    run.all(&sensors)
}

/// Ends the process: arguments that do not go together.
fn conflict(message: &str) {
    clap::Error::raw(ErrorKind::ArgumentConflict, format_args!("{message}\n")).exit();
}

/// A flag that the first Ctrl-C or SIGTERM sets; a second one ends the process at once.
pub(super) fn interruptions() -> Result<Arc<AtomicBool>, Error> {
    let flag = Arc::new(AtomicBool::new(false));
    on_interruption(&flag)?;
    Ok(flag)
}

/// The number of the first SIGINT or SIGTERM, 0 before; a second one ends the process at once.
pub(super) fn signals() -> Result<Arc<AtomicUsize>, Error> {
    interruptions()?;
    let number = Arc::new(AtomicUsize::new(0));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register_usize(signal, Arc::clone(&number), signal as usize)
            .map_err(|error| Error::new("signals", error))?;
    }
    Ok(number)
}

fn on_interruption(flag: &Arc<AtomicBool>) -> Result<(), Error> {
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(flag))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(flag)))
            .map_err(|error| Error::new("signals", error))?;
    }
    Ok(())
}
