//! The last 70 frames of features: written once a frame, read in order once an event.

use crate::features::Features;
use crate::params::{FEATURES, SAMPLE_FRAMES};

/// A ring of as many frames as a sample has.
///
/// Its own, not a library's: no index is taken on trust, so that no panic is left in a release build, and an
/// index that cannot be reads nothing.
#[derive(Clone, Debug)]
pub(crate) struct Ring {
    frames: [Features; SAMPLE_FRAMES],
    /// Where the next frame is written: at the oldest.
    next: u8,
    is_empty: bool,
}

impl Ring {
    pub(crate) const fn new() -> Self {
        Self { frames: [[0; FEATURES]; SAMPLE_FRAMES], next: 0, is_empty: true }
    }

    /// Writes a frame over the oldest.
    pub(crate) fn write(&mut self, features: Features) {
        if let Some(oldest) = self.frames.get_mut(usize::from(self.next)) {
            *oldest = features;
        }
        self.next = if usize::from(self.next) + 1 < SAMPLE_FRAMES { self.next + 1 } else { 0 };
        self.is_empty = false;
    }

    /// Whether no frame has been written.
    pub(crate) const fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// The newest frame.
    pub(crate) fn newest(&self) -> Option<&Features> {
        let newest = self.next.checked_sub(1).unwrap_or(SAMPLE_FRAMES as u8 - 1);
        self.frames.get(usize::from(newest)).filter(|_| !self.is_empty)
    }

    /// All 70 frames, the older part, then the newer; what was never written is 0.
    pub(crate) fn parts(&self) -> (&[Features], &[Features]) {
        let (newer, older) = self.frames.split_at_checked(usize::from(self.next)).unwrap_or((&self.frames, &[]));
        (older, newer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_last_frames_in_order() {
        let mut ring = Ring::new();
        assert!(ring.is_empty() && ring.newest().is_none());
        for frame in 0..200 {
            ring.write([frame; FEATURES]);
            assert!(!ring.is_empty());
            assert_eq!(ring.newest(), Some(&[frame; FEATURES]));
            let (older, newer) = ring.parts();
            let order = older.iter().chain(newer).map(|features| features[0]);
            let expected = (frame - 69..=frame).map(|number| number.max(0));
            assert!(order.eq(expected), "after frame {frame}");
        }
    }
}
