//! Weighted sums of a sample, as linear models and projections have them.
//!
//! Each row has a bias, an int64 (four halves). Weights follow, in blocks of up to [`BLOCK`] rows.
//!
//! For int16, a block has for every two inputs the two weights of each row. For int8, it has for every four inputs the
//! four weights of each row. They are in the order first, third, second, fourth, because a Cortex-M4 widens every other
//! byte. Inputs are those of the frames that the model needs; for int8, zeros follow up to a multiple of four.

use super::dot::{self, Int8, Int16, Weights};
use super::file::{INPUTS, ModelError, part};

/// The number of rows that are summed together. Each part of the sample is read once for them.
pub const BLOCK: usize = 2;
/// The types of weights: see the file's half 7.
pub(super) const INT8: u16 = 1;
pub(super) const INT16: u16 = 2;

/// Rows of weights that have been checked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a> {
    /// Two words per row.
    biases: &'a [[u32; 2]],
    weights: &'a [u32],
    /// Whether no sum can exceed 32 bits, whatever the sample is.
    fits_32_bits: bool,
}

impl<'a> Rows<'a> {
    pub(super) const fn halves(rows: usize, inputs: usize, number: u16) -> usize {
        rows * (4 + if number == INT16 { inputs } else { inputs.div_ceil(4) * 2 })
    }

    /// Creates rows from their words and checks that their sums cannot overflow.
    pub(super) const fn new(words: &'a [u32], rows: usize, inputs: usize, number: u16) -> Result<Self, ModelError> {
        let (biases, weights) = (part(words, 0, 2 * rows), part(words, 2 * rows, words.len()));
        let (biases, _) = biases.as_chunks::<2>();
        let row_words = Self::halves(1, inputs, number) / 2 - 2;
        let fits_32_bits = match largest(biases, weights, row_words, number == INT8) {
            // 700 products of int16 are below 2^40. With a bias below 2^62 no sum of them overflows.
            None => return Err(ModelError::Overflow),
            Some(largest) => largest <= i32::MAX as u64,
        };
        Ok(Self { biases, weights, fits_32_bits })
    }

    /// Returns the rows of words that [`Rows::new`] has checked. Their sums are added up in 64 bits.
    pub(super) fn checked(words: &'a [u32], rows: usize) -> Self {
        let (biases, weights) = words.split_at_checked(2 * rows).unwrap_or_default();
        Self { biases: biases.as_chunks::<2>().0, weights, fits_32_bits: false }
    }

    pub(super) const fn len(&self) -> usize {
        self.biases.len()
    }

    /// Passes every row's sum to `give` in order. It is inlined, so that a compiled-in model takes only the code of its
    /// own kind.
    #[inline(always)]
    pub(super) fn each_sum<const FAST: bool>(&self, number: u16, inputs: &[i16], give: impl FnMut(usize, i64)) {
        if number == INT16 {
            self.each_sum_of::<Int16, FAST>(inputs, give);
        } else {
            self.each_sum_of::<Int8, FAST>(inputs, give);
        }
    }

    #[inline(always)]
    pub(super) fn each_sum_of<W: Weights, const FAST: bool>(&self, inputs: &[i16], mut give: impl FnMut(usize, i64)) {
        let row_words = W::row_words(inputs.len());
        let (blocks, last) = self.biases.as_chunks::<BLOCK>();
        // This keeps the compiler from unrolling the loop for every block of a compiled-in model: flash matters more.
        let (blocks, mut left) = core::hint::black_box((blocks, self.weights));
        let mut row = 0;
        for biases in blocks {
            // `chunks_exact` does not serve: its panic for empty chunks was left over in fast code for a Cortex-M4.
            let weights;
            (weights, left) = left.split_at_checked(BLOCK * row_words).unwrap_or_default();
            let start = biases.map(bias_of);
            let sums = if FAST {
                dot::block::<W>(start, weights, inputs, self.fits_32_bits)
            } else {
                dot::both(start, dot::sums::<W, BLOCK>(weights, inputs, false))
            };
            for sum in sums {
                give(row, sum);
                row += 1;
            }
        }
        if let [bias] = last {
            let [sum] = dot::sums::<W, 1>(left, inputs, FAST && self.fits_32_bits);
            give(row, bias_of(*bias).wrapping_add(sum));
        }
    }
}

pub(super) fn inputs_of(sample: &[i16; INPUTS], inputs: usize) -> &[i16] {
    sample.get(..inputs).unwrap_or_default()
}

/// Returns the int64 of two words.
const fn bias_of([low, high]: [u32; 2]) -> i64 {
    low as i64 | (high as i64) << 32
}

/// Returns the largest sum that a row's bias and weights can reach, whatever the sample is; `None` if a bias is above
/// 2^62.
const fn largest(biases: &[[u32; 2]], weights: &[u32], row_words: usize, int8: bool) -> Option<u64> {
    let mut most = 0;
    let mut row = 0;
    while row < biases.len() {
        let bias = bias_of(biases[row]).unsigned_abs();
        if bias > 1 << 62 {
            return None;
        }
        // The words of a block's rows take turns.
        let rows = if biases.len() - row / BLOCK * BLOCK < BLOCK { biases.len() % BLOCK } else { BLOCK };
        let mut at = row / BLOCK * BLOCK * row_words + row % BLOCK;
        let mut sum = 0;
        let mut word = 0;
        while word < row_words && at < weights.len() {
            let bytes = weights[at].to_le_bytes();
            sum += if int8 {
                bytes[0].cast_signed().unsigned_abs() as u32
                    + bytes[1].cast_signed().unsigned_abs() as u32
                    + bytes[2].cast_signed().unsigned_abs() as u32
                    + bytes[3].cast_signed().unsigned_abs() as u32
            } else {
                (weights[at] as i16).unsigned_abs() as u32 + ((weights[at] >> 16) as i16).unsigned_abs() as u32
            };
            at += rows;
            word += 1;
        }
        let largest = bias + sum as u64 * 32_768;
        if largest > most {
            most = largest;
        }
        row += 1;
    }
    Some(most)
}
