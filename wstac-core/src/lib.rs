//! Frames of a WSTac tactile sensor → 25 taxel sums → ten features → events → sliding speed, direction and texture.
//!
//! "SPEC" in these pages is `docs/SPEC.md` of the repository: the arithmetic, with what is published and what was
//! decided. "Paper" is the published description of the sensor that it quotes.
//!
//! `no_std`, no allocation, integers from the camera to the event; unsafe code in kernels alone, beside plain ones that they are tested to equal: sums
//! of bytes on a Cortex-M (`green/byte_sums/`) and on a host with AVX2 (`green/avx2/`), and for texture models `descent`, `dot`, the calls of these in `forest.rs` and `boosted.rs`, and a
//! cast in `model/bytes.rs`. Construction validates; running takes what construction allows and cannot fail on anything else than bytes that
//! are not a frame.
//!
//! | stage | module |
//! | --- | --- |
//! | where taxels are | [`layout`] |
//! | pixel bytes → green sums | [`green`], [`taxels`] |
//! | sums → features | [`ln`], [`features`], [`stream`] |
//! | features → events | [`trigger`], [`baseline`], [`following`], [`sample`] |
//! | event → answers | [`speed`], [`direction`], [`texture`] with a [`model`] |
//! | half an event → texture | [`early`] |
//! | all of it | [`pipeline`] |
//! | events → a host, with the feature `wire` | `wire` |
//!
//! ## Panics
//! None. Sizes, sums and indices are proven when a [`taxels::FrameGeometry`], a [`trigger::TriggerConfig`] or a
//! [`speed::SpeedConfig`] is built, trees and weights when a [`model::Model`] is; slices are taken with checked access whose other branch reads nothing.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate self as wstac_core;
#[cfg(test)]
extern crate std;

pub mod baseline;
pub mod baseline_policy;
pub mod direction;
pub mod early;
pub mod error;
mod exp;
pub mod features;
pub mod fixed;
pub mod frame;
pub mod green;
pub mod layout;
pub mod ln;
pub mod model;
pub mod params;
pub mod pipeline;
pub mod rate;
mod ring;
pub mod sample;
pub mod speed;
pub mod stream;
pub mod taxels;
pub mod texture;
pub mod trigger;
mod trigger_config;
#[cfg(feature = "wire")]
pub mod wire;

/// The example of README.md, tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
