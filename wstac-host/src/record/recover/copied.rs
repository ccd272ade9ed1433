//! The moments that were copied, so that none is copied twice.

use std::collections::HashMap;

/// Most moments that are known by their places: beyond, every second of those that are known is forgotten.
const MOST_KNOWN: usize = 1 << 17;

#[derive(Debug, Default)]
pub(super) struct Copied {
    /// The checksums of moments, by their places and whether they have frames.
    known: HashMap<(u64, bool), Option<u32>>,
    /// Before the last of these places, those are known that end with so many zeros.
    zeros: u32,
    last: u64,
    /// The places between which nothing was copied.
    gaps: Vec<(u64, u64)>,
    /// Whether the last moment of a known place was another one.
    was_other: bool,
}

impl Copied {
    pub(super) fn add(&mut self, key: (u64, bool), crc: Option<u32>) {
        if self.last != key.0 && self.last.trailing_zeros() < self.zeros {
            self.known.remove(&(self.last, false));
            self.known.remove(&(self.last, true));
        }
        while self.known.len() >= MOST_KNOWN {
            self.zeros += 1;
            self.known.retain(|(place, _), _| place.trailing_zeros() >= self.zeros);
        }
        let is_gap = key.0 > self.last.saturating_add(1) && self.gaps.len() < MOST_KNOWN;
        self.gaps.extend(is_gap.then_some((self.last, key.0)));
        self.last = key.0;
        self.known.insert(key, crc);
    }

    /// Returns whether a moment is a copy of the one of its place; `None` if none was copied there. A place that was
    /// forgotten is taken to be like the last one that is known.
    pub(super) fn is_copy(&mut self, key: (u64, bool), crc: Option<u32>) -> Option<bool> {
        let gap = self.gaps.get(self.gaps.partition_point(|(_, to)| *to <= key.0));
        let is_missing = gap.is_some_and(|(from, _)| *from < key.0);
        let is_forgotten = !is_missing && key.0 < self.last && key.0.trailing_zeros() < self.zeros;
        let known = self.known.get(&key).map(|known| *known == crc);
        let is_copy = known.or_else(|| is_forgotten.then_some(!self.was_other))?;
        self.was_other = !is_copy;
        Some(is_copy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_hours_take_little_memory() {
        let (mut copied, all) = (Copied::default(), 5 * MOST_KNOWN as u64);
        for place in (1..=all).filter(|place| *place != 1001) {
            copied.add((place, true), Some(0));
            assert!(copied.known.len() <= MOST_KNOWN);
            // The last moment may come once more, and others without a frame.
            assert_eq!(copied.is_copy((place, true), Some(0)), Some(true), "{place}");
            assert_eq!(copied.is_copy((place, false), Some(0)), None, "{place}");
        }
        assert!((1..=all).all(|place| copied.is_copy((place, true), Some(0)) == (place != 1001).then_some(true)));
        // Another recording is known from the first place on that was kept.
        assert_eq!(copied.zeros, 3);
        assert!((8..=1000).all(|place| copied.is_copy((place, true), Some(1)) == Some(false)));
    }
}
