//! Boosted trees: every tree adds its leaf to the score of its class, and the class with the highest score wins.
//!
//! From half 16 on a file holds:
//!
//! - the number of scores: one for each class, or a single one for two classes
//! - two halves: the score above which the second of two classes is the answer
//! - for each score its number of trees (one half) and its start (two halves)
//! - all trees of the first score, of the second and so on, as in [`super::trees`].
//!
//! Either leaves are int16, and starts and the bound int32; or all of them are float32. They are added in the order of
//! the trees, exactly as XGBoost does.

use super::ModelParts;
use super::descent;
use super::file::{self, BOOSTED, HEADER_HALVES, Header, ModelError, half, long};
use super::trees::{self, Leaves};
use super::walk;

/// Boosted trees that have been checked.
#[derive(Clone, Copy, Debug)]
pub struct Boosted<'a> {
    words: &'a [u32],
    pub(super) parts: ModelParts<'a>,
    /// The number of scores: that of the classes, or 1.
    scores: u8,
    /// The half at which the trees start.
    trees: usize,
    floats: bool,
}

/// The types of leaves: see the file's half 7.
const INT16: u16 = 2;
const FLOAT32: u16 = 3;

impl<'a> Boosted<'a> {
    /// Creates boosted trees from their file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = attempt!(Header::read(words));
        if header.kind != BOOSTED {
            return Err(ModelError::Kind { found: header.kind, expected: BOOSTED });
        }
        let (floats, leaves) = match header.number {
            INT16 => (false, Leaves::Integers),
            FLOAT32 => (true, Leaves::Floats),
            _ => return Err(ModelError::Header { half: 7, found: header.number }),
        };
        if header.end < HEADER_HALVES + 3 {
            return Err(ModelError::Part(HEADER_HALVES as u32));
        }
        let scores = half(words, HEADER_HALVES);
        if scores != header.classes as u16 && !(scores == 1 && header.classes == 2) {
            return Err(ModelError::Part(HEADER_HALVES as u32));
        }
        if floats && !trees::is_moderate(half(words, HEADER_HALVES + 2)) {
            return Err(ModelError::Overflow);
        }
        let trees = HEADER_HALVES + 3 + 3 * scores as usize;
        if trees > header.end {
            return Err(ModelError::Part(HEADER_HALVES as u32));
        }
        let mut all = 0_u32;
        let mut score = 0;
        while score < scores as usize {
            let entry = HEADER_HALVES + 3 + 3 * score;
            let count = half(words, entry) as u32;
            all += count;
            let start = long(words, entry + 1) as i32;
            let fits = if floats {
                trees::is_moderate(half(words, entry + 2))
            } else {
                start.unsigned_abs() as u64 + count as u64 * 32_768 <= i32::MAX as u64
            };
            if !fits {
                return Err(ModelError::Overflow);
            }
            score += 1;
        }
        if all != header.trees as u32 {
            return Err(ModelError::Header { half: 11, found: header.trees });
        }
        attempt!(trees::check(words, trees, &header, leaves));
        let parts = attempt!(ModelParts::new(words, header));
        Ok(Self { words, parts, scores: scores as u8, trees, floats })
    }

    /// Returns the class of a sample, either by the fast kernel or by plain code. Each class's score is passed to
    /// `give`; scores of float32 are in units of 2^-16.
    #[inline(always)]
    pub(super) fn decide<const FAST: bool, const N: usize>(
        &self,
        sample: &[i16; N],
        _all: bool,
        give: impl FnMut(u8, i64),
    ) -> u8 {
        if FAST && !(descent::IS_POSSIBLE && self.parts.header.shift == 0) {
            return self.decide::<false, N>(sample, false, give);
        }
        if self.floats {
            let fixed = |score: f32| (score * 65_536.0) as i64;
            let score = if FAST { Self::float_score_fast } else { Self::float_score };
            self.highest(sample, f32::from_bits, score, fixed, give)
        } else {
            let score = if FAST { Self::score_fast } else { Self::score };
            self.highest(sample, u32::cast_signed, score, i64::from, give)
        }
    }

    /// Returns the class with the highest score. `score` computes a score from its start and the place and number of
    /// its trees, and returns it with the place of the trees behind.
    #[inline(always)]
    fn highest<S: PartialOrd + Copy, const N: usize>(
        &self,
        sample: &[i16; N],
        of_bits: impl Fn(u32) -> S,
        score: impl Fn(&Self, S, usize, u16, &[i16; N]) -> (S, usize),
        fixed: impl Fn(S) -> i64,
        mut give: impl FnMut(u8, i64),
    ) -> u8 {
        let one = self.scores == 1 && self.parts.header.classes == 2;
        let bound = of_bits(long(self.words, HEADER_HALVES + 1));
        if one {
            // The first class's score is what the second one's must exceed.
            give(0, fixed(bound));
        }
        let (mut at, mut best, mut highest) = (self.trees, 0, None);
        for class in 0..self.scores {
            let entry = HEADER_HALVES + 3 + 3 * usize::from(class);
            let start = of_bits(long(self.words, entry + 1));
            let (sum, end) = score(self, start, at, half(self.words, entry), sample);
            at = end;
            give(class + u8::from(one), fixed(sum));
            if highest.is_none_or(|highest| sum > highest) {
                (best, highest) = (class, Some(sum));
            }
        }
        if one {
            return u8::from(highest.is_some_and(|score| score > bound));
        }
        best
    }

    fn score<const N: usize>(&self, mut sum: i32, mut at: usize, trees: u16, sample: &[i16; N]) -> (i32, usize) {
        let (shift, bits) = (self.parts.header.shift, trees::bits_for::<N>(&self.parts.header));
        for _ in 0..trees {
            let Ok((start, end)) = trees::bounds(self.words, at, self.parts.header.end, shift) else { break };
            let leaf = walk::leaf::<1, N>(self.words, start, shift, bits, sample);
            // Starts and leaves fit 32 bits together, which has been checked once.
            sum = sum.wrapping_add(i32::from(half(self.words, leaf) as i16));
            at = end;
        }
        (sum, at)
    }

    fn float_score<const N: usize>(&self, mut sum: f32, mut at: usize, trees: u16, sample: &[i16; N]) -> (f32, usize) {
        let (shift, bits) = (self.parts.header.shift, trees::bits_for::<N>(&self.parts.header));
        for _ in 0..trees {
            let Ok((start, end)) = trees::bounds(self.words, at, self.parts.header.end, shift) else { break };
            sum += f32::from_bits(long(self.words, walk::leaf::<2, N>(self.words, start, shift, bits, sample)));
            at = end;
        }
        (sum, at)
    }

    #[allow(unsafe_code)]
    fn score_fast<const N: usize>(&self, sum: i32, at: usize, trees: u16, sample: &[i16; N]) -> (i32, usize) {
        // SAFETY: the trees have been checked, and so many belong to the score; the shift is 0.
        unsafe { descent::sum(self.words, at, trees, sum, file::start(sample)) }
    }

    #[allow(unsafe_code)]
    fn float_score_fast<const N: usize>(&self, sum: f32, at: usize, trees: u16, sample: &[i16; N]) -> (f32, usize) {
        // SAFETY: the trees have been checked, and so many belong to the score; the shift is 0.
        unsafe { descent::sum_floats(self.words, at, trees, sum, file::start(sample)) }
    }
}
