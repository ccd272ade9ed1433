//! What becomes of the baseline after its 5m frames: it is kept, or it follows slow drift while nothing touches (SPEC §3, "Slow drift").
//!
//! A type parameter of [`Trigger`](crate::trigger::Trigger) chooses: what is not asked for takes neither code nor memory. A host that chooses when it
//! runs has `Option<Follow>`.

use crate::baseline::Baseline;
use crate::error::Error;
use crate::params::{FEATURES, LONGEST_FOLLOW, SAMPLE_FRAMES, SHORTEST_FOLLOW};
use crate::trigger_config::TriggerConfig;

/// What becomes of the baseline. There are three: [`FixedBaseline`], [`TrackingBaseline`] and `Option<Follow>`.
pub trait BaselinePolicy: sealed::Sealed + Clone + core::fmt::Debug {
    /// The same before its first window.
    #[doc(hidden)]
    #[must_use]
    fn anew(&self) -> Self;

    /// A window has fired.
    #[doc(hidden)]
    fn fired(&mut self, config: &TriggerConfig);

    /// A window that did not fire is complete.
    #[doc(hidden)]
    fn quiet(
        &mut self,
        sums: &[i32; FEATURES],
        baseline: &mut Baseline,
        thresholds: &mut [i32; FEATURES],
        config: &TriggerConfig,
    );
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::FixedBaseline {}
    impl Sealed for super::TrackingBaseline {}
    impl Sealed for Option<super::TrackingBaseline> {}
}

/// The first 5m frames' baseline stays (paper).
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FixedBaseline;

impl BaselinePolicy for FixedBaseline {
    #[inline]
    fn anew(&self) -> Self {
        Self
    }

    #[inline]
    fn fired(&mut self, _: &TriggerConfig) {}

    #[inline]
    fn quiet(&mut self, _: &[i32; FEATURES], _: &mut Baseline, _: &mut [i32; FEATURES], _: &TriggerConfig) {}
}

/// The baseline follows slow drift (decided).
///
/// After each complete window that did not fire the baseline moves by 1/N of the window's distance from it, at most by 1/N of the
/// trigger's own margin either way, and the thresholds are worked out anew: a low pass with a time constant of N windows, in integers whose
/// remainders are kept. The ⌈35/m⌉ windows after one that fired are left out (afterglow). Frames of a long gap are in no window.
///
/// What is so slow that it rises by less than the margin within N windows is drift, whatever causes it: a press that slow fires with
/// [`FixedBaseline`], and not with this. A step fires as before, and is not followed as long as its windows fire.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackingBaseline {
    /// log2 N.
    shift: u8,
    /// Windows to leave out.
    pause: u8,
    /// What divisions left of each total, in units of 2^-11 / N.
    remainders: [i32; FEATURES],
}

impl TrackingBaseline {
    /// A time constant of N windows, a power of two from 16 to 32768.
    ///
    /// # Errors
    /// [`Error::TrackingBaseline`] for another number.
    pub const fn new(windows: u32) -> Result<Self, Error> {
        if !windows.is_power_of_two() || windows < SHORTEST_FOLLOW || windows > LONGEST_FOLLOW {
            return Err(Error::TrackingBaseline(windows));
        }
        Ok(Self { shift: windows.ilog2() as u8, pause: 0, remainders: [0; FEATURES] })
    }

    /// The time constant N, in windows.
    pub const fn windows(&self) -> u32 {
        1 << self.shift
    }
}

impl BaselinePolicy for TrackingBaseline {
    fn anew(&self) -> Self {
        Self { shift: self.shift, pause: 0, remainders: [0; FEATURES] }
    }

    fn fired(&mut self, config: &TriggerConfig) {
        self.pause = (SAMPLE_FRAMES as u8 / 2).div_ceil(config.window().max(1));
    }

    fn quiet(
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

impl BaselinePolicy for Option<TrackingBaseline> {
    fn anew(&self) -> Self {
        self.as_ref().map(TrackingBaseline::anew)
    }

    fn fired(&mut self, config: &TriggerConfig) {
        if let Some(follow) = self {
            follow.fired(config);
        }
    }

    fn quiet(
        &mut self,
        sums: &[i32; FEATURES],
        baseline: &mut Baseline,
        thresholds: &mut [i32; FEATURES],
        config: &TriggerConfig,
    ) {
        if let Some(follow) = self {
            follow.quiet(sums, baseline, thresholds, config);
        }
    }
}
