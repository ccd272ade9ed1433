//! `wstac serve` shows sensors on a page in a browser.

use std::borrow::Cow;
use std::ffi::OsString;
use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use clap::error::ErrorKind as ClapErrorKind;

use super::files::{Outputs, check_ending};
use super::output::Stop;
use super::records::{Form, Records};
use super::signals::{Ending, finishing};
use super::source_arguments::{SourceArguments, can_be_read_again, doubts_of_textures, models_of, open_models};
use wstac_host::camera::{ControlValue, DeviceInfo};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::output::OutputOptions;
use wstac_host::plural::counted;
use wstac_host::record::SharedRecording;
use wstac_host::source::FramePolicy;
use wstac_host::source::every_sensor::NamedSource;
use wstac_host::source::names::sensors;
use wstac_host::station::Station;
use wstac_host::text_file;
use wstac_host::texture::Textures;
use wstac_linux::controls::controls;
use wstac_linux::device_at;
use wstac_linux::source::{is_camera, is_device};
use wstac_serve::{CalibrationFile, ExaminedCamera, Server, Token, Tools};

/// The address without --listen.
const LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8025);
/// Most sensors of a page: as many as a recording takes.
const MOST_SENSORS: usize = SharedRecording::MOST_SENSORS;

/// Watch sensors in a browser: picture, taxels, traces, events
///
/// The first line on standard error is the address to open. Of a camera, the newest frame is shown. A file or a scene
/// waits for the first browser, is played at its own rate, and its events stay on the page. The first 25 frames are the
/// baseline: nothing may touch the sensor during them. The page can also record with labels, calibrate the sensor and
/// examine it. Ctrl-C ends the command.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Camera, recording or scene, or several as NAME=SOURCE
    ///
    /// The sources are those of wstac run, at most 20. Of a recording of several sensors, all are shown.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Listen here: an address, a port or both; port 0 is any free one
    ///
    /// Other machines reach the page only at another address than 127.0.0.1, and only with the token that is in the
    /// printed address then.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = LISTEN, value_parser = address)]
    listen: SocketAddr,

    /// Take the token from this file, instead of a new one at each start
    ///
    /// It has 16 to 128 letters, digits, - and _. With it, the page needs the token at any address.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,

    /// Let pages record to new files in this existing folder
    ///
    /// The files are NAME-1.mcap, NAME-2.mcap and so on by the name of the source, or wstac-1.mcap and so on. A page
    /// gives labels, and no names. Every frame of a camera is read then, in place of the newest.
    #[arg(long, value_name = "FOLDER")]
    record_to: Option<PathBuf>,

    /// Write a calibration that a page confirms to this new file
    ///
    /// A later one of the same run replaces it. Of several sensors, the name of each is added: FILE-left.toml. Without
    /// this option the page offers the file as a download.
    #[arg(long, value_name = "FILE.toml")]
    calibrate_to: Option<PathBuf>,

    /// Start files and scenes again at their end, as Loop on the page does
    #[arg(long = "loop")]
    repeats: bool,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    ///
    /// Names are those of wstac run; a scene has builtin by default.
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    #[command(flatten)]
    options: SourceArguments,
}

fn address(text: &str) -> Result<SocketAddr, String> {
    // A number may begin with +, a port may not.
    let port = text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok()).flatten();
    let alone = port.map(|port| SocketAddr::new(LISTEN.ip(), port));
    let text = text.replacen("localhost", "127.0.0.1", 1);
    alone
        .or_else(|| text.parse().ok())
        .or_else(|| Some(SocketAddr::new(text.parse().ok()?, LISTEN.port())))
        .ok_or_else(|| format!("expected an address, a port or both, such as {LISTEN}"))
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
            their standard deviations, texture with its confidence, and
            what else is known: basis, width, place, period, lit frames;
            slips and faults are shown here, too
Keys:
  p         pause the page; sensors are still read
  space     pause all files and scenes, or play them
  left, right   go back or forth by 1 s in all of them; with Shift by 10 s
  , and .   pause them, and go back or forth by one frame
  0         go to their first frame
  l         start them again at their end, or no longer
  1 to 9    gather a new baseline for sensor 1 to 9, as its button does
  r         start a recording of the chosen sensor with the labels on the
            page, or end it
  c         start a calibration of it; again: find the whiskers
  u         use the calibration that is shown
  d         examine it, as wstac doctor does
  Escape    end the calibration or the examination
  Of several sensors, the one that was clicked last is chosen, or the
  one that has the keyboard's focus.

Files and scenes:
  Buttons below the picture do the same for one of them. Loop starts it
  again at its end, Play once; the last 200 events, slips and faults stay.
  Going back reads the source again from its first frame. Cameras, pipes,
  standard input and a recording in progress have no way back or forth.

Recordings (--record-to FOLDER):
  They are files of wstac record, with the labels specimen, speed,
  direction, and sensor if the source has a name. A recording begins
  with a new baseline. It goes on if the page is closed, until a page,
  Ctrl-C, SIGTERM, SIGHUP or the end of the source ends it; its file is
  whole then. Files are never overwritten. A full disk ends a recording,
  but not the page.

Calibration:
  It is that of wstac calibrate. The page shows the spots that glow, and
  then the taxels. Nothing changes until a person confirms them. Then the
  sensor uses them, with the settings that follow from its noise, and so
  do recordings that start later.

Examination:
  It is that of wstac doctor for 10 s, without its comparison of MJPEG
  with a raw format, for which the camera must be opened again.

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
  Whoever sees the page may also record and calibrate, one request at a
  time for each sensor, and choose no path.
  Exit code: 1 if a source, a file or the address cannot be used, or if
  a source or a recording has failed; 2 for wrong arguments, else 0.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let sensors = arguments.options.every_sensor(&sensors(&arguments.sources)?)?;
    if sensors.len() > MOST_SENSORS {
        let message = format!("found {} sources, expected at most {MOST_SENSORS}", sensors.len());
        super::wrong_arguments(ClapErrorKind::TooManyValues, message).exit();
    }
    let token = arguments.token_file.as_deref().map(|path| {
        let text = text_file::file_text(path)?;
        Token::new(text.trim(), path.display())
    });
    let server = Server::bind(arguments.listen, token.transpose()?)
        .map_err(|error| error.about(format_args!("--listen {}", arguments.listen)))?;
    let files = open_models(&arguments.models)?;
    check_folder(arguments.record_to.as_deref())?;
    let opened = sensors
        .iter()
        .map(|sensor| open(sensor, &sensors, arguments, files.as_deref()))
        .collect::<Result<Vec<_>, _>>()?;
    // A recording is completed, however slow the disk is.
    let stop = finishing(if arguments.record_to.is_some() { Ending::Whole } else { Ending::InTime });
    // The address alone is on the first line, so that programs can read it.
    let _ = writeln!(std::io::stderr(), "{}", server.address());
    for (sensor, (_, notes)) in sensors.iter().zip(&opened) {
        let records = Records::new(Form::Text).of_sensor(sensor.name.as_deref());
        for text in notes {
            records.note(text);
        }
    }
    let opened = opened.into_iter().map(|(sensor, _)| sensor).collect();
    let failed = server.run(opened, &stop, &|name, line| Records::new(Form::Text).of_sensor(name).note(line));
    match failed {
        0 => Ok(()),
        _ => Err(Error::new(ErrorKind::Data, counted(failed, "sensor"), "failed").into()),
    }
}

/// Refuses a folder of recordings that is none.
fn check_folder(folder: Option<&Path>) -> Result<(), Error> {
    let Some(folder) = folder.filter(|folder| !folder.is_dir()) else { return Ok(()) };
    let (kind, what) =
        if folder.exists() { (ErrorKind::Io, "is no folder") } else { (ErrorKind::NotFound, "does not exist") };
    let message = format_args!("{what}, expected a folder for the recordings of --record-to");
    Err(Error::new(kind, folder.display(), message))
}

/// Opens a sensor, and returns it with what is to be said about it.
fn open(
    sensor: &NamedSource,
    all: &[NamedSource],
    arguments: &Arguments,
    given: Option<&[ModelFile]>,
) -> Result<(wstac_serve::ServedSensor, Vec<String>), Error> {
    let Arguments { config, record_to, .. } = arguments;
    let options = &arguments.options.of(sensor);
    // A recording has every frame.
    let policy = if record_to.is_some() { FramePolicy::Every } else { FramePolicy::Newest };
    let (source, info, config) = options.open_configured(&sensor.source, policy, config.as_deref())?;
    let files = models_of(given, &sensor.source, &info, &config)?;
    let doubts = config.notes(&info).map(Cow::into_owned);
    let notes = [info.about.clone()].into_iter().chain(doubts).chain(doubts_of_textures(&info, &files)).collect();
    let is_live = is_camera(&sensor.source);
    let camera = info.camera.as_ref().filter(|camera| is_live && is_device(&camera.path));
    let tools = Tools {
        record_to: record_to.clone(),
        calibrate_to: calibration_file(sensor, all, arguments)?,
        camera: camera.map(|camera| Box::new(Camera(camera.path.clone())) as Box<dyn ExaminedCamera>),
        asked_fps: is_live.then(|| options.asked_fps()),
    };
    let mut station = Station::new(source, info, config, Textures::new(&files)?, OutputOptions::LIVE)?;
    if !is_live {
        station = station.paced();
    }
    if can_be_read_again(&sensor.source) {
        let (again, name) = (options.clone(), sensor.source.clone());
        station = station.reopened_by(Box::new(move || again.open(&name, policy)), arguments.repeats);
    } else if arguments.repeats {
        let message = "can be read once, expected a file or a scene with --loop";
        return Err(Error::new(ErrorKind::Usage, sensor.source.display(), message));
    }
    Ok((wstac_serve::ServedSensor::new(sensor.name.as_deref(), station, tools), notes))
}

/// Returns the file for the calibration of a sensor, which does not exist yet.
fn calibration_file(
    sensor: &NamedSource,
    all: &[NamedSource],
    arguments: &Arguments,
) -> Result<Option<CalibrationFile>, Error> {
    let Some(named) = &arguments.calibrate_to else { return Ok(None) };
    check_ending(named, &["toml"])?;
    let path = match &sensor.name {
        Some(name) if all.len() > 1 => {
            let stem = named.file_stem().unwrap_or_default().display();
            let ending = named.extension().map_or(String::new(), |ending| format!(".{}", ending.display()));
            named.with_file_name(format!("{stem}-{name}{ending}"))
        }
        _ => named.clone(),
    };
    let outputs = |force| {
        let outputs = Outputs::new(force).reading(&arguments.config).reading(&arguments.models);
        all.iter().fold(outputs, |outputs, other| outputs.source(&other.source))
    };
    let new = outputs(false);
    new.check([&path])?;
    let (name, mut is_own, own) = (path.display().to_string(), false, outputs(true));
    let write = move |text: &str| {
        // Only a file of this run is replaced.
        let outputs = if is_own { &own } else { &new };
        outputs.write(&path, text)?;
        is_own = true;
        Ok(())
    };
    Ok(Some(CalibrationFile { name, write: Box::new(write) }))
}

/// A camera of V4L2, by its path.
struct Camera(PathBuf);

impl ExaminedCamera for Camera {
    fn controls(&self) -> Result<Vec<ControlValue>, Error> {
        controls(&self.0)
    }

    fn device(&self) -> Result<DeviceInfo, Error> {
        let gone = || Error::new(ErrorKind::Device, self.0.display(), "does not capture video any more");
        device_at(&self.0).ok_or_else(gone)
    }
}
