//! The part of a source whose records are printed.

use wstac_host::output::Output;
use wstac_host::session::Processor;

/// A range of times in seconds from the first frame on: from `since` on, before `until`. Without either it has all,
/// also frames of a clock that goes back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    since: f64,
    until: f64,
    /// Events that were left out.
    pub(super) left_out: u64,
}

impl Range {
    pub(super) fn new(since: Option<f64>, until: Option<f64>) -> Self {
        Self { since: since.unwrap_or(f64::NEG_INFINITY), until: until.unwrap_or(f64::INFINITY), left_out: 0 }
    }

    /// Returns a record and its time in seconds, if it is in the range. The end is always in it, without an incomplete
    /// sample from outside.
    pub(super) fn select(&mut self, mut output: Output, processor: &Processor) -> Option<(Output, Option<f64>)> {
        let Some(time_s) = output.time_frame().map(|frame| processor.seconds(frame)) else {
            if let Output::End(end) = &mut output {
                end.incomplete = end.incomplete.filter(|sample| self.has(processor.seconds(sample.frame)));
            }
            return Some((output, None));
        };
        if self.has(time_s) {
            return Some((output, Some(time_s)));
        }
        self.left_out += u64::from(matches!(output, Output::Event(_)));
        None
    }

    /// Returns whether no record of the range can follow any more.
    pub(super) fn is_over(&self, processor: &Processor) -> bool {
        self.until.is_finite() && processor.seconds(processor.pipeline().settled_frame()) >= self.until
    }

    fn has(&self, time_s: f64) -> bool {
        (self.since..self.until).contains(&time_s)
    }
}
