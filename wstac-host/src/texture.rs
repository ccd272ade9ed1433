//! Texture models beside a stream, and their answers about samples.

use std::fmt;
use std::sync::Arc;

use serde::Serialize;
use wstac_core::features::FeatureScale;
use wstac_core::law::Answer;
use wstac_core::model::Model;
use wstac_core::model::calibration::CONFIDENCE_ONE;
use wstac_core::model::file::{Input, Task};
use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::paper::trigger::Event;
use wstac_core::pipeline::Update;
use wstac_core::texture::texture;
use wstac_core::touch::motion::{self, MotionConfig, Velocity};
use wstac_core::touch::path_sample::PathSample;

use crate::error::{Error, ErrorKind};
use crate::model_file::{ModelFile, OwnedModel};

/// The answers of texture models about a sample. A field is `None` if no model answers it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Texture {
    /// The specimen, such as `Saw3`.
    pub specimen: Option<String>,
    /// The pattern: `Fla`, `Sin`, `Saw` or `Tri`. It comes from a model of patterns, or else from that of specimens.
    pub pattern: Option<String>,
    /// The depth of the pattern in mm. It comes from a model of depths, or else from that of specimens.
    pub depth_mm: Option<f64>,
    /// The class of a model that distinguishes something else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// The probability that the names are right, 0 to below 1, with five decimals: the lowest of all models that
    /// answer. It is `None` if one of them has no calibration.
    pub confidence: Option<f64>,
    /// Whether the touch is like those of the training; `None` if no model tells. If it is `false` there are no names
    /// and no confidence.
    pub known: Option<bool>,
}

impl Texture {
    /// Creates the answer of a model of this task from a class's name.
    pub fn of(task: Task, label: String) -> Self {
        let mut record = Self::default();
        match task {
            Task::Specimen => {
                (record.pattern, record.depth_mm) = pattern_and_depth(&label);
                record.specimen = Some(label);
            }
            Task::Pattern => record.pattern = Some(label),
            Task::Depth => record.depth_mm = label.parse().ok().filter(|depth: &f64| depth.is_finite()),
            // A task of a later version has no field of its own.
            _ => record.class = Some(label),
        }
        record
    }

    /// Creates the answer of a model from a class's name, with its confidence in units of 2^-15 and whether the touch
    /// is known ([`wstac_core::texture::Texture`]).
    pub fn of_answer(task: Task, label: String, confidence: Option<u16>, known: Option<bool>) -> Self {
        if known == Some(false) {
            return Self { known, ..Self::default() };
        }
        Self { confidence: confidence.map(confidence_of), known, ..Self::of(task, label) }
    }

    /// Merges the answers of several models of these tasks, each of another one; `None` without an answer.
    #[cfg(feature = "board")]
    pub(crate) fn of_all(mut answers: Vec<(Task, Self)>) -> Option<Self> {
        answers.sort_by_key(|(task, _)| rank(*task));
        Self::merged(answers.into_iter().map(|(_, answer)| answer))
    }

    fn merged(records: impl Iterator<Item = Self>) -> Option<Self> {
        let merged = records.reduce(|mut all, one| {
            all.merge(one);
            all
        })?;
        // If one model does not know the texture, it has no names, whatever others say.
        Some(if merged.known == Some(false) { Self { known: merged.known, ..Self::default() } } else { merged })
    }

    /// Takes over the fields that another answer has.
    fn merge(&mut self, other: Self) {
        self.specimen = other.specimen.or(self.specimen.take());
        self.pattern = other.pattern.or(self.pattern.take());
        self.depth_mm = other.depth_mm.or(self.depth_mm);
        self.class = other.class.or(self.class.take());
        self.confidence = self.confidence.zip(other.confidence).map(|(one, other)| one.min(other));
        self.known = match (self.known, other.known) {
            (Some(one), Some(other)) => Some(one && other),
            (one, other) => one.or(other),
        };
    }
}

/// Returns a confidence in units of 2^-15 for output, 0 to below 1, with five decimals.
pub fn confidence_of(units: u16) -> f64 {
    (f64::from(units) / f64::from(CONFIDENCE_ONE) * 1e5).round() / 1e5
}

/// Returns a specimen's pattern and depth in mm by its name: `Saw3` is a `Saw` of 3 mm. A sphere has no depth.
pub fn pattern_and_depth(specimen: &str) -> (Option<String>, Option<f64>) {
    match specimen.split_at_checked(3) {
        Some((pattern, depth)) if depth.parse::<f64>().is_ok_and(f64::is_finite) => {
            (Some(pattern.to_owned()), depth.parse().ok())
        }
        _ => (Some(specimen.to_owned()), None),
    }
}

/// Returns the order in which answers are taken over. Specimens come first, because models of patterns and depths know
/// better.
fn rank(task: Task) -> u8 {
    match task {
        Task::Specimen => 1,
        Task::Pattern => 2,
        Task::Depth => 3,
        _ => 0,
    }
}

/// Texture models, each of another task. Clones share the models.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    models: Vec<Arc<OwnedModel>>,
    /// The names of the models.
    names: Arc<[String]>,
}

impl Textures {
    /// Creates the models of these files.
    ///
    /// # Errors
    /// A file is no model, or two models have the same task.
    pub fn new(files: &[ModelFile]) -> Result<Self, Error> {
        let mut models: Vec<(Arc<OwnedModel>, &ModelFile)> = Vec::with_capacity(files.len());
        for file in files {
            let model = file.owned()?;
            let (task, input) = (model.get().task(), model.get().input());
            if !matches!(input, Input::Frames | Input::Path | Input::TaxelPath | Input::Taxels) {
                let message =
                    format_args!("takes the input {}, expected frames, path, taxel_path or taxels", input.name());
                return Err(Error::new(ErrorKind::Unsupported, file.about(), message));
            }
            if let Some((_, other)) = models.iter().find(|(other, _)| other.get().task() == task) {
                let (other, task) = (other.about(), task.name());
                let message = format_args!("tells apart the same as {other}: {task}, expected one model of each");
                return Err(Error::new(ErrorKind::Usage, file.about(), message));
            }
            models.push((model, file));
        }
        models.sort_by_key(|(model, _)| rank(model.get().task()));
        let names = files.iter().map(|file| file.about().to_owned()).collect();
        Ok(Self { models: models.into_iter().map(|(model, _)| model).collect(), names })
    }

    /// Returns the names of the models' files, as recordings keep them.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns whether a model takes 25 taxels. Then the pipeline must keep them
    /// ([`Pipeline::keep_taxels`](wstac_core::pipeline::Pipeline::keep_taxels)).
    pub fn needs_taxels(&self) -> bool {
        self.models.iter().any(|model| matches!(model.get().input(), Input::TaxelPath | Input::Taxels))
    }

    /// Returns whether all models take 25 taxels along the path, so that they can answer before a sample is complete.
    pub(crate) fn answer_at_once(&self) -> bool {
        self.models.iter().all(|model| model.get().input() == Input::TaxelPath)
    }

    /// Returns whether a model needs more of the path of a touch under way than has arrived.
    pub(crate) fn lack_path(&self, touch: &Event<'_>, answer: &Answer, config: MotionConfig) -> bool {
        let Some(velocity) = answer.velocity().filter(|_| touch.taxels().is_some()) else { return false };
        self.models.iter().map(|model| model.get().frames()).any(|frames| {
            let path = PathSample::of_touch(touch, &velocity, config, frames);
            path.is_none_or(|path| !path.covers(frames))
        })
    }

    /// Returns the answer of all models to an event, or a touch under way, of this answer.
    ///
    /// A model that takes the sample along the path needs the velocity. If the law does not give one, it is computed by
    /// coherence with the parameters `config`. `scale` is that of the features.
    ///
    /// # Errors
    /// There is no model, the touch is no slide, or no model can answer. The reason is then that of the first model.
    pub fn of_event(
        &self,
        event: &Event<'_>,
        answer: &Answer,
        config: MotionConfig,
        scale: &FeatureScale,
    ) -> Result<Texture, NoTexture> {
        if self.models.is_empty() {
            return Err(NoTexture::NoModel);
        }
        if !answer.has_texture() {
            return Err(NoTexture::NoSlide);
        }
        let needs_path = self.models.iter().any(|model| model.get().input().steps().is_some());
        let by_law = || answer.velocity().or_else(|| motion::by_coherence(event, config).velocity);
        // By a law of durations, models over time answer without a velocity.
        let velocity = if needs_path || answer.contact.is_some() { by_law() } else { answer.velocity() };
        let answer_of = |model: &Model| {
            let frames = model.frames();
            let is_excluded = excluding(model, velocity).is_some();
            let path = match model.input() {
                Input::Frames => return Ok(named(model, &event.sample.flat(), is_excluded)),
                Input::Path => velocity.and_then(|velocity| PathSample::of_sums(event, &velocity, config, frames)),
                Input::Taxels => {
                    let light = event.taxels().ok_or(NoTexture::LostFrames)?.numbers(scale);
                    return Ok(named(model, &light, is_excluded));
                }
                // [`Self::new`] takes no other input than that of 25 taxels.
                _ => velocity.and_then(|velocity| PathSample::of_touch(event, &velocity, config, frames)),
            };
            if velocity.is_none() {
                return Err(NoTexture::NoSpeed);
            }
            let has_lost = model.input() == Input::TaxelPath && event.whole_taxels().is_none();
            let reason = if has_lost { NoTexture::LostFrames } else { NoTexture::TooShort };
            let path = path.filter(|path| path.covers(frames)).ok_or(reason)?;
            Ok(named(model, path.numbers(), is_excluded))
        };
        let answers: Vec<_> = self.models.iter().map(|model| answer_of(model.get())).collect();
        let reason = answers.iter().find_map(|answer| answer.as_ref().err().copied());
        Texture::merged(answers.into_iter().flatten()).ok_or(reason.unwrap_or(NoTexture::TooShort))
    }

    /// Returns the speeds that a model knows, if the speed of this answer is none of them: then the texture is unknown.
    pub(crate) fn doubt(&self, texture: &Result<Texture, NoTexture>, answer: &Answer) -> Option<KnownSpeeds> {
        let texture = texture.as_ref().ok()?;
        let excluding = self.models.iter().find_map(|model| excluding(model.get(), answer.velocity()));
        excluding.filter(|_| texture.known == Some(false))
    }

    /// Returns the answers of the models for which enough of the sample under way has just arrived.
    ///
    /// An answer comes with the number of the sample's first frame and with the number of frames that the model reads.
    /// A model that takes the sample along the path answers events only.
    pub fn of_prefixes(&self, update: &Update<'_>) -> Vec<(u64, u8, Texture)> {
        let over_time = self.models.iter().filter(|model| model.get().input() == Input::Frames);
        let answers = over_time.filter_map(|model| {
            let frames = model.get().frames();
            let prefix = update.prefix(frames)?;
            Some((prefix.frame, frames, named(model.get(), &prefix.flat(), false)))
        });
        answers.collect()
    }
}

/// The reason why an event has no texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoTexture {
    /// No model was given, or the board has none.
    NoModel,
    /// The touch is no slide.
    NoSlide,
    /// The model needs the speed, which is not known.
    NoSpeed,
    /// The sample shows too little of the path for the models: the slide is too slow.
    TooShort,
    /// The model takes 25 taxels, frames of the sample were lost, and the rest shows too little of the path.
    LostFrames,
    /// The board has a model, which gave no answer. The board does not say why.
    Unanswered,
}

impl NoTexture {
    /// Returns the reason as a sentence. JSON output and `Display` use this sentence.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::NoModel => "no model was given",
            Self::NoSlide => "the touch is not a slide",
            Self::NoSpeed => "the speed is not known, and the model needs it",
            Self::TooShort => "the sample shows too little of the path for the model",
            Self::LostFrames => {
                "frames of the sample were lost, and the rest shows too little of the path for the model"
            }
            Self::Unanswered => "the board's model has no answer: too little of the path, or lost frames",
        }
    }
}

impl fmt::Display for NoTexture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl std::error::Error for NoTexture {}

/// Returns the speeds that a model knows, if it was not trained at this velocity.
fn excluding(model: &Model, velocity: Option<Velocity>) -> Option<KnownSpeeds> {
    model.known_speeds().filter(|speeds| speeds.exclude(velocity))
}

/// Returns a model's answer; at a speed that it excludes, none is known.
fn named<const N: usize>(model: &Model, sample: &[i16; N], is_excluded: bool) -> Texture {
    let texture = texture(sample, model);
    let known = if is_excluded { Some(false) } else { texture.known };
    Texture::of_answer(texture.task, texture.label.to_string(), texture.confidence, known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_several_models_are_as_sure_as_the_least_sure() {
        let of = |task, label: &str, confidence, known| Texture::of_answer(task, label.into(), confidence, known);
        let specimen = of(Task::Specimen, "Saw3", Some(32_767), Some(true));
        assert_eq!((specimen.confidence, specimen.known), (Some(0.99997), Some(true)));
        let both = Texture::merged([specimen.clone(), of(Task::Depth, "2", Some(16_384), None)].into_iter()).unwrap();
        let expected = Texture { depth_mm: Some(2.0), confidence: Some(0.5), ..specimen.clone() };
        assert_eq!(both, expected);
        let with_plain = Texture::merged([specimen.clone(), Texture::of(Task::Depth, "2".into())].into_iter()).unwrap();
        assert_eq!((with_plain.confidence, with_plain.known), (None, Some(true)));
        let unknown = of(Task::Pattern, "Saw", Some(9), Some(false));
        let nothing = Texture { known: Some(false), ..Texture::default() };
        assert_eq!(unknown, nothing);
        assert_eq!(Texture::merged([specimen, unknown].into_iter()), Some(nothing));
    }

    #[test]
    fn specimens_by_name() {
        let found = |name| pattern_and_depth(name);
        assert_eq!(found("Saw3"), (Some("Saw".into()), Some(3.0)));
        assert_eq!(found("Fla0"), (Some("Fla".into()), Some(0.0)));
        assert_eq!(found("Tri2.5"), (Some("Tri".into()), Some(2.5)));
        for name in ["Sphere", "Saw", "Sawinf", "é", ""] {
            assert_eq!(found(name), (Some(name.into()), None));
        }
    }
}
