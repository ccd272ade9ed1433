//! Tests live motion on the reference's frames: the kind of the touch, speed and direction in every frame.

use serde::Deserialize;
use wstac_core::baseline::Baseline;
use wstac_core::features::Features;
use wstac_core::motion::{LiveMotion, MotionConfig};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::rate::FrameRate;
use wstac_core::sample::Sample;

use super::case::{directory, read};

#[derive(Deserialize)]
struct Cases {
    cases: Vec<LiveCase>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LiveCase {
    name: String,
    /// Every feature before the case's frames.
    dark: i16,
    /// Frames of the baseline.
    frames: u16,
    features: Vec<Features>,
    said: Vec<Option<Expected>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    contact: String,
    mm_s: Option<f64>,
    mm_s_sd: Option<f64>,
    deg: Option<f64>,
    deg_sd: Option<f64>,
}

/// Checks every frame of every case. Light has 16 bits in the core and 53 in the reference, which moves a speed by less
/// than a hundredth.
#[test]
fn every_live_answer_is_that_of_the_reference() {
    let Cases { cases } = read(&directory().join("live.json"));
    assert!(cases.len() >= 15, "{} cases", cases.len());
    let (mut worst, mut velocities) = (0.0_f64, 0);
    for case in &cases {
        let baseline = Baseline::new([i32::from(case.frames) * i32::from(case.dark); FEATURES], case.frames);
        let mut live = LiveMotion::new(MotionConfig::published(FrameRate::NOMINAL));
        let mut all = vec![[case.dark; FEATURES]; SAMPLE_FRAMES];
        assert_eq!(case.features.len(), case.said.len(), "{}", case.name);
        for (frame, (features, expected)) in case.features.iter().zip(&case.said).enumerate() {
            let at = format!("{}, frame {frame}", case.name);
            all.push(*features);
            let recent: &[Features; SAMPLE_FRAMES] = all.last_chunk().unwrap();
            let found = live.push(all.len() as u64, Sample::from_frames(recent), &baseline);
            let (Some(found), Some(expected)) = (found, expected) else {
                assert!(found.is_none() && expected.is_none(), "{at}: {found:?}");
                continue;
            };
            assert_eq!(found.contact.as_str(), expected.contact, "{at}: {found:?}");
            let (Some(velocity), Some(mm_s)) = (found.velocity, expected.mm_s) else {
                assert!(found.velocity.is_none() && expected.mm_s.is_none(), "{at}: {found:?}, {:?}", expected.mm_s);
                continue;
            };
            velocities += 1;
            let off = (f64::from(velocity.mm_s) / mm_s - 1.0).abs();
            let turned = (f64::from(velocity.degrees) - expected.deg.unwrap() + 180.0).rem_euclid(360.0) - 180.0;
            worst = worst.max(off);
            assert!(off < 0.01, "{at}: {velocity:?}, expected {mm_s}");
            assert!(turned.abs() < 0.5, "{at}: {velocity:?}, expected {:?}", expected.deg);
            let close =
                |found: f32, expected: f64, unit: f64| (f64::from(found) - expected).abs() < 0.1 * expected + unit;
            assert!(close(velocity.mm_s_sd, expected.mm_s_sd.unwrap(), 2e-3 * mm_s), "{at}: {velocity:?}");
            assert!(close(velocity.degrees_sd, expected.deg_sd.unwrap(), 0.1), "{at}: {velocity:?}");
        }
    }
    assert!(velocities > 300, "{velocities} velocities");
    println!("{velocities} velocities, speeds off by at most {:.3} %", 100.0 * worst);
}
