//! Tactile events of a WSTac sensor on a host: sources of frames, sessions, recordings, configuration and model files.

mod builtin_models;
pub mod camera;
pub mod config;
pub mod error;
pub mod json;
pub mod model_file;
pub mod monitor;
pub mod output;
pub mod protobuf;
pub mod rate;
pub mod record;
pub mod session;
pub mod source;
pub mod texture;
pub mod whole_file;
