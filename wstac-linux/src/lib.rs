//! Host side of WSTac: sources of frames, a simulated sensor, and the `wstac` command.

pub mod calibrate;
pub mod camera;
pub mod cli;
pub mod config;
pub mod dataset;
pub mod error;
pub mod model;
pub mod monitor;
pub mod reading;
pub mod scene;
pub mod source;
pub mod texture;
pub mod trade;
