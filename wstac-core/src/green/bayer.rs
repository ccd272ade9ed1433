//! Bayer mosaics of 8, 10 and 12 bits. Only the green sites count, without demosaicing.

use super::{GreenChannel, full_scale, saturated_word, sum_pixels};
use crate::frame::{Rows, Run};

/// The order of a Bayer mosaic: the colors of its first row's first two sites, then those of its second row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[expect(missing_docs, reason = "each name is its meaning")]
// It is exhaustive: a cell has four orders.
pub enum BayerOrder {
    Rggb,
    Grbg,
    Gbrg,
    Bggr,
}

impl BayerOrder {
    /// All orders.
    pub const ALL: [Self; 4] = [Self::Rggb, Self::Grbg, Self::Gbrg, Self::Bggr];

    /// Returns the one of four values that is for this order; they are in the order of [`ALL`](Self::ALL).
    pub(super) const fn of<T: Copy>(self, [rggb, grbg, gbrg, bggr]: [T; 4]) -> T {
        match self {
            Self::Rggb => rggb,
            Self::Grbg => grbg,
            Self::Gbrg => gbrg,
            Self::Bggr => bggr,
        }
    }
}

/// A mosaic of `BITS` bits, with G = 2^BITS − 1. A site is one byte for 8 bits, and a little-endian 16-bit word
/// otherwise.
#[derive(Clone, Copy, Debug)]
pub struct Bayer<const BITS: u32> {
    /// The column of the green site in the even rows' cells.
    green_in_even_row: u8,
}

impl<const BITS: u32> Bayer<BITS> {
    /// Creates a mosaic of this order.
    pub const fn new(order: BayerOrder) -> Self {
        Self { green_in_even_row: matches!(order, BayerOrder::Rggb | BayerOrder::Bggr) as u8 }
    }
}

impl<const BITS: u32> GreenChannel for Bayer<BITS> {
    type Sum = u32;

    fn full_scale(&self) -> u32 {
        full_scale(BITS)
    }

    fn row_bytes(&self, width: u16) -> usize {
        usize::from(width) * if BITS == 8 { 1 } else { 2 }
    }

    fn cell(&self) -> u16 {
        2
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut u32, rows: &Rows<'_>, run: Run) {
        let second = (u16::from(self.green_in_even_row) ^ run.y) & 1 == 1;
        *sum += if BITS == 8 {
            let bytes = rows.row(run.y, usize::from(run.x), usize::from(run.width));
            sum_pixels(bytes, run.stride, |&[a, b]| u32::from(if second { b } else { a }))
        } else {
            let bytes = rows.row(run.y, 2 * usize::from(run.x), 2 * usize::from(run.width));
            sum_pixels(bytes, run.stride, |&[a, b, c, d]| saturated_word::<BITS>(if second { [c, d] } else { [a, b] }))
        };
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
