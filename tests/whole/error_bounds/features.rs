//! From sums to features.

use wstac_core::features::{FeatureScale, Floor};
use wstac_core::ln::{LN_FRACTION_BITS, Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_tests::{how_many, random::Random};

use super::{ONE, within};

/// The lower end of the range of a feature. Features below it saturate by design.
const LOWEST: f64 = -16.0;

/// Returns the largest distance of a feature from the real logarithm, in units. Taxels have any size and bit depth.
fn worst<L: Ln>() -> f64 {
    let mut random = Random::new(11);
    let mut worst = 0.0_f64;
    for round in 0..2000 {
        let full_scale = [255, 1023, 4095, 65_535][round % 4];
        let most_pixels = u32::MAX / 5 / full_scale;
        // Small taxels are as frequent as large ones.
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
            // Tries any sum, small ones as often as large ones. Also tries the sums next to a rounding boundary, which
            // are the worst.
            let sum = (f64::from(most) * 5.0).powf(random.below(1 << 20) as f64 / f64::from(1 << 20));
            let units = (sum.ln() - f64::from(most).ln()) * ONE;
            let turn = (((units.floor() + 0.5) / ONE).exp() * f64::from(most)) as u32;
            [sum as u32, turn.saturating_sub(1), turn, turn + 1].into_iter().for_each(&mut check);
        }
    }
    worst
}

/// A kernel, and its largest distance from the real logarithm according to its documentation.
struct Kernel {
    name: &'static str,
    ln: fn(u32) -> i32,
    feature: fn() -> f64,
    error: f64,
    /// Whether it never falls.
    is_monotone: bool,
}

fn kernel<L: Ln>(name: &'static str, error: f64, is_monotone: bool) -> Kernel {
    Kernel { name, ln: |x| L::default().ln(x), feature: worst::<L>, error, is_monotone }
}

fn kernels() -> [Kernel; 4] {
    [
        kernel::<Fixed<256>>("fixed 256", 1.7e-6, true),
        kernel::<Fixed<32>>("fixed 32", 1.3e-4, true),
        kernel::<Libm>("libm", 7.6e-9, true),
        kernel::<Micromath>("micromath", 6.4e-5, false),
    ]
}

/// Tests every integer of up to 20 bits, and every 997th above. `ci/long ln` tests all integers of 32 bits.
#[test]
fn logarithms_are_within_their_bound() {
    let step = how_many("WSTAC_LONG_LN_STEP", 997) as usize;
    let kernels = kernels();
    let (mut worst, mut last) = ([0.0_f64; 4], [i32::MIN; 4]);
    let mut integers = 0_u64;
    for x in (1..1 << 20).chain((1 << 20..=u32::MAX).step_by(step)) {
        let real = f64::from(x).ln();
        for ((worst, last), kernel) in worst.iter_mut().zip(&mut last).zip(&kernels) {
            let found = (kernel.ln)(x);
            *worst = worst.max((f64::from(found) / f64::from(1 << LN_FRACTION_BITS) - real).abs());
            assert!(!kernel.is_monotone || found >= *last, "{} falls at {x}", kernel.name);
            *last = found;
        }
        integers += 1;
    }
    println!("{integers} integers");
    for (worst, kernel) in worst.iter().zip(&kernels) {
        within(&format!("ln, {}", kernel.name), 1e6 * worst, 1e6 * kernel.error, "millionths");
    }
}

/// Tests that a feature is within half a unit of rounding and the errors of two logarithms.
#[test]
fn features_are_within_their_bound() {
    for kernel in kernels() {
        let bound = 0.5 + 2.0 * kernel.error * ONE;
        within(&format!("feature, {}", kernel.name), (kernel.feature)(), bound, "units of 2^-11");
    }
}
