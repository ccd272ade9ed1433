//! Light of 25 taxels over the last frames.

use crate::features::FeatureScale;
use crate::green::GreenChannel;
use crate::ln::Ln;
use crate::params::{SAMPLE_FRAMES, TAXELS};
use crate::taxels::FrameGeometry;
use crate::touch::crosstalk::{Correction, CorrectionSource};

/// Keeps the taxels of a pipeline's last 70 frames, or none.
///
/// A [`Pipeline`](crate::pipeline::Pipeline) has one of these types as its parameter. So a program whose model and law
/// take ten sums has no memory for 25 taxels. A host that chooses at run time uses [`ChosenTaxels`].
pub trait TaxelStore: Sized {
    /// A store before [`TaxelStore::start`]. It is a constant, so that a board makes it in its place, without a copy.
    const EMPTY: Self;

    /// Whether an empty store has to be started. A pipeline without one is returned as it is built: a compiler may copy
    /// what was changed in between.
    const NEEDS_START: bool = true;

    /// Returns the ring, to change it, and the correction of its frames; `None` if there is none.
    fn parts(&mut self) -> (Option<&mut TaxelRing>, Option<&Correction>);

    /// Returns the ring; `None` if taxels are not kept.
    fn ring(&self) -> Option<&TaxelRing>;

    /// Prepares an empty store for the sums of this geometry.
    #[inline(always)]
    fn start<G: GreenChannel>(&mut self, geometry: &FrameGeometry<G>) {
        if let (Some(ring), _) = self.parts() {
            let frames = geometry.rate().frames_added();
            ring.shift = shift_of(geometry.pixels().saturating_mul(geometry.full_scale()).saturating_mul(frames));
        }
    }

    /// Adds the sums of a camera frame. `is_first` says whether it is the first of its feature frame.
    #[inline(always)]
    fn add(&mut self, sums: &[u32; TAXELS], is_first: bool) {
        if let (Some(ring), _) = self.parts() {
            ring.add_sums(sums, is_first);
        }
    }

    /// Ends the feature frame, and corrects it. `has_missing_frames` says whether some of its camera frames were lost.
    #[inline(always)]
    fn complete(&mut self, has_missing_frames: bool) {
        let (Some(ring), correction) = self.parts() else { return };
        if let (Some(correction), Some(frame)) = (correction, ring.frames.get_mut(usize::from(ring.oldest))) {
            *frame = correction.apply(frame);
        }
        ring.advance(has_missing_frames);
    }

    /// Keeps the place of lost feature frames.
    #[inline(always)]
    fn skip(&mut self, frames: u64) {
        if let (Some(ring), _) = self.parts() {
            ring.fill(frames.min(SAMPLE_FRAMES as u64) as u32);
        }
    }

    /// Forgets the frames: those to come do not follow them.
    #[inline(always)]
    fn lose(&mut self) {
        if let (Some(ring), _) = self.parts() {
            ring.lost = ALL_LOST;
        }
    }
}

/// Keeps no taxels.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoTaxels;

impl TaxelStore for NoTaxels {
    const EMPTY: Self = Self;
    const NEEDS_START: bool = false;

    #[inline(always)]
    fn parts(&mut self) -> (Option<&mut TaxelRing>, Option<&Correction>) {
        (None, None)
    }

    #[inline(always)]
    fn ring(&self) -> Option<&TaxelRing> {
        None
    }
}

/// Starts without a ring.
impl TaxelStore for Option<TaxelRing> {
    const EMPTY: Self = None;

    fn parts(&mut self) -> (Option<&mut TaxelRing>, Option<&Correction>) {
        (self.as_mut(), None)
    }

    fn ring(&self) -> Option<&TaxelRing> {
        self.as_ref()
    }
}

/// Corrects the cross-talk in the frames of a store `S` as they are completed, by what `C` holds.
///
/// Features, and whatever follows from them alone, are of the light before this correction.
#[derive(Clone, Debug)]
pub struct Corrected<S, C> {
    pub(crate) store: S,
    pub(crate) correction: C,
}

/// The store of a host: a ring and a correction, each chosen at run time.
pub type ChosenTaxels = Corrected<Option<TaxelRing>, Option<Correction>>;

impl<S: TaxelStore, C: CorrectionSource> TaxelStore for Corrected<S, C> {
    const EMPTY: Self = Self { store: S::EMPTY, correction: C::EMPTY };

    #[inline(always)]
    fn parts(&mut self) -> (Option<&mut TaxelRing>, Option<&Correction>) {
        (self.store.parts().0, self.correction.correction())
    }

    #[inline(always)]
    fn ring(&self) -> Option<&TaxelRing> {
        self.store.ring()
    }
}

/// The last 70 frames of 25 taxels: about 3,500 bytes, for a model of 25 taxels and for [`ByWave`](crate::law::ByWave).
#[derive(Clone, Debug)]
pub struct TaxelRing {
    frames: [[u16; TAXELS]; SAMPLE_FRAMES],
    /// The place of the oldest frame, which the next one replaces.
    oldest: u8,
    /// Bits of a sum that a frame has no room for.
    shift: u8,
    /// A bit a frame, that of the newest the lowest: whether it was lost, in whole or in part, or came before the ring
    /// began.
    lost: u128,
}

/// All frames are lost.
const ALL_LOST: u128 = (1 << SAMPLE_FRAMES) - 1;

#[cfg(feature = "defmt")]
impl defmt::Format for TaxelRing {
    // An event is logged without its light.
    fn format(&self, formatter: defmt::Formatter<'_>) {
        defmt::write!(formatter, "TaxelRing");
    }
}

const MOST_BYTES: usize = 3584;
const _: () = assert!(size_of::<TaxelRing>() <= MOST_BYTES);

/// Returns the bits that a frame has no room for, of sums of at most `full_scale`.
const fn shift_of(full_scale: u32) -> u8 {
    let bits = u32::BITS - full_scale.leading_zeros();
    bits.saturating_sub(u16::BITS) as u8
}

impl TaxelRing {
    /// Creates a dark ring for sums of at most `full_scale`.
    pub const fn new(full_scale: u32) -> Self {
        Self { shift: shift_of(full_scale), ..Self::EMPTY }
    }

    /// Creates a dark ring for the sums of this geometry, over the camera frames that one feature frame adds up.
    pub fn of<G: GreenChannel>(geometry: &FrameGeometry<G>) -> Self {
        let mut ring = Self::EMPTY;
        ring.start(geometry);
        ring
    }

    /// Adds a frame's sums in place of the oldest frame's.
    pub fn push(&mut self, sums: &[u32; TAXELS]) {
        self.add(sums, true);
        self.complete(false);
    }

    /// Returns whether no frame is missing: the last 70 frames have arrived, one after the other.
    pub const fn is_unbroken(&self) -> bool {
        self.lost == 0
    }

    /// Returns whether none of so many of the last frames is missing.
    pub(crate) const fn has_whole(&self, frames: u8) -> bool {
        self.lost.trailing_zeros() >= frames as u32
    }

    /// Returns the last frames, the oldest first, from the first of 70 that arrived: what
    /// [`Wave::fit`](crate::touch::wave::Wave::fit) takes. A lost one is `None`.
    pub fn frames(&self) -> impl Iterator<Item = Option<&[u16; TAXELS]>> {
        self.last(SAMPLE_FRAMES as u8)
    }

    /// Returns so many of the last frames, as [`TaxelRing::frames`] does.
    pub(crate) fn last(&self, frames: u8) -> impl Iterator<Item = Option<&[u16; TAXELS]>> {
        let first = SAMPLE_FRAMES.saturating_sub(frames.into());
        // Bytes, since a board shifts 128 bits in many instructions.
        let lost = self.lost.to_le_bytes();
        let frame = move |number: usize| {
            let bit = SAMPLE_FRAMES - 1 - number;
            let is_lost = lost.get(bit >> 3).is_some_and(|bits| bits >> (bit & 7) & 1 == 1);
            if is_lost { None } else { self.frames.get(self.place(number)) }
        };
        (first..SAMPLE_FRAMES).map(frame).skip_while(Option::is_none)
    }

    /// Returns whether each taxel has been lit since the first four frames that arrived, to an eighth of the brightest
    /// at least.
    pub(crate) fn are_all_lit(&self) -> bool {
        let mut lights = [[0_u32; 2]; TAXELS];
        for (number, frame) in self.frames().flatten().enumerate() {
            for ([peak, dark], &light) in lights.iter_mut().zip(frame) {
                *peak = u32::from(light).max(*peak);
                *dark += if number < 4 { u32::from(light) } else { 0 };
            }
        }
        let peaks = lights.map(|[peak, dark]| (4 * peak).saturating_sub(dark));
        let highest = peaks.iter().copied().max().unwrap_or(0);
        peaks.iter().all(|&peak| 8 * peak > highest)
    }

    /// Returns whether a frame was lost, in whole or in part, by its age: 0 is the oldest, 69 the last one.
    pub(crate) fn is_lost(&self, number: usize) -> bool {
        self.lost >> ((SAMPLE_FRAMES - 1).saturating_sub(number) & 127) & 1 == 1
    }

    /// Returns whether each of the last frames was lost, in whole or in part: a bit each, that of the newest the
    /// lowest.
    pub(crate) const fn lost_lately(&self) -> u8 {
        self.lost as u8
    }

    /// Returns a taxel's light in a frame by its age: 0 is the oldest, 69 the last one; 0 beyond them.
    pub(crate) fn light(&self, frame: usize, taxel: usize) -> u16 {
        self.frames.get(self.place(frame)).and_then(|frame| frame.get(taxel)).copied().unwrap_or(0)
    }

    /// Returns the logarithms of all light relative to full scale, in units of 2^-11: 25 numbers for each of 70 frames,
    /// the oldest first. A lost frame has those of the last one before it.
    ///
    /// They are what a model of [`Input::Taxels`](crate::model::file::Input::Taxels) takes, if the last frame is that
    /// of the event's sample. The scale is that of the ring's sums.
    pub fn numbers<L: Ln>(&self, scale: &FeatureScale<L>) -> [i16; TAXELS * SAMPLE_FRAMES] {
        let shift = self.shift & 31;
        let mut numbers = [0; TAXELS * SAMPLE_FRAMES];
        for (age, frame) in numbers.as_chunks_mut::<TAXELS>().0.iter_mut().enumerate() {
            *frame = self.frame(age).map(|light| scale.taxel(u32::from(light) << shift));
        }
        numbers
    }

    /// Adds lost frames, each equal to the last one.
    pub fn fill(&mut self, lost: u32) {
        for _ in 0..lost.min(SAMPLE_FRAMES as u32) {
            let last = self.last_frame();
            if let Some(frame) = self.frames.get_mut(usize::from(self.oldest)) {
                *frame = last;
            }
            self.advance(true);
        }
    }

    // A feature frame under way is in the place of the oldest frame, which its last camera frame makes the newest.
    fn add_sums(&mut self, sums: &[u32; TAXELS], is_first: bool) {
        let shift = self.shift & 31;
        if let Some(frame) = self.frames.get_mut(usize::from(self.oldest)) {
            for (place, sum) in frame.iter_mut().zip(sums) {
                let sum = (sum >> shift).min(u16::MAX.into()) as u16;
                *place = if is_first { sum } else { place.saturating_add(sum) };
            }
        }
    }

    fn advance(&mut self, is_lost: bool) {
        self.lost = (self.lost << 1 | u128::from(is_lost)) & ALL_LOST;
        self.oldest = if usize::from(self.oldest) + 1 < SAMPLE_FRAMES { self.oldest + 1 } else { 0 };
    }

    /// Returns a frame by its age: 0 is the oldest, 69 the last one.
    pub(crate) fn frame(&self, number: usize) -> &[u16; TAXELS] {
        self.frames.get(self.place(number)).unwrap_or(&[0; TAXELS])
    }

    /// Returns a copy of the last frame.
    // Inlined, it would be a copy within the ring, which takes a board 1.5 kB of code.
    #[inline(never)]
    fn last_frame(&self) -> [u16; TAXELS] {
        *self.frame(SAMPLE_FRAMES - 1)
    }

    fn place(&self, number: usize) -> usize {
        let place = usize::from(self.oldest) + number;
        if place < SAMPLE_FRAMES { place } else { place - SAMPLE_FRAMES }
    }
}

impl TaxelStore for TaxelRing {
    const EMPTY: Self = Self { frames: [[0; TAXELS]; SAMPLE_FRAMES], oldest: 0, shift: 0, lost: ALL_LOST };

    #[inline(always)]
    fn parts(&mut self) -> (Option<&mut Self>, Option<&Correction>) {
        (Some(self), None)
    }

    #[inline(always)]
    fn ring(&self) -> Option<&Self> {
        Some(self)
    }
}
