//! Tests the logarithm on every integer that the published layouts can have, against 64-bit floating point (SPEC §2).

use wstac_core::features::{FeatureScale, Floor};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};

/// Units of a feature per 1.
const ONE: f64 = 2048.0;
/// Full scale of green with 8 bits.
const FULL_SCALE: u32 = 255;

/// The errors of a kernel on all integers of one domain.
struct Found {
    integers: u32,
    correctly_rounded: u32,
    /// Largest distance from the correctly rounded feature, in units.
    furthest: i32,
    /// Largest distance from the real number, in units.
    error: f64,
    falls: u32,
}

/// Returns ln `sum` − ln `most`, rounded to the nearest feature (ties round up), and as a real number of units.
fn expected(sum: u32, most: u32) -> (i32, f64) {
    let units = (f64::from(sum).ln() - f64::from(most).ln()) * ONE;
    ((units + 0.5).floor() as i32, units)
}

/// Tests every sum 1..=5·A·G without a floor.
fn every_integer<L: Ln>(pixels: u32) -> Found {
    let most = pixels * FULL_SCALE;
    let scale = FeatureScale::<L>::new(pixels, FULL_SCALE, 1, Floor::new(0.0, FULL_SCALE).unwrap()).unwrap();
    let mut found = Found { integers: 5 * most, correctly_rounded: 0, furthest: 0, error: 0.0, falls: 0 };
    let mut previous = i16::MIN;
    for sum in 1..=5 * most {
        let (nearest, units) = expected(sum, most);
        let feature = scale.feature(sum);
        let distance = (i32::from(feature) - nearest).abs();
        found.correctly_rounded += u32::from(distance == 0);
        found.furthest = found.furthest.max(distance);
        found.error = found.error.max((f64::from(feature) - units).abs());
        found.falls += u32::from(feature < previous);
        previous = feature;
    }
    found
}

/// Prints the row of a kernel for each published layout. No error is above 1 unit.
fn check<L: Ln>(name: &str, may_fall: bool) {
    for (width, height, pixels) in [(400, 400, 2500), (640, 480, 3600), (1280, 720, 8100)] {
        let layout = Layout::paper(FrameSize::new(width, height).unwrap()).unwrap();
        let [taxel_width, taxel_height] = layout.taxel().map(u32::from);
        assert_eq!(taxel_width * taxel_height, pixels, "A of {width}x{height}");
        let found = every_integer::<L>(pixels);
        let share = 100.0 * f64::from(found.correctly_rounded) / f64::from(found.integers);
        println!(
            "{name:10} {width:4}x{height:<4} {:9} integers: {share:8.4} % correctly rounded, furthest {} unit, error at most {:.4} units, falls {} times",
            found.integers, found.furthest, found.error, found.falls
        );
        assert!(found.furthest <= 1, "{name} {width}x{height} is off by {} units", found.furthest);
        assert!(share > 90.0, "{name} {width}x{height} rounds only {share} % correctly");
        assert!(may_fall || found.falls == 0, "{name} {width}x{height} falls {} times", found.falls);
        let scale = FeatureScale::<L>::new(pixels, FULL_SCALE, 1, Floor::new(0.0, FULL_SCALE).unwrap()).unwrap();
        assert_eq!(scale.feature(pixels * FULL_SCALE), 0, "full scale is 0");
    }
}

#[test]
fn fixed_256_is_within_a_unit_of_ln_and_monotone_on_every_integer() {
    check::<Fixed<256>>("fixed 256", false);
}

#[test]
fn fixed_32_is_within_a_unit_of_ln_and_monotone_on_every_integer() {
    check::<Fixed<32>>("fixed 32", false);
}

#[test]
fn libm_is_within_a_unit_of_ln_and_monotone_on_every_integer() {
    check::<Libm>("libm", false);
}

#[test]
fn micromath_is_within_a_unit_of_ln_on_every_integer() {
    check::<Micromath>("micromath", true);
}
