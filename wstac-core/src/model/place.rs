//! The place of a sample in a model's projection, in which samples of one texture lie close together.

use super::calibration::MOST_DIMENSIONS;

/// The number of units of a place in a standard deviation within a texture.
pub const PLACE_ONE: i16 = 64;
/// The largest difference of two places along a dimension. Squares of 32 of them fit 32 bits.
const MOST_DIFFERENCE: i64 = 8191;

/// The place of a sample in the projection of a calibrated model, or the mean of several places.
///
/// Numbers are in units of 1/64 of the standard deviation within a texture ([`PLACE_ONE`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Zeros behind the dimensions.
    numbers: [i16; MOST_DIMENSIONS],
    dimensions: u8,
}

impl Place {
    /// Returns the place of zeros with so many dimensions, at most [`MOST_DIMENSIONS`].
    pub(super) fn origin(dimensions: u8) -> Self {
        Self { numbers: [0; MOST_DIMENSIONS], dimensions: dimensions.min(MOST_DIMENSIONS as u8) }
    }

    /// Creates a place of these numbers; `None` for none or more than [`MOST_DIMENSIONS`].
    pub fn new(numbers: &[i16]) -> Option<Self> {
        let mut place = Self::origin(numbers.len().min(MOST_DIMENSIONS) as u8);
        place.numbers.get_mut(..numbers.len())?.copy_from_slice(numbers);
        (!numbers.is_empty()).then_some(place)
    }

    /// Returns its numbers, one for each dimension.
    pub fn numbers(&self) -> &[i16] {
        self.numbers.get(..usize::from(self.dimensions)).unwrap_or_default()
    }

    /// Returns the squared distance from another place. Differences along a dimension are limited to ±8191.
    pub fn squared_distance(&self, other: &Self) -> u32 {
        let pairs = self.numbers.iter().zip(&other.numbers);
        pairs.fold(0, |sum: u32, (&one, &other)| sum.wrapping_add(squared(i64::from(one).wrapping_sub(other.into()))))
    }

    pub(super) fn set(&mut self, dimension: usize, number: i16) {
        if let Some(place) = self.numbers.get_mut(dimension) {
            *place = number;
        }
    }

    /// Returns the mean of places, without the one of this number. Ties round up. Without places it is the origin.
    ///
    /// All must be places in one projection. At most 65,535 are used.
    pub fn mean(places: &[Self], without: Option<usize>) -> Self {
        let used = || {
            let all = places.iter().enumerate().take(u16::MAX.into());
            all.filter(|(number, _)| Some(*number) != without).map(|(_, place)| place)
        };
        let count = used().count() as i32;
        let mut mean = Self::origin(places.first().map_or(0, |place| place.dimensions));
        for dimension in 0..usize::from(mean.dimensions) {
            // At most 2^16 numbers of 16 bits.
            let sum = used()
                .fold(0_i32, |sum, place| sum.wrapping_add(place.numbers.get(dimension).copied().unwrap_or(0).into()));
            let (doubled, halves) = (i64::from(sum).wrapping_mul(2), i64::from(count));
            let rounded = doubled.wrapping_add(halves).checked_div_euclid(halves.wrapping_mul(2)).unwrap_or(0);
            mean.set(dimension, rounded as i16);
        }
        mean
    }
}

#[inline(always)]
pub(super) fn squared(difference: i64) -> u32 {
    let limited = difference.clamp(-MOST_DIFFERENCE, MOST_DIFFERENCE) as i32;
    limited.wrapping_mul(limited).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_that_of_real_numbers_with_ties_up() {
        let of = |numbers: [i16; 2]| Place::new(&numbers).unwrap();
        let places = [of([1, -1]), of([2, -2]), of([4, -5]), of([i16::MAX, i16::MIN])];
        assert_eq!(Place::mean(&places[..2], None).numbers(), [2, -1], "1.5 and -1.5");
        assert_eq!(Place::mean(&places[..3], None).numbers(), [2, -3], "2.33 and -2.67");
        assert_eq!(Place::mean(&places, Some(0)).numbers(), [10_924, -10_925], "10924.33 and -10925");
        assert_eq!(Place::mean(&places[3..], None), places[3]);
        assert_eq!(Place::mean(&places[..1], Some(0)).numbers(), [0, 0]);
        assert_eq!(Place::mean(&[], None).numbers(), []);
    }

    #[test]
    fn distances_are_limited_along_each_dimension() {
        let of = |numbers: &[i16]| Place::new(numbers).unwrap();
        assert_eq!(of(&[3, -4]).squared_distance(&of(&[0, 0])), 25);
        let far = [of(&[i16::MIN; MOST_DIMENSIONS]), of(&[i16::MAX; MOST_DIMENSIONS])];
        assert_eq!(far[0].squared_distance(&far[1]), 32 * 8191 * 8191);
        assert_eq!((Place::new(&[]), Place::new(&[0; MOST_DIMENSIONS + 1])), (None, None));
    }
}
