//! The compiled-in configuration, texture model, pixel format and frame rate.
//!
//! `WSTAC_CONFIG`, `WSTAC_MODEL`, `WSTAC_PIXELS`, `WSTAC_FPS`, `WSTAC_MHZ` and `WSTAC_REST` named them when this was
//! built (`build.rs`), which has checked all of them.
#![allow(clippy::unreadable_literal)]

use wstac_core::error::ConfigError;
use wstac_core::features::Floor;
use wstac_core::frame::Stride;
use wstac_core::green::any::PixelFormat;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::speed::{SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{Rule, TriggerConfig};
use wstac_core::pipeline::{CheckedBuilder, Pipeline};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, ReadoutTime};

include!(concat!(env!("OUT_DIR"), "/setup.rs"));

/// The frame rate of the sensors, as `WSTAC_FPS` says.
pub const RATE: FrameRate = match FrameRate::new(FPS, 1) {
    Ok(rate) => rate,
    Err(_) => panic!("checked by the build script"),
};

/// The type of the board's pipeline.
pub type BoardPipeline = Pipeline<GreenChannel, Ln, BaselinePolicy, Taxels>;

/// Checks the pipeline of this configuration for frames of this geometry.
///
/// # Errors
/// Returns the errors of [`PipelineBuilder::check`](wstac_core::pipeline::PipelineBuilder::check).
pub fn checked(
    geometry: FrameGeometry<GreenChannel>,
) -> Result<CheckedBuilder<GreenChannel, Ln, BaselinePolicy, Taxels>, ConfigError> {
    checked_with(geometry, FLOOR, TRIGGER)
}

/// Checks the pipeline of this configuration with another floor and trigger.
///
/// # Errors
/// Returns the errors of [`PipelineBuilder::check`](wstac_core::pipeline::PipelineBuilder::check).
pub fn checked_with(
    geometry: FrameGeometry<GreenChannel>,
    floor: Floor,
    trigger: TriggerConfig,
) -> Result<CheckedBuilder<GreenChannel, Ln, BaselinePolicy, Taxels>, ConfigError> {
    let builder = Pipeline::builder(geometry).floor(floor).ln(Ln::default());
    builder.trigger(trigger).baseline(FOLLOWING).taxels().check()
}

/// Builds the pipeline of this configuration for frames of this geometry.
///
/// # Errors
/// Returns the errors of [`checked`].
pub fn pipeline(geometry: FrameGeometry<GreenChannel>) -> Result<BoardPipeline, ConfigError> {
    Ok(checked(geometry)?.build())
}
