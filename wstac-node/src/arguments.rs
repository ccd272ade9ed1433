//! The arguments of the program.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::every_sensor::{self, every_sensor};
use wstac_host::source::names;
use wstac_host::source::open::OpenOptions;
use wstac_host::visible;

/// The variable of the environment that has the domain of ROS 2.
pub(crate) const DOMAIN: &str = "ROS_DOMAIN_ID";
/// Most bytes of an argument in a message about it, which may have it twice.
const LONGEST_ARGUMENT: usize = 150;

/// Publish tactile sensors on a Zenoh network
///
/// Taxel sums, features, motion, events and their ends become JSON objects under wstac/SENSOR/, which any program with a
/// library of Zenoh reads, or messages of ROS 2. Files and scenes are played at their own rates.
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

    /// Publish JSON under the keys below; this is the default without --ros
    #[arg(long)]
    zenoh: bool,

    /// Payloads of event, contact_end, motion, features and taxels under the keys below
    #[arg(long, value_name = "FORM", value_enum, default_value_t = Form::Json)]
    zenoh_encoding: Form,

    /// Publish messages of ROS 2, as rmw_zenoh does
    ///
    /// Topics are /wstac/SENSOR/event, contact_end, motion, features, taxels and picture, and /diagnostics. Nodes need
    /// RMW_IMPLEMENTATION=rmw_zenoh_cpp and the package wstac_msgs.
    #[arg(long)]
    pub(crate) ros: bool,

    /// Begin with pictures: every frame as sensor_msgs/Image under the topic picture (with --ros)
    ///
    /// The parameter SENSOR.picture changes it later.
    #[arg(long, requires = "ros")]
    pub(crate) picture: bool,

    /// The domain of ROS 2; by default that of ROS_DOMAIN_ID, or else 0
    #[arg(long = "domain", value_name = "N", value_parser = clap::value_parser!(u32).range(..=232))]
    given_domain: Option<u32>,

    /// `--domain`, else ROS_DOMAIN_ID.
    #[arg(skip)]
    pub(crate) domain: u32,

    /// The name of the node in ROS 2; each program of a domain needs its own
    #[arg(long, value_name = "NAME", default_value = "wstac_node", value_parser = node_name)]
    pub(crate) node_name: String,

    /// Let services read and write files of this folder (with --ros)
    ///
    /// They name configurations, models and recordings without folders. Without this, services that need a file refuse.
    /// With it, every frame of a camera is read, in place of the newest.
    #[arg(long, value_name = "FOLDER", requires = "ros")]
    pub(crate) files: Option<PathBuf>,

    /// Listen at this address of the network
    ///
    /// It is tcp/127.0.0.1:7447 by default, unless --ros or an address to connect to is given.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) listen: Vec<String>,

    /// Connect to a router or another program at this address
    ///
    /// If it is not there, the program tries again until it is. With --ros it is tcp/127.0.0.1:7447 by default, where
    /// the router of rmw_zenoh (ros2 run rmw_zenoh_cpp rmw_zenohd) listens.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) connect: Vec<String>,

    /// Read the settings of the network from this JSON5 file
    ///
    /// It is a configuration of Zenoh, which may have access control and multicast. What it does not name stays as it is
    /// without a file. --listen and --connect replace what it says about them.
    #[arg(long, value_name = "FILE")]
    pub(crate) zenoh_config: Option<PathBuf>,

    /// Begin all keys with this name instead of wstac
    ///
    /// With --ros, the namespace and the names of sensors have letters, digits and _, and no digit in front.
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

Services of ROS 2, with --ros:
  /wstac/SENSOR/restart_baseline, load_configuration, load_model,
  start_recording and stop_recording; parameters of /wstac_node

Network:
  Without an address, nothing leaves this machine. No multicast is
  sent and nobody looked for, unless --zenoh-config says so. TCP is
  the only transport that is built in.

Exit code: 1 if a source or file cannot be used or a source failed, 2
for wrong arguments, otherwise 0. SIGINT, SIGTERM and SIGHUP end it: at
the latest after 10 s, with 1 if a sensor is still waited for.
";

impl Arguments {
    /// Returns whether JSON is published.
    pub(crate) fn has_records(&self) -> bool {
        self.zenoh || !self.ros
    }

    /// Returns whether payloads that ROS 2 has a message for are such messages, under the keys of JSON.
    pub(crate) fn has_cdr_records(&self) -> bool {
        self.has_records() && self.zenoh_encoding == Form::Cdr
    }

    /// Takes the domain of the argument, or with --ros that of the environment. One that is empty is none, as in ROS 2.
    ///
    /// # Errors
    /// The environment has a domain that is no number.
    pub(crate) fn with_domain(mut self, environment: Option<&OsStr>) -> Result<Self, Error> {
        let environment = environment.filter(|text| self.ros && !text.is_empty());
        self.domain = match (self.given_domain, environment) {
            (Some(domain), _) => domain,
            (None, None) => 0,
            (None, Some(text)) => text.to_str().and_then(|text| text.parse().ok()).ok_or_else(|| {
                let message = format_args!("is {:?}, expected a number, or --domain N", text.to_string_lossy());
                Error::new(ErrorKind::Usage, DOMAIN, message)
            })?,
        };
        Ok(self)
    }

    /// Refuses names that ROS 2 does not know as such, if there are topics of ROS 2.
    ///
    /// # Errors
    /// The namespace or the name of a sensor has other characters than a name of ROS 2.
    pub(crate) fn check_names(&self, sensors: &[NamedSource]) -> Result<(), Error> {
        let parts = self.namespace.split('/').map(|part| ("the namespace", part));
        let mut names = parts.chain(sensors.iter().map(|sensor| ("the name of a sensor", &*sensor.name)));
        let Some((what, name)) = names.find(|(_, name)| self.ros && !is_name_of_ros(name)) else { return Ok(()) };
        let instead: String = name.chars().map(|part| if part.is_ascii_alphanumeric() { part } else { '_' }).collect();
        let instead = if is_name_of_ros(&instead) { instead } else { format!("s{instead}") };
        let message = format!(
            "has {name:?}, expected letters, digits and _, and no digit in front, as topics of ROS 2 have them; \
             help: {instead}"
        );
        Err(Error::new(ErrorKind::Usage, what, message))
    }

    /// Refuses a folder for services that is none.
    ///
    /// # Errors
    /// There is no such folder.
    pub(crate) fn check_files(&self) -> Result<(), Error> {
        let Some(folder) = self.files.as_deref().filter(|folder| !folder.is_dir()) else { return Ok(()) };
        let what = if folder.exists() { "is no folder" } else { "does not exist" };
        let message = format_args!("{what}, expected a folder for the files of services (--files)");
        Err(Error::new(ErrorKind::Usage, folder.display(), message))
    }

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

/// Checks the name of a node of ROS 2.
fn node_name(text: &str) -> Result<String, String> {
    let wrong = || "expected letters, digits and _, and no digit in front".to_owned();
    if is_name_of_ros(text) { Ok(text.to_owned()) } else { Err(wrong()) }
}

/// Returns whether a name can be a part of those of ROS 2.
fn is_name_of_ros(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        && text.bytes().next().is_some_and(|first| !first.is_ascii_digit())
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
    fn names_are_those_of_ros() {
        let check = |arguments: &[&str]| {
            let arguments = Arguments::try_parse_from(["wstac-node"].iter().chain(arguments)).unwrap();
            arguments.check_names(&arguments.sensors().unwrap()).map_err(|error| error.to_string())
        };
        assert_eq!(check(&["left-1=a.y4m", "--namespace", "hand/2-b"]), Ok(()));
        assert_eq!(check(&["left_1=a.y4m", "--ros", "--namespace", "hand/b2"]), Ok(()));
        for (arguments, part) in [
            (&["left-1=a.y4m", "--ros"][..], "the name of a sensor: has \"left-1\", expected letters, digits and _"),
            (&["left-1=a.y4m", "--ros"], "help: left_1"),
            (&["1=a.y4m", "--ros"], "help: s1"),
            (&["a.y4m", "--ros", "--namespace", "hand/left-2"], "the namespace: has \"left-2\""),
        ] {
            let said = check(arguments).unwrap_err();
            assert!(said.contains(part), "{said}");
        }
    }

    #[test]
    fn a_domain_of_the_environment_is_for_ros() {
        let domain = |more: &[&str], environment: Option<&str>| {
            let arguments = Arguments::try_parse_from(["wstac-node", "a.y4m"].iter().chain(more)).unwrap();
            let arguments = arguments.with_domain(environment.map(OsStr::new));
            arguments.map(|arguments| arguments.domain).map_err(|error| error.to_string())
        };
        for wrong in ["abc", "-1", " 3"] {
            assert_eq!(domain(&[], Some(wrong)), Ok(0));
            assert_eq!(domain(&["--ros", "--domain", "4"], Some(wrong)), Ok(4));
            let said = domain(&["--ros"], Some(wrong)).unwrap_err();
            assert_eq!(said, format!("ROS_DOMAIN_ID: is {wrong:?}, expected a number, or --domain N"));
        }
        assert_eq!([domain(&["--ros"], None), domain(&["--ros"], Some(""))], [Ok(0), Ok(0)]);
        assert_eq!(domain(&["--ros"], Some("7")), Ok(7));
    }

    #[test]
    fn services_have_a_folder_that_is_there() {
        let check = |folder: &str| {
            let arguments = Arguments::try_parse_from(["wstac-node", "a=1.y4m", "--ros", "--files", folder]).unwrap();
            arguments.check_files().map_err(|error| error.to_string())
        };
        assert_eq!(check("."), Ok(()));
        assert!(check("no-such-folder").unwrap_err().contains("no-such-folder: does not exist, expected a folder"));
        assert!(check("Cargo.toml").unwrap_err().contains("Cargo.toml: is no folder, expected a folder"));
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
