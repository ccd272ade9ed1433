//! The sample that the compiled-in texture model takes, as a type, so that no code of another sample is linked.

use wstac_core::model::file::{INPUTS, Input};
use wstac_core::paper::trigger::Event;
#[cfg(not(feature = "learn"))]
use wstac_core::texture;
use wstac_core::touch::motion::{MotionConfig, Velocity};
use wstac_core::touch::path_sample::PathSample;
#[cfg(not(feature = "learn"))]
use wstac_core::wire::Answers;
use wstac_core::wire::TextureAnswer;

use crate::setup::Kind;

/// The textures that a board names.
#[cfg(feature = "learn")]
pub use crate::learner::Learner as Textures;
/// The textures that a board names.
#[cfg(not(feature = "learn"))]
pub type Textures = TrainedTextures;

/// The textures of the model alone.
#[derive(Clone, Debug, Default)]
#[cfg(not(feature = "learn"))]
pub struct TrainedTextures;

#[cfg(not(feature = "learn"))]
impl TrainedTextures {
    /// Returns whether textures are being learned, which takes whole samples.
    #[inline(always)]
    pub fn are_learned(&self) -> bool {
        false
    }

    /// Looks at an event before its sample.
    #[inline(always)]
    pub fn look(&mut self, _: &Answers<'_>, _: u32) {}

    /// Returns the answer about a sample.
    #[inline(always)]
    pub fn answer(&mut self, numbers: &[i16; INPUTS], model: &'static Kind) -> TextureAnswer<'static> {
        texture::texture(numbers, model).into()
    }

    /// Leaves the event.
    #[inline(always)]
    pub fn leave(&mut self) {}
}

/// A sample that a texture model takes.
pub trait ModelSample {
    /// The sample, as a model file names it.
    const INPUT: Input;
    /// Whether the first frames of a sample are enough for an answer.
    const HAS_PREFIXES: bool;

    /// Returns the model's answer to an event that slides; `None` if the event shows too little for it.
    ///
    /// `velocity` is [`EventLaw::path_velocity`](wstac_core::law::EventLaw::path_velocity).
    fn texture(
        event: &Event<'_>,
        velocity: Option<Velocity>,
        motion: MotionConfig,
        model: &'static Kind,
        textures: &mut Textures,
    ) -> Option<TextureAnswer<'static>>;
}

/// Ten features over 70 frames.
#[derive(Clone, Copy, Debug)]
pub struct OverTime;

impl ModelSample for OverTime {
    const INPUT: Input = Input::Frames;
    const HAS_PREFIXES: bool = true;

    // It is not inlined, so that its copy of the sample does not lie on the stack of the law.
    #[inline(never)]
    fn texture(
        event: &Event<'_>,
        _: Option<Velocity>,
        _: MotionConfig,
        model: &'static Kind,
        textures: &mut Textures,
    ) -> Option<TextureAnswer<'static>> {
        let mut numbers = [0; INPUTS];
        event.sample.copy_to(&mut numbers);
        Some(textures.answer(&numbers, model))
    }
}

/// Light of ten sums along the path of the touch, by the speed and direction of a law of arrival times.
#[derive(Clone, Copy, Debug)]
pub struct AlongPath;

impl ModelSample for AlongPath {
    const INPUT: Input = Input::Path;
    const HAS_PREFIXES: bool = false;

    // It is not inlined for the same reason.
    #[inline(never)]
    fn texture(
        event: &Event<'_>,
        velocity: Option<Velocity>,
        motion: MotionConfig,
        model: &'static Kind,
        textures: &mut Textures,
    ) -> Option<TextureAnswer<'static>> {
        let mut path = PathSample::DARK;
        let is_there = path.fill_from_sums(event, &velocity?, motion, model.frames());
        (is_there && path.covers(model.frames())).then(|| textures.answer(path.numbers(), model))
    }
}

/// Light of 25 taxels along the path of the touch.
#[derive(Clone, Copy, Debug)]
pub struct AlongTaxels;

impl ModelSample for AlongTaxels {
    const INPUT: Input = Input::TaxelPath;
    const HAS_PREFIXES: bool = false;

    // It is not inlined for the same reason.
    #[inline(never)]
    fn texture(
        event: &Event<'_>,
        velocity: Option<Velocity>,
        motion: MotionConfig,
        model: &'static Kind,
        textures: &mut Textures,
    ) -> Option<TextureAnswer<'static>> {
        let mut path = PathSample::DARK;
        let is_there = path.fill_from_touch(event, &velocity?, motion, model.frames());
        (is_there && path.covers(model.frames())).then(|| textures.answer(path.numbers(), model))
    }
}
