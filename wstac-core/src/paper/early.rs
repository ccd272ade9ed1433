//! The beginning of a sample before the rest of it has arrived, for texture models that need no more (SPEC §6).

use crate::paper::sample::Sample;
use crate::paper::trigger::TriggerState;
use crate::params::{FEATURES, SAMPLE_FRAMES};

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
