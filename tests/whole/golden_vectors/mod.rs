//! Tests the golden vectors of the independent reference (`tests/reference`), case by case: sums, features, thresholds,
//! events, answers and ends. Every case of the manifest is run. A missing or empty manifest fails.

mod at_once;
mod case;
mod crosstalk;
mod extent;
mod known;
mod live;
mod motion;
mod motion_of;
mod path;
mod shutter;
mod slip;
mod wave;

use std::collections::HashMap;
use std::fs;

use wstac_core::green::any::Any;
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::direction;
use wstac_core::paper::speed::{self, SpeedConfig};
use wstac_core::paper::trigger::{ContactEnd, Event, InterruptedSample, Trigger};
use wstac_core::reason::Reason;
use wstac_core::stream::{FeatureFrame, FeatureStream, Loss};
use wstac_core::taxels::TaxelSums;

use case::{Case, EventOf, Expected, Manifest, directory, read};

const EVIDENCE: &str = include_str!("../../../docs/EVIDENCE.md");

/// Checks the numbers and answers of one event.
fn check_event(name: &str, event: &Event<'_>, expected: &EventOf, config: &SpeedConfig, compare_samples: bool) {
    let at = format!("{name}, event at {}", expected.frame);
    assert_eq!(event.frame, expected.frame, "{at}");
    assert_eq!(event.frames_filled, expected.frames_filled, "{at}: frames filled");
    assert_eq!(event.reliable, expected.reliable, "{at}: reliable");
    assert_eq!([event.touch_frame, event.end_frame], expected.touch, "{at}: touch");
    if let Some(sample) = expected.sample.as_ref().filter(|_| compare_samples) {
        assert_eq!(sample.len(), 10, "{at}");
        for (feature, expected) in sample.iter().enumerate() {
            assert_eq!(&event.sample.feature(feature).collect::<Vec<i16>>(), expected, "{at}: feature {feature}");
        }
    }

    let duration = speed::duration(event, config);
    assert_eq!(duration.map(|d| d.first), expected.first_valid, "{at}: first valid");
    assert_eq!(duration.map(|d| d.last), expected.last_valid, "{at}: last valid");
    assert_eq!(duration.map(speed::LitSpan::frames), expected.duration_frames, "{at}: duration");

    // 32-bit and 64-bit floats differ by a few units in the last place.
    let close = |found: f32, expected: f64| (f64::from(found) / expected - 1.0).abs() < 2e-6;
    let answer = &expected.speed;
    match speed::speed(event, config) {
        Ok(speed) => {
            let mm_s = answer.mm_s.unwrap_or_else(|| panic!("{at}: {speed:?}, expected none: {:?}", answer.why));
            assert!(close(speed.mm_s, mm_s), "{at}: {speed:?}, expected {mm_s}");
            assert_eq!(speed.extrapolated, answer.extrapolated, "{at}: {mm_s} extrapolated");
        }
        Err(none) => {
            let (why, bound) = match none {
                Reason::BaselineAbove => ("baseline", None),
                Reason::NeverValid => ("no_light", None),
                Reason::CutOff { at_most } => ("cut_off", at_most),
                other => panic!("{at}: {other:?} is no reason of the reference"),
            };
            assert_eq!(Some(why), answer.why.as_deref(), "{at}: why there is no speed");
            assert_eq!(answer.mm_s, None, "{at}: speed");
            assert_eq!(bound.is_some(), answer.bound_mm_s.is_some(), "{at}: {bound:?}, {:?}", answer.bound_mm_s);
            if let (Some(found), Some(expected)) = (bound, answer.bound_mm_s) {
                assert!(close(found, expected), "{at}: bound {found}, expected {expected}");
            }
        }
    }

    let direction = direction::direction(event);
    assert_eq!(direction.heading().map(direction::Heading::degrees), expected.direction.deg, "{at}: {direction:?}");
    // The confidence may differ by a unit of 2^-15, because it is rounded down, and by the effect of slopes that are
    // off by 2e-5 frames per index.
    let slopes = expected.direction.row_slope.abs() + expected.direction.column_slope.abs();
    let allowed = 1.1 / 32_768.0 + if slopes > 0.0 { 2.0 * 2e-5 / slopes } else { 0.0 };
    let (found, expected) = (f64::from(direction.confidence().unwrap()), expected.direction.confidence);
    assert!((found - expected).abs() < allowed, "{at}: confidence {found}, expected {expected} within {allowed}");
}

/// The totals of all cases.
#[derive(Default)]
struct Found {
    sums: usize,
    features: usize,
    equal: usize,
    events: usize,
    incomplete: usize,
    unrobust: usize,
}

/// A case that is being run: its trigger, and the number of expected events that have come.
struct Run<'a> {
    name: &'a str,
    trigger: Trigger<Option<TrackingBaseline>>,
    speed: SpeedConfig,
    expected: &'a [EventOf],
    events: usize,
    interrupted: Vec<InterruptedSample>,
    contact_ends: Vec<ContactEnd>,
    /// Whether samples can be compared, because the trigger got the reference's own features.
    exact: bool,
}

impl Run<'_> {
    fn push(&mut self, frame: Option<FeatureFrame>, lost: u64) {
        let event = if let Some(frame) = frame {
            self.trigger.push_then_lose(frame.features, frame.has_missing_frames, lost)
        } else {
            self.trigger.push_lost(lost);
            None
        };
        Self::check(self.name, event, self.expected, &mut self.events, &self.speed, self.exact);
        self.interrupted.extend(self.trigger.take_interrupted());
        self.contact_ends.extend(self.trigger.take_contact_end());
    }

    fn finish(&mut self) {
        let event = self.trigger.finish();
        Self::check(self.name, event, self.expected, &mut self.events, &self.speed, self.exact);
        self.interrupted.extend(self.trigger.take_interrupted());
        self.contact_ends.extend(self.trigger.take_contact_end());
        assert_eq!(self.events, self.expected.len(), "{}: events", self.name);
    }

    fn check(
        name: &str,
        event: Option<Event<'_>>,
        expected: &[EventOf],
        events: &mut usize,
        speed: &SpeedConfig,
        exact: bool,
    ) {
        let Some(event) = event else { return };
        let Some(expected) = expected.get(*events) else { panic!("{name}: event at {} too many", event.frame) };
        check_event(name, &event, expected, speed, exact);
        *events += 1;
    }
}

/// Runs a case twice: from its bytes, and from the reference's features. The second run must be exact.
fn run(case: &Case, expected: &Expected, bytes: &[u8], found: &mut Found) {
    let name = case.name.as_str();
    let camera = case.camera();
    assert_eq!(camera.pixels(), expected.pixels, "{name}: pixels");
    assert_eq!(camera.full_scale(), expected.full_scale, "{name}: full scale");
    assert_eq!(case.rate().frames_added(), expected.added, "{name}: frames added up");
    let frames: Vec<&[u8]> = bytes.chunks(case.frame_bytes).collect();

    let mut accumulators = TaxelSums::new(camera);
    if let Some(sums) = &expected.sums {
        assert_eq!(sums.len(), frames.len(), "{name}: sums");
        for (number, (frame, sums)) in frames.iter().zip(sums).enumerate() {
            assert_eq!(&accumulators.push_frame(frame).unwrap()[..], sums, "{name}, frame {number}: sums");
            found.sums += 1;
        }
    }

    let run = |exact| Run {
        name,
        trigger: Trigger::with(case.trigger(), 0, case.following()),
        speed: case.speed(),
        expected: &expected.events,
        events: 0,
        interrupted: Vec::new(),
        contact_ends: Vec::new(),
        exact,
    };
    let (mut own, mut fed) = (run(false), run(true));
    let mut stream = FeatureStream::<Any, Fixed>::new(camera, case.floor_levels).unwrap();
    let (mut numbers, mut partial) = (Vec::new(), Vec::new());
    let mut take = |frame: Option<FeatureFrame>, lost: u64| {
        let theirs = frame.map(|frame| {
            let Some(&theirs) = expected.features.get(numbers.len()) else {
                panic!("{name}: more than {} feature frames", expected.features.len())
            };
            let number = fed.trigger.next_frame();
            for (a, b) in frame.features.into_iter().zip(theirs) {
                assert!((i32::from(a) - i32::from(b)).abs() <= 1, "{name}, feature frame {number}: {a}, expected {b}");
                found.features += 1;
                found.equal += usize::from(a == b);
            }
            numbers.push(number);
            partial.extend(frame.has_missing_frames.then_some(number));
            FeatureFrame::new(theirs, frame.has_missing_frames)
        });
        if expected.robust {
            own.push(frame, lost);
        }
        fed.push(theirs, lost);
    };
    let mut dropped = 0;
    for (index, frame) in frames.iter().map(Some).chain([None]).enumerate() {
        for &(_, count) in case.lost.iter().filter(|lost| lost.0 == index) {
            let Loss { has_missing_frames, frames, .. } = stream.push_lost(count);
            take(has_missing_frames, frames);
            dropped += count;
        }
        if let Some(frame) = frame {
            take(stream.push_frame(frame).unwrap(), 0);
        }
    }
    assert_eq!(numbers.len(), expected.features.len(), "{name}: feature frames");
    let all = (0..numbers.len() as u64).collect();
    assert_eq!(&numbers, expected.feature_frames.as_ref().unwrap_or(&all), "{name}: numbers of the feature frames");
    assert_eq!(&partial, expected.partial_frames.as_ref().unwrap_or(&Vec::new()), "{name}: partial frames");
    assert_eq!(dropped, expected.end.dropped, "{name}: dropped");

    // A long gap that began in the baseline: more than 7 feature frames are missing.
    let baseline_frames = u64::from(case.trigger().baseline_frames());
    let ends = numbers.iter().skip(1).copied().chain([expected.end.frames]);
    let gap_in_baseline = numbers.iter().zip(ends).any(|(&last, next)| next - last > 8 && last + 1 < baseline_frames);

    let runs = if expected.robust { vec![own, fed] } else { vec![fed] };
    found.unrobust += usize::from(!expected.robust);
    for mut run in runs {
        run.finish();
        assert_eq!(run.interrupted, expected.incomplete_samples, "{name}: incomplete samples");
        let end = run.trigger.end();
        assert_eq!(end.frames, expected.end.frames, "{name}: frames");
        assert_eq!(end.baseline_complete, expected.end.baseline == "complete", "{name}: baseline");
        // The reference's `quiet` is only about the five windows. The product's is also false after a long gap.
        let quiet = expected.end.quiet.map(|quiet| quiet && !gap_in_baseline);
        assert_eq!(end.baseline_complete.then_some(end.baseline_quiet), quiet, "{name}: quiet");
        assert_eq!(run.contact_ends, expected.contact_ends, "{name}: ends of contacts");
        assert_eq!(end.incomplete, expected.end.incomplete, "{name}: sample at the end");
        found.events += run.events;
        found.incomplete += run.interrupted.len() + usize::from(end.incomplete.is_some());
        assert_eq!(run.trigger.baseline().is_some(), expected.trigger.is_some(), "{name}: thresholds");
        if let Some(thresholds) = expected.trigger.as_ref().filter(|_| run.exact) {
            assert_eq!(run.trigger.baseline().unwrap().totals(), &thresholds.baseline_sum, "{name}: baseline");
            assert_eq!(run.trigger.thresholds().unwrap(), &thresholds.threshold_floor, "{name}: thresholds");
            for (total, eta) in thresholds.baseline_sum.iter().zip(thresholds.eta) {
                assert!((f64::from(*total) / 5.0 - eta).abs() < 1e-6, "{name}: η");
            }
        }
    }
}

#[test]
fn every_golden_vector_is_met() {
    let manifest: Manifest = read(&directory().join("manifest.json"));
    assert_eq!(manifest.version, 2);
    assert!(!manifest.cases.is_empty(), "the manifest has no cases");
    let expected: HashMap<String, Expected> = read(&directory().join("expected.json"));
    assert_eq!(expected.len(), manifest.cases.len(), "expected.json has other cases than the manifest");
    let every_frame = fs::read(directory().join("frames.raw")).unwrap();
    let mut end = 0;
    for case in &manifest.cases {
        assert_eq!(case.at, end, "{}: its frames begin elsewhere than those before end", case.name);
        end += case.frames * case.frame_bytes;
    }
    assert_eq!(end, every_frame.len(), "frames.raw has frames of no case");
    let mut found = Found::default();
    let mut failed = Vec::new();
    for case in &manifest.cases {
        let attempt = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let bytes = &every_frame[case.at..][..case.frames * case.frame_bytes];
            run(case, &expected[&case.name], bytes, &mut found);
        }));
        if attempt.is_err() {
            failed.push(case.name.as_str());
        }
    }
    let percent = 100.0 * found.equal as f64 / found.features as f64;
    println!(
        "{} cases: {} frames' sums identical; {} features, {:.4} % equal, the others off by 1/2048; {} events and {} incomplete samples; {} cases run from the reference's features only",
        manifest.cases.len(),
        found.sums,
        found.features,
        percent,
        found.events,
        found.incomplete,
        found.unrobust,
    );
    assert!(failed.is_empty(), "{} of {} cases failed: {failed:?}", failed.len(), manifest.cases.len());
    assert!(found.sums > 0 && found.features > 0 && found.events > 0 && found.incomplete > 0, "a part has no cases");
    for claim in [
        format!("| {} golden cases ", manifest.cases.len()),
        format!("{percent:.2} % of {},{:03} features equal", found.features / 1000, found.features % 1000),
    ] {
        assert!(EVIDENCE.contains(&claim), "docs/EVIDENCE.md does not say: {claim}");
    }
}
