//! A pipeline's parameters, which may be changed before its first frame. A program links only the functions that it
//! calls: these use 64-bit floating point.

use wstac_core::features::Floor;
use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::speed::{Law, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{Rule, TriggerConfig};
use wstac_core::params::{
    DEFAULT_BACKTRACK, DEFAULT_MARGIN, DEFAULT_MULTIPLIER, DEFAULT_WINDOW, FASTEST_FITTED, SLOWEST_FITTED,
    SPEED_INTERCEPT, SPEED_SLOPE, VALID_THRESHOLD,
};

use crate::memory::{borrowed, give, value_mut};
use crate::pipeline::{PipelineState, WstacFwPipeline};
use crate::status::{WstacFwBool, WstacFwStatus, choice, status};

/// The parameters of the trigger: `[trigger]` of a configuration file.
#[repr(C)]
pub struct WstacFwTrigger {
    /// The number of frames of a window, m: 1 to 70.
    pub window: u32,
    /// The multiplier b: 0 (with the signed rule 1) to below 65536.
    pub multiplier: f64,
    /// The number of frames of a sample before the window that fired, c: at most 5 m, and 70 - m.
    pub backtrack: u32,
    /// Whether the paper's rule, b times the baseline, is used instead of the signed one.
    pub literal: WstacFwBool,
    /// The least distance of the signed rule's threshold from the baseline, in units of a feature's natural logarithm
    /// per frame.
    pub margin: f64,
    /// The time constant of a tracking baseline, in windows: a power of two from 16 to 32768; 0 for a fixed baseline.
    pub follow: u32,
    /// Whether a touch is one event, however long it is, as with `law = "arrival"`. Otherwise it is another event after
    /// each 70 frames, as published.
    pub one_event_per_touch: WstacFwBool,
}

/// The law from a duration D, in frames at 30 per second, to a speed v in mm/s: D = intercept - slope log10 v. It is
/// `[speed]` of a configuration file with `law = "published"`.
#[repr(C)]
pub struct WstacFwSpeedLaw {
    /// The intercept in frames.
    pub intercept: f32,
    /// The slope in frames per decade, above 0.
    pub slope: f32,
    /// The threshold: a frame is lit if a row or column is brighter than this fraction of full scale. It is above 0 and
    /// at most 5.
    pub threshold: f64,
    /// Whether the threshold is compared with the light above the baseline instead of all light.
    pub above_baseline: WstacFwBool,
    /// The slowest speed that the law was fitted on, in mm/s.
    pub slowest_mm_s: f32,
    /// The fastest speed that the law was fitted on, in mm/s.
    pub fastest_mm_s: f32,
}

/// Returns a pipeline before its first frame.
///
/// # Safety
/// `pipeline` is null, or a pipeline's memory that no other code uses meanwhile.
unsafe fn fresh<'a>(pipeline: *mut WstacFwPipeline) -> Result<&'a mut PipelineState, WstacFwStatus> {
    // SAFETY: the caller guarantees it.
    let state = unsafe { value_mut(pipeline) }?;
    if state.is_fresh() { Ok(state) } else { Err(WstacFwStatus::State) }
}

/// Writes the default trigger, so that a program can change parts of it.
///
/// # Safety
/// `trigger` is null or memory for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_trigger_defaults(trigger: *mut WstacFwTrigger) -> WstacFwStatus {
    let defaults = WstacFwTrigger {
        window: u32::from(DEFAULT_WINDOW),
        multiplier: DEFAULT_MULTIPLIER,
        backtrack: u32::from(DEFAULT_BACKTRACK),
        literal: 0,
        margin: DEFAULT_MARGIN,
        follow: 0,
        one_event_per_touch: 1,
    };
    // SAFETY: the caller guarantees it.
    status(unsafe { give(trigger, defaults) })
}

/// Sets the trigger of a pipeline that has not had a frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `trigger` is null or a trigger.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_set_trigger(
    pipeline: *mut WstacFwPipeline,
    trigger: *const WstacFwTrigger,
) -> WstacFwStatus {
    let set = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { fresh(pipeline) }?;
        // SAFETY: the caller guarantees it.
        let keys = unsafe { borrowed(trigger) }?;
        let rule = if choice(keys.literal)? { Rule::Literal } else { Rule::Signed };
        let config = TriggerConfig::new(keys.window, keys.multiplier, keys.backtrack, rule, keys.margin)?;
        let config = if choice(keys.one_event_per_touch)? { config.one_event_per_touch() } else { config };
        let following = if keys.follow == 0 { None } else { Some(TrackingBaseline::new(keys.follow)?) };
        state.pipeline.set_trigger(config, following);
        Ok(WstacFwStatus::Ok)
    };
    status(set())
}

/// Writes the published law of durations, so that a program can change parts of it.
///
/// # Safety
/// `law` is null or memory for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_speed_law_defaults(law: *mut WstacFwSpeedLaw) -> WstacFwStatus {
    let defaults = WstacFwSpeedLaw {
        intercept: SPEED_INTERCEPT,
        slope: SPEED_SLOPE,
        threshold: VALID_THRESHOLD,
        above_baseline: 0,
        slowest_mm_s: SLOWEST_FITTED,
        fastest_mm_s: FASTEST_FITTED,
    };
    // SAFETY: the caller guarantees it.
    status(unsafe { give(law, defaults) })
}

/// Sets the law of durations, which wstac_fw_speed answers by, of a pipeline that has not had a frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `law` is null or a law.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_set_speed_law(
    pipeline: *mut WstacFwPipeline,
    law: *const WstacFwSpeedLaw,
) -> WstacFwStatus {
    let set = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { fresh(pipeline) }?;
        // SAFETY: the caller guarantees it.
        let keys = unsafe { borrowed(law) }?;
        let law = Law { intercept: keys.intercept, slope: keys.slope };
        let on = if choice(keys.above_baseline)? { ThresholdOn::AboveBaseline } else { ThresholdOn::Absolute };
        let config = SpeedConfig::new(law, keys.threshold, on, state.pipeline.geometry().rate())?;
        state.speed = config.fitted_on(keys.slowest_mm_s, keys.fastest_mm_s)?;
        Ok(WstacFwStatus::Ok)
    };
    status(set())
}

/// Sets the darkness floor of a pipeline that has not had a frame.
///
/// It is in gray levels of a taxel, 0 to full scale; 0.5 if it is not set.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_set_floor(pipeline: *mut WstacFwPipeline, levels: f64) -> WstacFwStatus {
    let set = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { fresh(pipeline) }?;
        let floor = Floor::new(levels, state.pipeline.geometry().full_scale())?;
        state.pipeline.set_floor(floor)?;
        Ok(WstacFwStatus::Ok)
    };
    status(set())
}
