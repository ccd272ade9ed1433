//! `wstac view` shows sources on a terminal.

mod several;

use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use super::output::{Stop, note, text_of};
use super::source_arguments::{SourceArguments, at_least};
use crate::view::{self, Recordings};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::monitor::pictures::port_of;
use wstac_host::monitor::port::Port;
use wstac_host::output::OutputOptions;
use wstac_host::plural::counted;
use wstac_host::record::about::About;
use wstac_host::session::Processor;
use wstac_host::source::names::sensors;
use wstac_host::source::{FramePolicy, Labels, StreamInfo};
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

/// Watch sources in the terminal: picture, taxels, traces, events
///
/// It works over ssh, too. A board is shown by its features, events and its own state, without a picture. Of a camera, the newest frame is shown. A file or a scene is played at its own rate. The
/// first 25 frames are the baseline: nothing may touch the sensor during them, nor after the key z.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Source of wstac run, or board; several as NAME=SOURCE
    ///
    /// A board is a serial device or tcp:HOST:PORT, as for wstac monitor, or board:FILE with bytes that a board sent.
    /// All sensors of a recording are shown, or the one of --sensor.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Play a file or a scene as fast as possible
    #[arg(long)]
    fast: bool,

    /// Name of the first recording
    ///
    /// Later recordings are FILE-2.mcap and so on. By default, the names are wstac-1.mcap, wstac-2.mcap and so on.
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,

    /// Bits per second of a board's serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    baud: Option<u32>,

    #[command(flatten)]
    options: SourceArguments,
}

const HELP: &str = "\
Keys:
  q, Esc, Ctrl-C   quit
  z                re-zero: gather a new baseline and drop the event
                   that is under way
  r                start a recording at the next frame, with a new
                   baseline; again: end the recording
  space            pause the screen; a camera is still read
  left, right      go back or forth by 1 s in a file or scene
  down, up         the same by 10 s, also Page Up and Page Down
  , and .          pause, and go back or forth by one frame
  Home, 0          go to the first frame
  ?                help
  Tab, 1 to 9      of several sensors, show one alone; Tab again: the
                   next, and behind the last one all; Shift-Tab: back
  Going back reads the source again from its first frame, so the screen
  is the same as before. Standard input, pipes, cameras and boards can be
  read once. While a recording is written, there is no seek.

Several sensors:
  wstac view left=/dev/video0 right=slide.mcap
  wstac view both.mcap
  Sensors are next to each other on a wide terminal and below each other
  on a narrow one, each with its state, motion and last event, and with
  taxels, traces and picture if there is room. The first line counts the
  sensors that have no room: Tab and the digits show them.
  All files and scenes are on one time line: seek, step, and pause
  move all of them. The sensors of one recording keep the distances of
  their times; other files start together. A step is a frame of the
  sensor that is shown alone, or of the first one. z is for the sensor
  that is shown alone, or for all. A camera, board or pipe that stalls or
  ends does not stop the others. There is no key r: wstac record writes a
  recording of several sensors.

Content of the screen:
  picture   the frame in green light, scaled to the brightest taxel of
            the last frames, with the taxels outlined
  taxels    5 x 5, each in percent of full scale
  facts     the trigger's state; frames per second by the driver's
            timestamps (of a file: by its header); dropped camera frames;
            speed and direction of what slides;
            of a camera also the latency from the driver's timestamp to
            the reading, the frames that wait, and the frames skipped
            of a board its uptime, frame rate, overruns, restarts, stack
            and temperature, as far as it knows them;
            UTC is the time of the newest frame, of a camera, its
            recording, or a board whose clock is matched with that of
            this machine (docs/TIME.md), within the time at clock
  traces    ten features, five rows and five columns, one dot per frame,
            on one scale of natural logarithms; the trigger fires if the
            mean of a window is above the dashes
  events    first frame, speed (* extrapolated, ≤ cut off), direction or
            kind of touch, standard deviation or confidence of the
            direction, lit frames, texture if there is a model, and at
            the right the time of the touch in UTC, if it is known;
            faults are shown here, too

Recordings:
  The key r writes a new file as wstac record does, and never replaces a
  file. wstac run FILE.mcap gives its events again, so z is disabled
  during a recording. The first line of the screen shows the file, its
  frames, and how many wait for the disk. Skipped frames of a camera are
  lost in the recording, too; wstac record writes every frame. The key q,
  a signal, the end of the source and its failure all end a recording
  properly. A full disk ends the recording but not the view: the screen
  reports it, and so does standard error at the end.

Terminals:
  The screen needs 20 x 5 characters, and 60 x 20 with a picture; 40 x 10
  shows state, motion, traces and the last event, or two sensors with
  taxels. A line that is too long ends in an ellipsis. Colors follow
  COLORTERM and TERM: 24 bits, 256 or 16. If NO_COLOR is set,
  there are no colors, and shades are characters. At the end of a file
  the screen stays until q. For records that programs read, use
  wstac run --json.
  Exit code: 0 after a key; 128 + N after signal N; 1 if a source or
  the terminal cannot be used, or if a source fails.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    if !std::io::stdout().is_terminal() {
        let message = "is no terminal, expected one to draw on; wstac run prints events to files and pipes";
        return Err(Error::new(ErrorKind::Unsupported, "standard output", message).into());
    }
    let sensors = sensors(&arguments.sources)?;
    if sensors.len() > 1 && sensors.iter().any(|sensor| sensor.name.is_none()) {
        let message = "several sources need names, expected NAME=SOURCE for each";
        super::wrong_arguments(clap::error::ErrorKind::ArgumentConflict, message).exit();
    }
    match &sensors[..] {
        [only] => match &arguments.options.sensors_in(only.source)?[..] {
            [] => watch(only.source, arguments),
            names => several::watch_recording(only.source, names, arguments),
        },
        _ => several::watch(&sensors, arguments),
    }
}

/// Shows a single source.
fn watch(source: &OsStr, arguments: &Arguments) -> Result<(), Stop> {
    if let Some(port) = port_of(source) {
        return watch_board(source, port, arguments);
    }
    if arguments.baud.is_some() {
        let message = "is no board, expected no --baud";
        return Err(Error::new(ErrorKind::Usage, source.display(), message).into());
    }
    // There is no --force here, because a key is easily pressed by mistake.
    if let Some(path) = arguments.record.as_ref().filter(|path| path.symlink_metadata().is_ok()) {
        return Err(Error::new(ErrorKind::AlreadyExists, path.display(), "exists already, expected a new file").into());
    }
    let can_reopen = can_reopen(source);
    let live = is_camera(source);
    let name = source;
    let (mut source, info, config) =
        arguments.options.open_configured(name, FramePolicy::Newest, arguments.config.as_deref())?;
    let files = ModelFile::open_all(&arguments.models)?;
    let textures = Textures::new(&files)?;
    let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
    let processor =
        |info: &StreamInfo| Ok::<_, Error>(Processor::new(info, &config, wanted)?.with_textures(textures.clone()));
    let mut reading = processor(&info)?;
    let reopen = || {
        let (source, info) = arguments.options.open(name, FramePolicy::Newest)?;
        let processor = processor(&info)?;
        Ok((source, processor))
    };
    let options = view::Options { live, fast: arguments.fast, repeats: false };
    let models = files.iter().map(|file| file.about().to_owned()).collect();
    let about = About::new(&info, &config, Labels::default(), models);
    let mut recordings = Recordings::new(about, arguments.record.clone(), text_of);
    let reopen = can_reopen.then_some(&reopen as view::Reopen<'_>);
    let ending = view::run(&mut source, reopen, &info, &mut reading, &mut recordings, options);
    recordings.said().iter().for_each(note);
    let ending = ending?;
    note(counts(&ending));
    ended(&ending)
}

/// Shows a board.
fn watch_board(source: &OsStr, port: &OsStr, arguments: &Arguments) -> Result<(), Stop> {
    let Arguments { config, models, fast, record, options, .. } = arguments;
    options.expect_none(source)?;
    if config.is_some() || !models.is_empty() || *fast || record.is_some() {
        let message = "is a board, expected no --config, --model, --fast or --record: its firmware has the first two";
        return Err(Error::new(ErrorKind::Usage, source.display(), message).into());
    }
    let mut port = Port::open(port, arguments.baud)?;
    let ending = view::board::run(&mut port)?;
    note(counts(&ending));
    ended(&ending)
}

/// Returns whether a source can be read again from its start: a scene, a file or a folder.
fn can_reopen(source: &OsStr) -> bool {
    let is_scene = source.as_encoded_bytes().starts_with(b"scene:");
    is_scene || Path::new(source).metadata().is_ok_and(|there| there.is_file() || there.is_dir())
}

/// Returns what was seen of a sensor.
fn counts(ending: &view::Ending) -> String {
    let (frames, events) = (counted(ending.frames, "frame"), counted(ending.events, "event"));
    format!("{frames}, {} dropped, {events}", ending.dropped)
}

/// Returns how a view ended.
fn ended(ending: &view::Ending) -> Result<(), Stop> {
    match ending.signal {
        Some(signal) => Err(Stop::Interrupted(signal)),
        None => Ok(()),
    }
}
