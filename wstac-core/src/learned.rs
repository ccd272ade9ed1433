//! Textures that are learned from a few slides each, beside those of a model (SPEC §6).
//!
//! A calibrated model has a projection in which slides of one texture lie close together, also of textures that it was
//! not trained on. The center of a new texture is the mean of the places of its slides there ([`Center`]). A slide has
//! the new texture if its place is near that center, and not much farther from it than from the mean of the model's
//! answer ([`nearest`]). How near is near enough is a number of each texture: one whose slides differ much does not
//! widen what is known of others.
//!
//! ```
//! use wstac_core::learned::{Lesson, SLIDES, nearest};
//! use wstac_core::model::place::Place;
//!
//! let mut lesson = Lesson::new();
//! let places = [[60, -3], [64, 2], [70, 0], [58, 1], [68, 0]].map(|numbers| Place::new(&numbers));
//! let centers = places.into_iter().flatten().filter_map(|place| lesson.push(place));
//! let learned: heapless::Vec<_, 1> = centers.collect();
//! assert_eq!((lesson.slides(), learned[0].place().numbers()), (SLIDES, &[64, 0][..]));
//! // A slide near it has this texture, unless it is much nearer to what the model says.
//! let slide = Place::new(&[60, 0]).unwrap();
//! assert_eq!(nearest(&slide, None, learned.iter().enumerate()), Some(0));
//! assert_eq!(nearest(&slide, Some(4), learned.iter().enumerate()), None);
//! ```

use crate::model::calibration::MOST_DIMENSIONS;
use crate::model::place::Place;

/// The number of slides from which a board learns a texture.
pub const SLIDES: usize = 5;

/// 7/4 of the 98 % point of chi-squared for every number of dimensions from 1 on, in units of squared distances of
/// places, by Wilson and Hilferty. Fast slides differ more than a normal distribution has it: 7/4 was set on simulated
/// sensors.
const FAR: [u32; MOST_DIMENSIONS] = [
    38_156, 55_857, 70_414, 83_593, 95_957, 107_769, 119_174, 130_264, 141_100, 151_727, 162_176, 172_472, 182_636,
    192_682, 202_624, 212_472, 222_235, 231_920, 241_535, 251_085, 260_575, 270_009, 279_391, 288_724, 298_012,
    307_257, 316_462, 325_629, 334_760, 343_857, 352_922, 361_956,
];

/// Returns the squared distance from the mean of so many slides within which a texture's slides are expected.
///
/// If the covariance within a texture is the identity, at least 49 of 50 slides are so near. A mean of few slides is
/// itself off.
pub fn expected_far(dimensions: usize, slides: usize) -> u32 {
    let far = u64::from(FAR.get(dimensions.wrapping_sub(1)).copied().unwrap_or(0));
    let slides = slides as u64;
    let sum = far.saturating_mul(slides.saturating_add(1));
    // At most twice as far.
    sum.checked_div(slides).unwrap_or(far).min(u32::MAX.into()) as u32
}

/// The center of a learned texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Center {
    place: Place,
    far: u32,
}

impl Center {
    /// Creates the center at a place, with the largest squared distance of a slide of the texture.
    pub const fn new(place: Place, far: u32) -> Self {
        Self { place, far }
    }

    /// Creates the center of slides at these places.
    ///
    /// The largest squared distance is that of a slide from the mean of all others, or what is expected if that is
    /// larger.
    pub fn of(places: &[Place]) -> Self {
        let place = Place::mean(places, None);
        let expected = expected_far(place.numbers().len(), places.len());
        let far = places.iter().enumerate().map(|(number, own)| left_out(places, number, own));
        Self { place, far: far.fold(expected, u32::max) }
    }

    /// Returns the mean of the places of its slides.
    pub const fn place(&self) -> &Place {
        &self.place
    }

    /// Returns the largest squared distance of a slide of the texture.
    pub const fn far(&self) -> u32 {
        self.far
    }
}

/// Returns the squared distance of a slide from the mean of all others; 0 without others.
fn left_out(places: &[Place], number: usize, own: &Place) -> u32 {
    if places.len() > 1 { own.squared_distance(&Place::mean(places, Some(number))) } else { 0 }
}

/// The slides of a texture that is being learned.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lesson {
    places: [Option<Place>; SLIDES],
}

impl Lesson {
    /// Creates a lesson without slides.
    pub const fn new() -> Self {
        Self { places: [None; SLIDES] }
    }

    /// Returns the number of slides.
    pub fn slides(&self) -> usize {
        self.places.iter().flatten().count()
    }

    /// Takes the place of a slide. Returns the center after the last slide. More slides are left out.
    pub fn push(&mut self, place: Place) -> Option<Center> {
        *self.places.iter_mut().find(|free| free.is_none())? = Some(place);
        let mut places = [place; SLIDES];
        for (copy, place) in places.iter_mut().zip(&self.places) {
            *copy = (*place)?;
        }
        Some(Center::of(&places))
    }
}

/// Returns which learned texture a slide at this place has; `None` if it has none of them.
///
/// `centers` are those of all learned textures with any names of theirs. `rival` is the squared distance from the mean
/// of the model's answer, if that is to be compared. A slide has the texture of the nearest center, if its squared
/// distance is below 3/2 of the rival's, and it is not farther than the slides of that texture are. The factor favors
/// learned textures, which are touched more often.
pub fn nearest<'c, T>(
    place: &Place,
    rival: Option<u32>,
    centers: impl IntoIterator<Item = (T, &'c Center)>,
) -> Option<T> {
    let (mut best, mut distance, mut far) = (None, u32::MAX, 0);
    for (name, center) in centers {
        let other = place.squared_distance(&center.place);
        if other < distance {
            (best, distance, far) = (Some(name), other, center.far);
        }
    }
    best.filter(|_| distance <= far && rival.is_none_or(|rival| distance < rival.saturating_add(rival.div_ceil(2))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::place::PLACE_ONE;

    fn at(numbers: &[i16]) -> Place {
        Place::new(numbers).unwrap()
    }

    #[test]
    fn expected_distances_are_three_quarters_beyond_those_of_chi_squared() {
        for d in 1..=MOST_DIMENSIONS {
            // Wilson and Hilferty; the 98 % point of the normal distribution is 2.054.
            let real = d as f64;
            let point = real * (1.0 - 2.0 / (9.0 * real) + 2.054 * (2.0 / (9.0 * real)).sqrt()).powi(3);
            for slides in [1, 2, 5, 50] {
                let expected = 1.75 * point * f64::from(PLACE_ONE).powi(2) * (1.0 + 1.0 / slides as f64);
                assert!((f64::from(expected_far(d, slides)) - expected).abs() <= 2.0, "{d} {slides} {expected}");
            }
        }
        assert_eq!((expected_far(0, 5), expected_far(33, 5)), (0, 0));
        assert_eq!(expected_far(2, 0), FAR[1]);
    }

    #[test]
    fn the_last_slide_gives_the_center_and_no_other_does() {
        let mut lesson = Lesson::default();
        let numbers = [[100, 0], [104, 8], [96, -8], [103, 1], [100, 1]];
        for (number, numbers) in numbers.iter().enumerate() {
            assert_eq!(lesson.slides(), number);
            let center = lesson.push(at(numbers));
            assert_eq!(center.is_some(), number == 4);
            if let Some(center) = center {
                assert_eq!((center.place().numbers(), center.far()), (&[101, 0][..], expected_far(2, 5)));
            }
        }
        assert_eq!((lesson.push(at(&[0, 0])), lesson.slides()), (None, SLIDES));
    }

    #[test]
    fn a_slide_that_is_far_from_the_others_widens_what_is_known_of_its_texture() {
        // The mean of the others is at 0, and that of all at 200.
        let places = [at(&[0]), at(&[0]), at(&[1]), at(&[-1]), at(&[1000])];
        let center = Center::of(&places);
        assert_eq!((center.place().numbers(), center.far()), (&[200][..], 1_000_000));
        assert_eq!(Center::of(&places[..1]).far(), expected_far(1, 1));
    }

    #[test]
    fn the_nearest_center_counts_if_it_is_near_enough() {
        let centers = [Center::new(at(&[0, 0]), 100), Center::new(at(&[30, 0]), 225)];
        let of = |numbers, rival| nearest(&at(numbers), rival, centers.iter().enumerate());
        assert_eq!((of(&[9, 0], None), of(&[16, 0], None)), (Some(0), Some(1)));
        // Each center has its own limit: that of the other one does not count.
        assert_eq!((of(&[-10, 0], None), of(&[-11, 0], None)), (Some(0), None));
        assert_eq!((of(&[45, 0], None), of(&[46, 0], None)), (Some(1), None));
        // Of two that are equally near it is the first, which is too far here.
        assert_eq!(of(&[15, 0], None), None);
        assert_eq!((of(&[9, 0], Some(55)), of(&[9, 0], Some(54))), (Some(0), None));
        // 3/2 of 33 is 49.5.
        assert_eq!((of(&[7, 0], Some(33)), of(&[7, 0], Some(32))), (Some(0), None));
        assert_eq!(nearest::<u8>(&at(&[0, 0]), None, []), None);
    }
}
