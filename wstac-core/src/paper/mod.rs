//! The published algorithm: windows of ten features fire a trigger, which captures a sample of 10 × 70 features. The
//! duration of its light gives the speed, and the order in which rows and columns light up one of four directions.

pub mod baseline;
pub mod baseline_policy;
pub mod direction;
pub mod early;
pub mod sample;
pub mod speed;
pub mod trigger;
pub(crate) mod trigger_config;
