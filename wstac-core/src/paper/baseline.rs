//! The baseline η, its thresholds, and how it moves if it tracks drift (SPEC §3).

use crate::features::Features;
use crate::fixed::Q16;
use crate::paper::trigger_config::{Rule, TriggerConfig};
use crate::params::{BASELINE_WINDOWS, FEATURE_FRACTION_BITS, FEATURE_ONE, FEATURES};

/// 2^-11 in units of 2^-27 / 5. In that unit η, thresholds and margins are all integers.
const UNIT: i64 = (BASELINE_WINDOWS as i64) << 16;

/// Holds what the sensor showed before contact: ten totals over the baseline's 5m frames.
///
/// The mean window sum is η_k = total_k / 5; the mean feature is total_k / 5m. Totals keep both exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Baseline {
    totals: [i32; FEATURES],
    frames: u16,
}

impl Baseline {
    /// Creates a baseline from its totals, in units of 2^-11, over `frames` frames (5 to 350). It is for tests and
    /// recordings.
    pub fn new(totals: [i32; FEATURES], frames: u16) -> Self {
        Self { totals, frames }
    }

    pub(crate) fn empty() -> Self {
        Self { totals: [0; FEATURES], frames: 0 }
    }

    pub(crate) fn add(&mut self, features: &Features) {
        add(&mut self.totals, features);
        self.frames += 1;
    }

    /// Returns the sum of each feature over the baseline's frames, in units of 2^-11.
    pub fn totals(&self) -> &[i32; FEATURES] {
        &self.totals
    }

    /// Returns the number of frames of the baseline: 5m, or fewer while it is being gathered.
    pub fn frames(&self) -> u16 {
        self.frames
    }

    /// Returns each feature's mean over the baseline's frames, with `fraction_bits` (11 to 20) fraction bits, rounded
    /// down.
    pub(crate) fn means(&self, fraction_bits: u32) -> [i32; FEATURES] {
        self.totals.map(|total| self.mean(total, fraction_bits))
    }

    /// Returns the mean of one feature, as [`Self::means`] does; `None` if there is no such feature.
    #[inline(never)]
    pub(crate) fn mean_of(&self, feature: usize, fraction_bits: u32) -> Option<i32> {
        self.totals.get(feature).map(|&total| self.mean(total, fraction_bits))
    }

    fn mean(&self, total: i32, fraction_bits: u32) -> i32 {
        // |total| < 2^15 · 350, so 64 bits hold it; the quotient is within the range of a feature.
        let scaled = i64::from(total) << (fraction_bits - FEATURE_FRACTION_BITS);
        let mean = scaled.checked_div_euclid(i64::from(self.frames)).unwrap_or(0);
        // A recorded baseline may hold any numbers. A mean of features is within the range of a feature.
        let most = 1_i64 << (15 + fraction_bits - FEATURE_FRACTION_BITS);
        mean.clamp(-most, most - 1) as i32
    }

    /// Returns whether a feature is more than `distance` above its mean.
    #[inline(never)]
    pub(crate) fn is_below(&self, features: &[i16], distance: i16) -> bool {
        let frames = i64::from(self.frames);
        let above = |(&feature, &total)| (i64::from(feature) - i64::from(distance)) * frames > i64::from(total);
        features.iter().zip(&self.totals).any(above)
    }

    /// Returns the trigger's margin around η for a total, in units of 2^-27 / 5: how far above η a window sum must be.
    fn margin(total: i32, config: &TriggerConfig) -> i64 {
        let beyond_one = (i64::from(config.multiplier().bits()) - i64::from(Q16::ONE.bits())).abs();
        let relative = beyond_one * i64::from(total.abs());
        match config.rule() {
            Rule::Literal => relative,
            Rule::Signed => {
                let frames = i64::from(config.window()) * i64::from(BASELINE_WINDOWS);
                relative.max(frames * i64::from(config.margin().bits()) * i64::from(FEATURE_ONE))
            }
        }
    }

    /// Returns the highest window sum of each feature that does not fire, in units of 2^-11.
    pub(crate) fn thresholds(&self, config: &TriggerConfig) -> [i32; FEATURES] {
        // W fires if W · 5 · 2^16 > total · 2^16 + margin.
        self.totals.map(|total| {
            let threshold = match config.rule() {
                Rule::Literal => i64::from(config.multiplier().bits()) * i64::from(total),
                Rule::Signed => (i64::from(total) << 16) + Self::margin(total, config),
            };
            threshold.div_euclid(UNIT).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
        })
    }

    /// Moves every total towards five windows like this one (`sums`).
    ///
    /// A total moves by 2^-shift of the difference, and by at most 2^-shift of the margin. The remainder of each
    /// division stays in `remainders`, 0 to 2^shift − 1 each, so that no difference is too small to count.
    pub(crate) fn follow(
        &mut self,
        sums: &[i32; FEATURES],
        remainders: &mut [i32; FEATURES],
        shift: u32,
        config: &TriggerConfig,
    ) {
        for ((total, remainder), &sum) in self.totals.iter_mut().zip(remainders).zip(sums) {
            let most = (Self::margin(*total, config) >> 16).min(i64::from(i32::MAX)) as i32;
            // |sum| ≤ 70 · 2^15, and a total never exceeds five times the sum that it moves to. Everything fits 26
            // bits.
            let difference = (BASELINE_WINDOWS as i32 * sum - *total).max(-most).min(most);
            let moved = *remainder + difference;
            *total += moved >> shift;
            *remainder = moved & ((1 << shift) - 1);
        }
    }

    /// Returns whether the five window sums, `lowest` to `highest`, lie within the trigger's margin.
    pub(crate) fn is_quiet(&self, lowest: &[i32; FEATURES], highest: &[i32; FEATURES], config: &TriggerConfig) -> bool {
        self.totals
            .iter()
            .zip(lowest.iter().zip(highest))
            .all(|(&total, (&low, &high))| i64::from(high - low) * UNIT <= Self::margin(total, config))
    }
}

/// Adds the features of a frame to sums.
pub(crate) fn add(sums: &mut [i32; FEATURES], features: &Features) {
    for (sum, feature) in sums.iter_mut().zip(features) {
        *sum += i32::from(*feature);
    }
}
