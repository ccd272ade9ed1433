//! The progress of a board's stream, as its messages show it. It serves an end that the board does not report.

use wstac_core::trigger::{InterruptedSample, StreamEnd};

use crate::output::StreamSummary;

/// The state of a board's stream.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Progress {
    frames: u64,
    dropped: u64,
    baseline_complete: bool,
    incomplete: Option<InterruptedSample>,
}

impl Progress {
    /// Takes the board's own numbers.
    pub(super) fn set(&mut self, stream: &StreamEnd, dropped: u64) {
        *self = Self {
            frames: stream.frames,
            dropped,
            baseline_complete: stream.baseline_complete,
            incomplete: stream.incomplete,
        };
    }

    /// Returns whether any frame has passed.
    pub(super) fn any(&self) -> bool {
        self.frames > 0
    }

    /// Notes that this many frames have passed.
    pub(super) fn reach(&mut self, frames: u64) {
        self.frames = self.frames.max(frames);
    }

    /// Notes a sample that was being captured until this many frames had passed, or that begins there. The baseline is
    /// complete then.
    pub(super) fn contact(&mut self, frames: u64, incomplete: Option<InterruptedSample>) {
        self.reach(frames);
        self.baseline_complete = true;
        self.incomplete = incomplete;
    }

    /// Adds camera frames that were lost.
    pub(super) fn drop(&mut self, frames: u64) {
        self.dropped = self.dropped.saturating_add(frames);
    }

    /// Returns the end record of a stream in this state.
    pub(super) fn end(&self) -> StreamSummary {
        StreamSummary {
            frames: self.frames,
            dropped: self.dropped,
            baseline_complete: self.baseline_complete,
            incomplete: self.incomplete,
        }
    }
}
