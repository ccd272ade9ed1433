//! Judges what a sensor really sends: the size and format of a whole frame, and the rate.
//!
//! A table of settings can be wrong in ways that nothing on the bus shows. So after each setup, whole frames are
//! measured with every byte: their syncs, lines and words, and the last bytes of them. The sensors are told to fix
//! chroma at [`FIXED_CHROMA`], so the bytes tell which of two is luma, in any light.

use wstac_core::rate::FrameRate;
use wstac_core::wire::FramePart;

use crate::sensor::FIXED_CHROMA;
use crate::stripes::Ticks;

/// The number of frames after which the rate is judged again.
pub const RATE_FRAMES: u32 = 30;
/// The largest difference of a rate, as a fraction of the nominal one: 1/50 is 2 %.
const RATE_TOLERANCE: u64 = 50;
/// The largest difference of a chroma byte from its fixed value.
const CHROMA_TOLERANCE: u8 = 2;
/// Of 16 bytes of one kind, those that must be near chroma's value for chroma, and no more than that for luma.
const MOST_OF_16: usize = 15;

/// The measurements of whole frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Probe {
    /// The frame times that were measured.
    pub frames: u32,
    /// The ticks that they took.
    pub ticks: u32,
    /// The lines of the last frame.
    pub lines: u32,
    /// The words of four bytes of the last frame.
    pub words: u32,
}

/// Judges frames that should have this size and rate: two bytes per pixel if there is chroma, else one.
///
/// `tail` has the last bytes of frames, in pairs. Returns whether luma is the first of two bytes, or `None` if the
/// picture leaves that open because luma and chroma look the same, or if there is no chroma.
///
/// # Errors
/// Returns the first part that is wrong.
pub fn judge(
    probe: Probe,
    tail: &[u8],
    [width, height]: [u16; 2],
    has_chroma: bool,
    rate: FrameRate,
    tick_hz: Ticks,
) -> Result<Option<bool>, FramePart> {
    let Probe { lines, words, .. } = probe;
    if lines != u32::from(height) || words != u32::from(width) * lines / if has_chroma { 2 } else { 4 } {
        return Err(FramePart::Size);
    }
    let luma_first = if has_chroma { luma_is_first(tail)? } else { None };
    judge_rate(probe.frames, probe.ticks, rate, tick_hz)?;
    Ok(luma_first)
}

/// Returns the pixels for which the clock of each line runs before the first one, at most `most`, or else 0. A line
/// then has so many clocks more than pixels.
pub fn early_pixels(probe: Probe, width: u16, most: u16) -> u16 {
    let (lines, bytes) = (u64::from(probe.lines), 4 * u64::from(probe.words));
    let has = |early: &u16| lines > 0 && bytes == u64::from(width + early) * lines;
    (1..=most).find(has).unwrap_or(0)
}

/// Judges bytes of a test pattern of walking ones: each is twice the one before, and 1 follows 0. Lines may begin anew.
///
/// # Errors
/// Returns [`FramePart::Pattern`] if more than one of 64 steps is another one.
pub fn judge_pattern(parts: [&[u8]; 2]) -> Result<(), FramePart> {
    let (mut steps, mut wrong) = (0, 0);
    for pair in parts.into_iter().flat_map(|part| part.windows(2)) {
        let &[before, after] = pair else { continue };
        steps += 1;
        wrong += usize::from(after != if before == 0 { 1 } else { before << 1 });
    }
    if steps > 0 && wrong * 64 <= steps { Ok(()) } else { Err(FramePart::Pattern) }
}

/// Judges the rate of frames that took these ticks.
///
/// # Errors
/// Returns [`FramePart::Rate`] if the rate differs by more than 2 %.
pub fn judge_rate(frames: u32, ticks: u32, rate: FrameRate, tick_hz: Ticks) -> Result<(), FramePart> {
    let (numerator, denominator) = (u64::from(rate.numerator()), u64::from(rate.denominator()));
    // Both sides are frame times, times the numerator.
    let expected = u64::from(frames).saturating_mul(tick_hz).saturating_mul(denominator);
    let found = u64::from(ticks).saturating_mul(numerator);
    let is_near = found.abs_diff(expected).saturating_mul(RATE_TOLERANCE) <= expected;
    if is_near { Ok(()) } else { Err(FramePart::Rate) }
}

/// Returns the rate of frames that took these ticks, in frames per 1000 seconds.
pub fn millihertz(frames: u32, ticks: u32, tick_hz: Ticks) -> u32 {
    let rate = (u64::from(frames).saturating_mul(1000).saturating_mul(tick_hz)).checked_div(u64::from(ticks));
    rate.and_then(|rate| u32::try_from(rate).ok()).unwrap_or(u32::MAX)
}

/// Returns how many times the nominal rate this one is, if that is a whole number within 2 %.
pub fn times_nominal(millihertz: u32, rate: FrameRate) -> Option<u32> {
    let nominal = (1000 * u64::from(rate.numerator())).checked_div(u64::from(rate.denominator()))?;
    let times = (u64::from(millihertz) + nominal / 2).checked_div(nominal)?;
    let expected = times * nominal;
    let is_near = u64::from(millihertz).abs_diff(expected) * RATE_TOLERANCE <= expected;
    u32::try_from(times).ok().filter(|&times| is_near && times > 0)
}

fn luma_is_first(tail: &[u8]) -> Result<Option<bool>, FramePart> {
    let is_chroma = |byte: &u8| byte.abs_diff(FIXED_CHROMA) <= CHROMA_TOLERANCE;
    let of = |first: usize| {
        let near = tail.iter().skip(first).step_by(2).filter(|byte| is_chroma(byte)).count();
        16 * near > MOST_OF_16 * (tail.len() / 2)
    };
    match (of(0), of(1)) {
        (false, true) => Ok(Some(true)),
        (true, false) => Ok(Some(false)),
        (true, true) => Ok(None),
        (false, false) => Err(FramePart::Format),
    }
}

/// Measures the rate while frames are used.
#[derive(Clone, Copy, Debug, Default)]
pub struct RateMeter {
    from: Option<(u32, u32)>,
}

impl RateMeter {
    /// Begins a new measurement, because syncs may be missing or too many.
    pub fn restart(&mut self) {
        self.from = None;
    }

    /// Takes the number of syncs so far and the ticks at the last one, both modulo 2^32. Every [`RATE_FRAMES`] frames,
    /// returns their number and ticks.
    pub fn push(&mut self, syncs: u32, ticks: u32) -> Option<(u32, u32)> {
        let (first, began) = *self.from.get_or_insert((syncs, ticks));
        let frames = syncs.wrapping_sub(first);
        if frames < RATE_FRAMES {
            return None;
        }
        self.from = Some((syncs, ticks));
        Some((frames, ticks.wrapping_sub(began)))
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const HZ: Ticks = 32_768;

    /// Ten frames of the right size at this rate, times 100.
    fn probe(rate: u32) -> Probe {
        Probe { frames: 10, ticks: 1000 * 32_768 / rate, lines: 240, words: 38_400 }
    }

    fn of(probe: Probe, tail: &[u8]) -> Result<Option<bool>, FramePart> {
        judge(probe, tail, [320, 240], true, FrameRate::NOMINAL, HZ)
    }

    /// Pairs of bytes, with luma that changes.
    fn pairs(luma_first: bool, chroma: u8) -> Vec<u8> {
        let pair = |luma| if luma_first { [luma, chroma] } else { [chroma, luma] };
        (0..100).flat_map(|luma| pair(luma * 2)).collect()
    }

    #[test]
    fn the_right_frames_pass_in_any_light() {
        for chroma in [126, 128, 130] {
            assert_eq!(of(probe(3000), &pairs(true, chroma)), Ok(Some(true)));
            assert_eq!(of(probe(3000), &pairs(false, chroma)), Ok(Some(false)));
        }
        // In the dark, and so bright that nothing is left.
        assert_eq!(of(probe(3000), &[0, 128].repeat(50)), Ok(Some(true)));
        assert_eq!(of(probe(3000), &[128, 255].repeat(50)), Ok(Some(false)));
        // A picture that is as gray as chroma.
        assert_eq!(of(probe(3000), &[128, 128].repeat(50)), Ok(None));
    }

    #[test]
    fn another_format_is_refused() {
        for chroma in [125, 131, 0] {
            assert_eq!(of(probe(3000), &pairs(true, chroma)), Err(FramePart::Format));
        }
    }

    #[test]
    fn another_size_is_refused() {
        for (lines, words) in [(240, 38_399), (239, 38_240), (480, 38_400), (240, 76_800), (240, 0)] {
            let found = Probe { lines, words, ..probe(3000) };
            assert_eq!(of(found, &pairs(true, 128)), Err(FramePart::Size));
        }
        assert_eq!(of(Probe::default(), &[]), Err(FramePart::Size));
    }

    #[test]
    fn gray_pixels_have_one_byte_and_no_order() {
        let gray = |words| judge(Probe { words, ..probe(3000) }, &[1, 2], [320, 240], false, FrameRate::NOMINAL, HZ);
        assert_eq!(gray(19_200), Ok(None));
        assert_eq!(gray(38_400), Err(FramePart::Size));
    }

    #[test]
    fn clocks_before_the_first_pixel_are_counted() {
        let early = |lines, words| early_pixels(Probe { lines, words, ..Probe::default() }, 324, 2);
        assert_eq!([324, 325, 326, 327, 323].map(|clocks| early(244, 61 * clocks)), [0, 1, 2, 0, 0]);
        assert_eq!([early(0, 0), early(243, 61 * 326), early(244, u32::MAX)], [0; 3]);
    }

    #[test]
    fn walking_ones_are_known_from_those_of_other_wires_and_orders() {
        let walk = |length: usize| (0..length).map(|at| 1_u32.checked_shl(at as u32 % 9).unwrap() as u8);
        let lines: Vec<u8> = (0..22).flat_map(|_| walk(324)).collect();
        // The DMA is somewhere in the second half, and what is behind that is older.
        let other = [&lines[..777], &lines[99..3000]].concat();
        assert_eq!(judge_pattern([&lines, &other]), Ok(()));
        let changed = |change: fn(u8) -> u8| {
            let bytes: Vec<u8> = lines.iter().map(|byte| change(*byte)).collect();
            judge_pattern([&bytes, &bytes])
        };
        let changes: [fn(u8) -> u8; 8] = [
            |byte| byte & !0x20,
            |byte| byte | 0x01,
            |byte| byte.rotate_left(4),
            u8::reverse_bits,
            |byte| byte >> 2,
            |byte| byte.saturating_add(8),
            |_| 0,
            |_| 0xFF,
        ];
        for (number, change) in changes.into_iter().enumerate() {
            assert_eq!(changed(change), Err(FramePart::Pattern), "change {number}");
        }
        assert_eq!(judge_pattern([&[], &[]]), Err(FramePart::Pattern));
    }

    #[test]
    fn a_rate_may_differ_by_two_percent() {
        for (rate, right) in [(3000, true), (3057, true), (2945, true), (3070, false), (2930, false), (6000, false)] {
            assert_eq!(of(probe(rate), &pairs(true, 128)).is_ok(), right, "{rate}");
        }
        assert_eq!(of(probe(6000), &pairs(true, 128)), Err(FramePart::Rate));
        assert_eq!((millihertz(30, 16_384, HZ), millihertz(30, 0, HZ)), (60_000, u32::MAX));
        assert_eq!(judge_rate(30, 0, FrameRate::NOMINAL, HZ), Err(FramePart::Rate));
    }

    #[test]
    fn multiples_of_the_rate_are_known() {
        let times = |rate| times_nominal(rate, FrameRate::NOMINAL);
        assert_eq!([30_000, 60_024, 118_000, 122_000].map(times), [Some(1), Some(2), Some(4), Some(4)]);
        assert_eq!([0, 7_500, 15_000, 45_000, 58_000, 62_000].map(times), [None; 6]);
    }

    #[test]
    fn the_meter_measures_30_frames_over_the_turn_of_its_counters() {
        let mut meter = RateMeter::default();
        let (first, began) = (u32::MAX - 10, u32::MAX - 5000);
        let at = |frame: u32| (first.wrapping_add(frame), began.wrapping_add(frame * 1092));
        for frame in 0..30 {
            assert_eq!(meter.push(at(frame).0, at(frame).1), None);
        }
        assert_eq!(meter.push(at(30).0, at(30).1), Some((30, 30 * 1092)));
        meter.restart();
        assert_eq!(meter.push(at(60).0, at(60).1), None);
    }
}
