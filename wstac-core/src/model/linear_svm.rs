//! Linear models, such as a linear SVM: a weighted sum of the sample for every class, or for every pair of classes.
//!
//! From half 16 on a file holds:
//!
//! - the number of weighted sums (*rows*; one half), see below
//! - a half of 0
//! - each row's bias, an int64 (four halves)
//! - the weights, in blocks of up to [`BLOCK`] rows.
//!
//! There is one row for each class, or a single one for two classes (one-vs-rest). Or there is one for each pair of
//! classes, 0 and 1, 0 and 2 … 1 and 2 … (one-vs-one).
//!
//! For int16, a block has for every two inputs the two weights of each row. For int8, it has for every four inputs the
//! four weights of each row. They are in the order first, third, second, fourth, because a Cortex-M4 widens every other
//! byte. Inputs are those of the frames that the model needs; for int8, zeros follow up to a multiple of four.
//!
//! In one-vs-rest, the class with the highest sum wins; if there are several, the lowest. Of two classes with one row,
//! the second wins if the sum is above 0. In one-vs-one, each row is a vote: for its first class if the sum is above 0,
//! and for its second otherwise. The class with most votes wins; if there are several, the lowest (as in libsvm).

use super::dot::{self, Int8, Int16, Weights};
use super::file::{HEADER_HALVES, Header, INPUTS, MOST_CLASSES, ModelError, half, part};
use super::labels::Labels;

/// The number of rows that are summed together. Each part of the sample is read once for them.
pub const BLOCK: usize = 2;
/// The numbers of the kinds in the file.
pub(super) const ONE_AGAINST_REST: u16 = 1;
pub(super) const ONE_AGAINST_ONE: u16 = 2;
/// The types of weights: see the file's half 7.
const INT8: u16 = 1;
const INT16: u16 = 2;

/// A linear model that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct LinearSvm<'a> {
    pub(super) labels: Labels<'a>,
    pub(super) header: Header,
    /// Two words per row.
    biases: &'a [[u32; 2]],
    weights: &'a [u32],
    /// Whether no sum can exceed 32 bits, whatever the sample is.
    fits_32_bits: bool,
}

impl<'a> LinearSvm<'a> {
    /// Creates a linear model from its file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = match Header::read(words) {
            Ok(header) => header,
            Err(error) => return Err(error),
        };
        let classes = header.classes as usize;
        if header.kind != ONE_AGAINST_REST && header.kind != ONE_AGAINST_ONE {
            return Err(ModelError::Kind { found: header.kind, expected: ONE_AGAINST_REST });
        }
        if header.number != INT8 && header.number != INT16 {
            return Err(ModelError::Header { half: 7, found: header.number });
        }
        if header.trees != 0 {
            return Err(ModelError::Header { half: 11, found: header.trees });
        }
        let start = HEADER_HALVES + 2;
        if header.labels < start {
            return Err(ModelError::Part(HEADER_HALVES as u32));
        }
        let rows = half(words, HEADER_HALVES) as usize;
        let expected = match header.kind {
            ONE_AGAINST_REST if classes == 2 && rows == 1 => 1,
            ONE_AGAINST_REST => classes,
            _ => classes * (classes - 1) / 2,
        };
        if rows != expected || half(words, HEADER_HALVES + 1) != 0 {
            return Err(ModelError::Part(HEADER_HALVES as u32));
        }
        let inputs = header.inputs();
        let row_halves = if header.number == INT16 { inputs } else { inputs.div_ceil(4) * 2 };
        if header.labels != start + rows * (4 + row_halves) {
            return Err(ModelError::Part(start as u32));
        }
        let parts = part(words, start / 2, header.labels / 2);
        let (biases, weights) = (part(parts, 0, 2 * rows), part(parts, 2 * rows, parts.len()));
        let (biases, _) = biases.as_chunks::<2>();
        let fits_32_bits = match largest(biases, weights, row_halves / 2, header.number == INT8) {
            // 700 products of int16 are below 2^40. With a bias below 2^62 no sum of them overflows.
            None => return Err(ModelError::Overflow),
            Some(largest) => largest <= i32::MAX as u64,
        };
        Ok(Self { labels: Labels::new(words, &header), header, biases, weights, fits_32_bits })
    }

    /// Returns the class of a sample, either by packed instructions or by plain code.
    #[inline(always)]
    pub(super) fn decide<const FAST: bool>(&self, sample: &[i16; INPUTS]) -> u8 {
        if self.header.kind == ONE_AGAINST_ONE {
            return self.most_votes::<FAST>(sample);
        }
        let (mut best, mut highest) = (0, i64::MIN);
        self.each_sum::<FAST>(sample, |row, sum| {
            if sum > highest {
                (best, highest) = (row as u8, sum);
            }
        });
        if self.biases.len() == 1 && self.header.classes == 2 { u8::from(highest > 0) } else { best }
    }

    #[inline(always)]
    fn most_votes<const FAST: bool>(&self, sample: &[i16; INPUTS]) -> u8 {
        let mut votes = [0_u8; MOST_CLASSES];
        let (mut first, mut second) = (0, 1);
        self.each_sum::<FAST>(sample, |_, sum| {
            let winner = if sum > 0 { first } else { second };
            if let Some(votes) = votes.get_mut(winner) {
                *votes = votes.wrapping_add(1);
            }
            second += 1;
            if second >= usize::from(self.header.classes) {
                (first, second) = (first + 1, first + 2);
            }
        });
        let (mut best, mut most) = (0, 0);
        for (class, &votes) in (0..).zip(&votes) {
            if votes > most {
                (best, most) = (class, votes);
            }
        }
        best
    }

    /// Passes every row's sum to `give` in order. It is inlined, so that a compiled-in model takes only the code of its
    /// own kind.
    #[inline(always)]
    pub(super) fn each_sum<const FAST: bool>(&self, sample: &[i16; INPUTS], give: impl FnMut(usize, i64)) {
        if self.header.number == INT16 {
            self.each_sum_of::<Int16, FAST>(sample, give);
        } else {
            self.each_sum_of::<Int8, FAST>(sample, give);
        }
    }

    #[inline(always)]
    fn each_sum_of<W: Weights, const FAST: bool>(&self, sample: &[i16; INPUTS], mut give: impl FnMut(usize, i64)) {
        let inputs = sample.get(..self.header.inputs()).unwrap_or_default();
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
