//! Tests the motion of the reference's samples: kinds of touch, speeds, directions and standard deviations.

use serde::Deserialize;
use wstac_core::baseline::Baseline;
use wstac_core::features::Features;
use wstac_core::motion::{self, Contact, Motion, MotionConfig};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::rate::FrameRate;
use wstac_core::sample::Sample;
use wstac_core::trigger::Event;

use super::case::{directory, read};

#[derive(Deserialize)]
struct Cases {
    cases: Vec<MotionCase>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotionCase {
    name: String,
    totals: [i32; FEATURES],
    frames: u16,
    features: Vec<Features>,
    motion: Expected,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    contact: String,
    mm_s: Option<f64>,
    mm_s_sd: Option<f64>,
    deg: Option<f64>,
    deg_sd: Option<f64>,
    coherence: f64,
    reliable: bool,
}

/// Returns every bit of a motion, as a board writes them (`golden.rs` of wstac-fw).
fn bits(motion: &Motion) -> String {
    let kind = match motion.contact {
        Contact::Slide => 0_u16,
        Contact::Press => 1,
        Contact::Poke => 2,
        _ => 3,
    };
    let velocity = motion.velocity.map(|found| [found.mm_s, found.mm_s_sd, found.degrees, found.degrees_sd]);
    let numbers = velocity.unwrap_or_default().into_iter().chain([motion.coherence]);
    let halves = [kind, motion.reliable.into()].map(u16::to_le_bytes);
    let bytes = halves.into_iter().flatten().chain(numbers.flat_map(f32::to_le_bytes));
    let words: Vec<String> = bytes.map(|byte| format!("{byte:02x}")).collect();
    words.concat()
}

/// Checks that every bit of every motion is as recorded. Boards are compared with the same record (`ci/firmware`), so
/// every processor computes the same. A change of the record is a change of answers.
#[test]
fn every_processor_computes_the_same_bits() {
    let Cases { cases } = read(&directory().join("motion.json"));
    let config = MotionConfig::published(FrameRate::NOMINAL);
    let mut found = String::new();
    for case in &cases {
        let baseline = Baseline::new(case.totals, case.frames);
        let frames: &[Features; SAMPLE_FRAMES] = case.features.as_slice().try_into().unwrap();
        let event = Event::new(0, Sample::from_frames(frames), &baseline);
        let motions = [motion::by_coherence(&event, config), motion::by_edges(&event, config)];
        found += &[&case.name[..], &motions.map(|motion| bits(&motion)).join(" ")].join(" ");
        found += "\n";
    }
    let recorded = std::fs::read_to_string(directory().with_file_name("firmware").join("motions.txt")).unwrap();
    assert!(found == recorded, "expected the bits of tests/firmware/motions.txt, found:\n{found}");
}

/// Checks every case. Shapes have 13 bits in the core and 53 in the reference, which moves a slowness by less than a
/// thousandth of itself, or of a fifth of a frame.
#[test]
fn every_motion_is_that_of_the_reference() {
    let Cases { cases } = read(&directory().join("motion.json"));
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let config = MotionConfig::published(FrameRate::NOMINAL);
    let mut worst = 0.0_f64;
    for case in &cases {
        let name = &case.name;
        let frames: &[Features; SAMPLE_FRAMES] = case.features.as_slice().try_into().unwrap();
        let baseline = Baseline::new(case.totals, case.frames);
        let event = Event::new(0, Sample::from_frames(frames), &baseline);
        let found = motion::by_coherence(&event, config);
        let expected = &case.motion;
        assert_eq!(found.contact.as_str(), expected.contact, "{name}: {found:?}");
        assert!((f64::from(found.coherence) - expected.coherence).abs() < 2e-3, "{name}: {found:?}");
        assert_eq!(found.reliable, expected.reliable, "{name}: {found:?}");
        let Some(velocity) = found.velocity else {
            assert_eq!(expected.mm_s, None, "{name}");
            continue;
        };
        let mm_s = expected.mm_s.unwrap();
        let off = (f64::from(velocity.mm_s) / mm_s - 1.0).abs();
        let turned = (f64::from(velocity.degrees) - expected.deg.unwrap() + 180.0).rem_euclid(360.0) - 180.0;
        worst = worst.max(off);
        assert!(off < 1e-3 * (mm_s / 600.0).max(1.0), "{name}: {velocity:?}, expected {mm_s}");
        assert!(turned.abs() < 0.06, "{name}: {velocity:?}, expected {:?}", expected.deg);
        // Deviations are of what a fit leaves over: rounding counts where that is next to nothing.
        let close = |found: f32, expected: f64, unit: f64| (f64::from(found) - expected).abs() < 0.02 * expected + unit;
        assert!(close(velocity.mm_s_sd, expected.mm_s_sd.unwrap(), 5e-4 * mm_s), "{name}: {velocity:?}");
        assert!(close(velocity.degrees_sd, expected.deg_sd.unwrap(), 0.03), "{name}: {velocity:?}");
    }
    println!("{} motions, speeds off by at most {:.4} %", cases.len(), 100.0 * worst);
}
