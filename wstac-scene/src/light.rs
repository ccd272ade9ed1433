//! The light of a whisker's base: it flashes with the rate of strain, glows while it is rubbed, and fades
//! exponentially.
//!
//! Light is counted in fractions of the camera's full scale, as the mean of a taxel. Light that is emitted over time is
//! counted in fractions of full scale times seconds.

use libm::{exp, fabs};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use wstac_core::params::{COLUMNS, ROWS, TAXELS};
use wstac_host::text_file::wholes;

use super::keys::{key_table, within};
use super::rng::Rng;

key_table! {
    /// The `[light]` table of a scene.
    #[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct LightConfig {
        /// Light of bending by a strain of 1, in full scales · ms (a guess: bright slides reach a third of full scale).
        pub flash_ms: f64 = 11.0, in 0.0..=1e6;
        /// Light of rubbing over 1 mm under a load P L² / EI of 1, in full scales · ms; 0 for none.
        ///
        /// Rubbing is friction times speed times load (a guess).
        pub rubbing_ms: f64 = 0.01, in 0.0..=1e6;
        /// Standard deviation of the rubbing, as a fraction of it; 0 for even rubbing (a guess).
        pub fluctuation: f64 = 0.5, in 0.0..=10.0;
        /// Length over which the fluctuation stays similar, in mm (1, a guess).
        pub fluctuation_mm: f64 = 1.0, in 0.1..=1e3;
        /// Time in which light fades to 1/e, in ms; 0 for none.
        ///
        /// It was fitted, with the specimens' length, to the paper's speed law (SPEC §8).
        pub afterglow_ms: f64 = 44.5;
        /// Standard deviation of the whiskers' gains, as a fraction (a guess).
        pub gain_deviation: f64 = 0.05, in 0.0..=1.0;
        /// Number of the sensor unit: each unit has its own gains.
        pub unit: u32 = 0;
        /// Standard deviation of the gain of all whiskers from slide to slide, as a fraction (0.1, a guess).
        ///
        /// The light of similar sensors was seen to vary by 9 to 29 % from run to run.
        pub run_deviation: f64 = 0.1, in 0.0..=1.0;
        /// Ambient light that leaks in, as a fraction of full scale.
        pub leak: f64 = 0.0, in 0.0..=1.0;
        /// Growth of the leak per minute, as a fraction of full scale.
        ///
        /// It counts as light of the bases: within a taxel it has the shape of their spots, and its mean is that of a
        /// leak.
        pub leak_per_minute: f64 = 0.0, in 0.0..=1.0;
        /// Growth of all light per minute, as a fraction; a negative value means less light.
        pub drift_per_minute: f64 = 0.0, in -1.0..=10.0;
        /// Light of a base that is seen at each of the four beside it, as a fraction (the same for all: a guess).
        pub crosstalk: f64 = 0.0, in 0.0..=0.25;
        /// Light that is lost from touch to touch, as a fraction: the n-th has (1 − decay)ⁿ⁻¹ of the first one's (a
        /// guess).
        pub decay: f64 = 0.0, in 0.0..=1.0;
        /// Whiskers that give no light.
        pub dead: Dead = Dead::default();
        /// Whiskers that give less light than the others.
        pub weak: Weak = Weak::default();
    }
}

/// Whiskers that give less light, read from a list of row, column (each 1 to 5) and gain (0 to 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weak([f32; TAXELS]);

impl<'de> Deserialize<'de> for Weak {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(wholes::<_, (i64, i64, f64)>(deserializer)?).map_err(D::Error::custom)
    }
}

impl Default for Weak {
    fn default() -> Self {
        Self([1.0; TAXELS])
    }
}

impl Weak {
    /// Returns the gain of the whisker of this taxel, 1 for a whisker that is not weak.
    pub fn gain(&self, taxel: usize) -> f64 {
        self.0.get(taxel).map_or(1.0, |&gain| f64::from(gain))
    }

    /// Returns the number of whiskers that are weak.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|gain| **gain < 1.0).count()
    }
}

impl TryFrom<Vec<(i64, i64, f64)>> for Weak {
    type Error = String;

    /// Reads the list; an error names the key, the value found and the values expected.
    fn try_from(places: Vec<(i64, i64, f64)>) -> Result<Self, String> {
        let mut gains = Self::default();
        for (row, column, gain) in places {
            let taxel = taxel_of("weak", row, column)?;
            within("gain of weak", gain, 0.0, 1.0)?;
            if let Some(of) = gains.0.get_mut(taxel) {
                *of = gain as f32;
            }
        }
        Ok(gains)
    }
}

/// Returns the taxel of a row and a column; an error names the key, the values found and the values expected.
pub(crate) fn taxel_of(key: &str, row: i64, column: i64) -> Result<usize, String> {
    let (rows, columns) = (ROWS as i64, COLUMNS as i64);
    if !(1..=rows).contains(&row) || !(1..=columns).contains(&column) {
        return Err(format!("{key} has [{row}, {column}], expected a row and a column of 1 to {rows}"));
    }
    Ok(((row - 1) * columns + column - 1) as usize)
}

/// The set of whiskers that give no light, read from a list of rows and columns, each 1 to 5.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dead(u32);

impl<'de> Deserialize<'de> for Dead {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(wholes::<_, [i64; 2]>(deserializer)?).map_err(D::Error::custom)
    }
}

impl Dead {
    /// Returns `true` if the whisker of this taxel gives no light.
    pub fn has(self, taxel: usize) -> bool {
        self.0 >> taxel & 1 == 1
    }

    /// Returns the number of whiskers that give no light.
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }
}

impl TryFrom<Vec<[i64; 2]>> for Dead {
    type Error = String;

    /// Reads the list; an error names the key, the value found and the values expected.
    fn try_from(places: Vec<[i64; 2]>) -> Result<Self, String> {
        places
            .into_iter()
            .try_fold(Self(0), |Self(dead), [row, column]| Ok(Self(dead | 1 << taxel_of("dead", row, column)?)))
    }
}

impl LightConfig {
    /// Checks every key.
    ///
    /// # Errors
    /// A value is out of range; the message names the key, the value found and the values expected.
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.afterglow_ms != 0.0 {
            within("afterglow_ms", self.afterglow_ms, 0.1, 1e5).map_err(|message| format!("{message}, or 0"))?;
        }
        self.check_ranges()
    }

    /// Returns the light that is seen at each base if this light is emitted there.
    pub(crate) fn seen(&self, light: [f64; TAXELS]) -> [f64; TAXELS] {
        if self.crosstalk <= 0.0 {
            return light;
        }
        let at = |row: usize, column: usize| {
            if row < ROWS && column < COLUMNS { light[row * COLUMNS + column] } else { 0.0 }
        };
        core::array::from_fn(|taxel| {
            let (row, column) = (taxel / COLUMNS, taxel % COLUMNS);
            let (above, before) = (row.wrapping_sub(1), column.wrapping_sub(1));
            let beside = at(above, column) + at(row + 1, column) + at(row, before) + at(row, column + 1);
            light[taxel] + self.crosstalk * beside
        })
    }

    /// Returns the gain of all light at a time in s since the scene's start.
    pub fn drifted(&self, seconds: f64) -> f64 {
        (1.0 + self.drift_per_minute * seconds / 60.0).max(0.0)
    }
}

/// Draws a gain around 1 that is never below 0.
pub(crate) fn gain(deviation: f64, rng: &mut Rng) -> f64 {
    if deviation > 0.0 { (1.0 + deviation * rng.normal()).max(0.0) } else { 1.0 }
}

/// The light of one base over a stretch of time, summed up from the light emitted at single moments.
///
/// τ dB/dt = e − B: light that is emitted at a moment raises B · τ and fades from then on. A stretch needs only two
/// values: the sum of the emitted light, and the part of it that has not faded by the end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exposure {
    /// Time constant in s, 0 for none.
    afterglow: f64,
    /// End of the stretch in s.
    end: f64,
    emitted: f64,
    left: f64,
}

impl Exposure {
    /// Creates a stretch that ends at `end` s.
    pub(crate) fn new(afterglow: f64, end: f64) -> Self {
        Self { afterglow, end, emitted: 0.0, left: 0.0 }
    }

    /// Adds light that is emitted around the moment `at`, spread over about `length` s.
    #[inline]
    pub(crate) fn add(&mut self, emitted: f64, at: f64, length: f64) {
        self.emitted += emitted;
        if self.afterglow > 0.0 {
            let age = (self.end - at) / self.afterglow;
            // Light that is spread fades a little less than light at its mean moment, because e^x is convex. The
            // variance of the spread is near length² / 12, both for an even rate and for that of the first touch.
            let spread = length / self.afterglow;
            self.left += emitted * exp(-age) * (1.0 + spread * spread / 24.0);
        }
    }

    /// Returns the exposure: the brightness integrated over the stretch of `length` s, in full scales · s.
    ///
    /// It advances `brightness` to the end of the stretch.
    pub(crate) fn close(&self, brightness: &mut f64, length: f64) -> f64 {
        if self.afterglow <= 0.0 {
            return self.emitted;
        }
        let before = *brightness;
        *brightness = before * exp(-length / self.afterglow) + self.left / self.afterglow;
        if *brightness < 1e-12 {
            *brightness = 0.0;
        }
        // Light that is neither exposed nor left at the end fades later.
        self.emitted - self.afterglow * (*brightness - before)
    }
}

/// A fluctuation along the path of one whisker over one specimen.
///
/// It consists of independent numbers of mean 0 and standard deviation 1 at even distances, with straight lines between
/// them.
#[derive(Clone, Debug)]
pub(crate) struct Fluctuation {
    seed: u64,
    knot: i64,
    values: [f64; 2],
}

impl Fluctuation {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, knot: i64::MIN, values: [0.0; 2] }
    }

    /// Returns the values at two places that are at most 1 apart, and the mean between them.
    ///
    /// The unit of length is the distance between its numbers.
    pub(crate) fn over(&mut self, from: f64, to: f64) -> [f64; 3] {
        let knot = libm::floor(to);
        let first = self.at(from);
        if knot <= from {
            let last = self.at(to);
            return [first, last, 0.5 * (first + last)];
        }
        // The curve is straight on either side of the number between the places.
        let between = self.at(knot);
        let last = self.at(to);
        let sum = (first + between) * (knot - from) + (between + last) * (to - knot);
        [first, last, 0.5 * sum / (to - from)]
    }

    fn at(&mut self, place: f64) -> f64 {
        let floor = libm::floor(place);
        let knot = floor as i64;
        if knot != self.knot {
            let value = |knot: i64| Rng::new(self.seed, knot as u64).normal();
            let low = if knot == self.knot.wrapping_add(1) { self.values[1] } else { value(knot) };
            (self.values, self.knot) = ([low, value(knot.wrapping_add(1))], knot);
        }
        let share = place - floor;
        EVEN * (self.values[0] + (self.values[1] - self.values[0]) * share)
    }
}

/// Factor that makes up for interpolation: between independent numbers the mean deviates less, by √(2/3) on average.
const EVEN: f64 = 1.224_744_871_391_589;

/// Returns the mean moment of a change that follows the root of a linear quantity, as a fraction of its time.
///
/// The change goes from the root `from` to the root `to`.
#[inline]
pub(crate) fn moment_of_roots(from: f64, to: f64) -> f64 {
    let sum = from + to;
    if sum > 0.0 { (to + 2.0 * from) / (3.0 * sum) } else { 0.5 }
}

/// Returns the light of a change of strain.
#[inline]
pub(crate) fn flash(before: f64, after: f64) -> f64 {
    fabs(after - before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_is_emitted_is_seen_whenever_it_is() {
        for (at, frames) in [(0.0, 60), (0.01, 60), (0.033, 60)] {
            let (mut brightness, mut seen) = (0.0, 0.0);
            for frame in 0..frames {
                let mut exposure = Exposure::new(0.05, 0.033);
                if frame == 0 {
                    exposure.add(0.2, at, 0.0);
                }
                seen += exposure.close(&mut brightness, 0.033);
            }
            assert!((seen - 0.2).abs() < 1e-9, "{at}: {seen}");
        }
        let (mut none, mut at_once) = (0.0, Exposure::new(0.0, 1.0));
        at_once.add(0.2, 0.9, 0.0);
        assert!((at_once.close(&mut none, 1.0) - 0.2).abs() < 1e-15 && none.abs() < 1e-15);
    }

    #[test]
    fn an_even_rate_may_be_added_at_once() {
        let parts = |count: u32| {
            let (mut exposure, mut brightness) = (Exposure::new(0.055, 0.02), 0.0);
            let length = 0.02 / f64::from(count);
            for part in 0..count {
                exposure.add(length, (f64::from(part) + 0.5) * length, length);
            }
            exposure.close(&mut brightness, 0.02)
        };
        // ∫ (1 − e^(−t/τ)) dt.
        let expected = 0.02 - 0.055 * (1.0 - exp(-0.02_f64 / 0.055));
        for (count, error) in [(1, 5e-5), (4, 5e-7), (32, 1e-9)] {
            assert!((parts(count) / expected - 1.0).abs() < error, "{count}: {}", parts(count) / expected - 1.0);
        }
    }

    #[test]
    fn the_mean_moment_of_a_root() {
        // ∫ x d√x from 1/4 to 1, by parts.
        let expected = (1.0 - 2.0 / 3.0 * (1.0 - 0.125) - 0.125) / 0.5;
        let found = 0.25 + 0.75 * moment_of_roots(0.5, 1.0);
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        assert!((moment_of_roots(0.0, 1.0) - 1.0 / 3.0).abs() < 1e-15);
        assert!((moment_of_roots(1.0, 0.0) - 2.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn a_fluctuation_has_mean_0_and_deviation_1_and_is_the_same_from_wherever_it_is_asked() {
        let mut there = Fluctuation::new(3);
        let values: Vec<f64> = (0..100_000).map(|k| there.at(f64::from(k) * 0.37)).collect();
        let mean = values.iter().sum::<f64>() / 1e5;
        let variance = values.iter().map(|x| x * x).sum::<f64>() / 1e5;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
        let mut back = Fluctuation::new(3);
        for k in (0..100_000).rev().step_by(777) {
            assert!((back.at(k as f64 * 0.37) - values[k]).abs() < 1e-12);
        }
    }
}
