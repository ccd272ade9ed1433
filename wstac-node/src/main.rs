//! `wstac-node` publishes tactile sensors on a Zenoh network.
//!
//! Each sensor has two threads: `sensor` reads its source with `frames`, or its board with `board`, and `publisher`
//! sends what was found. Its handle makes messages between them, and `sums` those of taxels. A full queue makes it skip
//! messages, so that a slow network never holds up a sensor. `orders` are what services ask of a sensor. `ending` ends
//! all of it after a signal. `network` opens the session of Zenoh, `refused` has in words
//! what that refuses, and `threads` gives it enough threads. `records` and `message` are for any program that speaks
//! Zenoh, and `ros` is for nodes of ROS 2.

mod arguments;
mod board;
mod ending;
mod frames;
mod message;
mod network;
mod orders;
mod publisher;
mod queue;
mod records;
mod refused;
mod ros;
mod sensor;
mod strangers;
mod sums;
mod threads;

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::visible::OneLine;

use self::arguments::Arguments;
use self::ending::Ending;
use self::orders::Control;
use self::publisher::{Publisher, PublisherHandle};
use self::ros::publishers::RosPublishers;
use self::ros::services::Services;
use self::sensor::ConnectedSensor;

fn main() -> ExitCode {
    threads::prepare();
    let arguments = match arguments::parse() {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    let arguments = arguments.with_domain(std::env::var_os(arguments::DOMAIN).as_deref());
    match arguments.and_then(|arguments| run(&arguments)) {
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
    arguments.check_files()?;
    let models = ModelFile::open_all(&arguments.models)?;
    let sources = arguments.sensors()?;
    arguments.check_names(&sources)?;
    let mut sensors = Vec::new();
    for named in &sources {
        sensors.push(ConnectedSensor::open(named, arguments, &models)?);
    }
    let (network, about_network, connects) = network::open(arguments)?;
    note(about_network);
    strangers::watch(&network)?;
    let mut publishers = Vec::new();
    for (place, named) in sources.iter().enumerate() {
        publishers.push(Publisher::new(&network, arguments, &named.name, place)?);
    }
    let _node = arguments.ros.then(|| network::node_token(&network, arguments)).transpose()?;
    let (controls, orders): (Vec<_>, Vec<_>) =
        sources.iter().map(|named| Control::new(&named.name, &named.source.to_string_lossy(), arguments)).unzip();
    let first = RosPublishers::after(sources.len());
    let services = arguments.ros.then(|| Services::new(&network, arguments, &controls, first)).transpose()?;
    let (services, clerk) = services.unzip();
    let is_over = AtomicBool::new(false);
    let failures = thread::scope(|scope| {
        if let Some(clerk) = clerk {
            scope.spawn(move || clerk.run());
        }
        scope.spawn(|| network::watch(&network, &connects, &is_over));
        let threads: Vec<_> = sensors
            .into_iter()
            .zip(publishers)
            .zip(controls.iter().zip(orders))
            .enumerate()
            .map(|(place, ((sensor, publisher), (control, orders)))| {
                let handle = PublisherHandle::new(publisher.queue(), Arc::clone(&control.settings), arguments);
                let share = place as f64 / sources.len() as f64;
                scope.spawn(move || publisher.run());
                scope.spawn(move || {
                    let _reading = ending.reading(&control.name);
                    sensor.run(handle, &orders, share, ending.flag())
                })
            })
            .collect();
        let failures = threads.into_iter().map(|thread| thread.join().unwrap_or(false)).filter(|succeeded| !succeeded);
        let failures = failures.count();
        is_over.store(true, Ordering::Relaxed);
        // This ends the clerk.
        drop(services);
        failures
    });
    network::close(&network)?;
    if ending.flag().load(Ordering::Relaxed) {
        note("ended by a signal");
    }
    Ok(failures == 0)
}
