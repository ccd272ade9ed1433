//! The light of a touch from its first lit frame to its last, if a trigger gives one event per touch (SPEC §3).

use crate::params::DARK_FRAMES;

/// The end of an event's touch: the light has left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ContactEnd {
    /// The number of the first dark frame behind the touch.
    pub frame: u64,
    /// The number of the first frame of the event's sample.
    pub event_frame: u64,
}

impl ContactEnd {
    /// Creates the end of the touch of an event whose sample starts at `event_frame`.
    pub const fn new(frame: u64, event_frame: u64) -> Self {
        Self { frame, event_frame }
    }
}

/// The light of the last touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TouchState {
    /// The first lit frame.
    first: u64,
    /// The frame behind the last lit one.
    end: u64,
    /// The event whose touch is held, or has ended.
    event_frame: u64,
    /// The frame behind that touch, if it has ended.
    ended_at: u64,
    /// Dark frames since the last lit one, as far as they count.
    dark: u8,
    of_event: OfEvent,
}

/// The state of the touch of the last event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OfEvent {
    /// There is no event, or its end was reported.
    None,
    /// The touch has not ended.
    Held,
    /// The last push ended the touch.
    Ended,
}

impl TouchState {
    pub(crate) const NONE: Self =
        Self { first: 0, end: 0, event_frame: 0, ended_at: 0, dark: DARK_FRAMES, of_event: OfEvent::None };

    /// Takes whether the frame `now` is lit. While a sample is being captured, and while its touch is held, no other
    /// touch begins.
    pub(crate) fn advance(&mut self, now: u64, is_lit: bool, is_captured: bool) {
        if is_lit {
            if self.dark >= DARK_FRAMES && !is_captured && !self.is_held() {
                self.first = now;
            }
            (self.end, self.dark) = (now.saturating_add(1), 0);
        } else {
            self.dark = self.dark.saturating_add(1).min(DARK_FRAMES);
            self.release();
        }
    }

    /// Holds the touch of the event that is complete, until its light has left.
    pub(crate) fn hold(&mut self, event_frame: u64) {
        (self.event_frame, self.of_event) = (event_frame, OfEvent::Held);
        self.release();
    }

    /// Ends the touch of the held event if it has been dark for long enough.
    fn release(&mut self) {
        if self.dark >= DARK_FRAMES && self.is_held() {
            (self.ended_at, self.of_event) = (self.end, OfEvent::Ended);
        }
    }

    /// Returns whether the touch of the last event has not ended.
    pub(crate) fn is_held(&self) -> bool {
        self.of_event == OfEvent::Held
    }

    pub(crate) fn first(&self) -> u64 {
        self.first
    }

    /// Returns the number of a frame before which no touch that is reported later begins or ends. The window that may
    /// fire next starts at frame `window`, or the sample of this touch is being captured.
    pub(crate) fn settled_frame(&self, window: u64, is_captured: bool) -> u64 {
        if is_captured || (!self.is_held() && (self.dark < DARK_FRAMES || self.end > window)) {
            return self.first.min(window);
        }
        // The end of a held touch is reported, at its last lit frame or later ones.
        if self.is_held() { self.end.min(window) } else { window }
    }

    /// Returns the first dark frame behind the touch; `None` if the light has not left.
    pub(crate) fn end(&self) -> Option<u64> {
        (self.dark >= DARK_FRAMES).then_some(self.end)
    }

    /// Returns the end that the last push brought.
    pub(crate) fn ended(&self) -> Option<ContactEnd> {
        let Self { ended_at: frame, event_frame, .. } = *self;
        (self.of_event == OfEvent::Ended).then_some(ContactEnd { frame, event_frame })
    }

    pub(crate) fn forget_end(&mut self) {
        if self.of_event == OfEvent::Ended {
            self.of_event = OfEvent::None;
        }
    }
}
