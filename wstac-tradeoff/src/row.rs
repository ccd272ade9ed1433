//! The results of one configuration: a setting with or without a model.

use super::candidate::Candidate;
use super::float64::FeatureError;
use super::parameters::Setting;
use super::slides::TradeSlide;
use super::statistics::{Interval, interval};
use super::sweep::{Outcome, Plan};
use wstac_core::model::file::Input;
use wstac_core::params::SAMPLE_FRAMES;
use wstac_host::statistics::{mean, percentile};

/// Speeds whose errors are counted, in mm/s: the range in which the published law was fitted.
pub const FITTED: std::ops::RangeInclusive<u32> = 100..=200;

/// A configuration and its results.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The setting before a sample.
    pub setting: Setting,
    /// The model's name, if there is one.
    pub model: Option<String>,
    /// The results on the scene set.
    pub found: Found,
}

/// The results of a configuration on the scene set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Number of slides.
    pub slides: usize,
    /// Number of slides with an event. Those without one count as wrong.
    pub events: usize,
    /// Fraction of slides whose specimen, pattern and depth are right, in percent; `None` if no model answers.
    pub accuracy: [Option<Interval>; 3],
    /// Mean and 95th percentile of the relative error of speed in percent, over slides in the fitted range.
    ///
    /// It is `None` if no slide has a speed.
    pub speed: Option<[f64; 2]>,
    /// Number of slides in the fitted range.
    pub speed_slides: usize,
    /// Number of slides in the fitted range without a speed.
    pub speedless: usize,
    /// Number of slides with a wrong direction or none.
    pub direction_errors: usize,
    /// Errors of features in units of a natural logarithm.
    ///
    /// They are the largest and root mean square error for lit rows and columns, then the same for all.
    pub feature: [f64; 4],
    /// Mean number of frames from the first touch to the answer, over events; `None` without events.
    pub latency: Option<f64>,
    /// Fraction of touches of rods, balls, coins, corners and narrow blocks whose speed and direction are reliable and right,
    /// in percent; `None` of MJPEG, and of fewer than four slides of a sensor.
    pub objects: Option<f64>,
}

/// Returns a row for every setting, without a model and with each model that its law goes with, setting by setting.
pub fn rows(plan: &Plan<'_>, outcomes: &[Vec<Option<Outcome>>]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (place, setting) in plan.settings.iter().enumerate() {
        let all = plan.slides.iter().zip(outcomes);
        let all = all.filter_map(|(slide, all)| Some((slide, all.get(place)?.as_ref()?)));
        let (own, objects): (Vec<(&TradeSlide, &Outcome)>, Vec<_>) = all.partition(|(slide, _)| slide.object.is_none());
        let is_right =
            |(_, outcome): &(&TradeSlide, &Outcome)| outcome.event.as_ref().is_some_and(|event| event.is_right);
        let right = mean(objects.iter().map(|object| if is_right(object) { 100.0 } else { 0.0 }));
        let bare = Found { objects: right, ..bare(&own) };
        rows.push(Row { setting: *setting, model: None, found: bare });
        for (number, model) in plan.models.iter().enumerate().filter(|(_, model)| setting.law.is_with(model.input)) {
            // A sample along the path is known only when the event is complete.
            let frames =
                if model.input == Input::Frames { f64::from(model.about.frames) } else { SAMPLE_FRAMES as f64 };
            let found = Found { accuracy: accuracy(&own, number, model), latency: latency(&own, frames), ..bare };
            rows.push(Row { setting: *setting, model: Some(model.name.clone()), found });
        }
    }
    rows
}

/// Returns the number of frames from the first touch to the end of the whole sample.
///
/// Speed and direction come at that time, whatever a model reads. It is the latency of the same setting without a
/// model, or `None` if these rows have no such setting.
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
        objects: None,
    }
}

/// Returns the error in percent of the speed, if there is an answer.
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

/// Returns the mean time from the first touch to the end of the frame that completes the answer's data.
fn latency(own: &[(&TradeSlide, &Outcome)], frames: f64) -> Option<f64> {
    mean(own.iter().filter_map(|(_, outcome)| outcome.event.as_ref()).map(|event| event.lead + frames))
}
