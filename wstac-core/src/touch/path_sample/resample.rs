//! Lines or whiskers of light, shifted by when the touch reaches them, and read at equal distances along its path.

use super::{FACTS, FRAME_BITS, ONE, rounded};
use crate::ln::Ln;
use crate::ln::fixed::Fixed;
use crate::params::{FEATURES, SAMPLE_FRAMES, TAXELS};

/// Light of lines over the frames of a sample, above their baselines, in a common unit.
pub(super) trait Light {
    /// Returns the light of a line in a frame; 0 beyond the sample.
    fn at(&self, frame: usize, line: usize) -> u16;

    /// Returns whether a frame was lost: its light is on a straight line between its neighbors.
    fn is_lost(&self, _: usize) -> bool {
        false
    }

    /// Returns whether some frame was lost.
    fn has_lost(&self) -> bool {
        false
    }
}

/// Most groups and spreads of a plan.
const GROUPS: usize = 6;
const SPREADS: usize = 2;

/// The combination of lines: the mean light of each group, and the differences of the lines of a spread.
pub(super) struct Plan<const LINES: usize> {
    /// The number of groups, and the group of each line.
    pub(super) groups: usize,
    group_of: [u8; LINES],
    /// The number of spreads, and the spread of each line.
    spreads: usize,
    spread_of: [u8; LINES],
    pub(super) step_mm: f32,
    /// The logarithm to base 2 of the steps whose mean light is 1.
    window_bits: u32,
    /// Steps before the touch.
    before: i32,
    /// Whether numbers are multiplied by the direction as well as by the speed.
    by_direction: bool,
}

impl<const LINES: usize> Plan<LINES> {
    /// Returns how many numbers a step has.
    pub(super) const fn numbers(&self) -> usize {
        self.channels() * if self.by_direction { 3 } else { 2 }
    }

    const fn channels(&self) -> usize {
        self.groups + self.spreads
    }
}

/// Groups of rows and columns: the middle line, its neighbors and the outer ones, first those that the motion crosses.
pub(super) const BY_ROWS: Plan<FEATURES> = by_lines([2, 1, 0, 1, 2, 5, 4, 3, 4, 5], [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
pub(super) const BY_COLUMNS: Plan<FEATURES> = by_lines([5, 4, 3, 4, 5, 2, 1, 0, 1, 2], [1, 1, 1, 1, 1, 0, 0, 0, 0, 0]);
/// Groups of whiskers: the nine in the middle, twelve around them, and four in the corners, which the dome lowers most.
pub(super) const BY_TAXELS: Plan<TAXELS> = Plan {
    groups: 3,
    group_of: [2, 1, 1, 1, 2, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 2, 1, 1, 1, 2],
    spreads: 1,
    spread_of: [0; TAXELS],
    step_mm: 1.0,
    window_bits: 5,
    before: 4,
    by_direction: false,
};

const fn by_lines(group_of: [u8; FEATURES], spread_of: [u8; FEATURES]) -> Plan<FEATURES> {
    let (groups, spreads, step_mm, window_bits, before) = (6, 2, 2.0, 4, 2);
    Plan { groups, group_of, spreads, spread_of, step_mm, window_bits, before, by_direction: true }
}

/// By what the numbers of a step are multiplied, in units of 2^-11.
#[derive(Clone, Copy)]
pub(super) struct Factors {
    /// ln(v / 120 mm/s), −1 to 1.
    pub speed: i32,
    /// The cosine of four times the direction.
    pub direction: i32,
}

/// The level at which a touch begins, as a fraction 2^-3 of a line's peak.
const START_SHIFT: u32 = 3;
/// A line is lit if its peak is at least a fraction 2^-4 of the brightest. Its own mean counts as at least that
/// fraction of the mean of all.
const LIT_SHIFT: u32 = 4;
/// Fraction bits of light in units of a line's own mean, and the most that it counts.
const OWN_BITS: u32 = 12;
const MOST_OWN: u64 = u16::MAX as u64;
/// Numbers of the window, over all of its steps and groups. It is the same for all plans (checked below).
const IN_WINDOW: u32 = 96;
/// Lines beside a lost frame are replaced by others that have at least a fraction 2^-2 of all light.
const THERE_SHIFT: u32 = 2;
/// Light that is added before a logarithm: a fraction 2^-6 of the mean light, or of the spread 1.
const LEAST_SHIFT: u32 = 6;

/// The place of each line along the path.
pub(super) struct Track<const LINES: usize> {
    /// How much later than the middle of the sensor the touch reaches each line, in units of 2^-16 frames.
    delays: [i32; LINES],
    is_lit: [bool; LINES],
    /// When the touch reaches the middle, in the same units.
    start: i32,
    /// The time of a step.
    step: i32,
}

impl<const LINES: usize> Track<LINES> {
    /// Finds when the touch began. `None` if all lines are dark.
    #[inline(never)]
    pub(super) fn new(
        light: &impl Light,
        plan: &Plan<LINES>,
        delays: [i32; LINES],
        weights: [i32; LINES],
        step: i32,
    ) -> Option<Self> {
        let mut peaks = [0_u16; LINES];
        for frame in 0..SAMPLE_FRAMES {
            for (line, peak) in peaks.iter_mut().enumerate() {
                *peak = (*peak).max(light.at(frame, line));
            }
        }
        let least = peaks.iter().max().map_or(0, |&most| (most >> LIT_SHIFT).max(1));
        let is_lit = peaks.map(|peak| peak >= least);
        // Edges beside a lost frame count only if there are no others.
        let (mut sums, mut counts) = ([0_i64; 2], [0_i64; 2]);
        for (line, ((&peak, &delay), &of)) in peaks.iter().zip(&delays).zip(&weights).enumerate() {
            if peak >= least {
                let at = edge(light, line, peak);
                let kind = usize::from(is_beside_lost(light, at));
                if let (Some(sum), Some(count)) = (sums.get_mut(kind), counts.get_mut(kind)) {
                    *sum += i64::from(of) * i64::from(at - delay);
                    *count += i64::from(of);
                }
            }
        }
        let [found, beside] = [0, 1].map(|kind: usize| sums.get(kind)?.checked_div(*counts.get(kind)?));
        let start = found.or(beside)? as i32 - plan.before * step;
        Some(Self { delays, is_lit, start, step })
    }

    /// Returns how many numbers are those of steps at which all lit lines are still within the sample.
    pub(super) fn covered(&self, plan: &Plan<LINES>) -> usize {
        let lit = self.delays.iter().zip(&self.is_lit).filter(|(_, is_lit)| **is_lit);
        let last = lit.map(|(&delay, _)| delay).max().unwrap_or(0) + self.start;
        let left = (((SAMPLE_FRAMES - 1) as i32) << FRAME_BITS) - last;
        let steps = left.checked_div(self.step).filter(|_| left >= 0).map_or(0, |steps| steps + 1);
        FACTS + (steps as usize).min(SAMPLE_FRAMES * FEATURES) * plan.numbers()
    }

    /// Returns the light of a line at a step: on a straight line between two frames, 0 before the sample, and the last
    /// frame's light behind it.
    #[inline(always)]
    fn light(&self, light: &impl Light, line: usize, delay: i32, step: usize) -> u32 {
        let at = self.start + delay + step as i32 * self.step;
        let frame = at >> FRAME_BITS;
        if frame < 0 {
            return 0;
        }
        let last = SAMPLE_FRAMES - 1;
        if frame as usize >= last {
            return u32::from(light.at(last, line));
        }
        let (from, to) = (i32::from(light.at(frame as usize, line)), i32::from(light.at(frame as usize + 1, line)));
        // A difference below 2^16 times a fraction below 2^15.
        (from + (((to - from) * ((at & 0xFFFF) >> 1) + (1 << 14)) >> 15)) as u32
    }

    /// Returns the light of all lit lines at a step; dark lines are 0.
    #[inline(never)]
    fn lines(&self, light: &impl Light, step: usize) -> [u32; LINES] {
        let mut lines = [0; LINES];
        for (line, ((place, &delay), &is_lit)) in lines.iter_mut().zip(&self.delays).zip(&self.is_lit).enumerate() {
            if is_lit {
                *place = self.light(light, line, delay, step);
            }
        }
        lines
    }

    /// Replaces the light of lines beside a lost frame by that of the others, which pass the same path at other times.
    ///
    /// `own` is the light of each line over the window. Returns false, and leaves them, if the others have too little
    /// of it.
    #[inline(never)]
    fn refill(&self, light: &impl Light, own: &[u32; LINES], step: usize, lines: &mut [u32; LINES]) -> bool {
        let is_there = |delay: i32| !is_beside_lost(light, self.start + delay + step as i32 * self.step);
        let is_there = self.delays.map(is_there);
        let (mut all, mut there, mut sum) = (0_u64, 0_u64, 0_u64);
        for (((&is_there, &is_lit), &light), &own) in is_there.iter().zip(&self.is_lit).zip(&*lines).zip(own) {
            all += if is_lit { u64::from(own) } else { 0 };
            if is_lit && is_there {
                there += u64::from(own);
                sum += u64::from(light);
            }
        }
        if there << THERE_SHIFT < all {
            return false;
        }
        for (((is_there, &is_lit), light), &own) in is_there.iter().zip(&self.is_lit).zip(lines).zip(own) {
            if is_lit && !is_there {
                // Both factors are below 2^26.
                *light = (u64::from(own) * sum).checked_div(there).unwrap_or(0).min(u16::MAX.into()) as u32;
            }
        }
        true
    }

    /// Returns the mean light of each group, in units of 2^-4; 0 for a group of dark lines.
    fn groups(&self, plan: &Plan<LINES>, lines: &[u32; LINES]) -> [u32; GROUPS] {
        let (mut sums, mut counts) = ([0_u32; GROUPS], [0_u32; GROUPS]);
        for ((&of, &light), &is_lit) in plan.group_of.iter().zip(lines).zip(&self.is_lit) {
            if let (Some(sum), Some(count)) = (sums.get_mut(usize::from(of)), counts.get_mut(usize::from(of))) {
                *sum += light;
                *count += u32::from(is_lit);
            }
        }
        core::array::from_fn(|group| {
            let count = counts.get(group).copied().unwrap_or(0);
            sums.get(group).map_or(0, |sum| (sum << 4).checked_div(count).unwrap_or(0))
        })
    }

    /// Writes the numbers of all steps that have room. Returns how many are before the first step of which too much was
    /// lost; `None` if the window is dark.
    #[inline(never)]
    pub(super) fn fill(
        &self,
        light: &impl Light,
        plan: &Plan<LINES>,
        factors: Factors,
        numbers: &mut [i16],
    ) -> Option<usize> {
        let ln = |x: u32| Fixed::<256>.ln(x.max(1));
        let (mut level, mut own) = (0, [0_u32; LINES]);
        // Lines on straight lines say how bright each is, and then replace each other.
        for is_refilled in [false, true] {
            if is_refilled && !light.has_lost() {
                continue;
            }
            let straight = own;
            (level, own) = (0, [0; LINES]);
            for step in 0..1 << plan.window_bits {
                let mut lines = self.lines(light, step);
                if is_refilled {
                    self.refill(light, &straight, step, &mut lines);
                }
                for (sum, light) in own.iter_mut().zip(lines) {
                    *sum += light;
                }
                level += self.groups(plan, &lines).iter().take(plan.groups).sum::<u32>();
            }
        }
        // The sum of 96 numbers of at most 2^20.
        let mean = level / IN_WINDOW;
        if mean == 0 {
            return None;
        }
        // A line's own light over the window, in units of 2^-4 of a step's.
        let least = (mean << plan.window_bits) >> LIT_SHIFT;
        let scales = own.map(|sum| (1_u64 << 31).checked_div(u64::from((sum << 4).max(least)) >> 4).unwrap_or(0));
        let unit = ln(level / 3 * 2);
        let Factors { speed, direction } = factors;
        let product = |a: i32, b: i32| (a * b) >> 11;
        let facts = [speed, direction, product(speed, speed), product(speed, direction)];
        let (first, rest) = numbers.split_at_mut_checked(FACTS)?;
        for (place, fact) in first.iter_mut().zip(facts) {
            *place = fact as i16;
        }
        let (mut step, mut rest, mut whole) = (0, rest, None);
        while !rest.is_empty() {
            let places;
            (places, rest) = parted(rest, plan.numbers());
            let mut lines = self.lines(light, step);
            if light.has_lost() && !self.refill(light, &own, step, &mut lines) {
                whole = whole.or(Some(FACTS + step * plan.numbers()));
            }
            step += 1;
            let mut found = [0_i32; GROUPS + SPREADS];
            for (place, group) in found.iter_mut().zip(self.groups(plan, &lines)) {
                *place = rounded(ln((group << LEAST_SHIFT) + mean) - unit, 15);
            }
            let spreads = self.spreads(plan, &lines, &scales);
            for (place, spread) in found.iter_mut().skip(plan.groups).zip(spreads) {
                *place = spread;
            }
            let mut places = places;
            for factor in [ONE, speed, direction] {
                let some;
                (some, places) = parted(places, plan.channels());
                for (place, &number) in some.iter_mut().zip(&found) {
                    *place = product(number, factor) as i16;
                }
            }
        }
        Some(whole.unwrap_or(usize::MAX))
    }

    /// Returns the logarithm of the standard deviation of each spread's lit lines, each in units of its own mean.
    fn spreads(&self, plan: &Plan<LINES>, lines: &[u32; LINES], scales: &[u64; LINES]) -> [i32; SPREADS] {
        let own = 31 - OWN_BITS - plan.window_bits;
        let (mut counts, mut sums, mut squares) = ([0_u32; SPREADS], [0_u32; SPREADS], [0_u64; SPREADS]);
        for (((&of, &light), &scale), &is_lit) in plan.spread_of.iter().zip(lines).zip(scales).zip(&self.is_lit) {
            let of = usize::from(of);
            if let (Some(count), Some(sum), Some(square), true) =
                (counts.get_mut(of), sums.get_mut(of), squares.get_mut(of), is_lit)
            {
                let light = ((u64::from(light) * scale) >> (own & 31)).min(MOST_OWN);
                *count += 1;
                *sum += light as u32;
                *square += light * light;
            }
        }
        let ln = |x: u64| Fixed::<256>.ln(x.clamp(1, u64::from(u32::MAX)) as u32);
        core::array::from_fn(|spread| {
            let (Some(&count), Some(&sum), Some(&square)) = (counts.get(spread), sums.get(spread), squares.get(spread))
            else {
                return 0;
            };
            // The variance in units of 2^-24 / n². At most 25 · 25 · 2^32.
            let (n, sum) = (u64::from(count), u64::from(sum));
            let variance = (n * square).saturating_sub(sum * sum);
            // Half the logarithm of the variance and 2^-12, whose root is 2^-6.
            let twice = ln((variance >> (2 * LEAST_SHIFT)) + n * n) - ln(n * n) - ln(1 << (2 * LEAST_SHIFT));
            rounded(twice, 16)
        })
    }
}

/// Returns the first `count` numbers, or all of them if there are not so many, and the others.
fn parted(numbers: &mut [i16], count: usize) -> (&mut [i16], &mut [i16]) {
    let count = count.clamp(1, numbers.len().max(1));
    numbers.split_at_mut_checked(count).unwrap_or_default()
}

/// Returns whether a time in units of 2^-16 frames is beside a frame that was lost.
fn is_beside_lost(light: &impl Light, at: i32) -> bool {
    let frame = at >> FRAME_BITS;
    light.has_lost()
        && [frame, frame + 1].into_iter().any(|frame| usize::try_from(frame).is_ok_and(|at| light.is_lost(at)))
}

/// Returns when a line first exceeds the level at which a touch begins, in units of 2^-16 frames.
fn edge(light: &impl Light, line: usize, peak: u16) -> i32 {
    let mut before = 0;
    for frame in 0..SAMPLE_FRAMES {
        let here = u32::from(light.at(frame, line)) << START_SHIFT;
        if here > u32::from(peak) {
            // The first difference is below 2^16.
            let since = ((u32::from(peak) - before) << FRAME_BITS).checked_div(here - before).unwrap_or(0);
            return if frame == 0 { 0 } else { ((frame as i32 - 1) << FRAME_BITS) + since as i32 };
        }
        before = here;
    }
    0
}

const fn in_window<const LINES: usize>(plan: &Plan<LINES>) -> u32 {
    (plan.groups as u32) << plan.window_bits
}

const _: () = assert!(in_window(&BY_ROWS) == IN_WINDOW && in_window(&BY_COLUMNS) == IN_WINDOW);
const _: () = assert!(in_window(&BY_TAXELS) == IN_WINDOW);
