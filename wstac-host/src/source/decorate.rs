//! Decorators: sources that wrap any other source.

mod rate_watch;

use super::{Source, SourceEvent, StreamInfo};
use crate::error::Error;
use crate::output::OutputOptions;

pub use rate_watch::RateWatch;

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

    fn request(&mut self, outputs: OutputOptions) {
        self.source.request(outputs);
    }

    fn stop(&mut self) -> bool {
        self.source.stop()
    }
}

#[cfg(test)]
mod tests {
    use wstac_core::green::any::PixelFormat;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;
    use wstac_core::reason::Reason;

    use super::*;
    use crate::error::ErrorKind;
    use crate::output::Output;
    use crate::session::Session;
    use crate::source::{Fault, FaultKind, Frame, LossReason};

    type Planned = Option<Result<SourceEvent<'static>, Error>>;

    /// A stripe with other events in place of frames, by their numbers. After a fault, the frame is lost.
    struct Changed<F> {
        source: Stripe,
        plan: F,
        owed: bool,
    }

    impl<F: FnMut(u64) -> Planned + Send> Source for Changed<F> {
        fn info(&self) -> &StreamInfo {
            self.source.info()
        }

        fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
            if std::mem::take(&mut self.owed) {
                return Ok(lost(1));
            }
            let number = self.source.number as u64;
            let event = self.source.next_event();
            let Some(other) = (self.plan)(number) else { return event };
            self.owed = matches!(other, Ok(SourceEvent::Fault(_)));
            other
        }
    }

    fn lost(frames: u64) -> SourceEvent<'static> {
        SourceEvent::Lost { frames, reason: LossReason::Dropped }
    }

    /// Returns a plan of two faults in place of these frames.
    fn faults(first: (u64, FaultKind), then: (u64, FaultKind)) -> impl FnMut(u64) -> Planned + Send + 'static {
        move |number| {
            let (_, kind) = [&first, &then].into_iter().find(|(at, _)| *at == number)?;
            Some(Ok(SourceEvent::Fault(Fault::new(kind.clone(), "a fault"))))
        }
    }

    /// Returns the event's frame, whether it and its sample are reliable, and its doubt, with two faults.
    fn event(first: (u64, FaultKind), then: (u64, FaultKind)) -> (u64, bool, bool, Option<Reason>) {
        let event = outputs(faults(first, then)).into_iter().flatten().find_map(|output| match output {
            Output::Event(event) => Some((event.frame, event.reliable, event.sample_reliable, event.doubt)),
            _ => None,
        });
        event.unwrap()
    }

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

    fn stripe() -> Stripe {
        let size = FrameSize::new(100, 100).unwrap();
        let info = StreamInfo::new("a stripe", size, PixelFormat::Gray, FrameRate::NOMINAL);
        Stripe { info, bytes: vec![0; 10_000], number: 0 }
    }

    fn outputs(plan: impl FnMut(u64) -> Planned + Send + 'static) -> Vec<Result<Output, Error>> {
        Session::builder(Changed { source: stripe(), plan, owed: false }).build().unwrap().collect()
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
        let whole = event_and_dropped(&outputs(|_| None));
        assert_eq!(whole, (Some((30, 0)), 0));
        let three = |number| (60..63).contains(&number).then(|| Ok(lost(1)));
        assert_eq!(event_and_dropped(&outputs(three)), (Some((30, 3)), 3));
        let short = |number| (number == 61).then(|| Ok(SourceEvent::Frame(Frame::new(&[1; 99]))));
        assert_eq!(event_and_dropped(&outputs(short)), (Some((30, 1)), 1));
        let long = |number| (50..90).contains(&number).then(|| Ok(lost(1)));
        assert_eq!(event_and_dropped(&outputs(long)), (None, 40));
    }

    #[test]
    fn a_limit_is_exact_and_cuts_a_gap() {
        for (limit, gap, frames) in
            [(Some(70), 6, 70), (Some(70), u64::MAX, 70), (Some(66), 6, 66), (Some(300), 6, 125), (None, 6, 125)]
        {
            let plan = move |number| (number == 67).then(|| Ok(lost(gap)));
            let source = Changed { source: stripe(), plan, owed: false };
            let session = Session::builder(Limited::new(source, limit)).build().unwrap();
            let end = session.map(Result::unwrap).find_map(|output| match output {
                Output::End(end) => Some(end),
                _ => None,
            });
            assert_eq!(end.unwrap().frames, frames, "{limit:?}");
        }
    }

    #[test]
    fn an_injected_fault_is_reported_and_its_frame_lost() {
        let found = outputs(faults((10, FaultKind::Slow), (u64::MAX, FaultKind::Even)));
        let Some(Ok(Output::Fault(report))) = found.first() else { panic!("{found:?}") };
        assert_eq!((report.frame, &report.fault.kind), (10, &FaultKind::Slow));
        // The lost frame lies before the sample.
        assert_eq!(event_and_dropped(&found), (Some((30, 0)), 1));
    }

    #[test]
    fn an_event_with_uneven_frames_is_not_reliable_and_one_after_them_is() {
        let event = |from, to| event((from, FaultKind::Uneven), (to, FaultKind::Even));
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
        let event = |fast, then, to| {
            let (_, reliable, sample_reliable, doubt) = event((fast, FaultKind::Fast), (to, then));
            (reliable, sample_reliable, doubt)
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
        let error = |from, to| {
            let plan = faults((from, FaultKind::Uneven), (to, FaultKind::Even));
            let source = Changed { source: stripe(), plan, owed: false };
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
        let fails = || Err(Error::new(ErrorKind::Device, "a stripe", "fails"));
        let found = outputs(move |number| (number == 50).then(fails));
        assert!(matches!(&found[..], [Ok(Output::End(end)), Err(_)] if end.frames == 50), "{found:?}");
    }
}
