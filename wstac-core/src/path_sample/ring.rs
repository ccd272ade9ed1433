//! Light of 25 taxels over the frames of a sample.

use super::resample::Light;
use crate::green::GreenChannel;
use crate::params::{SAMPLE_FRAMES, TAXELS};
use crate::taxels::FrameGeometry;

/// Frames at the start of a sample that count as dark, and their logarithm.
const DARK_FRAMES: usize = 4;
const DARK_SHIFT: u32 = 2;

/// The last 70 frames of 25 taxels: 3,500 bytes, for a program whose model needs them.
#[derive(Clone, Debug)]
pub struct TaxelRing {
    frames: [[u16; TAXELS]; SAMPLE_FRAMES],
    /// The place of the oldest frame, which the next one replaces.
    oldest: u8,
    /// Bits of a sum that a frame has no room for.
    shift: u8,
}

impl TaxelRing {
    /// Creates a dark ring for sums of at most `full_scale`.
    pub const fn new(full_scale: u32) -> Self {
        let bits = u32::BITS - full_scale.leading_zeros();
        let shift = bits.saturating_sub(u16::BITS) as u8;
        Self { frames: [[0; TAXELS]; SAMPLE_FRAMES], oldest: 0, shift }
    }

    /// Creates a dark ring for the sums of this geometry, over the camera frames that one feature frame adds up.
    pub fn of<G: GreenChannel>(geometry: &FrameGeometry<G>) -> Self {
        let frames = geometry.rate().frames_added();
        Self::new(geometry.pixels().saturating_mul(geometry.full_scale()).saturating_mul(frames))
    }

    /// Adds a frame's sums in place of the oldest frame's.
    pub fn push(&mut self, sums: &[u32; TAXELS]) {
        let place = usize::from(self.oldest);
        if let Some(frame) = self.frames.get_mut(place) {
            *frame = sums.map(|sum| (sum >> (self.shift & 31)).min(u16::MAX.into()) as u16);
        }
        self.oldest = if place + 1 < SAMPLE_FRAMES { self.oldest + 1 } else { 0 };
    }

    /// Adds lost frames, each equal to the last one.
    pub fn fill(&mut self, lost: u32) {
        for _ in 0..lost.min(SAMPLE_FRAMES as u32) {
            let last = self.frame(SAMPLE_FRAMES - 1);
            if let Some(frame) = self.frames.get_mut(usize::from(self.oldest)) {
                *frame = last;
            }
            self.oldest = if usize::from(self.oldest) + 1 < SAMPLE_FRAMES { self.oldest + 1 } else { 0 };
        }
    }

    /// Returns a frame by its age: 0 is the oldest, 69 the last one.
    fn frame(&self, number: usize) -> [u16; TAXELS] {
        self.frames.get(self.place(number)).copied().unwrap_or([0; TAXELS])
    }

    fn place(&self, number: usize) -> usize {
        let place = usize::from(self.oldest) + number;
        if place < SAMPLE_FRAMES { place } else { place - SAMPLE_FRAMES }
    }
}

/// Light of the ring's taxels above what it was in the first frames.
pub(super) struct TaxelLight<'a> {
    ring: &'a TaxelRing,
    dark: [u16; TAXELS],
}

impl<'a> TaxelLight<'a> {
    pub(super) fn new(ring: &'a TaxelRing) -> Self {
        let mut sums = [0_u32; TAXELS];
        for number in 0..DARK_FRAMES {
            for (sum, light) in sums.iter_mut().zip(ring.frame(number)) {
                *sum += u32::from(light);
            }
        }
        Self { ring, dark: sums.map(|sum| ((sum + (1 << (DARK_SHIFT - 1))) >> DARK_SHIFT) as u16) }
    }
}

impl Light for TaxelLight<'_> {
    #[inline(always)]
    fn at(&self, frame: usize, line: usize) -> u16 {
        let light = self.ring.frames.get(self.ring.place(frame)).and_then(|frame| frame.get(line)).copied();
        light.unwrap_or(0).saturating_sub(self.dark.get(line).copied().unwrap_or(0))
    }
}

const _: () = assert!(DARK_FRAMES == 1 << DARK_SHIFT);
