//! The slowness along one axis while something slides: a recursive Gauss-Newton method.

use super::light::light;
use crate::paper::sample::Sample;
use crate::params::SAMPLE_FRAMES;
use crate::touch::motion::sqrt;

/// Largest slowness, in frames per pitch.
const MOST: f32 = 14.0;
/// Frames that must have been compared before the slowness moves.
const FEWEST: f32 = 1.5;
/// A shape and its derivative that are more alike than this have no slowness.
const LEAST_DETERMINANT: f32 = 1e-6;
/// Variances are kept between these, in frames² per pitch².
const VARIANCES: [f32; 2] = [1e-9, 1.0];
/// Most comparisons of an axis per frame.
const COMPARISONS: usize = 4;
/// Comparisons of usual quality that are added to those that were made.
const PRIOR: f32 = 4.0;

/// A slowness, and the sums of what was compared.
///
/// Five lines, shifted by the slowness, are the shape Σ y_k, its derivative, and the moment Σ k y_k. The moment is a
/// part of the shape, because gains differ, and a part of the derivative, if the slowness is off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Frames per pitch; positive if the light moves from the first line to the last.
    pub slowness: f32,
    /// The variance of the slowness, in frames² per pitch².
    pub variance: f32,
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
    /// Whether more frames could have been compared.
    pub is_behind: bool,
}

/// Returns the comparisons that are remembered, and the square of the usual difference of a line from the shape, as a
/// fraction: both depend on the slowness of both axes.
pub(super) fn memory(slowness: f32) -> [f32; 2] {
    let usual = 0.0065 + 0.017 * slowness.min(2.0);
    [3.0 + 1.5 * slowness, usual * usual]
}

impl Track {
    /// Creates the track of a slowness of this variance. The comparison begins at a frame counted from the newest.
    pub(super) const fn at(slowness: f32, variance: f32, frame: i32) -> Self {
        Self {
            slowness,
            variance,
            known: [slowness, variance],
            normal: [0.0; 3],
            moments: [0.0; 2],
            energy: 0.0,
            count: 0.0,
            frame,
            is_behind: false,
        }
    }

    /// Takes note that frames have arrived.
    pub(super) fn pass(&mut self, frames: u8) {
        self.frame -= i32::from(frames);
    }

    /// Replaces the slowness of the light, which is later by `delay`, by `factor` times itself, with a standard
    /// deviation of `sd` times itself more. Frames before now are not compared any more.
    pub(super) fn scale(&mut self, factor: f32, sd: f32, delay: f32) {
        let of_light = (self.slowness + delay) * factor;
        let slowness = of_light - delay;
        let sd = sqrt(self.variance) * factor + sd * of_light.abs();
        *self = Self::at(slowness, kept(sd * sd), 1 + (2.0 * slowness.abs()) as i32);
    }

    /// Compares the next frames of the lines `first..first + LINES`, if they have arrived in all of them.
    #[inline(never)]
    pub(super) fn compare(&mut self, recent: Sample<'_>, first: usize, base: &[i32], memory: [f32; 2]) {
        let shift = (self.slowness * 65_536.0) as i32;
        let reach = (2 * shift.abs() + (1 << 15)) >> 16;
        // Frames that are gone are not compared.
        self.frame = self.frame.max(reach + 4 - SAMPLE_FRAMES as i32);
        let frames = (-reach - self.frame).clamp(0, COMPARISONS as i32);
        self.is_behind = -reach - self.frame > frames + 1;
        let mut sums = [[0; 3]; COMPARISONS];
        let Some(sums) = sums.get_mut(..frames as usize) else { return };
        if sums.is_empty() {
            return;
        }
        let mut is_whole = true;
        for ((k, line), &base) in (-2..).zip(first..).zip(base) {
            let at = k * shift + (1 << 15);
            is_whole &= shifted(recent, line, base, -1 - self.frame - (at >> 16), at & 0xFFFF, k, sums).is_some();
        }
        self.frame += frames;
        if is_whole {
            let forgotten = self.add(sums, memory);
            self.solve(forgotten, memory);
        }
    }

    /// Adds comparisons. The others are forgotten as far as these tell something new. Returns how far.
    fn add(&mut self, sums: &[[i32; 3]], memory: [f32; 2]) -> f32 {
        let (mut mm, mut md, mut dd, mut qm, mut qd, mut qq) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for &[shape, derivative, moment] in sums {
            let (shape, derivative, moment) = (shape as f32, derivative as f32, moment as f32);
            mm += shape * shape;
            md += shape * derivative;
            dd += derivative * derivative;
            qm += moment * shape;
            qd += moment * derivative;
            qq += moment * moment;
        }
        // At most as much as these comparisons are of those that are remembered.
        let (told, number) = (dd * self.count, sums.len() as f32);
        let new = if told < number * self.normal[2] { told / self.normal[2] } else { number };
        let forgotten = (new / memory[0]).min(1.0);
        let keep = 1.0 - forgotten;
        self.normal = [keep * self.normal[0] + mm, keep * self.normal[1] + md, keep * self.normal[2] + dd];
        self.moments = [keep * self.moments[0] + qm, keep * self.moments[1] + qd];
        self.energy = keep * self.energy + qq;
        self.count = keep * self.count + number;
        forgotten
    }

    /// Moves the slowness to where the moment has no part of the derivative.
    fn solve(&mut self, forgotten: f32, memory: [f32; 2]) {
        let [mm, md, dd] = self.normal;
        let [qm, qd] = self.moments;
        let determinant = mm * dd - md * md;
        if self.count < FEWEST || determinant <= LEAST_DETERMINANT * mm * dd {
            return;
        }
        let most = 0.1 + 0.1 * self.slowness.abs();
        // Twice the excess of the slowness: Σ k² over five lines is 10, and the derivative is a sum of five.
        let excess = ((mm * qd - md * qm) / determinant * 0.5).max(-most).min(most);
        let rest = (self.energy - qm * qm / mm).max(0.0) + PRIOR * 0.4 * memory[1] * mm / self.count;
        let told = 4.0 * determinant * ((self.count - 2.0).max(0.0) + PRIOR) / (mm * rest);
        let [known, variance] = self.known;
        let variance = kept(variance * (1.0 + variance * told * forgotten).min(2.0));
        self.known = [known, variance];
        self.variance = 1.0 / (1.0 / variance + told);
        let slowness = (known / variance + (self.slowness - excess) * told) * self.variance;
        let moved = 2.0 * (self.slowness - slowness);
        self.slowness = slowness.clamp(-MOST, MOST);
        self.energy += moved * (moved * dd - 2.0 * qd);
        self.moments = [qm - moved * md, qd - moved * dd];
    }
}

/// Returns a variance within the bounds of all variances.
fn kept(variance: f32) -> f32 {
    variance.clamp(VARIANCES[0], VARIANCES[1])
}

/// Adds a line's light and its derivative to the sums of consecutive frames, and `k` times its light to their moments,
/// in units of 2^-16.
///
/// The first of the frames is read around the one that is `back` + 1 before the newest, and `after` · 2^-16 frames
/// after the start of that. A quadratic spline smooths every shift alike.
fn shifted(
    recent: Sample<'_>,
    line: usize,
    base: i32,
    back: i32,
    after: i32,
    k: i32,
    sums: &mut [[i32; 3]],
) -> Option<()> {
    // In units of 2^-12.
    let after = after >> 4;
    let before = (1 << 12) - after;
    let (first, last) = ((before * before) >> 13, (after * after) >> 13);
    let from = (recent.len() as i32 - 3 - back) as usize;
    let mut lights = [0; COMPARISONS + 2];
    let lights = lights.get_mut(..sums.len() + 2)?;
    let mut places = lights.iter_mut();
    for part in recent.between(from, from.wrapping_add(sums.len() + 2)) {
        for features in part {
            *places.next()? = light(*features.get(line)?);
        }
    }
    if places.next().is_some() {
        return None;
    }
    for ([shape, derivative, moment], &[p, q, r]) in sums.iter_mut().zip(lights.array_windows()) {
        let y = ((first * p + ((1 << 12) - first - last) * q + last * r) >> 12) - base;
        *shape += y;
        *moment += k * y;
        *derivative += (before * (q - p) + after * (r - q)) >> 12;
    }
    Some(())
}
