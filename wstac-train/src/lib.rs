//! Texture models, data sets and speed laws: trainers' files in, model files and Rust out.

pub mod dataset;
pub mod fit;
pub mod model;
