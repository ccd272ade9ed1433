//! Tests the first frames of samples: they are equal to those of the whole sample, and come once, as soon as they have
//! arrived.

use wstac_core::features::Features;
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::{Rule, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_tests::OwnedEvent;
use wstac_tests::random::Random;

/// Returns the sums of a dark stream that sometimes lights up.
fn stream(frames: usize, random: &mut Random) -> Vec<[u32; 25]> {
    let mut bright = 0;
    (0..frames)
        .map(|_| {
            bright = if random.below(60) == 0 { random.below(80) } else { u64::saturating_sub(bright, 1) };
            [0; 25].map(|_| if bright > 0 { 150 } else { 3 } + random.below(9) as u32)
        })
        .collect()
}

/// Returns a pipeline for sums of one pixel per taxel.
fn pipeline(config: TriggerConfig) -> Pipeline {
    let layout = Layout::paper(FrameSize::new(10, 10).unwrap()).unwrap();
    Pipeline::builder(FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap()).trigger(config).build().unwrap()
}

#[test]
fn prefixes_are_those_of_the_events_and_come_once_and_in_time() {
    let mut random = Random::new(5);
    let (mut compared, mut at_once, mut interrupted) = (0, 0, 0);
    for _ in 0..70 {
        let window = 1 + random.below(12) as u32;
        let backtrack = random.below(u64::from(5 * window).min(40)) as u32;
        let config = TriggerConfig::new(window, 1.2, backtrack, Rule::Signed, 0.2).unwrap();
        let lengths: [u8; 5] = std::array::from_fn(|_| random.below(75) as u8);
        let is_lossy = random.below(2) == 1;
        let mut pipeline = pipeline(config);
        // The prefixes of the sample under way, by length.
        let mut given: [Option<(u64, [i16; 700])>; 5] = [None; 5];
        for taxels in stream(900, &mut random) {
            let lost = if is_lossy && random.below(30) == 0 { 1 + random.below(12) } else { 0 };
            assert!(pipeline.push_lost(lost).frame().is_none());
            let number = pipeline.next_frame();
            let update = pipeline.push_taxels(&taxels);
            let frame = update.frame().unwrap();
            assert_eq!((frame.number, frame.has_missing_frames), (number, false));
            let prefixes = lengths.map(|frames| update.prefix(frames).map(|prefix| (prefix.frame, prefix.flat())));
            let event = update.event().map(OwnedEvent::from);
            interrupted += usize::from(update.interrupted().is_some());
            let under_way = pipeline.end().incomplete.filter(|_| event.is_none());
            at_once += usize::from(prefixes.iter().flatten().count() > 1);
            for ((&wanted, prefix), given) in lengths.iter().zip(prefixes).zip(&mut given) {
                let frames = 10 * usize::from(wanted);
                if let (Some(event), Some((first, numbers))) = (&event, *given)
                    && first == event.frame
                {
                    assert_eq!(numbers[..frames], event.sample.as_flattened()[..frames]);
                    assert!(numbers[frames..].iter().all(|&number| number == 0));
                    compared += 1;
                }
                let is_new = |first| given.is_none_or(|(before, _)| before != first);
                let expected = under_way.filter(|so_far| so_far.frames >= wanted && is_new(so_far.frame));
                assert_eq!(prefix.map(|(first, _)| first), expected.map(|so_far| so_far.frame), "{wanted}");
                *given = prefix.or(*given);
            }
        }
    }
    assert!(compared > 300 && at_once > 10 && interrupted > 10, "{compared} {at_once} {interrupted}");
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
    for _ in 0..30 {
        let mut pipeline = pipeline(TriggerConfig::default());
        // The first frame and the sample of the last event.
        let mut last: Option<(u64, Vec<Features>)> = None;
        for taxels in stream(900, &mut random) {
            if random.below(30) == 0 {
                pipeline.push_lost(1 + random.below(12));
            }
            if let Some(event) = pipeline.push_taxels(&taxels).event() {
                last = Some((event.frame, event.sample.frames().copied().collect()));
            }
            let Some((first, sample)) = &last else { continue };
            let (end, recent) = pipeline.recent();
            let recent: Vec<_> = recent.frames().copied().collect();
            // This many frames have come since the last one of the sample.
            let since = (end - first - 70) as usize;
            if since < 70 {
                assert_eq!(recent[..70 - since], sample[since..], "{since} frames after the event");
                compared += 1;
            }
        }
    }
    assert!(compared > 3_000, "{compared} comparisons show less than they should");
}
