//! Tests calibrated models: the class, the probabilities, and whether a sample is known.

use serde::Deserialize;
use wstac_core::model::Model;
use wstac_core::model::calibration::CONFIDENCE_ONE;
use wstac_core::model::file::INPUTS;

use super::case::{Cases, directory, read};

#[derive(Deserialize)]
struct Case {
    dimensions: usize,
    words: Vec<u32>,
    samples: Vec<Vec<i16>>,
    answers: Vec<Answer>,
}

#[derive(Deserialize)]
struct Answer {
    class: u8,
    probabilities: Vec<f64>,
    known: Option<bool>,
}

#[test]
fn confidence_and_known_are_those_of_the_reference() {
    let Cases::<Case> { cases } = read(&directory().join("known.json"));
    assert_eq!(cases.len(), 9);
    let (mut between, mut told) = (0, [0; 2]);
    for (number, case) in cases.iter().enumerate() {
        let model = Model::from_words(&case.words).unwrap();
        assert!(model.is_calibrated() && model.tells_unknown() == (case.dimensions > 0));
        for (sample, expected) in case.samples.iter().zip(&case.answers) {
            let mut numbers = [0; INPUTS];
            numbers[..sample.len()].copy_from_slice(sample);
            let found = model.classification(&numbers);
            assert_eq!((found.class, found.known), (expected.class, expected.known), "case {number}");
            let probabilities = model.probabilities(&numbers).unwrap();
            assert_eq!(found.confidence, Some(probabilities[usize::from(found.class)]));
            for (&found, expected) in probabilities.iter().zip(&expected.probabilities) {
                let expected = (expected * f64::from(CONFIDENCE_ONE)).min(f64::from(CONFIDENCE_ONE - 1));
                assert!((f64::from(found) - expected).abs() <= 1.0, "case {number}: {found}, expected {expected}");
                between += u32::from(found > 300 && found < CONFIDENCE_ONE - 300);
            }
            if let Some(known) = found.known {
                told[usize::from(known)] += 1;
            }
        }
    }
    assert!(between > 20 && told.iter().all(|&count| count > 5), "{between} {told:?}");
}
