#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | content |
//! | --- | --- |
//! | [`dataset`] | samples of simulated and recorded slides, and their files |
//! | [`model`] | models of other trainers, written as model files or as Rust |
//! | [`train`] | linear texture models, trained here |

pub mod dataset;
pub mod model;
pub mod train;
