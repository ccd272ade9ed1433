//! Arrival times of rising edges, and the straight line through them.

use super::sqrt::sqrt;
use crate::exp::{EXP_FRACTION_BITS, EXP_ONE, exp_of_negative, widened};
use crate::paper::trigger::Event;
use crate::params::SAMPLE_FRAMES;

pub(super) const LINES: usize = 5;

/// Arrival times of the five lines of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    /// In units of 2^-16 frames from the sample's start; `None` for a line that is not lit.
    pub frames: [Option<i32>; LINES],
}

/// The level of an edge: 77 / 256, 30 % of the peak.
const LEVEL: u64 = 77;
/// A line is lit if its peak is at least an eighth of the axis's brightest: ln 8 in units of 2^-20.
const LIT: i32 = 2_180_477;

impl Edges {
    pub(super) fn lit(&self) -> u8 {
        self.frames.iter().map(|edge| u8::from(edge.is_some())).sum()
    }

    /// Returns the least-squares slope in units of 2^-16 frames per line; 0 with fewer than two edges.
    pub(super) fn slope(&self) -> i32 {
        let (n, x, y, xx, xy) = self.sums();
        (n * xy - x * y).checked_div(n * xx - x * x).unwrap_or(0) as i32
    }

    /// Returns the slope in frames per line, its standard deviation, the largest distance of an edge from the straight
    /// line in frames, and how well the line explains the edges, 0 to 1.
    pub(super) fn fit(&self) -> (f32, f32, f32, f32) {
        let slope = self.slope();
        let (n, x, y, xx, _) = self.sums();
        let spread = (n * xx - x * x) as f32 / n as f32;
        let (mut rest, mut farthest) = (0.0, 0.0_f32);
        for (k, edge) in (0..).zip(self.frames) {
            if let Some(edge) = edge {
                let off = (i64::from(edge) * n - y - i64::from(slope) * (k * n - x)) as f32 / n as f32 / 65_536.0;
                rest += off * off;
                farthest = farthest.max(off.abs());
            }
        }
        let slope = slope as f32 / 65_536.0;
        let sd = sqrt(rest / ((n - 2) as f32 * spread));
        let unit = 1.0 + slope.abs();
        (slope, sd, farthest, 1.0 - (rest / (n as f32 * unit * unit)).min(1.0))
    }

    /// Returns the sums Σ1, Σx, Σy, Σx², Σxy over the edges, with x the line's number.
    fn sums(&self) -> (i64, i64, i64, i64, i64) {
        let (mut n, mut x, mut y, mut xx, mut xy) = (0, 0, 0, 0, 0);
        for (k, edge) in (0_i64..).zip(self.frames) {
            let Some(edge) = edge.map(i64::from) else { continue };
            (n, x, y, xx, xy) = (n + 1, x + k, y + edge, xx + k * k, xy + k * edge);
        }
        (n, x, y, xx, xy)
    }
}

/// Returns where a straight line from `before` at `frame` − 1 to `value` at `frame` crosses `threshold`, in units of
/// 2^-16 frames. The first frame has no frame before it.
pub(super) fn between(frame: i32, before: i32, value: i32, threshold: i32) -> i32 {
    if frame == 0 {
        return 0;
    }
    let share = ((i64::from(threshold - before)) << 16).checked_div(i64::from(value - before)).unwrap_or(0);
    ((frame - 1) << 16) + share.clamp(0, 1 << 16) as i32
}

/// Returns the highest feature of each of the lines `first..first + LINES`, in units of 2^-20.
pub(super) fn brightest(event: &Event<'_>, first: usize) -> [i32; LINES] {
    let mut brightest = [i16::MIN; LINES];
    for frame in event.sample.frames() {
        for (most, &value) in brightest.iter_mut().zip(frame.iter().skip(first)) {
            *most = (*most).max(value);
        }
    }
    brightest.map(widened)
}

/// Returns the edges of the lines `first..first + LINES` of an event.
///
/// A line's level is found in its features, so that only few of them must be turned into light.
pub(super) fn of_event(event: &Event<'_>, first: usize) -> Edges {
    let mut frames = [None; LINES];
    let brightest = brightest(event, first);
    let top = brightest.into_iter().max().unwrap_or(0);
    for ((line, place), most) in frames.iter_mut().enumerate().zip(brightest) {
        let Some(mean) = event.baseline.mean_of(first + line, EXP_FRACTION_BITS) else { continue };
        if top.saturating_sub(most) > LIT || most <= mean {
            continue;
        }
        *place = edge(event, first + line, most, mean);
    }
    Edges { frames }
}

/// Returns where a line's light above the baseline `mean` first exceeds the level.
fn edge(event: &Event<'_>, feature: usize, most: i32, mean: i32) -> Option<i32> {
    let light = |value: i32| exp_of_negative((most - value).max(0) as u32);
    let base = light(mean);
    let threshold = base + ((u64::from(EXP_ONE - base) * LEVEL) >> 8) as u32;
    let mut before = None;
    for (frame, value) in (0..SAMPLE_FRAMES as i32).zip(event.sample.feature(feature)) {
        let value = widened(value);
        // The threshold is above 0.3, which is ln 0.3 > −1.21 below the brightest.
        if most - value < (5 << (EXP_FRACTION_BITS - 2)) && light(value) > threshold {
            let before = before.map_or(0, |before| light(before) >> 1);
            return Some(between(frame, before as i32, (light(value) >> 1) as i32, (threshold >> 1) as i32));
        }
        before = Some(value);
    }
    None
}
