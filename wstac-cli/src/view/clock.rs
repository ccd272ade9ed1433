//! Two clocks: how fast a camera really is, by its driver's timestamps, and how fast a file is played.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use wstac_core::rate::FrameRate;

/// Over how long a camera's rate is measured.
const SPAN: Duration = Duration::from_secs(2);
/// A player that is further behind than this does not catch up.
const MOST_BEHIND: Duration = Duration::from_millis(300);

/// A camera's frame rate: frames that it took, lost ones included, between timestamps of about the last two seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct RateMeter {
    /// Frames that were taken.
    count: u64,
    /// Timestamps, and frames that were taken up to each.
    taken: VecDeque<(Duration, u64)>,
}

impl RateMeter {
    /// Frames that were lost.
    pub(super) fn lose(&mut self, frames: u64) {
        self.count = self.count.saturating_add(frames);
    }

    /// A frame, taken at this time.
    pub(super) fn take(&mut self, timestamp: Option<Duration>) {
        self.count = self.count.saturating_add(1);
        let Some(now) = timestamp else { return };
        // Another clock: a camera that was plugged in again.
        if self.taken.back().is_some_and(|(last, _)| *last > now) {
            self.taken.clear();
        }
        self.taken.push_back((now, self.count));
        // Of a slow camera two frames at least.
        while self.taken.len() > 2 && self.taken.front().is_some_and(|(first, _)| now.saturating_sub(*first) > SPAN) {
            self.taken.pop_front();
        }
    }

    /// Frames a second; nothing before the second frame.
    pub(super) fn fps(&self) -> Option<f64> {
        let ((from, before), (to, after)) = self.taken.front().zip(self.taken.back())?;
        let seconds = to.saturating_sub(*from).as_secs_f64();
        (seconds > 0.0).then(|| (after - before) as f64 / seconds)
    }
}

/// When the next frame of a file is due, so that it is played at its own rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    period: Duration,
    due: Instant,
}

impl Pace {
    /// From now on, at this rate.
    pub(super) fn new(rate: FrameRate) -> Self {
        let period = f64::from(rate.denominator()) / f64::from(rate.numerator());
        // A rate of one frame in centuries is waited for a second at a time.
        let period = Duration::try_from_secs_f64(period).unwrap_or(Duration::MAX).min(Duration::from_hours(1));
        Self { period, due: Instant::now() }
    }

    /// Starts anew from now.
    pub(super) fn restart(&mut self) {
        self.due = Instant::now();
    }

    /// `frames` have been shown: the next is due so much later.
    pub(super) fn advance(&mut self, frames: u64) {
        let frames = u32::try_from(frames).unwrap_or(u32::MAX);
        let now = Instant::now();
        let due = self.due.checked_add(self.period.saturating_mul(frames)).unwrap_or(now);
        self.due = if now.saturating_duration_since(due) > MOST_BEHIND { now } else { due };
    }

    /// How long to wait until the next frame.
    pub(super) fn wait(&self) -> Duration {
        self.due.saturating_duration_since(Instant::now())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_frames_were_taken_by_the_camera() {
        let mut meter = RateMeter::default();
        assert_eq!(meter.fps(), None);
        for frame in 0..200_u32 {
            // Every fourth is lost.
            if frame % 4 == 3 {
                meter.lose(1);
            } else {
                meter.take(Some(Duration::from_millis(40) * frame));
            }
        }
        assert!((meter.fps().unwrap() - 25.0).abs() < 1e-9, "{:?}", meter.fps());
    }

    #[test]
    fn a_rate_follows_the_camera_and_its_new_clock() {
        let mut meter = RateMeter::default();
        for frame in 0..100_u32 {
            meter.take(Some(Duration::from_secs(50) + Duration::from_millis(40) * frame));
        }
        for frame in 0..100_u32 {
            meter.take(Some(Duration::from_millis(125) * frame));
        }
        assert!((meter.fps().unwrap() - 8.0).abs() < 1e-9, "{:?}", meter.fps());
    }

    #[test]
    fn no_timestamps_no_rate() {
        let mut meter = RateMeter::default();
        for _ in 0..10 {
            meter.take(None);
        }
        assert_eq!(meter.fps(), None);
    }
}
