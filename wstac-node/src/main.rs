//! `wstac-node` publishes tactile sensors on a Zenoh network.
//!
//! Each sensor has two threads: `sensor` reads its source, and `publisher` sends what was found. Its handle makes
//! messages between them. A full queue makes it skip messages, so that a slow network never holds up a sensor.
//! `ending` ends all of it after a signal. `network` opens the session of Zenoh, `refused` has in words what that
//! refuses, and `threads` gives it enough threads. `records` and `message` are what is published, and `ros` has the
//! form that nodes of ROS 2 read. `removed` are options of before.

mod arguments;
mod ending;
mod message;
mod network;
mod publisher;
mod queue;
mod records;
mod refused;
mod removed;
mod ros;
mod sensor;
mod strangers;
mod threads;

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::visible::OneLine;

use self::arguments::Arguments;
use self::ending::Ending;
use self::publisher::{Publisher, PublisherHandle};
use self::sensor::ConnectedSensor;

fn main() -> ExitCode {
    threads::prepare();
    let arguments = match arguments::parse() {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            note(format_args!("error: {error}"));
            if error.kind() == ErrorKind::Usage { ExitCode::from(2) } else { ExitCode::FAILURE }
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
    let ending = &Ending::of_program()?;
    let models = ModelFile::open_all(&arguments.models)?;
    let sources = arguments.sensors()?;
    let mut sensors = Vec::new();
    for named in &sources {
        sensors.push(ConnectedSensor::open(named, arguments, &models)?);
    }
    let (network, about_network, connects) = network::open(arguments)?;
    note(about_network);
    strangers::watch(&network)?;
    let mut publishers = Vec::new();
    for named in &sources {
        publishers.push(Publisher::new(&network, arguments, &named.name)?);
    }
    let is_over = AtomicBool::new(false);
    let failures = thread::scope(|scope| {
        scope.spawn(|| network::watch(&network, &connects, &is_over));
        let threads: Vec<_> = sensors
            .into_iter()
            .zip(publishers)
            .zip(&sources)
            .enumerate()
            .map(|(place, ((sensor, publisher), named))| {
                let handle = PublisherHandle::new(publisher.queue(), &named.name, arguments);
                let share = place as f64 / sources.len() as f64;
                scope.spawn(move || publisher.run());
                scope.spawn(move || {
                    let _reading = ending.reading(&named.name);
                    sensor.run(handle, share, ending.flag())
                })
            })
            .collect();
        let failures = threads.into_iter().map(|thread| thread.join().unwrap_or(false)).filter(|succeeded| !succeeded);
        let failures = failures.count();
        is_over.store(true, Ordering::Relaxed);
        failures
    });
    network::close(&network)?;
    if ending.flag().load(Ordering::Relaxed) {
        note("ended by a signal");
    }
    Ok(failures == 0)
}
