//! Firmware of a WSTac tactile sensor: what a board needs beside `wstac-core` to turn its own camera's frames into events.
#![no_std]

#[cfg(feature = "emulated")]
pub mod emulated;
pub mod setup;
