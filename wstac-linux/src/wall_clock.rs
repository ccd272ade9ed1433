//! Wall-clock times of the monotonic clock, which drivers' timestamps are of.

use std::time::{Duration, SystemTime};

use rustix::time::{ClockId, clock_gettime};
use wstac_host::source::Stamp;

/// The most by which a wall-clock time may be wrong.
const WITHIN: Duration = Duration::from_micros(500);
/// The most times that the clocks are read until both are read in time.
const TRIES: u32 = 4;

/// The distance of the wall clock from the monotonic one.
///
/// It stays the same until it is wrong by more than half of what is allowed: if somebody sets the clock, or if it is
/// made faster or slower. So times of frames and wall-clock times have the same distances, and a recording needs to
/// keep the distance only when it changes.
#[derive(Debug, Default)]
pub(crate) struct WallClock {
    /// The wall-clock time when the monotonic clock showed 0; `None` before it was first read.
    zero: Option<SystemTime>,
}

impl WallClock {
    /// Returns the wall-clock time of a time of the monotonic clock; `None` if it cannot be known.
    pub(crate) fn stamp(&mut self, monotonic: Duration) -> Option<Stamp> {
        self.follow(read());
        Some(Stamp { time: self.zero?.checked_add(monotonic)?, within: WITHIN })
    }

    /// Takes the wall-clock time when the monotonic clock showed 0, as it was read now.
    fn follow(&mut self, read: Option<SystemTime>) {
        // If the processor was busy with others all the time, what was known before still holds.
        let Some(read) = read else { return };
        let is_near = |zero: SystemTime| {
            let apart = read.duration_since(zero).unwrap_or_else(|error| error.duration());
            apart <= WITHIN / 2
        };
        if !self.zero.is_some_and(is_near) {
            self.zero = Some(read);
        }
    }
}

/// Reads both clocks; `None` if something else ran in between, so that the result is off by more than a quarter of what
/// is allowed.
fn read() -> Option<SystemTime> {
    (0..TRIES).find_map(|_| {
        let before = monotonic();
        let wall = SystemTime::now();
        let took = monotonic().checked_sub(before)?;
        if took > WITHIN / 2 { None } else { wall.checked_sub(before + took / 2) }
    })
}

/// Returns the time on the monotonic clock.
pub(crate) fn monotonic() -> Duration {
    Duration::try_from(clock_gettime(ClockId::Monotonic)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_this_machines_time() {
        let mut clock = WallClock::default();
        let (before, at, after) = (SystemTime::now(), monotonic(), SystemTime::now());
        let stamp = clock.stamp(at).unwrap();
        assert!(stamp.time + stamp.within >= before && stamp.time <= after + stamp.within, "{stamp:?}");
    }

    #[test]
    fn the_distance_stays_until_it_is_wrong() {
        let (mut clock, at) = (WallClock::default(), SystemTime::UNIX_EPOCH + Duration::from_secs(1_800_000_123));
        for (moved, expected) in [(0, 0), (200, 0), (240, 0), (260, 260), (20, 260), (5_000_000, 5_000_000)] {
            clock.follow(Some(at + Duration::from_micros(moved)));
            assert_eq!(clock.zero, Some(at + Duration::from_micros(expected)), "{moved}");
        }
        clock.follow(Some(at));
        assert_eq!(clock.zero, Some(at));
        clock.follow(None);
        assert_eq!(clock.zero, Some(at));
    }
}
