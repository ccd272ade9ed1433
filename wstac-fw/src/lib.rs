//! Firmware of a WSTac tactile sensor: the code that a board needs besides `wstac-core` to turn its own camera's frames
//! into events.
#![no_std]

#[cfg(test)]
extern crate std;

#[cfg(feature = "h743")]
pub mod bus;
pub mod crash_record;
#[cfg(feature = "emulated")]
pub mod emulated;
#[cfg(feature = "h743")]
pub mod link;
pub mod picture;
pub mod reader;
pub mod sccb;
pub mod self_test;
pub mod sensor;
#[cfg(feature = "h743")]
pub mod serial;
pub mod setup;
pub mod stripes;
pub mod textures;
