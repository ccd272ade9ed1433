//! The light of a touch: 25 smoothed lines, cut out of a sample.

use crate::params::{SAMPLE_FRAMES, TAXELS};
use crate::reason::Reason;

/// Frames at the start that count as dark, and units of light to one of a sum.
const DARK: usize = 4;
const DARK_SHIFT: u32 = DARK.trailing_zeros();
/// The sum of the dark frames' 75 differences is 84 standard deviations of the noise, of which each is four units of light.
const NOISE: u32 = 84 / DARK as u32;
/// The noise is at least two units of a sum.
const LEAST_NOISE: u32 = 2 * DARK as u32;
/// A touch has a light of at least 64 units of a sum.
const LEAST_LIGHT: u32 = 64 * DARK as u32;
/// Most steps of a line: a longer touch has steps of two frames.
pub(super) const LONGEST: usize = 36;
/// Dark steps before and behind a line, so that each step that it is shifted to has four taps.
pub(super) const PAD: usize = 3;
const PADDED: usize = LONGEST + 2 * PAD;
/// Bits of a line's light.
const BITS: u32 = 12;
const MOST: i32 = (1 << BITS) - 1;

/// Whiskers' smoothed light over a touch.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    /// Light in units of at most a 2048th of the brightest, between dark steps.
    values: [[i16; PADDED]; TAXELS],
    pub(super) peaks: [i16; TAXELS],
    pub(super) length: usize,
    /// Frames of a step.
    pub(super) frames: u8,
    /// Whether the touch is not over at the lines' end.
    pub(super) is_cut: bool,
}

impl Lines {
    pub(super) const EMPTY: Self =
        Self { values: [[0; PADDED]; TAXELS], peaks: [0; TAXELS], length: 0, frames: 1, is_cut: false };

    /// Returns each line between dark steps, with its peak.
    pub(super) fn padded(&self) -> impl Iterator<Item = (&[i16; PADDED], i32)> {
        self.values.iter().zip(self.peaks.map(i32::from))
    }

    /// Fills the lines with the first touch of a sample's frames, oldest first. `None` is a lost frame.
    ///
    /// # Errors
    /// There is no touch, or the sample does not begin in the dark.
    pub(super) fn fill(
        &mut self,
        samples: impl Iterator<Item = Option<[u16; TAXELS]>> + Clone,
    ) -> Result<(), Reason> {
        let samples = Filled { rest: samples.take(SAMPLE_FRAMES), last: None };
        let (mut dark, mut differences) = ([0_u32; TAXELS], 0_u32);
        let mut before: Option<[u16; TAXELS]> = None;
        for frame in samples.clone().take(DARK) {
            for (dark, &light) in dark.iter_mut().zip(&frame) {
                *dark += u32::from(light);
            }
            for (&a, &b) in before.iter().flatten().zip(&frame) {
                differences += u32::from(a.abs_diff(b));
            }
            before = Some(frame);
        }
        let noise = (differences / NOISE).max(LEAST_NOISE);
        let mut totals = Totals::DARK;
        for ((frame, total), most) in samples.clone().zip(&mut totals.total).zip(&mut totals.most) {
            for (&light, &dark) in frame.iter().zip(&dark) {
                let light = (u32::from(light) << DARK_SHIFT).saturating_sub(dark);
                *total += light.saturating_sub(3 * noise);
                *most = light.max(*most);
            }
            totals.frames += 1;
        }
        let ([first, last], is_cut) = totals.span((8 * noise).max(LEAST_LIGHT))?;
        let frames = last - first;
        self.is_cut = is_cut;
        self.frames = if frames > LONGEST { 2 } else { 1 };
        self.length = (frames >> (self.frames - 1)).min(LONGEST);
        let most = totals.most.get(first..last).unwrap_or_default().iter().max().copied().unwrap_or(0);
        // As many bits as a line has.
        let bits = u32::BITS - (most << (self.frames - 1)).leading_zeros();
        let (left, right) = (BITS.saturating_sub(bits), bits.saturating_sub(BITS));
        self.values = Self::EMPTY.values;
        let steps = samples.skip(first).take(self.length << (self.frames - 1));
        for (number, frame) in steps.enumerate() {
            let place = PAD + (number >> (self.frames - 1));
            for ((line, &light), &dark) in self.values.iter_mut().zip(&frame).zip(&dark) {
                let light = (((i32::from(light) << DARK_SHIFT) - dark as i32).max(-(most as i32)) << left) >> right;
                if let Some(place) = line.get_mut(place) {
                    *place = (i32::from(*place) + light).clamp(-MOST, MOST) as i16;
                }
            }
        }
        for (line, peak) in self.values.iter_mut().zip(&mut self.peaks) {
            let line = line.get_mut(PAD..PAD + self.length).unwrap_or_default();
            smooth(line);
            if self.frames == 1 {
                smooth(line);
            }
            *peak = line.iter().copied().max().unwrap_or(0).max(0);
        }
        Ok(())
    }
}

/// Smooths by the filter [1 2 1] / 4 in place. The first and last values stand for those beyond them.
fn smooth(line: &mut [i16]) {
    let mut before = line.first().copied().unwrap_or(0);
    let last = line.last().copied().unwrap_or(0);
    let places = core::cell::Cell::from_mut(line).as_slice_of_cells();
    for (number, place) in places.iter().enumerate() {
        let here = place.get();
        let after = places.get(number + 1).map_or(last, core::cell::Cell::get);
        place.set(((i32::from(before) + 2 * i32::from(here) + i32::from(after) + 2) >> 2) as i16);
        before = here;
    }
}

/// Light of all whiskers over a sample.
struct Totals {
    /// What is above three standard deviations of the noise, of all whiskers.
    total: [u32; SAMPLE_FRAMES],
    /// Light of the brightest whisker.
    most: [u32; SAMPLE_FRAMES],
    frames: usize,
}

impl Totals {
    const DARK: Self = Self { total: [0; SAMPLE_FRAMES], most: [0; SAMPLE_FRAMES], frames: 0 };

    /// Returns the first frame of the first touch, the first one behind it, and whether it is not over.
    fn span(&self, least: u32) -> Result<([usize; 2], bool), Reason> {
        let total = self.total.get(..self.frames).unwrap_or_default();
        let highest = total.iter().copied().max().unwrap_or(0);
        let middle = total.iter().position(|&light| light == highest).unwrap_or(0);
        // A frame is lit if it has a fifth of the light before it, and of that behind it.
        let mut is_lit = 0_u128;
        for half in [0..middle + 1, middle..total.len()] {
            let is_second = half.start == middle && half.end != middle + 1;
            let mut most = 0;
            let count = half.len();
            for number in 0..count {
                let at = if is_second { half.end - 1 - number } else { half.start + number };
                let light = total.get(at).copied().unwrap_or(0);
                most = light.max(most);
                // At most 25 · 4 · 65,535 · 100.
                if 5 * light > most && 100 * light > highest {
                    is_lit |= 1 << (at & 127);
                }
            }
        }
        let mut end = 0;
        while end < self.frames {
            let start = end + (is_lit >> (end & 127)).trailing_zeros() as usize;
            if start >= self.frames {
                break;
            }
            end = start + (is_lit >> (start & 127)).trailing_ones() as usize;
            let is_bright = self.most.get(start..end).is_some_and(|most| most.iter().any(|&light| light > least));
            if end - start < 2 || !is_bright {
                continue;
            }
            return if start < DARK {
                Err(Reason::NotCrossed)
            } else {
                Ok((widened(total, start, end), end >= self.frames))
            };
        }
        Err(Reason::FewWhiskers)
    }
}

/// Returns a touch with the frames at both ends in which its light still rises or falls.
fn widened(total: &[u32], start: usize, end: usize) -> [usize; 2] {
    let at = |frame: usize| total.get(frame).copied();
    let (mut first, mut last) = (start, end);
    while start - first < 4 && first > 0 && at(first - 1) <= at(first) {
        first -= 1;
    }
    while last - end < 6 && last < total.len() && at(last) <= at(last - 1) {
        last += 1;
    }
    [first.saturating_sub(2), last]
}

/// Frames in which lost ones are on straight lines between those that arrived.
#[derive(Clone)]
struct Filled<I> {
    rest: I,
    last: Option<[u16; TAXELS]>,
}

impl<I: Iterator<Item = Option<[u16; TAXELS]>> + Clone> Iterator for Filled<I> {
    type Item = [u16; TAXELS];

    fn next(&mut self) -> Option<Self::Item> {
        let frame = self.rest.next()?.or_else(|| {
            let next = self.rest.clone().zip(2_i32..).find_map(|(frame, steps)| Some((frame?, steps)));
            let Some((mut frame, steps)) = next else { return self.last };
            for (light, &last) in frame.iter_mut().zip(self.last.iter().flatten()) {
                let last = i32::from(last);
                *light = (last + (i32::from(*light) - last) / steps) as u16;
            }
            Some(frame)
        });
        self.last = frame;
        Some(frame.unwrap_or([0; TAXELS]))
    }
}
