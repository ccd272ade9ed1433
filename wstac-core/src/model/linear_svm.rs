//! Linear models, such as a linear SVM: a weighted sum of the sample for every class, or for every pair of classes.
//!
//! From half 16 on a file holds:
//!
//! - the number of weighted sums (*rows*; one half), see below
//! - a half of 0
//! - the rows: their biases and weights, see below
//!
//! There is one row for each class, or a single one for two classes (one-vs-rest). Or there is one for each pair of
//! classes, 0 and 1, 0 and 2 … 1 and 2 … (one-vs-one).
//!
//! Each row has a bias, an int64 (four halves). Weights follow, in blocks of up to [`BLOCK`] rows. For int16, a block
//! has for every two inputs the two weights of each row. For int8, it has for every four inputs the four weights of
//! each row. They are in the order first, third, second, fourth, because a Cortex-M4 widens every other byte. Inputs
//! are those of the frames that the model needs; for int8, zeros follow up to a multiple of four. For int32, each row
//! is two rows of int16: its sum is that of the first times 2^15, and that of the second.
//!
//! In one-vs-rest, the class with the highest sum wins; if there are several, the lowest. Of two classes with one row,
//! the second wins if the sum is above 0. In one-vs-one, each row is a vote: for its first class if the sum is above 0,
//! and for its second otherwise. The class with most votes wins; if there are several, the lowest (as in libsvm).

use super::ModelParts;
use super::file::{HEADER_HALVES, Header, MOST_CLASSES, ModelError, ONE_AGAINST_ONE, ONE_AGAINST_REST, half, part};
pub use super::rows::BLOCK;
use super::rows::{Highest, INT8, INT16, INT32, Rows, inputs_of};

/// A linear model that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct LinearSvm<'a> {
    pub(super) parts: ModelParts<'a>,
    rows: Rows<'a>,
}

impl<'a> LinearSvm<'a> {
    /// Creates a linear model from its file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = attempt!(Header::read(words));
        let classes = header.classes as usize;
        if header.kind != ONE_AGAINST_REST && header.kind != ONE_AGAINST_ONE {
            return Err(ModelError::Kind { found: header.kind, expected: ONE_AGAINST_REST });
        }
        if header.number != INT8 && header.number != INT16 && header.number != INT32 {
            return Err(ModelError::Header { half: 7, found: header.number });
        }
        if header.trees != 0 {
            return Err(ModelError::Header { half: 11, found: header.trees });
        }
        let start = HEADER_HALVES + 2;
        if header.end < start {
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
        if header.end != start + Rows::halves(rows, header.inputs(), header.number) {
            return Err(ModelError::Part(start as u32));
        }
        let words_of_rows = part(words, start / 2, header.end / 2);
        let rows = attempt!(Rows::new(words_of_rows, rows, header.inputs(), header.number));
        Ok(Self { parts: attempt!(ModelParts::new(words, header)), rows })
    }

    /// Returns the class of a sample, either by packed instructions or by plain code. Each class's score is passed to
    /// `give`.
    #[inline(always)]
    pub(super) fn decide<const FAST: bool, const N: usize>(
        &self,
        sample: &[i16; N],
        _all: bool,
        mut give: impl FnMut(u8, i64),
    ) -> u8 {
        if self.parts.header.kind == ONE_AGAINST_ONE {
            return self.most_votes::<FAST, N>(sample, give);
        }
        let mut highest = Highest::new(self.rows.len(), self.parts.header.classes);
        self.each_sum::<FAST, N>(sample, |row, sum| highest.push(row, sum, &mut give));
        highest.class()
    }

    #[inline(always)]
    fn most_votes<const FAST: bool, const N: usize>(&self, sample: &[i16; N], mut give: impl FnMut(u8, i64)) -> u8 {
        let mut votes = [0_u8; MOST_CLASSES];
        let (mut first, mut second) = (0, 1);
        self.each_sum::<FAST, N>(sample, |_, sum| {
            let winner = if sum > 0 { first } else { second };
            if let Some(votes) = votes.get_mut(winner) {
                *votes = votes.wrapping_add(1);
            }
            second += 1;
            if second >= usize::from(self.parts.header.classes) {
                (first, second) = (first + 1, first + 2);
            }
        });
        let (mut best, mut most) = (0, 0);
        for (class, &votes) in (0..self.parts.header.classes).zip(&votes) {
            give(class, votes.into());
            if votes > most {
                (best, most) = (class, votes);
            }
        }
        best
    }

    /// Passes every row's sum to `give` in order.
    #[inline(always)]
    pub(super) fn each_sum<const FAST: bool, const N: usize>(&self, sample: &[i16; N], give: impl FnMut(usize, i64)) {
        self.rows.each_sum::<FAST>(inputs_of(sample, self.parts.header.inputs()), give);
    }
}
