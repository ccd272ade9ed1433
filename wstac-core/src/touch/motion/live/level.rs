//! The light of all lines while something slides on all whiskers. It grows with the speed.
//!
//! If all ten lines become brighter or darker by the same factor, the speed has changed by that factor. A texture makes
//! lines brighter at different times, and an edge that leaves makes some of them dark. Where its period is in step with
//! the whiskers, all lines along the motion rise at once; their mean over the path of a pitch does not.

use crate::paper::sample::Sample;
use crate::params::{FEATURE_FRACTION_BITS, FEATURES};

/// Fraction bits of mean features beyond those of features.
const EXTRA_BITS: u32 = 4;
/// One, as a sum of ten mean features.
const ONE: i32 = FEATURES as i32 * (1 << (FEATURE_FRACTION_BITS + EXTRA_BITS));
/// The change of the mean feature that counts, and the one that counts while the speed changes.
const CHANGES: [i32; 2] = [ONE / 10, ONE / 50];
/// The change from which on it is no other speed: what touches arrives or leaves.
const LARGEST: i32 = ONE / 2;
/// Frames until a change has passed the mean: this many, and so many times the slowness.
const PASSED: [f32; 2] = [4.0, 3.0];
/// Most frames of a mean: a slide has no slowness above this.
const MOST: f32 = 13.0;
/// The sum of the weights of a mean.
const WEIGHTS: i32 = 1 << 12;
/// Frames after all lines are lit until all are bright.
const LEAST_WAIT: f32 = 2.0;

/// The light of ten lines, and that at which the slowness was known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// The mean features at which the slowness was known.
    reference: [i32; FEATURES],
    /// Frames until all whiskers are touched, then frames until the reference holds.
    waits: [u8; 2],
    /// Frames in which a further change counts sooner.
    changing: u8,
    /// Whether light has changed as by no speed. Then nothing is known until the touch ends.
    is_lost: bool,
}

/// A number above that of any speed: its deviation is above the largest.
const LOST: f32 = 1.0;

impl Level {
    /// Creates the level of a touch whose ten lines are lit, by the slowness of rows and columns.
    pub(super) fn new([rows, columns]: [f32; 2], slowness: f32) -> Self {
        let touched = (4.0 * rows.abs().min(columns.abs())).max(LEAST_WAIT);
        let waits = [touched as u8, libm::ceilf(slowness.clamp(1.0, MOST)) as u8];
        Self { reference: [0; FEATURES], waits, changing: 0, is_lost: false }
    }

    pub(super) fn is_whole(&self) -> bool {
        self.waits[0] == 0
    }

    /// Takes the newest frame, the slowness, and the number of frames since the last. Returns the natural logarithm of
    /// the factor by which light has grown, 0 if lines do not share it, and whether the speed has changed by it.
    pub(super) fn push(&mut self, recent: Sample<'_>, slowness: f32, frames: u8) -> (f32, bool) {
        let [touched, settled] = &mut self.waits;
        if *touched > 0 {
            *touched = touched.saturating_sub(frames);
            return (0.0, false);
        }
        let means = means(recent, slowness);
        if *settled > 0 {
            *settled = settled.saturating_sub(frames);
            self.reference = means;
            return (0.0, false);
        }
        let changes = means.iter().zip(&self.reference).map(|(mean, reference)| mean - reference);
        let sum: i32 = changes.clone().sum();
        // Every line has changed by at least half of the mean.
        let is_shared = changes.into_iter().all(|change| if sum > 0 { 20 * change > sum } else { 20 * change < sum });
        self.changing = self.changing.saturating_sub(frames);
        self.is_lost |= is_shared && sum.abs() >= LARGEST;
        let has_changed = is_shared && sum.abs() > CHANGES[usize::from(self.changing > 0)];
        if has_changed && !self.is_lost {
            self.changing = (PASSED[0] + PASSED[1] * slowness) as u8;
            self.reference = means;
        }
        let number = if is_shared { sum as f32 / ONE as f32 } else { 0.0 };
        if self.is_lost { (LOST, false) } else { (number, has_changed) }
    }
}

/// Returns the mean features over the newest frames, in which the surface has moved by a pitch: at least one frame.
fn means(recent: Sample<'_>, slowness: f32) -> [i32; FEATURES] {
    let frames = slowness.clamp(1.0, MOST);
    let weight = (WEIGHTS as f32 / frames) as i32;
    let rest = WEIGHTS - weight * frames as i32;
    let oldest = recent.len().saturating_sub(frames as usize);
    let mut sums = [0; FEATURES];
    for frame in recent.between(oldest, recent.len()).into_iter().flatten() {
        for (sum, &feature) in sums.iter_mut().zip(frame) {
            *sum += i32::from(feature);
        }
    }
    let before = oldest.checked_sub(1).and_then(|before| recent.frame(before)).unwrap_or(&[0; FEATURES]);
    for (sum, &feature) in sums.iter_mut().zip(before) {
        // At most 2^15 · 2^12.
        *sum = (*sum * weight + i32::from(feature) * rest) >> (12 - EXTRA_BITS);
    }
    sums
}
