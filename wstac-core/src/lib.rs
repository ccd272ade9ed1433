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
//! | features → events | [`paper::trigger`], [`paper::baseline`], [`paper::baseline_policy`], [`paper::sample`] |
//! | event → speed, direction, kind of touch | [`law`]: [`touch::motion`], or [`paper::speed`] and [`paper::direction`] |
//! | event → texture | [`texture`] with a [`model`], and with textures that are [`learned`]; [`touch::path_sample`] |
//! | a held part → the onset of its slip | [`touch::slip`] |
//! | half an event → texture | [`paper::early`] |
//! | all of it | [`pipeline`] |
//! | why an answer is missing or not reliable | [`reason`] |
//! | events → a host, with the feature `wire` | `wire` |
//!
//! ## Example
//! ```rust
//! use wstac_core::{green::gray::Gray, law::{ByCoherence, EventLaw}, layout::{FrameSize, Layout}};
//! use wstac_core::{paper::trigger::TriggerConfig, pipeline::Pipeline, rate::FrameRate, taxels::FrameGeometry};
//! use wstac_core::touch::motion::MotionConfig;
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
//! None. Sizes, sums and indices are proven when a [`taxels::FrameGeometry`], a [`paper::trigger::TriggerConfig`] or a
//! [`paper::speed::SpeedConfig`] is built. Trees and weights are proven when a [`model::Model`] is. Slices are accessed
//! with checks whose other branch reads nothing.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate self as wstac_core;
#[cfg(test)]
extern crate std;

/// Returns what a result holds, or its error from the function around: `?` in a `const fn`.
macro_rules! attempt {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(error) => return Err(error),
        }
    };
}

pub mod crc;
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
pub mod paper;
pub mod params;
pub mod pipeline;
pub mod rate;
pub mod reason;
pub mod stream;
pub mod taxels;
pub mod texture;
pub mod touch;
#[cfg(feature = "wire")]
pub mod wire;

/// The former paths of modules, for one release.
macro_rules! former {
    ($new:ident, $note:literal, $($name:ident)*) => {$(
        #[doc(hidden)]
        #[deprecated(since = "0.4.0", note = $note)]
        pub mod $name {
            pub use crate::$new::$name::*;
        }
    )*};
}
former!(paper, "it is in `wstac_core::paper`", baseline baseline_policy direction early sample speed trigger);
former!(touch, "it is in `wstac_core::touch`", motion path_sample);

/// The example of README.md, tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
