//! Textures other than the ten specimens of the paper: what is unknown to a model, what an embedding is trained with,
//! and what is learned from a few slides.
//!
//! The ten specimens have depths of 2 to 4 mm and periods of 4 to 8 mm.

use wstac_scene::rng::Rng;
use wstac_scene::specimen::{Pattern, Specimen};

/// The kinds of [`unknown`] textures, in words.
pub const UNKNOWN_KINDS: [&str; 5] = ["shallow and fine", "shallow", "long", "short", "deep"];

/// The least factor by which an unknown texture's depth or period is outside those of the ten specimens.
const OUTSIDE: f64 = 1.5;

/// Returns textures whose depth or period is at least 1.5 times below or above those of the ten specimens, each with
/// the number of its kind in [`UNKNOWN_KINDS`].
pub fn unknown() -> Vec<(usize, Specimen)> {
    let shallow_mm = 2.0 / OUTSIDE;
    let deep_mm = 4.0 * OUTSIDE;
    let short_mm = 4.0 / OUTSIDE;
    let long_mm = 8.0 * OUTSIDE;
    let of = |specimen: &Specimen| {
        let with = |depth_mm: f64, period_mm: f64| Specimen { depth_mm, period_mm, ..*specimen };
        let (depth_mm, period_mm) = (specimen.depth_mm, specimen.period_mm);
        [
            (0, with(shallow_mm, short_mm)),
            (1, with(shallow_mm, period_mm)),
            (2, with(depth_mm, long_mm)),
            (2, with(depth_mm, 16.0)),
            (3, with(depth_mm, short_mm)),
            (3, with(depth_mm, 2.0)),
            (4, with(deep_mm, period_mm)),
            (4, with(deep_mm, long_mm)),
        ]
    };
    Specimen::ALL.iter().filter(|specimen| specimen.is_textured()).flat_map(of).collect()
}

/// The textures that no shipped model is trained with, for trials of learning: the three patterns of the paper as far
/// apart in depth as the ten specimens are, and one with a long period.
pub const NEW: [Specimen; 10] = [
    Specimen::block(Pattern::Sinc, 1.5),
    Specimen::block(Pattern::Sinc, 2.5),
    Specimen::block(Pattern::Sinc, 3.5),
    Specimen::block(Pattern::Saw, 1.5),
    Specimen::block(Pattern::Saw, 2.5),
    Specimen::block(Pattern::Saw, 3.5),
    Specimen::block(Pattern::Tri, 1.5),
    Specimen::block(Pattern::Tri, 2.5),
    Specimen::block(Pattern::Tri, 3.5),
    Specimen { period_mm: 12.0, ..Specimen::block(Pattern::Saw, 3.0) },
];

/// Returns the [`unknown`] textures that are unlike each of [`NEW`]: another pattern, or a depth or a period at least
/// 1.5 times above or below.
pub fn unlike_new() -> Vec<Specimen> {
    let outside = |one: f64, other: f64| (one / other).ln().abs() > OUTSIDE.ln() - 1e-9;
    let is_unlike = |new: &Specimen, other: &Specimen| {
        new.pattern != other.pattern || outside(new.depth_mm, other.depth_mm) || outside(new.period_mm, other.period_mm)
    };
    let all = unknown().into_iter().map(|(_, specimen)| specimen);
    all.filter(|specimen| NEW.iter().all(|new| is_unlike(new, specimen))).collect()
}

/// Returns random textures of the paper's three textured patterns: depths of 1 to 6 mm, periods of 2 to 16 mm, both
/// with an even logarithm.
///
/// Equal seeds give equal textures. None is within 5 % of one of [`NEW`] in both.
pub fn random(seed: u64, number: usize) -> Vec<Specimen> {
    let mut rng = Rng::new(seed, 7_000_000);
    let mut found = Vec::with_capacity(number);
    while found.len() < number {
        let mut between = |from: f64, to: f64| from * (to / from).powf(rng.uniform());
        let (depth_mm, period_mm) = (between(1.0, 6.0), between(2.0, 16.0));
        let pattern = [Pattern::Sinc, Pattern::Saw, Pattern::Tri][found.len() % 3];
        let specimen = Specimen { period_mm, ..Specimen::block(pattern, depth_mm) };
        if !NEW.iter().any(|new| is_near(new, &specimen)) {
            found.push(specimen);
        }
    }
    found
}

/// Returns whether two textures of one pattern differ by less than 5 % in depth and in period.
fn is_near(one: &Specimen, other: &Specimen) -> bool {
    let near = |a: f64, b: f64| (a / b).ln().abs() < 0.05;
    one.pattern == other.pattern && near(one.depth_mm, other.depth_mm) && near(one.period_mm, other.period_mm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_textures_are_outside_the_trained_ones() {
        let found = unknown();
        assert_eq!(found.len(), 72);
        for (kind, specimen) in found {
            let outside = |value: f64, low: f64, high: f64| value * 1.499 <= low || value >= high * 1.499;
            let (depth, period) = (outside(specimen.depth_mm, 2.0, 4.0), outside(specimen.period_mm, 4.0, 8.0));
            assert!(depth || period, "{specimen}");
            let expected = match kind {
                0 => depth && period,
                1 | 4 => depth,
                _ => period && !depth,
            };
            assert!(expected, "{} {specimen}", UNKNOWN_KINDS[kind]);
        }
    }

    #[test]
    fn textures_that_differ_little_from_new_ones_are_left_out() {
        let found = unlike_new();
        assert_eq!(found.len(), 53);
        let is_in = |pattern, depth_mm: f64, period_mm: f64| {
            let near = |of: &Specimen| (of.depth_mm - depth_mm).abs() + (of.period_mm - period_mm).abs() < 1e-6;
            found.iter().any(|of| of.pattern == pattern && near(of))
        };
        // A saw of 2 mm has a period of 4 mm: learned are one of 1.5 mm and 3 mm, and one of 3 mm and 12 mm.
        assert!(is_in(Pattern::Saw, 2.0, 2.0) && is_in(Pattern::Saw, 2.0, 12.0));
        assert!(!is_in(Pattern::Saw, 3.0, 12.0) && !is_in(Pattern::Saw, 4.0, 16.0));
    }

    #[test]
    fn random_textures_are_reproducible_and_none_is_new() {
        let found = random(1, 300);
        assert_eq!(found, random(1, 300));
        assert_ne!(found, random(2, 300));
        for specimen in &found {
            assert!((1.0..=6.0).contains(&specimen.depth_mm) && (2.0..=16.0).contains(&specimen.period_mm));
            assert!(!NEW.iter().any(|new| is_near(new, specimen)), "{specimen}");
        }
    }
}
