//! Where the light of ten lines arrives: the first slowness of a touch.

use super::light::light;
use super::track::Track;
use crate::motion::edges::LINES;
use crate::params::FEATURES;
use crate::sample::Sample;

/// The level of an edge: 77 / 256, 30 % of the peak.
const LEVEL: i32 = 77;
/// Most frames after its first light in which a line's peak is sought.
const LONGEST: u8 = 4;
/// Frames before the middle line's edge at which the comparison of shapes begins, in units of 2^-16.
const BEFORE: i32 = 2 << 16;
/// Variance of a slowness that every straight line through edges has, in frames² per pitch².
const LEAST_VARIANCE: f32 = 0.0009;
/// Largest distance of an edge from the straight line that counts as chance: as a fraction of the slowness, and in frames.
const FARTHEST: [f32; 2] = [0.3, 0.1];

/// The first slowness of both axes.
pub(super) struct Arrival {
    pub tracks: [Track; 2],
    /// Standard deviation of both slownesses by edges that are too far from a straight line, in frames per pitch.
    pub excess: f32,
}

/// Returns the slownesses of a touch whose ten lines were first lit `ages` − 1 frames before the newest; `None` if the
/// frames that tell are gone.
///
/// All lines are read at the same age, since brighter light comes later to the last ones than to the first ones.
#[inline(never)]
pub(super) fn arrival(recent: Sample<'_>, ages: &[u8; FEATURES], base: &[i32; FEATURES]) -> Option<Arrival> {
    let youngest = ages.iter().min()?.saturating_sub(1).min(LONGEST);
    let mut tracks = [Track::at(0.0, 1.0, 0); 2];
    let mut farthest = 0.0_f32;
    for ((track, ages), (axis, base)) in
        tracks.iter_mut().zip(ages.as_chunks::<LINES>().0).zip((0..).zip(base.as_chunks::<LINES>().0))
    {
        let (mut sum, mut moment) = (0, 0);
        let mut edges = [0; LINES];
        for ((k, place), (&age, &base)) in (-2..).zip(&mut edges).zip(ages.iter().zip(base)) {
            let line = axis * LINES + (k + 2) as usize;
            *place = edge(recent, line, age, youngest, base)?;
            sum += *place;
            moment += k * *place;
        }
        let (mean, slowness) = (sum as f32 / 5.0, moment as f32 / 10.0);
        let mut squares = 0.0;
        for (k, &edge) in (-2..).zip(&edges) {
            let off = (edge as f32 - mean - k as f32 * slowness) / 65_536.0;
            squares += off * off;
            farthest = farthest.max(off.abs());
        }
        *track = Track::at(slowness / 65_536.0, squares / 30.0 + LEAST_VARIANCE, (sum / 5 - BEFORE) >> 16);
    }
    let slowness = super::slowness(&tracks);
    Some(Arrival { tracks, excess: (farthest - (FARTHEST[0] * slowness + FARTHEST[1])).max(0.0) })
}

/// Returns where a line that was first lit `age` − 1 frames ago exceeds the level of its peak at that age, in units of
/// 2^-16 frames before (below 0) the newest frame.
fn edge(recent: Sample<'_>, line: usize, age: u8, youngest: u8, base: i32) -> Option<i32> {
    let value = |back: u8| Some(light(*recent.back(usize::from(back))?.get(line)?) - base);
    let first = age.checked_sub(1)?;
    let mut peak = 1;
    for back in first.saturating_sub(youngest)..=first {
        peak = peak.max(value(back)?);
    }
    let level = (peak * LEVEL) >> 8;
    let mut before = value(age)?;
    for back in (0..=first).rev() {
        let here = value(back)?;
        if here > level {
            let share = (level - before).max(0) as f32 / (here - before).max(1) as f32;
            return Some((share.min(1.0) * 65_536.0) as i32 - ((i32::from(back) + 1) << 16));
        }
        before = here;
    }
    None
}
