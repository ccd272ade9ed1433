//! Reads a camera's frames, some rows at a time, from hardware that captures into a ring of two stripes. It detects
//! faults and recovers from them.
//!
//! [`Stripes`] knows only what [`Capture`] counts and the time, so tests drive it through every fault. The hardware's
//! side is `dcmi` on an STM32 and `pio` on the RP2040 and RP2350, each the only owner of a DMA.
//!
//! ```text
//! frame          |--- stripe 0 --- stripe 1 --- … --- stripe n-1 ---|  blanking  |--- stripe 0 …
//! DMA writes     half 0        half 1        half 0 …
//! the core reads               half 0        half 1 …
//! ```
//!
//! A frame is whole stripes, and a restart begins at a vertical sync with stripe 0 in half 0. So stripe k is in half k
//! mod 2, and only the count of complete stripes has to be kept. While a stripe is read, the DMA fills the other half;
//! once that is full, it continues in this one. So rows are trusted only when [`Stripes::release`] has counted again
//! after they were read.
//!
//! While the core uses a frame, an interrupt takes the next one's rows ([`Stripes::early_rows`]).
//!
//! | fault | how it is detected | when |
//! | --- | --- | --- |
//! | overrun | the interface reports it, or the next stripe was complete before this one was read | at once |
//! | lost sync | a vertical sync in the middle of a frame | at once |
//! | lost sync | no frame began for 1.5 frame times, but then lines arrive | 1.9 frame times |
//! | silent sensor | no frame began for 1.5 frame times, and no lines arrive | 1.9 frame times |
//!
//! While a sensor rests, these are times of the frames that it sends ([`Stripes::set_pace`]).
//!
//! After each of them, capture restarts at the next vertical sync. The time tells how many frames were lost: a frame
//! that begins n frame times after the one before follows n − 1 lost ones.

use core::mem;

use crate::rest;

#[cfg(any(feature = "stm32", feature = "rp"))]
mod counts;
#[cfg(feature = "stm32")]
pub mod dcmi;
#[cfg(feature = "rp")]
pub mod pio;

/// A ring of two stripes of `WORDS` words each.
pub type Ring<const WORDS: usize> = [[u32; WORDS]; 2];

/// The ticks of a clock that does not stop or run backwards.
pub type Ticks = u64;

/// A camera interface with a DMA ring of two stripes.
pub trait Capture {
    /// Restarts at the next vertical sync, with its first row at the ring's start. It forgets what it has counted and
    /// seen.
    fn restart(&mut self);

    /// Returns the number of stripes complete since the restart, modulo 2^32. Reads of [`Capture::rows`] before the
    /// call happen before the count.
    fn complete(&self) -> u32;

    /// Returns the fault that the interface itself has found since the restart.
    fn trouble(&self) -> Option<Trouble>;

    /// Returns whether a line has begun since the restart, in a frame or not.
    fn lines_come(&self) -> bool;

    /// Returns the rows of half 0 or 1 of the ring, without gaps.
    fn rows(&self, half: usize) -> &[u8];

    /// Returns the time.
    fn now(&self) -> Ticks;
}

/// The part of frames that is captured, and its purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The rows of luma that are used.
    Frames,
    /// All bytes of whole frames, to be measured.
    AllBytes,
    /// The rows of luma, to be measured.
    Luma,
}

/// A fault that a camera interface itself can detect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// Pixels came faster than the DMA took them.
    Overrun,
    /// A vertical sync in the middle of a frame.
    MisplacedSync,
}

/// The fault that interrupted the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "node", derive(defmt::Format))]
pub enum Fault {
    /// Rows were lost or overwritten: the DMA or the core was too late.
    Overrun,
    /// A vertical sync was missing or misplaced.
    LostSync,
    /// The sensor sends no pixels.
    Silent,
}

/// The next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StripeStep<'a> {
    /// Read these rows, [`Stripes::release`] them, then ask again at once.
    Rows {
        /// Whole rows.
        rows: &'a [u8],
        /// Whether they end the frame.
        last: bool,
    },
    /// The rest of the frame under way will not arrive: the frame is lost.
    Abandoned,
    /// This many frames were lost before the next rows.
    Lost(u64),
    /// Report this fault. A silent sensor is reported every two frame times, until it sends again.
    Fault(Fault),
    /// Do nothing until the hardware signals or the time has come.
    Wait(Ticks),
}

/// The former name of [`StripeStep`].
#[deprecated(since = "0.4.0", note = "use `StripeStep`")]
pub type Step<'a> = StripeStep<'a>;

/// The position at which the ring is read.
#[derive(Debug)]
pub struct Stripes<C> {
    capture: C,
    per_frame: u32,
    /// The ticks from frame to frame.
    period: Ticks,
    /// The stripes read since the restart, modulo 2^32.
    taken: u32,
    /// The stripes read of the frame under way: fewer than a frame has.
    in_frame: u32,
    /// Whether the next stripe is being read.
    lent: bool,
    /// The time when the last frame began.
    began: Option<Ticks>,
    /// The time by which the next frame should have begun.
    due: Ticks,
    /// The time at which the reason for the delay is decided.
    verdict: Option<Ticks>,
    abandon: bool,
    /// The periods from frame to frame, in a build that lets a sensor rest.
    pace: [Ticks; rest::BUILDS],
}

impl<C: Capture> Stripes<C> {
    /// Creates a reader of frames of `stripes_per_frame` stripes, `period` ticks apart, from `capture`, and starts it.
    pub fn new(capture: C, stripes_per_frame: u32, period: Ticks) -> Self {
        let mut stripes = Self {
            capture,
            per_frame: stripes_per_frame.max(1),
            period: period.max(1),
            taken: 0,
            in_frame: 0,
            lent: false,
            began: None,
            due: 0,
            verdict: None,
            abandon: false,
            pace: [1; rest::BUILDS],
        };
        stripes.restart();
        stripes
    }

    /// Restarts at the next vertical sync. A frame that is under way is given up.
    pub fn restart(&mut self) {
        self.abandon |= self.is_in_frame();
        self.capture.restart();
        (self.taken, self.in_frame, self.lent, self.verdict) = (0, 0, false, None);
        self.due = self.after(3, 2);
    }

    /// Returns the next step.
    pub fn step(&mut self) -> StripeStep<'_> {
        if mem::take(&mut self.abandon) {
            return StripeStep::Abandoned;
        }
        if let Some(trouble) = self.capture.trouble() {
            return self.fault(match trouble {
                Trouble::Overrun => Fault::Overrun,
                Trouble::MisplacedSync => Fault::LostSync,
            });
        }
        // No stripe is complete yet, or the next one is. With one more, the DMA is in that one again.
        if self.lent && !self.release() {
            return self.fault(Fault::Overrun);
        }
        match self.ahead() {
            0 => self.wait(),
            1 => self.take(),
            _ => self.fault(Fault::Overrun),
        }
    }

    /// Ends the reading of the rows of [`StripeStep::Rows`]. Returns whether all that was read of them is what the
    /// camera sent.
    ///
    /// If not, they must not complete a frame, and the next step gives the frame up.
    ///
    /// Call it between reading a frame's last rows and using the frame.
    pub fn release(&mut self) -> bool {
        let whole = self.lent && self.ahead() == 1;
        if whole {
            self.lent = false;
            self.taken = self.taken.wrapping_add(1);
            self.in_frame = if self.in_frame + 1 < self.per_frame { self.in_frame + 1 } else { 0 };
        }
        whole
    }

    /// Returns the rows of the next stripe for an interrupt that comes while a frame is in use: if the stripe is
    /// complete, not the last of its frame, and nothing else is to be done before.
    ///
    /// [`Stripes::release`] them before the next step. While the interrupt lasts, no other one counts stripes: reading
    /// them must take less time than a stripe.
    pub fn early_rows(&mut self) -> Option<&[u8]> {
        let is_next = !self.abandon && !self.lent && self.verdict.is_none() && self.capture.trouble().is_none();
        if !is_next || self.in_frame + 1 >= self.per_frame || self.ahead() != 1 {
            return None;
        }
        if self.in_frame == 0 {
            let now = self.capture.now();
            if self.began.is_some_and(|before| self.frames_between(before, now) > 1) {
                return None;
            }
            (self.began, self.due) = (Some(now), self.after(3, 2));
        }
        self.lent = true;
        Some(self.capture.rows(self.taken as usize % 2))
    }

    /// Returns the number of the stripe of its frame that is read next, from 0 on.
    pub fn number(&self) -> u32 {
        self.in_frame
    }

    /// Returns the capture hardware.
    pub fn capture(&self) -> &C {
        &self.capture
    }

    /// Returns the capture hardware, to be used between frames. A [`Stripes::restart`] must follow.
    pub fn capture_mut(&mut self) -> &mut C {
        &mut self.capture
    }

    fn is_in_frame(&self) -> bool {
        self.in_frame > 0 || self.lent
    }

    /// Returns the number of complete stripes that were not read to their end.
    fn ahead(&self) -> u32 {
        self.capture.complete().wrapping_sub(self.taken)
    }

    /// From now on, expects a frame in so many periods. Those between are lost.
    pub fn set_pace(&mut self, periods: Ticks) {
        self.pace = [periods; rest::BUILDS];
        self.due = self.after(3, 2);
    }

    /// Returns the time `numerator / denominator` times from frame to frame from now.
    #[inline(never)]
    fn after(&self, numerator: Ticks, denominator: Ticks) -> Ticks {
        let numerator = self.pace.first().map_or(numerator, |pace| numerator.saturating_mul(*pace));
        let frames = self.period.saturating_mul(numerator).checked_div(denominator).unwrap_or(0);
        self.capture.now().saturating_add(frames)
    }

    fn take(&mut self) -> StripeStep<'_> {
        if !self.is_in_frame() {
            if self.verdict.is_some() {
                // The frame came while the decision was pending: late, but it came.
                self.verdict = None;
                return StripeStep::Fault(Fault::LostSync);
            }
            let now = self.capture.now();
            let before = self.began.replace(now);
            self.due = self.after(3, 2);
            let lost = before.map_or(0, |before| self.frames_between(before, now).saturating_sub(1));
            if lost > 0 {
                return StripeStep::Lost(lost);
            }
        }
        self.lent = true;
        let last = self.in_frame + 1 >= self.per_frame;
        StripeStep::Rows { rows: self.capture.rows(self.taken as usize % 2), last }
    }

    /// Returns the number of frame times from one time to another, rounded to the nearest; ties round up.
    #[inline(never)]
    fn frames_between(&self, before: Ticks, now: Ticks) -> u64 {
        now.saturating_sub(before).saturating_add(self.period / 2).checked_div(self.period).unwrap_or(0)
    }

    fn wait(&mut self) -> StripeStep<'_> {
        let now = self.capture.now();
        if let Some(verdict) = self.verdict {
            if now < verdict {
                return StripeStep::Wait(verdict);
            }
            if self.capture.lines_come() {
                // Capture restarted when the decision began; it still waits for its vertical sync.
                self.verdict = None;
                self.due = self.after(3, 2);
                return StripeStep::Fault(Fault::LostSync);
            }
            return self.fault(Fault::Silent);
        }
        if now < self.due {
            return StripeStep::Wait(self.due);
        }
        self.restart();
        let verdict = self.after(2, 5);
        self.verdict = Some(verdict);
        if mem::take(&mut self.abandon) { StripeStep::Abandoned } else { StripeStep::Wait(verdict) }
    }

    fn fault(&mut self, fault: Fault) -> StripeStep<'_> {
        self.restart();
        StripeStep::Fault(fault)
    }
}

#[cfg(test)]
mod tests;
