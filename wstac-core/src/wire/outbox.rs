//! Keeps the events of a board until a host has them.

use super::{Answers, Request};

/// The milliseconds after which an event that was not acknowledged is sent again.
pub const RESEND_MS: u32 = 250;

/// The number of times that an event is sent before it is given up. With [`RESEND_MS`], that is 4 seconds.
pub const TRIES: u8 = 16;

/// Numbers events, and keeps the last `N` of them until a host acknowledges them.
///
/// A host that acknowledges events asks for that with [`Request::KeepEvents`]. Without such
/// a host every event is sent once. An event is given up after [`TRIES`], or if there is no room. The host learns of
/// that from [`Answers::number`] and [`Answers::kept`] of later events, and from
/// [`Telemetry::events`](super::Telemetry::events).
///
/// Times are in milliseconds, and may wrap. Samples are 2.3 seconds long at 30 frames per second, so two places are
/// enough for their events.
///
/// ```
/// use wstac_core::wire::{Answers, Outbox, Request, RESEND_MS};
///
/// fn serve(outbox: &mut Outbox<'static>, event: Answers<'static>, mut send: impl FnMut(Answers<'static>)) {
///     outbox.answer(Request::KeepEvents(true));
///     send(outbox.push(event, 0));
///     assert_eq!(outbox.due(RESEND_MS - 1), None);
///     // It was lost on the line.
///     outbox.due(RESEND_MS).map(&mut send);
///     outbox.answer(Request::Acknowledge { event: 0 });
///     assert_eq!(outbox.due(2 * RESEND_MS), None);
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Outbox<'a, const N: usize = 2> {
    kept: [Option<Kept<'a>>; N],
    /// The number of the next event.
    next: u16,
    /// Whether a host acknowledges events.
    is_heard: bool,
}

/// An event that was sent, and not acknowledged.
#[derive(Clone, Debug)]
struct Kept<'a> {
    answers: Answers<'a>,
    sent_at: u32,
    tries: u8,
}

impl<const N: usize> Default for Outbox<'_, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, const N: usize> Outbox<'a, N> {
    /// Creates an outbox before the first event.
    pub const fn new() -> Self {
        Self { kept: [const { None }; N], next: 0, is_heard: false }
    }

    /// Takes a request, and ignores those that are not about events.
    pub fn answer(&mut self, request: Request) {
        match request {
            Request::KeepEvents(is_heard) => {
                self.is_heard = is_heard;
                if !is_heard {
                    self.kept.fill_with(|| None);
                }
            }
            Request::Acknowledge { event } => {
                for place in &mut self.kept {
                    place.take_if(|kept| kept.answers.number == event);
                }
            }
            _ => {}
        }
    }

    /// Numbers an event, and keeps it if a host acknowledges events. The oldest event gives way if there is no room.
    ///
    /// Returns the event as it is sent now.
    pub fn push(&mut self, mut answers: Answers<'a>, now: u32) -> Answers<'a> {
        answers.number = self.next;
        self.next = self.next.wrapping_add(1);
        answers.kept = 0;
        if self.is_heard {
            let next = self.next;
            // A free place is as old as can be.
            let age = |place: &Option<Kept<'_>>| place.as_ref().map_or(u16::MAX, |kept| age(kept, next));
            if let Some(place) = self.kept.iter_mut().max_by_key(|place| age(place)) {
                *place = Some(Kept { answers, sent_at: now, tries: 1 });
            }
            answers.kept = self.kept().saturating_sub(1);
        }
        answers
    }

    /// Returns the oldest event that has to be sent again now; `None` if there is none.
    ///
    /// If an event is given up because no host has acknowledged it, later events are sent once, until a host asks
    /// again.
    // Inlined, or with the copy in `resent`, it takes `memmove`, which is 1.5 kB of a board's flash and else not there.
    #[inline(never)]
    pub fn due(&mut self, now: u32) -> Option<Answers<'a>> {
        self.resent(now).copied()
    }

    fn resent(&mut self, now: u32) -> Option<&Answers<'a>> {
        let next = self.next;
        let is_due = |kept: &Kept<'_>| now.wrapping_sub(kept.sent_at) >= RESEND_MS;
        for place in &mut self.kept {
            if place.take_if(|kept| is_due(kept) && kept.tries >= TRIES).is_some() {
                self.is_heard = false;
            }
        }
        let behind = self.kept();
        let kept = self.kept.iter_mut().flatten().filter(|kept| is_due(kept)).max_by_key(|kept| age(kept, next))?;
        (kept.sent_at, kept.tries) = (now, kept.tries.saturating_add(1));
        kept.answers.kept = u16::from(behind).saturating_sub(age(kept, next)) as u8;
        Some(&kept.answers)
    }

    /// Returns the number of the next event.
    pub fn next_event(&self) -> u16 {
        self.next
    }

    /// Returns how far the oldest event that is kept is behind the next one: 0 if none is kept.
    pub fn kept(&self) -> u8 {
        let ages = self.kept.iter().flatten().map(|kept| age(kept, self.next));
        ages.max().unwrap_or(0).min(u16::from(u8::MAX)) as u8
    }

    /// Returns whether the event with this number is kept.
    pub fn keeps(&self, event: u16) -> bool {
        self.kept.iter().flatten().any(|kept| kept.answers.number == event)
    }

    /// Returns whether a host acknowledges events.
    pub fn is_heard(&self) -> bool {
        self.is_heard
    }
}

/// Returns how far an event is behind the next one: 1 for the newest.
fn age(kept: &Kept<'_>, next: u16) -> u16 {
    next.wrapping_sub(kept.answers.number)
}
