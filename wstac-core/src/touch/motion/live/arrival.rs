//! Where the light of ten lines arrives: the first slowness of a touch.

use super::light::light;
use super::track::Track;
use crate::paper::sample::Sample;
use crate::params::FEATURES;
use crate::touch::motion::Readout;
use crate::touch::motion::edges::LINES;

/// The level of an edge: 77 / 256, 30 % of the peak.
const LEVEL: i32 = 77;
/// Frames before the middle line's edge at which the comparison of shapes begins, in units of 2^-16.
const BEFORE: i32 = 1 << 16;
/// Variance of a slowness that every straight line through edges has, in frames² per pitch².
const LEAST_VARIANCE: f32 = 0.0009;
/// Largest distance of an edge from the straight line that counts as chance: as a fraction of the slowness, and in
/// frames.
const FARTHEST: [f32; 2] = [0.3, 0.1];

/// Returns the slownesses of a touch whose ten lines were first lit `ages` − 1 frames before the newest, and the
/// standard deviation of both by edges that are too far from a straight line, in frames per pitch; `None` if the frames
/// that tell are gone.
///
/// All lines are read at the same age, since brighter light comes later to the last ones than to the first ones.
#[inline]
pub(super) fn arrival(
    recent: Sample<'_>,
    ages: &[u8; FEATURES],
    base: &[i32; FEATURES],
    readout: Readout,
) -> Option<([Track; 2], f32)> {
    let mut tracks = [Track::at(0.0, 1.0, 0); 2];
    let mut farthest = 0.0_f32;
    for ((track, ages), (axis, base)) in
        tracks.iter_mut().zip(ages.as_chunks::<LINES>().0).zip((0..).zip(base.as_chunks::<LINES>().0))
    {
        let (mut sum, mut moment) = (0, 0);
        let mut edges = [0; LINES];
        for ((k, place), (&age, &base)) in (-2..).zip(&mut edges).zip(ages.iter().zip(base)) {
            let line = axis * LINES + (k + 2) as usize;
            *place = edge(recent, line, usize::from(age.checked_sub(1)?), base)?;
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
    let slowness = super::slowness(&tracks, readout);
    Some((tracks, (farthest - (FARTHEST[0] * slowness + FARTHEST[1])).max(0.0)))
}

/// Returns where a line that was first lit `first` frames ago exceeds the level of its peak in that frame and the next
/// two, in units of 2^-16 frames before (below 0) the newest frame.
#[inline(never)]
fn edge(recent: Sample<'_>, line: usize, first: usize, base: i32) -> Option<i32> {
    let value = |index: usize| Some(light(*recent.frame(index)?.get(line)?) - base);
    let dark = recent.len().checked_sub(first + 2)?;
    let values = [value(dark + 1)?, value(dark + 2)?, value(dark + 3)?];
    let peak = values[0].max(values[1]).max(values[2]).max(1);
    let level = (peak * LEVEL) >> 8;
    let (mut before, mut at) = (value(dark)?, -((first as i32 + 1) << 16));
    for here in values {
        if here > level {
            let share = ((level - before).max(0) << 10).checked_div(here - before).unwrap_or(0);
            return Some((share.min(1 << 10) << 6) + at);
        }
        (before, at) = (here, at + (1 << 16));
    }
    None
}
