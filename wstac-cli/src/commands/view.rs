//! `wstac view` shows a sensor on a terminal.

use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::PathBuf;

use super::output::{Stop, note};
use super::removed::words;
use super::source_arguments::{SourceArguments, models_of, open_models};
use super::values::at_least;
use crate::view::{SourceView, run as show};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::monitor::port::port_of;
use wstac_host::output::OutputOptions;
use wstac_host::plural::counted;
use wstac_host::source::names::sensors;
use wstac_host::source::{FramePolicy, Source};
use wstac_host::station::Station;
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

/// Watch a sensor in the terminal: picture, taxels, traces, events
///
/// It works over ssh, too. A board is shown by its features, events and its own state, without a picture. Of a camera,
/// the newest frame is shown. A file or a scene is played at its own rate. The first 25 frames are the baseline:
/// nothing may touch the sensor during them, nor after the key z. wstac serve shows several sensors, records, and goes
/// back and forth in files.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Source of wstac run, or board
    ///
    /// A board is a serial device or tcp:HOST:PORT, as for wstac run, or a file with bytes that a board sent.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    ///
    /// Names are those of wstac run; a scene has builtin by default.
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Bits per second of a board's serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    baud: Option<u32>,

    #[command(flatten)]
    options: SourceArguments,
}

const HELP: &str = "\
Keys:
  q, Esc, Ctrl-C   quit
  z                gather a new baseline
  space            pause the screen; a camera is still read

Content of the screen:
  picture   green light, scaled to the brightest taxel of the last frames
  taxels    5 x 5, each in percent of full scale
  facts     the trigger's state, frames per second, what was lost and
            what slides; of a camera also the latency of its frames
  traces    ten features over time, and the trigger's thresholds
  events    and faults, the newest first, in the words of wstac run

Terminals:
  The screen needs 20 x 5 characters, and 60 x 20 with a picture. Colors
  need a terminal with 256 of them; without, and if NO_COLOR is set,
  shades are characters. At the end of a file the screen stays until q.
  Exit code: 0 after a key, 128 + N after signal N, 1 after a failure.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let given = sensors(&arguments.sources)?;
    let [sensor] = &given[..] else {
        let instead = "wstac serve left=SOURCE right=SOURCE shows several sensors on a page";
        let message = words("wstac view left=SOURCE right=SOURCE", instead);
        super::wrong_arguments(clap::error::ErrorKind::TooManyValues, message).exit();
    };
    if !std::io::stdout().is_terminal() {
        let message = "is no terminal, which wstac view draws on; wstac run prints events to files and pipes";
        return Err(Error::new(ErrorKind::Unsupported, "standard output", message).into());
    }
    if std::env::var_os("TERM").is_some_and(|term| term == "dumb") {
        let message = "is dumb, a terminal that shows only lines; wstac run prints events as lines";
        return Err(Error::new(ErrorKind::Unsupported, "TERM", message).into());
    }
    let is_board = port_of(sensor.source).is_some();
    let mut view = if is_board { board(sensor.source, arguments)? } else { frames(sensor.source, arguments)? };
    let (state, signal) = show(&mut view)?;
    let (frames, events) = (counted(state.frame, "frame"), counted(state.events, "event"));
    note(format_args!("{frames}, {} dropped, {events}", state.dropped));
    signal.map_or(Ok(()), |signal| Err(Stop::Interrupted(signal)))
}

fn frames(source: &OsStr, arguments: &Arguments) -> Result<SourceView, Error> {
    let refused = |message: String| Err(Error::new(ErrorKind::Usage, source.display(), message));
    if arguments.baud.is_some() {
        return refused("is no board; leave --baud out".to_owned());
    }
    let names = arguments.options.sensors_in(source)?.join(", ");
    if !names.is_empty() {
        return refused(format!("has sensors {names}, expected one of them as --sensor; wstac serve shows all"));
    }
    let (opened, info, config) =
        arguments.options.open_configured(source, FramePolicy::Newest, arguments.config.as_deref())?;
    let live = is_camera(source);
    let given = open_models(&arguments.models)?;
    let textures = Textures::new(&models_of(given.as_deref(), source, &info, &config)?)?;
    let station = Station::new(opened, info, config, textures, OutputOptions::LIVE)?;
    Ok(SourceView::new(if live { station } else { station.paced() }, live))
}

fn board(source: &OsStr, arguments: &Arguments) -> Result<SourceView, Error> {
    let has_files = arguments.config.is_some() || !arguments.models.is_empty();
    let board = arguments.options.open_board(source, arguments.baud, has_files)?;
    let (info, config) = (board.info().clone(), Config::default());
    Ok(SourceView::new(Station::new(board, info, config, Textures::default(), OutputOptions::LIVE)?, true))
}
