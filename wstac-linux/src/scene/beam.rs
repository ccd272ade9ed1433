//! A whisker's beam: a cantilever with a load at its free end, across its length (L = 1 and EI = 1 throughout).
//!
//! What drives it is not a load but the surface, which shortens the whisker's projection. So states are reached by their
//! shortening, and load, deflection and curvature follow.

use libm::{exp, log, sqrt};
use serde::Deserialize;

use super::elliptic::{r_d, r_f};

/// How a beam bends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Beam {
    /// Euler–Bernoulli with small slopes: δ = α/3, shortening α²/15, curvature at the base α.
    #[default]
    Linear,
    /// The elastica: large deflections, after K. E. Bisshopp and D. C. Drucker, "Large deflection of cantilever
    /// beams" (1945).
    Elastica,
}

/// A state of the beam, in units of its length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// Load α = P L² / EI.
    pub load: f64,
    /// Lateral deflection of the tip, δ / L: 0 to below 1 for the elastica.
    pub deflection: f64,
    /// Shortening of the projection, as a share of L: 0 to below 1 for the elastica.
    pub shortening: f64,
    /// Curvature at the base, κ₀ L: the strain at a surface r off the axis is κ₀ L · r / L.
    pub curvature: f64,
}

/// Logarithm of the least complement of the modulus, k'²: a load of 2 · 10^4.
const LEAST_COMPLEMENT: f64 = -280.0;
/// Below this shortening the elastica, a small difference of large numbers there, is within 1e-6 of the linear beam.
const SMALL_SHORTENING: f64 = 1e-6;
/// Below this load, likewise.
const SMALL_LOAD: f64 = 4e-3;

impl Beam {
    /// The state under a load α ≥ 0; the elastica takes loads up to 2 · 10^4 and stays there beyond.
    pub fn under_load(self, load: f64) -> Bend {
        match self {
            Self::Elastica if load > SMALL_LOAD => elastica(|bend| bend.load > load),
            Self::Linear | Self::Elastica => {
                Bend { load, deflection: load / 3.0, shortening: load * load / 15.0, curvature: load }
            }
        }
    }

    /// The state whose projection is `shortening` ≥ 0 shorter.
    pub fn shortened(self, shortening: f64) -> Bend {
        match self {
            Self::Elastica if shortening > SMALL_SHORTENING => elastica(|bend| bend.shortening > shortening),
            Self::Linear | Self::Elastica => {
                let load = sqrt(15.0 * shortening);
                Bend { load, deflection: load / 3.0, shortening, curvature: load }
            }
        }
    }
}

/// The first state of the elastica that is `beyond` what is asked for, by bisection: load and shortening grow
/// monotonically as the complement of the modulus, k'² = 1 − k², falls from 1/2 to 0, exponentially at the end.
fn elastica(beyond: impl Fn(&Bend) -> bool) -> Bend {
    let (mut low, mut high) = (LEAST_COMPLEMENT, log(0.5));
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if beyond(&of_complement(exp(middle))) { low = middle } else { high = middle }
    }
    of_complement(exp(low))
}

/// The elastica of the modulus k, given as k'² in 0..1/2. With sin φ₀ = 2k² − 1 at the tip and sin² θ₁ = 1 / 2k²:
/// √α = F(k) − F(k, θ₁), δ = 1 − 2 (E(k) − E(k, θ₁)) / √α, projection √(2 sin φ₀ / α), κ₀ = √(2 α sin φ₀).
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

/// The elastica's curvature at the base by its shortening.
#[derive(Clone, Debug)]
pub struct CurvatureTable {
    /// Curvature times what is left of the projection, even in √shortening: smooth from end to end.
    values: Vec<f64>,
}

/// Intervals of the table.
const INTERVALS: usize = 1024;
/// Shortening at the table's end; a whisker is taken to be shortened no further.
const MOST_SHORTENING: f64 = 0.95;

impl CurvatureTable {
    /// The table; relative error of what it gives below 1e-5 (tested).
    pub fn new() -> Self {
        let root = |index: usize| sqrt(MOST_SHORTENING) * index as f64 / INTERVALS as f64;
        let value = |shortening| Beam::Elastica.shortened(shortening).curvature * (1.0 - shortening);
        Self { values: (0..=INTERVALS).map(|index| value(root(index) * root(index))).collect() }
    }

    /// κ₀ L at a shortening ≥ 0.
    pub fn curvature(&self, shortening: f64) -> f64 {
        let shortening = shortening.min(MOST_SHORTENING);
        let position = sqrt(shortening / MOST_SHORTENING) * INTERVALS as f64;
        let index = (position as usize).min(INTERVALS - 1);
        match self.values.get(index..index + 2) {
            Some(&[low, high]) => (low + (high - low) * (position - index as f64)) / (1.0 - shortening),
            _ => 0.0,
        }
    }
}

impl Default for CurvatureTable {
    fn default() -> Self {
        Self::new()
    }
}

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
        // PL²/EI = 1000: nearly flat, all bending next to the base.
        assert!((last.load - 1000.0).abs() < 1e-6 && last.deflection > 0.98, "{last:?}");
    }

    #[test]
    fn the_table_is_the_elastica() {
        let table = CurvatureTable::new();
        for index in 1..=4000 {
            let shortening = 0.95 * f64::from(index) / 4000.0;
            let (found, expected) = (table.curvature(shortening), Beam::Elastica.shortened(shortening).curvature);
            assert!((found / expected - 1.0).abs() < 1e-5, "{shortening}: {found} {expected}");
        }
        assert!(table.curvature(0.0).abs() < 1e-12);
        assert!((table.curvature(2.0) - table.curvature(0.95)).abs() < 1e-12);
    }
}
