//! The sample X: ten features over 70 frames, borrowed from the ring that they were captured in.

use crate::features::Features;
use crate::params::{FEATURES, SAMPLE_FRAMES};

/// A borrowed 10 × 70 view: frame by frame in the order of time, in units of 2^-11.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample<'a> {
    /// The ring's older part, then its newer one.
    parts: (&'a [Features], &'a [Features]),
}

impl<'a> Sample<'a> {
    pub(crate) fn new(parts: (&'a [Features], &'a [Features])) -> Self {
        Self { parts }
    }

    /// A sample of frames in the order of time, as a recording or a data set holds it.
    pub fn from_frames(frames: &'a [Features; SAMPLE_FRAMES]) -> Self {
        Self { parts: (frames, &[]) }
    }

    /// Its frames in the order of time: 70 times ten features.
    pub fn frames(&self) -> impl Iterator<Item = &'a Features> + Clone + use<'a> {
        self.parts.0.iter().chain(self.parts.1)
    }

    /// All of it, frame by frame: feature k of frame t is number 10 t + k. What texture models take.
    pub fn flat(&self) -> [i16; FEATURES * SAMPLE_FRAMES] {
        let mut flat = [0; FEATURES * SAMPLE_FRAMES];
        self.copy_to(&mut flat);
        flat
    }

    /// [`Sample::flat`] into memory that is there already, where 1,400 bytes of stack count. Numbers of frames that are not there
    /// stay as they are.
    pub fn copy_to(&self, flat: &mut [i16; FEATURES * SAMPLE_FRAMES]) {
        let (older, newer) = self.parts;
        let room = flat.as_chunks_mut::<FEATURES>().0;
        // Part by part: frame by frame would be 70 small copies, which take a Cortex-M 15,000 instructions.
        if let Some((first, rest)) = room.split_at_mut_checked(older.len()) {
            copy(older, first);
            if let Some((second, _)) = rest.split_at_mut_checked(newer.len()) {
                copy(newer, second);
            }
        }
    }

    /// The last `frames` frames.
    pub(crate) fn last(parts: (&'a [Features], &'a [Features]), frames: usize) -> Self {
        let (older, newer) = parts;
        let last = |part: &'a [Features], frames| {
            part.split_at_checked(part.len().saturating_sub(frames)).unwrap_or_default().1
        };
        Self { parts: (last(older, frames.saturating_sub(newer.len())), last(newer, frames)) }
    }

    /// The same without what comes after the first `frames` frames.
    pub(crate) fn first(self, frames: usize) -> Self {
        let (older, newer) = self.parts;
        let first = |part: &'a [Features], frames| part.get(..frames).unwrap_or(part);
        Self { parts: (first(older, frames), first(newer, frames.saturating_sub(older.len()))) }
    }

    /// One feature, 0..10, over the 70 frames; nothing for another number.
    pub fn feature(&self, feature: usize) -> impl Iterator<Item = i16> + Clone + use<'a> {
        self.frames().filter_map(move |frame| frame.get(feature).copied())
    }
}

/// As `copy_from_slice`, but nothing for slices of unlike lengths.
fn copy(from: &[Features], to: &mut [Features]) {
    if from.len() == to.len() {
        to.copy_from_slice(from);
    }
}

/// Its frames in the order of time: a sequence of 70 sequences of ten numbers.
#[cfg(feature = "serde")]
impl serde::Serialize for Sample<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeSeq;
        let mut frames = serializer.serialize_seq(Some(SAMPLE_FRAMES))?;
        for frame in self.frames() {
            frames.serialize_element(frame)?;
        }
        frames.end()
    }
}

const _: () = assert!(FEATURES == 10 && SAMPLE_FRAMES == 70);
