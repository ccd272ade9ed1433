//! Frame counters driven by features that are really pushed, with losses, without end. Before the trigger nothing counts further
//! than one feature frame, so that it is the trigger alone that has to go so far.

use wstac_core::trigger::{InterruptedSample, Trigger, TriggerConfig};
use wstac_tests::extreme::{BRIGHT, DARK};

use wstac_tests::how_many;

/// Frames after which the stream repeats itself. Windows are 5 frames and a sample 70, so all windows start at multiples of 5, and
/// events stay at the same frame of every period for ever.
const PERIOD: u64 = 1000;
/// Frames that are lit, in every period.
const LIT: [core::ops::Range<u64>; 2] = [200..230, 500..530];
/// Frames that are lost, in every period: 7 within the first sample, 10 within the second, and 10 in the dark.
const LOST: [core::ops::Range<u64>; 3] = [240..247, 540..550, 800..810];
/// The sample of the first slide starts c = 10 frames before its window.
const EVENT: u64 = 190;
/// The sample of the second slide, and how much of it there is when the loss ends it.
const INTERRUPTED: InterruptedSample = InterruptedSample::new(490, 50);

/// Every event and every interrupted sample of so many pushed frames is at its frame, none is missing and there is no other.
#[test]
fn no_counter_ends_and_no_event_moves() {
    // 2^33 = 8589934592 in `ci/long`.
    let wanted = how_many("WSTAC_LONG_FRAMES", 1 << 20);
    let mut trigger = Trigger::new(TriggerConfig::default());
    let (mut pushed, mut lost, mut events, mut interrupted) = (0, 0, 0, 0);
    let mut start = 0;
    while pushed < wanted {
        let mut at = 0;
        while at < PERIOD {
            if let Some(gap) = LOST.iter().find(|gap| gap.contains(&at)) {
                // At once or one by one, in turns.
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
