//! Tests the first frames of samples: they are equal to those of the whole sample, and come once, as soon as they have
//! arrived.

use std::collections::HashMap;

use wstac_core::early::EarlySampler;
use wstac_core::features::Features;
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::trigger::{Rule, Trigger, TriggerConfig};
use wstac_tests::OwnedEvent;
use wstac_tests::random::Random;

/// Returns a dark stream that sometimes lights up.
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
                    // A prefix is missing only if the sample has no such prefix, or if the rest came at once.
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

/// Returns a pipeline for sums of one pixel per taxel, and the sums of dark and bright frames.
fn pipeline(config: TriggerConfig) -> Pipeline {
    let layout = Layout::paper(FrameSize::new(10, 10).unwrap()).unwrap();
    Pipeline::builder(FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap()).trigger(config).build().unwrap()
}

#[test]
fn updates_give_the_prefixes_that_one_sampler_a_length_gives() {
    let mut random = Random::new(5);
    let (mut given, mut at_once, mut interrupted) = (0, 0, 0);
    for _ in 0..100 {
        let window = 1 + random.below(12) as u32;
        let backtrack = random.below(u64::from(5 * window).min(40)) as u32;
        let config = TriggerConfig::new(window, 1.2, backtrack, Rule::Signed, 0.2).unwrap();
        let lengths: [u8; 5] = std::array::from_fn(|_| random.below(75) as u8);
        let mut pipeline = pipeline(config);
        let (mut trigger, mut samplers) = (Trigger::new(config), lengths.map(EarlySampler::new));
        let mut bright = 0;
        for _ in 0..900 {
            let lost = if random.below(30) == 0 { 1 + random.below(12) } else { 0 };
            assert!(pipeline.push_lost(lost).frame().is_none());
            trigger.push_lost(lost);
            bright = if random.below(60) == 0 { random.below(80) } else { u64::saturating_sub(bright, 1) };
            let taxels = [0; 25].map(|_| if bright > 0 { 150 } else { 3 } + random.below(9) as u32);
            let number = pipeline.next_frame();
            let update = pipeline.push_taxels(&taxels);
            let frame = update.frame().unwrap();
            assert_eq!((frame.number, frame.has_missing_frames), (number, false));
            let event = trigger.push(frame.features, false).map(OwnedEvent::from);
            assert_eq!(update.interrupted(), trigger.take_interrupted());
            interrupted += usize::from(update.interrupted().is_some());
            assert_eq!(update.event().map(OwnedEvent::from), event);
            let mut now = 0;
            for (frames, sampler) in lengths.into_iter().zip(&mut samplers) {
                let expected = if event.is_none() { sampler.take(&trigger) } else { None };
                let found = update.prefix(frames).map(|prefix| (prefix.frame, prefix.flat()));
                assert_eq!(found, expected.map(|beginning| (beginning.frame, beginning.flat())), "{frames}");
                now += usize::from(found.is_some());
            }
            given += now;
            at_once += usize::from(now > 1);
        }
    }
    assert!(given > 1_000 && at_once > 10 && interrupted > 10, "{given} {at_once} {interrupted}");
}

#[test]
fn a_new_baseline_and_a_new_stream_begin_where_the_old_ones_end() {
    let mut random = Random::new(6);
    let config = TriggerConfig::default();
    for restart in [false, true] {
        let (mut running, mut events) = (pipeline(config), 0);
        for _ in 0..20 {
            let first = running.next_frame();
            let layout = Layout::paper(FrameSize::new(10, 10).unwrap()).unwrap();
            let camera = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
            let mut fresh = Pipeline::builder(camera).trigger(config).starting_at(first).build().unwrap();
            let light = 100 + random.below(60);
            for frame in 0..80 + random.below(70) {
                let taxels = [0; 25].map(|_| if frame > 40 { light as u32 } else { 3 } + random.below(2) as u32);
                let (found, expected) = (running.push_taxels(&taxels), fresh.push_taxels(&taxels));
                assert_eq!(found.frame(), expected.frame());
                assert_eq!(found.event().map(OwnedEvent::from), expected.event().map(OwnedEvent::from));
                events += usize::from(found.event().is_some());
            }
            let open = running.end().incomplete;
            assert_eq!(open, fresh.end().incomplete);
            assert_eq!(if restart { running.restart() } else { running.rezero() }, open);
            assert!(running.baseline().is_none() && running.end().frames == fresh.end().frames);
        }
        assert!(events > 5, "{events} events");
    }
}

#[test]
fn sums_of_the_last_frame_are_there_until_the_next_begins_or_is_lost() {
    let mut pipeline = pipeline(TriggerConfig::default());
    assert_eq!(pipeline.taxels(), None);
    pipeline.push_frame(&[7; 100]).unwrap();
    let sums = pipeline.taxels().unwrap();
    assert!(sums.iter().all(|&sum| sum == 7 * pipeline.geometry().pixels()));
    // An empty stripe starts no frame, and refused bytes change nothing.
    assert!(pipeline.push_stripe(&[]).unwrap().frame().is_none());
    assert!(pipeline.push_frame(&[9; 99]).is_err() && pipeline.push_stripe(&[9; 101]).is_err());
    assert_eq!(pipeline.taxels(), Some(sums));
    assert!(pipeline.push_stripe(&[8; 50]).unwrap().frame().is_none());
    assert_eq!(pipeline.taxels(), None);
    assert!(pipeline.push_frame(&[8; 100]).is_err());
    let whole = pipeline.push_stripe(&[8; 50]).unwrap().frame().unwrap();
    assert_eq!(pipeline.taxels(), Some(sums.map(|sum| sum / 7 * 8)));
    assert_eq!(pipeline.push_frame(&[8; 100]).unwrap().frame().unwrap().features, whole.features);
    for abandon in [false, true] {
        pipeline.push_frame(&[7; 100]).unwrap();
        assert_eq!(pipeline.taxels(), Some(sums));
        let update = if abandon { pipeline.abandon_frame() } else { pipeline.push_lost(1) };
        assert!(update.frame().is_none());
        assert_eq!(pipeline.taxels(), None);
    }
    pipeline.push_frame(&[7; 100]).unwrap();
    pipeline.push_taxels(&[3; 25]);
    assert_eq!(pipeline.taxels(), None);
}

#[test]
fn an_events_sample_stays_among_the_last_frames_for_a_while() {
    let mut random = Random::new(4);
    let mut compared = 0;
    for _ in 0..100 {
        let mut trigger = Trigger::new(TriggerConfig::default());
        // The first frame and the sample of the last event.
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
            // This many frames have come since the last one of the sample.
            let since = (end - first - 70) as usize;
            if since < 70 {
                assert_eq!(recent[..70 - since], sample[since..], "{since} frames after the event");
                compared += 1;
            }
        }
    }
    assert!(compared > 10_000, "{compared} comparisons show less than they should");
}
