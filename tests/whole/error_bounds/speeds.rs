//! From durations to speeds.

use wstac_core::paper::speed::Law;
use wstac_core::rate::FrameRate;

use super::Largest;

/// Half the distance from 1 to the next 32-bit float.
const U: f64 = 1.0 / 16_777_216.0;

/// Compares the law with 64-bit floating point at every duration and at many frame rates. `Law::speed` documents its
/// bound.
#[test]
fn the_law_in_32_bits_is_within_its_bound() {
    let (mut paper, mut beyond) = (Largest::default(), Largest::default());
    let usual = |speed: f64| (100.0..=200.0).contains(&speed);
    let rates =
        [(30, 1), (25, 1), (15, 1), (30_000, 1001), (60_000, 1001), (45, 1), (46, 1), (7, 3), (1000, 1), (240, 1)];
    for (numerator, denominator) in rates {
        let rate = FrameRate::new(numerator, denominator).unwrap();
        for frames in 0..=69_u8 {
            let duration = f64::from(frames) * f64::from(rate.frames_added()) * 30.0 * f64::from(denominator)
                / f64::from(numerator);
            let in_32_bits = f32::from(frames) * rate.nominal_frames();
            let exponent = (151.06 - duration) / 56.29 * std::f64::consts::LN_10;
            let off = (f64::from(Law::PUBLISHED.speed(in_32_bits).unwrap()) / exponent.exp() - 1.0).abs();
            let bound = ((151.06 + 6.0 * duration) / 56.29 * std::f64::consts::LN_10 + 5.0 * exponent.abs() + 3.0) * U;
            let what = format_args!("{frames} frames at {numerator}/{denominator}");
            (if usual(exponent.exp()) { &mut paper } else { &mut beyond }).see(off, bound, what);
        }
    }
    paper.print("paper's law, 100 to 200 mm/s", 1e6, "millionths of the speed");
    beyond.print("at other speeds", 1e6, "millionths of the speed");
    assert!(paper.count > 50 && beyond.count > 500);
}
