//! The beginning of a sample, before the rest of it has arrived: for texture models that need no more (SPEC §6).

use crate::baseline_policy::BaselinePolicy;
use crate::green::GreenChannel;
use crate::ln::Ln;
use crate::params::{FEATURES, SAMPLE_FRAMES};
use crate::pipeline::Pipeline;
use crate::sample::Sample;
use crate::trigger::Trigger;

/// The first frames of a sample that is still being captured.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SamplePrefix<'a> {
    /// Number of the first frame of the sample: that of the event that follows, unless a long gap interrupts it.
    pub frame: u64,
    first: Sample<'a>,
}

impl SamplePrefix<'_> {
    /// Its frames, then zeros: as [`Sample::flat`]. A model that needs no more frames answers as it will on the whole
    /// sample.
    pub fn flat(&self) -> [i16; FEATURES * SAMPLE_FRAMES] {
        self.first.flat()
    }

    /// [`SamplePrefix::flat`] into memory that is there already and holds zeros: as [`Sample::copy_to`].
    pub fn copy_to(&self, flat: &mut [i16; FEATURES * SAMPLE_FRAMES]) {
        self.first.copy_to(flat);
    }
}

/// Gives the beginning of every sample, once.
///
/// ```
/// use wstac_core::{early::EarlySampler, green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline};
/// use wstac_core::{rate::FrameRate, taxels::FrameGeometry, trigger::TriggerConfig};
///
/// let camera = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
/// let mut pipeline: Pipeline = Pipeline::new(camera, 0.5, TriggerConfig::default())?;
/// let mut early = EarlySampler::new(20); // such as the frames of a model
/// # let frames = (0..120).map(|t| vec![if t == 40 { 200 } else { 3_u8 }; 160_000]);
/// # let mut given = Vec::new();
/// for (number, frame) in frames.enumerate() {
///     if let Some(event) = pipeline.push_frame(&frame)? {
///         // The whole sample: speed, direction.
///     } else if let Some(beginning) = early.take(&pipeline) {
///         // The first 20 frames of it: model.classify(&beginning.flat()).
/// #       given.push((number, beginning.frame));
///     }
/// }
/// # assert_eq!(given, [(49, 30)]);
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EarlySampler {
    frames: u8,
    /// The sample that was given last, by its first frame.
    given: Option<u64>,
}

impl EarlySampler {
    /// For beginnings of `frames` frames. By default the trigger fires when 15 have arrived (its backtrack and a window): a
    /// beginning of fewer is given then. One of 70 or more is a whole sample, and never given.
    pub const fn new(frames: u8) -> Self {
        Self { frames, given: None }
    }

    /// The beginning of the sample that is being captured, if it has just become long enough: call it after every frame that
    /// completes no event. Lost frames are filled, so the sample may be longer by then.
    pub fn take<'a, B: BaselinePolicy + 'a>(&mut self, from: impl Into<&'a Trigger<B>>) -> Option<SamplePrefix<'a>> {
        let (so_far, sample) = from.into().captured()?;
        if so_far.frames < self.frames || self.given == Some(so_far.frame) {
            return None;
        }
        self.given = Some(so_far.frame);
        Some(SamplePrefix { frame: so_far.frame, first: sample.first(usize::from(self.frames)) })
    }
}

impl<'a, G: GreenChannel, L: Ln, B: BaselinePolicy> From<&'a Pipeline<G, L, B>> for &'a Trigger<B> {
    fn from(pipeline: &'a Pipeline<G, L, B>) -> Self {
        pipeline.trigger()
    }
}
