//! The optional part of a model file that says how sure an answer is, and whether a sample is like those of the
//! training.
//!
//! It starts at the first even half behind the part of the model's kind. Where that part ends at an odd half, one half
//! of 0 follows. The calibration holds:
//!
//! | half | content |
//! | --- | --- |
//! | 0–1 | factor of scores, above 0 |
//! | 2 | low byte: shift of scores, 0 to 31; high byte: shift of products, 0 to 63 |
//! | 3 | dimensions of the projection, 0 to [`MOST_DIMENSIONS`] |
//! | 4– | the projection, if it has dimensions |
//! | the last two | the half of the file at which the kind's part ends |
//!
//! Scores are a linear model's sums, the numbers of votes, or the sums of leaves; float32 is taken in units of 2^-16,
//! rounded toward 0. If one number tells two classes apart, the score of the first class is 0, or the number that the
//! second class must exceed. A class's weight is e^-x, where x in units of 2^-20 is the factor times the score's
//! distance from the highest score: the distance is shifted right, limited to 32 bits, multiplied by the factor,
//! shifted right again and limited to 32 bits. The confidence is the share of the answer in the sum of all weights.
//!
//! The projection tells whether a sample is known. From half 4 on it holds:
//!
//! | half | content |
//! | --- | --- |
//! | 4 | shift of sums, 1 to 40 |
//! | 5 | 1 if every class has a limit of its own, else 0 |
//! | 6–7 | largest squared distance of a known sample |
//! | 8– | a row of int16 weights for every dimension, as linear models have them ([`super::linear_svm`]) |
//! | … | the mean of each class, an int16 for every dimension; 0 behind an odd number |
//! | … | with limits: for each class, the largest squared distance of a known sample, two halves each |
//!
//! A row's sum is shifted right; ties round up. The differences from the mean of the answer's class, limited to ±8191,
//! are squared and added up. A sample is known if the result is at most the largest squared distance: that of the
//! answer's class if there are limits. So a sample that is near the mean of another class than the answer is unknown,
//! too.

use super::file::{Header, ModelError, half, long, part};
use super::place::{Place, squared};
use super::rows::{INT16, Rows, inputs_of};
use crate::exp::{EXP_ONE, exp_of_negative};

/// The most dimensions of a projection.
pub const MOST_DIMENSIONS: usize = 32;
/// The number one, in units of a confidence.
pub const CONFIDENCE_ONE: u16 = 1 << 15;
/// The halves in front of the projection, and in front of its rows.
const START: usize = 4;
const ROWS_START: usize = 8;
/// Fraction bits of weights. The sum of 64 of them is multiplied by a weight in 64 bits.
const WEIGHT_BITS: u32 = 24;
const WEIGHT_ONE: u64 = 1 << WEIGHT_BITS;

/// The calibration of a model, which has been checked; nothing for a model without one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calibration<'a> {
    /// Its words without the last one; none for a model without a calibration.
    words: &'a [u32],
}

/// Returns the half at which the kind's part of a file with a calibration ends.
pub(super) const fn start(words: &[u32], labels: usize) -> Result<usize, ModelError> {
    let error = Err(ModelError::Calibration(labels as u32));
    if !labels.is_multiple_of(2) || labels < super::file::HEADER_HALVES + 2 {
        return error;
    }
    let end = long(words, labels - 2) as usize;
    if end < super::file::HEADER_HALVES || end > labels - 2 {
        return error;
    }
    if !end.is_multiple_of(2) && half(words, end) != 0 {
        return Err(ModelError::Calibration(end as u32));
    }
    Ok(end)
}

impl<'a> Calibration<'a> {
    /// Creates the calibration of a file and checks all of it.
    pub(super) const fn new(words: &'a [u32], header: &Header) -> Result<Self, ModelError> {
        if header.end == header.labels {
            return Ok(Self { words: &[] });
        }
        let first = header.end.div_ceil(2);
        let error = Err(ModelError::Calibration(2 * first as u32));
        let words = part(words, first, header.labels / 2 - 1);
        if words.len() < START / 2 || words[0] == 0 {
            return error;
        }
        let (before, behind) = (half(words, 2) & 0xFF, half(words, 2) >> 8);
        let dimensions = half(words, 3) as usize;
        if before > 31 || behind > 63 || dimensions > MOST_DIMENSIONS {
            return error;
        }
        if dimensions == 0 {
            return if words.len() == START / 2 { Ok(Self { words }) } else { error };
        }
        let rows = Rows::halves(dimensions, header.inputs(), INT16) / 2;
        let means = header.classes as usize * dimensions.div_ceil(2);
        let limits = match half(words, START + 1) {
            0 => 0,
            1 => header.classes as usize,
            _ => return error,
        };
        if words.len() != ROWS_START / 2 + rows + means + limits {
            return error;
        }
        let shift = half(words, START);
        if shift == 0 || shift > 40 {
            return error;
        }
        let rows = part(words, ROWS_START / 2, ROWS_START / 2 + rows);
        attempt!(Rows::new(rows, dimensions, header.inputs(), INT16));
        Ok(Self { words })
    }

    pub(super) const fn is_some(&self) -> bool {
        !self.words.is_empty()
    }

    /// Returns the number of dimensions of the projection; 0 without one.
    pub(super) const fn dimensions(&self) -> u8 {
        half(self.words, 3) as u8
    }

    /// Returns a softmax that has no score yet.
    pub(super) const fn softmax(&self) -> Softmax {
        let shifts = half(self.words, 2);
        Softmax { factor: long(self.words, 0), before: shifts as u8, behind: (shifts >> 8) as u8, highest: 0, sum: 0 }
    }

    /// Returns whether a sample is like those of the training that have this class; `None` if the file does not tell.
    #[inline(never)]
    pub(super) fn is_known<const FAST: bool, const N: usize>(
        &self,
        sample: &[i16; N],
        header: &Header,
        class: u8,
    ) -> Option<bool> {
        if self.dimensions() == 0 {
            return None;
        }
        let mean = self.mean(header, class);
        let mut distance = 0_u32;
        self.each_number::<FAST, N>(sample, header, |dimension, at| {
            let mean = i64::from(half(self.words, mean.wrapping_add(dimension)) as i16);
            distance = distance.wrapping_add(squared(at.wrapping_sub(mean)));
        });
        Some(distance <= self.limit(header, class))
    }

    /// Returns the place of a sample in the projection; `None` without one.
    #[inline(never)]
    pub(super) fn place<const FAST: bool, const N: usize>(&self, sample: &[i16; N], header: &Header) -> Option<Place> {
        let mut place = Place::origin(self.dimensions());
        self.each_number::<FAST, N>(sample, header, |dimension, at| {
            place.set(dimension, at.clamp(i16::MIN.into(), i16::MAX.into()) as i16);
        });
        (self.dimensions() > 0).then_some(place)
    }

    /// Returns the mean of a class's places; `None` without a projection or such a class.
    pub(super) fn mean_place(&self, header: &Header, class: u8) -> Option<Place> {
        let mean = self.mean(header, class);
        let mut place = Place::origin(self.dimensions());
        for dimension in 0..usize::from(self.dimensions()) {
            place.set(dimension, half(self.words, mean.wrapping_add(dimension)) as i16);
        }
        (self.dimensions() > 0 && class < header.classes).then_some(place)
    }

    /// Returns the half at which the mean of a class starts.
    #[inline(always)]
    fn mean(&self, header: &Header, class: u8) -> usize {
        let classes = usize::from(header.classes);
        let words_of_mean = usize::from(self.dimensions()).div_ceil(2);
        let limits = if self.has_limits() { classes } else { 0 };
        let behind = classes.wrapping_mul(words_of_mean).wrapping_add(limits);
        let means = self.words.len().saturating_sub(behind);
        usize::from(class).wrapping_mul(words_of_mean).wrapping_add(means).wrapping_mul(2)
    }

    #[inline(always)]
    fn has_limits(&self) -> bool {
        half(self.words, START + 1) == 1
    }

    /// Returns the largest squared distance of a known sample of a class.
    #[inline(always)]
    fn limit(&self, header: &Header, class: u8) -> u32 {
        let limits = self.words.len().saturating_sub(header.classes.into());
        let own = self.words.get(limits.wrapping_add(class.into())).filter(|_| self.has_limits());
        own.copied().unwrap_or_else(|| long(self.words, START + 2))
    }

    /// Passes every number of a sample's place to `give`, with its dimension.
    #[inline(always)]
    fn each_number<const FAST: bool, const N: usize>(
        &self,
        sample: &[i16; N],
        header: &Header,
        mut give: impl FnMut(usize, i64),
    ) {
        let shift = u32::from(half(self.words, START));
        let dimensions = usize::from(self.dimensions());
        let rows = Rows::checked(self.words.get(ROWS_START / 2..).unwrap_or_default(), dimensions, INT16, false);
        rows.each_sum_of::<INT16, FAST>(inputs_of(sample, header.inputs()), |dimension, sum| {
            // Sums are below 2^63 by far.
            give(dimension, sum.wrapping_add(1_i64.wrapping_shl(shift.wrapping_sub(1))).wrapping_shr(shift));
        });
    }
}

/// Turns scores into a probability, one after another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Softmax {
    factor: u32,
    before: u8,
    behind: u8,
    highest: i64,
    /// The weights of all scores so far, in units of 2^-24; that of the highest is 1. It is 0 before the first score.
    sum: u64,
}

impl Softmax {
    #[inline(never)]
    pub(super) fn push(&mut self, score: i64) {
        if self.sum == 0 || score > self.highest {
            // At most 64 weights in front, each at most 1: below 2^30, times 2^24.
            let before = self.sum.wrapping_mul(self.weight(score, self.highest));
            self.sum = (before.wrapping_add(WEIGHT_ONE / 2) >> WEIGHT_BITS).wrapping_add(WEIGHT_ONE);
            self.highest = score;
        } else {
            self.sum = self.sum.wrapping_add(self.weight(self.highest, score));
        }
    }

    /// Returns the weight of a score beside a higher one, in units of 2^-24.
    fn weight(&self, higher: i64, score: i64) -> u64 {
        // The distance of two int64 is a uint64.
        let distance = higher.wrapping_sub(score).cast_unsigned().wrapping_shr(self.before.into());
        let product = distance.min(u32::MAX.into()).wrapping_mul(self.factor.into());
        let x = product.wrapping_shr(self.behind.into()).min(u32::MAX.into()) as u32;
        const { assert!(EXP_ONE == 1 << 31) };
        u64::from(exp_of_negative(x) >> (31 - WEIGHT_BITS))
    }

    /// Returns the probability of a score, in units of 2^-15. It is below 1: nothing is certain.
    pub(super) fn probability(&self, score: i64) -> u16 {
        let weight = self.weight(self.highest, score.min(self.highest)) << 15;
        let share = weight.wrapping_add(self.sum / 2).checked_div(self.sum).unwrap_or(0);
        share.min(u64::from(CONFIDENCE_ONE) - 1) as u16
    }

    /// Returns the probability of the highest score, in units of 2^-15.
    pub(super) fn confidence(&self) -> u16 {
        self.probability(self.highest)
    }
}
