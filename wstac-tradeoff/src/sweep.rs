//! Evaluation of slides with every setting: one pass over a slide's frames serves all settings, and slides run in
//! parallel.

use rayon::prelude::*;
use wstac_core::model::Model;
use wstac_core::model::file::Input;

use super::candidate::{Candidate, Right};
use super::float64::FeatureError;
use super::parameters::{Format, Setting};
use super::slides::{QUICK_SLIDES, TradeSlide};
use super::streams::{EvaluatedCamera, FirstEvent};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::texture::{Texture, pattern_and_depth};
use wstac_scene::Scene;

/// The scope of a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    /// All configuration that is not a parameter.
    pub config: &'a Config,
    /// The settings before a sample.
    pub settings: &'a [Setting],
    /// The models after it.
    pub models: &'a [Candidate],
    /// The slides.
    pub slides: &'a [TradeSlide],
}

/// The result of one setting on one slide.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The answer for the whole sample, if an event was triggered.
    pub event: Option<Answer>,
    /// The answers at once, by the number of frames along the path that a model reads; 0 for those without a model.
    pub early: Vec<(u8, Answer)>,
    /// The deviation of its features from the reference.
    pub error: FeatureError,
}

impl Outcome {
    /// Returns the answer with a model or without: that at once, if the law and the model allow it.
    pub fn answer(&self, model: Option<&Candidate>) -> Option<&Answer> {
        let wanted = match model {
            None => Some(0),
            Some(model) => (model.input == Input::TaxelPath).then_some(model.about.frames),
        };
        let early = self.early.iter().find(|(frames, _)| Some(*frames) == wanted);
        early.map(|(_, answer)| answer).or(self.event.as_ref())
    }
}

/// The answer for a slide.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Frames from the first touch to the sample's first frame; below 0, the sample starts before the touch.
    pub lead: f64,
    /// Frames of the sample that had arrived.
    pub frames: u8,
    /// Speed in mm/s, if there is one.
    pub speed: Option<f32>,
    /// `true` if there is a direction and it is right.
    pub direction: bool,
    /// `true` if speed and direction are reliable, and off by at most 10 % and 10°.
    pub is_right: bool,
    /// Each model's result.
    pub right: Vec<Right>,
}

/// Returns the outcomes by slide, then by setting; `None` if a setting was not run.
///
/// They are the same whatever the number of threads.
///
/// # Errors
/// The configuration does not fit the frames.
pub fn run(plan: &Plan<'_>) -> Result<Vec<Vec<Option<Outcome>>>, Error> {
    let models = plan.models.iter().map(Candidate::model).collect::<Result<Vec<_>, _>>()?;
    plan.slides.par_iter().with_max_len(1).map(|slide| one(plan, &models, slide)).collect()
}

fn one(plan: &Plan<'_>, models: &[Model<'_>], slide: &TradeSlide) -> Result<Vec<Option<Outcome>>, Error> {
    let mut scene = Scene::new(&slide.script(Format::Gray)?)?;
    let mut cameras = Vec::new();
    let mut wanted = vec![0];
    wanted.extend(models.iter().filter(|model| model.input() == Input::TaxelPath).map(Model::frames));
    wanted.sort_unstable();
    wanted.dedup();
    let formats: Vec<Format> = formats_read(plan.settings).filter(|format| is_run(*format, slide)).collect();
    for &format in &formats {
        let sensor = Scene::camera(&slide.script(format)?)?;
        cameras.push(EvaluatedCamera::new(sensor, format, plan.settings, &wanted, plan.config)?);
    }
    while let Some((light, _)) = scene.next_light() {
        let mut colored = None;
        for (camera, format) in cameras.iter_mut().zip(&formats) {
            let own = camera.expose(&light, colored.as_ref());
            let own = own.map_err(|error| plan.config.does_not_fit("simulated frames", "[layout]", error))?;
            if *format == Format::Rgb24 {
                colored = Some(own);
            }
        }
        if cameras.iter().all(EvaluatedCamera::is_done) {
            break;
        }
    }
    let touch = scene.truth().first().map_or(0.0, |truth| truth.start);
    let specimen = slide.specimen.to_string();
    let (pattern, depth_mm) = pattern_and_depth(&specimen);
    let truth = Texture { specimen: Some(specimen), pattern, depth_mm, ..Texture::default() };
    let mut outcomes = vec![None; plan.settings.len()];
    for stream in cameras.into_iter().flat_map(EvaluatedCamera::into_streams) {
        let answer = |event: FirstEvent| Answer {
            lead: event.frame as f64 - touch,
            frames: event.frames,
            speed: event.speed,
            direction: event.degrees.is_some_and(|degrees| off(degrees, slide.heading.degrees().into()) <= NEAR),
            is_right: event.is_reliable && is_right(&event, slide),
            right: plan
                .models
                .iter()
                .zip(models)
                .map(|(candidate, model)| match event.class(model) {
                    Some(class) => candidate.judge(class, &truth),
                    None => [None; 3],
                })
                .collect(),
        };
        if let Some(outcome) = outcomes.get_mut(stream.place) {
            let early = stream.early.into_iter().map(|(frames, event)| (frames, answer(event))).collect();
            *outcome = Some(Outcome { event: stream.first.map(answer), early, error: stream.error });
        }
    }
    Ok(outcomes)
}

/// Degrees up to which a direction is right.
const NEAR: f64 = 5.0;

/// Returns by how many degrees a direction is off.
fn off(degrees: f32, truth: f64) -> f64 {
    ((f64::from(degrees) - truth + 180.0).rem_euclid(360.0) - 180.0).abs()
}

/// Returns whether speed and direction are off by at most 10 % and 10°.
fn is_right(event: &FirstEvent, slide: &TradeSlide) -> bool {
    let own = (f64::from(slide.speed_mm_s), f64::from(slide.heading.degrees()));
    let (mm_s, degrees) = slide.object.map_or(own, |object| (object.speed_mm_s, object.direction_deg));
    let is_speed = event.speed.is_some_and(|speed| (f64::from(speed) / mm_s - 1.0).abs() <= 0.1);
    is_speed && event.degrees.is_some_and(|found| off(found, degrees) <= 10.0)
}

/// Returns `true` if a camera sees a slide.
///
/// JPEG takes as long as all else together, so it runs only a quick look's slides.
fn is_run(format: Format, slide: &TradeSlide) -> bool {
    format != Format::Mjpeg || slide.number < QUICK_SLIDES
}

/// Returns one format for each camera that these settings need; the colored reference comes before those it judges.
fn formats_read(settings: &[Setting]) -> impl Iterator<Item = Format> + '_ {
    let is_wanted = |format: &Format| {
        let read = settings.iter().any(|setting| setting.format.code() == format.code());
        let judges = *format == Format::Rgb24 && settings.iter().any(|setting| setting.format.is_colored());
        // Both methods of YUYV read the same camera.
        (read || judges) && *format != Format::YuyvLinear
    };
    Format::ALL.into_iter().filter(is_wanted)
}
