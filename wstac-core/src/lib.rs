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
//! | features → events | [`trigger`], [`baseline`], [`baseline_policy`], [`sample`] |
//! | event → answers | [`speed`], [`direction`], [`texture`] with a [`model`] |
//! | half an event → texture | [`early`] |
//! | all of it | [`pipeline`] |
//! | events → a host, with the feature `wire` | `wire` |
//!
//! ## Example
//! ```rust
//! use wstac_core::{direction, green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
//! use wstac_core::{speed::{self, SpeedConfig}, taxels::FrameGeometry};
//!
//! fn main() -> Result<(), wstac_core::error::Error> {
//!     let rate = FrameRate::NOMINAL; // 30 frames a second
//!     let camera = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, rate)?;
//!     let mut pipeline = Pipeline::builder(camera).build()?;
//!     let speed_config = SpeedConfig::published(rate);
//!     for t in 0..120 {
//!         // From your camera; here a bright stripe moves to the right. push_stripe takes some rows at a time.
//!         let mut frame = [1; 400 * 400];
//!         if (40..73).contains(&t) {
//!             frame.chunks_mut(400).for_each(|row| row[12 * (t - 40)..][..12].fill(200));
//!         }
//!         if let Some(event) = pipeline.push_frame(&frame)?.event() {
//!             println!("frame {}: {:?}", event.frame, speed::speed(&event, &speed_config));
//!             println!("{:?}", direction::direction(&event));
//!         }
//!     }
//!     Ok(())
//! }
//! ```
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
