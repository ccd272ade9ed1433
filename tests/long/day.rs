//! Tests a day of a simulated sensor's frames. Every slide is an event, and nothing else is. The time before a slide
//! changes nothing.

use std::fmt::Write;

use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::direction::{self, Direction};
use wstac_core::paper::speed::{self, Speed, SpeedConfig};
use wstac_core::paper::trigger::{Trigger, TriggerConfig};
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::FrameGeometry;
use wstac_host::source::{Source, SourceEvent, StreamInfo, SummedFrame};
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;
use wstac_tests::OwnedEvent;

use wstac_tests::how_many;

/// The number of dark frames after each slide: three minutes. 480 slides are a day of 2,592,000 frames.
const GAP: u64 = 5400;
/// The number of frames before a slide at which a second sensor starts: a baseline of 25, a backtrack of 10, and some
/// to spare.
const BEFORE: u64 = 60;
/// The frames of a window. The second sensor starts at a multiple of it, so both have the same windows.
const WINDOW: u64 = 5;

/// The core from taxel sums to answers.
struct Sensor {
    stream: FeatureStream<Any, Fixed>,
    trigger: Trigger,
    speed: SpeedConfig,
}

/// An event with its answers.
#[derive(Clone, Debug, PartialEq)]
struct Answered {
    event: OwnedEvent,
    direction: Direction,
    speed: Result<Speed, Reason>,
}

impl Sensor {
    fn starting_at(info: &StreamInfo, frame: u64) -> Self {
        let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
        let camera = FrameGeometry::new(green, Layout::paper(info.size).unwrap(), info.rate).unwrap();
        Self {
            stream: FeatureStream::new(camera, 0.5).unwrap(),
            trigger: Trigger::starting_at(TriggerConfig::default(), frame),
            speed: SpeedConfig::published(FrameRate::NOMINAL),
        }
    }

    fn push(&mut self, sums: &[u32; TAXELS]) -> Option<Answered> {
        let frame = self.stream.push_taxels(sums)?;
        let event = self.trigger.push(frame.features, frame.has_missing_frames)?;
        let (direction, speed) = (direction::direction(&event), speed::speed(&event, &self.speed));
        Some(Answered { event: OwnedEvent::from(event), direction, speed })
    }
}

/// Returns a scene of this many slides, three minutes apart, as taxel sums. They have all specimens, directions and
/// speeds of the paper.
fn script(slides: u64) -> SceneConfig {
    let mut text =
        format!("seed = 20\nlead_in = 100\ngap = {GAP}\nfidelity = \"taxel\"\n[sensor]\nformat = \"GREY\"\n");
    let specimens = ["Fla0", "Sin2", "Saw3", "Tri4", "Sin3", "Saw4", "Tri2", "Sin4", "Saw2", "Tri3"];
    for slide in 0..slides {
        let specimen = specimens[slide as usize % specimens.len()];
        let (speed, direction) = (100 + 10 * (slide % 11), 90 * (slide / 3 % 4));
        let _ = write!(text, "[[slide]]\nspecimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\n");
    }
    SceneConfig::from_toml("a day", &text).unwrap()
}

/// Returns a line about some slides: how far their events start before the first touch, and the error of their speeds.
fn summary(name: &str, found: &[(i64, f64)]) -> String {
    let mean = |of: fn(&(i64, f64)) -> f64| found.iter().map(of).sum::<f64>() / found.len().max(1) as f64;
    format!(
        "{name}: events start {:.2} frames before the first touch, speeds are off by {:.2} %",
        -mean(|slide| slide.0 as f64),
        100.0 * mean(|slide| slide.1)
    )
}

/// Checks that every slide is one event, in its place and with its direction, and that there is no other event. A
/// second sensor starts before each slide and must report the same event.
#[test]
fn a_day_has_the_events_of_its_slides_and_no_others() {
    // `ci/long` has 480 slides: 24 hours.
    let slides = how_many("WSTAC_LONG_SLIDES", 12);
    let mut source = SceneSource::new(&script(slides)).unwrap();
    let (info, truth) = (source.info().clone(), source.truth().to_vec());
    let mut sensor = Sensor::starting_at(&info, 0);
    let (mut restarted, mut waiting) =
        (None, truth.iter().map(|slide| (slide.start_frame() - BEFORE) / WINDOW * WINDOW));
    let mut next_restart = waiting.next();
    let (mut found, mut frame, mut first_thresholds) = (Vec::new(), 0, None);
    let mut differences = Vec::new();
    while let SourceEvent::Taxels(SummedFrame { sums, .. }) = source.next_event().unwrap() {
        if next_restart == Some(frame) {
            restarted = Some(Sensor::starting_at(&info, frame));
            next_restart = waiting.next();
        }
        let event = sensor.push(&sums);
        let afresh = restarted.as_mut().and_then(|restarted: &mut Sensor| restarted.push(&sums));
        frame += 1;
        first_thresholds = first_thresholds.or(sensor.trigger.thresholds().copied());
        // The baselines come from different frames, so their noise differs. Everything that depends only on the light
        // is equal.
        assert_eq!(event.is_some(), afresh.is_some(), "frame {frame}: {event:?} {afresh:?}");
        let (Some(event), Some(afresh)) = (event, afresh) else { continue };
        differences.push(event.direction.confidence.unwrap().abs_diff(afresh.direction.confidence.unwrap()));
        let without_baseline = |answered: &Answered| {
            let event = OwnedEvent { totals: [0; 10], ..answered.event.clone() };
            (event, answered.direction.degrees, answered.speed)
        };
        assert_eq!(without_baseline(&event), without_baseline(&afresh));
        let slide = &truth[found.len()];
        let offset = event.event.frame as i64 - slide.start_frame() as i64;
        assert!((-14..=-6).contains(&offset), "event {} of a slide from {}", event.event.frame, slide.start);
        assert_eq!(event.direction.heading(), slide.touch.slide().unwrap().heading(), "slide from {}", slide.start);
        let speed = f64::from(event.speed.unwrap().mm_s);
        found.push((offset, (speed / slide.touch.slide().unwrap().speed_mm_s - 1.0).abs()));
    }
    assert_eq!(found.len() as u64, slides);
    assert!(frame >= slides * GAP);
    assert!(sensor.trigger.finish().is_none());
    let end = sensor.trigger.end();
    assert_eq!((end.frames, end.baseline_quiet, end.incomplete), (frame, true, None));
    assert_eq!(sensor.trigger.thresholds().copied(), first_thresholds, "thresholds do not move");
    println!(
        "{frame} frames, {:.2} hours: {slides} slides, {} events, none besides; after a restart before each slide the same, \
         confidences within {:.4}",
        frame as f64 / 30.0 / 3600.0,
        found.len(),
        f64::from(differences.into_iter().max().unwrap_or(0)) / 32_768.0
    );
    let quarter = found.len().div_ceil(4);
    println!("{}", summary("the first quarter", &found[..quarter]));
    println!("{}", summary("the last quarter", &found[found.len() - quarter..]));
}
