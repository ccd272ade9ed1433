//! What the tests share: every pixel format, a plain per-pixel model of the taxel sums, a plain model of the trigger,
//! and events as owned data.

pub mod command;
pub mod extreme;
pub mod folder;
pub mod formats;
pub mod npz;
pub mod plain_sums;
pub mod plain_trigger;
pub mod random;
pub mod trained;

use wstac_core::features::Features;
use wstac_core::trigger::Event;

/// An event that does not borrow the trigger it came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnedEvent {
    /// Number of the first frame of its sample.
    pub frame: u64,
    /// Its sample, frame by frame.
    pub sample: Vec<Features>,
    /// Totals of its baseline.
    pub totals: [i32; 10],
    /// Frames of its sample that were filled.
    pub frames_filled: u8,
    /// Whether it is to be relied on.
    pub reliable: bool,
}

impl From<Event<'_>> for OwnedEvent {
    fn from(event: Event<'_>) -> Self {
        Self {
            frame: event.frame,
            sample: event.sample.frames().copied().collect(),
            totals: *event.baseline.totals(),
            frames_filled: event.frames_filled,
            reliable: event.reliable,
        }
    }
}

/// A whole number from the environment, for a run that is longer than a test; without it what is usual in a test.
///
/// # Panics
///
/// Where it is no whole number.
pub fn how_many(variable: &str, usual: u64) -> u64 {
    let Ok(text) = std::env::var(variable) else { return usual };
    text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}, expected a whole number"))
}
