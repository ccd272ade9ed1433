//! The numbers of the `exact` kernels, in few enough bits for lanes of 16 and 32.
//!
//! As in `ycbcr`, round(G) = ⌊(p · y + w) / q⌋ with w = ⌊o − q B · Cb − q C · Cr⌋.
//! A lane of 32 bits holds w with 16 fraction bits, so that its high half is w.
//! q B and q C need 30 bits. The first 22 are the product of 7 bits and 15 bits, which the kernels multiply by in turn.
//! What such a product lacks has 15 bits more: that product has 32 fraction bits, is shifted right by 16, and is added.
//! The tests go over all 2^16 pairs of Cb and Cr, and over all 2^24 triples.

/// The numbers that a conversion multiplies by.
#[derive(Clone, Copy, Debug)]
pub(in crate::green) struct Factors {
    /// p.
    pub(in crate::green) luma: i8,
    /// The 7 bits that Cb and Cr are multiplied by first.
    pub(in crate::green) scale: [i8; 2],
    /// The factors of the results, with 16 fraction bits.
    pub(in crate::green) high: [i16; 2],
    /// The remainders of the factors, with 32 fraction bits.
    pub(in crate::green) low: [i16; 2],
    /// The result for Cb = Cr = 0, with 16 fraction bits.
    pub(in crate::green) offset: i32,
}

impl Factors {
    /// Splits q B and q C, which have 48 fraction bits. `offset` has 16.
    pub(in crate::green) const fn new(luma: i32, chroma: [i64; 2], offset: i32) -> Self {
        let (cb, cr) = (split(chroma[0]), split(chroma[1]));
        Self { luma: luma as i8, scale: [cb.0, cr.0], high: [cb.1, cr.1], low: [cb.2, cr.2], offset }
    }
}

/// Splits −`factor` into s · (h · 2^−16 + l · 2^−32), with the s of 7 bits that comes nearest.
const fn split(factor: i64) -> (i8, i16, i16) {
    let (mut nearest, mut least) = ((0, 0, 0), i64::MAX);
    let mut scale = 1;
    while scale < 128 {
        // The factor with 32 fraction bits, over the scale.
        let unit = scale << 16;
        let quotient = -((factor + unit / 2) / unit);
        let high = (quotient + (1 << 15)) >> 16;
        let error = (factor + quotient * unit).abs();
        if high >= i16::MIN as i64 && error < least {
            (nearest, least) = ((scale as i8, high as i16, (quotient - (high << 16)) as i16), error);
        }
        scale += 1;
    }
    nearest
}
