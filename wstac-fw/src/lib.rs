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
#[cfg(feature = "settings")]
pub mod flash;
#[cfg(feature = "settings")]
pub mod keeper;
#[cfg(all(feature = "h743", not(feature = "settings")))]
#[path = "fixed_keeper.rs"]
pub mod keeper;
#[cfg(feature = "h743")]
pub mod link;
pub mod picture;
pub mod reader;
pub mod sccb;
pub mod self_test;
pub mod sensor;
#[cfg(feature = "h743")]
pub mod serial;
#[cfg(any(feature = "settings", test))]
pub mod settings;
pub mod setup;
pub mod stripes;
pub mod textures;
