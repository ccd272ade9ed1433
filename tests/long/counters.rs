//! Tests frame counters with features that are really pushed, and with losses, for a very long time. Only the trigger
//! counts that far: the code before it counts at most the camera frames of one feature frame.

use wstac_core::paper::trigger::{InterruptedSample, Trigger, TriggerConfig};
use wstac_tests::extreme::{BRIGHT, DARK};

use wstac_tests::how_many;

/// The stream repeats itself after this many frames. It is a multiple of the 5 frames of a window, so events stay at
/// the same frame of every period.
const PERIOD: u64 = 1000;
/// The frames of every period that are lit.
const LIT: [core::ops::Range<u64>; 2] = [200..230, 500..530];
/// The frames of every period that are lost: 7 within the first sample, 10 within the second, and 10 in the dark.
const LOST: [core::ops::Range<u64>; 3] = [240..247, 540..550, 800..810];
/// The first frame of the first slide's sample, c = 10 frames before its window.
const EVENT: u64 = 190;
/// The sample of the second slide, which the loss interrupts.
const INTERRUPTED: InterruptedSample = InterruptedSample::new(490, 50);

/// Checks that every event and every interrupted sample is at its expected frame. None may be missing, and there may be
/// no other.
#[test]
fn no_counter_ends_and_no_event_moves() {
    // `ci/long` pushes 2^33 = 8,589,934,592 frames.
    let wanted = how_many("WSTAC_LONG_FRAMES", 1 << 20);
    let mut trigger = Trigger::new(TriggerConfig::default());
    let (mut pushed, mut lost, mut events, mut interrupted) = (0, 0, 0, 0);
    let mut start = 0;
    while pushed < wanted {
        let mut at = 0;
        while at < PERIOD {
            if let Some(gap) = LOST.iter().find(|gap| gap.contains(&at)) {
                // Periods alternate: the loss is reported at once, or one frame at a time.
                let frames = if (start / PERIOD).is_multiple_of(2) { gap.end - at } else { 1 };
                trigger.push_lost(frames);
                (at, lost) = (at + frames, lost + frames);
                continue;
            }
            let level = if LIT.iter().any(|lit| lit.contains(&at)) { BRIGHT } else { DARK };
            let event = trigger.push([level; 10], false);
            (at, pushed) = (at + 1, pushed + 1);
            if let Some(event) = event {
                assert_eq!((event.frame, at), (start + EVENT, EVENT + 70), "after {pushed} frames");
                assert_eq!((event.frames_filled, event.reliable), (7, true), "event at {}", event.frame);
                events += 1;
            }
            if let Some(sample) = trigger.take_interrupted() {
                let expected = InterruptedSample::new(start + INTERRUPTED.frame, INTERRUPTED.frames);
                assert_eq!((sample, at), (expected, LOST[1].end + 1), "after {pushed} frames");
                interrupted += 1;
            }
        }
        start += PERIOD;
        assert_eq!(trigger.end().frames, start);
        assert_eq!((events, interrupted), (start / PERIOD, start / PERIOD));
    }
    println!(
        "{pushed} frames pushed and {lost} lost: the next is number {start}, 2^{:.2}; {events} events and {interrupted} interrupted \
         samples, all where they should be",
        (start as f64).log2()
    );
    assert_eq!(start, pushed + lost);
}
