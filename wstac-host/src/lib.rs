//! Tactile events of a WSTac sensor on a host: sources of frames, sessions, recordings, configuration and model files.

pub mod atomic_write;
mod builtin_models;
pub mod camera;
pub mod config;
pub mod error;
pub mod model_file;
pub mod monitor;
pub mod rate;
pub mod reading;
pub mod record;
pub mod source;
pub mod statistics;
pub mod texture;
