//! The direction in which whiskers that the same part of an object passes are alike.

use super::LIT_SHIFT;
use super::fit::place_of;
use crate::exp::{EXP_FRACTION_BITS, exp_of_negative};
use crate::ln::constant::{exp, ln};
use crate::ln::fixed::Fixed;
use crate::ln::{LN_FRACTION_BITS, Ln};
use crate::params::{COLUMNS, PITCH_MM, ROWS, TAXELS};
use crate::touch::motion::sqrt;

/// Directions of half a turn. The grid's symmetry makes them of those from 0° to 45°.
const ANGLES: usize = 36;
const QUARTER: usize = ANGLES / 2;
const KEPT: usize = QUARTER / 2 + 1;
/// The angle of a step in degrees.
const STEP: f32 = 180.0 / ANGLES as f32;
/// Length in mm over which whiskers are alike, and the variance of their gains.
const LENGTH_MM: f64 = 6.0;
const GAIN: f64 = 0.25 * 0.25;
/// Fraction bits of a peak and of likeness, and of a weight.
const PEAK_BITS: u32 = 12;
const WEIGHT_BITS: u32 = 6;
/// A whisker below 55 % of all its neighbors is weak, in units of 2^-8, if they are lit: an eighth to the power of 0.6.
const WEAK: i32 = 141;
const LIT: i32 = 1176;

/// Distances across the motion, in 2^-16 pitches: whiskers on one way, and whiskers that have those between them lit.
const SAME_WAY: i32 = 3277;
const BESIDE: i32 = 78_643;
const MOST_MISSED: u32 = 1;

/// One of the directions: the whiskers' order across it.
struct Chain {
    /// How alike a whisker is to the one before it, in units of 2^-12; in higher bits its taxel; above that the inverse
    /// of the variance of what is left, in units of 2^-6, below 2^10.
    links: [u32; TAXELS],
    /// Half the logarithm of the variances' product, in units of 2^-20.
    half_ln: i32,
}

static CHAINS: [Chain; KEPT] = {
    const NONE: Chain = Chain { links: [0; TAXELS], half_ln: 0 };
    let mut chains = [NONE; KEPT];
    let mut k = 0;
    while k < KEPT {
        chains[k] = chain(core::f64::consts::PI * k as f64 / ANGLES as f64);
        k += 1;
    }
    chains
};

/// Returns the sine of an angle from 0 to π/2 by its series.
const fn sine(x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (x, x, 1);
    while n < 12 {
        term *= -x * x / ((2 * n) as f64 * (2 * n + 1) as f64);
        sum += term;
        n += 1;
    }
    sum
}

/// Returns the square root of 3 by Newton's steps.
const ROOT_3: f64 = 1.732_050_807_568_877_2;

const fn chain(angle: f64) -> Chain {
    let (up, right) = (sine(angle), sine(core::f64::consts::FRAC_PI_2 - angle));
    let (mut across, mut along) = ([0.0; TAXELS], [0.0; TAXELS]);
    let (mut links, mut order) = ([0; TAXELS], [0; TAXELS]);
    let mut taxel = 0;
    while taxel < TAXELS {
        let [x, y] = place_of(taxel);
        across[taxel] = -(x as f64) * up - y as f64 * right;
        along[taxel] = x as f64 * right - y as f64 * up;
        // Sorted by the place across, and by that along.
        let mut at = taxel;
        while at > 0 {
            let before: usize = order[at - 1];
            let apart = across[before] - across[taxel];
            if apart < -1e-6 || (apart < 1e-6 && along[before] < along[taxel]) {
                break;
            }
            order[at] = before;
            at -= 1;
        }
        order[at] = taxel;
        taxel += 1;
    }
    let whole = 1.0 + GAIN;
    let (mut at, mut sum) = (0, 0.0);
    while at < TAXELS {
        let mut like = 0.0;
        if at > 0 {
            let apart = across[order[at]] - across[order[at - 1]];
            let scaled = ROOT_3 * PITCH_MM as f64 * (if apart > 0.0 { apart } else { 0.0 }) / LENGTH_MM;
            like = (1.0 + scaled) * exp(-scaled) / whole;
        }
        let variance = whole * (1.0 - like * like);
        let weight = ((1 << WEIGHT_BITS) as f64 / variance + 0.5) as u32;
        links[at] = (like * (1 << PEAK_BITS) as f64 + 0.5) as u32 | (order[at] as u32 | weight << 5) << PEAK_BITS;
        sum += ln(variance);
        at += 1;
    }
    Chain { links, half_ln: (0.5 * sum * (1 << EXP_FRACTION_BITS) as f64) as i32 }
}

/// The direction that whiskers' peaks tell.
pub(super) struct Outline {
    /// Degrees counterclockwise from the right, from 0 to 180, or a little beyond.
    pub(super) degrees: f32,
    pub(super) degrees_sd: f32,
}

impl Outline {
    /// Returns the direction by the whiskers' peaks.
    #[inline(never)]
    pub(super) fn new(peaks: &[i16; TAXELS]) -> Self {
        let plain = values(peaks);
        // A grid as it is and a quarter turned, so that a kept chain tells two directions; its mirror image tells two
        // more.
        let grids: [[[i32; 2]; TAXELS]; 2] = [false, true].map(|is_mirrored| {
            core::array::from_fn(|taxel| {
                let [x, y] = place_of(taxel);
                let columns = COLUMNS as i32;
                let places =
                    if is_mirrored { [-x * columns - y, y * columns - x] } else { [y * columns + x, y - x * columns] };
                places.map(|at| plain.get((at + TAXELS as i32 / 2) as usize).copied().unwrap_or(0))
            })
        });
        let mut likely = [0_i32; ANGLES];
        let (first, second) = likely.split_at_mut(QUARTER);
        for (k, (of_plain, of_turned)) in first.iter_mut().zip(second).enumerate() {
            let is_mirrored = k >= KEPT;
            let grid = &grids[usize::from(is_mirrored)];
            let Some(chain) = CHAINS.get(if is_mirrored { QUARTER - k } else { k }) else { continue };
            let (mut before, mut sums) = ([0; 2], [0_u32; 2]);
            for link in &chain.links {
                let values = grid.get((link >> PEAK_BITS & 31) as usize).copied().unwrap_or_default();
                let (like, weight) = ((link & ((1 << PEAK_BITS) - 1)) as i32, link >> (PEAK_BITS + 5));
                let square = |value: i32, before: i32| {
                    let rest = value - ((like * before) >> PEAK_BITS);
                    // Below 2^16, times below 2^10, 25 times.
                    ((rest * rest) as u32 >> 8) * weight
                };
                sums = [sums[0] + square(values[0], before[0]), sums[1] + square(values[1], before[1])];
                before = values;
            }
            for (likely, sum) in [of_plain, of_turned].into_iter().zip(sums) {
                let ln = Fixed::<256>.ln(sum.max(1)) >> (LN_FRACTION_BITS - EXP_FRACTION_BITS);
                *likely = -chain.half_ln - (ln >> 1) * TAXELS as i32;
            }
        }
        let highest = likely.iter().copied().max().unwrap_or(0);
        let best = likely.iter().position(|&each| each == highest).unwrap_or(0) as i32;
        let (mut whole, mut first, mut second) = (0, 0, 0);
        // A likelihood that is smaller by e^-11 is 0.
        for (k, likely) in (0..).zip(likely).filter(|(_, likely)| highest - likely < 11 << EXP_FRACTION_BITS) {
            let share = (exp_of_negative(highest.abs_diff(likely)) >> 16) as i32;
            let half = QUARTER as i32;
            // The nearest of both ways round.
            let turn = k - best;
            let turn = if turn < -half { turn + 2 * half } else { turn };
            let turn = if turn < half { turn } else { turn - 2 * half };
            // Below 2^15 · 36 · 18².
            (whole, first, second) = (whole + share, first + share * turn, second + share * turn * turn);
        }
        let mean = first as f32 / whole.max(1) as f32;
        let variance = second as f32 / whole.max(1) as f32 - mean * mean;
        Self { degrees: (best as f32 + mean) * STEP, degrees_sd: sqrt(variance.max(0.0) + 1.0 / 12.0) * STEP }
    }
}

/// Returns the peaks to the power of 0.6, in units of 2^-12 of the brightest. A weak whisker has the mean of its
/// neighbors.
fn values(peaks: &[i16; TAXELS]) -> [i32; TAXELS] {
    let ln =
        |peak: i16| Fixed::<256>.ln(u32::from(peak.max(1).unsigned_abs())) >> (LN_FRACTION_BITS - EXP_FRACTION_BITS);
    let highest = peaks.iter().copied().max().map_or(0, ln);
    let values = peaks.map(|peak| {
        let below = (highest - ln(peak)).max(0) as u32;
        if peak > 0 { (exp_of_negative(below / 5 * 3) >> (31 - PEAK_BITS)) as i32 } else { 0 }
    });
    let mut mended = values;
    for (taxel, place) in mended.iter_mut().enumerate() {
        let (row, column) = (taxel / COLUMNS, taxel % COLUMNS);
        let beside = [
            (row > 0).then(|| taxel - COLUMNS),
            (row + 1 < ROWS).then_some(taxel + COLUMNS),
            (column > 0).then(|| taxel - 1),
            (column + 1 < COLUMNS).then_some(taxel + 1),
        ];
        let (mut lowest, mut sum, mut count) = (i32::MAX, 0, 0);
        for value in beside.into_iter().flatten().filter_map(|at| values.get(at).copied()) {
            (lowest, sum, count) = (lowest.min(value), sum + value, count + 1);
        }
        if count >= 3 && lowest > LIT && *place << 8 < WEAK * lowest {
            *place = sum / count;
        }
    }
    mended
}

/// Returns the whiskers' places to the left of a motion, in 2^-16 pitches.
#[inline(never)]
fn across(right: f32, up: f32) -> [i32; TAXELS] {
    let [right, up] = [right, up].map(|part| (part * 65_536.0) as i32);
    core::array::from_fn(|taxel| {
        let [x, y] = place_of(taxel);
        -x * up - y * right
    })
}

/// Returns the highest value and the second one, at least 0.
pub(super) fn highest(values: impl Iterator<Item = i32>) -> [i32; 2] {
    values.fold([0; 2], with)
}

fn with([most, second]: [i32; 2], value: i32) -> [i32; 2] {
    if value > most { [value, most] } else { [most, second.max(value)] }
}

/// Returns the whiskers to the right of the deepest valley across the motion that parts two contacts, a bit for each.
#[inline(never)]
pub(super) fn valley(peaks: &[i16; TAXELS], right: f32, up: f32) -> Option<u32> {
    let [most, _] = highest(peaks.iter().map(|&peak| i32::from(peak)));
    let is_low = |light: i32, side: i32| 20 * light < 3 * side;
    // Two whiskers are in it.
    if peaks.iter().filter(|&&peak| is_low(peak.into(), most)).count() < 2 {
        return None;
    }
    // The place across the motion, and in the lowest five bits the taxel.
    let mut order = [0; TAXELS];
    for (across, taxel) in across(right, up).into_iter().zip(0..) {
        // Sorted in few bytes.
        let mut places = order.get_mut(..=taxel as usize).unwrap_or_default();
        if let Some(last) = places.last_mut() {
            *last = across << 5 | taxel;
        }
        while let Some((here, rest)) = places.split_last_mut()
            && let Some(before) = rest.last_mut().filter(|before| **before > *here)
        {
            core::mem::swap(before, here);
            places = rest;
        }
    }
    let sorted = order.map(|each| peaks.get(each as usize & 31).map_or(0, |&peak| i32::from(peak)));
    let (mut before, mut whiskers, mut deepest, mut side) = ([0; 2], 0, 0, None);
    for (at, (&[a, b], each)) in sorted.array_windows().zip(order).enumerate().take(TAXELS - 3) {
        (before, whiskers) = (with(before, a), whiskers | 1 << (each & 31));
        let bottom = a.max(b);
        // Both sides are lit, and the valley has less than 15 % of either. No side is brighter than the brightest.
        let is_side = |side| side << LIT_SHIFT > most && is_low(bottom, side) && side - bottom > deepest;
        if at < 2 || !is_low(bottom, most) || !is_side(before[1]) {
            continue;
        }
        let [_, behind] = highest(sorted.iter().copied().skip(at + 1));
        let sides = before[1].min(behind);
        if is_side(sides) {
            (deepest, side) = (sides - bottom, Some(whiskers));
        }
    }
    side
}

/// Returns whether whiskers are lit along the whole way, but for a dead one. An object that stops on the sensor leaves
/// whiskers ahead of it dark.
pub(super) fn is_crossed(peaks: &[i16; TAXELS], right: f32, up: f32) -> bool {
    let places = across(right, up);
    let highest = i32::from(peaks.iter().copied().max().unwrap_or(0));
    let mut missed = 0;
    for (_, here) in peaks.iter().zip(&places).filter(|&(&peak, _)| i32::from(peak) << LIT_SHIFT <= highest) {
        let lit = peaks.iter().zip(&places).filter(|&(&peak, _)| 3 * i32::from(peak) >= highest);
        let is_lit = |from, to| lit.clone().any(|(_, other)| (from..=to).contains(&(other - here)));
        missed += u32::from(is_lit(-BESIDE, SAME_WAY) && is_lit(-SAME_WAY, BESIDE));
    }
    missed <= MOST_MISSED
}
