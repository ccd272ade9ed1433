//! The times of frames by their numbers: seconds from the first frame, and wall-clock time where the source knows it.

use std::time::{Duration, SystemTime};

use wstac_core::rate::FrameRate;

/// The first second of the year 10000, from 1970 on. Times as text have four digits of a year.
const END_OF_YEARS_S: u64 = 253_402_300_800;

/// Turns numbers of feature frames into times.
///
/// Lost frames count, so the frame rate gives the time from one frame to another. The wall-clock time of the frame that
/// arrived last gives that of frames shortly before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameClock {
    /// The duration of a feature frame in seconds.
    period_s: f64,
    /// The number of a feature frame, and the wall-clock time when it was taken.
    last: Option<(u64, SystemTime)>,
}

impl FrameClock {
    /// Creates the clock of a camera of this rate.
    pub(crate) fn new(rate: FrameRate) -> Self {
        Self { period_s: f64::from(rate.frames_added()) / rate.per_second(), last: None }
    }

    /// Takes the wall-clock time of a frame, or that the source knows none.
    pub(crate) fn frame_arrives(&mut self, frame: u64, stamp: Option<SystemTime>) {
        self.last = stamp.map(|stamp| (frame, stamp));
    }

    /// Returns the time of a frame in seconds from the first frame.
    pub(crate) fn seconds(&self, frame: u64) -> f64 {
        frame as f64 * self.period_s
    }

    /// Returns the wall-clock time of a frame, in the years 1970 to 9999; `None` if the source knows none.
    pub(crate) fn stamp(&self, frame: u64) -> Option<SystemTime> {
        let (last, stamp) = self.last?;
        let before = Duration::try_from_secs_f64(self.seconds(last.saturating_sub(frame))).ok()?;
        let stamp = stamp.checked_sub(before)?;
        // A clock that was never set starts in 1970, and a frame before that has no time that can be written.
        let since_1970 = stamp.duration_since(SystemTime::UNIX_EPOCH).ok()?;
        (since_1970.as_secs() < END_OF_YEARS_S).then_some(stamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_the_times_of_their_numbers() {
        let mut clock = FrameClock::new(FrameRate::NOMINAL);
        assert!((clock.seconds(45) - 1.5).abs() < 1e-12);
        assert_eq!(clock.stamp(45), None);
        let at = SystemTime::UNIX_EPOCH + Duration::from_secs(1000);
        clock.frame_arrives(105, Some(at));
        assert_eq!(clock.stamp(105), Some(at));
        assert_eq!(clock.stamp(45), Some(at - Duration::from_secs(2)));
        // The touch was two seconds before, and the clock started one second before; or it is far ahead.
        clock.frame_arrives(105, Some(SystemTime::UNIX_EPOCH + Duration::from_secs(1)));
        assert_eq!(clock.stamp(45), None);
        clock.frame_arrives(105, SystemTime::UNIX_EPOCH.checked_add(Duration::from_secs(END_OF_YEARS_S + 2)));
        assert_eq!((clock.stamp(105), clock.stamp(45)), (None, None));
        clock.frame_arrives(105, SystemTime::UNIX_EPOCH.checked_add(Duration::from_secs(END_OF_YEARS_S + 1)));
        assert!(clock.stamp(105).is_none() && clock.stamp(45).is_some());
        clock.frame_arrives(106, None);
        assert_eq!(clock.stamp(45), None);
        // 120 frames per second are 30 feature frames per second.
        let fast = FrameClock::new(FrameRate::new(120, 1).unwrap());
        assert!((fast.seconds(30) - 1.0).abs() < 1e-12);
    }
}
