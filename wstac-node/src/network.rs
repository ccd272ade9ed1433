//! The session of Zenoh.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::text_file::file_text;
use zenoh::{Config, Session, Wait};

use crate::arguments::Arguments;
use crate::note;
use crate::refused::refused;
use crate::threads;

/// The address of a program that connects to no other one.
const LOCAL: &str = "tcp/127.0.0.1:7447";

/// Opens the session. Returns a line about it for people, too, and the addresses that it connects to.
///
/// # Errors
/// A setting is wrong, or an address cannot be listened at. The error names it.
pub(crate) fn open(arguments: &Arguments) -> Result<(Session, String, String), Error> {
    let config = config(arguments)?;
    let (listens, connects) = (addresses(&config, "listen"), addresses(&config, "connect"));
    let all = [&listens[..], &connects[..]].concat().join(" ");
    let about = |error| refused(ErrorKind::Usage, format_args!("the network {all}"), &error);
    let session = zenoh::open(config).wait().map_err(about)?;
    let connects = connects.join(" ");
    let connected = if connects.is_empty() { String::new() } else { format!(", connects to {connects}") };
    let listens = if listens.is_empty() { "at no address".to_owned() } else { format!("at {}", listens.join(" ")) };
    let line = format!("{} listens {listens}{connected}; keys begin with {}/", session.zid(), arguments.namespace);
    Ok((session, line, connects))
}

/// The time that a connection may take before it is said that there is none, and the time between two looks at it.
const PATIENCE: Duration = Duration::from_secs(2);
const BETWEEN: Duration = Duration::from_millis(100);

/// Says when the session is connected to these addresses, and after some time that it is not yet. Returns when
/// `is_over` is set.
pub(crate) fn watch(session: &Session, connects: &str, is_over: &AtomicBool) {
    if connects.is_empty() {
        return;
    }
    let is_connected = || {
        let info = session.info();
        info.routers_zid().wait().next().is_some() || info.peers_zid().wait().next().is_some()
    };
    let (start, mut is_said) = (Instant::now(), false);
    while !is_connected() {
        if is_over.load(Ordering::Relaxed) {
            note(format_args!("was never connected to {connects}: nobody has heard it"));
            return;
        }
        if !is_said && start.elapsed() >= PATIENCE {
            is_said = true;
            note(format_args!("not connected to {connects} yet; it tries again until a router or program is there"));
        }
        thread::sleep(BETWEEN);
    }
    note(format_args!("connected to {connects}"));
}

/// Ends the session after what was published has been sent.
///
/// # Errors
/// The session did not end as it should.
pub(crate) fn close(session: &Session) -> Result<(), Error> {
    threads::release_connections();
    session.close().wait().map_err(|error| refused(ErrorKind::Io, "the network", &error))
}

/// Returns the addresses that the session listens at or connects to, in any mode.
fn addresses(config: &Config, kind: &str) -> Vec<String> {
    let text = config.get_json(&format!("{kind}/endpoints")).unwrap_or_default();
    let found = serde_json::from_str(&text).unwrap_or(Value::Null);
    let all = |list: &Value| list.as_array().cloned().unwrap_or_default();
    let of = |list: &Value| all(list).iter().filter_map(Value::as_str).map(str::to_owned).collect::<Vec<_>>();
    match &found {
        Value::Object(modes) => modes.values().flat_map(of).collect(),
        list => of(list),
    }
}

/// Returns the settings of the session: safe ones, over which go those of the file, and then those of the arguments.
fn config(arguments: &Arguments) -> Result<Config, Error> {
    let path = arguments.zenoh_config.as_deref();
    let file = path.map(read).transpose()?.unwrap_or_else(|| json!({}));
    for (option, endpoints) in [("--listen", &arguments.listen), ("--connect", &arguments.connect)] {
        if let Some(endpoint) = endpoints.iter().find(|endpoint| !endpoint.starts_with("tcp/")) {
            let message = "expected tcp/ADDRESS:PORT: TCP is the only transport that is built in";
            return Err(Error::new(ErrorKind::Usage, format_args!("{option} is \"{endpoint}\""), message));
        }
    }
    let names = |kind: &str| file.get(kind).is_some_and(|part| part.get("endpoints").is_some());
    let is_told = !arguments.listen.is_empty() || !arguments.connect.is_empty() || names("listen") || names("connect");
    let local = if is_told { json!([]) } else { json!([LOCAL]) };
    let safe = json!({
        "mode": "peer",
        // Nothing is sent to or asked of anybody who is not named.
        "scouting": {"multicast": {"enabled": false}, "gossip": {"enabled": false}},
        // A router may come later, or come back.
        "connect": {"timeout_ms": -1, "exit_on_failure": false, "endpoints": []},
        // Without addresses, Zenoh would listen to the whole network.
        "listen": {"exit_on_failure": true, "endpoints": local},
        // A subscriber that is late for half a second misses nothing of 100 sensors: 16 batches of 64 kB, the most
        // there is. Of what arrives, only requests are read, and the longest of them has 64 kB. Whoever takes nothing
        // for half a second, while what must not be lost waits for it, is cut off.
        "transport": {
            "unicast": {"accept_timeout": 2000, "accept_pending": 256, "max_sessions": 128},
            "link": {
                "tx": {"queue": {
                    "size": {"data": 16, "interactive_high": 16},
                    "congestion_control": {"block": {"wait_before_close": 500_000}},
                }},
                "rx": {"max_message_size": 1 << 20},
            },
        },
    });
    let wrong = |error| Error::with_cause(ErrorKind::Config, "the network's safe settings", error);
    let mut settings: Value = serde_json::from_str(&Config::default().to_string()).map_err(wrong)?;
    merge(&mut settings, safe);
    merge(&mut settings, file);
    for (kind, endpoints) in [("listen", &arguments.listen), ("connect", &arguments.connect)] {
        if !endpoints.is_empty() {
            merge(&mut settings, json!({ kind: {"endpoints": endpoints} }));
        }
    }
    let name = path.map_or("the network's safe settings".into(), Path::to_string_lossy);
    let about = |error: zenoh::Error| refused(ErrorKind::Config, name, &error);
    Config::from_json5(&settings.to_string()).map_err(about)
}

fn read(path: &Path) -> Result<Value, Error> {
    let text = file_text(path)?;
    let wrong = |message: String| Error::new(ErrorKind::Config, path.display(), message);
    // The parser draws the place on lines of their own.
    let one_line = |error: json5::Error| error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    let settings: Value = json5::from_str(&text).map_err(|error| wrong(one_line(error)))?;
    if settings.is_object() { Ok(settings) } else { Err(wrong("has no settings, expected {…}".to_owned())) }
}

/// Replaces the settings that `named` has, and keeps all others.
fn merge(settings: &mut Value, named: Value) {
    match (settings, named) {
        (Value::Object(settings), Value::Object(named)) => {
            for (name, value) in named {
                merge(settings.entry(name).or_insert(Value::Null), value);
            }
        }
        (setting, value) => *setting = value,
    }
}
