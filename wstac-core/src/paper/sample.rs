//! The sample X: ten features over 70 frames, borrowed from the ring that captured them.

use crate::features::Features;
use crate::params::{FEATURES, SAMPLE_FRAMES};

/// A borrowed view of ten features over 70 frames, frame by frame in the order of time, in units of 2^-11.
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

    /// Creates a sample of frames in the order of time, as a recording or a data set holds it.
    pub fn from_frames(frames: &'a [Features; SAMPLE_FRAMES]) -> Self {
        Self { parts: (frames, &[]) }
    }

    /// Returns the frames in the order of time: 70 times ten features.
    pub fn frames(&self) -> impl Iterator<Item = &'a Features> + Clone + use<'a> {
        self.parts.0.iter().chain(self.parts.1)
    }

    /// Returns the number of frames: 70, or fewer at the start of a stream.
    pub(crate) fn len(&self) -> usize {
        self.parts.0.len() + self.parts.1.len()
    }

    #[inline(always)]
    /// Returns a frame by its number from the oldest.
    pub(crate) fn frame(&self, index: usize) -> Option<&'a Features> {
        let (older, newer) = self.parts;
        older.get(index).or_else(|| newer.get(index.wrapping_sub(older.len())))
    }

    /// Returns the numbers frame by frame, as texture models take them: feature k of frame t is number 10 t + k.
    pub fn flat(&self) -> [i16; FEATURES * SAMPLE_FRAMES] {
        let mut flat = [0; FEATURES * SAMPLE_FRAMES];
        self.copy_to(&mut flat);
        flat
    }

    /// Copies the numbers of [`Sample::flat`] to memory that is there already, for programs in which 1,400 bytes of
    /// stack matter. Numbers of missing frames stay as they are.
    pub fn copy_to(&self, flat: &mut [i16; FEATURES * SAMPLE_FRAMES]) {
        let (older, newer) = self.parts;
        let room = flat.as_chunks_mut::<FEATURES>().0;
        // The copy is made part by part. Frame by frame it would be 70 small copies, which take a Cortex-M 15,000
        // instructions.
        if let Some((first, rest)) = room.split_at_mut_checked(older.len()) {
            copy(older, first);
            if let Some((second, _)) = rest.split_at_mut_checked(newer.len()) {
                copy(newer, second);
            }
        }
    }

    pub(crate) fn last(parts: (&'a [Features], &'a [Features]), frames: usize) -> Self {
        let (older, newer) = parts;
        let last = |part: &'a [Features], frames| {
            part.split_at_checked(part.len().saturating_sub(frames)).unwrap_or_default().1
        };
        Self { parts: (last(older, frames.saturating_sub(newer.len())), last(newer, frames)) }
    }

    pub(crate) fn first(self, frames: usize) -> Self {
        let (older, newer) = self.parts;
        let first = |part: &'a [Features], frames| part.get(..frames).unwrap_or(part);
        Self { parts: (first(older, frames), first(newer, frames.saturating_sub(older.len()))) }
    }

    /// Returns the frames from a number from the oldest to before another one, as far as there are: of the older part,
    /// then of the newer one.
    pub(crate) fn between(&self, from: usize, to: usize) -> [&'a [Features]; 2] {
        let (older, newer) = self.parts;
        let of_newer = |number: usize| number.saturating_sub(older.len()).min(newer.len());
        let of_older = older.get(from..to.min(older.len())).unwrap_or_default();
        [of_older, newer.get(of_newer(from)..of_newer(to)).unwrap_or_default()]
    }

    /// Returns one feature, 0..10, over the 70 frames. The iterator is empty for another number.
    pub fn feature(&self, feature: usize) -> impl Iterator<Item = i16> + Clone + use<'a> {
        self.frames().filter_map(move |frame| frame.get(feature).copied())
    }
}

/// Copies a slice as `copy_from_slice` does, but does nothing if the lengths differ.
fn copy(from: &[Features], to: &mut [Features]) {
    if from.len() == to.len() {
        to.copy_from_slice(from);
    }
}

/// Serializes the frames in the order of time: a sequence of 70 sequences of ten numbers.
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
