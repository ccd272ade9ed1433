#![doc = include_str!("../README.md")]

mod access;
mod client;
mod http;
mod hub;
mod jobs;
mod order;
mod page;
mod sensor;
mod server;
mod tools;

pub use access::Token;
pub use sensor::Sensor;
pub use server::Server;
pub use tools::{CalibrationFile, ExaminedCamera, Tools, WriteFile};
