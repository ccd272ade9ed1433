//! The session of Zenoh.

use wstac_host::error::{Error, ErrorKind};
use zenoh::liveliness::LivelinessToken;
use zenoh::{Config, Session, Wait};

use crate::arguments::Arguments;
use crate::ros::names;

/// The address of a program that connects to no other one, and the one at which nodes of ROS 2 meet.
const LOCAL: &str = "tcp/127.0.0.1:7447";

/// Opens the session.
///
/// # Errors
/// A setting is wrong, or an address cannot be listened at. The error names it.
pub(crate) fn open(arguments: &Arguments) -> Result<Session, Error> {
    let addresses = format!("{:?} {:?}", arguments.listen, arguments.connect);
    let about = |error| Error::new(ErrorKind::Usage, format_args!("the network {addresses}"), error);
    zenoh::open(config(arguments)?).wait().map_err(about)
}

/// Ends the session after what was published has been sent.
///
/// # Errors
/// The session did not end as it should.
pub(crate) fn close(session: &Session) -> Result<(), Error> {
    session.close().wait().map_err(|error| Error::new(ErrorKind::Io, "the network", error))
}

/// Returns a line about the network for people.
pub(crate) fn described(session: &Session, arguments: &Arguments) -> String {
    let connects = connects(arguments);
    let connected = if connects.is_empty() { String::new() } else { format!(", connects to {}", connects.join(" ")) };
    let listens = listens(arguments);
    let listens = if listens.is_empty() { "at no address".to_owned() } else { format!("at {}", listens.join(" ")) };
    format!("{} listens {listens}{connected}; keys begin with {}/", session.zid(), arguments.namespace)
}

/// Returns the addresses to listen at, if the arguments decide about that.
fn listens(arguments: &Arguments) -> Vec<String> {
    if is_told_nothing(arguments) && !arguments.ros { vec![LOCAL.to_owned()] } else { arguments.listen.clone() }
}

/// Returns the addresses to connect to, if the arguments decide about that.
fn connects(arguments: &Arguments) -> Vec<String> {
    if is_told_nothing(arguments) && arguments.ros { vec![LOCAL.to_owned()] } else { arguments.connect.clone() }
}

fn is_told_nothing(arguments: &Arguments) -> bool {
    arguments.listen.is_empty() && arguments.connect.is_empty() && arguments.zenoh_config.is_none()
}

/// Declares the token that tells nodes of ROS 2 of this one.
///
/// # Errors
/// The network refuses it.
pub(crate) fn node_token(session: &Session, arguments: &Arguments) -> Result<LivelinessToken, Error> {
    let token = names::node_token(arguments.domain, &session.zid().to_string());
    let refused = |error| Error::new(ErrorKind::Usage, "the node's token", error);
    session.liveliness().declare_token(token).wait().map_err(refused)
}

/// Returns the settings of the session.
fn config(arguments: &Arguments) -> Result<Config, Error> {
    let refused = |key: &str, error| Error::new(ErrorKind::Usage, format_args!("the network's setting {key}"), error);
    let mut config = match &arguments.zenoh_config {
        Some(path) => Config::from_file(path).map_err(|error| Error::new(ErrorKind::Config, path.display(), error))?,
        None => Config::default(),
    };
    let mut set = |key: &str, value: String| config.insert_json5(key, &value).map_err(|error| refused(key, error));
    if arguments.zenoh_config.is_none() {
        set("mode", "\"peer\"".to_owned())?;
        // Nothing is sent to or asked of anybody who is not named.
        set("scouting/multicast/enabled", "false".to_owned())?;
        set("scouting/gossip/enabled", "false".to_owned())?;
        // A router may come later, or come back.
        set("connect/timeout_ms", "-1".to_owned())?;
        set("connect/exit_on_failure", "false".to_owned())?;
        set("listen/exit_on_failure", "true".to_owned())?;
    }
    let is_given = arguments.zenoh_config.is_none() || !arguments.listen.is_empty();
    if is_given {
        set("listen/endpoints", in_json(&listens(arguments)))?;
    }
    if arguments.zenoh_config.is_none() || !arguments.connect.is_empty() {
        set("connect/endpoints", in_json(&connects(arguments)))?;
    }
    Ok(config)
}

fn in_json(endpoints: &[String]) -> String {
    serde_json::json!(endpoints).to_string()
}
