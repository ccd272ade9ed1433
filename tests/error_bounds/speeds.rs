//! Durations → speeds.

use wstac_core::rate::FrameRate;
use wstac_core::speed::Law;

use crate::within;

/// Half the distance of 1 from the next 32-bit float.
const U: f64 = 1.0 / 16_777_216.0;

/// The laws in 64 bits at every duration and many frame rates, beside their bounds: see `Law::speed`.
#[test]
fn laws_in_32_bits_are_within_their_bound() {
    let (mut paper, mut paper_share, mut physical, mut physical_share) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let rates =
        [(30, 1), (25, 1), (15, 1), (30_000, 1001), (60_000, 1001), (45, 1), (46, 1), (7, 3), (1000, 1), (240, 1)];
    for (numerator, denominator) in rates {
        let rate = FrameRate::new(numerator, denominator).unwrap();
        for frames in 0..=69_u8 {
            let duration = f64::from(frames) * f64::from(rate.frames_added()) * 30.0 * f64::from(denominator)
                / f64::from(numerator);
            let in_32_bits = f32::from(frames) * rate.nominal_frames();
            let exponent = (151.06 - duration) / 56.29 * std::f64::consts::LN_10;
            let off = f64::from(Law::PAPER.speed(in_32_bits).unwrap()) / exponent.exp() - 1.0;
            let bound = ((151.06 + 6.0 * duration) / 56.29 * std::f64::consts::LN_10 + 5.0 * exponent.abs() + 3.0) * U;
            assert!(
                off.abs() <= bound,
                "{frames} frames at {numerator}/{denominator}: off by {off:e}, bound {bound:e}"
            );
            if (100.0..=200.0).contains(&exponent.exp()) {
                (paper, paper_share) = (paper.max(off.abs()), paper_share.max(bound));
            }
            let above = duration - 5.36;
            if above > 0.01 {
                let expected = 113.4 * 30.0 / above;
                let off = f64::from(Law::PHYSICAL.speed(in_32_bits).unwrap()) / expected - 1.0;
                let bound = ((6.0 * duration + 5.36) / above + 5.0) * U;
                assert!(off.abs() <= bound, "{frames} at {numerator}/{denominator}: off by {off:e}, bound {bound:e}");
                if (100.0..=200.0).contains(&expected) {
                    (physical, physical_share) = (physical.max(off.abs()), physical_share.max(bound));
                }
            }
        }
    }
    within("paper's law, 100 to 200 mm/s", 1e6 * paper, 1e6 * paper_share, "millionths of the speed");
    within("physical law, 100 to 200 mm/s", 1e6 * physical, 1e6 * physical_share, "millionths of the speed");
}
