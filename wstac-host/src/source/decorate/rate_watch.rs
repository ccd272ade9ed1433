//! Checks that a camera keeps the rate that was agreed on.

use std::collections::VecDeque;
use std::time::Duration;

use wstac_core::rate::FrameRate;

use crate::error::Error;
use crate::output::OutputOptions;
use crate::source::{Fault, FaultKind, Frame, LossReason, RATE_OFF, Source, SourceEvent, StreamInfo};

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
/// From this on it is too fast over the shortest span, too: a first slide must not be reliable.
const FAST: f64 = 1.05;
/// The span over which a smaller deviation is measured.
const LONG_SPAN: Duration = Duration::from_secs(10);

/// Reports a fault if a source's frames come at another rate than agreed on, and once more if they come in time again.
/// A rate that is more than 2 % off over ten seconds, or 5 % too high over two, is reported once in each direction,
/// until it is right again, which is reported, too.
///
/// It uses the driver's sequence numbers and timestamps alone, over at least two seconds and five frames. Frames that
/// were dropped count as taken, so a slow program or a full bus is no slow camera. While the camera is slow, frames
/// that it did not take count as [`LossReason::NeverTaken`] instead of [`LossReason::Dropped`].
///
/// The fault comes before the frame that shows it, and before the losses ahead of that frame. So losses are held back
/// until the next event of the source; [`SourceEvent::Waiting`] stands in their place.
///
/// ```no_run
/// # fn watched(camera: impl wstac_host::source::Source + 'static) -> Result<(), Box<dyn std::error::Error>> {
/// use wstac_host::output::Output;
/// use wstac_host::session::Session;
/// use wstac_host::source::FaultKind;
/// use wstac_host::source::decorate::RateWatch;
///
/// for output in Session::builder(RateWatch::new(camera)).build()? {
///     if let Output::Fault(report) = output?
///         && report.fault.kind == FaultKind::Slow
///     {
///         println!("{}", report.fault);
///     }
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct RateWatch<S> {
    source: S,
    pace: Pace,
    /// Losses ahead of the next event.
    losses: VecDeque<(u64, LossReason)>,
    /// Events to hand out before the source is asked again. A frame stands for the one that was copied.
    ready: VecDeque<Result<SourceEvent<'static>, Error>>,
    copy: FrameCopy,
}

/// A frame that outlives the source's next event.
#[derive(Debug, Default)]
struct FrameCopy {
    bytes: Vec<u8>,
    encoded: Option<Vec<u8>>,
    /// The rest of the frame.
    facts: Frame<'static>,
}

impl FrameCopy {
    fn set(&mut self, frame: &Frame<'_>) {
        let Frame { timestamp, stamp, sequence, lag, .. } = *frame;
        self.facts = Frame { timestamp, stamp, sequence, lag, ..Frame::default() };
        self.bytes.clear();
        self.bytes.extend_from_slice(frame.bytes);
        self.encoded = frame.encoded.map(<[u8]>::to_vec);
    }

    /// Returns the next event, in which this is the frame.
    fn event(&self, ready: &mut VecDeque<Result<SourceEvent<'static>, Error>>) -> Result<SourceEvent<'_>, Error> {
        ready.pop_front().unwrap_or(Ok(SourceEvent::Waiting)).map(|event| match event {
            SourceEvent::Frame(_) => SourceEvent::Frame(self.frame()),
            event => event,
        })
    }

    fn frame(&self) -> Frame<'_> {
        Frame { bytes: &self.bytes, encoded: self.encoded.as_deref(), ..self.facts }
    }
}

impl<S: Source> RateWatch<S> {
    /// Wraps a source. The rate that was agreed on is that of its [`StreamInfo`].
    pub fn new(source: S) -> Self {
        let pace = Pace::new(source.info().rate);
        Self { source, pace, losses: VecDeque::new(), ready: VecDeque::new(), copy: FrameCopy::default() }
    }
}

impl<S: Source> Source for RateWatch<S> {
    fn info(&self) -> &StreamInfo {
        self.source.info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if !self.ready.is_empty() {
            return self.copy.event(&mut self.ready);
        }
        let event = match self.source.next_event() {
            Ok(SourceEvent::Frame(frame)) => {
                let fault = frame.sequence.and_then(|sequence| self.pace.arrive(sequence, frame.timestamp));
                if fault.is_none() && self.losses.is_empty() {
                    return Ok(SourceEvent::Frame(frame));
                }
                self.copy.set(&frame);
                self.ready.extend(fault.map(|fault| Ok(SourceEvent::Fault(fault))));
                Ok(SourceEvent::Frame(Frame::default()))
            }
            Ok(SourceEvent::Lost { frames, reason: reason @ (LossReason::Dropped | LossReason::Skipped) }) => {
                self.losses.push_back((frames, reason));
                return Ok(SourceEvent::Waiting);
            }
            Ok(SourceEvent::Lost { frames, reason }) => {
                if matches!(reason, LossReason::Disconnected | LossReason::NoSignal) {
                    self.pace.restart();
                }
                Ok(SourceEvent::Lost { frames, reason })
            }
            Ok(SourceEvent::Fault(fault)) => {
                if matches!(fault.kind, FaultKind::Disconnected | FaultKind::Reconnected) {
                    self.pace.restart();
                }
                Ok(SourceEvent::Fault(fault))
            }
            Ok(SourceEvent::Taxels(frame)) => Ok(SourceEvent::Taxels(frame)),
            #[cfg(feature = "board")]
            Ok(SourceEvent::Report(report)) => Ok(SourceEvent::Report(report)),
            Ok(SourceEvent::Waiting) => Ok(SourceEvent::Waiting),
            Ok(SourceEvent::End) => Ok(SourceEvent::End),
            Err(error) => Err(error),
        };
        let is_slow = self.pace.slow;
        self.ready.extend(self.losses.drain(..).map(|(frames, reason)| {
            let is_never = is_slow && reason == LossReason::Dropped;
            Ok(SourceEvent::Lost { frames, reason: if is_never { LossReason::NeverTaken } else { reason } })
        }));
        self.ready.push_back(event);
        self.copy.event(&mut self.ready)
    }

    fn request(&mut self, outputs: OutputOptions) {
        self.source.request(outputs);
    }

    fn stop(&mut self) -> bool {
        self.source.stop()
    }
}

#[derive(Clone, Debug)]
struct Pace {
    /// Frames per second, as agreed.
    rate: f64,
    /// Sequence number and time of the first frame of the measurement.
    start: Option<(u32, Duration)>,
    /// Sequence number of the last frame.
    last: u32,
    slow: bool,
    /// Sequence number and time of the first frame of the long measurement.
    long_start: Option<(u32, Duration)>,
    /// The deviation that was reported; `None` if the rate was right when it was measured last.
    off: Option<Off>,
}

/// A deviation from the agreed rate by more than 2 %.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Off {
    TooFew,
    TooMany,
}

impl Pace {
    fn new(rate: FrameRate) -> Self {
        let rate = rate.per_second();
        Self { rate, start: None, last: 0, slow: false, long_start: None, off: None }
    }

    /// Notes a buffer, and returns a fault if the pace has changed.
    fn arrive(&mut self, sequence: u32, timestamp: Option<Duration>) -> Option<Fault> {
        let step = sequence.wrapping_sub(std::mem::replace(&mut self.last, sequence));
        let Some(now) = timestamp else {
            self.start = None;
            return None;
        };
        let goes_on = self.start.filter(|_| step <= MOST_FRAMES);
        let span = goes_on.and_then(|(first, start)| Some((first, now.checked_sub(start)?)));
        let Some((first, span)) = span.filter(|(_, span)| *span <= LONGEST) else {
            self.start = Some((sequence, now));
            self.long_start = self.start;
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
            let is_long = self.long_start.is_none_or(|(_, start)| now.saturating_sub(start) >= LONG_SPAN);
            return if share > FAST && self.off != Some(Off::TooMany) {
                // The frames before it would make the long span right.
                self.long_start = self.start;
                self.deviate(Some(Off::TooMany), measured)
            } else if is_long && !slow {
                self.off(sequence, now)
            } else {
                None
            };
        }
        (self.slow, self.long_start, self.off) = (slow, self.start, None);
        Some(self.fault(measured))
    }

    /// Returns a fault if the rate has become too high, too low or right over a long span.
    fn off(&mut self, sequence: u32, now: Duration) -> Option<Fault> {
        let (first, start) = self.long_start.replace((sequence, now))?;
        let measured = f64::from(sequence.wrapping_sub(first)) / now.saturating_sub(start).as_secs_f64();
        let off = measured / self.rate - 1.0;
        let too = if off < 0.0 { Off::TooFew } else { Off::TooMany };
        self.deviate((off.abs() > RATE_OFF).then_some(too), measured)
    }

    /// Takes what was measured. Returns a fault if it differs from what was reported last.
    fn deviate(&mut self, off: Option<Off>, measured: f64) -> Option<Fault> {
        if std::mem::replace(&mut self.off, off) == off {
            return None;
        }
        let (kind, what) = match off {
            None => return Some(self.fault(measured)),
            Some(Off::TooFew) => (FaultKind::Rate, "those that are missing count as lost"),
            Some(Off::TooMany) => (FaultKind::Fast, "speeds are too low by as much, and events are not reliable"),
        };
        let rate = self.rate;
        let message = format!("the camera takes {measured:.2} frames per second, {rate:.2} were agreed on; {what}");
        Some(Fault::new(kind, message))
    }

    /// Starts again with the stream: nothing is measured across the break.
    fn restart(&mut self) {
        (self.start, self.long_start) = (None, None);
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
    use wstac_core::green::any::PixelFormat;
    use wstac_core::layout::FrameSize;

    use super::*;
    use crate::error::ErrorKind;

    /// An event of a source that plays a list.
    enum Played {
        /// A frame with this sequence number, taken so many milliseconds after the start.
        Frame(u32, u64),
        Lost(u64, LossReason),
        Fault(FaultKind),
        Fail,
    }

    struct Player {
        info: StreamInfo,
        events: VecDeque<Played>,
        bytes: [u8; 1],
    }

    impl Source for Player {
        fn info(&self) -> &StreamInfo {
            &self.info
        }

        fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
            // Bytes that were lent before are gone.
            self.bytes = [0];
            Ok(match self.events.pop_front() {
                Some(Played::Frame(sequence, time)) => {
                    self.bytes = [sequence as u8];
                    let timestamp = Some(Duration::from_millis(time));
                    let (bytes, encoded) = (&self.bytes[..], Some(&b"jpeg"[..]));
                    SourceEvent::Frame(Frame { timestamp, sequence: Some(sequence), encoded, ..Frame::new(bytes) })
                }
                Some(Played::Lost(frames, reason)) => SourceEvent::Lost { frames, reason },
                Some(Played::Fault(kind)) => SourceEvent::Fault(Fault::new(kind, "a fault")),
                Some(Played::Fail) => return Err(Error::new(ErrorKind::Device, "a player", "fails")),
                None => SourceEvent::End,
            })
        }
    }

    /// Returns the events of a watched source up to its end, without waits: frames by their first byte.
    fn watched(events: impl IntoIterator<Item = Played>) -> Vec<String> {
        let size = FrameSize::new(1, 1).unwrap();
        let info = StreamInfo::new("a player", size, PixelFormat::Gray, FrameRate::NOMINAL);
        let mut source = RateWatch::new(Player { info, events: events.into_iter().collect(), bytes: [0] });
        let mut found = Vec::new();
        loop {
            match source.next_event() {
                Ok(SourceEvent::Frame(frame)) => {
                    assert_eq!(frame.encoded, Some(&b"jpeg"[..]));
                    found.push(format!("frame {}", frame.bytes[0]));
                }
                Ok(SourceEvent::Lost { frames, reason }) => found.push(format!("{frames} {reason:?}")),
                Ok(SourceEvent::Fault(fault)) => found.push(format!("{:?}", fault.kind)),
                Ok(SourceEvent::Waiting) => {}
                Ok(SourceEvent::End) => return found,
                Ok(other) => panic!("{other:?}"),
                Err(error) => {
                    found.push(error.to_string());
                    return found;
                }
            }
        }
    }

    /// Returns frames with a loss before each but the first: every second frame of a camera, from a number on.
    fn half(numbers: std::ops::Range<u32>) -> impl Iterator<Item = Played> {
        numbers.flat_map(|number| {
            let lost = (number > 0).then_some(Played::Lost(1, LossReason::Dropped));
            lost.into_iter().chain([Played::Frame(number, u64::from(number) * 67)])
        })
    }

    #[test]
    fn a_fault_comes_before_the_losses_and_the_frame_that_show_it() {
        let found = watched(half(0..33));
        let at = found.iter().position(|event| event == "Slow").unwrap();
        let expected = ["1 Dropped", "frame 29", "Slow", "1 NeverTaken", "frame 30", "1 NeverTaken", "frame 31"];
        assert_eq!(found[at - 2..at + 5], expected);
        assert_eq!(found.len(), 33 + 32 + 1);
    }

    #[test]
    fn losses_stay_ahead_of_what_followed_them() {
        let lost = |reason| Played::Lost(2, reason);
        let found = watched([
            Played::Frame(0, 0),
            lost(LossReason::Dropped),
            lost(LossReason::Skipped),
            Played::Frame(5, 170),
            lost(LossReason::Dropped),
            lost(LossReason::Damaged),
            lost(LossReason::Dropped),
            Played::Fault(FaultKind::Signal),
            lost(LossReason::Dropped),
            Played::Fail,
        ]);
        let expected = "frame 0, 2 Dropped, 2 Skipped, frame 5, 2 Dropped, 2 Damaged, 2 Dropped, Signal, 2 Dropped, a player: fails";
        assert_eq!(found.join(", "), expected);
        assert_eq!(watched([lost(LossReason::Dropped)]), ["2 Dropped"]);
    }

    #[test]
    fn nothing_is_measured_across_a_break() {
        let frames = |from: u64| (0..40).map(move |number| Played::Frame(number, from + u64::from(number) * 100 / 3));
        let one = || frames(0).chain([Played::Fault(FaultKind::Disconnected)]).chain(frames(10_000));
        assert!(!watched(one()).contains(&"Slow".to_owned()));
        let away = frames(0).chain([Played::Lost(260, LossReason::NoSignal)]);
        let later = (40..80).map(|number| Played::Frame(number, 8667 + u64::from(number) * 100 / 3));
        assert!(!watched(away.chain(later)).contains(&"Slow".to_owned()));
        let later = (40..80).map(|number| Played::Frame(number, 8667 + u64::from(number) * 100 / 3));
        assert!(watched(frames(0).chain(later)).contains(&"Slow".to_owned()));
    }

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
        assert_eq!(said(&mut pace, 200.0, 29.5, (0..1000).step_by(2)), []);
        assert_eq!(said(&mut pace, 300.0, 30.5, 0..1000), []);
    }

    #[test]
    fn a_rate_that_is_a_little_off_is_reported_once() {
        for (rate, at, kind, words) in [
            (29.3, 294, FaultKind::Rate, "29.30 frames per second, 30.00"),
            (31.0, 310, FaultKind::Fast, "31.00 frames per second, 30.00"),
            (33.0, 66, FaultKind::Fast, "33.00 frames per second, 30.00"),
        ] {
            let mut pace = Pace::new(FrameRate::NOMINAL);
            let time = |number: u32| Some(Duration::from_secs_f64(100.0 + f64::from(number) / rate));
            let faults: Vec<_> =
                (0..2000).filter_map(|number| Some((number, pace.arrive(number, time(number))?))).collect();
            let [(number, fault)] = &faults[..] else { panic!("{rate}: {faults:?}") };
            assert!((at..at + 70).contains(number) && fault.kind == kind, "{rate}: {number}, {fault}");
            assert!(fault.message.contains(words), "{fault}");
        }
        // Another direction is reported, and so is the same one after a rate that was right.
        let (mut pace, mut start, mut found) = (Pace::new(FrameRate::NOMINAL), 100.0, Vec::new());
        for (part, rate) in [29.3, 31.5, 31.5, 30.0, 31.5].into_iter().enumerate() {
            let first = 900 * part as u32;
            start -= f64::from(first) / rate;
            let time = |number: u32| Some(Duration::from_secs_f64(start + f64::from(number) / rate));
            let faults = (first..first + 900).filter_map(|number| pace.arrive(number, time(number)));
            found.extend(faults.map(|fault| (part, fault.kind)));
            start += f64::from(first + 900) / rate;
        }
        let (rate, fast, in_time) = (FaultKind::Rate, FaultKind::Fast, FaultKind::InTime);
        assert_eq!(found, [(0, rate), (1, fast.clone()), (3, in_time), (4, fast)]);
        // Frames in time before a rate that is too high are not in its long span.
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 30.0, 0..240), []);
        let start = 108.0 - 240.0 / 31.65;
        assert!(matches!(said(&mut pace, start, 31.65, 240..840)[..], [(_, FaultKind::Fast)]));
        // One that changes within the span is slow, and then in time.
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 15.0, 0..150), [(30, FaultKind::Slow)]);
        let later = said(&mut pace, 105.0, 30.0, 150..1000);
        assert!(matches!(later[..], [(_, FaultKind::InTime)]), "{later:?}");
    }

    #[test]
    fn a_slow_camera_is_reported_once_and_once_more_when_it_recovers() {
        let mut pace = Pace::new(FrameRate::NOMINAL);
        assert_eq!(said(&mut pace, 100.0, 15.0, 0..150), [(30, FaultKind::Slow)]);
        assert!(pace.slow);
        // The rate is back at 30 per second. The span that holds both rates may still be slow.
        let told = said(&mut pace, 110.0 - 150.0 / 30.0, 30.0, 150..450);
        assert!(matches!(told[..], [(210..=211, FaultKind::InTime)]), "{told:?}");
        assert!(!pace.slow);
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
