//! The counts of a camera interface's interrupts: complete stripes, vertical syncs, and for a self-test lines and
//! words.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

use embassy_time::Instant;

use super::Trouble;
use crate::self_test::Probe;

const NONE: u8 = 0;
const OVERRUN: u8 = 1;
const MISPLACED_SYNC: u8 = 2;

/// The counters of the one camera interface. Interrupts of one priority write to them; without atomic additions, which
/// a Cortex-M0 does not have.
pub(super) static COUNTS: Counts = Counts::new();

pub(super) struct Counts {
    /// The stripes complete since the restart, modulo 2^32.
    complete: AtomicU32,
    /// The complete stripes of the frame under way.
    in_frame: AtomicU32,
    /// [`NONE`], or the [`Trouble`] since the restart.
    trouble: AtomicU8,
    /// The stripes of a frame and the words of a stripe.
    per_frame: AtomicU32,
    words_per_stripe: AtomicU32,
    /// The vertical syncs since power was on, modulo 2^32, and the ticks at the last one.
    syncs: AtomicU32,
    sync_at: AtomicU32,
    /// Whether frames are measured.
    is_probing: AtomicBool,
    /// The syncs that the measurement has seen, and the ticks at the first.
    probed: AtomicU32,
    probed_from: AtomicU32,
    /// The lines of the frame under way, and those of the last one.
    lines: AtomicU32,
    last_lines: AtomicU32,
    /// The words since the restart at the last sync, and those between the last two.
    words_at_sync: AtomicU32,
    last_words: AtomicU32,
}

impl Counts {
    const fn new() -> Self {
        Self {
            complete: AtomicU32::new(0),
            in_frame: AtomicU32::new(0),
            trouble: AtomicU8::new(NONE),
            per_frame: AtomicU32::new(1),
            words_per_stripe: AtomicU32::new(0),
            syncs: AtomicU32::new(0),
            sync_at: AtomicU32::new(0),
            is_probing: AtomicBool::new(false),
            probed: AtomicU32::new(0),
            probed_from: AtomicU32::new(0),
            lines: AtomicU32::new(0),
            last_lines: AtomicU32::new(0),
            words_at_sync: AtomicU32::new(0),
            last_words: AtomicU32::new(0),
        }
    }

    /// Takes the stripes of a frame and the words of a stripe, before any interrupt.
    pub(super) fn set_size(&self, per_frame: u32, words_per_stripe: u32) {
        self.per_frame.store(per_frame, Ordering::Relaxed);
        self.words_per_stripe.store(words_per_stripe, Ordering::Relaxed);
    }

    /// Forgets everything but the syncs. From now on, frames are used or measured.
    pub(super) fn restart(&self, is_probing: bool) {
        let Self { complete, in_frame, probed, lines, last_lines, words_at_sync, last_words, .. } = self;
        for counter in [complete, in_frame, probed, lines, last_lines, words_at_sync, last_words] {
            counter.store(0, Ordering::Relaxed);
        }
        self.trouble.store(NONE, Ordering::Relaxed);
        self.is_probing.store(is_probing, Ordering::Relaxed);
    }

    /// Adds complete stripes. Returns the number since the restart.
    pub(super) fn add_stripes(&self, more: u32) -> u32 {
        let complete = self.complete.load(Ordering::Relaxed).wrapping_add(more);
        self.complete.store(complete, Ordering::Release);
        let in_frame = self.in_frame.load(Ordering::Relaxed) + more;
        let in_frame = in_frame.checked_rem(self.per_frame.load(Ordering::Relaxed)).unwrap_or(0);
        self.in_frame.store(in_frame, Ordering::Relaxed);
        complete
    }

    /// Adds a vertical sync at this time.
    pub(super) fn add_sync(&self) {
        add(&self.syncs, 1);
        self.sync_at.store(Instant::now().as_ticks() as u32, Ordering::Relaxed);
    }

    /// Adds a line to a measurement.
    pub(super) fn add_line(&self) {
        add(&self.lines, 1);
    }

    /// Ends a measured frame at a vertical sync that [`Counts::add_sync`] has added: `words` have come since the
    /// restart.
    pub(super) fn end_probed_frame(&self, words: u32) {
        self.last_words.store(words.wrapping_sub(self.words_at_sync.load(Ordering::Relaxed)), Ordering::Relaxed);
        self.words_at_sync.store(words, Ordering::Relaxed);
        self.last_lines.store(self.lines.load(Ordering::Relaxed), Ordering::Relaxed);
        self.lines.store(0, Ordering::Relaxed);
        if self.probed.load(Ordering::Relaxed) == 0 {
            self.probed_from.store(self.sync_at.load(Ordering::Relaxed), Ordering::Relaxed);
        }
        add(&self.probed, 1);
    }

    pub(super) fn set_trouble(&self, trouble: Trouble) {
        let is_misplaced = trouble == Trouble::MisplacedSync;
        self.trouble.store(if is_misplaced { MISPLACED_SYNC } else { OVERRUN }, Ordering::Relaxed);
    }

    /// Returns the stripes complete since the restart, modulo 2^32.
    #[cfg(feature = "stm32")]
    pub(super) fn complete(&self) -> u32 {
        self.complete.load(Ordering::Acquire)
    }

    /// Returns whether the complete stripes are whole frames.
    pub(super) fn is_between_frames(&self) -> bool {
        self.in_frame.load(Ordering::Relaxed) == 0
    }

    pub(super) fn is_probing(&self) -> bool {
        self.is_probing.load(Ordering::Relaxed)
    }

    pub(super) fn words_per_stripe(&self) -> u32 {
        self.words_per_stripe.load(Ordering::Relaxed)
    }

    /// Returns the trouble since the restart.
    pub(super) fn trouble(&self) -> Option<Trouble> {
        match self.trouble.load(Ordering::Relaxed) {
            NONE => None,
            MISPLACED_SYNC => Some(Trouble::MisplacedSync),
            _ => Some(Trouble::Overrun),
        }
    }

    pub(super) fn probe(&self) -> Probe {
        critical_section::with(|_| Probe {
            frames: self.probed.load(Ordering::Relaxed).saturating_sub(1),
            ticks: self.sync_at.load(Ordering::Relaxed).wrapping_sub(self.probed_from.load(Ordering::Relaxed)),
            lines: self.last_lines.load(Ordering::Relaxed),
            words: self.last_words.load(Ordering::Relaxed),
        })
    }

    /// Returns the vertical syncs, modulo 2^32, and the ticks at the last one, modulo 2^32.
    pub(super) fn syncs(&self) -> (u32, u32) {
        critical_section::with(|_| (self.syncs.load(Ordering::Relaxed), self.sync_at.load(Ordering::Relaxed)))
    }
}

fn add(counter: &AtomicU32, more: u32) {
    counter.store(counter.load(Ordering::Relaxed).wrapping_add(more), Ordering::Relaxed);
}
