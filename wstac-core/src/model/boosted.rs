//! Boosted trees: every tree adds its leaf to the score of its class, and the class with the highest score wins.
//!
//! From word 16 on: scores (one for each class, or a single one for two classes), then two words: the score above which
//! the second of two classes is the answer; for each score its trees (one word) and what it starts with (two words);
//! then all trees of the first score, of the second and so on, as in [`super::trees`]. Leaves, starts and the bound are
//! int32 and leaves int16, or all float32, which are added in the order of the trees: exactly what XGBoost does.

use super::file::{HEADER_WORDS, Header, INPUTS, Labels, ModelError, long, word};
use super::trees::{self, Leaves};

/// Boosted trees that have been checked.
#[derive(Clone, Copy, Debug)]
pub struct Boosted<'a> {
    words: &'a [u16],
    pub(super) labels: Labels<'a>,
    pub(super) header: Header,
    /// Number of scores: that of the classes, or 1.
    scores: u8,
    /// Word at which the trees start.
    trees: usize,
    floats: bool,
}

/// The kind's number in the file.
pub(super) const KIND: u16 = 4;
/// What leaves are: see the file's word 7.
const INT16: u16 = 2;
const FLOAT32: u16 = 3;

impl<'a> Boosted<'a> {
    /// Boosted trees from their file's words, all of which are checked.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub const fn from_words(words: &'a [u16]) -> Result<Self, ModelError> {
        let header = match Header::read(words) {
            Ok(header) => header,
            Err(error) => return Err(error),
        };
        if header.kind != KIND {
            return Err(ModelError::Kind);
        }
        let (floats, leaf_words, leaves) = match header.number {
            INT16 => (false, 1, Leaves::Integers),
            FLOAT32 => (true, 2, Leaves::Floats),
            _ => return Err(ModelError::Header(7)),
        };
        if header.labels < HEADER_WORDS + 3 {
            return Err(ModelError::Part(HEADER_WORDS as u32));
        }
        let scores = word(words, HEADER_WORDS);
        if scores as u8 != header.classes && !(scores == 1 && header.classes == 2) || scores > 0xFF {
            return Err(ModelError::Part(HEADER_WORDS as u32));
        }
        if floats && !trees::is_moderate(word(words, HEADER_WORDS + 2)) {
            return Err(ModelError::Overflow);
        }
        let trees = HEADER_WORDS + 3 + 3 * scores as usize;
        if trees > header.labels {
            return Err(ModelError::Part(HEADER_WORDS as u32));
        }
        let mut all = 0_u32;
        let mut score = 0;
        while score < scores as usize {
            let entry = HEADER_WORDS + 3 + 3 * score;
            let count = word(words, entry) as u32;
            all += count;
            let start = long(words, entry + 1) as i32;
            let fits = if floats {
                trees::is_moderate(word(words, entry + 2))
            } else {
                start.unsigned_abs() as u64 + count as u64 * 32_768 <= i32::MAX as u64
            };
            if !fits {
                return Err(ModelError::Overflow);
            }
            score += 1;
        }
        if all != header.trees as u32 {
            return Err(ModelError::Header(11));
        }
        let mut at = trees;
        while all > 0 {
            let (start, end) = match trees::bounds(words, at, header.labels) {
                Ok(bounds) => bounds,
                Err(error) => return Err(error),
            };
            if let Err(error) = trees::check(words, start, end, header.shift, header.inputs(), leaf_words, leaves) {
                return Err(error);
            }
            at = end;
            all -= 1;
        }
        if at != header.labels {
            return Err(ModelError::Part(at as u32));
        }
        Ok(Self { words, labels: Labels::new(words, &header), header, scores: scores as u8, trees, floats })
    }

    /// The class of a sample; the lowest of those with the highest score.
    pub fn classify(&self, sample: &[i16; INPUTS]) -> u8 {
        if self.floats {
            self.highest(sample, f32::from_bits, |score, at| score + f32::from_bits(long(self.words, at)))
        } else {
            // Starts and leaves fit 32 bits together: checked once.
            self.highest(
                sample,
                |bits| bits as i32,
                |score, at| score.wrapping_add(i32::from(word(self.words, at) as i16)),
            )
        }
    }

    /// The class with the highest score of those that `add` sums up from leaves.
    #[inline(always)]
    fn highest<S: PartialOrd + Copy>(
        &self,
        sample: &[i16; INPUTS],
        of_bits: impl Fn(u32) -> S,
        add: impl Fn(S, usize) -> S,
    ) -> u8 {
        let (mut at, mut best, mut highest) = (self.trees, 0, None);
        for class in 0..self.scores {
            let entry = HEADER_WORDS + 3 + 3 * usize::from(class);
            let mut score = of_bits(long(self.words, entry + 1));
            for _ in 0..word(self.words, entry) {
                let Ok((start, end)) = trees::bounds(self.words, at, self.header.labels) else { break };
                let leaf = if self.floats {
                    trees::walk::<2>(self.words, start, self.header.shift, sample)
                } else {
                    trees::walk::<1>(self.words, start, self.header.shift, sample)
                };
                score = add(score, leaf.place());
                at = end;
            }
            if highest.is_none_or(|highest| score > highest) {
                (best, highest) = (class, Some(score));
            }
        }
        if self.scores == 1 {
            let bound = of_bits(long(self.words, HEADER_WORDS + 1));
            return u8::from(highest.is_some_and(|score| score > bound));
        }
        best
    }
}
