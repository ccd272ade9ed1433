//! The true frame rate, by the driver's timestamps and sequence numbers.

use std::time::Duration;

use wstac_host::statistics::rms;

/// Largest number of frames between two that arrived; a larger step of the sequence number is a reset.
const LONGEST_STEP: u32 = 1000;

/// Intervals between the frames that came.
#[derive(Clone, Debug, Default)]
pub struct Pace {
    last: Option<(Option<u32>, Duration)>,
    /// Length in s, and number of frames by the driver's count.
    intervals: Vec<(f64, f64)>,
}

/// Statistics of the intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaceSummary {
    /// Frames per second that the camera takes, whether they arrive or not.
    pub fps: f64,
    /// Standard deviation of an interval from a whole number of mean ones, in s.
    pub jitter: f64,
    /// The longest interval, in s.
    pub longest: f64,
}

impl Pace {
    /// Adds a frame; a frame without a timestamp is ignored.
    pub fn push(&mut self, sequence: Option<u32>, timestamp: Option<Duration>) {
        let Some(timestamp) = timestamp else { return };
        let Some((last, before)) = self.last.replace((sequence, timestamp)) else { return };
        let steps = sequence.zip(last).map_or(1, |(now, before)| now.wrapping_sub(before));
        if timestamp > before && (1..=LONGEST_STEP).contains(&steps) {
            self.intervals.push((timestamp.saturating_sub(before).as_secs_f64(), f64::from(steps)));
        }
    }

    /// Returns the statistics after three frames or more.
    pub fn summary(&self) -> Option<PaceSummary> {
        if self.intervals.len() < 2 {
            return None;
        }
        let (elapsed, steps) =
            self.intervals.iter().fold((0.0, 0.0), |(e, s), (length, steps)| (e + length, s + steps));
        let period = elapsed / steps;
        let off = self.intervals.iter().map(|(length, steps)| length - steps * period);
        Some(PaceSummary {
            fps: steps / elapsed,
            jitter: rms(off)?,
            longest: self.intervals.iter().map(|(length, _)| *length).fold(0.0, f64::max),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pace(frames: impl IntoIterator<Item = (u32, f64)>) -> PaceSummary {
        let mut pace = Pace::default();
        for (sequence, seconds) in frames {
            pace.push(Some(sequence), Some(Duration::from_secs_f64(seconds)));
        }
        pace.summary().unwrap()
    }

    #[test]
    fn dropped_frames_do_not_make_a_camera_slow() {
        let kept = (0..300_u32).filter(|t| t % 7 != 3).map(|t| (t.wrapping_sub(100), 5.0 + f64::from(t) / 29.97));
        let found = pace(kept);
        assert!((found.fps - 29.97).abs() < 1e-3 && found.jitter < 1e-6, "{found:?}");
        assert!((found.longest - 2.0 / 29.97).abs() < 1e-6);
    }

    #[test]
    fn a_camera_that_is_slow_in_the_dark_is_told() {
        let found = pace((0..50).map(|t| (t, f64::from(t) / 7.5)));
        assert!((found.fps - 7.5).abs() < 1e-6);
    }

    #[test]
    fn jitter_is_measured_and_resets_are_left_out() {
        // Every other frame is 3 ms late: the intervals are 6 ms apart, 3 ms from their mean.
        let late = |t: u32| f64::from(t) / 30.0 + if t % 2 == 1 { 0.003 } else { 0.0 };
        let found = pace((0..200).map(|t| (if t < 100 { 5000 + t } else { t - 100 }, late(t))));
        assert!((found.jitter - 0.003).abs() < 1e-4 && (found.fps - 30.0).abs() < 0.1, "{found:?}");
        let mut none = Pace::default();
        (0..10).for_each(|t| none.push(Some(t), None));
        assert_eq!(none.summary(), None);
    }
}
