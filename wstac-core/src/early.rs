//! The beginning of a sample before the rest of it has arrived, for texture models that need no more (SPEC §6).

use crate::baseline_policy::BaselinePolicy;
use crate::params::{FEATURES, SAMPLE_FRAMES};
use crate::sample::Sample;
use crate::trigger::{Trigger, TriggerState};

/// The first frames of a sample that is still being captured.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct SamplePrefix<'a> {
    /// The number of the sample's first frame, and of the event that follows unless a long gap interrupts the sample.
    pub frame: u64,
    first: Sample<'a>,
}

impl SamplePrefix<'_> {
    /// Returns the frames, then zeros, in the order of [`Sample::flat`]. A model that needs no more frames gives the
    /// same answer for it as for the whole sample.
    pub fn flat(&self) -> [i16; FEATURES * SAMPLE_FRAMES] {
        self.first.flat()
    }

    /// Copies the frames to memory that holds zeros, as [`Sample::copy_to`] does.
    pub fn copy_to(&self, flat: &mut [i16; FEATURES * SAMPLE_FRAMES]) {
        self.first.copy_to(flat);
    }
}

/// Returns the first `frames` frames of the sample under way, if the last of them came after the first `before`.
pub(crate) fn prefix(trigger: &TriggerState, before: u8, frames: u8) -> Option<SamplePrefix<'_>> {
    let so_far = trigger.under_way()?;
    let wanted = frames.max(1);
    if wanted <= before || wanted > so_far.frames {
        return None;
    }
    Some(SamplePrefix { frame: so_far.frame, first: trigger.last(so_far.frames).first(usize::from(frames)) })
}

/// Returns the beginning of every sample of a [`Trigger`] once. A [`Pipeline`](crate::pipeline::Pipeline) does not need
/// it: [`Update::prefix`](crate::pipeline::Update::prefix) returns beginnings of any length.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EarlySampler {
    frames: u8,
    /// The first frame of the sample that was given last.
    given: Option<u64>,
}

impl EarlySampler {
    /// Creates a sampler for beginnings of `frames` frames.
    ///
    /// By default the trigger fires when 15 frames of a sample have arrived (its backtrack and a window). A shorter
    /// beginning is returned then. A beginning of 70 or more frames is a whole sample and is never returned.
    pub const fn new(frames: u8) -> Self {
        Self { frames, given: None }
    }

    /// Returns the beginning of the sample that is being captured, if it has just become long enough.
    ///
    /// Call it after every frame that completes no event. Lost frames are filled, so the sample may be longer by then.
    pub fn take<'a, B: BaselinePolicy>(&mut self, from: &'a Trigger<B>) -> Option<SamplePrefix<'a>> {
        let (so_far, sample) = from.captured()?;
        if so_far.frames < self.frames || self.given == Some(so_far.frame) {
            return None;
        }
        self.given = Some(so_far.frame);
        Some(SamplePrefix { frame: so_far.frame, first: sample.first(usize::from(self.frames)) })
    }
}
