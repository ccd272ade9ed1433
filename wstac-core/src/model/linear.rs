//! Linear models, such as a linear SVM: a weighted sum of the sample for every class, or for every two classes.
//!
//! From word 16 on: the weighted sums (*rows*; one word): one for each class, or a single one for two classes (one against
//! the rest), or one for each pair of classes, 0 and 1, 0 and 2 … 1 and 2 … (one against one); a word of 0; then each
//! row's bias, an int64 (four words); then the weights, in blocks of up to [`BLOCK`] rows: for every two inputs, the two
//! weights of each row of the block (int16); or for every four inputs, the four of each (int8). Inputs are those of the frames
//! that the model needs, and for int8 zeros up to a multiple of four.
//!
//! One against the rest: the class with the highest sum wins, the lowest of several; of two classes with one row, the second
//! where it is above 0. One against one: each row is a vote, for its first class where it is above 0 and for its second
//! otherwise; the class with most votes wins, the lowest of several (as libsvm does).

use super::file::{HEADER_WORDS, Header, INPUTS, Labels, MOST_CLASSES, ModelError, part, word};

/// Rows that are summed up together: their sums fit a Cortex-M's registers.
pub const BLOCK: usize = 5;
/// The kinds' numbers in the file.
pub(super) const ONE_AGAINST_REST: u16 = 1;
pub(super) const ONE_AGAINST_ONE: u16 = 2;
/// What weights are: see the file's word 7.
const INT8: u16 = 1;
const INT16: u16 = 2;

/// A linear model that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct Linear<'a> {
    pub(super) labels: Labels<'a>,
    pub(super) header: Header,
    /// Four words a row.
    biases: &'a [[u16; 4]],
    weights: &'a [u16],
}

impl<'a> Linear<'a> {
    /// A linear model from its file's words, all of which are checked.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub const fn from_words(words: &'a [u16]) -> Result<Self, ModelError> {
        let header = match Header::read(words) {
            Ok(header) => header,
            Err(error) => return Err(error),
        };
        let classes = header.classes as usize;
        if header.kind != ONE_AGAINST_REST && header.kind != ONE_AGAINST_ONE {
            return Err(ModelError::Kind);
        }
        if header.number != INT8 && header.number != INT16 {
            return Err(ModelError::Header(7));
        }
        if header.trees != 0 {
            return Err(ModelError::Header(11));
        }
        let start = HEADER_WORDS + 2;
        if header.labels < start {
            return Err(ModelError::Part(HEADER_WORDS as u32));
        }
        let rows = word(words, HEADER_WORDS) as usize;
        let expected = match header.kind {
            ONE_AGAINST_REST if classes == 2 && rows == 1 => 1,
            ONE_AGAINST_REST => classes,
            _ => classes * (classes - 1) / 2,
        };
        if rows != expected || word(words, HEADER_WORDS + 1) != 0 {
            return Err(ModelError::Part(HEADER_WORDS as u32));
        }
        let inputs = header.inputs();
        let weights = if header.number == INT16 { rows * inputs } else { rows * inputs.div_ceil(4) * 2 };
        if header.labels != start + 4 * rows + weights {
            return Err(ModelError::Part(start as u32));
        }
        let parts = part(words, start, header.labels);
        let (biases, weights) = (part(parts, 0, 4 * rows), part(parts, 4 * rows, parts.len()));
        let (biases, _) = biases.as_chunks::<4>();
        // 700 products of int16 are below 2^40: with a bias below 2^62 no sum of them overflows.
        let mut left = biases;
        while let [bias, rest @ ..] = left {
            if bias_of(*bias).unsigned_abs() > 1 << 62 {
                return Err(ModelError::Overflow);
            }
            left = rest;
        }
        Ok(Self { labels: Labels::new(words, &header), header, biases, weights })
    }

    /// The class of a sample.
    pub fn classify(&self, sample: &[i16; INPUTS]) -> u8 {
        if self.header.kind == ONE_AGAINST_ONE {
            return self.most_votes(sample);
        }
        let (mut best, mut highest) = (0, i64::MIN);
        self.each_sum(sample, |row, sum| {
            if sum > highest {
                (best, highest) = (row as u8, sum);
            }
        });
        if self.biases.len() == 1 && self.header.classes == 2 { u8::from(highest > 0) } else { best }
    }

    fn most_votes(&self, sample: &[i16; INPUTS]) -> u8 {
        let mut votes = [0_u8; MOST_CLASSES];
        let (mut first, mut second) = (0, 1);
        self.each_sum(sample, |_, sum| {
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

    /// Gives every row's sum in order.
    fn each_sum(&self, sample: &[i16; INPUTS], mut give: impl FnMut(usize, i64)) {
        let inputs = sample.get(..self.header.inputs()).unwrap_or_default();
        let mut weights = self.weights;
        for (block, biases) in self.biases.chunks(BLOCK).enumerate() {
            let mut sums = [0_i64; BLOCK];
            let words =
                biases.len() * if self.header.number == INT16 { inputs.len() } else { inputs.len().div_ceil(4) * 2 };
            let (these, rest) = weights.split_at_checked(words).unwrap_or_default();
            weights = rest;
            if self.header.number == INT16 {
                sums_of_int16(&mut sums, these, biases.len(), inputs);
            } else {
                sums_of_int8(&mut sums, these, biases.len(), inputs);
            }
            for ((row, bias), sum) in (block * BLOCK..).zip(biases).zip(sums) {
                give(row, bias_of(*bias).wrapping_add(sum));
            }
        }
    }
}

/// An int64 of four words.
const fn bias_of(words: [u16; 4]) -> i64 {
    let [a, b, c, d] = words;
    a as i64 | (b as i64) << 16 | (c as i64) << 32 | (d as i64) << 48
}

/// Adds up a block of int16 rows; the plain way.
fn sums_of_int16(sums: &mut [i64; BLOCK], weights: &[u16], rows: usize, inputs: &[i16]) {
    for (weights, inputs) in weights.chunks_exact((2 * rows).max(1)).zip(inputs.as_chunks::<2>().0) {
        for (sum, &[a, b]) in sums.iter_mut().zip(weights.as_chunks::<2>().0) {
            // Two products of int16 may just exceed 32 bits.
            *sum += i64::from(i32::from(a as i16) * i32::from(inputs[0]))
                + i64::from(i32::from(b as i16) * i32::from(inputs[1]));
        }
    }
}

/// Adds up a block of int8 rows; the plain way.
fn sums_of_int8(sums: &mut [i64; BLOCK], weights: &[u16], rows: usize, inputs: &[i16]) {
    for (weights, inputs) in weights.chunks_exact((2 * rows).max(1)).zip(inputs.chunks(4)) {
        for (sum, words) in sums.iter_mut().zip(weights.as_chunks::<2>().0) {
            let bytes = words.iter().flat_map(|word| word.to_le_bytes());
            for (weight, &input) in bytes.zip(inputs) {
                *sum += i64::from(i32::from(weight as i8) * i32::from(input));
            }
        }
    }
}
