//! Tests of several crates together, without the command: golden vectors, properties, extremes, error bounds.

mod doubts;
mod drift;
mod early;
mod error_bounds;
mod extremes;
mod extremes_in_time;
mod extremes_of_answers;
mod golden_vectors;
mod host;
mod jpeg;
mod learn;
mod path_models;
mod picture;
mod properties;
mod serialized;
mod taxel_models;
