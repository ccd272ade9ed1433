//! Checks that a camera keeps the rate that was agreed on.
//!
//! It uses the driver's sequence numbers and timestamps alone, over at least two seconds and five frames. Frames that
//! were dropped count as taken, so a slow program or a full bus is no slow camera.

use std::time::Duration;

use wstac_core::rate::FrameRate;

use wstac_host::source::{Fault, FaultKind};

/// The shortest span of a measurement, in time and in frames.
const SPAN: Duration = Duration::from_secs(2);
const FRAMES: u32 = 5;
/// Longest span, and largest step of the sequence number. Beyond these it is a wrap or a reset: nothing is measured
/// across it.
const LONGEST: Duration = Duration::from_mins(10);
const MOST_FRAMES: u32 = 1 << 16;
/// Fractions of the agreed rate: below the first the camera is slow, and from the second on it is no longer slow.
const SLOW: f64 = 0.9;
const IN_TIME: f64 = 0.95;

/// The pace of one stream.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    /// Frames per second, as agreed.
    rate: f64,
    /// Sequence number and time of the first frame of the measurement.
    start: Option<(u32, Duration)>,
    /// Sequence number of the last frame.
    last: u32,
    slow: bool,
}

impl Pace {
    pub(super) fn new(rate: FrameRate) -> Self {
        let rate = rate.per_second();
        Self { rate, start: None, last: 0, slow: false }
    }

    /// Returns whether the camera was slow when it was measured last.
    pub(super) fn is_slow(&self) -> bool {
        self.slow
    }

    /// Notes a buffer, and returns a fault if the pace has changed.
    pub(super) fn arrive(&mut self, sequence: u32, timestamp: Option<Duration>) -> Option<Fault> {
        let step = sequence.wrapping_sub(std::mem::replace(&mut self.last, sequence));
        let Some(now) = timestamp else {
            self.start = None;
            return None;
        };
        let goes_on = self.start.filter(|_| step <= MOST_FRAMES);
        let span = goes_on.and_then(|(first, start)| Some((first, now.checked_sub(start)?)));
        let Some((first, span)) = span.filter(|(_, span)| *span <= LONGEST) else {
            self.start = Some((sequence, now));
            return None;
        };
        let frames = sequence.wrapping_sub(first);
        if span < SPAN || frames < FRAMES {
            return None;
        }
        self.start = Some((sequence, now));
        let measured = f64::from(frames) / span.as_secs_f64();
        let share = measured / self.rate;
        let slow = if self.slow { share < IN_TIME } else { share < SLOW };
        if slow == self.slow {
            return None;
        }
        self.slow = slow;
        Some(self.fault(measured))
    }

    /// Starts again with the stream: nothing is measured across the break.
    pub(super) fn restart(&mut self) {
        self.start = None;
    }

    fn fault(&self, measured: f64) -> Fault {
        let rate = self.rate;
        if self.slow {
            let message = format!(
                "the camera takes {measured:.1} frames per second, {rate:.1} were agreed on; those that are missing count as \
                 lost; usual cause: automatic exposure in the dark, so lock the exposure or add light"
            );
            return Fault::new(FaultKind::Slow, message);
        }
        Fault::new(FaultKind::InTime, format!("the camera takes {measured:.1} of {rate:.1} frames per second again"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the reports over `frames` at this rate from `start` on, by frame.
    fn said(pace: &mut Pace, start: f64, rate: f64, numbers: impl Iterator<Item = u32>) -> Vec<(u32, FaultKind)> {
        let time = |number| Some(Duration::from_secs_f64(start + f64::from(number) / rate));
        numbers.filter_map(|number| Some((number, pace.arrive(number, time(number))?.kind))).collect()
    }

    #[test]
    fn a_camera_in_time_is_not_mentioned() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 30.0, 0..1000), []);
        // Half of them are dropped, and the rate is a little off.
        assert_eq!(said(&mut pace, 200.0, 28.0, (0..1000).step_by(2)), []);
    }

    #[test]
    fn a_slow_camera_is_told_once_and_once_more_when_it_recovers() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 15.0, 0..150), [(30, FaultKind::Slow)]);
        assert!(pace.is_slow());
        // The rate is back at 30 per second. The span that holds both rates may still be slow.
        let told = said(&mut pace, 110.0 - 150.0 / 30.0, 30.0, 150..450);
        assert!(matches!(told[..], [(210..=211, FaultKind::InTime)]), "{told:?}");
        assert!(!pace.is_slow());
    }

    #[test]
    fn both_rates_are_named() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        let time = |number: u32| Some(Duration::from_millis(u64::from(number) * 133));
        let fault = (1..100).find_map(|number| pace.arrive(number, time(number))).unwrap();
        assert!(fault.message.contains("7.5 frames per second, 30.0 were agreed on"), "{}", fault.message);
        assert!(fault.message.contains("exposure"));
    }

    #[test]
    fn a_short_delay_says_nothing() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        let time =
            |number: u32| Duration::from_millis(1000 + u64::from(number) * 100 / 3 + 150 * u64::from(number > 20));
        assert_eq!((0..600).find_map(|number| pace.arrive(number, Some(time(number)))), None);
    }

    #[test]
    fn nothing_is_measured_across_a_reset_or_without_times() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 30.0, 0..50), []);
        // The sequence number starts again, then the time does.
        assert_eq!(said(&mut pace, 102.0, 30.0, 0..50), []);
        assert_eq!(said(&mut pace, 5.0, 30.0, 50..100), []);
        assert_eq!(said(&mut pace, 1e9, 30.0, 100..150), []);
        assert_eq!((0..1000).find_map(|number| pace.arrive(number, None)), None);
        // The number wraps.
        let numbers = (0..200_u32).map(|number| (u32::MAX - 100).wrapping_add(number));
        let time = |index: usize| Some(Duration::from_secs_f64(index as f64 / 30.0));
        assert_eq!(numbers.enumerate().find_map(|(index, number)| pace.arrive(number, time(index))), None);
    }

    #[test]
    fn a_break_is_not_slowness() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 30.0, 0..40), []);
        pace.restart();
        assert_eq!(said(&mut pace, 130.0, 30.0, 0..200), []);
    }

    #[test]
    fn very_slow_cameras_are_measured_over_five_frames() {
        let mut pace = Pace::new(FrameRate::new(1, 2).unwrap());
        assert_eq!(said(&mut pace, 0.0, 0.25, 0..20), [(5, FaultKind::Slow)]);
    }
}
