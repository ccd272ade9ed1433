//! The times of frames by their numbers: on the driver's clock, and on the wall clock where the source knows it.

use std::collections::VecDeque;
use std::time::{Duration, SystemTime};

use serde::Serialize;
use wstac_core::rate::FrameRate;

/// The first second of the year 10000, from 1970 on. Times as text have four digits of a year.
const END_OF_YEARS_S: u64 = 253_402_300_800;
/// Frames whose own times are kept: more than a sample and the touch before it have, and a slow block of 120 mm.
const KEPT: usize = 512;
/// Nanoseconds of a second.
const SECOND: i128 = 1_000_000_000;
/// The most that a camera is off its frame rate before it is known how fast it runs, in millionths.
const MOST_UNKNOWN_OFF: i128 = 20_000;
/// The least by which its rate is taken to be off, in millionths.
const LEAST_OFF: i128 = 1000;
/// The frames with times of their own that show how fast it runs.
const RATE_FRAMES: usize = 8;

/// The clock of a stream's times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum StreamClock {
    /// The driver's monotonic clock, now or when the frames were recorded.
    Driver,
    /// The clock of a board, matched with this machine's monotonic clock.
    Board,
    /// The source states no times: frames are counted from 0, and the frame rate gives their times.
    #[default]
    Frames,
}

impl StreamClock {
    /// Returns the name in records: `driver`, `board` or `frames`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Driver => "driver",
            Self::Board => "board",
            Self::Frames => "frames",
        }
    }
}

/// A wall-clock time with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// The time by this machine's wall clock, now or when it was recorded.
    pub time: SystemTime,
    /// The most by which it may differ from the time that this clock would have shown.
    pub within: Duration,
}

/// The time from the first frame of a stream to the frame at which its processor was restarted last.
///
/// [`Output::after`](crate::output::Output::after) counts an output's times from the first frame with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Elapsed {
    /// For times in nanoseconds. It is 0 by a driver's clock, which goes on.
    time_ns: u64,
    /// For times in seconds.
    time_s: f64,
}

impl Elapsed {
    /// Returns a time in nanoseconds, counted from the stream's first frame; `None` from 2^63 on.
    pub(crate) fn nanoseconds(self, time_ns: u64) -> Option<u64> {
        self.time_ns.checked_add(time_ns).filter(|time_ns| i64::try_from(*time_ns).is_ok())
    }

    /// Returns a time in seconds, counted from the stream's first frame.
    pub(crate) fn seconds(self, time_s: f64) -> f64 {
        self.time_s + time_s
    }
}

/// Returns whether a wall-clock time is of the years 1970 to 9999, so that it can be written as text.
///
/// A clock that was never set starts in 1970, and a frame may be before that. A damaged recording may have any time.
pub(crate) fn can_be_written(time: SystemTime) -> bool {
    time.duration_since(SystemTime::UNIX_EPOCH).is_ok_and(|since| since.as_secs() < END_OF_YEARS_S)
}

/// The match of a board's clock and this machine's.
#[cfg(feature = "board")]
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClockMatch {
    /// The most that a time of the board may be wrong here, in milliseconds.
    pub within_ms: f64,
    /// This machine's monotonic time less the board's, in seconds.
    pub offset_s: f64,
    /// How much faster the board's clock runs, in millionths; `None` before ten seconds have passed.
    pub fast_ppm: Option<f64>,
}

/// Turns numbers of feature frames into times.
///
/// A frame has the driver's time of the first of its camera frames that arrived. Where all were lost, the frames around
/// it give the time, and the frame rate does before the first and after the last frame. The wall-clock time of one
/// frame gives that of the others: a camera's is that of the frame that arrived last, a board's is a second old at
/// most.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameClock {
    /// The duration of a feature frame in nanoseconds: numerator and denominator.
    period: (i128, i128),
    /// The clock that the source states.
    stated: StreamClock,
    /// The clock; `None` before the first frame.
    clock: Option<StreamClock>,
    /// The frame that seconds are counted from: 0, or that of the last restart.
    start: u64,
    /// The time of the frame that seconds are counted from, which may be lost.
    zero: i128,
    /// Whether a time of the source has given `zero`.
    has_zero: bool,
    /// The time of frame 0 of the stream, since a restart.
    first: Option<i128>,
    /// Frames by their numbers, with their driver's times.
    taken: VecDeque<(u64, i128)>,
    /// The number of a feature frame, and the wall-clock time when it was taken.
    last: Option<(u64, Stamp)>,
}

impl FrameClock {
    pub(crate) fn new(rate: FrameRate, stated: StreamClock) -> Self {
        let period =
            (SECOND * i128::from(rate.denominator()) * i128::from(rate.frames_added()), i128::from(rate.numerator()));
        Self { period, stated, ..Self::default() }
    }

    /// Counts frames from now on, unless a frame has shown another clock: the source will never state times.
    #[cfg(feature = "board")]
    pub(crate) fn count_frames(&mut self) {
        self.clock.get_or_insert(StreamClock::Frames);
    }

    /// Returns the clock of a source that has started again.
    #[cfg(feature = "board")]
    pub(crate) fn renewed(&self) -> Self {
        let clock = self.clock.filter(|clock| *clock == StreamClock::Frames);
        let Self { period, stated, .. } = *self;
        Self { period, stated, clock, ..Self::default() }
    }

    /// Returns whether frames last as long by another clock.
    #[cfg(feature = "board")]
    pub(crate) fn has_rate_of(&self, other: &Self) -> bool {
        self.period == other.period
    }

    /// Takes the times of a camera frame of feature frame `frame`, or that the source knows none.
    pub(crate) fn frame_arrives(&mut self, frame: u64, timestamp: Option<Duration>, stamp: Option<Stamp>) {
        if stamp.is_none() || self.last.is_none_or(|(last, _)| last != frame) {
            self.wall_clock(frame, stamp);
        }
        if *self.clock.get_or_insert(self.stated) == StreamClock::Frames {
            return;
        }
        let Some(time) = timestamp.map(|time| i128::from(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX))) else {
            return;
        };
        if !self.has_zero {
            (self.zero, self.has_zero) = (time.saturating_sub(self.span(frame.saturating_sub(self.start))), true);
        }
        if self.taken.back().is_none_or(|(last, _)| *last < frame) {
            self.taken.drain(..self.taken.len().saturating_sub(KEPT - 1));
            self.taken.push_back((frame, time));
        }
    }

    /// Takes the wall-clock time of a frame, or that the source knows none.
    pub(crate) fn wall_clock(&mut self, frame: u64, stamp: Option<Stamp>) {
        self.last = stamp.map(|stamp| (frame, stamp));
    }

    /// Counts seconds from this frame on, and takes the next frame as the first.
    pub(crate) fn restart(&mut self, frame: u64) {
        // Before any frame, the time of frame 0 is not known, and nothing was counted from it.
        let is_known = self.stated == StreamClock::Frames || self.has_zero;
        if self.first.is_none() && self.clock.is_some() && is_known {
            self.first = Some(self.zero);
        }
        self.clock = None;
        self.taken.clear();
        (self.start, self.zero, self.has_zero) = (frame, self.span(frame), false);
    }

    /// Returns the time from frame 0 of the stream to that of the last restart.
    ///
    /// By a driver's clock it is known from the first frame after the restart on; until then it is 0.
    pub(crate) fn elapsed(&self) -> Elapsed {
        let is_counted = self.stated == StreamClock::Frames;
        let Some(first) = self.first.filter(|_| is_counted || self.has_zero) else { return Elapsed::default() };
        let since = u64::try_from(self.zero.saturating_sub(first).max(0)).unwrap_or(u64::MAX);
        // The driver's own times go on.
        Elapsed { time_ns: if is_counted { since } else { 0 }, time_s: since as f64 / SECOND as f64 }
    }

    /// Returns the clock of the times.
    pub(crate) fn clock(&self) -> StreamClock {
        self.clock.unwrap_or_default()
    }

    #[cfg(feature = "board")]
    pub(crate) fn is_known(&self) -> bool {
        self.clock.is_some()
    }

    /// Returns the time of a frame in nanoseconds on the [clock](Self::clock); `None` before the first frame, and from
    /// 2^63 on, after 292 years.
    pub(crate) fn nanoseconds(&self, frame: u64) -> Option<u64> {
        let since = if self.clock? == StreamClock::Frames { self.zero } else { 0 };
        Some(i64::try_from(self.time(frame).saturating_sub(since).max(0)).ok()?.cast_unsigned())
    }

    /// Returns the time of a frame in seconds from the first frame.
    pub(crate) fn seconds(&self, frame: u64) -> f64 {
        self.time(frame).saturating_sub(self.zero) as f64 / SECOND as f64
    }

    /// Returns the wall-clock time of a frame, in the years 1970 to 9999; `None` if the source knows none.
    pub(crate) fn stamp(&self, frame: u64) -> Option<Stamp> {
        let (last, Stamp { time, within }) = self.last?;
        let since = self.time(frame).saturating_sub(self.time(last));
        let distance = Duration::from_nanos(u64::try_from(since.unsigned_abs()).ok()?);
        let time = if since < 0 { time.checked_sub(distance)? } else { time.checked_add(distance)? };
        let within = within.saturating_add(self.unsure(frame, last));
        can_be_written(time).then_some(Stamp { time, within })
    }

    /// Returns by how much the time between two frames may be wrong, because the frame rate gives a part of it and a
    /// camera runs a little faster or slower. Both may be any frames; `last` is the one whose wall-clock time is known.
    fn unsure(&self, frame: u64, last: u64) -> Duration {
        let frames = match (self.taken.front(), self.taken.back()) {
            (Some((from, _)), Some((to, _))) => {
                let outside = |frame: u64| from.saturating_sub(frame).max(frame.saturating_sub(*to));
                outside(frame).saturating_add(outside(last))
            }
            _ => frame.abs_diff(last),
        };
        let wrong = self.span(frames).saturating_mul(self.off_rate()) / 1_000_000;
        Duration::from_nanos(u64::try_from(wrong).unwrap_or(u64::MAX))
    }

    /// Returns how far the camera may be off its frame rate in millionths: twice what the last frames with times of
    /// their own show.
    fn off_rate(&self) -> i128 {
        let first = self.taken.len().saturating_sub(RATE_FRAMES);
        match (self.taken.get(first), self.taken.back()) {
            (Some((first, from)), Some((last, to))) if first < last => {
                let expected = self.span(last - first).max(1);
                ((to - from - expected).abs().saturating_mul(2_000_000) / expected).max(LEAST_OFF)
            }
            _ => MOST_UNKNOWN_OFF,
        }
    }

    /// Returns whether these frames came as fast as agreed on, within 3 %.
    pub(crate) fn is_in_time(&self, first: u64, last: u64) -> bool {
        let span = self.span(last.saturating_sub(first));
        let of = |frame| self.nanoseconds(frame).map(i128::from);
        of(first).zip(of(last)).is_none_or(|(first, last)| 100 * (last - first - span).abs() <= 3 * span)
    }

    /// Returns the time of so many frames by the frame rate, in nanoseconds.
    fn span(&self, frames: u64) -> i128 {
        i128::from(frames).saturating_mul(self.period.0) / self.period.1
    }

    /// Returns the time of a frame: the driver's own, else one between those of its neighbors. Without any it is that
    /// by the frame rate.
    fn time(&self, frame: u64) -> i128 {
        let after = self.taken.partition_point(|(number, _)| *number < frame);
        let before = after.checked_sub(1).and_then(|before| self.taken.get(before));
        match (before, self.taken.get(after)) {
            (_, Some((number, time))) if *number == frame => *time,
            (Some((first, from)), Some((last, to))) => {
                let (part, whole) = (i128::from(frame - first), i128::from(last - first));
                // Times are of 64 bits, so their difference is exact.
                from + (to - from).saturating_mul(part) / whole
            }
            (Some((first, from)), None) => from.saturating_add(self.span(frame - first)),
            (None, Some((last, to))) => to.saturating_sub(self.span(last - frame)),
            (None, None) => self.span(frame),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Returns a clock of 30 frames per second that has seen frames with these times in milliseconds.
    fn with(frames: &[(u64, u64)]) -> FrameClock {
        let mut clock = FrameClock::new(FrameRate::NOMINAL, StreamClock::Driver);
        for (frame, ms) in frames {
            clock.frame_arrives(*frame, Some(Duration::from_millis(*ms)), None);
        }
        clock
    }

    fn at(time: SystemTime) -> Stamp {
        Stamp { time, within: Duration::from_micros(500) }
    }

    #[test]
    fn frames_have_the_times_of_their_numbers() {
        let mut clock = FrameClock::new(FrameRate::NOMINAL, StreamClock::Frames);
        assert_eq!((clock.nanoseconds(45), clock.stamp(45)), (None, None));
        clock.frame_arrives(0, None, None);
        assert!((clock.seconds(45) - 1.5).abs() < 1e-12);
        assert_eq!((clock.clock(), clock.nanoseconds(46)), (StreamClock::Frames, Some(1_533_333_333)));
        // 120 frames per second are 30 feature frames per second.
        let fast = FrameClock::new(FrameRate::new(120, 1).unwrap(), StreamClock::Frames);
        assert!((fast.seconds(30) - 1.0).abs() < 1e-12);
        // The source says whether there are times: a stream has one clock.
        clock.frame_arrives(46, Some(Duration::from_mins(15)), None);
        assert_eq!((clock.clock(), clock.nanoseconds(46)), (StreamClock::Frames, Some(1_533_333_333)));
        clock.restart(46);
        assert_eq!(clock.nanoseconds(46), None);
        clock.frame_arrives(46, None, None);
        assert_eq!((clock.nanoseconds(46), clock.nanoseconds(76)), (Some(0), Some(1000 * MS)));
        assert!((clock.seconds(76) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn after_a_restart_seconds_count_from_there_and_the_time_before_is_known() {
        let mut counted = FrameClock::new(FrameRate::NOMINAL, StreamClock::Frames);
        assert_eq!(counted.elapsed(), Elapsed::default());
        for (frame, seconds) in [(45, 1.5), (60, 2.0)] {
            counted.frame_arrives(frame - 1, None, None);
            counted.restart(frame);
            let elapsed = counted.elapsed();
            assert_eq!(elapsed, Elapsed { time_ns: (seconds * 1e9) as u64, time_s: seconds });
            counted.frame_arrives(frame, None, None);
            let expected = Some(elapsed.time_ns + 1000 * MS);
            assert_eq!(counted.nanoseconds(frame + 30).and_then(|time| elapsed.nanoseconds(time)), expected);
        }
        // The driver's clock goes on. Its frames come late, and seconds are its own.
        let mut driver = with(&[(0, 5000), (1, 5040)]);
        driver.restart(2);
        assert_eq!(driver.elapsed(), Elapsed::default());
        driver.frame_arrives(2, Some(Duration::from_millis(5100)), None);
        driver.frame_arrives(3, Some(Duration::from_millis(5130)), None);
        assert_eq!(driver.elapsed(), Elapsed { time_ns: 0, time_s: 0.1 });
        assert!(driver.seconds(2).abs() < 1e-9 && (driver.seconds(3) - 0.03).abs() < 1e-9);
        // A restart before the first frame.
        let mut early = FrameClock::new(FrameRate::NOMINAL, StreamClock::Driver);
        early.restart(0);
        early.frame_arrives(0, Some(Duration::from_secs(7)), None);
        assert_eq!(early.elapsed(), Elapsed::default());
    }

    #[test]
    fn a_frame_keeps_its_drivers_time() {
        // The driver runs at 25 frames per second, and frames 13 and 14 are lost.
        let clock = with(&[(10, 5000), (11, 5043), (12, 5080), (15, 5200)]);
        assert_eq!(clock.clock(), StreamClock::Driver);
        let times = [10, 11, 12, 13, 14, 15].map(|frame| clock.nanoseconds(frame).unwrap() / MS);
        assert_eq!(times, [5000, 5043, 5080, 5120, 5160, 5200]);
        // Outside, the frame rate gives the time.
        assert_eq!(clock.nanoseconds(18), Some(5300 * MS));
        assert_eq!(clock.nanoseconds(7), Some(4900 * MS));
        // Frame 0 was lost: ten frames before frame 10.
        assert!((clock.seconds(10) - 1.0 / 3.0).abs() < 1e-8 && (clock.seconds(11) - 1.0 / 3.0 - 0.043).abs() < 1e-8);
        // Of camera frames that are added up, the first counts.
        let mut fast = FrameClock::new(FrameRate::new(60, 1).unwrap(), StreamClock::Driver);
        for (frame, ms) in [(0, 100), (0, 117), (1, 133), (1, 150)] {
            fast.frame_arrives(frame, Some(Duration::from_millis(ms)), None);
        }
        assert_eq!((fast.nanoseconds(0), fast.nanoseconds(1)), (Some(100 * MS), Some(133 * MS)));
    }

    #[test]
    fn old_frames_are_forgotten_and_wild_times_do_no_harm() {
        let frames: Vec<_> = (0..1000).map(|frame| (frame, 7000 + 40 * frame)).collect();
        let mut clock = with(&frames);
        assert_eq!(clock.taken.len(), KEPT);
        assert_eq!(clock.nanoseconds(1000 - KEPT as u64), Some((7000 + 40 * (1000 - KEPT as u64)) * MS));
        // A frame without a time of its own, a clock that goes back, and one at its end.
        clock.frame_arrives(1000, None, None);
        assert_eq!(clock.nanoseconds(1002), Some((7000 + 40 * 999 + 100) * MS));
        clock.frame_arrives(1003, Some(Duration::ZERO), None);
        assert_eq!(clock.nanoseconds(1003), Some(0));
        clock.frame_arrives(u64::MAX, Some(Duration::MAX), None);
        assert_eq!(clock.nanoseconds(u64::MAX), None);
        assert!(clock.seconds(u64::MAX / 2).is_finite() && clock.seconds(u64::MAX).is_finite());
        let mut last = FrameClock::new(FrameRate::new(1, 1).unwrap(), StreamClock::Frames);
        last.frame_arrives(0, None, None);
        let frames = i64::MAX.cast_unsigned() / 1_000_000_000;
        assert_eq!([frames, frames + 1].map(|frame| last.nanoseconds(frame)), [Some(frames * 1_000_000_000), None]);
        let elapsed = Elapsed { time_ns: i64::MAX.cast_unsigned() - 1, time_s: 0.0 };
        assert_eq!([1, 2, u64::MAX].map(|time| elapsed.nanoseconds(time).is_some()), [true, false, false]);
        clock.restart(u64::MAX);
        clock.frame_arrives(u64::MAX, Some(Duration::ZERO), Some(at(SystemTime::UNIX_EPOCH)));
        assert!(clock.nanoseconds(0) == Some(0) && clock.stamp(0).is_none());
    }

    #[test]
    fn wall_clock_times_are_those_of_years_that_can_be_written() {
        let mut clock = FrameClock::new(FrameRate::NOMINAL, StreamClock::Frames);
        let time = SystemTime::UNIX_EPOCH + Duration::from_secs(1000);
        clock.wall_clock(105, Some(at(time)));
        assert_eq!(clock.stamp(105), Some(at(time)));
        // The rate gives the time between, and the camera may be 2 % off it.
        let unsure = |distance: Duration| Duration::from_micros(500) + distance / 50;
        let far = Duration::from_secs(2);
        assert_eq!(clock.stamp(45), Some(Stamp { time: time - far, within: unsure(far) }));
        assert_eq!(clock.stamp(165), Some(Stamp { time: time + far, within: unsure(far) }));
        // The touch was two seconds before, and the clock started one second before; or it is far ahead.
        clock.wall_clock(105, Some(at(SystemTime::UNIX_EPOCH + Duration::from_secs(1))));
        assert_eq!(clock.stamp(45), None);
        clock.wall_clock(105, Some(at(SystemTime::UNIX_EPOCH + Duration::from_secs(END_OF_YEARS_S + 2))));
        assert_eq!((clock.stamp(105), clock.stamp(45)), (None, None));
        clock.wall_clock(105, Some(at(SystemTime::UNIX_EPOCH + Duration::from_secs(END_OF_YEARS_S + 1))));
        assert!(clock.stamp(105).is_none() && clock.stamp(45).is_some());
        clock.wall_clock(106, None);
        assert_eq!(clock.stamp(45), None);
        // The driver's own times tell how long before it was.
        let mut clock = with(&[(0, 0), (1, 40)]);
        clock.frame_arrives(2, Some(Duration::from_millis(90)), Some(at(time)));
        assert_eq!(clock.stamp(0), Some(at(time - Duration::from_millis(90))));
        // A frame to come is a period later, and these took 45 ms each instead of 33.
        let next = clock.stamp(3).unwrap();
        assert_eq!(next.time, time + Duration::from_nanos(33_333_333));
        assert!(next.within.abs_diff(Duration::from_micros(500 + 2 * 11_667)) < Duration::from_micros(10), "{next:?}");
        assert_eq!(clock.nanoseconds(3), Some(90 * MS + 33_333_333));
        // The end of all times, and of all frames.
        clock.frame_arrives(4, Some(Duration::MAX), Some(at(time)));
        assert!(clock.stamp(u64::MAX).is_none() && clock.stamp(0).is_none());
    }
}
