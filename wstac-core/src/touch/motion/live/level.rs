//! The light of all lines while something slides on all whiskers. It grows with the speed.
//!
//! If all ten lines become brighter or darker by the same factor, the speed has changed by that factor. An edge that
//! leaves makes some of them dark, and a texture makes lines brighter at different times. If the texture's period is in
//! step with the whiskers, all lines rise at once, but their mean over the path of a pitch stays.

use crate::paper::sample::Sample;
use crate::params::{FEATURE_FRACTION_BITS, FEATURES};
use crate::touch::motion::MOST_SLOWNESS;

/// Fraction bits of mean features beyond those of features.
const EXTRA_BITS: u32 = 4;
/// One, as a sum of ten mean features.
const ONE: i32 = FEATURES as i32 * (1 << (FEATURE_FRACTION_BITS + EXTRA_BITS));
/// The change of the mean feature that counts, and the one that counts while the speed changes.
const CHANGES: [i32; 2] = [ONE / 10, ONE / 50];
/// A change that counts is below this: from here on, what touches stops or leaves.
const LARGEST: i32 = ONE / 2;
/// Frames until a change has passed the mean: this many, and so many times the slowness.
const PASSED: [f32; 2] = [4.0, 3.0];
/// The sum of the weights of a mean is a power of two of this exponent.
const WEIGHT_BITS: u32 = 12;
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
    /// Whether a change was too large. Then nothing is known until the touch ends.
    is_lost: bool,
}

impl Level {
    /// Creates the level of a touch whose ten lines are lit, by the slowness of rows and columns.
    pub(super) fn new([rows, columns]: [f32; 2], slowness: f32) -> Self {
        let touched = (4.0 * rows.abs().min(columns.abs())).max(LEAST_WAIT);
        let waits = [touched as u8, libm::ceilf(slowness.clamp(1.0, MOST_SLOWNESS)) as u8];
        Self { reference: [0; FEATURES], waits, changing: 0, is_lost: false }
    }

    pub(super) fn is_whole(&self) -> bool {
        self.waits[0] == 0
    }

    /// Takes the newest frame, the slowness, whether it is along a diagonal, where an edge that leaves lights all lines
    /// alike, and the number of frames since the last. Returns the natural logarithm of the factor by which light has
    /// grown, 0 if lines do not share it, and infinite once it was too large; and whether the speed has changed by it.
    pub(super) fn push(&mut self, recent: Sample<'_>, slowness: f32, is_diagonal: bool, frames: u8) -> (f32, bool) {
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
        self.is_lost |= is_shared && sum.abs() >= if is_diagonal { CHANGES[0] } else { LARGEST };
        if self.is_lost {
            return (f32::INFINITY, false);
        }
        let has_changed = is_shared && sum.abs() > CHANGES[usize::from(self.changing > 0)];
        if has_changed {
            self.changing = (PASSED[0] + PASSED[1] * slowness) as u8;
            self.reference = means;
        }
        (if is_shared { sum as f32 / ONE as f32 } else { 0.0 }, has_changed)
    }
}

/// Returns the mean features over the newest frames, in which the surface has moved by a pitch: at least one frame.
fn means(recent: Sample<'_>, slowness: f32) -> [i32; FEATURES] {
    let frames = slowness.clamp(1.0, MOST_SLOWNESS);
    let weight = ((1 << WEIGHT_BITS) as f32 / frames) as i32;
    let rest = (1 << WEIGHT_BITS) - weight * frames as i32;
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
        *sum = (*sum * weight + i32::from(feature) * rest) >> (WEIGHT_BITS - EXTRA_BITS);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::Features;
    use crate::params::SAMPLE_FRAMES;

    /// Returns how often the speed has changed, and the last logarithm, if all lines have this light: its logarithm for
    /// each frame, at so many frames per pitch.
    fn followed(slowness: f32, is_diagonal: bool, light: impl Fn(usize) -> f64) -> (usize, f32) {
        let mut level = Level::new([0.0, slowness], slowness);
        let mut recent = [[0; FEATURES]; SAMPLE_FRAMES];
        let mut found = (0, 0.0);
        for t in 0..120 {
            recent.rotate_left(1);
            recent[SAMPLE_FRAMES - 1] = Features::from([(2048.0 * (light(t) - 2.0)) as i16; FEATURES]);
            let (number, has_changed) = level.push(Sample::from_frames(&recent), slowness, is_diagonal, 1);
            found = (found.0 + usize::from(has_changed), number);
        }
        found
    }

    #[test]
    fn a_texture_in_step_with_the_whiskers_is_no_change_of_speed() {
        for slowness in [2.0, 5.3, 8.57, 12.9] {
            for waves in [1.0, 2.0] {
                let texture = |t: usize| 0.4 * (t as f64 / slowness * waves * core::f64::consts::TAU).sin();
                let (changes, last) = followed(slowness as f32, true, texture);
                assert!(changes == 0 && last.abs() < 0.05, "{slowness}: {changes} changes, {last}");
            }
        }
    }

    #[test]
    fn a_change_is_followed_and_one_that_is_too_large_ends_the_answers() {
        let step = |by: f64| move |t: usize| if t < 60 { 0.0 } else { by };
        // It arrives in steps, because the mean is over five frames.
        assert!(matches!(followed(5.0, false, step(0.3)), (2..=5, last) if last.abs() < 0.02));
        assert!(matches!(followed(5.0, false, step(0.02)), (0, last) if last > 0.01));
        assert_eq!(followed(5.0, true, step(0.3)), (0, f32::INFINITY));
        for by in [0.6, -0.6] {
            assert_eq!(followed(1.0, false, step(by)), (0, f32::INFINITY));
        }
    }
}
