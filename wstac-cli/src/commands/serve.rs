//! `wstac serve` shows sensors on a page in a browser.

use std::ffi::OsString;
use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use clap::error::ErrorKind as ClapErrorKind;

use super::output::{Stop, note};
use super::signals::{Ending, finishing};
use super::source_arguments::{SourceArguments, doubts_of_textures};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::plural::counted;
use wstac_host::session::Session;
use wstac_host::source::FramePolicy;
use wstac_host::source::names::{Sensor, sensors};
use wstac_host::source::pace::Pace;
use wstac_host::text_file;
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;
use wstac_serve::{Server, Token};

/// The address without --listen.
const LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8025);
/// Most sensors of a page.
const MOST_SENSORS: usize = 16;

/// Watch sensors in a browser: picture, taxels, traces, events
///
/// The first line on standard error is the address to open. Of a camera, the newest frame is shown. A file or a scene is
/// played once, at its own rate, and its events stay on the page. The first 25 frames are the baseline: nothing may touch
/// the sensor during them. Ctrl-C ends the command.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Camera, recording or scene, or several as cam:NAME=SOURCE
    ///
    /// The sources are those of wstac run.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Listen at this address and port; port 0 is any free one
    ///
    /// Other machines reach the page only at another address than 127.0.0.1, and only with the token that is in the
    /// printed address then.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = LISTEN)]
    listen: SocketAddr,

    /// Take the token from this file, instead of a new one at each start
    ///
    /// It has 16 to 128 letters, digits, - and _. With it, the page needs the token at any address.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    #[command(flatten)]
    options: SourceArguments,
}

const HELP: &str = "\
The page, for each sensor:
  picture   the frame in green light, scaled to its brightest parts, with
            the taxels outlined; without pictures, the taxels alone
  motion    speed and direction as an arrow while something slides
  traces    ten features of the last 10 s, five rows and five columns,
            on one scale of natural logarithms; the dashes are the
            thresholds of the trigger
  events    the newest first: kind of touch, speed and direction with
            their standard deviations, texture with its confidence;
            faults are shown here, too
Keys:
  p         pause the page; sensors are still read
  1 to 9    gather a new baseline for sensor 1 to 9, as its button does

Slow browsers:
  Each browser gets up to 30 updates per second. One that is slower gets
  the newest frame when it is ready. The page shows how many frames it
  has skipped. No browser delays a sensor or another browser.
  If the command ends, the page waits for it and connects again.

Who can see the page:
  Without --listen, only programs on this machine can. For a page of
  another machine:
    ssh -L 8025:127.0.0.1:8025 MACHINE
  The token of any other address is a secret, but the connection is not
  encrypted: use such an address only in a network that you trust.
  Requests that come from the page of another site are refused.
  Exit code: 1 if a source, a file or the address cannot be used, or if
  a source has failed; 2 for wrong arguments; otherwise 0.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let sensors = sensors(&arguments.sources)?;
    if sensors.len() > 1 && sensors.iter().any(|sensor| sensor.name.is_none()) {
        let message = "several sources need names, expected cam:NAME=SOURCE for each";
        super::wrong_arguments(ClapErrorKind::ArgumentConflict, message).exit();
    }
    if sensors.len() > MOST_SENSORS {
        let message = format!("found {} sources, expected at most {MOST_SENSORS}", sensors.len());
        super::wrong_arguments(ClapErrorKind::TooManyValues, message).exit();
    }
    let token = arguments.token_file.as_deref().map(|path| {
        let text = text_file::file_text(path)?;
        Token::new(text.trim(), path.display())
    });
    let server = Server::bind(arguments.listen, token.transpose()?)?;
    let files = ModelFile::open_all(&arguments.models)?;
    let opened = sensors.iter().map(|sensor| open(sensor, arguments, &files)).collect::<Result<Vec<_>, _>>()?;
    let stop = finishing(Ending::InTime);
    // The address alone is on the first line, so that programs can read it.
    let _ = writeln!(std::io::stderr(), "{}", server.address());
    for (sensor, (_, notes)) in sensors.iter().zip(&opened) {
        for text in notes {
            note_of(sensor.name, text);
        }
    }
    let opened = opened.into_iter().map(|(sensor, _)| sensor).collect();
    let failed = server.run(opened, &stop, &|name, error| note_of(name, error));
    match failed {
        0 => Ok(()),
        _ => Err(Error::new(ErrorKind::Data, counted(failed, "source"), "failed").into()),
    }
}

/// Opens a sensor, and returns it with what is to be said about it.
fn open(
    sensor: &Sensor<'_>,
    arguments: &Arguments,
    files: &[ModelFile],
) -> Result<(wstac_serve::Sensor, Vec<String>), Error> {
    let Arguments { options, config, .. } = arguments;
    let (source, info, config) = options.open_configured(sensor.source, FramePolicy::Newest, config.as_deref())?;
    let notes = [info.about.clone()].into_iter().chain(doubts_of_textures(&info, files)).collect();
    let session = Session::builder(source).config(config).textures(Textures::new(files)?);
    let pace = (!is_camera(sensor.source)).then(|| Pace::new(info.rate));
    Ok((wstac_serve::Sensor::new(sensor.name, session, &info, pace)?, notes))
}

/// Writes a note about a sensor to standard error.
fn note_of(name: Option<&str>, message: impl std::fmt::Display) {
    match name {
        Some(name) => note(format_args!("{name}: {message}")),
        None => note(message),
    }
}
