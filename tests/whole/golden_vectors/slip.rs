//! Tests the slips of the reference's streams: when each comes, and when something is held.

use serde::Deserialize;
use wstac_core::rate::FrameRate;
use wstac_core::touch::slip::SlipDetector;

use super::case::{Cases, Frames, directory, each, read};

/// Level of a dark frame.
const DARK: u16 = 300;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SlipCase {
    name: String,
    fps: FrameRate,
    frames: Vec<Frames<u16>>,
    /// The frames of the alarm, of the onset and of the hold's begin, and the strength.
    slips: Vec<(u64, u64, u64, f32)>,
    /// The frames from which something is held since another frame, or nothing is.
    holds: Vec<(u64, Option<u64>)>,
}

#[test]
fn every_slip_is_that_of_the_reference() {
    let Cases::<SlipCase> { cases } = read(&directory().join("slip.json"));
    let (mut count, mut ends) = (0, 0);
    for case in &cases {
        let name = &case.name;
        let (mut detector, mut slips, mut holds) = (SlipDetector::new(case.fps), vec![], vec![(0, None)]);
        for (number, taxels) in (0..).zip(each(&case.frames, DARK)) {
            let Some(taxels) = taxels else { continue };
            slips.extend(detector.push_taxels(number, &taxels));
            let held = detector.held_since_frame();
            if held != holds.last().and_then(|(_, held)| *held) {
                holds.push((number, held));
            }
        }
        assert_eq!(holds, case.holds, "{name}: holds");
        assert_eq!(slips.len(), case.slips.len(), "{name}: {slips:?}");
        for (slip, expected) in slips.iter().zip(&case.slips) {
            let (frame, onset, held, strength) = *expected;
            assert_eq!((slip.frame, slip.onset_frame, slip.held_since_frame), (frame, onset, held), "{name}");
            assert!((slip.strength / strength - 1.0).abs() < 1e-5, "{name}: {slip:?}, expected {expected:?}");
        }
        count += slips.len();
        ends += holds.iter().skip(1).filter(|(_, held)| held.is_none()).count();
    }
    assert!(count >= 20 && ends >= 12, "{count} slips, {ends} ends of holds");
}
