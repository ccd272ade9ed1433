//! Host side of WSTac: sources of frames, a simulated sensor, and the `wstac` command.

pub mod calibrate;
pub mod camera;
pub mod cli;
pub mod config;
pub mod dataset;
pub mod doctor;
pub mod error;
#[cfg(feature = "capi")]
pub mod ffi;
pub mod fit;
pub mod model;
pub mod monitor;
pub mod plot;
mod protobuf;
mod rate;
pub mod reading;
pub mod record;
pub mod scene;
pub mod source;
mod svg;
pub mod texture;
pub mod trade;
pub mod view;
mod whole_file;
