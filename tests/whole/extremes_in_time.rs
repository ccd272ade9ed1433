//! Tests the ends of every range of the trigger and of time. Each test names an extreme and what is guaranteed there.

use wstac_core::error::ConfigError;
use wstac_core::green::gray::Gray;
use wstac_core::layout::Layout;
use wstac_core::ln::libm::Libm;
use wstac_core::paper::trigger::{InterruptedSample, Rule, Trigger, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::FrameGeometry;
use wstac_tests::OwnedEvent;
use wstac_tests::extreme::{BRIGHT, DARK, push, size, stacked};

fn trigger(window: u32, backtrack: u32, rule: Rule, multiplier: f64) -> Trigger {
    Trigger::new(TriggerConfig::new(window, multiplier, backtrack, rule, 0.2).unwrap())
}

// Trigger.

/// Window and backtrack at both ends: the first window starts at 5m, the sample at t − c, and the event comes with the
/// last frame of the sample.
#[test]
fn window_and_backtrack_at_both_ends() {
    for (m, c) in [(1, 0), (1, 5), (5, 25), (11, 55), (12, 58), (35, 35), (69, 1), (70, 0)] {
        let mut trigger = trigger(m, c, Rule::Signed, 1.2);
        let t = 5 * u64::from(m);
        let last = t + 70 - u64::from(c) - 1;
        for frame in 0..last + 200 {
            let level = if frame >= t { BRIGHT } else { DARK };
            let event = push(&mut trigger, level);
            assert_eq!(event.is_some(), frame >= last && (frame - last) % 70 == 0, "m {m}, c {c}, frame {frame}");
            if let Some(event) = event {
                assert_eq!(event.frame, t - u64::from(c) + (frame - last), "m {m}, c {c}");
                assert_eq!(event.sample.len(), 70);
                let dark = if frame == last { c } else { 0 };
                assert_eq!(event.sample.iter().filter(|f| f[0] == DARK).count() as u32, dark, "m {m}, c {c}");
            }
        }
    }
    let build = |m, c| TriggerConfig::new(m, 1.2, c, Rule::Signed, 0.2);
    for m in [0, 71, 256, 257, u32::MAX] {
        assert_eq!(build(m, 0), Err(ConfigError::Window(m)));
    }
    for (m, most) in [(1, 5), (11, 55), (12, 58), (69, 1), (70, 0)] {
        assert!(build(m, most).is_ok());
        for found in [most + 1, most + 256, u32::MAX] {
            assert_eq!(build(m, found), Err(ConfigError::Backtrack { found, most }));
        }
    }
}

/// The multiplier's ends: 0 (literal) fires on any positive sum and on no other; 1 (signed) leaves only the margin; the
/// largest never fires if there is a baseline.
#[test]
fn multiplier_at_both_ends() {
    let fires = |rule, b, base: i16, level: i16| {
        let mut trigger = trigger(5, 0, rule, b);
        (0..25).for_each(|_| assert!(push(&mut trigger, base).is_none()));
        (0..70).any(|_| push(&mut trigger, level).is_some())
    };
    assert!(!fires(Rule::Literal, 0.0, DARK, 0) && fires(Rule::Literal, 0.0, DARK, 1));
    assert!(!fires(Rule::Signed, 1.0, DARK, DARK + 409) && fires(Rule::Signed, 1.0, DARK, DARK + 410));
    let largest = 65_535.999;
    assert!(!fires(Rule::Signed, largest, DARK, i16::MAX) && !fires(Rule::Signed, largest, 1, i16::MAX));
    assert!(!fires(Rule::Literal, largest, 1, i16::MAX) && fires(Rule::Literal, largest, -1, -32_000));
    for b in [65_536.0, f64::MAX, -1e-9, -1.0] {
        assert_eq!(TriggerConfig::new(5, b, 0, Rule::Literal, 0.2), Err(ConfigError::Multiplier(b)));
    }
    assert_eq!(TriggerConfig::new(5, 0.99, 0, Rule::Signed, 0.2), Err(ConfigError::Multiplier(0.99)));
    for margin in [65_536.0, f64::MAX, -1e-9, -1.0] {
        assert_eq!(TriggerConfig::new(5, 1.2, 0, Rule::Signed, margin), Err(ConfigError::Margin(margin)));
    }
}

/// η zero, tiny, hugely negative and positive, in both rules: the thresholds are those computed by hand, the window sum
/// at the threshold does not fire, and the next one does.
#[test]
fn eta_at_its_extremes_in_both_rules() {
    // b = 1.25 and 0.75, margin 0.2 (13107 / 65536), m = 5: margin alone is 5 · 2048 · 13107/65536 = 2047.96875.
    // Totals over 25 frames; η = total / 5.
    for (rule, b, total, threshold) in [
        (Rule::Literal, 1.25, 0, 0),
        (Rule::Literal, 1.25, 1, 0),   // 0.25
        (Rule::Literal, 1.25, -1, -1), // −0.25
        (Rule::Literal, 0.75, -25 * 32_768, -122_880),
        (Rule::Literal, 1.25, -25 * 32_768, -204_800), // below every window sum: always fires
        (Rule::Literal, 1.25, 25 * 3296, 20_600),
        (Rule::Signed, 1.25, 0, 2047),
        (Rule::Signed, 1.25, 1, 2048),  // 2048.16875
        (Rule::Signed, 1.25, -1, 2047), // 2047.76875
        (Rule::Signed, 1.25, -25 * 32_768, -122_880),
        (Rule::Signed, 1.25, 25 * 3296, 20_600),
        (Rule::Signed, 1.25, 25 * 1638, 10_237), // 8190 + max(2047.5, 2047.96875)
        (Rule::Signed, 1.25, 25 * 1639, 10_243), // 8195 + max(2048.75, 2047.96875)
    ] {
        for extra in [0, 1] {
            let mut trigger = trigger(5, 0, rule, b);
            let (even, odd) = (total / 25, total % 25);
            for frame in 0..25 {
                push(&mut trigger, (even + if frame == 0 { odd } else { 0 }) as i16);
            }
            let case = format!("{rule:?} {b} total {total}");
            assert_eq!(trigger.baseline().unwrap().totals(), &[total; 10], "{case}");
            assert_eq!(trigger.thresholds().unwrap(), &[threshold; 10], "{case}");
            // A window of exactly the threshold, then of one more, if five features can add up to that.
            let sum = (threshold + extra).max(5 * i32::from(i16::MIN));
            let (each, rest) = (sum.div_euclid(5), sum.rem_euclid(5));
            for frame in 0..5 {
                trigger.push([(each + i32::from(frame < rest)) as i16; 10], false);
            }
            let fired = trigger.end().incomplete.is_some();
            assert_eq!(fired, sum > threshold, "{case}: window sum {sum}");
        }
    }
}

/// A stream around 2^32 and 2^33 frames: the same events at the same distances, none missed, none twice.
#[test]
fn streams_around_2_to_the_32_and_33() {
    let run = |start: u64| {
        let config = TriggerConfig::new(5, 1.2, 10, Rule::Signed, 0.2).unwrap();
        let mut trigger = Trigger::starting_at(config, start);
        let mut events = Vec::new();
        for frame in 0..1500_u64 {
            if frame % 211 == 60 {
                trigger.push_lost(3);
            }
            let level = if frame % 130 > 110 { BRIGHT } else { DARK };
            events.extend(push(&mut trigger, level).map(|event| event.frame - start));
        }
        trigger.push_lost(5);
        events.extend(trigger.finish().map(|event| event.frame - start));
        (events, trigger.end().frames - start, trigger.end().incomplete.map(|i| (i.frame - start, i.frames)))
    };
    let expected = run(0);
    assert!(expected.0.len() >= 10, "{expected:?}");
    for around in [1 << 31, 1 << 32, 1 << 33, 1 << 53, u64::MAX - 2000] {
        for before in [0, 1, 20, 34, 99, 105, 700, 1499] {
            assert_eq!(run(around - before), expected, "{around} − {before}");
        }
    }
}

/// Losses of up to 2^64 − 1 frames at every phase, twice: frame numbers stay at the largest number, open samples are
/// reported, and the trigger continues.
#[test]
fn losses_up_to_the_largest_number() {
    for at in 1..130 {
        for lost in [1 << 31, 1 << 32, u64::MAX - 200, u64::MAX - 1, u64::MAX] {
            let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
            for frame in 0..at {
                push(&mut trigger, if frame >= 30 { BRIGHT } else { DARK });
            }
            let open = trigger.end().incomplete;
            trigger.push_lost(lost);
            assert_eq!(trigger.next_frame(), lost.saturating_add(at));
            let event = push(&mut trigger, DARK);
            assert!(event.is_none());
            assert_eq!(trigger.take_interrupted(), open, "{lost} lost after {at} frames");
            assert_eq!(trigger.end().frames, lost.saturating_add(at).saturating_add(1));
            assert!(trigger.end().baseline_complete);
            assert_eq!(trigger.end().baseline_quiet, at >= 25, "{lost} lost after {at} frames");
            trigger.push_lost(u64::MAX);
            trigger.push_lost(u64::MAX);
            let events = (0..500).filter(|_| push(&mut trigger, i16::MAX).is_some()).count();
            assert_eq!(events, 7, "{lost} lost after {at} frames");
            assert_eq!(trigger.end().frames, u64::MAX);
        }
    }
    // Above 45 frames per second, losses are first counted in groups.
    for fps in [30, 60, 1000] {
        let layout = stacked(size(2, 2), [1, 1], [0, 0]);
        let camera = FrameGeometry::new(Gray, layout, FrameRate::new(fps, 1).unwrap()).unwrap();
        let added = u64::from(camera.rate().frames_added());
        let mut pipeline = Pipeline::builder(camera).build().unwrap();
        pipeline.push_lost(u64::MAX);
        assert_eq!(pipeline.end().frames, 0, "lost before the first frame");
        pipeline.push_frame(&[9; 4]).unwrap();
        pipeline.push_lost(u64::MAX);
        let expected = ((u128::from(u64::MAX) + 1) / u128::from(added)).min(u128::from(u64::MAX)) as u64;
        assert_eq!(pipeline.end().frames, expected);
        pipeline.push_lost(u64::MAX);
        pipeline.finish();
    }
}

// Time.

/// Frame rates of 1 to 1000 per second, and unusual ones: round(fps / 30) frames are added up above 45, and 1 below.
/// The features of a still picture do not depend on the rate, and time runs in feature frames.
#[test]
fn frame_rates_from_1_to_1000() {
    let odd = [(30_000, 1001), (60_000, 1001), (45_000, 1001), (2997, 100), (5994, 100), (45_001, 1000), (1, 60)];
    let layout = Layout::paper(size(8, 8)).unwrap();
    let bytes: Vec<u8> = (0..64).map(|i| 3 * i).collect();
    let camera = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
    let nominal = FeatureStream::<Gray, Libm>::new(camera, 0.5).unwrap().push_frame(&bytes).unwrap().unwrap().features;
    for (numerator, denominator) in (1..=1000).map(|fps| (fps, 1)).chain(odd) {
        let fps = f64::from(numerator) / f64::from(denominator);
        let expected = if fps > 45.0 { (fps / 30.0).round() as u32 } else { 1 };
        let rate = FrameRate::new(numerator, denominator).unwrap();
        assert_eq!(rate.frames_added(), expected, "{numerator}/{denominator}");
        let lasts = f64::from(expected) * 30.0 / fps;
        assert!((f64::from(rate.nominal_frames()) / lasts - 1.0).abs() < 1e-6, "{numerator}/{denominator}");
        let camera = FrameGeometry::new(Gray, layout, rate).unwrap();
        let mut stream = FeatureStream::<Gray, Libm>::new(camera, 0.5).unwrap();
        let mut frames = 0;
        for frame in 1..=3 * expected {
            let found = stream.push_frame(&bytes).unwrap();
            assert_eq!(found.is_some(), frame % expected == 0, "{numerator}/{denominator}, frame {frame}");
            if let Some(found) = found {
                frames += 1;
                assert_eq!(found.features, nominal, "{numerator}/{denominator}");
                assert!(!found.has_missing_frames);
            }
        }
        assert_eq!(frames, 3);
    }
    assert_eq!([45, 46, 74, 75, 76].map(|fps| FrameRate::new(fps, 1).unwrap().frames_added()), [1, 2, 2, 3, 3]);
    assert_eq!(FrameRate::new(0, 1), Err(ConfigError::FrameRate { numerator: 0, denominator: 1 }));
    assert_eq!(FrameRate::new(1, 0), Err(ConfigError::FrameRate { numerator: 1, denominator: 0 }));
}

/// All frames lost: nothing has arrived, so there is no time. All but the first lost: its baseline is never reliable,
/// and there is no event. The properties of events lose some.
#[test]
fn all_frames_lost_and_all_but_the_first() {
    let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
    (0..300).for_each(|_| trigger.push_lost(1));
    assert!(trigger.finish().is_none());
    assert_eq!((trigger.end().frames, trigger.end().baseline_complete), (0, false));
    push(&mut trigger, DARK);
    (0..300).for_each(|_| trigger.push_lost(1));
    assert!(trigger.finish().is_none());
    let end = trigger.end();
    assert_eq!((end.frames, end.baseline_complete, end.baseline_quiet, end.incomplete), (301, true, false, None));
}

/// 7 and 8 frames lost in a row at every phase: 7 are filled, and every event stays at its place; 8 interrupt a sample,
/// spoil a baseline, or restart windows. Time never shifts.
#[test]
fn seven_and_eight_lost_in_a_row_at_every_phase() {
    const FRAMES: u64 = 300;
    let bright = |frame: u64| (60..75).contains(&frame);
    // Without losses: windows at 25, 30 …, the one at 60 fires, the sample is 50..120, and the next window is at 130.
    for gap in [7, 8] {
        for at in 1..=FRAMES - gap {
            let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
            let (mut events, mut interrupted) = (Vec::new(), Vec::new());
            for frame in 0..FRAMES {
                if (at..at + gap).contains(&frame) {
                    trigger.push_lost(1);
                } else {
                    events.extend(push(&mut trigger, if bright(frame) { BRIGHT } else { DARK }));
                }
                interrupted.extend(trigger.take_interrupted());
                assert_eq!(trigger.next_frame(), frame + 1);
            }
            events.extend(trigger.finish().map(OwnedEvent::from));
            interrupted.extend(trigger.take_interrupted());
            assert_eq!(trigger.end().frames, FRAMES);
            let context = format!("{gap} lost at {at}");
            assert_eq!(trigger.end().baseline_quiet, gap == 7 || at >= 25, "{context}");

            // The light as the trigger saw it: fills repeat the last frame.
            let seen = |frame: u64| if (at..at + gap).contains(&frame) { bright(at - 1) } else { bright(frame) };
            let fires = |t: u64| (t..t + 5).any(seen);
            let windows_after = |start: u64| (start..=FRAMES - 5).step_by(5).find(|&t| fires(t));
            if gap == 8 && (65..120).contains(&at) {
                // The window at 60 had fired: its sample is cut off, and later light makes a new one.
                assert_eq!(interrupted, [InterruptedSample::new(50, (at - 50) as u8)], "{context}");
                let expected: Vec<u64> = windows_after(at + 8).map(|t| t - 10).into_iter().collect();
                assert_eq!(events.iter().map(|event| event.frame).collect::<Vec<_>>(), expected, "{context}");
                continue;
            }
            assert_eq!(interrupted, [], "{context}");
            let first = if gap == 8 && (18..65).contains(&at) {
                // Windows before the gap are dark; the next starts after it.
                windows_after(at + 8)
            } else {
                windows_after(25)
            };
            let expected: Vec<u64> = first.map(|t| t - 10).into_iter().collect();
            assert_eq!(events.iter().map(|event| event.frame).collect::<Vec<_>>(), expected, "{context}");
            for event in &events {
                let filled = (event.frame..event.frame + 70).filter(|frame| (at..at + gap).contains(frame)).count();
                assert_eq!(usize::from(event.frames_filled), filled, "{context}");
                assert_eq!(event.reliable, filled <= 7 && (gap == 7 || at >= 25), "{context}");
            }
        }
    }
}

/// The last frames of a stream are lost: 7 can complete a sample, 8 leave it incomplete, and the end counts them.
#[test]
fn losses_at_the_very_end() {
    for arrived in 100..=125_u64 {
        for lost in 0..=9 {
            let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
            let mut events = 0;
            for frame in 0..arrived {
                events +=
                    u32::from(push(&mut trigger, if (60..75).contains(&frame) { BRIGHT } else { DARK }).is_some());
            }
            trigger.push_lost(lost);
            events += u32::from(trigger.finish().is_some());
            let context = format!("{arrived} arrived, {lost} lost");
            let complete = arrived >= 120 || (lost <= 7 && arrived + lost >= 120);
            assert_eq!(events, u32::from(complete), "{context}");
            let end = trigger.end();
            assert_eq!(end.frames, arrived + lost, "{context}");
            let (open, interrupted) = (end.incomplete, trigger.take_interrupted());
            if complete {
                assert_eq!((open, interrupted), (None, None), "{context}");
            } else if lost > 7 {
                let frames = (arrived - 50) as u8;
                assert_eq!((open, interrupted), (None, Some(InterruptedSample::new(50, frames))), "{context}");
            } else {
                let frames = (arrived + lost - 50) as u8;
                assert_eq!((open, interrupted), (Some(InterruptedSample::new(50, frames)), None), "{context}");
            }
        }
    }
}
