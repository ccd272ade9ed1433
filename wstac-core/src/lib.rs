//! Frames of a WSTac tactile sensor → 25 taxel sums → ten features → events → sliding speed, direction and texture.
//!
//! In these pages, "SPEC" is `docs/SPEC.md` of the repository: the arithmetic, with published and decided numbers.
//! "Paper" is the published description of the sensor that it quotes.
//!
//! The crate is `no_std`, allocates nothing, and uses integers from the camera to the event.
//!
//! Unsafe code is only in kernels, beside plain ones that they are tested to equal. Some sum bytes: on a Cortex-M
//! (`green/byte_sums/`), and on a host with AVX2 or NEON (`green/avx2/`, `green/neon/`). Others are for texture models:
//! `descent`, `dot`, their calls in `forest.rs` and `boosted.rs`, and a cast in `model/bytes.rs`.
//!
//! Construction validates. Running takes what construction allows, and can fail only on bytes that are not a frame.
//!
//! | stage | module |
//! | --- | --- |
//! | positions of taxels | [`layout`] |
//! | pixel bytes → green sums | [`green`], [`taxels`] |
//! | sums → features | [`ln`], [`features`], [`stream`] |
//! | features → events | [`trigger`], [`baseline`], [`baseline_policy`], [`sample`] |
//! | event → speed, direction and kind of touch | [`law`]: [`motion`], or as published [`speed`] and [`direction`] |
//! | event → texture | [`texture`] with a [`model`], and with textures that are [`learned`] |
//! | half an event → texture | [`early`] |
//! | all of it | [`pipeline`] |
//! | why an answer is missing or not reliable | [`reason`] |
//! | events → a host, with the feature `wire` | `wire` |
//!
//! ## Example
//! ```rust
//! use wstac_core::{green::gray::Gray, law::{ByCoherence, EventLaw}, layout::{FrameSize, Layout}, motion::MotionConfig};
//! use wstac_core::{pipeline::Pipeline, rate::FrameRate, taxels::FrameGeometry, trigger::TriggerConfig};
//!
//! fn main() -> Result<(), wstac_core::error::Error> {
//!     let rate = FrameRate::NOMINAL; // 30 frames per second
//!     let camera = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, rate)?;
//!     let trigger = TriggerConfig::default().one_event_per_touch();
//!     let mut pipeline = Pipeline::builder(camera).trigger(trigger).build()?;
//!     let law = ByCoherence(MotionConfig::published(rate));
//!     for t in 0..120 {
//!         // From your camera; here a bright stripe moves to the right. push_stripe takes some rows at a time.
//!         let mut frame = [1; 400 * 400];
//!         if (40..73).contains(&t) {
//!             frame.chunks_mut(400).for_each(|row| row[12 * (t - 40)..][..12].fill(200));
//!         }
//!         if let Some(event) = pipeline.push_frame(&frame)?.event() {
//!             // A slide at 18 mm/s to the right.
//!             println!("frame {}: {:?}", event.frame, law.answer(&event));
//!         }
//!     }
//!     Ok(())
//! }
//! ```
//!
//! ## Panics
//! None. Sizes, sums and indices are proven when a [`taxels::FrameGeometry`], a [`trigger::TriggerConfig`] or a
//! [`speed::SpeedConfig`] is built. Trees and weights are proven when a [`model::Model`] is. Slices are accessed with
//! checks whose other branch reads nothing.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate self as wstac_core;
#[cfg(test)]
extern crate std;

pub mod baseline;
pub mod baseline_policy;
pub mod crc;
pub mod direction;
pub mod early;
pub mod error;
mod exp;
pub mod features;
pub mod fixed;
pub mod frame;
pub mod green;
pub mod law;
pub mod layout;
pub mod learned;
pub mod ln;
pub mod model;
pub mod motion;
pub mod params;
pub mod path_sample;
pub mod pipeline;
pub mod rate;
pub mod reason;
pub mod sample;
pub mod speed;
pub mod stream;
pub mod taxels;
pub mod texture;
mod touch_state;
pub mod trigger;
mod trigger_config;
#[cfg(feature = "wire")]
pub mod wire;

/// The example of README.md, tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
