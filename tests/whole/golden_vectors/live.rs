//! Tests live motion on the reference's frames: the kind of the touch, speed and direction in every frame.

use serde::Deserialize;
use wstac_core::features::Features;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::sample::Sample;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::touch::motion::LiveMotion;

use super::case::{Cases, directory, read};
use super::motion_of::{MotionOf, Tolerance};
use super::shutter::{config_of, rolling};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LiveCase {
    name: String,
    /// Every feature before the case's frames.
    dark: i16,
    /// Frames of the baseline.
    frames: u16,
    /// The number of the rolling shutter; `None` for a global one.
    shutter: Option<usize>,
    features: Vec<Features>,
    said: Vec<Option<MotionOf>>,
}

/// Light has 16 bits in the core and 53 in the reference, which moves a speed by less than a hundredth.
pub(super) const MOST: Tolerance =
    Tolerance { speed: 0.01, grows: false, degrees: 0.5, deviation: 0.1, of_speed: 2e-3, of_degrees: 0.1 };

/// Checks every frame of every case.
#[test]
fn every_live_answer_is_that_of_the_reference() {
    let Cases::<LiveCase> { cases } = read(&directory().join("live.json"));
    let rolling = rolling();
    assert!(cases.len() >= 25, "{} cases", cases.len());
    let (mut worst, mut velocities) = (0.0_f64, 0);
    for case in &cases {
        let baseline = Baseline::new([i32::from(case.frames) * i32::from(case.dark); FEATURES], case.frames);
        let mut live = LiveMotion::new(config_of(case.shutter, &rolling));
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
            if let Some(off) = expected.check(&at, found.contact, found.velocity, &MOST) {
                velocities += 1;
                worst = worst.max(off);
            }
        }
    }
    assert!(velocities > 500, "{velocities} velocities");
    println!("{velocities} velocities, speeds off by at most {:.3} %", 100.0 * worst);
}
