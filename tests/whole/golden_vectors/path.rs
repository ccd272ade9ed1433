//! Tests the samples along the path of the reference's touches: of ten sums and of 25 taxels.

use serde::Deserialize;
use wstac_core::features::Features;
use wstac_core::model::file::Input;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::trigger::Event;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::touch::motion::Velocity;
use wstac_core::touch::path_sample::{self, PathSample};
use wstac_core::touch::taxel_ring::TaxelRing;

use super::case::{Cases, directory, read};
use super::shutter::{config_of, rolling};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathCase {
    name: String,
    mm_s: f32,
    deg: f32,
    /// The number of the rolling shutter; `None` for a global one.
    shutter: Option<usize>,
    full_scale: u32,
    totals: [i32; FEATURES],
    frames: u16,
    sums: Vec<[u32; TAXELS]>,
    features: Vec<Features>,
    path: Vec<i16>,
    taxel_path: Vec<i16>,
    /// Numbers of lost frames, and the first step of which too much was lost.
    lost: Vec<usize>,
    whole_steps: Option<usize>,
    /// The relative deviation of the speed, and the period of the texture with its deviation, in mm.
    relative_sd: f32,
    period: Option<[f32; 2]>,
}

/// Largest difference in units of 2^-11 where light is above a tenth of the mean, and where it is below.
const CLOSE: [u16; 2] = [12, 60];

/// Returns the largest differences where light is above a tenth of the mean, and where it is below.
fn worst(name: &str, found: &PathSample, expected: &[i16], input: Input) -> [u16; 2] {
    let (_, step) = input.steps().unwrap();
    let (facts, numbers) = found.numbers().split_at(4);
    let mut worst = [0; 2];
    for (number, (a, b)) in facts.iter().zip(expected).enumerate() {
        assert!(a.abs_diff(*b) <= 2, "{name}: fact {number} is {a}, expected {b}");
    }
    for (number, (found, expected)) in numbers.chunks(step).zip(expected[4..].chunks(step)).enumerate() {
        for (k, (a, b)) in found.iter().zip(expected).enumerate() {
            // Products have the size of the number that they are products of.
            let of = expected[k % (step / if input == Input::Path { 3 } else { 2 })];
            let dark = usize::from(of < -4700);
            let off = a.abs_diff(*b);
            worst[dark] = worst[dark].max(off);
            assert!(off <= CLOSE[dark], "{name}: step {number}, number {k} is {a}, expected {b}");
        }
    }
    worst
}

#[test]
fn every_path_is_that_of_the_reference() {
    let Cases::<PathCase> { cases } = read(&directory().join("path.json"));
    assert!(cases.len() >= 25, "{} cases", cases.len());
    let rolling = rolling();
    let (mut most, mut told) = ([[0; 2]; 2], 0);
    for case in &cases {
        let (name, config) = (&case.name, config_of(case.shutter, &rolling));
        let mut velocity = Velocity::default();
        (velocity.mm_s, velocity.degrees) = (case.mm_s, case.deg);
        velocity.mm_s_sd = case.relative_sd * case.mm_s;
        let frames: &[Features; SAMPLE_FRAMES] = case.features.as_slice().try_into().unwrap();
        let baseline = Baseline::new(case.totals, case.frames);
        let event = Event::new(0, Sample::from_frames(frames), &baseline);
        let mut ring = TaxelRing::new(case.full_scale);
        for (number, sums) in case.sums.iter().enumerate() {
            if case.lost.contains(&number) { ring.fill(1) } else { ring.push(sums) }
        }
        let period = path_sample::period(&event.with_taxels(&ring), &velocity, config);
        let (found, expected) = (period.map_or([0.0; 2], |one| [one.value, one.sd]), case.period.unwrap_or_default());
        told += usize::from(period.is_some());
        for (found, expected, close) in [(found[0], expected[0], 0.002), (found[1], expected[1], 0.02)] {
            assert!((found - expected).abs() <= close * expected, "{name}: period {found}, expected {expected}");
        }
        let sums = PathSample::of_sums(&event, &velocity, config, 70).unwrap();
        let taxels = PathSample::of_taxels(&ring, &velocity, config, 70).unwrap();
        if let Some(steps) = case.whole_steps {
            let covered = (1..=70).filter(|frames| taxels.covers(*frames)).count();
            assert_eq!(covered, (4 + 8 * steps) / 10, "{name}");
        }
        let found =
            [worst(name, &sums, &case.path, Input::Path), worst(name, &taxels, &case.taxel_path, Input::TaxelPath)];
        for (most, found) in most.as_flattened_mut().iter_mut().zip(found.as_flattened()) {
            *most = (*most).max(*found);
        }
    }
    assert!(told >= 6, "{told} periods");
    println!("{} paths, off by at most {most:?} units of 2^-11", cases.len());
}
