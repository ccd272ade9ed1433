//! The slowness along one axis while something slides: a recursive Gauss-Newton method.

use super::light::light;
use crate::motion::edges::LINES;
use crate::params::SAMPLE_FRAMES;
use crate::sample::Sample;

/// Largest slowness, in frames per pitch.
const MOST: f32 = 14.0;
/// Frames that must have been compared before the slowness moves.
const FEWEST: f32 = 1.5;
/// A shape and its derivative that are more alike than this have no slowness.
const LEAST_DETERMINANT: f32 = 1e-6;
/// Variances are kept between these, in frames² per pitch².
const VARIANCES: [f32; 2] = [1e-9, 1.0];
/// Comparisons of usual quality that are added to those that were made.
const PRIOR: f32 = 4.0;

/// A slowness, and the sums of what was compared.
///
/// Five lines, shifted by the slowness, are the shape Σ y_k, its derivative, and the moment Σ k y_k. The moment is a part
/// of the shape, because gains differ, and a part of the derivative, if the slowness is off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Frames per pitch; positive if the light moves from the first line to the last.
    pub slowness: f32,
    /// The slowness that was known otherwise, and its variance.
    known: [f32; 2],
    /// Sums over shape², shape · derivative, derivative².
    normal: [f32; 3],
    /// Sums over moment · shape and moment · derivative.
    moments: [f32; 2],
    /// Sum over moment².
    energy: f32,
    /// Number of comparisons, each as far as it is remembered.
    count: f32,
    /// The next frame to be compared at the middle line, counted from the newest: below 0.
    frame: i32,
}

/// How much is remembered and how well lines usually agree: both depend on the slowness of both axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    /// Comparisons that are remembered.
    pub length: f32,
    /// Usual difference of a line from the shape, as a fraction, squared.
    pub usual: f32,
}

impl Memory {
    /// Returns the memory for a slowness of both axes.
    pub(super) fn of(slowness: f32) -> Self {
        let usual = 0.0075 + 0.02125 * slowness.min(2.0);
        Self { length: 3.0 + 1.5 * slowness, usual: usual * usual }
    }
}

impl Track {
    /// Creates the track of a slowness of this variance. The comparison begins at a frame counted from the newest.
    pub(super) const fn at(slowness: f32, variance: f32, frame: i32) -> Self {
        Self {
            slowness,
            known: [slowness, variance],
            normal: [0.0; 3],
            moments: [0.0; 2],
            energy: 0.0,
            count: 0.0,
            frame,
        }
    }

    /// Takes note that frames have arrived.
    pub(super) fn pass(&mut self, frames: u8) {
        self.frame -= i32::from(frames);
    }

    /// Replaces the slowness by `factor` times itself, with a standard deviation of `sd` more. Frames before now are not
    /// compared any more.
    pub(super) fn scale(&mut self, factor: f32, sd: f32, memory: Memory) {
        let slowness = self.slowness * factor;
        let sd = libm::sqrtf(self.variance(memory)) * factor + sd * slowness.abs();
        *self = Self::at(slowness, kept(sd * sd), 1 + (2.0 * slowness.abs()) as i32);
    }

    /// Compares the next frame of the lines `first..first + LINES`. Returns `false` if it has not arrived in all of them.
    #[inline(never)]
    pub(super) fn compare(&mut self, recent: Sample<'_>, first: usize, base: &[i32; LINES], memory: Memory) -> bool {
        let shift = (self.slowness * 65_536.0) as i32;
        let reach = 2 * shift.abs();
        // Frames that are gone are not compared.
        self.frame = self.frame.max((reach >> 16) + 4 - SAMPLE_FRAMES as i32);
        if ((self.frame << 16) + reach + (1 << 15)) >> 16 > -1 {
            return false;
        }
        if let Some([shape, derivative, moment]) = shifted(recent, first, base, self.frame, shift) {
            self.add(shape as f32, derivative as f32, moment as f32, memory);
            self.solve(memory);
        }
        self.frame += 1;
        true
    }

    /// Adds a comparison. The others are forgotten as far as this one tells something new.
    fn add(&mut self, shape: f32, derivative: f32, moment: f32, memory: Memory) {
        let told = derivative * derivative;
        let new = if told * self.count < self.normal[2] { told * self.count / self.normal[2] } else { 1.0 };
        let forgotten = new / memory.length;
        let keep = 1.0 - forgotten;
        let [mm, md, dd] = &mut self.normal;
        (*mm, *md, *dd) = (keep * *mm + shape * shape, keep * *md + shape * derivative, keep * *dd + told);
        let [qm, qd] = &mut self.moments;
        (*qm, *qd) = (keep * *qm + moment * shape, keep * *qd + moment * derivative);
        self.energy = keep * self.energy + moment * moment;
        self.count = keep * self.count + 1.0;
        let [_, variance] = &mut self.known;
        let growth =
            1.0 + *variance * forgotten * information(self.normal, self.moments, self.energy, self.count, memory);
        *variance = kept(*variance * growth.min(2.0));
    }

    /// Moves the slowness to where the moment has no part of the derivative.
    fn solve(&mut self, memory: Memory) {
        let [mm, md, dd] = self.normal;
        let [qm, qd] = self.moments;
        let determinant = mm * dd - md * md;
        if self.count < FEWEST || determinant <= LEAST_DETERMINANT * mm * dd {
            return;
        }
        let most = 0.1 + 0.1 * self.slowness.abs();
        // Twice the excess of the slowness: Σ k² over five lines is 10, and the derivative is a sum of five.
        let excess = ((mm * qd - md * qm) / determinant * 0.5).clamp(-most, most);
        let [known, variance] = self.known;
        let (weight, told) = (1.0 / variance, self.information(memory));
        let slowness = (known * weight + (self.slowness - excess) * told) / (weight + told);
        let moved = 2.0 * (self.slowness - slowness);
        self.slowness = slowness.clamp(-MOST, MOST);
        self.energy += moved * (moved * dd - 2.0 * qd);
        self.moments = [qm - moved * md, qd - moved * dd];
    }

    fn information(&self, memory: Memory) -> f32 {
        information(self.normal, self.moments, self.energy, self.count, memory)
    }

    /// Returns the variance of the slowness, in frames² per pitch².
    pub(super) fn variance(&self, memory: Memory) -> f32 {
        1.0 / (1.0 / self.known[1] + self.information(memory))
    }
}

/// Returns a variance within the bounds of all variances.
fn kept(variance: f32) -> f32 {
    variance.clamp(VARIANCES[0], VARIANCES[1])
}

/// Returns what the sums tell of the slowness: the inverse of a variance.
fn information([mm, md, dd]: [f32; 3], [qm, _]: [f32; 2], energy: f32, count: f32, memory: Memory) -> f32 {
    let determinant = mm * dd - md * md;
    if count < FEWEST || determinant <= LEAST_DETERMINANT * mm * dd {
        return 0.0;
    }
    let rest = (energy - qm * qm / mm).max(0.0);
    let expected = PRIOR * 0.4 * memory.usual * mm / count;
    4.0 * determinant * ((count - 2.0).max(0.0) + PRIOR) / (mm * (rest + expected))
}

/// Returns shape, derivative and moment of five lines at a frame of the middle one, in units of 2^-16.
///
/// A line is read between its frames by a quadratic spline, which smooths every shift alike.
fn shifted(recent: Sample<'_>, first: usize, base: &[i32; LINES], frame: i32, shift: i32) -> Option<[i32; 3]> {
    let (mut shape, mut derivative, mut moment) = (0, 0, 0);
    for ((k, line), &base) in (-2..).zip(first..).zip(base) {
        let at = (frame << 16) + k * shift + (1 << 15);
        // In units of 2^-12: the parts of a frame after and before the spline's middle.
        let after = (at & 0xFFFF) >> 4;
        let before = (1 << 12) - after;
        let newest = usize::try_from(-1 - (at >> 16)).ok()?;
        let value = |back: usize| Some(light(*recent.back(newest + back)?.get(line)?));
        let [p, q, r] = [value(2)?, value(1)?, value(0)?];
        let (first, last) = ((before * before) >> 13, (after * after) >> 13);
        let y = ((first * p + ((1 << 12) - first - last) * q + last * r) >> 12) - base;
        shape += y;
        moment += k * y;
        derivative += (before * (q - p) + after * (r - q)) >> 12;
    }
    Some([shape, derivative, moment])
}
