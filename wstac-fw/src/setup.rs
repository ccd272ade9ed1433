//! What is compiled in: the configuration, the texture model and the pixel format that `WSTAC_CONFIG`, `WSTAC_MODEL` and `WSTAC_PIXELS`
//! named when this was built (`build.rs`), all checked by then.
#![allow(clippy::unreadable_literal)]

use wstac_core::error::Error;
use wstac_core::features::Floor;
use wstac_core::frame::Stride;
use wstac_core::green::any::PixelFormat;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::pipeline::{CheckedBuilder, Pipeline};
use wstac_core::rate::FrameRate;
use wstac_core::speed::{Law, SpeedConfig, ThresholdOn};
use wstac_core::taxels::FrameGeometry;
use wstac_core::trigger::{Rule, TriggerConfig};

include!(concat!(env!("OUT_DIR"), "/setup.rs"));

/// Checks the pipeline of this configuration for frames of this geometry.
///
/// # Errors
/// As [`PipelineBuilder::check`](wstac_core::pipeline::PipelineBuilder::check).
pub fn checked(geometry: FrameGeometry<Green>) -> Result<CheckedBuilder<Green, Ln, Following>, Error> {
    let builder = Pipeline::builder(geometry).floor(FLOOR).ln(Ln::default());
    builder.trigger(TRIGGER).baseline(FOLLOWING).check()
}

/// Builds the pipeline of this configuration for frames of this geometry.
///
/// # Errors
/// As [`checked`].
pub fn pipeline(geometry: FrameGeometry<Green>) -> Result<Pipeline<Green, Ln, Following>, Error> {
    Ok(checked(geometry)?.build())
}
