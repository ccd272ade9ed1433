//! Green from Y, Cb, Cr: exactly per pixel, or once per taxel.
//!
//! Kr and Kb are those of the matrix, and Kg = 1 − Kr − Kb. y, b, r are the samples less their zero level. Then
//!
//! G = p/q · y − B · b − C · r,  B = s · 2 Kb (1 − Kb) / Kg,  C = s · 2 Kr (1 − Kr) / Kg,
//!
//! For limited range p/q = 85/73 (255/219) and s = 255/224; for full range both are 1. Rounded to the nearest integer
//! (ties round up) it is
//!
//! round(G) = ⌊(p · y + w) / q⌋  with  w(b, r) = ⌊q/2 − q B b − q C r⌋,
//!
//! because p · y is an integer. So only w needs more than 16 bits, once for all pixels that share a chroma sample.

#[cfg(simd)]
use super::simd::{Cells, Factors, Simd};
pub(super) use vectors::Vectors;

/// The matrix of Y, Cb, Cr.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum YcbcrMatrix {
    /// ITU-R BT.601: Kr = 0.299, Kb = 0.114.
    #[default]
    Bt601,
    /// ITU-R BT.709: Kr = 0.2126, Kb = 0.0722.
    Bt709,
}

impl YcbcrMatrix {
    /// Returns the name of the matrix, such as `BT.601`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bt601 => "BT.601",
            Self::Bt709 => "BT.709",
        }
    }

    /// Returns the weights of red and blue in Y, Kr and Kb. The weight of green is 1 − Kr − Kb.
    pub const fn red_and_blue(self) -> (f64, f64) {
        match self {
            Self::Bt601 => (0.299, 0.114),
            Self::Bt709 => (0.2126, 0.0722),
        }
    }
}

/// The quantization range of Y, Cb, Cr.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
// It is exhaustive: values use all of their range, or a part of it.
pub enum QuantizationRange {
    /// Limited range: Y 16..=235, Cb and Cr 16..=240.
    #[default]
    Limited,
    /// Full range: 0..=255.
    Full,
}

/// The meaning of the numbers of a YCbCr stream, as its source states it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct YcbcrEncoding {
    /// The matrix.
    pub matrix: YcbcrMatrix,
    /// The quantization range.
    pub range: QuantizationRange,
}

/// Makes `$of($color)` at compile time for each of the four colors, so that there is no 128-bit division at run time.
macro_rules! of_color {
    ($of:path, $color:expr) => {
        match ($color.matrix, $color.range) {
            (YcbcrMatrix::Bt601, QuantizationRange::Limited) => {
                const { $of(YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Limited }) }
            }
            (YcbcrMatrix::Bt601, QuantizationRange::Full) => {
                const { $of(YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Full }) }
            }
            (YcbcrMatrix::Bt709, QuantizationRange::Limited) => {
                const { $of(YcbcrEncoding { matrix: YcbcrMatrix::Bt709, range: QuantizationRange::Limited }) }
            }
            (YcbcrMatrix::Bt709, QuantizationRange::Full) => {
                const { $of(YcbcrEncoding { matrix: YcbcrMatrix::Bt709, range: QuantizationRange::Full }) }
            }
        }
    };
}

/// q B and q C as exact fractions, and B, C rounded for 32-bit multiplies.
#[derive(Clone, Copy, Debug)]
struct Coefficients {
    /// Numerator and denominator of luma's factor, p and q.
    luma: (i32, i32),
    /// Zero level of luma.
    black: i32,
    /// q B = cb / denominator.
    cb: i64,
    /// q C = cr / denominator.
    cr: i64,
    denominator: i64,
}

impl Coefficients {
    const fn of(color: YcbcrEncoding) -> Self {
        // Kr and Kb in units of 1/10000.
        let (kr, kb) = match color.matrix {
            YcbcrMatrix::Bt601 => (2990_i64, 1140_i64),
            YcbcrMatrix::Bt709 => (2126, 722),
        };
        let kg = 10_000 - kr - kb;
        let (luma, black, scale) = match color.range {
            QuantizationRange::Limited => ((85, 73), 16, (73 * 255, 224)),
            QuantizationRange::Full => ((1, 1), 0, (1, 1)),
        };
        let cb = scale.0 * 2 * kb * (10_000 - kb);
        let cr = scale.0 * 2 * kr * (10_000 - kr);
        let denominator = scale.1 * kg * 10_000;
        let common = common_divisor(common_divisor(cb, cr), denominator);
        Self { luma, black, cb: cb / common, cr: cr / common, denominator: denominator / common }
    }
}

const fn common_divisor(mut a: i64, mut b: i64) -> i64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// A conversion from Y, Cb, Cr to green.
pub trait Conversion: Copy + Vectors<<Self as Conversion>::Sum> {
    /// The type that a taxel's pixels are gathered in.
    type Sum: Copy + Default + core::fmt::Debug;
    /// The type of what the pixels of one chroma sample share.
    type Chroma: Copy;

    /// Prepares one chroma sample.
    fn chroma(&self, cb: u8, cr: u8) -> Self::Chroma;

    /// Adds one pixel.
    fn add(&self, sum: &mut Self::Sum, y: u8, chroma: Self::Chroma);

    /// Returns the taxel sum of `pixels` gathered pixels: 0..=255 · pixels.
    fn total(&self, sum: &Self::Sum, pixels: u32) -> u32;
}

/// Fraction bits of the high and of the low part of [`Exact`]'s chroma factors: as many as 32-bit sums allow.
const HIGH_BITS: u32 = 17;
const LOW_BITS: u32 = 22;

/// Rounds every pixel to the nearest integer and clamps it to 0..=255, in 32-bit arithmetic.
///
/// The result equals that of the exact fractions for every Y, Cb, Cr (tested on all 2^24).
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    luma: i32,
    /// q B, high and low part.
    cb: (i32, i32),
    /// q C, high and low part.
    cr: (i32, i32),
    /// q/2 less the effect of luma's zero level, and half a unit against rounding of the factors.
    offset: (i32, i32),
    /// The highest p · y + w that is not clamped, and 2^22 / q rounded up: n / q = (n · reciprocal) >> 22 up to there.
    highest: i32,
    reciprocal: u32,
    /// The numbers of vector kernels.
    #[cfg(simd)]
    pub(super) factors: Factors,
}

impl Exact {
    /// Returns the conversion for streams of this color: one of four made at compile time.
    pub const fn new(color: YcbcrEncoding) -> Self {
        of_color!(Exact::of, color)
    }

    const fn of(color: YcbcrEncoding) -> Self {
        let c = Coefficients::of(color);
        let one = 1_i128 << (HIGH_BITS + LOW_BITS);
        let nearest = (one * c.cb as i128 + c.denominator as i128 / 2) / c.denominator as i128;
        let cb = split_at_low(nearest);
        let nearest = (one * c.cr as i128 + c.denominator as i128 / 2) / c.denominator as i128;
        let cr = split_at_low(nearest);
        // A value that is exactly an integer must not fall below it: half the least distance of any other value.
        let guard = one / (2 * c.denominator as i128);
        let half = one * c.luma.1 as i128 / 2;
        let offset = split_at_low(half + guard - one * (c.luma.0 * c.black) as i128);
        Self {
            luma: c.luma.0,
            cb,
            cr,
            offset,
            highest: 256 * c.luma.1 - 1,
            reciprocal: (1_u32 << 22).div_ceil(c.luma.1 as u32),
            #[cfg(simd)]
            factors: Factors::of(&c),
        }
    }
}

const fn split_at_low(x: i128) -> (i32, i32) {
    ((x >> LOW_BITS) as i32, (x & ((1 << LOW_BITS) - 1)) as i32)
}

impl Conversion for Exact {
    type Sum = u32;
    type Chroma = i32;

    #[inline(always)]
    fn chroma(&self, cb: u8, cr: u8) -> i32 {
        let (cb, cr) = (i32::from(cb) - 128, i32::from(cr) - 128);
        let low = self.offset.1 - self.cb.1 * cb - self.cr.1 * cr;
        let high = self.offset.0 - self.cb.0 * cb - self.cr.0 * cr;
        (high + (low >> LOW_BITS)) >> HIGH_BITS
    }

    #[inline(always)]
    fn add(&self, sum: &mut u32, y: u8, chroma: i32) {
        let n = (self.luma * i32::from(y) + chroma).max(0).min(self.highest);
        *sum += (n as u32 * self.reciprocal) >> 22;
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}

impl Vectors<u32> for Exact {
    #[cfg(simd)]
    #[inline(always)]
    fn add_cells(&self, sum: &mut u32, cells: &Cells<'_>, simd: Simd) -> bool {
        *sum += simd.exact(cells, &self.factors);
        true
    }
}

/// Fraction bits of the chroma factors that [`Factors`] splits, and of its offset.
#[cfg(simd)]
const CHROMA_BITS: u32 = 48;
#[cfg(simd)]
const OFFSET_BITS: u32 = 16;

#[cfg(simd)]
impl Factors {
    /// Returns the factors of vector kernels: those of [`Exact`] with fewer bits.
    ///
    /// The offset is that for Cb = Cr = 0. Rounded to 16 fraction bits, it gives the same w as exact fractions do.
    const fn of(c: &Coefficients) -> Self {
        let (cb, cr, denominator) = (c.cb as i128, c.cr as i128, c.denominator as i128);
        let factors = [
            (((cb << CHROMA_BITS) + denominator / 2) / denominator) as i64,
            (((cr << CHROMA_BITS) + denominator / 2) / denominator) as i64,
        ];
        let twice = (c.luma.1 - 2 * c.luma.0 * c.black) as i128 * denominator + 256 * (cb + cr);
        let offset = ((twice << OFFSET_BITS) + denominator) / (2 * denominator);
        Self::new(c.luma.0, factors, offset as i32)
    }
}

/// Sums Y, Cb and Cr, and converts them once per taxel.
///
/// The result is rounded to the nearest integer (ties round up) and clamped to 0..=255 · pixels. It differs from that
/// of [`Exact`] by per-pixel rounding and clipping.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    coefficients: Coefficients,
}

impl Linear {
    /// Returns the conversion for streams of this color: one of four made at compile time.
    pub const fn new(color: YcbcrEncoding) -> Self {
        Self { coefficients: of_color!(Coefficients::of, color) }
    }
}

impl Conversion for Linear {
    type Sum = [u32; 3];
    type Chroma = (u8, u8);

    #[inline(always)]
    fn chroma(&self, cb: u8, cr: u8) -> (u8, u8) {
        (cb, cr)
    }

    #[inline(always)]
    fn add(&self, sum: &mut [u32; 3], y: u8, (cb, cr): (u8, u8)) {
        sum[0] += u32::from(y);
        sum[1] += u32::from(cb);
        sum[2] += u32::from(cr);
    }

    fn total(&self, sum: &[u32; 3], pixels: u32) -> u32 {
        // 64 bits hold the result: pixels < 2^32 / (5 · 255), |q B| + |q C| < 10^2 in units of 1 / denominator < 2.7 ·
        // 10^8.
        let c = &self.coefficients;
        let level = |sum: u32, zero: i32| i64::from(sum) - i64::from(zero) * i64::from(pixels);
        let (p, q) = (i64::from(c.luma.0), i64::from(c.luma.1));
        let chroma = c.cb * level(sum[1], 128) + c.cr * level(sum[2], 128);
        // ⌊q/2 − chroma⌋, in which the half of an even denominator is kept exact.
        let w = (q * c.denominator - 2 * chroma).checked_div_euclid(2 * c.denominator).unwrap_or(0);
        let green = (p * level(sum[0], c.black) + w).checked_div_euclid(q).unwrap_or(0);
        green.clamp(0, 255 * i64::from(pixels)) as u32
    }
}

impl Vectors<[u32; 3]> for Linear {
    #[cfg(simd)]
    #[inline(always)]
    fn add_cells(&self, sum: &mut [u32; 3], cells: &Cells<'_>, simd: Simd) -> bool {
        let Some([y, cb, cr]) = cells.sums(simd) else { return false };
        *sum = [sum[0] + y, sum[1] + cb, sum[2] + cr];
        true
    }
}

mod vectors {
    /// Gathers pixels by vectors.
    ///
    /// The trait cannot be named outside, so that the interface is the same on every machine.
    pub trait Vectors<Sum> {
        /// Adds the pixels of cells by vectors and returns whether it did.
        #[cfg(simd)]
        fn add_cells(&self, sum: &mut Sum, cells: &super::Cells<'_>, simd: super::Simd) -> bool;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Every encoding.
    pub(in crate::green) const COLORS: [YcbcrEncoding; 4] = [
        YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Limited },
        YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Full },
        YcbcrEncoding { matrix: YcbcrMatrix::Bt709, range: QuantizationRange::Limited },
        YcbcrEncoding { matrix: YcbcrMatrix::Bt709, range: QuantizationRange::Full },
    ];

    /// Returns ⌊G + 1/2⌋ in exact fractions, straight from the definition.
    fn by_definition(color: YcbcrEncoding, y: u8, cb: u8, cr: u8) -> i128 {
        let (kr, kb) = match color.matrix {
            YcbcrMatrix::Bt601 => (2990, 1140),
            YcbcrMatrix::Bt709 => (2126, 722),
        };
        let kg: i128 = 10_000 - kr - kb;
        let (black, y_span, c_span) = match color.range {
            QuantizationRange::Limited => (16, 219, 224),
            QuantizationRange::Full => (0, 255, 255),
        };
        let denominator = 2 * y_span * c_span * kg * 10_000;
        let twice = 2
            * 255
            * ((i128::from(y) - black) * c_span * kg * 10_000
                - (i128::from(cb) - 128) * 2 * kb * (10_000 - kb) * y_span
                - (i128::from(cr) - 128) * 2 * kr * (10_000 - kr) * y_span);
        (twice + denominator / 2).div_euclid(denominator).clamp(0, 255)
    }

    #[test]
    fn every_chroma_and_luma_converts_as_the_exact_fractions_do() {
        for color in COLORS {
            let (exact, linear) = (Exact::new(color), Linear::new(color));
            for cb in 0..=255 {
                for cr in 0..=255 {
                    for y in 0..=255 {
                        let expected = by_definition(color, y, cb, cr) as u32;
                        let mut sum = 0;
                        exact.add(&mut sum, y, exact.chroma(cb, cr));
                        assert_eq!(sum, expected, "{color:?} exact {y} {cb} {cr}");
                        let sums = [y, cb, cr].map(u32::from);
                        assert_eq!(linear.total(&sums, 1), expected, "{color:?} linear {y} {cb} {cr}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_largest_sums_fit() {
        let pixels = u32::MAX / (5 * 255);
        for color in COLORS {
            for corner in 0..8 {
                let sample = |bit: u32| if corner >> bit & 1 == 1 { 255 } else { 0 };
                let (y, cb, cr) = (sample(0), sample(1), sample(2));
                let linear = Linear::new(color);
                let total = linear.total(&[y, cb, cr].map(|s| s * pixels), pixels);
                let one = by_definition(color, y as u8, cb as u8, cr as u8);
                assert!((i128::from(total) - one * i128::from(pixels)).abs() <= i128::from(pixels) / 2 + 1);
            }
        }
    }
}
