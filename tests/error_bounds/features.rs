//! Sums → features.

use wstac_core::features::{FeatureScale, Floor};
use wstac_core::ln::{LN_FRACTION_BITS, Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_tests::random::Random;

use crate::{ONE, within};

/// What is left of the range of a feature: below it features saturate, on purpose.
const LOWEST: f64 = -16.0;

/// The largest distance of a feature from the real logarithm, in units, over taxels of any size and depth of colour.
fn worst<L: Ln>() -> f64 {
    let mut random = Random::new(11);
    let mut worst = 0.0_f64;
    for round in 0..2000 {
        let full_scale = [255, 1023, 4095, 65_535][round % 4];
        let most_pixels = u32::MAX / 5 / full_scale;
        // As many small taxels as large ones.
        let size = 1 << random.below(25);
        let pixels = (1 + random.below(size) as u32).min(most_pixels);
        let frames = 1 + random.below(u64::from((most_pixels / pixels).min(40))) as u32;
        let floor = Floor::new(0.0, full_scale).unwrap();
        let scale = FeatureScale::<L>::new(pixels, full_scale, frames, floor).unwrap();
        let most = pixels * full_scale * frames;
        let mut check = |sum: u32| {
            let real = f64::from(sum).ln() - f64::from(most).ln();
            if (1..=5 * most).contains(&sum) && real > LOWEST {
                worst = worst.max((f64::from(scale.feature(sum)) - real * ONE).abs());
            }
        };
        for _ in 0..200 {
            // Any sum, small ones as often as large ones; and those next to where rounding turns, which are the worst.
            let sum = (f64::from(most) * 5.0).powf(random.below(1 << 20) as f64 / f64::from(1 << 20));
            let units = (sum.ln() - f64::from(most).ln()) * ONE;
            let turn = (((units.floor() + 0.5) / ONE).exp() * f64::from(most)) as u32;
            [sum as u32, turn.saturating_sub(1), turn, turn + 1].into_iter().for_each(&mut check);
        }
    }
    worst
}

/// The largest error of a kernel itself: every integer of up to 20 bits, and 2^18 of each length above.
fn worst_ln<L: Ln>() -> f64 {
    let longer = (20..32).flat_map(|bits| (0..1 << 18).map(move |i| (1_u32 << bits) + (i << (bits - 18)) + i % 4));
    let off = |x: u32| (f64::from(L::ln(x)) / f64::from(1 << LN_FRACTION_BITS) - f64::from(x).ln()).abs();
    (1..1 << 20).chain(longer).map(off).fold(0.0, f64::max)
}

/// A kernel as its page says it is, and half a unit of rounding beside the error of two logarithms.
fn check<L: Ln>(name: &str, ln_error: f64) {
    within(&format!("ln, {name}"), 1e6 * worst_ln::<L>(), 1e6 * ln_error, "millionths");
    within(&format!("feature, {name}"), worst::<L>(), 0.5 + 2.0 * ln_error * ONE, "units of 2^-11");
}

#[test]
fn features_are_within_their_bound() {
    check::<Fixed<256>>("fixed 256", 1.7e-6);
    check::<Fixed<32>>("fixed 32", 1.3e-4);
    check::<Libm>("libm", 7.6e-9);
    check::<Micromath>("micromath", 6.4e-5);
}
