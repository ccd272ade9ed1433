//! Tests the motion of the reference's samples: kinds of touch, speeds, directions and standard deviations.

use serde::Deserialize;
use wstac_core::features::Features;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::trigger::Event;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::{self, Contact, Motion, MotionConfig, Readout};

use super::case::{Cases, directory, read};
use super::motion_of::{MotionOf, Tolerance};
use super::shutter;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotionCase {
    name: String,
    totals: [i32; FEATURES],
    frames: u16,
    features: Vec<Features>,
    motion: MotionOf,
}

/// Shapes have 13 bits in the core and 53 in the reference, which moves a slowness by less than a thousandth of itself,
/// or of a fifth of a frame. Deviations are of what a fit leaves over: rounding counts where that is next to nothing.
const MOST: Tolerance =
    Tolerance { speed: 1e-3, grows: true, degrees: 0.06, deviation: 0.02, of_speed: 5e-4, of_degrees: 0.03 };

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
    let Cases::<MotionCase> { cases } = read(&directory().join("motion.json"));
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
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

/// Checks every case.
#[test]
fn every_motion_is_that_of_the_reference() {
    let Cases::<MotionCase> { cases } = read(&directory().join("motion.json"));
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let mut worst = 0.0_f64;
    for case in &cases {
        let name = &case.name;
        let frames: &[Features; SAMPLE_FRAMES] = case.features.as_slice().try_into().unwrap();
        let baseline = Baseline::new(case.totals, case.frames);
        let event = Event::new(0, Sample::from_frames(frames), &baseline);
        let found = motion::by_coherence(&event, config);
        let expected = &case.motion;
        let coherence = expected.coherence.unwrap();
        assert!((f64::from(found.coherence) - coherence).abs() < 2e-3, "{name}: {found:?}");
        assert_eq!(Some(found.reliable), expected.reliable, "{name}: {found:?}");
        worst = worst.max(expected.check(name, found.contact, found.velocity, &MOST).unwrap_or(0.0));
    }
    println!("{} motions, speeds off by at most {:.4} %", cases.len(), 100.0 * worst);
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReadoutCase {
    name: String,
    totals: [i32; FEATURES],
    frames: u16,
    features: Vec<Features>,
    /// One for each shutter.
    answers: Vec<MotionOf>,
}

/// Checks touches before rolling shutters, with known readouts and unknown ones, along either axis.
#[test]
fn every_motion_before_a_rolling_shutter_is_that_of_the_reference() {
    let Cases::<ReadoutCase> { cases } = read(&directory().join("readout.json"));
    let rolling = shutter::rolling();
    assert!(cases.len() >= 10 && rolling.len() >= 10, "{} cases, {} shutters", cases.len(), rolling.len());
    for case in &cases {
        let frames: &[Features; SAMPLE_FRAMES] = case.features.as_slice().try_into().unwrap();
        let baseline = Baseline::new(case.totals, case.frames);
        let event = Event::new(0, Sample::from_frames(frames), &baseline);
        assert_eq!(case.answers.len(), rolling.len(), "{}", case.name);
        for (expected, config) in case.answers.iter().zip(&rolling) {
            let name = format!("{}, {:?}", case.name, config.readout());
            let found = motion::by_coherence(&event, *config);
            assert_eq!(Some(found.reliable), expected.reliable, "{name}: {found:?}");
            expected.check(&name, found.contact, found.velocity, &MOST);
        }
    }
}
