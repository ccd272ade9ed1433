//! What was found of one configuration: a setting with a model, or without one.

use super::candidate::Candidate;
use super::float64::FeatureError;
use super::parameters::Setting;
use super::slides::TradeSlide;
use super::statistics::{Interval, interval};
use super::sweep::{Outcome, Plan};
use wstac_core::params::SAMPLE_FRAMES;
use wstac_host::statistics::{mean, percentile};

/// Speeds whose errors are counted, in mm/s: where the speed law was fitted.
pub const FITTED: std::ops::RangeInclusive<u32> = 100..=200;

/// A configuration and what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The setting before a sample.
    pub setting: Setting,
    /// The model's name, if there is one.
    pub model: Option<String>,
    /// What was found on the scene set.
    pub found: Found,
    /// What it costs on a host: of one machine, and only to be compared with each other.
    pub host: Option<Host>,
}

/// Time on a host, in ns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Host {
    /// Of a frame: bytes (of MJPEG, a picture) to features and trigger.
    pub frame_ns: f64,
    /// Of an event: speed, direction and texture.
    pub event_ns: f64,
}

/// What was found of a configuration on the scene set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Slides.
    pub slides: usize,
    /// Slides with an event. Those without one count as wrong.
    pub events: usize,
    /// Share of slides whose specimen, pattern and depth are right, in per cent; nothing where no model tells them.
    pub accuracy: [Option<Interval>; 3],
    /// Mean and 95th percentile of the error of speed, in per cent of it, of slides in the fitted range; nothing where none has a
    /// speed.
    pub speed: Option<[f64; 2]>,
    /// Slides in the fitted range.
    pub speed_slides: usize,
    /// Those without a speed.
    pub speedless: usize,
    /// Slides with a wrong direction or none.
    pub direction_errors: usize,
    /// Largest and root mean square error of features of lit rows and columns, then of all, in units of a natural logarithm.
    pub feature: [f64; 4],
    /// Frames from the first touch to the answer, mean over events; nothing where there is none.
    pub latency: Option<f64>,
}

/// A row for every setting with no model and with each, setting by setting.
pub fn rows(plan: &Plan<'_>, outcomes: &[Vec<Option<Outcome>>]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (place, setting) in plan.settings.iter().enumerate() {
        let own: Vec<(&TradeSlide, &Outcome)> = plan
            .slides
            .iter()
            .zip(outcomes)
            .filter_map(|(slide, all)| Some((slide, all.get(place)?.as_ref()?)))
            .collect();
        let bare = bare(&own);
        rows.push(Row { setting: *setting, model: None, found: bare, host: None });
        for (number, model) in plan.models.iter().enumerate() {
            let found = Found {
                accuracy: accuracy(&own, number, model),
                latency: latency(&own, f64::from(model.about.frames)),
                ..bare
            };
            rows.push(Row { setting: *setting, model: Some(model.name.clone()), found, host: None });
        }
    }
    rows
}

/// Frames from the first touch to the end of the whole sample, with which speed and direction come, whatever a model reads: that of
/// the same setting without a model; nothing where these rows have none.
pub fn whole_latency(row: &Row, rows: &[Row]) -> Option<f64> {
    rows.iter().find(|other| other.setting == row.setting && other.model.is_none())?.found.latency
}

fn bare(own: &[(&TradeSlide, &Outcome)]) -> Found {
    let fitted = own.iter().filter(|(slide, _)| FITTED.contains(&slide.speed_mm_s));
    let speeds: Vec<Option<f64>> = fitted.map(|(slide, outcome)| speed_error(slide, outcome)).collect();
    let errors: Vec<f64> = speeds.iter().flatten().copied().collect();
    let mut feature = FeatureError::default();
    for (_, outcome) in own {
        feature.merge(&outcome.error);
    }
    Found {
        slides: own.len(),
        events: own.iter().filter(|(_, outcome)| outcome.event.is_some()).count(),
        accuracy: [None; 3],
        speed: mean(errors.iter().copied()).zip(percentile(errors.clone(), 0.95)).map(|(mean, most)| [mean, most]),
        speed_slides: speeds.len(),
        speedless: speeds.len() - errors.len(),
        direction_errors: own
            .iter()
            .filter(|(_, outcome)| !outcome.event.as_ref().is_some_and(|event| event.direction))
            .count(),
        feature: [feature.lit.max, feature.lit.rms(), feature.all.max, feature.all.rms()],
        latency: latency(own, SAMPLE_FRAMES as f64),
    }
}

/// In per cent of the speed, where there is an answer.
fn speed_error(slide: &TradeSlide, outcome: &Outcome) -> Option<f64> {
    let speed = f64::from(outcome.event.as_ref()?.speed?);
    let truth = f64::from(slide.speed_mm_s);
    Some(100.0 * (speed - truth).abs() / truth)
}

fn accuracy(own: &[(&TradeSlide, &Outcome)], number: usize, model: &Candidate) -> [Option<Interval>; 3] {
    let mut all = [None; 3];
    for ((task, found), tells) in all.iter_mut().enumerate().zip(model.tells()) {
        let right = |outcome: &Outcome| {
            let right = outcome.event.as_ref().and_then(|event| event.right.get(number).copied());
            right.and_then(|right| right[task]).unwrap_or(false)
        };
        *found = tells.then(|| interval(own.iter().map(|(slide, outcome)| (slide.sensor, right(outcome)))));
    }
    all
}

/// From the first touch to the end of the frame that completes what the answer needs.
fn latency(own: &[(&TradeSlide, &Outcome)], frames: f64) -> Option<f64> {
    mean(own.iter().filter_map(|(_, outcome)| outcome.event.as_ref()).map(|event| event.lead + frames))
}
