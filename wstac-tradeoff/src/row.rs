//! The results of one configuration: a setting with or without a model.

use super::candidate::Candidate;
use super::float64::FeatureError;
use super::parameters::{AnswerLaw, Setting};
use super::slides::TradeSlide;
use super::statistics::{Interval, interval};
use super::sweep::{Answer, Outcome, Plan};
use wstac_core::model::file::Input;
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
    /// Mean number of frames from the first touch to the answer, of the model if there is one; `None` without events.
    pub latency: Option<f64>,
    /// Fraction of touches of rods, balls, coins, corners and narrow blocks whose speed and direction are reliable and
    /// right, in percent; `None` of MJPEG, and of fewer than four slides of a sensor.
    pub objects: Option<f64>,
}

/// A slide, its outcome, and the answer that a configuration has.
type Answered<'a> = (&'a TradeSlide, &'a Outcome, Option<&'a Answer>);

/// Returns a row for every setting, without a model and with each model that its law goes with, setting by setting.
pub fn rows(plan: &Plan<'_>, outcomes: &[Vec<Option<Outcome>>]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (place, setting) in plan.settings.iter().enumerate() {
        let models = plan.models.iter().enumerate().filter(|(_, model)| setting.law.is_with(model.input));
        for model in std::iter::once(None).chain(models.map(Some)) {
            let all = plan.slides.iter().zip(outcomes);
            let all = all.filter_map(|(slide, all)| Some((slide, all.get(place)?.as_ref()?)));
            let all = all.map(|(slide, outcome)| (slide, outcome, outcome.answer(model.map(|(_, model)| model))));
            let (own, objects): (Vec<Answered<'_>>, Vec<_>) = all.partition(|(slide, ..)| slide.object.is_none());
            let is_right = |(.., answer): &Answered<'_>| answer.is_some_and(|answer| answer.is_right);
            let right = mean(objects.iter().map(|object| if is_right(object) { 100.0 } else { 0.0 }));
            let found = Found { objects: right, ..found(&own, model) };
            rows.push(Row { setting: *setting, model: model.map(|(_, model)| model.name.clone()), found });
        }
    }
    rows
}

/// Returns the number of frames from the first touch to speed and direction.
///
/// With the law of durations they come with the whole sample, whatever a model reads, so it is the latency of the same
/// setting without a model, or `None` if these rows have no such setting. With the others the event has all answers.
pub fn motion_latency(row: &Row, rows: &[Row]) -> Option<f64> {
    let bare = |other: &&Row| other.setting == row.setting && other.model.is_none();
    let of = if row.setting.law == AnswerLaw::Published { rows.iter().find(bare)? } else { row };
    of.found.latency
}

fn found(own: &[Answered<'_>], model: Option<(usize, &Candidate)>) -> Found {
    let fitted = own.iter().filter(|(slide, ..)| FITTED.contains(&slide.speed_mm_s));
    let speeds: Vec<Option<f64>> = fitted.map(|(slide, _, answer)| speed_error(slide, (*answer)?)).collect();
    let errors: Vec<f64> = speeds.iter().flatten().copied().collect();
    let mut feature = FeatureError::default();
    for (_, outcome, _) in own {
        feature.merge(&outcome.error);
    }
    let answers = || own.iter().filter_map(|(.., answer)| *answer);
    // A model over time answers before its event.
    let read = model.filter(|(_, model)| model.input == Input::Frames).map(|(_, model)| model.about.frames);
    Found {
        slides: own.len(),
        events: answers().count(),
        accuracy: model.map_or([None; 3], |(number, model)| accuracy(own, number, model)),
        speed: mean(errors.iter().copied()).zip(percentile(errors.clone(), 0.95)).map(|(mean, most)| [mean, most]),
        speed_slides: speeds.len(),
        speedless: speeds.len() - errors.len(),
        direction_errors: own.len() - answers().filter(|answer| answer.direction).count(),
        feature: [feature.lit.max, feature.lit.rms(), feature.all.max, feature.all.rms()],
        latency: mean(answers().map(|answer| answer.lead + f64::from(read.unwrap_or(answer.frames)))),
        objects: None,
    }
}

/// Returns the error in percent of the speed, if there is one.
fn speed_error(slide: &TradeSlide, answer: &Answer) -> Option<f64> {
    let truth = f64::from(slide.speed_mm_s);
    Some(100.0 * (f64::from(answer.speed?) - truth).abs() / truth)
}

fn accuracy(own: &[Answered<'_>], number: usize, model: &Candidate) -> [Option<Interval>; 3] {
    let mut all = [None; 3];
    for ((task, found), tells) in all.iter_mut().enumerate().zip(model.tells()) {
        let right = |answer: &Answer| answer.right.get(number).and_then(|right| right[task]);
        let right = |(slide, _, answer): &Answered<'_>| (slide.sensor, answer.and_then(right).unwrap_or(false));
        *found = tells.then(|| interval(own.iter().map(right)));
    }
    all
}
