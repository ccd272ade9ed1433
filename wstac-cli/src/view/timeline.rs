//! The time line that several files share: each gives its frames at their times, and jumps move all of them.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The largest lag in seconds that is caught up with. If a sensor is further behind, the others wait for it.
const MOST_BEHIND: f64 = 0.3;
/// The longest wait for a turn, so that signals and keys are seen.
const WAIT: Duration = Duration::from_millis(50);
/// Differences of times that do not count, in seconds.
const ALMOST: f64 = 1e-6;

/// What a sensor does next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    /// Nothing yet.
    Wait,
    /// Read the next item. Whether it is the last of a jump, so that its picture is shown.
    Step {
        /// Whether it is the last of a jump.
        arrives: bool,
    },
    /// Go back to the first frame.
    Back,
}

/// Where a sensor is on the time line.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The time of its first frame in seconds.
    start: f64,
    /// The time of a frame in seconds.
    period: f64,
    /// The time of its next frame in seconds.
    due: f64,
    /// Whether it has no more frames.
    is_over: bool,
    /// Whether the others wait for it: not for a pipe, whose frames may never come.
    is_waited_for: bool,
    /// The last jump that it knows, and whether it is still on its way.
    jump: u64,
    is_arriving: bool,
}

impl Place {
    /// Returns whether a frame at or behind a time was read, so that only the first frame leads to it.
    fn is_behind(&self, time: f64) -> bool {
        self.due > self.start && self.due - self.period >= time - ALMOST
    }
}

#[derive(Debug)]
struct Inner {
    /// The time at `since`, from which it runs on.
    position: f64,
    since: Instant,
    is_paused: bool,
    is_fast: bool,
    /// The number of jumps.
    jump: u64,
    places: Vec<Place>,
}

/// A time line in seconds. Frames before its time are shown.
#[derive(Debug)]
pub(super) struct Timeline {
    inner: Mutex<Inner>,
    changed: Condvar,
}

/// What is known of a sensor before its first frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// The time of its first frame in seconds.
    pub(super) start: f64,
    /// The time of a frame in seconds.
    pub(super) period: f64,
    /// Whether the others wait for it.
    pub(super) is_waited_for: bool,
}

impl Timeline {
    /// Creates a time line at 0 of sensors with these tracks. If it is fast, it goes on as soon as all have read.
    pub(super) fn new(tracks: impl IntoIterator<Item = Track>, is_fast: bool) -> Self {
        let place = |Track { start, period, is_waited_for }| Place {
            start,
            period,
            due: start,
            is_over: false,
            is_waited_for,
            jump: 0,
            is_arriving: false,
        };
        let places = tracks.into_iter().map(place).collect();
        let inner = Inner { position: 0.0, since: Instant::now(), is_paused: false, is_fast, jump: 0, places };
        Self { inner: Mutex::new(inner), changed: Condvar::new() }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits a short time for the turn of a sensor, and returns what it does.
    pub(super) fn turn(&self, sensor: usize) -> Turn {
        let inner = self.inner();
        let (mut inner, wait) = match Self::decide(inner, sensor) {
            (inner, Turn::Wait) => {
                let due = inner.places[sensor].due;
                let left = if inner.runs() && !inner.is_fast { due - inner.position } else { f64::MAX };
                (inner, Duration::try_from_secs_f64(left.max(0.0)).unwrap_or(WAIT).min(WAIT))
            }
            (_, turn) => return turn,
        };
        inner = self.changed.wait_timeout(inner, wait).unwrap_or_else(PoisonError::into_inner).0;
        Self::decide(inner, sensor).1
    }

    /// Returns what a sensor does now.
    fn decide(mut inner: MutexGuard<'_, Inner>, sensor: usize) -> (MutexGuard<'_, Inner>, Turn) {
        let (jump, position) = (inner.jump, inner.position);
        let place = &mut inner.places[sensor];
        if place.jump != jump {
            (place.jump, place.is_arriving) = (jump, true);
            if place.is_behind(position) {
                return (inner, Turn::Back);
            }
        }
        if place.is_arriving {
            if !place.is_over && place.due < position - ALMOST {
                let arrives = place.due + place.period >= position - ALMOST;
                return (inner, Turn::Step { arrives });
            }
            place.is_arriving = false;
            inner.since = Instant::now();
        }
        let now = inner.now();
        let place = inner.places[sensor];
        let is_due = inner.runs() && !place.is_over && place.due <= now + ALMOST;
        (inner, if is_due { Turn::Step { arrives: false } } else { Turn::Wait })
    }

    /// Notes the time of a sensor's next frame in seconds from its first, and whether it has no more frames.
    pub(super) fn reached(&self, sensor: usize, seconds: f64, is_over: bool) {
        let place = &mut self.inner().places[sensor];
        (place.due, place.is_over) = (place.start + seconds, is_over);
        self.changed.notify_all();
    }

    /// Notes that a sensor cannot go back. It stays until the time line has come to it.
    pub(super) fn stays(&self, sensor: usize) {
        self.inner().places[sensor].is_arriving = false;
        self.changed.notify_all();
    }

    /// Pauses or goes on.
    pub(super) fn pause(&self, is_paused: bool) {
        let mut inner = self.inner();
        inner.position = inner.now();
        inner.since = Instant::now();
        inner.is_paused = is_paused;
        self.changed.notify_all();
    }

    /// Goes back or forth by so many seconds.
    pub(super) fn seek(&self, seconds: i64) {
        let mut inner = self.inner();
        // At the end, the way back begins at the last frame.
        let end = inner.places.iter().fold(0.0_f64, |end, place| end.max(place.due));
        let to = inner.now().min(end) + seconds as f64;
        self.jump(&mut inner, to);
    }

    /// Goes back or forth by so many frames of a sensor.
    pub(super) fn step(&self, sensor: usize, frames: i64) {
        let mut inner = self.inner();
        let Some(Place { due, period, start, .. }) = inner.places.get(sensor).copied() else { return };
        // During a jump, the next step begins where it leads.
        let is_arriving = inner.places[sensor].jump != inner.jump || inner.places[sensor].is_arriving;
        let due = if is_arriving { inner.position.max(start) + 0.5 * period } else { due };
        // Half a frame is between two frames, so that no rounding matters.
        self.jump(&mut inner, due + (frames as f64 - 0.5) * period);
    }

    /// Goes to the first frame.
    pub(super) fn restart(&self) {
        self.jump(&mut self.inner(), 0.0);
    }

    /// Returns whether no sensor has more frames.
    pub(super) fn is_over(&self) -> bool {
        let inner = self.inner();
        let is_over = |place: &Place| place.is_over && place.jump == inner.jump;
        !inner.places.is_empty() && inner.places.iter().all(is_over)
    }

    fn jump(&self, inner: &mut Inner, to: f64) {
        inner.position = to.max(0.0);
        inner.jump += 1;
        self.changed.notify_all();
    }
}

impl Inner {
    /// Returns whether time passes.
    fn runs(&self) -> bool {
        let is_away = |place: &Place| place.is_waited_for && (place.is_arriving || place.jump != self.jump);
        !self.is_paused && !self.places.iter().any(is_away)
    }

    /// Returns the time now. It stays behind if a sensor is too slow.
    fn now(&mut self) -> f64 {
        let waited = self.places.iter().filter(|place| place.is_waited_for && !place.is_over);
        let slowest = waited.map(|place| place.due).reduce(f64::min);
        if !self.runs() {
            self.since = Instant::now();
        } else if let Some(slowest) = slowest.filter(|_| self.is_fast) {
            self.position = slowest.max(self.position);
        } else {
            let now = Instant::now();
            self.position += now.duration_since(self.since).as_secs_f64();
            self.since = now;
            if let Some(slowest) = slowest.filter(|slowest| self.position - slowest > MOST_BEHIND) {
                self.position = slowest;
            }
        }
        self.position
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACK: Track = Track { start: 0.0, period: 0.1, is_waited_for: true };

    /// Lets sensors of 40 frames each take their turns until none has one.
    fn settle(timeline: &Timeline, frames: &mut [u32], starts: &[f64]) -> u32 {
        let mut backs = 0;
        // A turn that is none is certain only after all sensors have seen the others' last.
        let mut waits = 0;
        while waits < 2 * frames.len() {
            for (sensor, frame) in frames.iter_mut().enumerate() {
                let inner = timeline.inner();
                match Timeline::decide(inner, sensor).1 {
                    Turn::Wait => {
                        waits += 1;
                        continue;
                    }
                    Turn::Step { .. } => *frame += 1,
                    Turn::Back => (*frame, backs) = (0, backs + 1),
                }
                waits = 0;
                assert!(starts[sensor] >= 0.0);
                timeline.reached(sensor, 0.1 * f64::from(*frame), *frame >= 40);
            }
        }
        backs
    }

    #[test]
    fn jumps_move_all_sensors_to_one_time() {
        // The second sensor starts 0.5 s later, and has half the frames per second.
        let tracks = [TRACK, Track { start: 0.5, period: 0.1, is_waited_for: true }];
        let timeline = Timeline::new(tracks, false);
        timeline.pause(true);
        let mut frames = [0; 2];
        let mut go = |backs| assert_eq!(settle(&timeline, &mut frames, &[0.0, 0.5]), backs);
        timeline.seek(2);
        go(0);
        timeline.seek(-1);
        go(2);
        let shown = |sensor: usize| timeline.inner().places[sensor].due;
        assert!((shown(0) - 1.0).abs() < 1e-9 && (shown(1) - 1.0).abs() < 1e-9);
        // A frame forth, and a frame back, which needs the first frame.
        timeline.step(0, 1);
        go(0);
        assert!((shown(0) - 1.1).abs() < 1e-9, "{}", shown(0));
        timeline.step(0, -1);
        go(2);
        assert!((shown(0) - 1.0).abs() < 1e-9, "{}", shown(0));
        // Two steps at once are two frames.
        timeline.step(0, 1);
        timeline.step(0, 1);
        go(0);
        assert!((shown(0) - 1.2).abs() < 1e-9, "{}", shown(0));
        // Behind the end, and back from there.
        timeline.seek(10);
        go(0);
        assert!(timeline.is_over());
        assert!((shown(0) - 4.0).abs() < 1e-9 && (shown(1) - 4.5).abs() < 1e-9);
        timeline.seek(-1);
        go(2);
        assert!((shown(0) - 3.5).abs() < 1e-9 && (shown(1) - 3.5).abs() < 1e-9);
        timeline.restart();
        go(2);
        assert!(shown(0).abs() < 1e-9 && (shown(1) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_fast_time_line_keeps_sensors_together() {
        let timeline = Timeline::new([TRACK, Track { period: 0.05, ..TRACK }], true);
        // The first sensor has read a frame, and waits for the second one, which reads two.
        assert_eq!(timeline.turn(0), Turn::Step { arrives: false });
        timeline.reached(0, 0.1, false);
        assert_eq!(timeline.turn(0), Turn::Wait);
        for due in [0.05, 0.1] {
            assert_eq!(timeline.turn(1), Turn::Step { arrives: false });
            timeline.reached(1, due, false);
        }
        assert_eq!(timeline.turn(0), Turn::Step { arrives: false });
        // One that has ended holds up nobody.
        timeline.reached(1, 0.1, true);
        timeline.reached(0, 0.2, false);
        assert_eq!(timeline.turn(0), Turn::Step { arrives: false });
    }

    #[test]
    fn a_slow_file_holds_up_the_others_and_a_silent_pipe_nobody() {
        for (is_waited_for, is_held) in [(true, true), (false, false)] {
            let timeline = Timeline::new([TRACK, Track { is_waited_for, ..TRACK }], false);
            timeline.reached(0, 1.0, false);
            // As if 10 s had passed.
            timeline.inner().since = Instant::now().checked_sub(Duration::from_secs(10)).unwrap();
            let turn = Timeline::decide(timeline.inner(), 0).1;
            assert_eq!(turn == Turn::Wait, is_held, "{turn:?}");
        }
    }

    #[test]
    fn a_pause_stops_the_time() {
        let timeline = Timeline::new([TRACK], false);
        timeline.pause(true);
        assert_eq!(timeline.turn(0), Turn::Wait);
        timeline.pause(false);
        assert_eq!(timeline.turn(0), Turn::Step { arrives: false });
    }
}
