//! R, G, B of 0..=255 → Y, Cb, Cr, as a camera's own processor does it: integers, rounded to nearest.

use wstac_core::green::ycbcr::{Colour, Matrix, Range};

/// Fraction bits of the factors: rounding them is off by less than 0.01 of a level.
const BITS: u32 = 16;

/// The factors of one matrix and range.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conversion {
    luma: [i32; 3],
    black: i32,
    cb: [i32; 3],
    cr: [i32; 3],
}

impl Conversion {
    /// The conversion of this colour.
    pub(super) fn new(colour: Colour) -> Self {
        let (red, blue) = match colour.matrix {
            Matrix::Bt601 => (0.299, 0.114),
            Matrix::Bt709 => (0.2126, 0.0722),
        };
        let (black, luma_span, chroma_span) = match colour.range {
            Range::Limited => (16, 219.0 / 255.0, 224.0 / 255.0),
            Range::Full => (0, 1.0, 1.0),
        };
        let factor = |share: f64| libm::round(share * f64::from(1 << BITS)) as i32;
        // The middle factor is what is left: grey has exactly no chroma, white exactly all luma.
        let chroma = |own: f64, other: f64| {
            let (own, other) = (factor(0.5 * chroma_span), factor(-0.5 * chroma_span * other / (1.0 - own)));
            [own, -own - other, other]
        };
        let (r, b) = (factor(red * luma_span), factor(blue * luma_span));
        let [cb_blue, cb_green, cb_red] = chroma(blue, red);
        let [cr_red, cr_green, cr_blue] = chroma(red, blue);
        Self {
            luma: [r, factor(luma_span) - r - b, b],
            black,
            cb: [cb_red, cb_green, cb_blue],
            cr: [cr_red, cr_green, cr_blue],
        }
    }

    /// Luma of a pixel.
    #[inline(always)]
    pub(super) fn luma(&self, pixel: [i32; 3]) -> u8 {
        (self.black + ((dot(self.luma, pixel) + (1 << (BITS - 1))) >> BITS)) as u8
    }

    /// Cb and Cr of 2^`log_count` pixels whose colours are summed, 4 pixels at most: their mean.
    #[inline(always)]
    pub(super) fn chroma(&self, sum: [i32; 3], log_count: u32) -> [u8; 2] {
        let bits = BITS + log_count;
        // Full range reaches 128 + 127.5.
        let level = |factors| (128 + ((dot(factors, sum) + (1 << (bits - 1))) >> bits)).min(255) as u8;
        [level(self.cb), level(self.cr)]
    }
}

#[inline(always)]
fn dot(a: [i32; 3], b: [i32; 3]) -> i32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight from the definition: Y' = Kr R + Kg G + Kb B, Cb = (B − Y') / 2 (1 − Kb), Cr likewise.
    fn by_definition(colour: Colour, [r, g, b]: [i32; 3]) -> [f64; 3] {
        let (kr, kb) = if colour.matrix == Matrix::Bt601 { (0.299, 0.114) } else { (0.2126, 0.0722) };
        let [r, g, b] = [r, g, b].map(|value| f64::from(value) / 255.0);
        let y = kr * r + (1.0 - kr - kb) * g + kb * b;
        let [cb, cr] = [(b - y) / (2.0 * (1.0 - kb)), (r - y) / (2.0 * (1.0 - kr))];
        match colour.range {
            Range::Limited => [16.0 + 219.0 * y, 128.0 + 224.0 * cb, 128.0 + 224.0 * cr],
            Range::Full => [255.0 * y, 128.0 + 255.0 * cb, 128.0 + 255.0 * cr],
        }
    }

    #[test]
    fn every_colour_is_converted_to_nearest() {
        for matrix in [Matrix::Bt601, Matrix::Bt709] {
            for range in [Range::Limited, Range::Full] {
                let (colour, steps) = (Colour { matrix, range }, (0..=255).step_by(5));
                let conversion = Conversion::new(colour);
                for pixel in steps.clone().flat_map(|r| {
                    let steps = steps.clone();
                    steps.clone().flat_map(move |g| steps.clone().map(move |b| [r, g, b]))
                }) {
                    let [cb, cr] = conversion.chroma(pixel.map(|value| 4 * value), 2);
                    assert_eq!([cb, cr], conversion.chroma(pixel, 0));
                    for (found, expected) in
                        [conversion.luma(pixel), cb, cr].into_iter().zip(by_definition(colour, pixel))
                    {
                        let expected = expected.min(255.0);
                        assert!((f64::from(found) - expected).abs() < 0.51, "{pixel:?}: {found} {expected}");
                    }
                }
                let grey = (0..=255).map(|value| conversion.chroma([value; 3], 0));
                assert!(grey.into_iter().all(|chroma| chroma == [128, 128]));
            }
        }
    }
}
