//! Decorators: sources that wrap any other source.

mod rate_watch;

use super::{Fault, FaultKind, Frame, LossReason, Source, SourceEvent, StreamInfo};
use crate::error::{Error, ErrorKind};

pub use rate_watch::RateWatch;

/// Shows every event of a source to a function before it is handed out, for example to record or to count frames.
///
/// ```
/// # use wstac_core::{green::any::PixelFormat, layout::FrameSize, rate::FrameRate};
/// # use wstac_host::error::Error;
/// # use wstac_host::source::{Frame, Source, SourceEvent, StreamInfo};
/// use wstac_host::source::decorate::Tap;
/// # struct Two(StreamInfo, u8);
/// # impl Source for Two {
/// #     fn info(&self) -> &StreamInfo { &self.0 }
/// #     fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
/// #         self.1 += 1;
/// #         Ok(if self.1 > 2 { SourceEvent::End } else { SourceEvent::Frame(Frame::new(b"bytes")) })
/// #     }
/// # }
/// # let source = Two(StreamInfo::new("two", FrameSize::new(5, 1)?, PixelFormat::Gray, FrameRate::NOMINAL), 0);
///
/// let mut bytes = Vec::new();
/// let mut source = Tap::new(source, |event| {
///     if let SourceEvent::Frame(frame) = event {
///         bytes.extend_from_slice(frame.bytes);
///     }
/// });
/// while !matches!(source.next_event()?, SourceEvent::End) {}
/// # drop(source);
/// assert_eq!(bytes, b"bytesbytes");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Tap<S, F> {
    source: S,
    look: F,
}

impl<S: Source, F: FnMut(&SourceEvent<'_>) + Send> Tap<S, F> {
    /// Wraps a source. `look` sees every event.
    pub fn new(source: S, look: F) -> Self {
        Self { source, look }
    }
}

impl<S: Source, F: FnMut(&SourceEvent<'_>) + Send> Source for Tap<S, F> {
    fn info(&self) -> &StreamInfo {
        self.source.info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let event = self.source.next_event()?;
        (self.look)(&event);
        Ok(event)
    }
}

/// Ends a source after a number of camera frames, lost ones included, and never gives one more.
///
/// A gap that reaches beyond the limit is cut there.
#[derive(Clone, Debug)]
pub struct Limited<S> {
    source: S,
    left: Option<u64>,
}

impl<S: Source> Limited<S> {
    /// Wraps a source. Without a limit it gives all that the source has.
    pub fn new(source: S, limit: Option<u64>) -> Self {
        Self { source, left: limit }
    }
}

impl<S: Source> Source for Limited<S> {
    fn info(&self) -> &StreamInfo {
        self.source.info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.left == Some(0) {
            return Ok(SourceEvent::End);
        }
        let event = self.source.next_event()?;
        let Some(left) = &mut self.left else { return Ok(event) };
        Ok(match event {
            SourceEvent::Lost { frames, reason } => {
                let frames = frames.min(*left);
                *left -= frames;
                SourceEvent::Lost { frames, reason }
            }
            event => {
                *left -= u64::from(matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_)));
                event
            }
        })
    }
}

/// The action of a [`FaultInjector`] on a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Injection {
    /// Hands the frame out as it is.
    #[default]
    Keep,
    /// Reports the frame as lost.
    Drop,
    /// Hands out at most this many of the frame's bytes.
    Truncate(usize),
    /// Reports a fault in place of the frame, and the frame as lost after it.
    Fault(FaultKind),
    /// Fails: the source cannot be read any further.
    Fail,
}

/// Injects faults into a source, to test what an application makes of them.
///
/// A function decides by the number of the camera frame, counted from 0, so a run is repeated exactly.
#[derive(Clone, Debug)]
pub struct FaultInjector<S, F> {
    source: S,
    plan: F,
    number: u64,
    /// A frame in whose place a fault was reported.
    owed: bool,
}

impl<S: Source, F: FnMut(u64) -> Injection + Send> FaultInjector<S, F> {
    /// Wraps a source. `plan` says what becomes of each frame.
    pub fn new(source: S, plan: F) -> Self {
        Self { source, plan, number: 0, owed: false }
    }
}

impl<S: Source, F: FnMut(u64) -> Injection + Send> Source for FaultInjector<S, F> {
    fn info(&self) -> &StreamInfo {
        self.source.info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let lost = SourceEvent::Lost { frames: 1, reason: LossReason::Dropped };
        if std::mem::take(&mut self.owed) {
            return Ok(lost);
        }
        let frame = match self.source.next_event()? {
            SourceEvent::Frame(frame) => frame,
            other => return Ok(other),
        };
        let injection = (self.plan)(self.number);
        self.number += 1;
        Ok(match injection {
            Injection::Keep => SourceEvent::Frame(frame),
            Injection::Drop => lost,
            Injection::Truncate(length) => {
                SourceEvent::Frame(Frame { bytes: frame.bytes.get(..length).unwrap_or(frame.bytes), ..frame })
            }
            Injection::Fault(kind) => {
                self.owed = true;
                SourceEvent::Fault(Fault::new(kind, "an injected fault"))
            }
            Injection::Fail => {
                return Err(Error::new(ErrorKind::Device, "fault injection", "the source fails here on purpose"));
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use wstac_core::green::any::PixelFormat;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;
    use wstac_core::reason::Reason;

    use super::*;
    use crate::output::Output;
    use crate::session::Session;

    /// A black sensor over which a bright stripe moves to the right.
    struct Stripe {
        info: StreamInfo,
        bytes: Vec<u8>,
        number: usize,
    }

    impl Source for Stripe {
        fn info(&self) -> &StreamInfo {
            &self.info
        }

        fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
            self.number += 1;
            self.bytes.fill(1);
            if let Some(x) = self.number.checked_sub(40).filter(|x| *x < 33) {
                self.bytes.chunks_mut(100).for_each(|row| row[3 * x..][..3].fill(200));
            }
            Ok(if self.number > 120 { SourceEvent::End } else { SourceEvent::Frame(Frame::new(&self.bytes)) })
        }
    }

    fn outputs(plan: impl FnMut(u64) -> Injection + Send + 'static) -> Vec<Result<Output, Error>> {
        let size = FrameSize::new(100, 100).unwrap();
        let info = StreamInfo::new("a stripe", size, PixelFormat::Gray, FrameRate::NOMINAL);
        let source = Stripe { info, bytes: vec![0; 10_000], number: 0 };
        Session::builder(FaultInjector::new(source, plan)).build().unwrap().collect()
    }

    fn event_and_dropped(outputs: &[Result<Output, Error>]) -> (Option<(u64, u8)>, u64) {
        let mut found = (None, 0);
        for output in outputs.iter().flatten() {
            match output {
                Output::Event(event) => found.0 = Some((event.frame, event.frames_filled)),
                Output::End(end) => found.1 = end.dropped,
                _ => {}
            }
        }
        found
    }

    #[test]
    fn injected_losses_keep_their_place_in_time() {
        let whole = event_and_dropped(&outputs(|_| Injection::Keep));
        assert_eq!(whole, (Some((30, 0)), 0));
        let three = |number| if (60..63).contains(&number) { Injection::Drop } else { Injection::Keep };
        assert_eq!(event_and_dropped(&outputs(three)), (Some((30, 3)), 3));
        let short = |number| if number == 61 { Injection::Truncate(99) } else { Injection::Keep };
        assert_eq!(event_and_dropped(&outputs(short)), (Some((30, 1)), 1));
        let long = |number| if (50..90).contains(&number) { Injection::Drop } else { Injection::Keep };
        assert_eq!(event_and_dropped(&outputs(long)), (None, 40));
    }

    /// Gives frames, and a gap of any length after the 67th.
    struct Gap(Stripe, u64);
    impl Source for Gap {
        fn info(&self) -> &StreamInfo {
            self.0.info()
        }

        fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
            if self.0.number == 67 && self.1 > 0 {
                return Ok(SourceEvent::Lost { frames: std::mem::take(&mut self.1), reason: LossReason::Dropped });
            }
            self.0.next_event()
        }
    }

    #[test]
    fn a_limit_is_exact_and_cuts_a_gap() {
        let size = FrameSize::new(100, 100).unwrap();
        let info = StreamInfo::new("a stripe", size, PixelFormat::Gray, FrameRate::NOMINAL);
        for (limit, gap, frames) in
            [(Some(70), 6, 70), (Some(70), u64::MAX, 70), (Some(66), 6, 66), (Some(300), 6, 126), (None, 6, 126)]
        {
            let stripe = Stripe { info: info.clone(), bytes: vec![0; 10_000], number: 0 };
            let session = Session::builder(Limited::new(Gap(stripe, gap), limit)).build().unwrap();
            let end = session.map(Result::unwrap).find_map(|output| match output {
                Output::End(end) => Some(end),
                _ => None,
            });
            assert_eq!(end.unwrap().frames, frames, "{limit:?} {gap}");
        }
    }

    #[test]
    fn an_injected_fault_is_reported_and_its_frame_lost() {
        let found = outputs(|number| match number {
            10 => Injection::Fault(FaultKind::Slow),
            _ => Injection::Keep,
        });
        let Some(Ok(Output::Fault(report))) = found.first() else { panic!("{found:?}") };
        assert_eq!((report.frame, &report.fault.kind), (10, &FaultKind::Slow));
        // The lost frame lies before the sample.
        assert_eq!(event_and_dropped(&found), (Some((30, 0)), 1));
    }

    #[test]
    fn an_event_with_uneven_frames_is_not_reliable_and_one_after_them_is() {
        let event = |from, to| {
            let found = outputs(move |number| match number {
                _ if number == from => Injection::Fault(FaultKind::Uneven),
                _ if number == to => Injection::Fault(FaultKind::Even),
                _ => Injection::Keep,
            });
            let event = found.into_iter().flatten().find_map(|output| match output {
                Output::Event(event) => Some((event.frame, event.reliable, event.sample_reliable, event.doubt)),
                _ => None,
            });
            event.unwrap()
        };
        let whole = event(u64::MAX, u64::MAX);
        assert_eq!((whole.0, whole.2), (30, true));
        assert_eq!(event(10, 30), whole);
        let uneven = (30, false, false, Some(Reason::Uneven));
        assert_eq!(event(10, 31), uneven);
        assert_eq!(event(99, 110), uneven);
        assert_eq!(event(100, 110), whole);
    }

    #[test]
    fn an_event_of_a_camera_that_is_too_fast_is_not_reliable() {
        let event = |fast, then: FaultKind, to| {
            let found = outputs(move |number| match number {
                _ if number == fast => Injection::Fault(FaultKind::Fast),
                _ if number == to => Injection::Fault(then.clone()),
                _ => Injection::Keep,
            });
            let event = found.into_iter().flatten().find_map(|output| match output {
                Output::Event(event) => Some((event.reliable, event.sample_reliable, event.doubt)),
                _ => None,
            });
            event.unwrap()
        };
        let doubted = (false, false, Some(Reason::FasterCamera));
        assert_eq!(event(10, FaultKind::InTime, 50), doubted);
        assert_eq!(event(10, FaultKind::Even, 20), doubted);
        for right in [FaultKind::InTime, FaultKind::Rate, FaultKind::Slow] {
            assert_ne!(event(10, right, 20), doubted);
        }
    }

    #[test]
    fn a_baseline_of_doubted_frames_is_refused() {
        let size = FrameSize::new(100, 100).unwrap();
        let info = StreamInfo::new("a stripe", size, PixelFormat::Gray, FrameRate::NOMINAL);
        let stripe = || Stripe { info: info.clone(), bytes: vec![0; 10_000], number: 0 };
        let error = |from, to| {
            let source = FaultInjector::new(stripe(), move |number| match number {
                _ if number == from => Injection::Fault(FaultKind::Uneven),
                _ if number == to => Injection::Fault(FaultKind::Even),
                _ => Injection::Keep,
            });
            let error = Session::builder(stripe()).baseline_from(source, 0.5).build().err();
            error.map(|error| error.to_string())
        };
        assert_eq!((error(u64::MAX, u64::MAX), error(3, 9), error(110, 115)), (None, None, None));
        let refused = "a stripe: frames of the baseline from 0.5 s on are damaged or come unevenly; help: choose another \
                       --baseline-at";
        for (from, to) in [(3, u64::MAX), (20, u64::MAX), (20, 30)] {
            assert_eq!(error(from, to).as_deref(), Some(refused), "{from} to {to}");
        }
    }

    #[test]
    fn a_source_that_fails_gives_its_end_and_its_error() {
        let found = outputs(|number| if number == 50 { Injection::Fail } else { Injection::Keep });
        assert!(matches!(&found[..], [Ok(Output::End(end)), Err(_)] if end.frames == 50), "{found:?}");
    }
}
