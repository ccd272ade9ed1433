//! What 25 whiskers tell while something slides. A line is lit as soon as one of its five whiskers is, so that lines
//! alone take a narrow thing for a wide one.

use crate::params::{SAMPLE_FRAMES, TAXELS};
use crate::touch::motion::{MotionConfig, Velocity, length, sqrt, squares};
use crate::touch::taxel_ring::TaxelRing;
use crate::touch::wave::{Basis, Wave, dome, place_of, sums, velocity_of};

/// The newest frame of a ring.
const NEWEST: usize = SAMPLE_FRAMES - 1;
/// Frames from the newest, when the first line of a touch is lit, to the last one that is dark.
const DARK: usize = 3;
/// Frames before a touch that a wave is given.
const BEFORE: usize = 8;
/// Parts of a frame in which the age of an edge is kept.
const PARTS: u32 = 64;
/// The most that an age may be.
const OLDEST: u32 = 1000 * PARTS;
/// An edge is where light exceeds this part of its peak, in 256ths.
const LEVEL: i32 = 102;
/// Age of an edge after which only a peak of this many times the light counts: ridges of a texture are none.
const SETTLED: u32 = 5 * PARTS / 2;
const HIGHER: u32 = 8;
const MOST_LIGHT: u32 = u16::MAX as u32;
/// Frames in which an edge is looked for.
const STEPS: usize = 7;
/// A whisker is lit above an eighth of the highest peak; one may be dark, as if it were dead.
const LIT_SHIFT: u32 = 3;
/// Light that fades is afterglow if less than this part is left of each frame's, of all whiskers alike: within these
/// parts of the brightest whisker and of the highest peak.
const GLOW: f32 = 0.75;
const ALIKE: [f32; 2] = [0.03, 0.01];
/// Frames in which afterglow is continued, and the part of the brightest frame at which it ends.
const CONTINUED: usize = 16;
const FADED: f32 = 0.004;
/// Shifts of the most light of all whiskers: light that grows by more in a frame touches again, and a touch that has
/// less left has ended earlier.
const AGAIN: u32 = 6;
const FAINT: u32 = 4;
/// Times that a wave is asked in a touch.
const MOST_TRIES: u8 = 4;
/// Largest root mean square distance from the plane of edges and a dome, as a part of the slowness and 0.3 frames.
const OFF: [f32; 2] = [0.18, 0.3];
/// Mean square distance of a dome from the plane, for curvatures of 1 over half of the sensor and a slowness of 1.
const OF_DOME: f32 = 0.35;
/// Largest curvature of a dome: light that spreads from a place has a greater one.
const ROUND: f32 = 0.6;
/// Largest curvatures of the plane over half of the sensor, as parts of the slowness: along less across, where light
/// that grows along the motion by a fraction counts as half of it; of both mixed; and across less what is curved alike
/// along.
const CURVED: [f32; 3] = [0.12, 0.13, 0.2];
/// Largest growth of the light over the sensor, as a fraction.
const GROWN: f32 = 0.12;
/// Largest change of the slowness since the frame before, and difference from that of lines, as fractions.
const STABLE: f32 = 0.04;
const DIFFERS: f32 = 0.1;
/// Largest difference of two curvatures: along less across, and by how much lines are slower than edges; as a part of
/// the slowness, and in frames. A change of speed gives both.
const CHANGES: [f32; 2] = [0.08, 0.03];
/// Largest root mean square distance, as a part of the slowness, once all light has faded, as where a slide sticks.
const OFF_AFTER_GLOW: f32 = 0.06;
/// Least slowness in frames per pitch of a velocity by edges, and the age at which the youngest edge tells nothing
/// more.
const LEAST: f32 = 0.3;
const OLD: u32 = 6 * PARTS;

/// The first light of a whisker.
#[derive(Clone, Copy, Debug)]
struct FirstLight {
    dark: u16,
    peak: u16,
    /// Parts of a frame since the edge.
    age: u16,
}

impl FirstLight {
    fn above(self, light: u16) -> f32 {
        (i32::from(light) - i32::from(self.dark)) as f32
    }
}

/// What is known of all whiskers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whiskers {
    each: [FirstLight; TAXELS],
    /// Frames since the touch began, and since one arrived as a whole.
    since: u8,
    missed: u8,
    /// The light of all whiskers in the last frame that arrived, and the most in a frame.
    light: u32,
    brightest: u32,
    /// Whether there was nothing but afterglow in the newest frame, and in one before light came again.
    is_over: bool,
    has_glowed: bool,
    pub(super) tries: u8,
    /// Slowness of rows and columns by edges, in the frame before.
    slowness: Option<[f32; 2]>,
    /// Whether edges agreed with lines; false if both say that the speed has changed, `None` until both say anything.
    agreed: Option<bool>,
}

impl Whiskers {
    pub(super) const EMPTY: Self = Self {
        each: [FirstLight { dark: 0, peak: 0, age: 0 }; TAXELS],
        since: 0,
        missed: 0,
        light: 0,
        brightest: 0,
        is_over: false,
        has_glowed: false,
        tries: 0,
        slowness: None,
        agreed: None,
    };

    /// Begins with a touch whose first line is lit in the newest frame, `frames` after the last.
    pub(super) fn begin(&mut self, ring: &TaxelRing, frames: u8) {
        *self = Self::EMPTY;
        let mut dark = (0..=NEWEST - DARK).rev().filter(|&frame| !ring.is_lost(frame));
        if let (Some(newer), Some(older)) = (dark.next(), dark.next()) {
            for (whisker, (a, b)) in self.each.iter_mut().zip(ring.frame(newer).iter().zip(ring.frame(older))) {
                whisker.dark = *a.min(b);
            }
        }
        let before = ring.frame(NEWEST.saturating_sub(frames.into()));
        let light = self.each.iter().zip(before).map(|(whisker, light)| u32::from(light.saturating_sub(whisker.dark)));
        self.light = light.sum();
    }

    /// Takes the newest frame, `frames` after the last. Returns what is known of a touch that has just ended.
    #[inline(never)]
    pub(super) fn follow(&mut self, ring: &TaxelRing, frames: u8, config: MotionConfig) -> Option<(Velocity, Basis)> {
        self.since = self.since.saturating_add(frames);
        let (frames, lost) = (self.missed.saturating_add(frames), ring.lost_lately());
        self.missed = if lost & 1 == 1 { frames } else { 0 };
        if self.missed > 0 {
            return None;
        }
        let now = ring.frame(NEWEST);
        let recent = core::array::from_fn(|back| ring.frame(NEWEST - 1 - back));
        let (passed, mut sum) = (u32::from(frames) * PARTS, 0);
        for (taxel, (whisker, &now)) in self.each.iter_mut().zip(now).enumerate() {
            let light = u32::from(now).saturating_sub(whisker.dark.into());
            sum += light;
            let age = (u32::from(whisker.age) + passed).min(OLDEST);
            whisker.age = age as u16;
            let highest = u32::from(whisker.peak);
            if light > highest && (age < SETTLED || light >= (highest * HIGHER).min(MOST_LIGHT)) {
                whisker.age = edge(&recent, taxel, whisker.dark, lost, light as i32);
                whisker.peak = light as u16;
            }
        }
        let sums = [sum, core::mem::replace(&mut self.light, sum)];
        self.brightest = self.brightest.max(sum);
        let part = sums[0] as f32 / sums[1].max(1) as f32;
        let left = if frames == 1 { part } else { sqrt(part) };
        let before = || ring.frame(NEWEST.saturating_sub(frames.into()));
        let is_over = frames <= 2 && left < GLOW && self.are_alike(now, before(), part);
        // Noise on the last afterglow is no new light.
        let has_grown = sums[0] > sums[1] + (self.brightest >> AGAIN);
        let was_over = self.is_over;
        self.has_glowed |= was_over;
        self.is_over = is_over || (was_over && !has_grown);
        if !is_over || was_over || sums[1] << FAINT < self.brightest || self.tries >= MOST_TRIES {
            return None;
        }
        self.tries += 1;
        self.wave(ring, left, sums[0] as f32, config)
    }

    /// Returns whether each whisker has this part of its light of the frame before.
    #[inline(never)]
    fn are_alike(&self, now: &[u16; TAXELS], before: &[u16; TAXELS], part: f32) -> bool {
        let (mut most, mut peak) = (0, 0);
        for (whisker, before) in self.each.iter().zip(before) {
            (most, peak) = (before.saturating_sub(whisker.dark).max(most), whisker.peak.max(peak));
        }
        let limit = ALIKE[0] * f32::from(most) + ALIKE[1] * f32::from(peak);
        self.each.iter().zip(now).zip(before).all(|((whisker, &now), &before)| {
            let [now, before] = [now, before].map(|light| whisker.above(light));
            (now - part * before).abs() <= limit
        })
    }

    /// Asks the wave about the touch, whose afterglow is continued: `left` of it in each frame.
    #[inline(never)]
    fn wave(&self, ring: &TaxelRing, left: f32, sum: f32, config: MotionConfig) -> Option<(Velocity, Basis)> {
        let mut glow = [[0; TAXELS]; CONTINUED];
        let (mut part, mut frames, least) = (left, 0, FADED * self.brightest as f32);
        for frame in &mut glow {
            if sum * part <= least * left {
                break;
            }
            for ((taxel, light), whisker) in frame.iter_mut().enumerate().zip(&self.each) {
                let above = whisker.above(ring.light(NEWEST, taxel));
                *light = (f32::from(whisker.dark) + part * above + 0.5) as u16;
            }
            (part, frames) = (part * left, frames + 1);
        }
        let before = (usize::from(self.since) + BEFORE).min(SAMPLE_FRAMES - frames);
        let known = ring.frames().count();
        let samples = ring.frames().skip(known.saturating_sub(before)).chain(glow.iter().take(frames).map(Some));
        let mut wave = Wave::EMPTY;
        wave.fit(samples, config).ok().filter(|_| wave.is_even[usize::from(self.has_glowed)])
    }

    /// Returns the velocity in a frame in which lines tell one or none: that of lines once edges agree with it, or that
    /// of edges that cross the sensor.
    ///
    /// `lines` are slownesses of rows and columns in their own time.
    #[inline(never)]
    pub(super) fn velocity(&mut self, lines: Option<(Velocity, [f32; 2])>, config: MotionConfig) -> Option<Velocity> {
        if self.is_over {
            return None;
        }
        if let Some(agreed) = self.agreed {
            return lines.filter(|_| agreed).map(|(velocity, _)| velocity);
        }
        if self.missed > 0 {
            return None;
        }
        let before = self.slowness.take();
        let (slowness, [variance, whole, bent]) = self.front()?;
        let size = squares(slowness);
        let near = |other: [f32; 2], part: f32, size: f32| {
            squares([other[0] - slowness[0], other[1] - slowness[1]]) < part * part * size
        };
        let is_steady = |more: f32| (bent * whole - more).abs() < CHANGES[0] * whole + CHANGES[1];
        if let Some((velocity, lines)) = lines {
            let is_near = near(lines, DIFFERS, squares(lines));
            self.agreed = is_near.then(|| is_steady(length(lines) - whole));
            return self.agreed.filter(|agreed| *agreed).map(|_| velocity);
        }
        self.slowness = Some(slowness);
        let is_stable = is_steady(0.0) && before.is_some_and(|before| near(before, STABLE, size));
        let is_old = |whisker: &FirstLight| u32::from(whisker.age) >= OLD;
        if !is_stable || self.each.iter().all(is_old) || size < LEAST * LEAST {
            return None;
        }
        velocity_of(slowness, variance * (1.0 / 50.0), config)
    }

    /// Returns the slowness of rows and columns of edges that cross the sensor at an even speed, and what
    /// [`EdgePlane::is_even`] returns.
    fn front(&self) -> Option<([f32; 2], [f32; 3])> {
        let (mut peaks, mut times, mut highest) = ([0; TAXELS], [0; TAXELS], 0);
        for ((whisker, peak), time) in self.each.iter().zip(&mut peaks).zip(&mut times) {
            (*peak, *time) = (i32::from(whisker.peak), -i32::from(whisker.age));
            highest = highest.max(*peak);
        }
        let mut dark = peaks.iter().enumerate().filter(|(_, peak)| **peak <= highest >> LIT_SHIFT);
        let (first, None) = (dark.next(), dark.next()) else { return None };
        let mut plane = EdgePlane::new(&times);
        if let Some((taxel, _)) = first {
            // It is put on the plane of the others.
            let of_others = plane.at_without(taxel, &times);
            *times.get_mut(taxel)? = of_others;
            plane = EdgePlane::new(&times);
        }
        let even = plane.is_even(&peaks)?;
        let most = OFF_AFTER_GLOW * OFF_AFTER_GLOW * squares(plane.slope);
        (!self.has_glowed || even[0] < most).then_some((plane.slope, even))
    }
}

/// A plane through 25 times, and how these are curved. Polynomials on 5 × 5 places are orthogonal, so that each
/// coefficient is a sum of its own. Sums of times are whole numbers.
struct EdgePlane {
    /// The sum of the times, and of their products with columns and rows.
    sums: [i32; 3],
    /// Of rows and columns.
    slope: [f32; 2],
    /// Of the square of the row's number, of the column's, and of their product.
    curves: [f32; 3],
    /// Mean square distance from the plane.
    off: f32,
}

/// A part of a frame.
const PART: f32 = 1.0 / PARTS as f32;

impl EdgePlane {
    #[inline(never)]
    fn new(times: &[i32; TAXELS]) -> Self {
        let [one, x, y, xx, xy, yy] = sums(times);
        // Below 25 · 2^32.
        let squares = times.iter().fold(0, |sum, time| sum + u64::from(time.unsigned_abs() * time.unsigned_abs()));
        let [of_one, of_x, of_y] = [one, x, y].map(|sum| i64::from(sum) * i64::from(sum));
        let rest = 50 * squares as i64 - 2 * of_one - of_x - of_y;
        Self {
            sums: [one, x, y],
            slope: [y, x].map(|sum| sum as f32 * (PART / 50.0)),
            curves: [
                (yy - 2 * one) as f32 * (PART / 70.0),
                (xx - 2 * one) as f32 * (PART / 70.0),
                xy as f32 * (PART / 100.0),
            ],
            off: rest as f32 * (PART * PART / 1250.0),
        }
    }

    /// Returns the time at a whisker of the plane through the others.
    fn at_without(&self, taxel: usize, times: &[i32; TAXELS]) -> i32 {
        let ([one, along_x, along_y], [x, y]) = (self.sums, place_of(taxel));
        // In units of a 50th: what the plane has there, and how much of it is by the whisker itself.
        let (at, part) = (2 * one + along_x * x + along_y * y, 2 + x * x + y * y);
        let own = times.get(taxel).map_or(0, |time| part * time);
        let most = OLDEST as i32;
        (at - own).checked_div(50 - part).unwrap_or(0).max(-most).min(most)
    }

    /// Returns the mean square distance from the plane, the slowness and the curvature along less across, if all is as
    /// of an edge of an even speed.
    #[inline(never)]
    fn is_even(&self, peaks: &[i32; TAXELS]) -> Option<[f32; 3]> {
        let slowness = length(self.slope);
        let most = OFF[0] * (slowness + OFF[1]);
        if slowness <= 0.0 {
            return None;
        }
        let [down, right] = self.slope.map(|part| part / slowness);
        let [light, along_x, along_y, ..] = sums(peaks).map(|sum| sum as f32);
        let grown = along_y * down + along_x * right;
        let [rows, columns, mixed] = self.curves.map(|curve| 4.0 * curve / slowness);
        let along = rows * down * down + columns * right * right + mixed * down * right;
        let across = rows * right * right + columns * down * down - mixed * down * right;
        let twisted = 2.0 * (rows - columns) * down * right + mixed * (right * right - down * down);
        let grown = 2.0 * grown / light;
        let bent = along - across - 0.5 * grown;
        let round = dome(along, across);
        let is_even = self.off - OF_DOME * round * round * slowness * slowness < most * most
            && bent.abs() < CURVED[0]
            && twisted.abs() < CURVED[1]
            && round.abs() < ROUND
            && (across - round).abs() < CURVED[2]
            && grown.abs() < GROWN;
        is_even.then_some([self.off, slowness, bent])
    }
}

/// Returns the parts of a frame since light exceeded the level of its peak, which is `light` in the newest frame. It is
/// on straight lines between that and those of the frames before it that were not `lost`.
#[inline(never)]
fn edge(recent: &[&[u16; TAXELS]; STEPS - 1], taxel: usize, dark: u16, lost: u8, light: i32) -> u16 {
    let level = (light * LEVEL) >> 8;
    let (mut after, mut at) = (light, 0);
    for (back, frame) in (1..).zip(recent).filter(|(back, _)| lost >> back & 1 == 0) {
        let before = i32::from(frame.get(taxel).map_or(0, |light| light.saturating_sub(dark)));
        if before <= level {
            let share = ((level - before) * PARTS as i32 * (back - at)).checked_div(after - before).unwrap_or(0);
            return (back * PARTS as i32 - share).max(0) as u16;
        }
        (after, at) = (before, back);
    }
    (STEPS as u16 - 1) * PARTS as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whiskers_of_a_dome_are_on_a_plane_and_those_of_a_bent_edge_are_not() {
        // An edge of 6 frames per pitch to the right, with curvatures along and across over half of the sensor.
        let is_even = |[along, across]: [f32; 2]| {
            let times = core::array::from_fn(|taxel| {
                let [x, y] = place_of(taxel).map(|place| place as f32);
                (PARTS as f32 * (6.0 * x + 1.5 * (along * x * x + across * y * y))) as i32 - 6400
            });
            EdgePlane::new(&times).is_even(&[1000; TAXELS]).is_some()
        };
        assert!(is_even([0.0, 0.0]) && is_even([0.4, 0.4]) && is_even([-0.4, -0.45]));
        assert!(!is_even([0.7, 0.7]) && !is_even([0.0, 0.4]) && !is_even([0.4, 0.0]) && !is_even([0.4, -0.4]));
    }
}
