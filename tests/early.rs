//! Beginnings of samples: the same numbers as the whole sample has, once, as soon as they are there.

use std::collections::HashMap;

use wstac_core::early::EarlySampler;
use wstac_core::features::Features;
use wstac_core::trigger::{Rule, Trigger, TriggerConfig};
use wstac_tests::random::Random;

/// A dark stream that lights up now and then.
fn stream(frames: usize, random: &mut Random) -> Vec<Features> {
    let mut bright = 0;
    (0..frames)
        .map(|_| {
            bright = if random.below(60) == 0 { random.below(80) } else { u64::saturating_sub(bright, 1) };
            let level = if bright > 0 { -2_000 } else { -9_000 };
            [0; 10].map(|_| (level + random.below(50) as i64) as i16)
        })
        .collect()
}

#[test]
fn beginnings_are_those_of_the_events_and_come_once_and_in_time() {
    let mut random = Random::new(3);
    let (mut compared, mut interrupted) = (0, 0);
    for _ in 0..300 {
        let window = 1 + random.below(12) as u32;
        let backtrack = random.below(u64::from(5 * window).min(40)) as u32;
        let config = TriggerConfig::new(window, 1.2, backtrack, Rule::Signed, 0.2).unwrap();
        let wanted = 1 + random.below(75) as u8;
        let is_lossy = random.below(2) == 1;
        let (mut trigger, mut early) = (Trigger::new(config), EarlySampler::new(wanted));
        let mut beginnings = HashMap::new();
        for (now, features) in stream(900, &mut random).into_iter().enumerate() {
            if is_lossy && random.below(30) == 0 {
                trigger.push_lost(1 + random.below(12));
            }
            if let Some(event) = trigger.push(features, false) {
                let whole = event.sample.flat();
                let numbers = 10 * usize::from(wanted);
                match beginnings.remove(&event.frame) {
                    Some(beginning) => {
                        let beginning: [i16; 700] = beginning;
                        assert_eq!(beginning[..numbers], whole[..numbers]);
                        assert!(beginning[numbers..].iter().all(|&number| number == 0));
                        compared += 1;
                    }
                    // A beginning is missing where there is none, or where the rest came at once.
                    None => assert!(is_lossy || wanted >= 70 || window + backtrack >= 70),
                }
            }
            if let Some(beginning) = early.take(&trigger) {
                let arrived = u64::from(wanted).max(u64::from(window + backtrack));
                if !is_lossy {
                    assert_eq!(beginning.frame + arrived - 1, now as u64);
                }
                assert!(beginnings.insert(beginning.frame, beginning.flat()).is_none());
                assert!(early.take(&trigger).is_none());
            }
            if trigger.take_interrupted().is_some() {
                interrupted += 1;
            }
        }
    }
    assert!(compared > 1_000 && interrupted > 10, "{compared} {interrupted}");
}

#[test]
fn an_events_sample_stays_among_the_last_frames_for_a_while() {
    let mut random = Random::new(4);
    let mut compared = 0;
    for _ in 0..100 {
        let mut trigger = Trigger::new(TriggerConfig::default());
        // The last event's first frame and sample.
        let mut last: Option<(u64, Vec<Features>)> = None;
        for features in stream(900, &mut random) {
            if random.below(30) == 0 {
                trigger.push_lost(1 + random.below(12));
            }
            if let Some(event) = trigger.push(features, false) {
                last = Some((event.frame, event.sample.frames().copied().collect()));
            }
            let Some((first, sample)) = &last else { continue };
            let (end, recent) = trigger.recent();
            let recent: Vec<_> = recent.frames().copied().collect();
            // So many frames have come since the sample's last one.
            let since = (end - first - 70) as usize;
            if since < 70 {
                assert_eq!(recent[..70 - since], sample[since..], "{since} frames after the event");
                compared += 1;
            }
        }
    }
    assert!(compared > 10_000, "{compared} comparisons show less than they should");
}
