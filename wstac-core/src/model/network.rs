//! Small networks: one or two hidden layers of weighted sums, each followed by a rectifier (ReLU), and a layer of
//! scores.
//!
//! From half 16 on a file, whose layout is version 2, holds:
//!
//! - the number of layers, 2 or 3 (one half)
//! - a half of 0
//! - for each layer: the number of its sums (one half), a shift of 0 to 47 (one half), and rows of weights, as linear
//!   models have them ([`super::linear_svm`])
//!
//! A hidden layer has 1 to [`MOST_WIDTH`] sums. Its values are the sums shifted right, at least 0 and at most 32767.
//! They are the inputs of the next layer; zeros follow up to a multiple of ten. Weights are int8, int16 or int32, the
//! same in all layers. The last layer has a sum for each class, or a single one for two classes, and a shift of 0. The
//! class with the highest sum wins, as in a linear model with a row for each class.

use super::ModelParts;
use super::file::{HEADER_HALVES, Header, MOST_CLASSES, ModelError, NETWORK, half, part};
use super::rows::{Highest, INT8, INT16, INT32, Rows, inputs_of};
use crate::params::FEATURES;

/// The most sums of a hidden layer.
pub const MOST_WIDTH: usize = 128;
/// The most values of a layer, with zeros up to a multiple of ten, which kernels read at a time.
const MOST_VALUES: usize = MOST_WIDTH.next_multiple_of(FEATURES);
/// The largest shift: sums of int16 are below 2^62.
const MOST_SHIFT: u16 = 47;

/// The most layers.
const MOST_LAYERS: usize = 3;
/// The half at which the first layer starts.
const START: usize = HEADER_HALVES + 2;

/// The values of a hidden layer.
type Values = [i16; MOST_VALUES];

/// A layer of a file.
struct Layer<'a> {
    rows: Rows<'a>,
    shift: u32,
    /// The number of values, with zeros up to a multiple of ten.
    values: usize,
    /// The half behind it.
    end: usize,
}

impl<'a> Layer<'a> {
    /// Checks a layer that starts at a half.
    const fn new(words: &'a [u32], at: usize, inputs: usize, header: &Header) -> Result<Self, ModelError> {
        let (sums, shift) = (half(words, at) as usize, half(words, at + 1));
        let end = at + 2 + Rows::halves(sums, inputs, header.number);
        if sums == 0 || sums > MOST_WIDTH || shift > MOST_SHIFT || end > header.end || !end.is_multiple_of(2) {
            return Err(ModelError::Part(at as u32));
        }
        let rows = attempt!(Rows::new(part(words, at / 2 + 1, end / 2), sums, inputs, header.number));
        Ok(Self { rows, shift: shift as u32, values: sums.next_multiple_of(FEATURES), end })
    }

    /// Returns the layer of a file that has been checked.
    fn checked(words: &'a [u32], at: usize, inputs: usize, number: u16, fits_32_bits: bool) -> Self {
        let (sums, shift) = (usize::from(half(words, at)), u32::from(half(words, at.wrapping_add(1))));
        let end = Rows::halves(sums, inputs, number).wrapping_add(at).wrapping_add(2);
        let rows = Rows::checked(part(words, at / 2 + 1, end / 2), sums, number, fits_32_bits);
        Self { rows, shift, values: sums.next_multiple_of(FEATURES), end }
    }

    /// Computes the values of a hidden layer, or scores; one of the two slices is empty. It is not inlined: all layers
    /// share one copy of the kernels.
    #[inline(never)]
    fn sums<const FAST: bool>(&self, inputs: &[i16], values: &mut [i16], scores: &mut [i64]) {
        self.rows.each_sum::<FAST>(inputs, |row, sum| {
            if let Some(value) = values.get_mut(row) {
                *value = sum.wrapping_shr(self.shift).clamp(0, i16::MAX.into()) as i16;
            }
            if let Some(score) = scores.get_mut(row) {
                *score = sum;
            }
        });
    }
}

/// A network that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    words: &'a [u32],
    pub(super) parts: ModelParts<'a>,
    /// The number of hidden layers.
    hidden: u8,
    /// Whether no sum of a layer can exceed 32 bits.
    fits_32_bits: [bool; MOST_LAYERS],
}

impl<'a> Network<'a> {
    /// Creates a network from its file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = attempt!(Header::read(words));
        if header.kind != NETWORK {
            return Err(ModelError::Kind { found: header.kind, expected: NETWORK });
        }
        if header.number != INT8 && header.number != INT16 && header.number != INT32 {
            return Err(ModelError::Header { half: 7, found: header.number });
        }
        if header.trees != 0 {
            return Err(ModelError::Header { half: 11, found: header.trees });
        }
        let layers = half(words, HEADER_HALVES) as usize;
        if header.end < START || layers < 2 || layers > MOST_LAYERS || half(words, HEADER_HALVES + 1) != 0 {
            return Err(ModelError::Part(HEADER_HALVES as u32));
        }
        let (mut number, mut at, mut inputs) = (0, START, header.inputs());
        let mut fits_32_bits = [false; MOST_LAYERS];
        while number < layers {
            let layer = attempt!(Layer::new(words, at, inputs, &header));
            let (sums, classes) = (half(words, at), header.classes as u16);
            if number + 1 == layers
                && (layer.end != header.end || layer.shift != 0 || (sums != classes && !(sums == 1 && classes == 2)))
            {
                return Err(ModelError::Part(at as u32));
            }
            fits_32_bits[number] = layer.rows.fits_32_bits;
            (at, inputs) = (layer.end, layer.values);
            number += 1;
        }
        let parts = attempt!(ModelParts::new(words, header));
        Ok(Self { words, parts, hidden: layers as u8 - 1, fits_32_bits })
    }

    /// Iterates over the number of sums of each layer, from the first hidden layer to the scores.
    pub fn widths(&self) -> impl Iterator<Item = usize> {
        let (words, number) = (self.words, self.parts.header.number);
        let (mut at, mut inputs) = (START, self.parts.header.inputs());
        (0..=self.hidden).map(move |_| {
            let layer = Layer::checked(words, at, inputs, number, false);
            let width = usize::from(half(words, at));
            (at, inputs) = (layer.end, layer.values);
            width
        })
    }

    /// Returns the class of a sample, either by packed instructions or by plain code. Each class's score is passed to
    /// `give`. It is not inlined, so that scores do not lie on the stack of other kinds of models.
    #[inline(never)]
    pub(super) fn decide<const FAST: bool, const N: usize>(
        &self,
        sample: &[i16; N],
        _all: bool,
        mut give: impl FnMut(u8, i64),
    ) -> u8 {
        let mut scores = [0; MOST_CLASSES];
        let count = self.scores::<FAST, N>(sample, &mut scores);
        let mut highest = Highest::new(count, self.parts.header.classes);
        scores.iter().take(count).enumerate().for_each(|(row, &sum)| highest.push(row, sum, &mut give));
        highest.class()
    }

    /// Computes all scores, and returns how many there are.
    #[inline(never)]
    fn scores<const FAST: bool, const N: usize>(&self, sample: &[i16; N], scores: &mut [i64; MOST_CLASSES]) -> usize {
        let (mut one, mut other) = ([0; MOST_VALUES], [0; MOST_VALUES]);
        let (mut values, mut next): (&mut Values, &mut Values) = (&mut one, &mut other);
        let first = inputs_of(sample, self.parts.header.inputs());
        let (mut at, mut count) = (START, first.len());
        for (number, &fits) in self.fits_32_bits.iter().enumerate() {
            let layer = Layer::checked(self.words, at, count, self.parts.header.number, fits);
            let inputs = if number == 0 { first } else { values.get(..count).unwrap_or_default() };
            if number == usize::from(self.hidden) {
                layer.sums::<FAST>(inputs, &mut [], scores);
                return usize::from(half(self.words, at));
            }
            layer.sums::<FAST>(inputs, next, &mut []);
            // Two hidden layers at most: each memory is written once, and zeros follow the values.
            (at, count) = (layer.end, layer.values);
            core::mem::swap(&mut values, &mut next);
        }
        0
    }
}
