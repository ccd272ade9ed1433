//! Whether the baseline changes after its first 5m frames (SPEC §3, "Slow drift").
//!
//! The baseline stays fixed, or it tracks slow drift while nothing touches the sensor.
//!
//! A type parameter of [`Trigger`](crate::paper::trigger::Trigger) chooses the policy. A policy that is not chosen
//! takes neither code nor memory. A host that chooses at run time uses `Option<TrackingBaseline>`.

use crate::error::ConfigError;
use crate::paper::baseline::Baseline;
use crate::paper::trigger_config::TriggerConfig;
use crate::params::{FEATURES, LONGEST_FOLLOW, SAMPLE_FRAMES, SHORTEST_FOLLOW};

/// Decides what happens to the baseline. There are three: [`FixedBaseline`], [`TrackingBaseline`] and
/// `Option<TrackingBaseline>`.
pub trait BaselinePolicy: sealed::Sealed + Clone + core::fmt::Debug {
    /// Returns what tracks drift; `None` if nothing does.
    #[doc(hidden)]
    fn tracking(&mut self) -> Option<&mut TrackingBaseline>;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::FixedBaseline {}
    impl Sealed for super::TrackingBaseline {}
    impl Sealed for Option<super::TrackingBaseline> {}
}

/// Keeps the baseline of the first 5m frames (paper).
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FixedBaseline;

impl BaselinePolicy for FixedBaseline {
    #[inline]
    fn tracking(&mut self) -> Option<&mut TrackingBaseline> {
        None
    }
}

/// Lets the baseline track slow drift (decided).
///
/// After each complete window that did not fire, the baseline moves by 1/N of the window's distance from it. It moves
/// by at most 1/N of the trigger's margin, up or down. Then the thresholds are computed again. This is a low-pass
/// filter with a time constant of N windows, in integers whose remainders are kept. The ⌈35/m⌉ windows after a window
/// that fired are left out, because of the afterglow. Frames of a long gap are in no window.
///
/// A signal that rises by less than the margin within N windows counts as drift, whatever causes it. A press that slow
/// fires with [`FixedBaseline`], but not with this policy. A step fires as before. It is not tracked as long as its
/// windows fire.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackingBaseline {
    /// log2 N.
    shift: u8,
    /// Windows that are still to be left out.
    pause: u8,
    /// The remainder of each total's divisions, in units of 2^-11 / N.
    remainders: [i32; FEATURES],
}

impl TrackingBaseline {
    /// Creates a policy with a time constant of N windows: a power of two from 16 to 32768.
    ///
    /// # Errors
    /// Returns [`ConfigError::TrackingBaseline`] for another number.
    pub const fn new(windows: u32) -> Result<Self, ConfigError> {
        if !windows.is_power_of_two() || windows < SHORTEST_FOLLOW || windows > LONGEST_FOLLOW {
            return Err(ConfigError::TrackingBaseline(windows));
        }
        Ok(Self { shift: windows.ilog2() as u8, pause: 0, remainders: [0; FEATURES] })
    }

    /// Returns the time constant N, in windows.
    pub const fn windows(&self) -> u32 {
        1 << self.shift
    }

    /// Returns to the state before the first window.
    pub(crate) fn restart(&mut self) {
        (self.pause, self.remainders) = (0, [0; FEATURES]);
    }

    /// Takes note of a window that fired.
    pub(crate) fn fired(&mut self, config: &TriggerConfig) {
        self.pause = (SAMPLE_FRAMES as u8 / 2).div_ceil(config.window().max(1));
    }

    /// Takes a complete window that did not fire.
    pub(crate) fn quiet(
        &mut self,
        sums: &[i32; FEATURES],
        baseline: &mut Baseline,
        thresholds: &mut [i32; FEATURES],
        config: &TriggerConfig,
    ) {
        if self.pause > 0 {
            self.pause -= 1;
            return;
        }
        baseline.follow(sums, &mut self.remainders, u32::from(self.shift), config);
        *thresholds = baseline.thresholds(config);
    }
}

impl BaselinePolicy for TrackingBaseline {
    fn tracking(&mut self) -> Option<&mut Self> {
        Some(self)
    }
}

impl BaselinePolicy for Option<TrackingBaseline> {
    fn tracking(&mut self) -> Option<&mut TrackingBaseline> {
        self.as_mut()
    }
}
