//! The moments that were copied, so that none is copied twice.

use std::collections::HashMap;

/// Most moments that are known by their places: beyond, every second of those that are known is forgotten.
const MOST_KNOWN: usize = 1 << 17;

#[derive(Debug)]
pub(super) struct Copied {
    /// The checksums of moments, by their places and whether they have frames.
    known: HashMap<(u64, bool), Option<u32>>,
    /// Of the moments before `forgotten`, those are known whose places are multiples of `step`.
    step: u64,
    forgotten: u64,
    /// Whether the last moment of a known place was a copy.
    was_copy: bool,
}

impl Default for Copied {
    fn default() -> Self {
        Self { known: HashMap::new(), step: 1, forgotten: 0, was_copy: true }
    }
}

impl Copied {
    pub(super) fn add(&mut self, key: (u64, bool), crc: Option<u32>) {
        while self.known.len() >= MOST_KNOWN {
            self.step = self.step.saturating_mul(2);
            self.known.retain(|(place, _), _| place.is_multiple_of(self.step));
            self.forgotten = key.0;
        }
        self.known.insert(key, crc);
    }

    /// Returns whether a moment is a copy of the one of its place; `None` if none was copied there. A place that was
    /// forgotten is taken to be like the last one that is known.
    pub(super) fn is_copy(&mut self, key: (u64, bool), crc: Option<u32>) -> Option<bool> {
        let Some(known) = self.known.get(&key) else {
            let is_forgotten = key.0 < self.forgotten && !key.0.is_multiple_of(self.step);
            return is_forgotten.then_some(self.was_copy);
        };
        self.was_copy = *known == crc;
        Some(self.was_copy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_hours_take_little_memory() {
        let (mut copied, all) = (Copied::default(), 5 * MOST_KNOWN as u64);
        for place in 1..=all {
            copied.add((place, true), Some(place as u32));
            assert!(copied.known.len() <= MOST_KNOWN);
            // The last moment may come once more, also without a frame.
            assert_eq!(copied.is_copy((place, true), Some(place as u32)), Some(true), "{place}");
            assert_eq!(copied.is_copy((place, false), Some(0)), None, "{place}");
        }
        let copies = |copied: &mut Copied, other: u32| {
            (1..=all).filter(|&place| copied.is_copy((place, true), Some(place as u32 + other)) == Some(true)).count()
        };
        assert_eq!(copies(&mut copied, 0), all as usize);
        // Another recording is known from the first place on that was kept.
        assert_eq!(copies(&mut copied, 1), copied.step as usize - 1);
        assert_eq!(copied.is_copy((all + 1, true), None), None);
    }
}
