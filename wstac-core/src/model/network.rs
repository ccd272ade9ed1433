//! Small networks: one or two hidden layers of weighted sums, each followed by a rectifier (ReLU), and a layer of scores.
//!
//! From half 16 on a file, whose layout is version 2, holds:
//!
//! - the number of layers, 2 or 3 (one half)
//! - a half of 0
//! - for each layer: the number of its sums (one half), a shift of 0 to 47 (one half), and rows of weights, as linear
//!   models have them ([`super::linear_svm`])
//!
//! A hidden layer has 1 to [`MOST_WIDTH`] sums. Its values are the sums shifted right, at least 0 and at most 32767. They
//! are the inputs of the next layer; zeros follow up to a multiple of ten. Weights are int8, int16 or int32, the same in
//! all layers. The last layer has a sum for each class, or a single one for two classes, and a shift of 0. The class with the
//! highest sum wins, as in a linear model with a row for each class.

use super::calibration::Calibration;
use super::file::{HEADER_HALVES, Header, INPUTS, ModelError, NETWORK, half, part};
use super::labels::Labels;
use super::rows::{INT8, INT16, INT32, Rows, inputs_of};
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
        match Rows::new(part(words, at / 2 + 1, end / 2), sums, inputs, header.number) {
            Ok(rows) => Ok(Self { rows, shift: shift as u32, values: sums.next_multiple_of(FEATURES), end }),
            Err(error) => Err(error),
        }
    }

    /// Returns the layer of a file that has been checked.
    fn checked(words: &'a [u32], at: usize, inputs: usize, number: u16, fits_32_bits: bool) -> Self {
        let (sums, shift) = (usize::from(half(words, at)), u32::from(half(words, at.wrapping_add(1))));
        let end = Rows::halves(sums, inputs, number).wrapping_add(at).wrapping_add(2);
        let rows = part(words, at / 2 + 1, end / 2);
        let values = sums.next_multiple_of(FEATURES);
        Self { rows: Rows::checked(rows, sums, number, fits_32_bits), shift, values, end }
    }

    /// Computes the values of a hidden layer. It is not inlined: hidden layers share one copy of the kernels.
    #[inline(never)]
    fn values<'v, const FAST: bool>(&self, inputs: &[i16], values: &'v mut Values) -> &'v [i16] {
        self.rows.each_sum::<FAST>(inputs, |row, sum| {
            if let Some(value) = values.get_mut(row) {
                *value = sum.wrapping_shr(self.shift).clamp(0, i16::MAX.into()) as i16;
            }
        });
        values.get(..self.values).unwrap_or_default()
    }
}

/// A network that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    words: &'a [u32],
    pub(super) labels: Labels<'a>,
    pub(super) header: Header,
    pub(super) calibration: Calibration<'a>,
    layers: u8,
    /// Whether no sum of a layer can exceed 32 bits.
    fits_32_bits: [bool; MOST_LAYERS],
}

impl<'a> Network<'a> {
    /// Creates a network from its file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = match Header::read(words) {
            Ok(header) => header,
            Err(error) => return Err(error),
        };
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
        let (mut at, mut inputs) = (START, header.inputs());
        let mut fits_32_bits = [false; MOST_LAYERS];
        let mut number = 0;
        while number < layers {
            let layer = match Layer::new(words, at, inputs, &header) {
                Ok(layer) => layer,
                Err(error) => return Err(error),
            };
            let (sums, classes) = (half(words, at), header.classes as u16);
            if number + 1 == layers
                && (layer.end != header.end || layer.shift != 0 || (sums != classes && !(sums == 1 && classes == 2)))
            {
                return Err(ModelError::Part(at as u32));
            }
            fits_32_bits[number] = layer.rows.fits_32_bits();
            (at, inputs) = (layer.end, layer.values);
            number += 1;
        }
        let calibration = match Calibration::new(words, &header) {
            Ok(calibration) => calibration,
            Err(error) => return Err(error),
        };
        Ok(Self { words, labels: Labels::new(words, &header), header, calibration, layers: layers as u8, fits_32_bits })
    }

    /// Returns the class of a sample, either by packed instructions or by plain code. Each class's score is passed to
    /// `give`.
    #[inline(always)]
    pub(super) fn decide<const FAST: bool>(&self, sample: &[i16; INPUTS], _all: bool, give: impl FnMut(u8, i64)) -> u8 {
        let mut values = [0; MOST_VALUES];
        let (scores, count) = self.hidden::<FAST>(sample, &mut values);
        scores.highest::<FAST>(values.get(..count).unwrap_or_default(), self.header.classes, give)
    }

    /// Computes the values of the last hidden layer, and returns the rows of the scores and how many inputs they have.
    /// It is not inlined, so that the values of the first layer do not lie on the stack of scores.
    #[inline(never)]
    fn hidden<const FAST: bool>(&self, sample: &[i16; INPUTS], values: &mut Values) -> (Rows<'a>, usize) {
        let (inputs, number) = (inputs_of(sample, self.header.inputs()), self.header.number);
        let [fit_first, fit_second, fit_third] = self.fits_32_bits;
        let first = Layer::checked(self.words, START, inputs.len(), number, fit_first);
        let second = Layer::checked(self.words, first.end, first.values, number, fit_second);
        if usize::from(self.layers) < MOST_LAYERS {
            first.values::<FAST>(inputs, values);
            return (second.rows, first.values);
        }
        let mut inner = [0; MOST_VALUES];
        second.values::<FAST>(first.values::<FAST>(inputs, &mut inner), values);
        let third = Layer::checked(self.words, second.end, second.values, number, fit_third);
        (third.rows, second.values)
    }
}
