//! The arguments of the program.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use wstac_host::error::Error;
use wstac_host::source::every_sensor::{self, every_sensor};
use wstac_host::source::names;
use wstac_host::source::open::OpenOptions;
use wstac_host::visible;

use crate::{note, removed};

/// Most bytes of an argument in a message about it, which may have it twice.
const LONGEST_ARGUMENT: usize = 150;

/// Publish tactile sensors on a Zenoh network
///
/// Taxel sums, features, motion, events and their ends become JSON objects under wstac/SENSOR/, which any program with
/// a library of Zenoh reads. The node of ROS 2 is wstac_ros. Files and scenes are played at their own rates.
#[derive(Debug, Parser)]
#[command(name = "wstac-node", version, after_long_help = HELP, max_term_width = 100)]
pub(crate) struct Arguments {
    /// Camera, board, recording or scene; several as NAME=SOURCE
    ///
    /// Sources are those of wstac run (/dev/videoN, scene:Saw3@150, FILE.y4m, FILE.mcap, a folder of PNG or JPEG files)
    /// and the boards of wstac monitor (/dev/ttyACM0, tcp:HOST:PORT). One source without a name is called sensor. Of a
    /// recording of several sensors, all are published under their own names; NAME=FILE.mcap is the one of this name.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<OsString>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    #[arg(long = "model", value_name = "FILE.wsm")]
    pub(crate) models: Vec<PathBuf>,

    /// Bits per second of all serial devices; 115200 by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) baud: Option<u32>,

    #[command(flatten)]
    pub(crate) camera: OpenOptions,

    /// Payloads of event, contact_end, slip, motion, features and taxels under the keys below
    #[arg(long, value_name = "FORM", value_enum, default_value_t = Form::Json)]
    pub(crate) zenoh_encoding: Form,

    /// Listen at this address of the network
    ///
    /// It is tcp/127.0.0.1:7447 by default, unless an address to connect to is given.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) listen: Vec<String>,

    /// Connect to a router or another program at this address
    ///
    /// If it is not there, the program tries again until it is.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) connect: Vec<String>,

    /// Read the settings of the network from this JSON5 file
    ///
    /// It is a configuration of Zenoh, which may have access control and multicast. What it does not name stays as it
    /// is without a file. --listen and --connect replace what it says about them.
    #[arg(long, value_name = "FILE")]
    pub(crate) zenoh_config: Option<PathBuf>,

    /// Begin all keys with this name instead of wstac
    #[arg(long, value_name = "NAME", default_value = "wstac", value_parser = namespace)]
    pub(crate) namespace: String,
}

/// The form of payloads that both JSON and ROS 2 have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Form {
    /// JSON objects, as wstac run prints them
    Json,
    /// The messages of ROS 2, in CDR behind four bytes of header
    Cdr,
}

const HELP: &str = r"Keys under wstac/SENSOR/, with the JSON objects of wstac run --json:
  event        a tactile event; its number, from 0, is attached
  event/*      answers with the last 1000 events under their numbers
  contact_end  the end of an event's touch
  slip         a held part begins to slip
  texture      a texture that is known before its event
  incomplete   an event that a gap interrupted
  motion       speed and direction while something slides
  features     ten features of every frame
  fault        a fault of the camera
  end          the end of the source
  taxels       25 taxel sums of every frame; boards have none
  state        once a second: frames, events, skipped messages
A token of liveliness at wstac/SENSOR says that a sensor is there.

Network:
  Without an address, nothing leaves this machine. No multicast is
  sent and nobody looked for, unless --zenoh-config says so. TCP is
  the only transport that is built in.

Exit code: 1 if a source or file cannot be used or a source failed, 2
for wrong arguments, otherwise 0. SIGINT, SIGTERM and SIGHUP end it: at
the latest after 10 s, with 1 if a sensor is still waited for.
";

impl Arguments {
    /// Returns all sensors: of a recording of several, each one.
    ///
    /// # Errors
    /// A name is invalid or taken, one of several sources has none, or a recording cannot be read.
    pub(crate) fn sensors(&self) -> Result<Vec<NamedSource>, Error> {
        let all = every_sensor(&names::sensors(&self.sources)?)?;
        let named = |sensor: every_sensor::NamedSource| NamedSource {
            name: sensor.name.unwrap_or_else(|| "sensor".to_owned()),
            source: sensor.source,
            recorded: sensor.recorded,
        };
        Ok(all.into_iter().map(named).collect())
    }
}

/// A sensor with its name, and where it is read from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NamedSource {
    pub(crate) name: String,
    pub(crate) source: OsString,
    /// The sensor of a recording of several.
    pub(crate) recorded: Option<String>,
}

/// Parses the arguments of the program, or prints help, or what is wrong with them.
///
/// # Errors
/// The exit code, if the program ends here.
pub(crate) fn parse() -> Result<Arguments, ExitCode> {
    let error = match Arguments::try_parse() {
        Ok(arguments) => return Ok(arguments),
        Err(error) => error,
    };
    if !error.use_stderr() {
        return Err(if error.print().is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    if let Some(instead) = removed::answer(&error) {
        note(format_args!("error: {instead}"));
        return Err(ExitCode::from(2));
    }
    // The message is about the arguments as they can be shown: without characters that control a terminal, and short.
    let shown =
        |given: OsString| visible::shortened(&visible::line(&given.to_string_lossy()), LONGEST_ARGUMENT).into_owned();
    let error = Arguments::try_parse_from(std::env::args_os().map(shown)).err().unwrap_or(error);
    // Nobody may read it; the exit code still reports the failure.
    let _ = error.print();
    Err(ExitCode::from(2))
}

/// Checks the beginning of all keys: names between slashes, without the characters that Zenoh gives a meaning.
fn namespace(text: &str) -> Result<String, String> {
    let is_name = |name: &str| {
        !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-')
    };
    let wrong = || "expected letters, digits, - and _, with / between names".to_owned();
    if text.split('/').all(is_name) { Ok(text.to_owned()) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn sensors(sources: &[&str]) -> Result<Vec<(String, String)>, String> {
        let arguments = ["wstac-node"].iter().chain(sources);
        let found = Arguments::try_parse_from(arguments).unwrap().sensors().map_err(|error| error.to_string())?;
        Ok(found.into_iter().map(|named| (named.name, named.source.into_string().unwrap())).collect())
    }

    #[test]
    fn a_sensor_has_the_name_before_the_equals_sign() {
        let pair = |name: &str, source: &str| (name.to_owned(), source.to_owned());
        assert_eq!(sensors(&["scene:Saw3@150,seed=2"]).unwrap(), [pair("sensor", "scene:Saw3@150,seed=2")]);
        assert_eq!(sensors(&["./a=b.y4m"]).unwrap(), [pair("sensor", "./a=b.y4m")]);
        let two = sensors(&["left=/dev/video0", "cam:right=scene:Saw3@150,seed=2"]).unwrap();
        assert_eq!(two, [pair("left", "/dev/video0"), pair("right", "scene:Saw3@150,seed=2")]);
    }

    #[test]
    fn a_namespace_has_no_wildcards() {
        assert!(["wstac", "hand/left-1"].iter().all(|text| namespace(text).is_ok()));
        assert!(["", "a//b", "a/*", "$x"].iter().all(|text| namespace(text).is_err()));
    }

    #[test]
    fn help_fits_a_terminal() {
        Arguments::command().debug_assert();
        assert!(HELP.lines().all(|line| line.len() <= 72));
    }
}
