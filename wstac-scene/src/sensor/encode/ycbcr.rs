//! Converts R, G, B of 0..=255 into Y, Cb, Cr as a camera's own processor does: rounded to nearest.

use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding};

/// Constant that rounds: added to a number of 0..=255, it leaves the nearest integer in the low bits of a
/// single-precision number.
const ROUNDER: f32 = 8_388_608.0;

/// The factors of one matrix and range, in single precision.
///
/// Every machine can process several pixels at once, and the error is within 1e-4 of a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conversion {
    luma: [f32; 3],
    black: f32,
    /// Of Cb and of Cr.
    chroma: [[f32; 3]; 2],
}

impl Conversion {
    pub(super) fn new(color: YcbcrEncoding) -> Self {
        let (red, blue) = color.matrix.red_and_blue();
        let (black, luma_span, chroma_span) = match color.range {
            QuantizationRange::Limited => (16.0, 219.0 / 255.0, 224.0 / 255.0),
            QuantizationRange::Full => (0.0, 1.0, 1.0),
        };
        let chroma = |share: f64| 0.5 * chroma_span * share;
        let cb = [chroma(-red / (1.0 - blue)), chroma((red + blue - 1.0) / (1.0 - blue)), chroma(1.0)];
        let cr = [chroma(1.0), chroma((red + blue - 1.0) / (1.0 - red)), chroma(-blue / (1.0 - red))];
        let luma = [red * luma_span, (1.0 - red - blue) * luma_span, blue * luma_span];
        let [luma, cb, cr] = [luma, cb, cr].map(|factors| factors.map(|factor| factor as f32));
        Self { luma, black, chroma: [cb, cr] }
    }

    #[inline(always)]
    pub(super) fn luma(&self, pixel: [u16; 3]) -> u8 {
        (self.black + dot(self.luma, pixel) + ROUNDER).to_bits() as u8
    }

    /// Returns the Cb (0) or Cr (1) of the mean of some pixels, which is their sum times `share`.
    #[inline(always)]
    pub(super) fn chroma(&self, which: usize, sum: [u16; 3], share: f32) -> u8 {
        let level = dot(self.chroma[which], sum) * share + 128.0;
        // Full range reaches 255.5.
        let level = if level < 255.0 { level } else { 255.0 };
        (level + ROUNDER).to_bits() as u8
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [u16; 3]) -> f32 {
    let [r, g, b] = b.map(f32::from);
    a[0] * r + a[1] * g + a[2] * b
}

#[cfg(test)]
mod tests {
    use wstac_core::green::ycbcr::YcbcrMatrix;

    use super::*;

    /// Computes from the definition: Y' = Kr R + Kg G + Kb B, Cb = (B − Y') / 2 (1 − Kb), and Cr accordingly.
    fn by_definition(color: YcbcrEncoding, [r, g, b]: [u16; 3]) -> [f64; 3] {
        let (kr, kb) = if color.matrix == YcbcrMatrix::Bt601 { (0.299, 0.114) } else { (0.2126, 0.0722) };
        let [r, g, b] = [r, g, b].map(|value| f64::from(value) / 255.0);
        let y = kr * r + (1.0 - kr - kb) * g + kb * b;
        let [cb, cr] = [(b - y) / (2.0 * (1.0 - kb)), (r - y) / (2.0 * (1.0 - kr))];
        match color.range {
            QuantizationRange::Limited => [16.0 + 219.0 * y, 128.0 + 224.0 * cb, 128.0 + 224.0 * cr],
            QuantizationRange::Full => [255.0 * y, 128.0 + 255.0 * cb, 128.0 + 255.0 * cr],
        }
    }

    #[test]
    fn every_color_is_converted_to_nearest() {
        for matrix in [YcbcrMatrix::Bt601, YcbcrMatrix::Bt709] {
            for range in [QuantizationRange::Limited, QuantizationRange::Full] {
                let (color, steps) = (YcbcrEncoding { matrix, range }, (0..=255).step_by(5));
                let conversion = Conversion::new(color);
                for pixel in steps.clone().flat_map(|r| {
                    let steps = steps.clone();
                    steps.clone().flat_map(move |g| steps.clone().map(move |b| [r, g, b]))
                }) {
                    let chroma = |times, share| {
                        let sum = pixel.map(|value| times * value);
                        [0, 1].map(|which| conversion.chroma(which, sum, share))
                    };
                    let [cb, cr] = chroma(4, 0.25);
                    assert_eq!([cb, cr], chroma(1, 1.0));
                    for (found, expected) in
                        [conversion.luma(pixel), cb, cr].into_iter().zip(by_definition(color, pixel))
                    {
                        let expected = expected.min(255.0);
                        assert!((f64::from(found) - expected).abs() < 0.501, "{pixel:?}: {found} {expected}");
                    }
                }
                for gray in 0..=255 {
                    assert_eq!([0, 1].map(|which| conversion.chroma(which, [gray; 3], 1.0)), [128, 128]);
                }
            }
        }
    }
}
