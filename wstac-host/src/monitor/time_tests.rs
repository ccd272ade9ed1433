//! Tests that records of a board have this machine's times once the clocks are matched.

use std::time::{Duration, SystemTime};

use wstac_core::paper::trigger::InterruptedSample;
use wstac_core::wire::{FrameTime, LONGEST, Telemetry, encode};

use super::tests::hello;
use super::*;
use crate::output::{InterruptedReport, StreamClock, StreamSummary};

/// A board that is read, and this machine's time.
struct Live {
    monitor: Monitor,
    sequence: u16,
}

impl Live {
    fn new() -> Self {
        Self { monitor: Monitor::new(OutputOptions::default()), sequence: 0 }
    }

    /// Sets this machine's time in milliseconds. The wall clock is 1,700,000,000 s ahead.
    fn set(&mut self, ms: u64) -> Option<Request> {
        let now = Duration::from_millis(ms);
        self.monitor.set_now((now, SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000) + now))
    }

    fn send(&mut self, message: &Message<'_>) -> Vec<Output> {
        let mut outputs = Vec::new();
        let give = |report| {
            if let Report::Output(output) = report {
                outputs.push(output);
            }
        };
        self.monitor.take(encode(message, self.sequence, &mut [0; LONGEST]), give).unwrap();
        self.sequence += 1;
        outputs
    }

    /// Sends the state of the board, whose last frame was taken then by its clock.
    fn state(&mut self, frame: u64, board_us: u64) {
        let mut telemetry = Telemetry::default();
        telemetry.last_frame = Some(FrameTime { frame, board_us });
        telemetry.uptime_ms = board_us / 1000;
        self.send(&Message::Telemetry(telemetry));
    }

    /// Returns the record of a sample that was interrupted.
    fn record(&mut self, frame: u64) -> InterruptedReport {
        match &self.send(&Message::InterruptedSample(InterruptedSample::new(frame, 7)))[..] {
            [Output::Interrupted(record)] => *record,
            other => panic!("{other:?}"),
        }
    }

    fn end(&self) -> StreamSummary {
        let Output::End(end) = self.monitor.finish() else { panic!("the end") };
        end
    }
}

#[test]
fn times_are_this_machines_once_the_clocks_are_matched() {
    let mut live = Live::new();
    let Some(Request::Time { host_us }) = live.set(90_000) else { panic!("the board is asked") };
    live.send(&hello(0));
    assert_eq!((live.record(35).time_ns, live.end().time_ns), (None, None));
    // The board started 80 s after this machine, and answers within 2 ms.
    live.set(90_002);
    live.send(&Message::Time { host_us, board_us: 10_001_000 });
    live.state(60, 10_000_000);
    let record = live.record(30);
    assert_eq!(record.time_ns, Some(90_000_000_000 - 1_001_000_000));
    // A second before the only time that is known, which the rate alone gives: the camera may be 2 % off it.
    let early = record.stamp.unwrap().within.as_micros();
    assert!((21_000..22_100).contains(&early), "{early} us");
    let record = live.record(60);
    let stamp = record.stamp.unwrap();
    let since = stamp.time.duration_since(SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000)).unwrap();
    assert_eq!(since.as_nanos(), u128::from(record.time_ns.unwrap()));
    assert!((Duration::from_millis(1)..Duration::from_millis(2)).contains(&stamp.within), "{stamp:?}");
    let found = live.monitor.board.own_clock.matched().unwrap();
    assert!((found.offset_s - 80.0).abs() < 1e-6, "{found:?}");
    assert_eq!(live.end().clock, StreamClock::Board);
    // The camera is slower than agreed on: frames between two states have times between them.
    live.set(91_002);
    live.state(80, 11_000_000);
    assert_eq!(live.record(70).time_ns, Some(90_500_000_000));
}

/// The board says once per second when its last frame was taken. Those behind it are later by the same time on both
/// clocks.
#[test]
fn frames_behind_the_last_state_have_stamps_of_their_own() {
    let mut live = Live::new();
    let Some(Request::Time { host_us }) = live.set(90_000) else { panic!("the board is asked") };
    live.send(&hello(0));
    live.set(90_002);
    live.send(&Message::Time { host_us, board_us: 10_001_000 });
    live.state(60, 10_000_000);
    let wall = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000);
    let known = live.record(60).stamp.unwrap();
    let mut before = Duration::ZERO;
    for frame in 61..=90 {
        let (record, since) = (live.record(frame), Duration::from_nanos((frame - 60) * 1_001_000_000 / 30));
        let stamp = record.stamp.unwrap();
        assert_eq!(stamp.time.duration_since(known.time).unwrap(), since);
        assert_eq!(stamp.time, wall + Duration::from_nanos(record.time_ns.unwrap()));
        // The camera may be 2 % off its rate.
        assert!(stamp.within > known.within + since / 51 && stamp.within > before, "{stamp:?} at {frame}");
        before = stamp.within;
    }
    // It is 1 % slow: its frame 90 was taken 10 ms later than the rate says. From then on its rate is known.
    let told = live.record(90).stamp.unwrap();
    live.set(91_014);
    live.state(90, 11_011_010);
    let [last, next] = [90, 120].map(|frame| live.record(frame).stamp.unwrap());
    let wrong = last.time.duration_since(told.time).unwrap();
    assert!(wrong.abs_diff(Duration::from_micros(10_010)) < Duration::from_micros(2) && told.within > wrong);
    assert_eq!(next.time.duration_since(last.time).unwrap(), Duration::from_millis(1001));
    let widened = next.within.checked_sub(last.within).unwrap();
    assert!(widened.abs_diff(Duration::from_micros(20_020)) < Duration::from_micros(10), "{widened:?}");
}

#[test]
fn a_board_whose_clock_cannot_be_matched_counts_frames() {
    let mut live = Live::new();
    live.set(90_000);
    live.send(&hello(0));
    for second in 1..=3 {
        assert_eq!(live.record(30).time_ns, None);
        live.set(90_000 + 1000 * second);
        live.state(30 * second, 1_000_000 * second);
    }
    assert_eq!((live.record(30).time_ns, live.end().clock), (Some(1_001_000_000), StreamClock::Frames));
    // So does the file of a board's bytes, at once.
    let mut file = Live::new();
    file.send(&hello(0));
    assert_eq!((file.record(30).time_ns, file.end().clock), (Some(1_001_000_000), StreamClock::Frames));
}
