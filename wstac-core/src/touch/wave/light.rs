//! The light of a touch: 25 smoothed lines, cut out of a sample.

use super::LIT_SHIFT;
use crate::params::{COLUMNS, SAMPLE_FRAMES, TAXELS};
use crate::reason::Reason;
use crate::touch::motion::smooth;

/// Frames at the start that count as dark, and units of light to one of a sum.
const DARK: usize = 4;
const DARK_SHIFT: u32 = DARK.trailing_zeros();
/// The sum of the dark frames' 75 differences is 84 standard deviations of the noise, of which each is four units of
/// light.
const NOISE: u32 = 84 / DARK as u32;
/// The noise is at least two units of a sum.
const LEAST_NOISE: u32 = 2 * DARK as u32;
/// A touch has a light of at least 64 units of a sum.
const LEAST_LIGHT: u32 = 64 * DARK as u32;
/// Most frames of a line.
const LONGEST: usize = SAMPLE_FRAMES;
/// Dark frames before and behind a line, so that each frame that it is shifted to has four taps.
pub(super) const PAD: usize = 3;
const PADDED: usize = LONGEST + 2 * PAD;
/// Bits of a line's light.
const BITS: u32 = 12;
const MOST: i32 = (1 << BITS) - 1;

/// Whiskers' smoothed light over a touch.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    /// Light in units of at most a 2048th of the brightest, between dark frames.
    values: [[i16; PADDED]; TAXELS],
    pub(super) peaks: [i16; TAXELS],
    pub(super) length: usize,
    /// Whether the touch is not over at the lines' end.
    pub(super) is_cut: bool,
    /// The whiskers that light up behind the touch in the sample, if a quarter of the highest light follows it; a bit
    /// each.
    pub(super) later: u32,
    /// Frames of the lines that were lost.
    pub(super) lost: u8,
    /// Flashes of the sample: runs of lit frames, of which one is a touch.
    pub(super) flashes: u32,
}

impl Lines {
    pub(super) const EMPTY: Self = Self {
        values: [[0; PADDED]; TAXELS],
        peaks: [0; TAXELS],
        length: 0,
        is_cut: false,
        later: 0,
        lost: 0,
        flashes: 0,
    };

    /// Returns each line between dark frames, with its peak.
    pub(super) fn padded(&self) -> impl Iterator<Item = (&[i16], i32)> {
        let padded = self.length + 2 * PAD;
        self.values.iter().map(move |line| line.get(..padded).unwrap_or_default()).zip(self.peaks.map(i32::from))
    }

    /// Returns each whisker's light over the touch, within ±70 · 4,096.
    pub(super) fn energies(&self) -> [i32; TAXELS] {
        self.values.each_ref().map(|line| line.iter().skip(PAD).take(self.length).map(|&light| i32::from(light)).sum())
    }

    /// Fills the lines with the first touch of a sample's frames.
    ///
    /// # Errors
    /// There is no touch, or the sample does not begin in the dark.
    // Its list is not in memory for longer.
    #[inline(never)]
    pub(super) fn read<'a>(&mut self, samples: impl Iterator<Item = Option<&'a [u16; TAXELS]>>) -> Result<(), Reason> {
        self.fill(&Samples::new(samples))
    }

    #[inline(never)]
    fn fill(&mut self, samples: &Samples<'_>) -> Result<(), Reason> {
        let (mut dark, mut differences) = ([0_u32; TAXELS], 0_u32);
        let [mut here, mut there] = [[0; TAXELS]; 2];
        for number in 0..DARK {
            let (frame, before) = (samples.frame(number, &mut here), samples.frame(number.max(1) - 1, &mut there));
            for ((dark, &light), &before) in dark.iter_mut().zip(frame).zip(before) {
                *dark += u32::from(light);
                differences += u32::from(light.abs_diff(before));
            }
        }
        let noise = (differences / NOISE).max(LEAST_NOISE);
        // Noise of 25 whiskers is five times that of one: three standard deviations.
        let totals = totals(samples, dark.iter().sum::<u32>() + 15 * noise);
        let (mut is_cut, mut most) = (false, 0);
        self.flashes = 0;
        let [first, last] = span(totals.get(..samples.count).unwrap_or_default(), |start, end, flashes| {
            is_cut = end >= samples.count;
            most = samples.brightest(&dark, start, end).into_iter().max().unwrap_or(0);
            let is_bright = most > (8 * noise).max(LEAST_LIGHT);
            self.flashes = u32::from(is_bright) * flashes;
            is_bright
        })?;
        (self.length, self.is_cut) = (last - first, is_cut);
        self.later = 0;
        let highest = totals.iter().copied().max().unwrap_or(0);
        if totals.iter().skip(last).any(|&light| 4 * light > highest) {
            for (taxel, light) in samples.brightest(&dark, last, samples.count).into_iter().enumerate() {
                self.later |= u32::from(light << LIT_SHIFT > most) << taxel;
            }
        }
        self.lost = (first..last).filter(|&number| samples.known(number).is_none()).count() as u8;
        // As many bits as a line has.
        let bits = u32::BITS - most.leading_zeros();
        let (left, right) = (BITS.saturating_sub(bits), bits.saturating_sub(BITS));
        let frames = samples.frames.get(first..last).unwrap_or_default();
        for (taxel, ((line, peak), dark)) in self.values.iter_mut().zip(&mut self.peaks).zip(dark).enumerate() {
            let (line, behind) = line.split_at_mut_checked(PAD + self.length).unwrap_or_default();
            let line = line.get_mut(PAD..).unwrap_or_default();
            for (number, (place, frame)) in line.iter_mut().zip(frames).enumerate() {
                let between = || i32::from(samples.between(first + number, taxel));
                let light = frame.and_then(|frame| frame.get(taxel)).map_or_else(between, |&light| light.into());
                let light = ((light << DARK_SHIFT) - dark as i32).max(-(most as i32));
                *place = ((light << left) >> right).clamp(-MOST - 1, MOST) as i16;
            }
            *peak = smooth(line, |light| light as i16) as i16;
            behind.iter_mut().take(PAD).for_each(|place| *place = 0);
        }
        Ok(())
    }
}

/// A sample's frames, oldest first; `None` is a lost one.
struct Samples<'a> {
    frames: [Option<&'a [u16; TAXELS]>; SAMPLE_FRAMES],
    count: usize,
}

impl<'a> Samples<'a> {
    fn new(samples: impl Iterator<Item = Option<&'a [u16; TAXELS]>>) -> Self {
        let mut list = Self { frames: [None; SAMPLE_FRAMES], count: 0 };
        for (place, frame) in list.frames.iter_mut().zip(samples) {
            *place = frame;
            list.count += 1;
        }
        list
    }

    fn known(&self, number: usize) -> Option<&'a [u16; TAXELS]> {
        self.frames.get(number).copied().flatten()
    }

    /// Returns a frame. A lost one is on a straight line between those that arrived before and after it.
    fn frame<'b>(&'b self, number: usize, place: &'b mut [u16; TAXELS]) -> &'b [u16; TAXELS] {
        if let Some(frame) = self.known(number) {
            return frame;
        }
        *place = core::array::from_fn(|taxel| self.between(number, taxel));
        place
    }

    /// Returns the most light of each whisker in some frames.
    #[inline(never)]
    fn brightest(&self, dark: &[u32; TAXELS], start: usize, end: usize) -> [u32; TAXELS] {
        let (mut highest, mut place) = ([0; TAXELS], [0; TAXELS]);
        for number in start..end {
            let rows = self.frame(number, &mut place).as_chunks::<COLUMNS>().0;
            for ([a, b, c, d, e], &[f, g, h, i, j]) in highest.as_chunks_mut::<COLUMNS>().0.iter_mut().zip(rows) {
                (*a, *b, *c, *d, *e) = (f.max(*a), g.max(*b), h.max(*c), i.max(*d), j.max(*e));
            }
        }
        let mut above = *dark;
        for (above, light) in above.iter_mut().zip(highest) {
            *above = (u32::from(light) << DARK_SHIFT).saturating_sub(*above);
        }
        above
    }

    #[cold]
    #[inline(never)]
    fn between(&self, number: usize, taxel: usize) -> u16 {
        let light = |number| Some(i32::from(*self.known(number)?.get(taxel)?));
        let before = (1..=number).find_map(|steps| Some((light(number - steps)?, steps as i32)));
        let after = (1..SAMPLE_FRAMES).find_map(|steps| Some((light(number + steps)?, steps as i32)));
        let (Some((before, since)), Some((after, until))) = (before, after) else {
            return before.or(after).map_or(0, |(light, _)| light as u16);
        };
        (before + ((after - before) * since).checked_div(since + until).unwrap_or(0)) as u16
    }
}

/// Returns the light of all whiskers over a sample, as far as it is above the noise.
fn totals(samples: &Samples<'_>, floor: u32) -> [u32; SAMPLE_FRAMES] {
    let mut totals = [0; SAMPLE_FRAMES];
    let mut place = [0; TAXELS];
    for (number, total) in totals.iter_mut().enumerate().take(samples.count) {
        let mut sum = 0;
        for &[a, b, c, d, e] in samples.frame(number, &mut place).as_chunks::<COLUMNS>().0 {
            sum += u32::from(a) + u32::from(b) + u32::from(c) + u32::from(d) + u32::from(e);
        }
        *total = (sum << DARK_SHIFT).saturating_sub(floor);
    }
    totals
}

/// Returns the first frame of the first touch, and the first one behind it.
fn span(total: &[u32], mut is_bright: impl FnMut(usize, usize, u32) -> bool) -> Result<[usize; 2], Reason> {
    let highest = total.iter().copied().max().unwrap_or(0);
    let middle = total.iter().position(|&light| light == highest).unwrap_or(0);
    // A frame is lit if it has a fifth of the light before it, and of that behind it. The first one stands for those
    // before the sample.
    let mut is_lit = [false; SAMPLE_FRAMES + 1];
    for (half, is_second) in [(0..middle + 1, false), (middle..total.len(), true)] {
        let mut most = 0;
        for number in 0..half.len() {
            let at = if is_second { half.end - 1 - number } else { half.start + number };
            let light = total.get(at).copied().unwrap_or(0);
            most = light.max(most);
            if let Some(is_lit) = is_lit.get_mut(at + 1) {
                // At most 25 · 4 · 65,535 · 100.
                *is_lit |= 5 * light > most && 100 * light > highest;
            }
        }
    }
    let flashes = is_lit.array_windows().filter(|[before, here]| !before && *here).count() as u32;
    let mut end = 0;
    while let Some(dark) = is_lit.iter().skip(end + 1).position(|&is_lit| is_lit) {
        let start = end + dark;
        end = is_lit.iter().skip(start + 1).position(|&is_lit| !is_lit).map_or(total.len(), |lit| start + lit);
        if end - start < 2 || !is_bright(start, end, flashes) {
            continue;
        }
        return if start < DARK { Err(Reason::NotCrossed) } else { Ok(widened(total, start, end)) };
    }
    Err(Reason::FewWhiskers)
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
