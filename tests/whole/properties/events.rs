//! Properties from features to events.

use proptest::prelude::*;
use wstac_core::features::Features;
use wstac_core::paper::trigger::Trigger;
use wstac_tests::random::Random;
use wstac_tests::{OwnedEvent, plain_trigger};

use super::choice::{any_trigger_config, config, lively_trigger_config};

/// Returns a stream of features that is dark with noise, and sometimes bright. The dark level can be any level.
fn features(frames: usize, seed: u64) -> Vec<Features> {
    let mut random = Random::new(seed);
    let dark = -16_000 + random.below(17_000) as i64;
    let noise = 1 + random.below(60);
    let mut bright = 0;
    (0..frames)
        .map(|_| {
            if bright > 0 {
                bright -= 1;
            } else if random.below(90) == 0 {
                bright = random.below(80);
            }
            let level = if bright > 0 { dark + (3_290 - dark) / 2 } else { dark };
            [0; 10].map(|_| (level + random.below(noise) as i64) as i16)
        })
        .collect()
}

/// Pushes one frame and returns the event that it completed.
fn push(trigger: &mut Trigger, features: Features) -> Option<OwnedEvent> {
    trigger.push(features, false).map(OwnedEvent::from)
}

fn finish(trigger: &mut Trigger) -> Option<OwnedEvent> {
    trigger.finish().map(OwnedEvent::from)
}

/// Returns a stream of features that flickers: light and dark last for a few frames, or for long.
fn flickering(frames: usize, random: &mut Random) -> Vec<Features> {
    let mut stream = vec![[-8000; 10]; 100];
    while stream.len() < frames {
        let length = if random.below(3) == 0 { random.below(120) } else { random.below(12) };
        let level = [-8000, -8000, -7800, -7500, -2000][random.below(5) as usize];
        stream.extend(std::iter::repeat_n([level; 10], length as usize));
    }
    stream
}

proptest! {
    #![proptest_config(config(600))]

    #[test]
    fn events_are_those_of_the_plain_model(
        config in prop_oneof![any_trigger_config(), lively_trigger_config()],
        frames in 0_usize..900, losses in prop::collection::vec((0_usize..900, 1_u64..=7), 0..30), seed in any::<u64>(),
    ) {
        // Up to 7 frames in a row are lost, each time after a frame that arrived. The plain model gets them filled in
        // by hand.
        let arriving = features(frames, seed);
        let mut filled = Vec::new();
        let mut trigger = Trigger::new(config);
        let mut events = Vec::new();
        for (number, frame) in arriving.into_iter().enumerate() {
            filled.push((frame, false));
            events.extend(push(&mut trigger, frame));
            if let Some(&(_, lost)) = losses.iter().find(|loss| loss.0 == number) {
                filled.extend((0..lost).map(|_| (frame, true)));
                trigger.push_lost(lost);
            }
            prop_assert_eq!(trigger.next_frame(), filled.len() as u64);
        }
        events.extend(finish(&mut trigger));
        let (expected, open) = plain_trigger::events(&filled, &config);
        for (event, expected) in events.iter().zip(&expected) {
            prop_assert_eq!(event, expected);
        }
        prop_assert_eq!(events.len(), expected.len());
        let end = trigger.end();
        prop_assert_eq!(end.frames, filled.len() as u64);
        prop_assert_eq!(end.baseline_complete, filled.len() >= 5 * usize::from(config.window()));
        prop_assert_eq!(end.incomplete.map(|i| (i.frame, i.frames)), open);
    }

    #[test]
    fn samples_never_overlap_whatever_is_lost(
        config in prop_oneof![any_trigger_config(), lively_trigger_config()],
        losses in prop::collection::vec((0_usize..600, prop_oneof![1_u64..=20, 60_u64..200, any::<u64>()]), 0..30),
        start in prop_oneof![Just(0), any::<u32>().prop_map(u64::from)], seed in any::<u64>(),
    ) {
        let mut trigger = Trigger::starting_at(config, start);
        let mut frames_seen = start;
        let mut last: Option<u64> = None;
        let mut check = |event: Option<OwnedEvent>, now: u64| {
            // At the largest frame number, time stands still.
            if let Some(event) = event.filter(|_| now < u64::MAX) {
                assert_eq!(event.sample.len(), 70);
                assert!(event.frame >= start && event.frame.saturating_add(70) <= now, "{} at {now}", event.frame);
                assert!(last.is_none_or(|last| event.frame >= last.saturating_add(70)), "{last:?}, {}", event.frame);
                last = Some(event.frame);
            }
        };
        for (number, frame) in features(600, seed).into_iter().enumerate() {
            let event = push(&mut trigger, frame);
            frames_seen = frames_seen.saturating_add(1);
            check(event, frames_seen);
            if let Some(&(_, lost)) = losses.iter().find(|loss| loss.0 == number) {
                trigger.push_lost(lost);
                frames_seen = frames_seen.saturating_add(lost);
            }
            prop_assert_eq!(trigger.next_frame(), frames_seen);
            if let Some(interrupted) = trigger.take_interrupted() {
                prop_assert!((1..=69).contains(&interrupted.frames));
            }
        }
        let event = finish(&mut trigger);
        check(event, frames_seen);
        prop_assert_eq!(trigger.end().frames, frames_seen);
    }

    #[test]
    fn after_a_long_gap_frames_have_their_own_numbers(
        config in lively_trigger_config(), before in 0_usize..200, gap in 8_u64..5000, seed in any::<u64>(),
    ) {
        // After a long gap, the stream must behave like one after a quiet baseline of its own, moved in time. Windows
        // start anew, and the baseline stays.
        let m = usize::from(config.window());
        let quiet = vec![[-8000; 10]; 5 * m + before];
        let after = features(500, seed);
        let mut gapped = Trigger::new(config);
        for &frame in &quiet {
            gapped.push(frame, false);
        }
        gapped.push_lost(gap);
        let mut plain = Trigger::new(config);
        // The quiet stream has only whole windows, so that the next window starts with `after`. It has at least 70
        // frames to look back on.
        for _ in 0..5 * m + 70_usize.next_multiple_of(m) {
            plain.push([-8000; 10], false);
        }
        let shift = gapped.next_frame() as i64 - plain.next_frame() as i64;
        for frame in after {
            let (found, expected) = (push(&mut gapped, frame), push(&mut plain, frame));
            prop_assert_eq!(found.is_some(), expected.is_some());
            if let (Some(found), Some(expected)) = (found, expected) {
                prop_assert_eq!(found.frame as i64, expected.frame as i64 + shift);
                prop_assert_eq!(found.sample, expected.sample);
            }
        }
    }

    #[test]
    fn nothing_is_reported_about_frames_that_are_settled(
        config in lively_trigger_config(), per_touch in any::<bool>(),
        losses in prop::collection::vec((0_usize..900, prop_oneof![1_u64..=7, 8_u64..200]), 0..10), seed in any::<u64>(),
    ) {
        let config = if per_touch { config.one_event_per_touch() } else { config };
        let mut trigger = Trigger::new(config);
        let mut settled = trigger.settled_frame();
        for (number, frame) in flickering(900, &mut Random::new(seed)).into_iter().enumerate() {
            // Losses are known before the frame behind them.
            if let Some(&(_, lost)) = losses.iter().find(|loss| loss.0 == number) {
                trigger.push_lost(lost);
            }
            prop_assert_eq!(trigger.settled_frame(), settled);
            if let Some(event) = trigger.push(frame, false) {
                prop_assert!(event.frame >= settled, "sample {}, settled {settled}", event.frame);
                prop_assert!(event.touch_frame.is_none_or(|touch| touch >= settled), "{:?}, {settled}", event.touch_frame);
                prop_assert_eq!(event.touch_frame.is_some(), per_touch);
            }
            if let Some(end) = trigger.take_contact_end() {
                prop_assert!(end.frame >= settled, "end {}, settled {settled}", end.frame);
            }
            if let Some(interrupted) = trigger.take_interrupted() {
                prop_assert!(interrupted.frame >= settled, "interrupted {}, settled {settled}", interrupted.frame);
            }
            prop_assert!(trigger.settled_frame() >= settled, "{} after {settled}", trigger.settled_frame());
            settled = trigger.settled_frame();
        }
        // It follows the stream: in the dark, a window and the backtrack behind the newest frame.
        let quiet = usize::from(config.window()) + 10;
        for _ in 0..quiet + 140 {
            trigger.push([-8000; 10], false);
        }
        let behind = trigger.next_frame() - trigger.settled_frame();
        prop_assert!(behind <= u64::from(config.window()) + u64::from(config.backtrack()), "{behind} frames behind");
    }
}
