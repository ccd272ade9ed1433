//! Tests places and widths of objects that are known, and of whatever 25 whiskers may say.

use super::{Extent, place_of};
use crate::params::TAXELS;

/// Returns the light of an object by its height at a distance from its middle, to the left of the motion in mm.
fn light(degrees: f64, height: impl Fn(f64) -> f64) -> [i32; TAXELS] {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    core::array::from_fn(|taxel| {
        let [x, y] = place_of(taxel).map(f64::from);
        let lowered = (x * x + y * y) / 16.0;
        // A beam bends by the root of the overlap.
        (40_000.0 * (height(-4.0 * (x * sine + y * cosine)) - lowered).max(0.0).sqrt()) as i32
    })
}

#[test]
fn the_unit_of_light_is_free() {
    let rod = light(20.0, |left| f64::from(left.abs() < 4.0));
    let unit = Extent::new(&rod.map(|light| 8 * light), 20.0, 0.5);
    assert!(unit.place_mm.is_some());
    for shift in [4, 8, 15] {
        assert_eq!(Extent::new(&rod.map(|light| light << shift), 20.0, 0.5), unit, "{shift}");
    }
}

#[test]
fn a_direction_that_is_none_has_no_extent() {
    let rod = light(20.0, |left| f64::from(left.abs() < 4.0));
    for degrees in [-1e-3, 360.1, 1e9, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let extent = Extent::new(&rod, degrees, 0.5);
        assert_eq!((extent.place_mm, extent.width_mm, extent.contacts), (None, None, 0), "{degrees}");
    }
}

/// Checks that whatever the light is, sums fit and numbers are in range. Overflow is a panic in tests.
#[test]
fn any_light_has_an_answer_in_range() {
    let mut random = wstac_random_models::numbers();
    let mut answered = 0;
    for round in 0..20_000 {
        let degrees = (random() % 36_000) as f32 / 100.0;
        let (place, width) = (f64::from(random() % 240) / 10.0 - 12.0, f64::from(random() % 250 + 10) / 10.0);
        let smooth = light(f64::from(degrees), |left| 1.0 - (2.0 * (left - place).abs() / width).powi(round % 7 + 1));
        let light = core::array::from_fn(|taxel| match round % 5 {
            0 => random() as i32,
            1 => [0, i32::MAX][random() as usize & 1],
            2 => 1 << (random() % 31),
            3 => (random() % 3) as i32 - 1,
            _ => smooth.get(taxel).map_or(0, |&light| light + (random() % 4000) as i32),
        });
        let extent = Extent::new(&light, degrees, 0.5);
        assert_eq!(extent.place_mm.is_some(), extent.width_mm.is_some());
        if let (Some(place), Some(width)) = (extent.place_mm, extent.width_mm) {
            answered += 1;
            assert!(place.value.abs() < 14.0 && width.value > 0.0 && width.value < 30.0, "{round}: {extent:?}");
            assert!(place.sd > 0.03 && place.sd < 10.0 && width.sd > 0.09 && width.sd < 20.0, "{round}: {extent:?}");
        }
    }
    assert!(answered > 500, "{answered} answers");
}
