//! `wstac calibrate` finds the whiskers in the picture and writes them as a configuration file.

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use serde::Serialize;

use super::files::Outputs;
use super::output::{Stop, note, print_json, stdout};
use super::progress::OverwrittenLine;
use super::signals::{Ending, check, finishing};
use super::source_arguments::SourceArguments;
use super::values::at_least;
use wstac_core::green::any::Any;
use wstac_core::taxels::FrameGeometry;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::monitor::pictures::BoardPictures;
use wstac_host::monitor::port::port_of;
use wstac_host::plural::counted;
use wstac_host::source::{Frame, FramePolicy, Source, SourceEvent, StreamInfo};
use wstac_host::text_file::file_text;
use wstac_setup::calibrate::{Calibration, DIM, UNTOUCHED, Watch};
use wstac_setup::crosstalk::{Crosstalk, CrosstalkWatch};
use wstac_setup::gains::{self, GainsWatch};

/// Find the 25 whiskers in the picture and write a configuration
///
/// Do not touch the sensor for the first 25 frames (0.8 s). Then press on all whiskers, or slide something over all of
/// them. Each base that glows becomes a taxel. Presses also tell the readout. Ctrl-C ends a camera earlier.
#[derive(Debug, Default, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is an argument of its own")]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// A camera, a recording or a scene, as for wstac run, or a board
    ///
    /// A board is a serial device or tcp:HOST:PORT, or a file with bytes that a board sent. It sends pictures slowly.
    source: OsString,

    /// The configuration file to write, for --config; with --crosstalk or --gains, the one to change
    #[arg(short, long, value_name = "FILE.toml")]
    output: PathBuf,

    /// Measure the cross-talk between taxels, through the layout of FILE.toml, and write it there
    ///
    /// After the untouched frames, touch each whisker alone with a thin tip, in any order.
    #[arg(long, conflicts_with = "overlay")]
    crosstalk: bool,

    /// Measure the gains of whiskers, through the layout of FILE.toml, and write them there
    ///
    /// After the untouched frames, slide a block with teeth of 4 mm (Saw4) over all whiskers three times.
    #[arg(long, conflicts_with_all = ["overlay", "crosstalk"])]
    gains: bool,

    /// The picture to write: the spots that glowed, and the taxels
    ///
    /// By default, it is the configuration's name with the ending .png.
    #[arg(long, value_name = "FILE.png")]
    overlay: Option<PathBuf>,

    /// End after this many frames: 600, or 18000 with --crosstalk or --gains
    #[arg(long, value_name = "N", value_parser = at_least(30_u64))]
    frames: Option<u64>,

    /// Overwrite existing files
    #[arg(long)]
    force: bool,

    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,

    /// Bits per second of a board's serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    baud: Option<u32>,

    #[command(flatten)]
    options: SourceArguments,
}

impl Arguments {
    /// Returns those of a calibration that writes this configuration.
    pub(super) fn of(source: OsString, output: PathBuf, options: SourceArguments) -> Self {
        Self { source, output, options, ..Self::default() }
    }
}

const NO_READOUT: &str = "no presses tell the readout, or they were too fast or too slow, or other touches hid them; if the \
                          camera has a rolling shutter, press only (slides do not tell it): a flat plate on all whiskers within \
                          20 to 300 ms, hold it, and let go, three times; without a readout, deviations allow for any";

const HELP: &str = r#"Pictures that can be used:
  It may be turned by up to 15 degrees, seen in perspective or through a
  curved lens, and have uneven or ambient light. One whisker may have no
  light: its place follows from the others. Row 1 is on top in the
  picture, and column 1 is on the left.

Refusals:
  If the answer is not certain, no configuration is written. The command
  gives the reason and ends with exit code 1. Reasons are: fewer than 24
  whiskers; spots that are no lattice of 5 x 5, that the edge of the
  picture cuts, that run into each other or that reach full scale; a
  sensor that was touched too early.
  A picture shows the reason: FILE.refused.png, which the next try
  replaces, or the file that --overlay names.

The readout of a rolling shutter:
  Press a flat plate within 20 to 300 ms on all whiskers, hold it
  for half a second, and let go; do so three times. A press and its
  release tell the time from the first to the last row of the picture,
  which is written as [sensor] readout_ms. It is left out if presses are
  too fast, too weak or differ by more than 1 ms. Slides do not tell it,
  and take no part; lift what pressed before you slide it.

Boards:
  A board sends a picture in parts while it goes on finding events. One
  picture of 320 x 240 takes 8 s at 115200 bits per second, so the 25
  untouched ones take 3 minutes: standard error reports each. Then press
  on all whiskers, and hold until 5 or more pictures have come. A slide
  is too fast for such pictures.

The overlay picture:
  White rings are spots that seemed to be whiskers, orange rings are
  other spots. After a calibration, each taxel has its row and column.
  A dashed orange taxel is the whisker without light.

Cross-talk:
  A taxel also sees a part of its neighbors' light, which biases speeds.
  --crosstalk measures it: standard error names each whisker whose light
  is enough. When all 25 are named, the recording may end, or Ctrl-C.
  [layout] crosstalk of FILE.toml is written, and nothing else of it is
  changed. If a whisker was not touched alone, nothing is written. The
  room's light must not change. A board's pictures are too slow for it.
  Calibrate again after the camera was moved: first without --crosstalk.

Gains:
  Textures are known by how light differs between whiskers. --gains tells
  those of the sensor and the camera: slide a block with teeth of 4 mm
  (Sin4, Saw4 or Tri4) over all whiskers three times, at any speed and
  in any direction, then Ctrl-C. [layout] gains of FILE.toml is written.
  Measure cross-talk first. If slides do not agree, slide again.

The configuration:
  It has the layout, and keys that follow from the noise of the untouched
  frames, each with a comment: [features] floor_levels, [trigger] margin,
  [speed] threshold and threshold_on. All other keys keep their defaults;
  add what you like. It is valid for frames of the same size (others are
  refused), until the camera or the sensor is moved.

Output with --json, one object (wrapped here):
  {"kind":"calibration","found":25,"dead":null,"off_px":0.21,
   "pitch_px":[144.0,143.9],"rotation_degrees":0.1,"taxel":[90,90],
   "centres":[[351.4,71.5], … 25 in all, row by row],
   "saturated":0,"noise_levels":0.005,"dark_levels":1.0,
   "readout_ms":20.1,"readout_sd_ms":0.3}
  dead is null or [row, column]. off_px is the root mean square distance
  of the bases from a smooth lattice. readout_ms and its deviation are
  null if no presses told them.
  With --crosstalk: {"kind":"crosstalk","largest":0.05,"taxel":[1,2],
  "whisker":[1,1]}, the largest fraction and where it is.
  With --gains: {"kind":"gains","gains":[0.97,1.04, … 25 in all]}.

Examples:
  wstac calibrate scene:Fla0@100 -o wstac.toml
  wstac calibrate scene:press.toml -o wstac.toml
  wstac calibrate /dev/video0 -o wstac.toml
  wstac calibrate /dev/ttyACM0 -o board.toml
  wstac calibrate /dev/video0 --crosstalk -o wstac.toml
  wstac calibrate /dev/video0 --gains -o wstac.toml
  wstac run /dev/video0 --config wstac.toml
  A scene that is turned needs room at its edges: set rotation_degrees to
  8 and scale to 0.75 in [sensor.pose] (see wstac scene --help).
  A scene's default press is too fast to tell a readout. This press.toml
  tells 20 ms:
    [sensor]
    readout_ms = 20
    [[touch]]
    kind = "press"
    approach = 80
"#;

/// The output of `--json`.
#[derive(Serialize)]
struct Record<'a> {
    kind: &'static str,
    found: usize,
    dead: Option<[usize; 2]>,
    off_px: f64,
    pitch_px: [f64; 2],
    rotation_degrees: f64,
    taxel: [u16; 2],
    // The output keeps this name.
    #[serde(rename = "centres")]
    centers: &'a [[f64; 2]],
    saturated: usize,
    noise_levels: f64,
    dark_levels: f64,
    readout_ms: Option<f64>,
    readout_sd_ms: Option<f64>,
}

/// The output of `--crosstalk --json`.
#[derive(Serialize)]
struct CrosstalkRecord {
    kind: &'static str,
    largest: f64,
    taxel: [usize; 2],
    whisker: [usize; 2],
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    if arguments.crosstalk {
        return crosstalk(arguments);
    }
    if arguments.gains {
        return gains(arguments);
    }
    find(arguments, None::<fn() -> Result<(), Error>>)
}

/// Finds the whiskers. `make_folder` is called before the first frame is read, if the source can be opened.
pub(super) fn find(arguments: &Arguments, make_folder: Option<impl FnOnce() -> Result<(), Error>>) -> Result<(), Stop> {
    let output = arguments.output.as_path();
    let outputs = Outputs::new(arguments.force).source(&arguments.source);
    let overlay = arguments.overlay.clone().unwrap_or_else(|| output.with_extension("png"));
    if overlay == output {
        let message = "is the name of both configuration and picture, expected two names";
        return Err(Error::new(ErrorKind::Usage, output.display(), message).into());
    }
    match &make_folder {
        None => outputs.check([output, &overlay])?,
        Some(_) => [output, &overlay].into_iter().try_for_each(Outputs::check_room)?,
    }
    if arguments.options.readout.is_some() {
        let message = "--readout is what this command measures; leave it out, or write [sensor] readout_ms yourself";
        return Err(Error::new(ErrorKind::Usage, arguments.source.display(), message).into());
    }
    let (mut source, info) = open(arguments)?;
    let is_part = make_folder.is_some();
    if let Some(make_folder) = make_folder {
        make_folder()?;
        outputs.check([output, &overlay])?;
    }
    note(&info.about);
    let mut watch = Watch::new(&info)?;
    let is_board = port_of(&arguments.source).is_some();
    // Every picture of a board is shown: they are slow.
    let (progress, every) = (OverwrittenLine::new(), if is_board { 1 } else { 15 });
    let lost = read(source.as_mut(), arguments.frames.unwrap_or(600), |event, frames| match event {
        SourceEvent::Frame(Frame { bytes, .. }) => {
            watch.take(bytes);
            if is_board {
                // Its pictures are no frames in a row.
                watch.lose(1);
            }
            if progress.is_terminal && frames.is_multiple_of(every) {
                progress.write(state_of(&watch, frames));
            }
        }
        SourceEvent::Lost { frames, .. } => watch.lose(*frames),
        _ => {}
    })?;
    drop(progress);
    note_lost(lost);
    // A signal ends all of `characterize`, of which this is a part; alone, it calibrates with what was seen.
    if is_part {
        check()?;
    }
    let outcome = watch.calibrate();
    let calibration = match &outcome.result {
        Ok(calibration) => calibration,
        Err(refusal) => {
            // The next try replaces this picture.
            let unnamed = || (output.with_extension("refused.png"), Outputs::new(true).source(&arguments.source));
            let (picture, outputs) = arguments.overlay.clone().map_or_else(unnamed, |overlay| (overlay, outputs));
            outputs.write(&picture, outcome.to_png())?;
            let seen = format_args!("{}; {} shows what was seen", refusal.message, picture.display());
            return Err(Error::new(ErrorKind::Data, arguments.source.display(), seen).into());
        }
    };
    outputs.write(&overlay, outcome.to_png())?;
    let text = calibration.to_toml(&info.about);
    // A configuration that cannot be read again is not written.
    Config::parse(&text).map_err(|error| error.about(output.display()))?;
    outputs.write(output, text)?;
    note(format_args!("wrote {} and {}: look at the picture", output.display(), overlay.display()));
    print(calibration, arguments.json)
}

/// Opens the source: a board, or any other.
fn open(arguments: &Arguments) -> Result<(Box<dyn Source>, StreamInfo), Stop> {
    let Some(port) = port_of(&arguments.source) else {
        if arguments.baud.is_some() {
            let message = "is no board; leave --baud out";
            return Err(Error::new(ErrorKind::Usage, arguments.source.display(), message).into());
        }
        return Ok(arguments.options.open(&arguments.source, FramePolicy::Every)?);
    };
    arguments.options.expect_none(&arguments.source)?;
    let board = BoardPictures::open(port, arguments.baud)?;
    let info = board.info().clone();
    Ok((Box::new(board), info))
}

/// Measures a key of `[layout]` through the layout of the configuration, and writes it there.
///
/// `take` has each event, and `found` returns what was measured.
fn layout_key<W, T>(
    arguments: &Arguments,
    watch: impl FnOnce(FrameGeometry<Any>) -> W,
    mut take: impl FnMut(&mut W, &SourceEvent<'_>),
    found: impl FnOnce(&W) -> Result<T, String>,
    (key, written): (&str, impl FnOnce(&T, &str) -> Result<String, Error>),
) -> Result<T, Stop> {
    let (config, output) = (Config::read_stored(&arguments.output)?, arguments.output.as_path());
    let outputs = Outputs::new(true).source(&arguments.source);
    outputs.check([output])?;
    let (mut source, info) = open(arguments)?;
    note(&info.about);
    let mut watch = watch(config.geometry(&info)?);
    let lost = read(source.as_mut(), arguments.frames.unwrap_or(18_000), |event, _| take(&mut watch, event))?;
    note_lost(lost);
    let found = found(&watch).map_err(|message| Error::new(ErrorKind::Data, arguments.source.display(), message))?;
    let text = written(&found, &file_text(output)?).map_err(|error| error.about(output.display()))?;
    outputs.write(output, text)?;
    note(format_args!("wrote [layout] {key} of {}", output.display()));
    Ok(found)
}

/// Measures the cross-talk, and writes it to the configuration.
fn crosstalk(arguments: &Arguments) -> Result<(), Stop> {
    let mut known = 0;
    let take = |watch: &mut CrosstalkWatch, event: &SourceEvent<'_>| {
        if let Some(taxel) = watch.take(event) {
            known += 1;
            note(format_args!("{known} of 25 whiskers: row {}, column {}", taxel / 5 + 1, taxel % 5 + 1));
        }
    };
    let key = ("crosstalk", Crosstalk::written_to);
    let found = layout_key(arguments, CrosstalkWatch::new, take, CrosstalkWatch::crosstalk, key)?;
    if !arguments.json {
        return Ok(writeln!(stdout(), "{found}")?);
    }
    let (largest, taxel, whisker) = found.largest;
    let [taxel, whisker] = [taxel, whisker].map(|at| [at / 5 + 1, at % 5 + 1]);
    print_json(&CrosstalkRecord { kind: "crosstalk", largest, taxel, whisker })
}

/// Measures the gains, and writes them to the configuration.
fn gains(arguments: &Arguments) -> Result<(), Stop> {
    let take = |watch: &mut GainsWatch, event: &SourceEvent<'_>| {
        watch.take(event).into_iter().for_each(|slides| note(counted(slides, "slide")));
    };
    let found = layout_key(arguments, GainsWatch::new, take, GainsWatch::gains, ("gains", gains::written_to))?;
    if arguments.json {
        return print_json(&serde_json::json!({ "kind": "gains", "gains": found.as_slice() }));
    }
    let [least, most] = [f64::min, f64::max].map(|of| found.into_iter().reduce(of).unwrap_or(1.0));
    Ok(writeln!(stdout(), "gains of {least} to {most}")?)
}

/// Reads until the source ends, `limit` frames have passed or a signal asks for the end. `take` has each event and the
/// number of frames with it. Returns the number of lost frames.
fn read(source: &mut dyn Source, limit: u64, mut take: impl FnMut(&SourceEvent<'_>, u64)) -> Result<u64, Stop> {
    let interrupted = finishing(Ending::InTime);
    let (mut frames, mut lost) = (0_u64, 0_u64);
    while frames < limit && !interrupted.load(Ordering::Relaxed) {
        let event = source.next_event()?;
        match &event {
            SourceEvent::Frame(_) | SourceEvent::Taxels(_) => frames += 1,
            SourceEvent::Lost { frames: more, .. } => lost = lost.saturating_add(*more),
            SourceEvent::Fault(fault) => note(format_args!("{}: {fault}", fault.kind)),
            SourceEvent::End => break,
            _ => {}
        }
        take(&event, frames);
    }
    Ok(lost)
}

fn note_lost(lost: u64) {
    if lost > 0 {
        note(format_args!("{} lost", counted(lost, "frame")));
    }
}

/// Returns what to do now, and how many spots glowed.
fn state_of(watch: &Watch, frames: u64) -> String {
    if !watch.is_ready() {
        return format!("do not touch the sensor: {frames} of {UNTOUCHED} frames");
    }
    let spots = counted(watch.found(), "spot");
    format!("press on all whiskers: {spots} of light so far; Ctrl-C when all 25 have glowed")
}

fn print(calibration: &Calibration, json: bool) -> Result<(), Stop> {
    let dead = calibration.dead.map(|taxel| [taxel / 5 + 1, taxel % 5 + 1]);
    let rounded = |value: f64| (value * 1000.0).round() / 1000.0;
    if json {
        return print_json(&Record {
            kind: "calibration",
            found: 25 - usize::from(dead.is_some()),
            dead,
            off_px: rounded(calibration.off),
            pitch_px: calibration.pitch.map(rounded),
            rotation_degrees: rounded(calibration.rotation_degrees),
            taxel: calibration.layout.taxel(),
            centers: &calibration.centers.map(|center| center.map(rounded)),
            saturated: calibration.saturated,
            noise_levels: calibration.noise.levels,
            dark_levels: calibration.noise.dark_levels,
            readout_ms: calibration.readout.map(|readout| rounded(readout.ms)),
            readout_sd_ms: calibration.readout.map(|readout| rounded(readout.sd_ms)),
        });
    }
    writeln!(stdout(), "{calibration}")?;
    if calibration.readout.is_none() {
        note(NO_READOUT);
    }
    if calibration.is_dim() {
        note(DIM);
    }
    Ok(())
}
