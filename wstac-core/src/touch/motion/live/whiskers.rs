//! Whether 25 whiskers are lit as by an edge that crosses the whole sensor, at an even speed. A line is lit as soon as one
//! of its five whiskers is, so that lines alone take some narrow things for wide ones.

use crate::params::{SAMPLE_FRAMES, TAXELS};
use crate::touch::motion::edges::LINES;
use crate::touch::taxel_ring::TaxelRing;

/// The newest frame of a ring.
const NEWEST: usize = SAMPLE_FRAMES - 1;
/// The two frames before a touch that are dark, counted from the newest when its first line is lit.
const DARK: [usize; 2] = [3, 4];
/// Parts of a frame in which the age of an edge is kept.
const PARTS: u16 = 64;
/// The most that an age may be.
const OLDEST: u16 = 1000 * PARTS;
/// An edge is where light exceeds this part of its peak, in 256ths.
const LEVEL: i32 = 102;
/// Age of an edge after which only a peak of this many times the light counts: ridges of a texture are none.
const SETTLED: u16 = 3 * PARTS;
const HIGHER: u16 = 4;
/// Frames in which an edge is looked for.
const STEPS: usize = 6;
/// A whisker is lit if its peak is above the median over this number; so many must be: one may be dead.
const LIT: u16 = 4;
const FEWEST: usize = TAXELS - 1;
/// Largest difference of the slowness by whiskers from that by lines, as a fraction.
const DIFFERS: f32 = 0.12;
/// Least and most change of the slowness from the first whisker to the last, as a fraction.
const SLOWS: [f32; 2] = [-0.8, 0.7];
/// Most growth of the light from the first whisker to the last, as a fraction: it grows with the speed. That of the last
/// ones is still less when they have just been lit.
const GROWS: f32 = 0.12;

/// The first light of a whisker.
#[derive(Clone, Copy, Debug)]
struct FirstLight {
    dark: u16,
    peak: u16,
    /// Parts of a frame since the edge.
    age: u16,
}

/// The first light of all whiskers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whiskers {
    each: [FirstLight; TAXELS],
    /// Whether they agreed, or are not known: the check is of the leading edge.
    agree: bool,
}

impl Whiskers {
    /// Nothing is known, so nothing is refused.
    pub(super) const UNKNOWN: Self = Self { each: [FirstLight { dark: 0, peak: 0, age: 0 }; TAXELS], agree: true };

    /// Begins with a touch whose first line is lit in the newest frame.
    pub(super) fn begin(ring: &TaxelRing) -> Self {
        let mut whiskers = Self { agree: false, ..Self::UNKNOWN };
        for (taxel, whisker) in whiskers.each.iter_mut().enumerate() {
            let [a, b] = DARK.map(|back| ring.light(NEWEST - back, taxel));
            whisker.dark = a.min(b);
        }
        whiskers
    }

    /// Takes the newest frame, `frames` after the last.
    #[inline(never)]
    pub(super) fn follow(&mut self, ring: &TaxelRing, frames: u8) {
        if self.agree {
            return;
        }
        for (taxel, whisker) in self.each.iter_mut().enumerate() {
            let light = |back: usize| ring.light(NEWEST.saturating_sub(back), taxel).saturating_sub(whisker.dark);
            let now = light(0);
            let age = whisker.age.saturating_add(u16::from(frames) * PARTS).min(OLDEST);
            let is_first = now > whisker.peak && (age < SETTLED || now >= whisker.peak.saturating_mul(HIGHER));
            (whisker.peak, whisker.age) = if is_first { (now, edge(now, light)) } else { (whisker.peak, age) };
        }
    }

    /// Returns whether all whiskers are lit, at the times at which the slowness of lines says, once they are.
    ///
    /// `lines` are slownesses of rows and columns in their own time, `toward` is the direction of the motion.
    #[inline(never)]
    pub(super) fn agree(&mut self, lines: [f32; 2], toward: [f32; 2], slowness: f32) -> bool {
        self.agree = self.agree || self.are_alike(lines, toward, slowness);
        self.agree
    }

    fn are_alike(&self, [of_rows, of_columns]: [f32; 2], [up, right]: [f32; 2], slowness: f32) -> bool {
        let peaks = self.each.map(|whisker| whisker.peak);
        // The median: a sort of 25 numbers may panic.
        let upper = peaks.iter().filter(|&one| peaks.iter().filter(|&peak| peak <= one).count() > TAXELS / 2);
        let least = upper.min().map_or(0, |median| median / LIT);
        let count = peaks.iter().filter(|peak| **peak > least).count();
        if count < FEWEST {
            return false;
        }
        // How much later than on the lines' plane each is; the dark one, if there is one, as much as the mean.
        let mut late = [0.0_f32; TAXELS];
        let mut mean = 0.0;
        for ((late, whisker), [row, column]) in late.iter_mut().zip(&self.each).zip(places()) {
            if whisker.peak > least {
                *late = -f32::from(whisker.age) / f32::from(PARTS) - row * of_rows - column * of_columns;
                mean += *late / count as f32;
            }
        }
        // Squares of five places on both sides of the middle, five times, are 50.
        let (mut rows, mut columns, mut squares, mut rest) = (0.0, 0.0, 0.0, 0.0);
        let along = |[row, column]: [f32; 2]| row * up + column * right;
        for ((late, whisker), place) in late.iter_mut().zip(&self.each).zip(places()) {
            *late = if whisker.peak > least { *late - mean } else { 0.0 };
            rows += place[0] * *late / 50.0;
            columns += place[1] * *late / 50.0;
            rest += *late / TAXELS as f32;
            squares += along(place) * along(place) / TAXELS as f32;
        }
        let (mut bent, mut bends, mut grown, mut light) = (0.0, 0.0, 0.0, 0.0);
        for ((late, whisker), [row, column]) in late.iter().zip(&self.each).zip(places()) {
            let along = along([row, column]);
            let bend = along * along - squares;
            bent += (late - rest - row * rows - column * columns) * bend;
            bends += bend * bend;
            grown += along * f32::from(whisker.peak);
            light += f32::from(whisker.peak);
        }
        let reach = 2.0 * (up.abs() + right.abs());
        let slows = 4.0 * reach * bent / (bends * slowness);
        let grows = 2.0 * reach * grown / (squares * light);
        rows * rows + columns * columns < (DIFFERS * slowness) * (DIFFERS * slowness)
            && slows > SLOWS[0]
            && slows < SLOWS[1]
            && grows < GROWS
    }
}

/// Returns the parts of a frame since light exceeded the level of its peak, which is the light of now.
fn edge(now: u16, light: impl Fn(usize) -> u16) -> u16 {
    let mut after = i32::from(now);
    let level = (after * LEVEL) >> 8;
    for back in 1..STEPS {
        let before = i32::from(light(back));
        if before <= level {
            let share = ((level - before) * i32::from(PARTS)).checked_div(after - before).unwrap_or(0);
            return (back as u16 * PARTS).saturating_sub(share as u16);
        }
        after = before;
    }
    (STEPS as u16 - 1) * PARTS
}

/// Rows and columns of taxels, counted from the middle.
fn places() -> impl Iterator<Item = [f32; 2]> {
    let half = LINES as i8 / 2;
    (-half..=half).flat_map(move |row| (-half..=half).map(move |column| [f32::from(row), f32::from(column)]))
}
