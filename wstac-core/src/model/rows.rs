//! Weighted sums of a sample, as linear models and projections have them.
//!
//! Each row has a bias, an int64 (four halves). Weights follow, in blocks of up to [`BLOCK`] rows.
//!
//! For int16, a block has for every two inputs the two weights of each row. For int8, it has for every four inputs the
//! four weights of each row. They are in the order first, third, second, fourth, because a Cortex-M4 widens every other
//! byte. Inputs are those of the frames that the model needs; for int8, zeros follow up to a multiple of four.
//!
//! Weights of int32 are two rows of int16 for each of theirs, one behind the other: a sum is that of the first row
//! times 2^15, and that of the second. So fast kernels of int16 serve them, and weights have 30 bits and a sign.

use super::dot;
use super::file::{ModelError, part};

/// The number of rows that are summed together. Each part of the sample is read once for them.
pub const BLOCK: usize = 2;
/// The types of weights: see the file's half 7.
pub(super) const INT8: u16 = 1;
pub(super) const INT16: u16 = 2;
pub(super) const INT32: u16 = 4;
/// Bits of a weight of int32 in the second of its rows.
const LOW_BITS: u32 = 15;

/// Rows of weights that have been checked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a> {
    /// Two words per row.
    biases: &'a [[u32; 2]],
    weights: &'a [u32],
    /// Whether no sum can exceed 32 bits, whatever the sample is.
    pub(super) fits_32_bits: bool,
    /// The type of weights.
    number: u16,
}

impl<'a> Rows<'a> {
    pub(super) const fn halves(rows: usize, inputs: usize, number: u16) -> usize {
        match number {
            INT8 => rows * (4 + inputs.div_ceil(4) * 2),
            INT16 => rows * (4 + inputs),
            _ => 2 * rows * (4 + inputs),
        }
    }

    /// Creates rows from their words and checks that their sums cannot overflow.
    pub(super) const fn new(words: &'a [u32], rows: usize, inputs: usize, number: u16) -> Result<Self, ModelError> {
        let (rows, most_bias) = if number == INT32 { (2 * rows, 1 << 46) } else { (rows, 1 << 62) };
        let (biases, weights) = (part(words, 0, 2 * rows), part(words, 2 * rows, words.len()));
        let (biases, _) = biases.as_chunks::<2>();
        let row_words = dot::row_words(inputs, number);
        let fits_32_bits = match largest(biases, weights, row_words, number == INT8, most_bias) {
            // 1750 products of int16 are below 2^41. With a bias below 2^62 no sum of them overflows; one of 2^46 may
            // be multiplied by 2^15.
            None => return Err(ModelError::Overflow),
            Some(largest) => largest <= i32::MAX as u64,
        };
        Ok(Self { biases, weights, fits_32_bits, number })
    }

    /// Returns the rows of words that [`Rows::new`] has checked.
    pub(super) fn checked(words: &'a [u32], rows: usize, number: u16, fits_32_bits: bool) -> Self {
        let words_of_biases = if number == INT32 { 4 * rows } else { 2 * rows };
        let (biases, weights) = words.split_at_checked(words_of_biases).unwrap_or_default();
        Self { biases: biases.as_chunks::<2>().0, weights, fits_32_bits, number }
    }

    /// Returns the number of sums.
    pub(super) const fn len(&self) -> usize {
        if self.number == INT32 { self.biases.len() / 2 } else { self.biases.len() }
    }

    /// Passes every row's sum to `give` in order. It is inlined, so that a compiled-in model takes only the code of its
    /// own kind.
    #[inline(always)]
    pub(super) fn each_sum<const FAST: bool>(&self, inputs: &[i16], mut give: impl FnMut(usize, i64)) {
        if self.number == INT8 {
            return self.each_sum_of::<INT8, FAST>(inputs, give);
        }
        let (wide, mut high) = (self.number == INT32, 0_i64);
        self.each_sum_of::<INT16, FAST>(inputs, |row, sum| match (wide, row % 2) {
            (false, _) => give(row, sum),
            (true, 0) => high = sum,
            (true, _) => give(row / 2, high.wrapping_shl(LOW_BITS).wrapping_add(sum)),
        });
    }

    #[inline(always)]
    pub(super) fn each_sum_of<const NUMBER: u16, const FAST: bool>(
        &self,
        inputs: &[i16],
        mut give: impl FnMut(usize, i64),
    ) {
        let row_words = dot::row_words(inputs.len(), NUMBER);
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
                dot::block::<NUMBER>(start, weights, inputs, self.fits_32_bits)
            } else {
                dot::both(start, dot::sums::<NUMBER, BLOCK>(weights, inputs, false))
            };
            for sum in sums {
                give(row, sum);
                row += 1;
            }
        }
        if let [bias] = last {
            let [sum] = dot::sums::<NUMBER, 1>(left, inputs, FAST && self.fits_32_bits);
            give(row, bias_of(*bias).wrapping_add(sum));
        }
    }
}

/// Finds the class with the highest sum; if there are several, the lowest. Of two classes with one sum, the second wins
/// if it is above 0.
pub(super) struct Highest {
    /// Whether one sum decides: the second class's score over the first one's.
    one: bool,
    best: u8,
    sum: i64,
}

impl Highest {
    /// Begins with so many sums to come.
    pub(super) const fn new(sums: usize, classes: u8) -> Self {
        Self { one: sums == 1 && classes == 2, best: 0, sum: i64::MIN }
    }

    /// Takes the next sum, and passes its class's score to `give`; if it is the only one, that of the first class
    /// before.
    #[inline(always)]
    pub(super) fn push(&mut self, row: usize, sum: i64, mut give: impl FnMut(u8, i64)) {
        if self.one {
            give(0, 0);
        }
        give(row as u8 + u8::from(self.one), sum);
        if sum > self.sum {
            (self.best, self.sum) = (row as u8, sum);
        }
    }

    #[inline(always)]
    pub(super) fn class(&self) -> u8 {
        if self.one { u8::from(self.sum > 0) } else { self.best }
    }
}

pub(super) fn inputs_of<const N: usize>(sample: &[i16; N], inputs: usize) -> &[i16] {
    sample.get(..inputs).unwrap_or_default()
}

/// Returns the int64 of two words.
const fn bias_of([low, high]: [u32; 2]) -> i64 {
    low as i64 | (high as i64) << 32
}

/// Returns the largest sum that a row's bias and weights can reach, whatever the sample is; `None` if a bias is above
/// `most_bias`.
const fn largest(biases: &[[u32; 2]], weights: &[u32], row_words: usize, int8: bool, most_bias: u64) -> Option<u64> {
    let mut most = 0;
    let mut row = 0;
    while row < biases.len() {
        let bias = bias_of(biases[row]).unsigned_abs();
        if bias > most_bias {
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
