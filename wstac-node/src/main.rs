//! `wstac-node` publishes tactile sensors on a Zenoh network.
//!
//! Each sensor has two threads: `sensor` reads its source, or `board` its board, and `publisher` sends what was found.
//! `outlet` makes messages between them. A full queue makes it skip messages, so that a slow network never holds up a
//! sensor. `network` opens the session of Zenoh, `records` and `message` are for any program that speaks Zenoh, and `ros`
//! is for nodes of ROS 2.

mod arguments;
mod board;
mod message;
mod network;
mod outlet;
mod publisher;
mod records;
mod ros;
mod sensor;

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use clap::Parser;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::visible::OneLine;

use self::arguments::Arguments;
use self::outlet::Outlet;
use self::publisher::Publisher;
use self::sensor::Sensor;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            note(format_args!("error: {error}"));
            if error.is_usage() { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}

/// Writes a line to standard error, which may be closed.
fn note(message: impl std::fmt::Display) {
    let _ = io::stderr().write_all(format!("wstac-node: {}\n", OneLine(message)).as_bytes());
}

/// Publishes all sensors to their ends. Returns whether none of them failed.
///
/// # Errors
/// A source, a file or the network cannot be used. Nothing was published.
fn run(arguments: &Arguments) -> Result<bool, Error> {
    let ends = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        // A second signal ends the program at once.
        let handlers = signal_hook::flag::register_conditional_shutdown(signal, 1, Arc::clone(&ends))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&ends)));
        handlers.map_err(|error| Error::io("signals", error))?;
    }
    let models = ModelFile::open_all(&arguments.models)?;
    let sources = arguments.sensors()?;
    let mut sensors = Vec::new();
    for (name, source) in &sources {
        sensors.push(Sensor::open(name, source, arguments, &models)?);
    }
    let (network, about_network) = network::open(arguments)?;
    note(about_network);
    let mut publishers = Vec::new();
    for (place, (name, _)) in sources.iter().enumerate() {
        publishers.push(Publisher::new(&network, arguments, name, place)?);
    }
    let _node = arguments.ros.then(|| network::node_token(&network, arguments)).transpose()?;
    let failures = thread::scope(|scope| {
        let threads: Vec<_> = sensors
            .into_iter()
            .zip(publishers)
            .zip(&sources)
            .map(|((sensor, publisher), (name, _))| {
                let (outlet, ends) = (Outlet::new(publisher.queue(), name, arguments), &ends);
                scope.spawn(move || publisher.run());
                scope.spawn(move || sensor.run(outlet, ends))
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap_or(false)).filter(|succeeded| !succeeded).count()
    });
    network::close(&network)?;
    if ends.load(Ordering::Relaxed) {
        note("ended by a signal");
    }
    Ok(failures == 0)
}
