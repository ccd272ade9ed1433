//! How long a camera may be silent, and a wait for it may take.

use std::time::Duration;

use wstac_core::rate::FrameRate;

/// Longest wait for a frame before the caller may look for signals.
pub(crate) const WAIT: Duration = Duration::from_millis(500);
/// The longest time without a frame before the stream is started again; for a very slow camera, it is this many
/// periods.
const LONGEST_SILENCE: Duration = Duration::from_secs(5);
const SILENT_PERIODS: f64 = 3.0;

/// Returns how long a camera of this rate may be silent before it counts as stuck.
pub(crate) fn longest_silence(rate: FrameRate) -> Duration {
    let periods = SILENT_PERIODS * f64::from(rate.denominator()) / f64::from(rate.numerator());
    Duration::try_from_secs_f64(periods).map_or(Duration::MAX, |periods| periods.max(LONGEST_SILENCE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_cameras_may_be_silent_for_longer() {
        let silence = |numerator, denominator| longest_silence(FrameRate::new(numerator, denominator).unwrap());
        assert_eq!(silence(30, 1), Duration::from_secs(5));
        assert_eq!(silence(1, 1), Duration::from_secs(5));
        assert_eq!(silence(1, 60), Duration::from_mins(3));
        assert!(silence(1, u32::MAX) > Duration::from_secs(u32::MAX.into()));
    }
}
