//! The last frames of a stream, in memory of a fixed size.
//!
//! This crate's own, so that a board's program needs no other crate for it: a ring of features alone has no memory that is not
//! initialized, no unsafe code and no branch that panics.

use crate::features::Features;
use crate::params::{FEATURES, SAMPLE_FRAMES};

/// The features of the last 70 frames.
#[derive(Clone, Debug)]
pub(crate) struct Ring {
    frames: [Features; SAMPLE_FRAMES],
    /// Where the next frame goes: the oldest one's place once all are taken.
    next: u8,
    /// Whether all places are taken.
    is_full: bool,
}

impl Ring {
    /// Creates a ring without frames.
    pub(crate) const fn new() -> Self {
        Self { frames: [[0; FEATURES]; SAMPLE_FRAMES], next: 0, is_full: false }
    }

    /// Returns whether no frame has come.
    pub(crate) const fn is_empty(&self) -> bool {
        !self.is_full && self.next == 0
    }

    /// Adds a frame; the oldest one leaves if there is no room.
    pub(crate) fn push(&mut self, features: Features) {
        if let Some(place) = self.frames.get_mut(usize::from(self.next)) {
            *place = features;
        }
        self.next += 1;
        if usize::from(self.next) == SAMPLE_FRAMES {
            self.next = 0;
            self.is_full = true;
        }
    }

    /// Returns the newest frame.
    pub(crate) fn newest(&self) -> Option<&Features> {
        let (older, newer) = self.as_slices();
        newer.last().or(older.last())
    }

    /// Returns the frames in the order of time: the older part, then the newer one.
    pub(crate) fn as_slices(&self) -> (&[Features], &[Features]) {
        let (newer, older) = self.frames.split_at_checked(usize::from(self.next)).unwrap_or_default();
        // Until the ring is full, what lies after the newest frame is empty room.
        if self.is_full { (older, newer) } else { (newer, &[]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_last_frames_come_back_in_order() {
        let mut ring = Ring::new();
        assert!(ring.is_empty());
        assert_eq!((ring.newest(), ring.as_slices()), (None, (&[][..], &[][..])));
        for pushed in 1..=4 * SAMPLE_FRAMES as i16 {
            ring.push([pushed; FEATURES]);
            assert!(!ring.is_empty());
            assert_eq!(ring.newest(), Some(&[pushed; FEATURES]));
            let (older, newer) = ring.as_slices();
            let frames: Vec<i16> = older.iter().chain(newer).map(|frame| frame[9]).collect();
            let expected: Vec<i16> = ((pushed - SAMPLE_FRAMES as i16).max(0) + 1..=pushed).collect();
            assert_eq!(frames, expected);
        }
    }
}
