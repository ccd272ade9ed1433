//! The light of all lines while something slides on all whiskers. It grows with the speed.
//!
//! If all ten lines become brighter or darker by the same factor, the speed has changed by that factor. A texture makes
//! lines brighter at different times, and an edge that leaves makes some of them dark.

use crate::features::Features;
use crate::params::{FEATURE_FRACTION_BITS, FEATURES};

/// Fraction bits of smoothed features beyond those of features.
const EXTRA_BITS: u32 = 4;
/// One, as a sum of ten smoothed features.
const ONE: i32 = FEATURES as i32 * (1 << (FEATURE_FRACTION_BITS + EXTRA_BITS));
/// The change of the mean feature that counts, and the one that counts while the speed changes.
const CHANGES: [i32; 2] = [ONE / 10, ONE / 50];
/// Frames until a change has passed the smoothing: this many, and so many times the slowness.
const SMOOTHED: [f32; 2] = [4.0, 3.0];
/// Frames after all lines are lit until all are bright.
const LEAST_WAIT: f32 = 2.0;

/// The light of ten lines, and that at which the slowness was known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// Features, smoothed over about the time in which the surface moves by a pitch.
    smoothed: [i32; FEATURES],
    /// The smoothed features at which the slowness was known.
    reference: [i32; FEATURES],
    /// Frames until all whiskers are touched, then frames until the reference holds.
    waits: [u8; 2],
    /// Frames in which a further change counts sooner.
    changing: u8,
}

/// A change of the mean feature that all lines share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// The natural logarithm of the factor by which light has grown; 0 if lines do not share it.
    pub number: f32,
    /// The logarithm in units of 2^-11, if it is so large that the speed has changed.
    pub large: Option<i16>,
}

const NO_CHANGE: Change = Change { number: 0.0, large: None };

impl Level {
    /// Creates the level of a touch whose ten lines are lit, by the slowness of rows and columns.
    pub(super) fn new([rows, columns]: [f32; 2], slowness: f32) -> Self {
        let touched = (4.0 * rows.abs().min(columns.abs())).max(LEAST_WAIT);
        let waits = [touched as u8, (libm::ceilf(0.5 * slowness) as u8).saturating_sub(1)];
        Self { smoothed: [0; FEATURES], reference: [0; FEATURES], waits, changing: 0 }
    }

    pub(super) fn is_whole(&self) -> bool {
        self.waits[0] == 0
    }

    /// Takes the features of a frame, the slowness, and the number of frames since the last.
    pub(super) fn push(&mut self, features: &Features, slowness: f32, frames: u8) -> Change {
        let [touched, settled] = &mut self.waits;
        if *touched > frames {
            *touched -= frames;
            return NO_CHANGE;
        }
        let weight = if *touched > 0 { 256 } else { (256.0 / (1.0 + slowness)) as i32 };
        let (mut sum, mut lowest, mut highest) = (0, i32::MAX, i32::MIN);
        for ((smoothed, &reference), &feature) in self.smoothed.iter_mut().zip(&self.reference).zip(features) {
            *smoothed += (((i32::from(feature) << EXTRA_BITS) - *smoothed) * weight) >> 8;
            let change = *smoothed - reference;
            (sum, lowest, highest) = (sum + change, lowest.min(change), highest.max(change));
        }
        if *touched > 0 || *settled > 0 {
            *settled = settled.saturating_sub(if *touched > 0 { 0 } else { frames });
            *touched = 0;
            self.reference = self.smoothed;
            return NO_CHANGE;
        }
        // Every line has changed by at least half of the mean.
        let is_shared = if sum > 0 { 20 * lowest > sum } else { 20 * highest < sum };
        let number = if is_shared { sum as f32 / ONE as f32 } else { 0.0 };
        self.changing = self.changing.saturating_sub(frames);
        if is_shared && sum.abs() > if self.changing > 0 { CHANGES[1] } else { CHANGES[0] } {
            self.changing = (SMOOTHED[0] + SMOOTHED[1] * slowness) as u8;
            self.reference = self.smoothed;
            return Change { number, large: Some((sum / (FEATURES as i32 * (1 << EXTRA_BITS))) as i16) };
        }
        Change { number, large: None }
    }
}
