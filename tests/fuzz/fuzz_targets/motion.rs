//! Pushes any features through a trigger, and asks for the motion of every event by both estimators. Nothing may panic,
//! and answers must be within their documented ranges.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::{Trigger, TriggerConfig};
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::{self, Contact, Motion, MotionConfig, Readout, ReadoutTime, RowOrder};

/// Frames of the baseline, which nothing touches.
const BASELINE: usize = 25;

fuzz_target!(|data: &[u8]| {
    let Some((&[rate, pitch, rest, readout], data)) = data.split_first_chunk() else { return };
    let rate = FrameRate::new(u32::from(rate) + 1, 1 + u32::from(rest & 1)).expect("a rate above 0");
    let config = MotionConfig::new(0.01 + f32::from(pitch), rate).expect("a pitch from 0.01 to 256 mm");
    let layout = Layout::paper(FrameSize::new(400, 400).expect("a size")).expect("it fits");
    // Unknown, or up to a second either way.
    let time = (rest & 2 > 0).then(|| 8.0 * (f32::from(readout) - 125.0)).and_then(ReadoutTime::from_ms);
    let config = config.with_readout(Readout::of_layout(time, RowOrder::Right, &layout, rate));
    let mut trigger = Trigger::new(TriggerConfig::default());
    for _ in 0..BASELINE {
        trigger.push([-3000; 10], false);
    }
    for frame in data.as_chunks::<20>().0 {
        let features = std::array::from_fn(|k| i16::from_le_bytes([frame[2 * k], frame[2 * k + 1]]));
        if let Some(event) = trigger.push(features, false) {
            for found in [motion::by_coherence(&event, config), motion::by_edges(&event, config)] {
                check(&found);
            }
        }
    }
});

fn check(found: &Motion) {
    assert!((0.0..=1.0).contains(&found.coherence), "{found:?}");
    assert_eq!(found.velocity.is_some(), found.contact == Contact::Slide, "{found:?}");
    assert!(!found.reliable || found.velocity.is_some(), "{found:?}");
    if let Some(velocity) = found.velocity {
        assert!(velocity.mm_s > 0.0 && velocity.mm_s.is_finite() && velocity.mm_s_sd >= 0.0, "{found:?}");
        assert!((0.0..360.0).contains(&velocity.degrees) && velocity.degrees_sd >= 0.0, "{found:?}");
    }
}
