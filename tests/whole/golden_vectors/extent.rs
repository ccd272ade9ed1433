//! Tests places and widths of the reference's touches, with their deviations, and their contacts.

use serde::Deserialize;
use wstac_core::params::TAXELS;
use wstac_core::touch::wave::{Extent, Measured};

use super::case::{Cases, directory, read};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ExtentCase {
    name: String,
    energies: [i32; TAXELS],
    deg: f32,
    deg_sd: f32,
    extent: ExtentOf,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExtentOf {
    contacts: u8,
    place_mm: Option<f32>,
    place_sd: Option<f32>,
    width_mm: Option<f32>,
    width_sd: Option<f32>,
}

/// Heights have ten bits, and places are whole 256ths of a millimeter: SPEC §9 has these bounds.
#[test]
fn every_extent_is_that_of_the_reference() {
    let Cases::<ExtentCase> { cases } = read(&directory().join("extent.json"));
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let (mut answered, mut worst) = (0, [[0.0_f32; 2]; 2]);
    for ExtentCase { name, energies, deg, deg_sd, extent: expected } in &cases {
        let found = Extent::new(energies, *deg, *deg_sd);
        let numbers = |measured: Option<Measured>| measured.map(|Measured { value, sd }| [value, sd]);
        let both = |value: Option<f32>, sd: Option<f32>| Some([value?, sd?]);
        assert_eq!(found.contacts, expected.contacts, "{name}");
        let pairs = [
            (numbers(found.place_mm), both(expected.place_mm, expected.place_sd)),
            (numbers(found.width_mm), both(expected.width_mm, expected.width_sd)),
        ];
        let bounds = [[0.02, 0.03], [0.1, 0.12]];
        for (((found, expected), [off, apart]), [most, most_sd]) in pairs.into_iter().zip(&mut worst).zip(bounds) {
            assert_eq!(found.is_some(), expected.is_some(), "{name}: {found:?}, expected {expected:?}");
            let (Some([value, sd]), Some([of, of_sd])) = (found, expected) else { continue };
            (*off, *apart) = (off.max((value - of).abs()), apart.max((sd - of_sd).abs()));
            assert!((value - of).abs() < most, "{name}: {value}, expected {of}");
            assert!((sd - of_sd).abs() < most_sd, "{name}: {sd}, expected {of_sd}");
        }
        answered += usize::from(found.place_mm.is_some());
    }
    assert!(answered >= 25, "{answered} of {} have a place", cases.len());
    println!("{answered} of {} extents, off by at most {worst:?} mm", cases.len());
}
