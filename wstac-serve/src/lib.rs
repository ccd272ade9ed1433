#![doc = include_str!("../README.md")]

mod access;
mod client;
mod connections;
mod guest;
mod http;
mod hub;
mod jobs;
mod order;
mod page;
mod sensor;
mod server;
mod tools;

pub use access::Token;
pub use sensor::ServedSensor;
pub use server::Server;
pub use tools::{CalibrationFile, ExaminedCamera, Tools, WriteFile};

/// The former name of [`ServedSensor`].
#[deprecated(since = "0.4.0", note = "use `ServedSensor`")]
pub type Sensor = ServedSensor;
