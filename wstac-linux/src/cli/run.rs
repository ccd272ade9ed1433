//! `wstac run`: a source's events.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};

use super::output::{Form, Records, Stop, note};
use super::source_arguments::{SourceArguments, config_of};
use crate::error::Error;
use crate::model::file::ModelFile;
use crate::reading::{BASELINE_DISTURBED, Reading, Wanted};
use crate::source::{Delivery, Item, Source};
use crate::texture::Textures;

/// Print the tactile events of a source
///
/// Frames become 25 taxel sums, 10 log features, and events: samples of 70 frames around each contact, with sliding
/// speed and direction. The first 25 frames are the baseline: nothing may touch the sensor during them (0.8 s at
/// 30 frames a second). Ctrl-C ends a camera.
#[derive(Debug, clap::Args)]
#[command(after_long_help = help())]
pub(super) struct Arguments {
    /// /dev/videoN, scene:Saw3@150[,90deg][,seed=N], scene:FILE.toml, FILE.y4m, - (Y4M on standard input), a folder of
    /// PNGs, or FILE.mcap
    source: String,

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

    /// End after this many frames
    #[arg(long, value_name = "N")]
    frames: Option<u64>,

    /// Write the bytes of every frame, as they are summed (JPEG and PNG decoded), to a new file; lost frames leave no
    /// bytes
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
                   configuration unless --config gives another
  FOLDER           its PNGs, 2.png before 10.png; 30 frames a second unless --fps says otherwise
  Exit code: 1 where a source or file cannot be used, 2 for wrong arguments, otherwise 0.

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
  {"kind":"end","frames":900,"dropped":0,"baseline":"complete","incomplete":null}
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
    let configuration = super::DEFAULT_CONFIGURATION.replace('\n', "\n  ");
    format!("{HELP}  {}", configuration.trim_end())
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let (mut source, info) = arguments.options.open(&arguments.source, Delivery::Newest)?;
    let config = config_of(source.as_ref(), arguments.config.as_deref())?;
    let wanted = Wanted { features: arguments.features, samples: arguments.samples };
    let files = arguments.models.iter().map(|name| ModelFile::open(name)).collect::<Result<Vec<_>, _>>()?;
    let mut reading = Reading::new(&info, &config, wanted)?.with_textures(Textures::new(&files)?);
    note(&info.about);
    if info.rate.frames_added() > 1 {
        note(format_args!("{} camera frames are added up to one feature frame", info.rate.frames_added()));
    }
    if info.taxels_only && arguments.save_raw.is_some() {
        return Err(Error::new(&info.about, "--save-raw needs frames, expected fidelity = \"rendered\"").into());
    }
    let interrupted = interruptions()?;
    let raw = arguments.save_raw.as_deref().map(RawFile::create).transpose()?;
    let form = if arguments.json { Form::Json } else { Form::Text };
    let mut records = Records::new(form);
    read(source.as_mut(), &mut reading, &mut records, raw, arguments.frames, &interrupted)
}

/// Reads until the source ends or fails, `limit` frames have passed, or a signal asks for the end. Whatever happens,
/// the end record is written.
fn read(
    source: &mut dyn Source,
    reading: &mut Reading<'_>,
    records: &mut Records,
    mut raw: Option<RawFile>,
    limit: Option<u64>,
    interrupted: &AtomicBool,
) -> Result<(), Stop> {
    let mut seen = 0;
    let mut reasons = LossReport::default();
    let result = loop {
        if interrupted.load(Ordering::Relaxed) || limit.is_some_and(|limit| seen >= limit) {
            reading.finish(|record| records.write(&record))?;
            break Ok(());
        }
        let item = match source.next() {
            Ok(item) => item,
            Err(error) => {
                // The source's error is the one that matters, whatever becomes of the end record.
                let _ = reading.finish(|record| records.write(&record));
                break Err(error.into());
            }
        };
        match &item {
            Item::Frame { bytes, .. } => {
                seen += 1;
                if let Some(error) = raw.as_mut().and_then(|raw| raw.write(bytes).err()) {
                    reading.finish(|record| records.write(&record))?;
                    break Err(error.into());
                }
            }
            Item::Taxels(_) => seen += 1,
            Item::Lost { frames, why } => {
                seen += frames;
                reasons.add(*frames, why);
            }
            Item::Fault(_) | Item::Waiting | Item::End => {}
        }
        if !reading.take(&item, |record| records.write(&record))? {
            break Ok(());
        }
        if reading.baseline_disturbed() {
            note(BASELINE_DISTURBED);
        }
    };
    reasons.say();
    result
}

/// Why frames were lost, counted by reason, said once at the end.
#[derive(Default)]
pub(super) struct LossReport(Vec<(&'static str, u64)>);

impl LossReport {
    pub(super) fn add(&mut self, frames: u64, why: &'static str) {
        match self.0.iter_mut().find(|(reason, _)| *reason == why) {
            Some((_, count)) => *count += frames,
            None => self.0.push((why, frames)),
        }
    }

    pub(super) fn say(&self) {
        for (why, count) in &self.0 {
            note(format_args!("{count} frame(s) lost: {why}"));
        }
    }
}

/// The file that `--save-raw` names.
struct RawFile {
    file: File,
    path: PathBuf,
}

impl RawFile {
    /// Creates it, and never writes over another.
    fn create(path: &Path) -> Result<Self, Error> {
        let file = File::create_new(path).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => Error::new(path.display(), "exists already, expected a new file"),
            _ => Error::new(path.display(), error),
        })?;
        Ok(Self { file, path: path.to_owned() })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.file.write_all(bytes).map_err(|error| Error::new(self.path.display(), error))
    }
}

/// A flag that the first Ctrl-C or SIGTERM sets; a second one ends the process at once.
pub(super) fn interruptions() -> Result<Arc<AtomicBool>, Error> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&flag))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&flag)))
            .map_err(|error| Error::new("signals", error))?;
    }
    Ok(flag)
}
