//! A sample put together of its parts.

use wstac_core::features::Features;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::wire::SAMPLE_PART;

/// The parts of one sample that have arrived.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    /// Number of the sample's first frame.
    frame: u64,
    frames: [Features; SAMPLE_FRAMES],
    arrived: [bool; SAMPLE_FRAMES / SAMPLE_PART],
}

impl Default for Parts {
    fn default() -> Self {
        Self { frame: 0, frames: [[0; FEATURES]; SAMPLE_FRAMES], arrived: [false; SAMPLE_FRAMES / SAMPLE_PART] }
    }
}

impl Parts {
    /// Takes the part of the sample at `frame` that starts with its frame `first`; what is no part is passed over.
    pub(super) fn take(&mut self, frame: u64, first: u8, part: &[Features; SAMPLE_PART]) {
        if frame != self.frame {
            *self = Self { frame, ..Self::default() };
        }
        let number = usize::from(first) / SAMPLE_PART;
        let places = self.frames.as_chunks_mut().0;
        if usize::from(first).is_multiple_of(SAMPLE_PART)
            && let (Some(place), Some(arrived)) = (places.get_mut(number), self.arrived.get_mut(number))
        {
            *place = *part;
            *arrived = true;
        }
    }

    /// The sample at `frame`, if all of it has arrived.
    pub(super) fn of(&self, frame: u64) -> Option<&[Features; SAMPLE_FRAMES]> {
        (frame == self.frame && self.arrived.iter().all(|&arrived| arrived)).then_some(&self.frames)
    }
}
