//! Tests corrections of cross-talk of the reference's matrices, to the bit, and its refusals.

use serde::Deserialize;
use wstac_core::params::TAXELS;
use wstac_host::config::Config;

use super::case::{Cases, directory, read};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CrosstalkCase {
    name: String,
    matrix: Vec<Vec<f64>>,
    weights: Option<[Vec<i16>; TAXELS]>,
    frames: Vec<[u16; TAXELS]>,
    corrected: Vec<[u16; TAXELS]>,
}

#[test]
fn every_correction_is_that_of_the_reference() {
    let Cases::<CrosstalkCase> { cases } = read(&directory().join("crosstalk.json"));
    let mut frames = 0;
    for case in &cases {
        let config = Config::parse(&format!("[layout]\ncrosstalk = {:?}", case.matrix));
        let Some(weights) = &case.weights else {
            let error = config.expect_err(&case.name);
            assert!(error.message().contains("crosstalk has no inverse, or one that raises noise"), "{error}");
            continue;
        };
        let correction = config.unwrap().layout.correction().unwrap();
        assert!(
            correction.weights().iter().zip(weights).all(|(found, expected)| found[..] == expected[..]),
            "{}",
            case.name
        );
        assert_eq!(case.frames.len(), case.corrected.len());
        for (frame, expected) in case.frames.iter().zip(&case.corrected) {
            assert_eq!(correction.apply(frame), *expected, "{}: {frame:?}", case.name);
            frames += 1;
        }
    }
    assert!(cases.len() >= 6 && frames >= 24, "{} cases, {frames} frames", cases.len());
}
