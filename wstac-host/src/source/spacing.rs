//! The spacing of a file's frames by their positions: the times of a video's frames, or the numbers of pictures.
//!
//! Frames are counted, so a frame that is missing or late would make every speed wrong. A gap of whole frames is lost
//! frames in its place. Where frames are neither in their places nor whole frames apart, a fault says that they come
//! unevenly.

use std::collections::VecDeque;
use std::time::Duration;

use wstac_core::rate::FrameRate;

use super::{Fault, FaultKind, Frame, LossReason, Source, SourceEvent, StreamInfo};
use crate::error::{Error, ErrorKind};
use crate::plural::counted;

/// The largest distance of a frame from its place that counts as even, in steps between frames: an application that
/// writes the time when a frame arrived is off by some milliseconds, now early, now late.
const TOLERANCE: f64 = 0.4;
/// The largest distance of frames from their places on average: beyond, the camera runs at another rate than before.
const MEAN_TOLERANCE: f64 = 0.15;
/// The part of the average that the last frame is.
const AVERAGED: f64 = 0.2;
/// The part of a frame's distance by which the places of later frames move, because a rate is a little off.
const FOLLOWED: f64 = 0.1;
/// The largest difference from whole frames in a distance that counts for the usual one, in steps.
const NEAR: f64 = 0.45;
/// A rate by times is a whole number if it differs from one by at most this part.
const WHOLE_RATE: f64 = 0.0003;
/// Frames in a row after which frames come evenly again.
const EVEN_AGAIN: u32 = 10;

/// The meaning of positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Positions {
    /// Milliseconds, by the time stamps of a video or a recording.
    Times,
    /// Milliseconds, by the names of pictures.
    NamedTimes,
    /// Numbers in the names of pictures, whatever they count.
    Numbers,
    /// Milliseconds, by the times that a program pushes. Its frames' numbers count lost ones, too.
    Pushed,
}

/// Finds gaps and unevenness.
#[derive(Debug)]
pub(crate) struct Spacing {
    subject: String,
    positions: Positions,
    /// The usual distance from frame to frame.
    step: f64,
    /// The position of the last frame, and its place by those before it.
    last: Option<(f64, f64)>,
    /// The average distance of frames from their places, in steps, and that of the last one.
    mean: f64,
    off: f64,
    frame: u64,
    /// Frames in a row that were in their places.
    even: u32,
    pub(super) is_uneven: bool,
    /// Frames that are missing, and frames that came unevenly.
    missing: u64,
    uneven: u64,
    /// The smallest and the largest distance.
    least: f64,
    most: f64,
    /// Events before the next frame.
    pub(super) ready: VecDeque<SourceEvent<'static>>,
}

impl Spacing {
    pub(crate) fn new(subject: String, positions: Positions, step: f64) -> Self {
        let (least, most, ready) = (f64::INFINITY, 0.0, VecDeque::new());
        let (last, mean, off, frame, even, is_uneven, missing, uneven) = (None, 0.0, 0.0, 0, 0, false, 0, 0);
        Self { subject, positions, step, last, mean, off, frame, even, is_uneven, missing, uneven, least, most, ready }
    }

    /// Takes the position of the next frame. [`Self::next_event`] has what comes before it. If it is not a number, the
    /// frame is taken to be in its place.
    pub(crate) fn arrive(&mut self, position: f64) {
        let number = self.frame;
        self.frame += 1;
        let position = match self.last {
            Some((_, place)) if position.is_nan() => place + self.step,
            None if position.is_nan() => return,
            _ => position,
        };
        let Some((last, place)) = self.last.replace((position, position)) else { return };
        let distance = position - last;
        (self.least, self.most) = (self.least.min(distance), self.most.max(distance));
        let off = position - place - self.step;
        let missing = (off / self.step).round().max(0.0);
        let off = off - missing * self.step;
        let (frames, is_pushed) = (missing as u64, self.positions == Positions::Pushed);
        let counted = if is_pushed { frames } else { 0 };
        self.frame = self.frame.saturating_add(counted);
        self.off = off / self.step;
        self.mean += AVERAGED * (self.off - self.mean);
        if off.abs() <= TOLERANCE * self.step && self.mean.abs() <= MEAN_TOLERANCE {
            self.last = Some((position, position - (1.0 - FOLLOWED) * off));
            self.even += 1;
            if self.is_uneven && self.even >= EVEN_AGAIN {
                self.is_uneven = false;
                self.fault(FaultKind::Even, "frames come evenly again");
            }
        } else {
            self.mean = 0.0;
            let [found, expected] = [distance, self.step].map(|distance| self.distance(distance));
            let frame = number.saturating_add(counted);
            self.come_unevenly(&format!("frame {frame} comes {found} after the one before, expected {expected}"));
        }
        if frames > 0 {
            self.missing = self.missing.saturating_add(frames);
            let reason = if is_pushed { LossReason::MissingByTimes } else { LossReason::Missing };
            self.ready.push_back(SourceEvent::Lost { frames, reason });
        }
    }

    /// Takes frames that are known to be lost.
    pub(crate) fn lose(&mut self, frames: u64) {
        // Those before the first frame have no numbers.
        if self.positions == Positions::Pushed && self.last.is_some() {
            self.frame = self.frame.saturating_add(frames);
        }
        for position in self.last.iter_mut().flat_map(|(last, place)| [last, place]) {
            *position += frames as f64 * self.step;
        }
    }

    /// Takes a frame of unknown position.
    fn stray(&mut self) {
        self.come_unevenly(&format!("the name of frame {} is not as those of the others", self.frame));
        self.frame += 1;
    }

    fn come_unevenly(&mut self, what: &str) {
        (self.even, self.uneven) = (0, self.uneven + 1);
        if !std::mem::replace(&mut self.is_uneven, true) {
            let message = format!("{what}; events are not reliable until frames come evenly");
            self.fault(FaultKind::Uneven, &message);
        }
    }

    /// Returns a source's event, of which a frame tells how far it is from its place.
    pub(super) fn placed<'a>(&self, event: SourceEvent<'a>) -> SourceEvent<'a> {
        match event {
            SourceEvent::Frame(frame) => SourceEvent::Frame(Frame { off: self.off as f32, ..frame }),
            event => event,
        }
    }

    /// Takes the end of the source: if frames were missing or uneven, [`Self::next_event`] says how many.
    pub(super) fn finish(&mut self) {
        let (missing, uneven) = (std::mem::take(&mut self.missing), std::mem::take(&mut self.uneven));
        if missing == 0 && uneven == 0 {
            return;
        }
        let by = match self.positions {
            Positions::Times | Positions::Pushed => "time stamps",
            Positions::NamedTimes => "the times in their names",
            Positions::Numbers => "the numbers in their names",
        };
        let mut found = Vec::new();
        if missing > 0 {
            found.push(counted(missing, "frame") + if missing == 1 { " is missing" } else { " are missing" });
        }
        if uneven > 0 {
            found.push(counted(uneven, "frame") + if uneven == 1 { " comes unevenly" } else { " come unevenly" });
        }
        let mut message = format!("{}, by {by}", found.join(" and "));
        if self.most > 0.0 {
            let [least, most, step] = [self.least, self.most, self.step].map(|distance| self.distance(distance));
            message = format!("{message}: {least} to {most} apart, expected {step}");
        }
        if uneven > 0 && self.positions == Positions::Times {
            message += "; help: lock the exposure and record again; if only the times are uneven, ffmpeg -i FILE -vf \
                        setpts=N/RATE/TB -r RATE -c:v ffv1 NEW.mkv";
        }
        self.fault(FaultKind::Spacing, &message);
    }

    /// Returns the next event that comes before the frame that arrived last, or before the end.
    pub(crate) fn next_event(&mut self) -> Option<SourceEvent<'static>> {
        self.ready.pop_front()
    }

    pub(super) fn fault(&mut self, kind: FaultKind, message: &str) {
        let message = format!("{}: {message}", self.subject);
        self.ready.push_back(SourceEvent::Fault(Fault::new(kind, message)));
    }

    /// Returns a distance for a person.
    fn distance(&self, distance: f64) -> String {
        match self.positions {
            Positions::Times | Positions::NamedTimes | Positions::Pushed => format!("{distance:.1} ms"),
            Positions::Numbers => format!("{}", distance.round()),
        }
    }
}

/// Returns the usual distance between positions; `None` if there are fewer than two.
pub(super) fn step(positions: &[f64]) -> Option<f64> {
    let distances = positions.windows(2).map(|pair| pair[1] - pair[0]).filter(|distance| *distance > 0.0);
    let mut distances: Vec<f64> = distances.collect();
    distances.sort_by(f64::total_cmp);
    let mut step = *distances.get(distances.len() / 2)?;
    // Gaps of whole frames count as frames. What lies between two numbers of frames says nothing.
    for _ in 0..3 {
        let (mut sum, mut frames) = (0.0, 0.0);
        for distance in &distances {
            let near = (distance / step).round();
            if near >= 1.0 && (distance / step - near).abs() < NEAR {
                (sum, frames) = (sum + distance, frames + near);
            }
        }
        step = if frames > 0.0 { sum / frames } else { step };
    }
    Some(step)
}

/// Returns the rate of frames that are so many milliseconds apart: a whole number if it is one but for rounding.
pub(super) fn rate_of(step: f64) -> Option<FrameRate> {
    let rate = 1000.0 / step;
    let is_whole = (rate / rate.round() - 1.0).abs() < WHOLE_RATE;
    let (frames, time) = if is_whole { (rate.round() as u32, 1) } else { (1_000_000, (1000.0 * step).round() as u32) };
    FrameRate::new(frames, time).ok()
}

/// A source whose frames have known positions.
#[derive(Debug)]
pub(super) struct Spaced<S> {
    source: S,
    spacing: Spacing,
    positions: std::vec::IntoIter<f64>,
    /// Whether the position of the next frame was taken.
    has_arrived: bool,
    is_over: bool,
}

impl<S: Source> Spaced<S> {
    /// Wraps a source whose frames, lost ones included, have these positions: not a number for an unknown one.
    pub(super) fn new(source: S, subject: String, kind: Positions, positions: Vec<f64>) -> Self {
        let known: Vec<f64> = positions.iter().copied().filter(|position| !position.is_nan()).collect();
        let spacing = Spacing::new(subject, kind, step(&known).unwrap_or(1.0));
        Self { source, spacing, positions: positions.into_iter(), has_arrived: false, is_over: false }
    }
}

impl<S: Source> Source for Spaced<S> {
    fn info(&self) -> &StreamInfo {
        self.source.info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let Self { source, spacing, positions, has_arrived, is_over } = self;
        if !std::mem::replace(has_arrived, true)
            && let Some(position) = positions.next()
        {
            if position.is_nan() {
                spacing.stray();
            } else {
                spacing.arrive(position);
            }
        }
        if let Some(event) = spacing.next_event() {
            return Ok(event);
        }
        let event = source.next_event()?;
        *has_arrived = !matches!(event, SourceEvent::Frame(_) | SourceEvent::Lost { .. });
        if matches!(event, SourceEvent::End) && !std::mem::replace(is_over, true) {
            spacing.finish();
            return Ok(spacing.next_event().unwrap_or(SourceEvent::End));
        }
        Ok(spacing.placed(event))
    }
}

/// Watches the times of frames that a program pushes, as a file's are watched.
///
/// A program asks it before it pushes an event into a [`Session`](crate::session::Session).
#[derive(Debug)]
pub struct PushedTimes {
    spacing: Spacing,
    last: Option<Duration>,
}

impl PushedTimes {
    /// Watches a stream of this rate.
    pub fn new(info: &StreamInfo) -> Self {
        let step = 1000.0 / info.rate.per_second();
        Self { spacing: Spacing::new(info.about.clone(), Positions::Pushed, step), last: None }
    }

    /// Takes an event, and returns those to push: the event itself is the last of them. Frames that are missing by the
    /// times come before it, and so do faults of frames that come unevenly.
    ///
    /// # Errors
    /// The time of a frame is not after that of the last one. Nothing of it was taken.
    pub fn take<'a>(
        &mut self,
        event: SourceEvent<'a>,
    ) -> Result<impl Iterator<Item = SourceEvent<'a>> + use<'a>, Error> {
        let time = match &event {
            SourceEvent::Frame(Frame { timestamp, .. }) => *timestamp,
            SourceEvent::Taxels(frame) => frame.timestamp,
            _ => None,
        };
        if let Some((last, now)) = self.last.zip(time).filter(|(last, now)| now <= last) {
            let frame = self.spacing.frame;
            let (found, last) = (now.as_nanos(), last.as_nanos());
            let message =
                format_args!("the time of frame {frame} is wrong (found {found} ns, expected a time above {last} ns)");
            return Err(Error::new(ErrorKind::Frame, &self.spacing.subject, message));
        }
        self.last = time.or(self.last);
        match &event {
            SourceEvent::Frame(_) | SourceEvent::Taxels(_) => {
                self.spacing.arrive(time.map_or(f64::NAN, |time| time.as_secs_f64() * 1000.0));
            }
            SourceEvent::Lost { frames, .. } => self.spacing.lose(*frames),
            SourceEvent::End => self.spacing.finish(),
            _ => {}
        }
        let event = self.spacing.placed(event);
        let before: VecDeque<SourceEvent<'a>> = std::mem::take(&mut self.spacing.ready);
        Ok(before.into_iter().chain([event]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the events of frames at these positions: `.` for a frame.
    fn events(positions: Positions, step: f64, frames: &[f64]) -> String {
        let mut spacing = Spacing::new("a".into(), positions, step);
        let mut found = Vec::new();
        let say = |event: SourceEvent<'_>| match event {
            SourceEvent::Lost { frames, reason: LossReason::Missing } => format!("{frames} missing"),
            SourceEvent::Fault(fault) => format!("{}", fault.kind),
            other => panic!("{other:?}"),
        };
        for position in frames {
            spacing.arrive(*position);
            found.extend(std::iter::from_fn(|| spacing.next_event()).map(say));
            found.push(".".into());
        }
        found.join(" ").replace(". .", "..").replace(". .", "..")
    }

    fn even(step: f64, count: u32) -> Vec<f64> {
        (0..count).map(|frame| f64::from(frame) * step).collect()
    }

    fn dots(count: usize) -> String {
        ".".repeat(count)
    }

    #[test]
    fn what_is_even_is_left_alone() {
        // Whole milliseconds, a rate that is slightly off, and times when frames arrived.
        let rounded: Vec<_> = even(1000.0 / 30.0, 200).into_iter().map(f64::round).collect();
        assert_eq!(events(Positions::Times, step(&rounded).unwrap(), &rounded), dots(200));
        let fast: Vec<_> = even(1000.0 / 480.0, 200).into_iter().map(f64::round).collect();
        assert_eq!(events(Positions::Times, 1000.0 / 480.0, &fast), dots(200));
        assert_eq!(events(Positions::Times, 1000.0 / 30.0, &even(1000.0 / 29.97, 3000)), dots(3000));
        assert_eq!(events(Positions::Times, 1000.0 / 30.0, &even(1000.0 / 29.6, 3000)), dots(3000));
        let mut random = fastrand::Rng::with_seed(1);
        let late: Vec<_> = even(33.3, 300).into_iter().map(|time| time + 7.0 * (random.f64() - 0.5)).collect();
        assert_eq!(events(Positions::Times, step(&late).unwrap(), &late), dots(300));
        assert_eq!(events(Positions::Numbers, 2.0, &even(2.0, 99)), dots(99));
    }

    #[test]
    fn times_of_arrival_are_even_and_a_changed_rate_is_not() {
        let mut random = fastrand::Rng::with_seed(2);
        for _ in 0..20 {
            let late: Vec<_> = even(33.3, 300).into_iter().map(|time| time + 12.0 * (random.f64() - 0.5)).collect();
            assert_eq!(events(Positions::Times, 33.3, &late), dots(300));
        }
        for changed in [0.97, 1.03, 1.2, 1.4, 1.5] {
            let mut times = even(33.3, 30);
            times.extend((1..30).map(|frame| times[29] + 33.3 * changed * f64::from(frame)).collect::<Vec<_>>());
            let found = events(Positions::Times, 33.3, &times);
            assert!(found.starts_with(&dots(30)) && found.contains("uneven"), "{changed}: {found}");
        }
        // One late frame, after which all are as late.
        let times: Vec<_> =
            even(33.3, 40).into_iter().map(|time| if time > 666.0 { time + 12.0 } else { time }).collect();
        assert!(events(Positions::Times, 33.3, &times).contains("uneven"));
    }

    #[test]
    fn gaps_are_lost_frames_in_their_places() {
        assert_eq!(events(Positions::Numbers, 1.0, &[1.0, 2.0, 4.0, 5.0, 9.0]), ".. 1 missing .. 3 missing .");
        let times = [0.0, 33.0, 67.0, 133.0, 167.0, 267.0];
        assert_eq!(events(Positions::Times, 33.3, &times), "... 1 missing .. 2 missing .");
        assert!(events(Positions::Numbers, 1.0, &[0.0, 1e18]).contains(" 1000000000000000000 missing"));
    }

    #[test]
    fn what_is_neither_is_uneven_until_it_is_even_again() {
        let mut times = even(33.3, 20);
        let slow: Vec<_> = (1..=5).map(|frame| times[19] + 50.0 * f64::from(frame)).collect();
        times.extend(slow);
        let last = times[24];
        times.extend((1..=20).map(|frame| last + 33.3 * f64::from(frame)));
        let found = events(Positions::Times, 33.3, &times);
        assert!(found.starts_with(&format!("{} uneven ", dots(20))), "{found}");
        assert!(found.ends_with(&format!("{} even {}", dots(9), dots(11))), "{found}");
        // Frames at once or backward, and a rate that changes by 5 %.
        for times in [&[0.0, 33.0, 33.0][..], &[33.0, 0.0]] {
            assert!(events(Positions::Times, 33.3, times).contains("uneven"), "{times:?}");
        }
        assert!(events(Positions::Times, 33.3, &even(35.0, 100)).contains("uneven"));
    }

    #[test]
    fn the_usual_distance_is_found() {
        assert_eq!(step(&[]), None);
        assert_eq!(step(&[4.0]), None);
        assert_eq!(step(&[1.0, 2.0, 3.0, 9.0, 10.0]), Some(1.0));
        let mut times: Vec<_> = even(1000.0 / 30.0, 150).into_iter().map(f64::round).collect();
        assert!((step(&times).unwrap() - 33.333).abs() < 0.01);
        for at in (60..100).rev().step_by(2) {
            times.remove(at);
        }
        assert!((step(&times).unwrap() - 33.333).abs() < 0.01);
        let mut spacing = Spacing::new("a.mp4".into(), Positions::Times, step(&times).unwrap());
        for time in times {
            spacing.arrive(time);
        }
        spacing.finish();
        let Some(SourceEvent::Fault(fault)) = spacing.ready.pop_back() else { panic!() };
        let expected = "a.mp4: 20 frames are missing, by time stamps: 33.0 ms to 67.0 ms apart, expected 33.3 ms";
        assert_eq!(fault.to_string(), expected);
        // The sum opens no part that is uneven.
        assert_eq!(fault.kind, FaultKind::Spacing);
    }

    #[test]
    fn times_that_are_pushed_are_watched_and_do_not_go_back() {
        let size = wstac_core::layout::FrameSize::new(1, 1).unwrap();
        let format = wstac_core::green::any::PixelFormat::Gray;
        let mut times = PushedTimes::new(&StreamInfo::new("frames", size, format, FrameRate::NOMINAL));
        let mut push = |ms| {
            let frame = Frame { timestamp: Some(Duration::from_millis(ms)), ..Frame::new(&[]) };
            times.take(SourceEvent::Frame(frame)).map(|events| {
                let say = |event| match event {
                    SourceEvent::Lost { frames, reason } => format!("{frames} {reason:?}"),
                    SourceEvent::Fault(fault) => fault.kind.to_string(),
                    SourceEvent::Frame(frame) => format!("{:.1}", frame.off),
                    other => panic!("{other:?}"),
                };
                events.map(say).collect::<Vec<_>>().join(" ")
            })
        };
        for (ms, expected) in
            [(1000, "0.0"), (1033, "-0.0"), (1100, "1 MissingByTimes 0.0"), (5100, "119 MissingByTimes 0.0")]
        {
            assert_eq!(push(ms).unwrap(), expected);
        }
        for ms in [5099, 5100] {
            let expected =
                format!("the time of frame 124 is wrong (found {ms}000000 ns, expected a time above 5100000000 ns)");
            assert_eq!(push(ms).unwrap_err().to_string(), format!("frames: {expected}"));
        }
        assert_eq!(push(5150).unwrap(), "uneven 1 MissingByTimes -0.5");
        // A frame that is known to be lost is no other one.
        assert_eq!(times.take(SourceEvent::Lost { frames: 2, reason: LossReason::Reported }).unwrap().count(), 1);
        let at = |ms| SourceEvent::Frame(Frame { timestamp: Some(Duration::from_millis(ms)), ..Frame::new(&[]) });
        assert_eq!(times.take(at(5250)).unwrap().count(), 1);
        // 124 frames, two that came, three that were lost.
        assert!(times.take(at(5250)).err().unwrap().to_string().contains("of frame 129 is"));
        let said: Vec<_> = times.take(SourceEvent::End).unwrap().map(|event| format!("{event:?}")).collect();
        assert!(said.len() == 2 && said[0].contains("121 frames are missing and 1 frame comes unevenly"), "{said:?}");
    }
}
