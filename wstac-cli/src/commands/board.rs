//! `wstac board` shows and sets the settings of a board.

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

use serde::Serialize;
use wstac_core::wire::Settings;

use super::output::{Stop, note};
use super::source_arguments::at_least;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::monitor::settings::{SettableBoard, settings_of};

/// Show and set the layout, trigger and exposure of a board
///
/// The board checks them, keeps them over resets and starts again. Everything else of a configuration is compiled into
/// its firmware.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Serial device or tcp:HOST:PORT, as for wstac monitor
    port: OsString,

    /// Set layout, floor and trigger of this configuration
    #[arg(long, value_name = "FILE.toml")]
    set: Option<PathBuf>,

    /// Set the exposure in lines of the camera
    ///
    /// A camera of 30 frames per second has about 510 lines.
    #[arg(long, value_name = "LINES", value_parser = at_least(1_u16))]
    exposure: Option<u16>,

    /// Return to the settings that are compiled in
    #[arg(long, conflicts_with_all = ["set", "exposure"])]
    forget: bool,

    /// Print one JSON object instead of TOML
    #[arg(long)]
    json: bool,

    /// Bits per second of a serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    baud: Option<u32>,
}

const HELP: &str = r#"What is set:
  [layout] frame, taxel and corners, [features] floor_levels, and
  [trigger] window, multiplier, backtrack, rule and margin of the file,
  as wstac calibrate writes them, and the exposure. What is not given
  stays as it is. The law, the logarithm and the texture model are
  compiled in: WSTAC_CONFIG and WSTAC_MODEL of the firmware.

Output:
  The settings in use after that, as the keys of a configuration. With
  --json, one object: {"kind":"board","set":true,"frame":[320,240],
  "taxel":[30,30],"corners":[[49,9], … 25 in all],"window":5,
  "multiplier":1.5,"backtrack":15,"margin":0.5,"exposure":null}
  set tells settings of a host from those compiled in.

Refusals:
  The board refuses a layout for frames of another size, taxels outside
  the frame, and an exposure that is longer than a frame. It says why,
  and goes on with the settings that it has. Exit code: 1.

Examples:
  wstac calibrate /dev/ttyACM0 -o my.toml
  wstac board /dev/ttyACM0 --set my.toml
  wstac board /dev/ttyACM0 --exposure 240
  wstac board /dev/ttyACM0
"#;

/// The output of `--json`.
#[derive(Serialize)]
struct Record<'a> {
    kind: &'static str,
    set: bool,
    frame: [u16; 2],
    taxel: [u16; 2],
    corners: &'a [[u16; 2]],
    window: u8,
    multiplier: f64,
    backtrack: u8,
    margin: f64,
    exposure: Option<u16>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    // The file is read first, so that nothing is sent in vain.
    let config = arguments.set.as_deref().map(Config::read).transpose()?;
    let mut board = SettableBoard::open(&arguments.port, arguments.baud)?;
    if arguments.forget {
        board.forget()?;
    } else if config.is_some() || arguments.exposure.is_some() {
        let settings = wanted(&mut board, config.as_ref(), arguments)?;
        board.set(&settings)?;
    }
    let in_use = board.in_use()?;
    note(if in_use.set { "settings that were set" } else { "settings that are compiled in" });
    print(&in_use.settings, in_use.set, arguments.json)
}

/// Returns the settings in use with those changed that the arguments name.
fn wanted(board: &mut SettableBoard, config: Option<&Config>, arguments: &Arguments) -> Result<Settings, Stop> {
    let now = board.in_use()?.settings;
    let mut settings = now;
    if let (Some(config), Some(file)) = (config, &arguments.set) {
        let info = board.info()?;
        settings = settings_of(config, &info, now.exposure).map_err(|error| Error::config(file.display(), error))?;
        if settings.trigger.is_per_touch() != now.trigger.is_per_touch() {
            let message = "has another [speed] law than the board, whose law is compiled in: expected the same";
            return Err(Error::new(ErrorKind::Data, file.display(), message).into());
        }
    }
    settings.exposure = arguments.exposure.or(settings.exposure);
    Ok(settings)
}

fn print(settings: &Settings, set: bool, json: bool) -> Result<(), Stop> {
    let mut out = super::output::stdout();
    let Settings { frame, taxel, corners, trigger, exposure, .. } = settings;
    let real = |bits: u32| f64::from(bits) / 65_536.0;
    let (multiplier, margin) = (real(trigger.multiplier().bits()), real(trigger.margin().bits()));
    if json {
        let record = Record {
            kind: "board",
            set,
            frame: *frame,
            taxel: *taxel,
            corners,
            window: trigger.window(),
            multiplier,
            backtrack: trigger.backtrack(),
            margin,
            exposure: *exposure,
        };
        let line = serde_json::to_string(&record)
            .map_err(|error| Error::with_cause(ErrorKind::Io, "standard output", error))?;
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(out, "[layout]\nframe = {frame:?}\ntaxel = {taxel:?}\ncorners = [")?;
    for row in corners.chunks(5) {
        let row: Vec<_> = row.iter().map(|corner| format!("{corner:?}")).collect();
        writeln!(out, "    {},", row.join(", "))?;
    }
    writeln!(out, "]\n\n[trigger]\nwindow = {}\nmultiplier = {multiplier:?}", trigger.window())?;
    writeln!(out, "backtrack = {}\nmargin = {margin:?}\n", trigger.backtrack())?;
    match exposure {
        Some(lines) => writeln!(out, "# The exposure is {lines} lines.")?,
        None => writeln!(out, "# The exposure is that of the firmware.")?,
    }
    Ok(())
}
