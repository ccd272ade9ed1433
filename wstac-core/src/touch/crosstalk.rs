//! Cross-talk between taxels, taken out by the inverse of a measured matrix (SPEC §9).
//!
//! A taxel also sees some light of its neighbors' whiskers. If a matrix says how much, its inverse gives each whisker's
//! own light. A host inverts the matrix; a board has the inverse as a constant.

use crate::params::TAXELS;

/// Bits behind the point of a weight: 1 is 8192.
pub const WEIGHT_BITS: u32 = 13;
/// Largest sum of the absolute weights of a taxel, in units of 2^-13: just below 4. With it, 25 products of 16 bits and
/// the rounding fit 32 bits.
pub const MOST_WEIGHTS: u32 = 32_767;

/// The inverse of a cross-talk matrix, in fixed point: what each taxel's own whisker gives, of what all taxels see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Correction {
    weights: [[i16; TAXELS]; TAXELS],
}

impl Correction {
    /// Creates a correction of weights in units of 2^-13, a row for each corrected taxel.
    ///
    /// Returns `None` if the absolute weights of a row add up to more than [`MOST_WEIGHTS`]: such an inverse would
    /// multiply noise by up to 4.
    pub const fn new(weights: [[i16; TAXELS]; TAXELS]) -> Option<Self> {
        let mut rows: &[[i16; TAXELS]] = &weights;
        while let [row, rest @ ..] = rows {
            let (mut sum, mut row) = (0, row.as_slice());
            while let [weight, others @ ..] = row {
                sum += weight.unsigned_abs() as u32;
                row = others;
            }
            if sum > MOST_WEIGHTS {
                return None;
            }
            rows = rest;
        }
        Some(Self { weights })
    }

    /// Returns the weights in units of 2^-13, a row for each corrected taxel.
    pub const fn weights(&self) -> &[[i16; TAXELS]; TAXELS] {
        &self.weights
    }

    /// Returns the light without cross-talk, rounded (ties up) and clamped to 0..=65535.
    ///
    /// It differs from that of the exact inverse by at most half a unit and 1/16384 of the sum of all light.
    pub fn apply(&self, light: &[u16; TAXELS]) -> [u16; TAXELS] {
        let mut corrected = [0; TAXELS];
        for (own, row) in corrected.iter_mut().zip(&self.weights) {
            let products = row.iter().zip(light).map(|(&weight, &light)| i32::from(weight) * i32::from(light));
            let sum = products.fold(1 << (WEIGHT_BITS - 1), |sum, product| sum + product);
            *own = (sum >> WEIGHT_BITS).clamp(0, u16::MAX.into()) as u16;
        }
        corrected
    }
}

/// Holds the correction of a [`Corrected`](super::taxel_ring::Corrected) store: at run time in an `Option`, or as a
/// board's constant in a type of its own.
///
/// ```
/// use wstac_core::touch::crosstalk::{Correction, CorrectionSource};
/// use wstac_core::touch::taxel_ring::{Corrected, TaxelRing};
///
/// static CROSSTALK: Correction = match Correction::new([[0; 25]; 25]) {
///     Some(correction) => correction,
///     None => panic!("the weights are too large"),
/// };
///
/// struct Constant;
///
/// impl CorrectionSource for Constant {
///     const EMPTY: Self = Self;
///
///     fn correction(&self) -> Option<&Correction> {
///         Some(&CROSSTALK)
///     }
/// }
///
/// // The parameter of a board's pipeline.
/// type Taxels = Corrected<TaxelRing, Constant>;
/// # assert_eq!(size_of::<Taxels>(), size_of::<TaxelRing>());
/// ```
pub trait CorrectionSource: Sized {
    /// The holder in a pipeline that is built.
    const EMPTY: Self;

    /// Returns the correction; `None` if there is none.
    fn correction(&self) -> Option<&Correction>;
}

impl CorrectionSource for Option<Correction> {
    const EMPTY: Self = None;

    #[inline(always)]
    fn correction(&self) -> Option<&Correction> {
        self.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::green::gray::Gray;
    use crate::layout::{FrameSize, Layout};
    use crate::pipeline::Pipeline;
    use crate::rate::FrameRate;
    use crate::taxels::FrameGeometry;
    use crate::touch::taxel_ring::{ChosenTaxels, TaxelRing};

    /// A correction that takes an eighth of the taxel before from each taxel but the first.
    fn correction() -> Correction {
        let weight =
            |taxel: usize, other: usize| i16::from(taxel == other) * 8192 - i16::from(other + 1 == taxel) * 1024;
        let weights = core::array::from_fn(|taxel| core::array::from_fn(|other| weight(taxel, other)));
        Correction::new(weights).unwrap()
    }

    #[test]
    fn weights_that_could_overflow_are_refused() {
        let mut weights = [[0; TAXELS]; TAXELS];
        weights[24] = [-1310; TAXELS];
        weights[24][0] = i16::MAX - 24 * 1310;
        assert!(Correction::new(weights).is_some_and(|correction| correction.apply(&[u16::MAX; TAXELS])[24] == 0));
        weights[24][0] += 1;
        assert_eq!(Correction::new(weights), None);
        weights[24] = [0; TAXELS];
        weights[24][3] = i16::MIN;
        assert_eq!(Correction::new(weights), None);
        weights[24][3] = i16::MAX;
        assert_eq!(Correction::new(weights).unwrap().apply(&[u16::MAX; TAXELS])[24], u16::MAX);
    }

    /// At 60 frames per second a feature frame has two camera frames, of which one may be lost.
    #[test]
    fn a_ring_is_corrected_once_a_frame_and_features_are_not() {
        let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
        let geometry = FrameGeometry::new(Gray, layout, FrameRate::new(60, 1).unwrap()).unwrap();
        let mut plain = Pipeline::builder(geometry).taxels::<TaxelRing>().build().unwrap();
        let mut corrected = Pipeline::builder(geometry).taxels::<ChosenTaxels>().build().unwrap();
        corrected.keep_taxels();
        corrected.set_correction(Some(correction()));
        for number in 0..200_u32 {
            let sums = core::array::from_fn(|taxel| 1000 * ((number * 7 + taxel as u32 * 13) % 97));
            let (is_lost, (plain, corrected)) = (number % 11 == 3 || number / 8 == 9, (&mut plain, &mut corrected));
            let frames = if is_lost {
                [plain.push_lost(1).frame(), corrected.push_lost(1).frame()]
            } else {
                [plain.push_taxels(&sums).frame(), corrected.push_taxels(&sums).frame()]
            };
            assert_eq!(frames[0], frames[1]);
        }
        let [plain, corrected] = [plain.taxel_ring().unwrap(), corrected.taxel_ring().unwrap()];
        for number in 0..70 {
            assert_eq!(*corrected.frame(number), correction().apply(plain.frame(number)), "{number}");
            assert_eq!(corrected.is_lost(number), plain.is_lost(number));
        }
        assert!((0..70).any(|number| corrected.frame(number) != plain.frame(number)));
    }
}
