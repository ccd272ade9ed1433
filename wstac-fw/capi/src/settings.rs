//! A pipeline's parameters, which may be changed before its first frame. What a program does not call it does not link: these take 64-bit
//! floating point.

use wstac_core::features::Floor;
use wstac_core::baseline_policy::TrackingBaseline;
use wstac_core::params::{
    AFTERGLOW_FRAMES, DEFAULT_BACKTRACK, DEFAULT_MARGIN, DEFAULT_MULTIPLIER, DEFAULT_WINDOW, FASTEST_FITTED,
    SLOWEST_FITTED, SPEED_INTERCEPT, SPEED_SLOPE, TRACK_LENGTH, VALID_THRESHOLD,
};
use wstac_core::speed::{Law, SpeedConfig, ThresholdOn};
use wstac_core::trigger::{Rule, TriggerConfig};

use crate::memory::{borrowed, give, value_mut};
use crate::pipeline::{State, WstacFwPipeline};
use crate::status::{WstacFwStatus, status};

/// When an event starts: `[trigger]` of a configuration file.
#[repr(C)]
pub struct WstacFwTrigger {
    /// Frames of a window, m: 1 to 70.
    pub window: u32,
    /// Multiplier b: 0 (with the signed rule 1) to below 65536.
    pub multiplier: f64,
    /// Frames of a sample before the window that fired, c: at most 5 m, and 70 - m.
    pub backtrack: u32,
    /// The paper's rule, b times the baseline, instead of the signed one.
    pub literal: bool,
    /// Least distance of the signed rule's threshold from the baseline, in units of a feature's natural logarithm a frame.
    pub margin: f64,
    /// Time constant of a baseline that follows drift, in windows: a power of two from 16 to 32768; 0 for one that is kept.
    pub follow: u32,
}

/// The law that makes a speed of a duration: `[speed]` of a configuration file.
#[repr(C)]
pub struct WstacFwSpeedLaw {
    /// D = 30 track / v + afterglow instead of D = intercept - slope log10 v, in frames at 30 a second.
    pub physical: bool,
    /// Intercept in frames; with `physical` the track in mm.
    pub intercept_or_track: f32,
    /// Slope in frames a decade; with `physical` the afterglow in frames.
    pub slope_or_afterglow: f32,
    /// A frame is lit where a row or column is brighter than this share of full scale: above 0, at most 5.
    pub threshold: f64,
    /// The threshold is compared with the light above the baseline instead of all light.
    pub above_baseline: bool,
    /// Slowest speed that the law was fitted on, in mm/s.
    pub slowest_mm_s: f32,
    /// Fastest speed that the law was fitted on, in mm/s.
    pub fastest_mm_s: f32,
}

/// A pipeline before its first frame.
///
/// # Safety
/// Null, or a pipeline's memory that nobody else uses meanwhile.
unsafe fn fresh<'a>(pipeline: *mut WstacFwPipeline) -> Result<&'a mut State, WstacFwStatus> {
    // SAFETY: the caller's.
    let state = unsafe { value_mut(pipeline) }?;
    if state.is_fresh() { Ok(state) } else { Err(WstacFwStatus::State) }
}

/// The default trigger, to change some of it.
///
/// # Safety
/// `trigger` is null or memory for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_trigger_defaults(trigger: *mut WstacFwTrigger) -> WstacFwStatus {
    let defaults = WstacFwTrigger {
        window: u32::from(DEFAULT_WINDOW),
        multiplier: DEFAULT_MULTIPLIER,
        backtrack: u32::from(DEFAULT_BACKTRACK),
        literal: false,
        margin: DEFAULT_MARGIN,
        follow: 0,
    };
    // SAFETY: the caller's.
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
        // SAFETY: the caller's.
        let state = unsafe { fresh(pipeline) }?;
        // SAFETY: the caller's.
        let keys = unsafe { borrowed(trigger) }?;
        let rule = if keys.literal { Rule::Literal } else { Rule::Signed };
        let config = TriggerConfig::new(keys.window, keys.multiplier, keys.backtrack, rule, keys.margin)?;
        let following = if keys.follow == 0 { None } else { Some(TrackingBaseline::new(keys.follow)?) };
        state.pipeline.set_trigger(config, following);
        Ok(WstacFwStatus::Ok)
    };
    status(set())
}

/// The default speed law, the paper's, or with `physical` the physical one, to change some of it.
///
/// # Safety
/// `law` is null or memory for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_speed_law_defaults(law: *mut WstacFwSpeedLaw, physical: bool) -> WstacFwStatus {
    let (first, second) = if physical { (TRACK_LENGTH, AFTERGLOW_FRAMES) } else { (SPEED_INTERCEPT, SPEED_SLOPE) };
    let defaults = WstacFwSpeedLaw {
        physical,
        intercept_or_track: first,
        slope_or_afterglow: second,
        threshold: VALID_THRESHOLD,
        above_baseline: false,
        slowest_mm_s: SLOWEST_FITTED,
        fastest_mm_s: FASTEST_FITTED,
    };
    // SAFETY: the caller's.
    status(unsafe { give(law, defaults) })
}

/// Sets the speed law of a pipeline that has not had a frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `law` is null or a law.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_set_speed_law(
    pipeline: *mut WstacFwPipeline,
    law: *const WstacFwSpeedLaw,
) -> WstacFwStatus {
    let set = || {
        // SAFETY: the caller's.
        let state = unsafe { fresh(pipeline) }?;
        // SAFETY: the caller's.
        let keys = unsafe { borrowed(law) }?;
        let (first, second) = (keys.intercept_or_track, keys.slope_or_afterglow);
        let law = if keys.physical {
            Law::Physical { track: first, afterglow: second }
        } else {
            Law::Published { intercept: first, slope: second }
        };
        let on = if keys.above_baseline { ThresholdOn::AboveBaseline } else { ThresholdOn::Absolute };
        let config = SpeedConfig::new(law, keys.threshold, on, state.pipeline.geometry().rate())?;
        state.speed = config.fitted_on(keys.slowest_mm_s, keys.fastest_mm_s)?;
        Ok(WstacFwStatus::Ok)
    };
    status(set())
}

/// Sets the darkness floor of a pipeline that has not had a frame: gray levels of a taxel, 0 to full scale; 0.5 where it is not set.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_set_floor(pipeline: *mut WstacFwPipeline, levels: f64) -> WstacFwStatus {
    let set = || {
        // SAFETY: the caller's.
        let state = unsafe { fresh(pipeline) }?;
        let floor = Floor::new(levels, state.pipeline.geometry().full_scale())?;
        state.pipeline.set_floor(floor)?;
        Ok(WstacFwStatus::Ok)
    };
    status(set())
}
