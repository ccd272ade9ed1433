#![doc = include_str!("../README.md")]

mod access;
mod client;
mod http;
mod hub;
mod page;
mod sensor;
mod server;

pub use access::Token;
pub use sensor::Sensor;
pub use server::Server;
