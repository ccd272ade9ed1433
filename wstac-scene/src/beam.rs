//! The beam of a whisker: a cantilever with a lateral load at its free end (L = 1 and EI = 1 throughout).
//!
//! The surface drives the beam, not a load: it shortens the whisker's projection. So the shortening selects a state,
//! and load, deflection and curvature follow from it.

use std::sync::OnceLock;

use libm::{exp, log, sqrt};
use serde::Deserialize;

use super::elliptic::{r_d, r_f};

/// The law by which a beam bends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Beam {
    /// Euler–Bernoulli with small slopes: δ = α/3, shortening α²/15, curvature at the base α.
    Linear,
    /// The elastica: large deflections, after K. E. Bisshopp and D. C. Drucker, "Large deflection of cantilever
    /// beams" (1945).
    #[default]
    Elastica,
}

/// A state of the beam, in units of its length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// Load α = P L² / EI.
    pub load: f64,
    /// Lateral deflection of the tip, δ / L: 0 to below 1 for the elastica.
    pub deflection: f64,
    /// Shortening of the projection, as a fraction of L: 0 to below 1 for the elastica.
    pub shortening: f64,
    /// Curvature at the base, κ₀ L: the strain at a surface r off the axis is κ₀ L · r / L.
    pub curvature: f64,
}

/// Logarithm of the smallest complement of the modulus, k'²: a load of 2 · 10^4.
const LEAST_COMPLEMENT: f64 = -280.0;
/// Shortening below which the elastica is within 1e-6 of the linear beam; there it is a small difference of large
/// numbers.
const SMALL_SHORTENING: f64 = 1e-6;
/// Load below which the elastica is within 1e-6 of the linear beam.
const SMALL_LOAD: f64 = 4e-3;

impl Beam {
    /// Returns the largest shortening that a whisker may have, as a fraction of its length.
    ///
    /// The linear beam does not apply beyond small slopes, and the loads of the elastica grow without bound.
    pub fn most_shortening(self) -> f64 {
        match self {
            Self::Linear => 0.6,
            Self::Elastica => MOST_SHORTENING,
        }
    }

    /// Returns the state under a load α ≥ 0.
    ///
    /// The elastica takes loads up to 2 · 10^4; larger loads give the state at that load.
    pub fn under_load(self, load: f64) -> Bend {
        match self {
            Self::Elastica if load > SMALL_LOAD => elastica(|bend| bend.load > load),
            Self::Linear | Self::Elastica => {
                Bend { load, deflection: load / 3.0, shortening: load * load / 15.0, curvature: load }
            }
        }
    }

    /// Returns the state whose projection is `shortening` ≥ 0 shorter.
    pub fn shortened(self, shortening: f64) -> Bend {
        match self {
            Self::Elastica if shortening > SMALL_SHORTENING => elastica(|bend| bend.shortening > shortening),
            Self::Linear | Self::Elastica => {
                let load = sqrt(15.0 * shortening);
                Bend { load, deflection: load / 3.0, shortening, curvature: load }
            }
        }
    }

    /// Returns the curvature κ L at `parts` + 1 even places from the base to the tip of a beam in the state `bend`.
    pub fn curvature_along(self, bend: &Bend, parts: usize) -> Vec<f64> {
        let parts = parts.max(1);
        match self {
            Self::Linear => (0..=parts).map(|k| bend.load * (1.0 - k as f64 / parts as f64)).collect(),
            Self::Elastica => elastica_along(bend, parts),
        }
    }
}

/// Returns the curvature of the elastica along its length.
///
/// It integrates θ'' = −α cos θ from θ = 0 and θ' = κ₀ at the base with the Runge–Kutta method.
fn elastica_along(bend: &Bend, parts: usize) -> Vec<f64> {
    const STEPS: usize = 1000;
    let steps = STEPS.div_ceil(parts);
    let step = 1.0 / (steps * parts) as f64;
    let rate = |[angle, curvature]: [f64; 2]| [curvature, -bend.load * libm::cos(angle)];
    let ahead = |[a, b]: [f64; 2], [da, db]: [f64; 2], by: f64| [a + da * by, b + db * by];
    let mut state = [0.0, bend.curvature];
    let mut along = vec![bend.curvature];
    for _ in 0..parts {
        for _ in 0..steps {
            let k1 = rate(state);
            let k2 = rate(ahead(state, k1, step / 2.0));
            let k3 = rate(ahead(state, k2, step / 2.0));
            let k4 = rate(ahead(state, k3, step));
            let mean: [f64; 2] = core::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
            state = ahead(state, mean, step);
        }
        along.push(state[1]);
    }
    along
}

/// Returns the first state of the elastica for which `beyond` holds, by bisection.
///
/// Load and shortening grow monotonically as the complement of the modulus, k'² = 1 − k², falls from 1/2 to 0. Near 0
/// they grow exponentially.
fn elastica(beyond: impl Fn(&Bend) -> bool) -> Bend {
    let (mut low, mut high) = (LEAST_COMPLEMENT, log(0.5));
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if beyond(&of_complement(exp(middle))) { low = middle } else { high = middle }
    }
    of_complement(exp(low))
}

/// Returns the elastica of the modulus k, given as k'² in 0..1/2.
///
/// With sin φ₀ = 2k² − 1 at the tip and sin² θ₁ = 1 / 2k²: √α = F(k) − F(k, θ₁), δ = 1 − 2 (E(k) − E(k, θ₁)) / √α,
/// projection √(2 sin φ₀ / α), κ₀ = √(2 α sin φ₀).
fn of_complement(complement: f64) -> Bend {
    let modulus = 1.0 - complement;
    let tip = 1.0 - 2.0 * complement;
    let (sine, cosine) = (1.0 / (2.0 * modulus), tip / (2.0 * modulus));
    let delta = cosine + complement * sine;
    let root = r_f(0.0, complement, 1.0) - sqrt(sine) * r_f(cosine, delta, 1.0);
    // E = F − k²/3 · R_D at both limits.
    let second = root - modulus / 3.0 * (r_d(0.0, complement, 1.0) - sine * sqrt(sine) * r_d(cosine, delta, 1.0));
    let load = root * root;
    Bend {
        load,
        deflection: 1.0 - 2.0 * second / root,
        shortening: 1.0 - sqrt(2.0 * tip / load),
        curvature: sqrt(2.0 * load * tip),
    }
}

/// A table of the elastica's states by the root of their shortening.
///
/// It is interpolated linearly and serves look-ups that happen many times per frame.
#[derive(Clone, Debug)]
pub(crate) struct BendTable {
    /// Curvature times the remaining projection, and load times the square of the remaining projection. Both are even
    /// in √shortening from end to end.
    values: Vec<[f64; 2]>,
}

/// Number of intervals of the table.
const INTERVALS: usize = 1024;
/// Shortening at the table's end.
const MOST_SHORTENING: f64 = 0.95;

impl BendTable {
    /// Returns the table, which is computed once. The relative error of its values is below 1e-5 (tested).
    pub(crate) fn get() -> &'static Self {
        static TABLE: OnceLock<BendTable> = OnceLock::new();
        TABLE.get_or_init(Self::new)
    }

    fn new() -> Self {
        let root = |index: usize| sqrt(MOST_SHORTENING) * index as f64 / INTERVALS as f64;
        let value = |root: f64| {
            let bend = Beam::Elastica.shortened(root * root);
            let left = 1.0 - root * root;
            [bend.curvature * left, bend.load * left * left]
        };
        Self { values: (0..=INTERVALS).map(|index| value(root(index))).collect() }
    }

    /// Returns the curvature at the base κ₀ L and the load α for the root `root` ≥ 0 of the shortening.
    #[inline]
    pub(crate) fn at(&self, root: f64) -> [f64; 2] {
        let root = root.min(const { MOST_ROOT });
        let position = root * const { INTERVALS as f64 / MOST_ROOT };
        let index = (position as usize).min(INTERVALS - 1);
        let Some(&[low, high]) = self.values.get(index..index + 2) else { return [0.0; 2] };
        let share = position - index as f64;
        let inverse = 1.0 / (1.0 - root * root);
        let between = |k: usize| low[k] + (high[k] - low[k]) * share;
        [between(0) * inverse, between(1) * inverse * inverse]
    }

    /// Returns d ln κ₀ / d ln √shortening for the root `root` ≥ 0 of the shortening.
    ///
    /// It is 1 for small shortenings and grows with the bend.
    pub(crate) fn steepness(&self, root: f64) -> f64 {
        let root = root.min(const { MOST_ROOT });
        let width = const { MOST_ROOT / INTERVALS as f64 };
        let index = ((root / width) as usize).min(INTERVALS - 1);
        let Some(&[[low, _], [high, _]]) = self.values.get(index..index + 2) else { return 1.0 };
        let value = low + (high - low) * (root / width - index as f64);
        if value <= 0.0 {
            return 1.0;
        }
        root * (high - low) / (width * value) + 2.0 * root * root / (1.0 - root * root)
    }
}

/// The square root of [`MOST_SHORTENING`].
const MOST_ROOT: f64 = 0.974_679_434_480_896_3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_elastica_is_bisshopp_and_druckers_to_four_digits() {
        for (load, deflection) in [(1.0, 0.3017), (2.0, 0.4935), (5.0, 0.7138), (10.0, 0.8106)] {
            let found = Beam::Elastica.under_load(load).deflection;
            println!("PL²/EI = {load}: δ/L = {found:.6}, published {deflection}");
            assert!((found - deflection).abs() < 0.5e-4, "{load}: {found}");
        }
    }

    #[test]
    fn both_beams_agree_under_small_loads() {
        for load in [0.0, 1e-6, 1e-3, 3.9e-3, 4.1e-3, 0.01] {
            let (linear, elastica) = (Beam::Linear.under_load(load), Beam::Elastica.under_load(load));
            for (a, b) in [
                (linear.deflection, elastica.deflection),
                (linear.shortening, elastica.shortening),
                (linear.curvature, elastica.curvature),
            ] {
                assert!((a - b).abs() <= 2e-5 * a, "{load}: {a} {b}");
            }
        }
    }

    #[test]
    fn no_load_and_a_huge_load_stay_finite_and_ordered() {
        assert_eq!(Beam::Elastica.under_load(0.0), Bend::default());
        let mut last = Bend::default();
        for exponent in -30..=30 {
            let bend = Beam::Elastica.under_load(libm::pow(10.0, f64::from(exponent) / 10.0));
            assert!(bend.deflection > last.deflection && bend.deflection < 1.0, "{bend:?}");
            assert!(bend.shortening > last.shortening && bend.shortening < 1.0, "{bend:?}");
            assert!(bend.curvature > last.curvature && bend.curvature.is_finite(), "{bend:?}");
            last = bend;
        }
        // PL²/EI = 1000: nearly flat, with all bending next to the base.
        assert!((last.load - 1000.0).abs() < 1e-6 && last.deflection > 0.98, "{last:?}");
    }

    #[test]
    fn the_table_is_the_elastica() {
        assert!((MOST_ROOT * MOST_ROOT - MOST_SHORTENING).abs() < 1e-15);
        let table = BendTable::get();
        for index in 1..=4000 {
            let shortening = 0.95 * f64::from(index) / 4000.0;
            let (found, expected) = (table.at(sqrt(shortening)), Beam::Elastica.shortened(shortening));
            assert!((found[0] / expected.curvature - 1.0).abs() < 1e-5, "{shortening}: {found:?} {expected:?}");
            assert!((found[1] / expected.load - 1.0).abs() < 2e-5, "{shortening}: {found:?} {expected:?}");
        }
        assert!(table.at(0.0)[0].abs() < 1e-12);
        assert!((table.at(2.0)[0] - table.at(0.974_679_43)[0]).abs() < 1e-4);
    }

    #[test]
    fn curvature_falls_from_the_base_to_nothing_at_the_tip() {
        for beam in [Beam::Linear, Beam::Elastica] {
            for load in [0.01, 1.0, 10.0, 100.0] {
                let bend = beam.under_load(load);
                let along = beam.curvature_along(&bend, 20);
                assert_eq!(along.len(), 21);
                assert!((along[0] / bend.curvature - 1.0).abs() < 1e-12);
                assert!(along.windows(2).all(|pair| pair[0] > pair[1]), "{along:?}");
                // The moment at the tip is zero.
                assert!(along[20].abs() < 1e-5 * bend.curvature, "{beam:?} {load} {}", along[20]);
            }
        }
    }
}
