//! The shapes of five lines' light over a sample: above the baseline, smoothed, and scaled to their peaks.

use super::edges::{Edges, LINES, between, brightest};
use super::smooth::smooth;
use crate::exp::{EXP_FRACTION_BITS, exp_of_negative, widened};
use crate::paper::trigger::Event;
use crate::params::SAMPLE_FRAMES;

pub(super) const PEAK: i32 = 1 << 13;
/// A line is lit if its smoothed peak is at least this fraction, 2^-3, of the axis's brightest.
const LIT_SHIFT: u32 = 3;
/// A frame of a shape is bright above this light: a 64th of the peak.
const BRIGHT: u32 = PEAK as u32 / 64;
/// In the first frame, most lines of a touch that crosses the sensor are below this light: a 32nd of the peak.
const DARK_AT_FIRST: i16 = PEAK as i16 / 32;
/// All lines of a touch that is as wide as the sensor have peaks above this fraction of the brightest, in units of
/// 2^-4.
const EVEN: u32 = 7;
/// The span of a shape without bright frames.
const NO_SPAN: [u8; 2] = [SAMPLE_FRAMES as u8, 0];
/// Iterations of the filter [1 2 1] / 4. Together they are a binomial filter of nine taps.
const SMOOTHED: u32 = 4;

/// The shapes of an axis's lines.
#[derive(Clone, Debug)]
pub(super) struct Shapes {
    /// Light of each line, at most [`PEAK`].
    pub lines: [[i16; SAMPLE_FRAMES]; LINES],
    /// Whether a line is lit.
    pub is_lit: [bool; LINES],
    /// The first and last frames in which a lit line is bright.
    pub span: [u8; 2],
    /// Whether the touch crosses all lines: each is as bright as others, and most were dark at first.
    pub is_crossed: bool,
}

impl Shapes {
    pub(super) const DARK: Self =
        Self { lines: [[0; SAMPLE_FRAMES]; LINES], is_lit: [false; LINES], span: NO_SPAN, is_crossed: false };

    /// Computes the shapes of the lines `first..first + LINES` of an event, in place of dark ones.
    ///
    /// A new value would be a second one on the stack.
    #[inline(never)]
    pub(super) fn fill(&mut self, event: &Event<'_>, first: usize) {
        let brightest = brightest(event, first);
        let (mut peaks, mut spans) = ([0_u32; LINES], [NO_SPAN; LINES]);
        for (line, shape) in self.lines.iter_mut().enumerate() {
            let feature = first + line;
            let mean = event.baseline.mean_of(feature, EXP_FRACTION_BITS);
            let (Some(mean), Some(&most)) = (mean, brightest.get(line)) else { continue };
            let mut light = [0_i32; SAMPLE_FRAMES];
            let base = exp_of_negative((most - mean).max(0) as u32);
            for (light, value) in light.iter_mut().zip(event.sample.feature(feature)) {
                let value = widened(value);
                // Most frames are dark.
                if value > mean {
                    // 28 bits, so that a smoothing step fits.
                    *light = (exp_of_negative((most - value).max(0) as u32).saturating_sub(base) >> 3) as i32;
                }
            }
            let peak = (0..SMOOTHED / 2).fold(0, |_, _| smooth(&mut light, |light| light)) as u32;
            let span = scale(&light, peak, shape);
            if let (Some(place), Some(of)) = (peaks.get_mut(line), spans.get_mut(line)) {
                (*place, *of) = (peak, span);
            }
        }
        // Peaks in a common unit: the light of the brightest feature of all lines.
        let top = brightest.into_iter().max().unwrap_or(0);
        for (peak, most) in peaks.iter_mut().zip(brightest) {
            let relative = exp_of_negative(top.saturating_sub(most).max(0) as u32);
            *peak = ((u64::from(*peak) * u64::from(relative)) >> 31) as u32;
        }
        let highest = peaks.into_iter().max().unwrap_or(0);
        self.is_lit = peaks.map(|peak| peak > highest >> LIT_SHIFT);
        let early = self.lines.iter().filter(|line| line[0] > DARK_AT_FIRST).count();
        self.is_crossed = early <= LINES / 2 && peaks.iter().all(|peak| *peak > (highest >> 4) * EVEN);
        for ([first, last], is_lit) in spans.into_iter().zip(self.is_lit) {
            if is_lit {
                self.span = [self.span[0].min(first), self.span[1].max(last)];
            }
        }
    }

    pub(super) fn lit(&self) -> u8 {
        self.is_lit.iter().map(|&lit| u8::from(lit)).sum()
    }

    /// Returns where each lit line first exceeds `level` · 2^-7 of its peak.
    pub(super) fn edges(&self, level: i32) -> Edges {
        let threshold = (PEAK >> 7) * level;
        let edge = |(line, &is_lit): (&[i16; SAMPLE_FRAMES], &bool)| {
            if !is_lit {
                return None;
            }
            let mut before = 0;
            for (frame, value) in (0..).zip(line.iter().map(|&value| i32::from(value))) {
                if value > threshold {
                    return Some(between(frame, before, value, threshold));
                }
                before = value;
            }
            None
        };
        let mut edges = [None; LINES];
        for (place, line) in edges.iter_mut().zip(self.lines.iter().zip(&self.is_lit)) {
            *place = edge(line);
        }
        Edges { frames: edges }
    }
}

/// Scales light of up to 29 bits so that `peak` becomes [`PEAK`]. Returns its first and last bright frames.
fn scale(light: &[i32; SAMPLE_FRAMES], peak: u32, shape: &mut [i16; SAMPLE_FRAMES]) -> [u8; 2] {
    // The peak gets 16 bits: 2^15 ≤ peak < 2^16, or fewer if it has fewer.
    let shift = 16_u32.saturating_sub(peak.leading_zeros());
    let factor = ((PEAK as u32) << 16).checked_div(peak >> shift).unwrap_or(0);
    let mut span = NO_SPAN;
    for (frame, (shape, &light)) in (0..).zip(shape.iter_mut().zip(light)) {
        // At most 2^29, since the factor is 2^29 divided by the peak.
        let scaled = ((light as u32 >> shift) * factor + (1 << 15)) >> 16;
        *shape = scaled as i16;
        if scaled > BRIGHT {
            span = [span[0].min(frame), frame];
        }
    }
    span
}
