//! The beginning of a sample, before the rest of it has arrived: for texture models that need no more (SPEC §6).

use crate::baseline_policy::BaselinePolicy;
use crate::params::{FEATURES, SAMPLE_FRAMES};
use crate::sample::Sample;
use crate::trigger::{Trigger, TriggerState};

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

/// Returns the first `frames` frames of the sample under way if the last of them came after the first `before`.
pub(crate) fn prefix(trigger: &TriggerState, before: u8, frames: u8) -> Option<SamplePrefix<'_>> {
    let so_far = trigger.under_way()?;
    let wanted = frames.max(1);
    if wanted <= before || wanted > so_far.frames {
        return None;
    }
    Some(SamplePrefix { frame: so_far.frame, first: trigger.last(so_far.frames).first(usize::from(frames)) })
}

/// Gives the beginning of every sample of a [`Trigger`], once. A [`Pipeline`](crate::pipeline::Pipeline) needs none:
/// [`Update::prefix`](crate::pipeline::Update::prefix) gives beginnings of any length.
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
    pub fn take<'a, B: BaselinePolicy>(&mut self, from: &'a Trigger<B>) -> Option<SamplePrefix<'a>> {
        let (so_far, sample) = from.captured()?;
        if so_far.frames < self.frames || self.given == Some(so_far.frame) {
            return None;
        }
        self.given = Some(so_far.frame);
        Some(SamplePrefix { frame: so_far.frame, first: sample.first(usize::from(self.frames)) })
    }
}
