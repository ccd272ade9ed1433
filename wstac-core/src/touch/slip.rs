//! The slip of a part that is pressed on and held: it moves, and no edge arrives (SPEC §9, "Slip").

use crate::params::TAXELS;
use crate::pipeline::Update;
use crate::rate::FrameRate;

/// A slip: a held part has begun to move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Slip {
    /// The number of the frame of the alarm: the newest one.
    pub frame: u64,
    /// The number of the first frame with light of the motion.
    pub onset_frame: u64,
    /// The number of the first frame with light of the press, or, after a slip, of the rest behind it.
    pub held_since_frame: u64,
    /// The most light of a frame since the onset, as a fraction of the press's brightest frame: above 0.
    pub strength: f32,
}

impl Slip {
    /// Creates a slip.
    pub const fn new(frame: u64, onset_frame: u64, held_since_frame: u64, strength: f32) -> Self {
        Self { frame, onset_frame, held_since_frame, strength }
    }
}

/// Watches for a press, and then for the slip of what is held.
#[derive(Clone, Copy, Debug)]
pub struct SlipDetector {
    next: u64,
    held_since: Option<u64>,
}

impl SlipDetector {
    /// Creates the state before the first frame, for a camera's frame rate.
    pub const fn new(rate: FrameRate) -> Self {
        let _ = rate;
        Self { next: 0, held_since: None }
    }

    /// Takes the feature frame that a push completed, if it did. Returns the slip that this frame shows.
    ///
    /// It needs a pipeline that keeps taxels ([`PipelineBuilder::taxels`](crate::pipeline::PipelineBuilder::taxels)).
    pub fn push(&mut self, update: &Update<'_>) -> Option<Slip> {
        let (frame, taxels) = update.newest_taxels()?;
        self.push_taxels(frame, taxels)
    }

    /// Takes the taxels of the feature frame of a number, in the unit of
    /// [`TaxelRing::frames`](crate::touch::taxel_ring::TaxelRing::frames). Returns the slip that this frame shows.
    ///
    /// Numbers that are left out are lost frames. A frame that does not follow the last one is ignored.
    pub fn push_taxels(&mut self, frame: u64, taxels: &[u16; TAXELS]) -> Option<Slip> {
        let _ = taxels;
        if frame < self.next {
            return None;
        }
        self.next = frame.saturating_add(1);
        None
    }

    /// Returns the number of the first frame with light of the press, while something is held.
    pub const fn held_since_frame(&self) -> Option<u64> {
        self.held_since
    }
}
