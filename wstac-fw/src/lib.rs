//! Firmware of a WSTac tactile sensor: what a board needs beside `wstac-core` to turn its own camera's frames into events.
#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod sccb;
pub mod sensor;
pub mod stripes;
pub mod window;
