//! How far a board's stream has come, as its messages show it: for an end that the board does not tell.

use wstac_core::trigger::{InterruptedSample, StreamEnd};

use crate::output::StreamSummary;

/// How a board's stream stands.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Progress {
    frames: u64,
    dropped: u64,
    baseline_complete: bool,
    incomplete: Option<InterruptedSample>,
}

impl Progress {
    /// Takes the board's own word.
    pub(super) fn set(&mut self, stream: &StreamEnd, dropped: u64) {
        *self = Self {
            frames: stream.frames,
            dropped,
            baseline_complete: stream.baseline_complete,
            incomplete: stream.incomplete,
        };
    }

    /// Whether any frame has passed.
    pub(super) fn any(&self) -> bool {
        self.frames > 0
    }

    /// So many frames have passed.
    pub(super) fn reach(&mut self, frames: u64) {
        self.frames = self.frames.max(frames);
    }

    /// A sample was under way until so many frames had passed, or begins to be: the baseline is complete.
    pub(super) fn contact(&mut self, frames: u64, incomplete: Option<InterruptedSample>) {
        self.reach(frames);
        self.baseline_complete = true;
        self.incomplete = incomplete;
    }

    /// So many camera frames more were lost.
    pub(super) fn drop(&mut self, frames: u64) {
        self.dropped = self.dropped.saturating_add(frames);
    }

    /// The end record of a stream that stands like this.
    pub(super) fn end(&self) -> StreamSummary {
        StreamSummary {
            frames: self.frames,
            dropped: self.dropped,
            baseline_complete: self.baseline_complete,
            incomplete: self.incomplete,
        }
    }
}
