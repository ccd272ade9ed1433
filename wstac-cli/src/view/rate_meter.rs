//! The real rate of a camera by its driver's timestamps.

use std::collections::VecDeque;
use std::time::Duration;

/// The time over which a camera's rate is measured.
const SPAN: Duration = Duration::from_secs(2);

/// The frame rate of a camera: its frames, lost ones included, between timestamps of about the last two seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct RateMeter {
    /// Frames so far.
    count: u64,
    /// Timestamps, each with the number of frames up to it.
    taken: VecDeque<(Duration, u64)>,
}

impl RateMeter {
    /// Counts lost frames.
    pub(super) fn lose(&mut self, frames: u64) {
        self.count = self.count.saturating_add(frames);
    }

    /// Counts a frame with its timestamp.
    pub(super) fn take(&mut self, timestamp: Option<Duration>) {
        self.count = self.count.saturating_add(1);
        let Some(now) = timestamp else { return };
        // The clock changed: the camera was plugged in again.
        if self.taken.back().is_some_and(|(last, _)| *last > now) {
            self.taken.clear();
        }
        self.taken.push_back((now, self.count));
        // A slow camera needs at least two frames.
        while self.taken.len() > 2 && self.taken.front().is_some_and(|(first, _)| now.saturating_sub(*first) > SPAN) {
            self.taken.pop_front();
        }
    }

    /// Returns the frames per second, or `None` before the second frame.
    pub(super) fn fps(&self) -> Option<f64> {
        let ((from, before), (to, after)) = self.taken.front().zip(self.taken.back())?;
        let seconds = to.saturating_sub(*from).as_secs_f64();
        (seconds > 0.0).then(|| (after - before) as f64 / seconds)
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
            // Every fourth frame is lost.
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
