//! Plays a file or a scene at its own rate.

use std::time::{Duration, Instant};

use wstac_core::rate::FrameRate;

/// The largest lag that a player catches up with.
const MOST_BEHIND: Duration = Duration::from_millis(300);

/// The time when the next frame of a file is due, so that it is played at its own rate.
///
/// ```
/// use std::thread;
/// use wstac_core::rate::FrameRate;
/// use wstac_host::source::pace::Pace;
///
/// let mut pace = Pace::new(FrameRate::new(1000, 1)?);
/// for frame in 0..3 {
///     // Show the frame, and then wait until the next one is due.
///     pace.advance(1);
///     thread::sleep(pace.wait());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    period: Duration,
    due: Instant,
}

impl Pace {
    /// Starts now, at this rate.
    pub fn new(rate: FrameRate) -> Self {
        let period = f64::from(rate.denominator()) / f64::from(rate.numerator());
        // For a file of one frame in centuries.
        let period = Duration::try_from_secs_f64(period).unwrap_or(Duration::MAX).min(Duration::from_hours(1));
        Self { period, due: Instant::now() }
    }

    /// Starts again from now.
    pub fn restart(&mut self) {
        self.due = Instant::now();
    }

    /// Moves the due time on by `frames` frames, which were shown.
    pub fn advance(&mut self, frames: u64) {
        let frames = u32::try_from(frames).unwrap_or(u32::MAX);
        let now = Instant::now();
        let due = self.due.checked_add(self.period.saturating_mul(frames)).unwrap_or(now);
        self.due = if now.saturating_duration_since(due) > MOST_BEHIND { now } else { due };
    }

    /// Returns how long to wait until the next frame.
    pub fn wait(&self) -> Duration {
        self.due.saturating_duration_since(Instant::now())
    }
}
