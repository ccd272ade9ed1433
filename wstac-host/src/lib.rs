//! Tactile events of a WSTac sensor on a host: sources of frames, sessions, recordings, configuration and model files.

#[cfg(feature = "builtin-models")]
mod builtin_models;
pub mod camera;
pub mod config;
pub mod error;
pub mod model_file;
#[cfg(feature = "board")]
pub mod monitor;
pub mod protobuf;
pub mod reading;
#[cfg(feature = "mcap")]
pub mod record;
pub mod source;
pub mod texture;
pub mod whole_file;
