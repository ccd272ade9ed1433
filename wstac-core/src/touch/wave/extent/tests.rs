//! Tests places and widths of objects that are known, and of whatever 25 whiskers may say.

use std::format;

use super::{Extent, Measured, place_of};
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

/// Checks that a length is off by at most three of its deviations, and by a limit in mm.
fn check(name: &str, found: Option<Measured>, of: f64, most: f64) {
    let Some(Measured { value, sd }) = found else { panic!("{name}: none, expected {of}") };
    let off = (f64::from(value) - of).abs();
    assert!(off < 3.0 * f64::from(sd) && off < most, "{name}: {value} ± {sd}, expected {of}");
}

#[test]
fn places_and_widths_are_those_of_the_objects() {
    for degrees in [20.0, 63.0, 110.0, 158.0, 201.0, 249.0, 295.0, 340.0] {
        for (place, width) in [(0.0, 8.0), (2.5, 9.0), (-3.0, 10.0)] {
            let rod = light(degrees, |left| f64::from((left - place).abs() < width / 2.0));
            let extent = Extent::new(&rod, degrees as f32, 0.5);
            check(&format!("rod's place {degrees}"), extent.place_mm, place, 0.8);
            check(&format!("rod's width {degrees}"), extent.width_mm, width, 1.7);
            let ball = light(degrees, |left| 1.0 - (2.0 * (left - place) / width).powi(2));
            let extent = Extent::new(&ball, degrees as f32, 0.5);
            check(&format!("ball's place {degrees}"), extent.place_mm, place, 0.8);
            check(&format!("ball's width {degrees}"), extent.width_mm, width, 1.7);
            assert_eq!(extent.contacts, 1);
        }
    }
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

#[test]
fn what_is_unknown_is_absent() {
    let none = |name: &str, light: &[i32; TAXELS], degrees: f32, contacts: u8| {
        let extent = Extent::new(light, degrees, 0.5);
        assert_eq!((extent.place_mm, extent.width_mm, extent.contacts), (None, None, contacts), "{name}");
    };
    none("black", &[0; TAXELS], 30.0, 0);
    none("below the dark", &[i32::MIN; TAXELS], 30.0, 0);
    none("saturated", &[i32::MAX; TAXELS], 30.0, 1);
    none("equal", &[1; TAXELS], 30.0, 1);
    for taxel in 0..TAXELS {
        none("one whisker", &core::array::from_fn(|each| if each == taxel { 9000 } else { 0 }), 30.0, 1);
        none("one bright", &core::array::from_fn(|each| if each == taxel { i32::MAX } else { 1 }), 30.0, 1);
    }
    none("along the rows", &light(0.0, |left| f64::from(left.abs() < 6.0)), 0.0, 1);
    none("as wide as the sensor", &light(30.0, |_| 1.0), 30.0, 1);
    none("a side beyond it", &light(30.0, |left| f64::from(left > -3.0)), 30.0, 1);
    none("two fingers", &light(30.0, |left| f64::from((left.abs() - 7.0).abs() < 3.5)), 30.0, 2);
}

/// Checks that whatever the light is, sums fit and numbers are in range. Overflow is a panic in tests.
#[test]
fn any_light_has_an_answer_in_range() {
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as u32
    };
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
