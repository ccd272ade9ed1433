//! `wstac board` shows and sets the settings of a board.

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use serde::Serialize;
use wstac_core::wire::{
    BoardModel, Bootloader, LONGEST_TEXTURE_NAME, Learning, LearningStep, Settings, SettingsInUse, TextureName,
};

use super::output::{Stop, note, print_json, stdout};
use super::signals::{Ending, code, finishing};
use super::values::at_least;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::{BUILT_IN, ModelFile};
use wstac_host::monitor::learning::Learned;
use wstac_host::monitor::models::{built_in_name, kind_name};
use wstac_host::monitor::settings::{SettableBoard, settings_of};
use wstac_host::visible::OneLine;

/// Show and set layout, trigger, exposure and model of a board; teach textures; start its boot loader
///
/// The board checks settings, keeps them over resets and starts again. Everything else of a configuration is compiled
/// into its firmware. A board whose firmware has the feature learn learns textures from slides. One
/// with the feature models takes a texture model.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
#[expect(clippy::struct_excessive_bools, reason = "each is an argument of its own")]
pub(super) struct Arguments {
    /// Serial device or tcp:HOST:PORT, as for wstac run
    port: OsString,

    /// Set layout, floor and trigger of this configuration
    #[arg(long, value_name = "FILE.toml")]
    set: Option<PathBuf>,

    /// Set the exposure in lines of the camera
    ///
    /// At 30 frames per second at most 264 for an HM01B0, and 500 for an OV7725, OV7690 or OV7692: a longer one does
    /// not fit in a frame. At other rates the board says its limit.
    #[arg(long, value_name = "LINES", value_parser = at_least(1_u16))]
    exposure: Option<u16>,

    /// Learn a texture from the next five slides
    ///
    /// A name has 1 to 23 bytes. A texture of this name that was learned before is learned anew. Ctrl-C stops.
    #[arg(long, value_name = "NAME", value_parser = texture_name, conflicts_with_all = ["set", "exposure", "forget"])]
    learn: Option<TextureName>,

    /// Forget a texture that was learned
    #[arg(long, value_name = "NAME", value_parser = texture_name, conflicts_with_all = ["set", "exposure", "forget", "learn"])]
    unlearn: Option<TextureName>,

    /// Send a texture model, which the board keeps and uses
    ///
    /// A model file, builtin or builtin:NAME. Its kind and sample must be those of the firmware.
    #[arg(long, value_name = "FILE.wsm", conflicts_with_all = ["set", "exposure", "forget", "learn", "unlearn"])]
    model: Option<PathBuf>,

    /// Forget the model that was sent
    #[arg(long, conflicts_with_all = ["set", "exposure", "forget", "learn", "unlearn", "model"])]
    forget_model: bool,

    /// Return to what is compiled in; forget all textures and the model
    #[arg(long, conflicts_with_all = ["set", "exposure"])]
    forget: bool,

    /// Start the boot loader: it takes a program over USB
    ///
    /// A Raspberry Pi Pico becomes a drive for a .uf2 file, and an OpenMV Cam H7 waits for dfu-util.
    #[arg(long, conflicts_with_all = ["set", "exposure", "forget", "learn", "unlearn", "model", "forget_model", "json"])]
    bootloader: bool,

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
  stays as it is. The law, the logarithm and [layout] crosstalk are
  compiled in: WSTAC_CONFIG of the firmware.

Output:
  The settings in use after that, as the keys of a configuration. With
  --json, one object: {"kind":"board","set":true,"frame":[320,240],
  "taxel":[30,30],"corners":[[49,9], … 25 in all],"window":5,
  "multiplier":1.5,"backtrack":15,"margin":0.5,"exposure":null}
  set tells settings of a host from those compiled in. A board that
  learns also has "textures":["carpet", …], the names of those that
  it has learned so far.

Learning:
  The board must have a calibrated texture model, such as
  builtin:taxel-embedding, and the feature learn. Slide the texture over
  the sensor five times, at any speed and in any direction. Each touch
  is reported, with the reason if it was not taken. Events of the
  texture then have its name as class. The board keeps up to 10 textures.

Models:
  The board must have the feature models. The file is checked here, then
  sent in pieces that are acknowledged, checked again on the board, and
  kept in its flash. If the line or the power fails, the board goes on
  with the model that it had. When no touch is under way it starts again
  and uses the new one. A board that takes models also has, in --json,
  "model":{"checksum":"1A2B3C4D","name":"builtin:svm","sent":true,
  "kind":"linear_svm","input":"frames","most":262080}: the model in use,
  its name if it comes with wstac, whether it was sent, and the kind,
  sample and most bytes that the board takes. Without a model, checksum
  is null. While flash is erased, for a second or two, no frame is used.

Refusals:
  The board refuses a layout for frames of another size, taxels outside
  the frame, and an exposure that does not fit in a frame. It says why,
  and goes on with the settings that it has. Exit code: 1.

Examples:
  wstac calibrate /dev/ttyACM0 -o my.toml
  wstac board /dev/ttyACM0 --set my.toml
  wstac board /dev/ttyACM0 --exposure 240
  wstac board /dev/ttyACM0 --learn carpet
  wstac board /dev/ttyACM0 --model builtin
  wstac board /dev/ttyACM0 --bootloader
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
    #[serde(skip_serializing_if = "Option::is_none")]
    textures: Option<Vec<&'a str>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    model: Option<ModelRecord>,
}

/// The model in the output of `--json`.
#[derive(Serialize)]
struct ModelRecord {
    checksum: Option<String>,
    name: Option<String>,
    sent: bool,
    kind: &'static str,
    input: &'static str,
    most: u32,
}

impl From<&BoardModel> for ModelRecord {
    fn from(model: &BoardModel) -> Self {
        Self {
            checksum: model.in_use.map(|checksum| format!("{checksum:08X}")),
            name: model.in_use.and_then(built_in_name).map(|name| format!("{BUILT_IN}{name}")),
            sent: model.sent,
            kind: kind_name(model.accepts.kind),
            input: model.accepts.input.name(),
            most: model.accepts.most,
        }
    }
}

fn texture_name(text: &str) -> Result<TextureName, String> {
    let name = TextureName::new(text).filter(|_| !text.contains(char::is_control));
    name.ok_or_else(|| format!("expected a name of 1 to {LONGEST_TEXTURE_NAME} bytes without control characters"))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    // The file is read first, so that nothing is sent in vain.
    let config = arguments.set.as_deref().map(Config::read).transpose()?;
    let model = arguments.model.as_deref().map(ModelFile::open).transpose()?;
    if let Some(model) = &model {
        model.model()?;
    }
    let mut board = SettableBoard::open(&arguments.port, arguments.baud)?;
    if arguments.bootloader {
        note(match board.start_bootloader()? {
            Bootloader::Uf2 => "the board becomes a drive: copy the .uf2 file to it",
            Bootloader::Dfu => "the board waits for: dfu-util -w -d 37c5:9204 -a FIRMWARE --reset -D FILE.dfu",
            _ => "the board's boot loader waits for a program",
        });
        return Ok(());
    }
    if let Some(file) = &model {
        send_model(&mut board, file)?;
    } else if arguments.forget_model {
        board.forget_model()?;
    } else if arguments.forget {
        if board.model()?.is_some_and(|model| model.sent) {
            board.forget_model()?;
        }
        for name in board.textures()?.iter().flat_map(|textures| textures.names).flatten() {
            board.forget_texture(name)?;
        }
        board.forget()?;
    } else if let Some(name) = arguments.learn {
        learn(&mut board, name)?;
    } else if let Some(name) = arguments.unlearn {
        board.forget_texture(name)?;
    } else if config.is_some() || arguments.exposure.is_some() {
        let settings = wanted(&mut board, config.as_ref(), arguments)?;
        board.set(&settings)?;
    }
    print(&mut board, arguments.json)
}

/// Sends a model to the board, and reports each tenth.
fn send_model(board: &mut SettableBoard, file: &ModelFile) -> Result<(), Stop> {
    let mut tenths = None;
    board.send_model(file, |sent, all| {
        let reached = u64::from(sent) * 10 / u64::from(all.max(1));
        if tenths.replace(reached) != Some(reached) {
            note(format_args!("{sent} of {all} bytes of the model are sent"));
        }
    })?;
    note(format_args!("the board uses the model {}", file.about()));
    Ok(())
}

/// Lets the board learn a texture, and reports each touch.
fn learn(board: &mut SettableBoard, name: TextureName) -> Result<(), Stop> {
    let interrupted = finishing(Ending::InTime);
    let told = |state: &Learning| {
        let Learning { slides, needed, .. } = state;
        match state.step {
            LearningStep::Begun if *slides == 0 => {
                note(format_args!("slide {name} over the sensor {needed} times, at any speed and in any direction"));
            }
            LearningStep::NotTaken(reason) => note(format_args!("{slides} of {needed}; not taken: {reason}")),
            LearningStep::Learned => note(format_args!("{needed} of {needed}; {name} is learned")),
            LearningStep::Failed(_) => {}
            _ => note(format_args!("{slides} of {needed}")),
        }
    };
    match board.learn(name, told, || interrupted.load(Ordering::Relaxed))? {
        Learned::Whole => Ok(()),
        Learned::Stopped => Err(Stop::Interrupted(code())),
    }
}

/// Returns the settings in use with those changed that the arguments name.
fn wanted(board: &mut SettableBoard, config: Option<&Config>, arguments: &Arguments) -> Result<Settings, Stop> {
    let now = board.in_use()?.settings;
    let mut settings = now;
    if let (Some(config), Some(file)) = (config, &arguments.set) {
        let info = board.info()?;
        settings = settings_of(config, &info, now.exposure).map_err(|error| Error::config(file.display(), error))?;
        if settings.trigger.is_per_touch() != now.trigger.is_per_touch() {
            let law = if now.trigger.is_per_touch() { "leave law out" } else { "set law = \"published\"" };
            let message = format_args!("[speed] law is not the board's, which is compiled in; help: {law}");
            return Err(Error::new(ErrorKind::Data, file.display(), message).into());
        }
        if config.layout.correction().is_some() {
            note("[layout] crosstalk is not sent: a board has that which is compiled in");
        }
    }
    settings.exposure = arguments.exposure.or(settings.exposure);
    Ok(settings)
}

fn print(board: &mut SettableBoard, json: bool) -> Result<(), Stop> {
    let (SettingsInUse { set, settings, .. }, textures) = (board.in_use()?, board.textures()?);
    let model = board.model()?.as_ref().map(ModelRecord::from);
    note(if set { "settings that were set" } else { "settings that are compiled in" });
    let Settings { frame, taxel, corners, trigger, exposure, .. } = settings;
    let real = |bits: u32| f64::from(bits) / 65_536.0;
    let (multiplier, margin) = (real(trigger.multiplier().bits()), real(trigger.margin().bits()));
    if json {
        return print_json(&Record {
            kind: "board",
            set,
            frame,
            taxel,
            corners: &corners,
            window: trigger.window(),
            multiplier,
            backtrack: trigger.backtrack(),
            margin,
            exposure,
            textures: textures
                .as_ref()
                .map(|textures| textures.names.iter().flatten().map(TextureName::as_str).collect()),
            model,
        });
    }
    let mut out = stdout();
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
    for name in textures.iter().flat_map(|textures| &textures.names).flatten() {
        writeln!(out, "# It has learned the texture {}.", OneLine(name))?;
    }
    if let Some(ModelRecord { checksum, name, sent, .. }) = model {
        let origin = if sent { "was sent" } else { "is compiled in" };
        match checksum {
            Some(checksum) => {
                let name = name.map_or_else(String::new, |name| format!("{name}, "));
                writeln!(out, "# Its texture model {origin}: {name}checksum {checksum}.")?;
            }
            None => writeln!(out, "# It has no texture model.")?,
        }
    }
    Ok(())
}
