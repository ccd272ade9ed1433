//! Helpers that the tests share: every pixel format, a plain per-pixel model of the taxel sums, a plain model of the
//! trigger, and events as owned data.

pub mod command;
pub mod extreme;
pub mod folder;
pub mod formats;
pub mod npz;
pub mod plain_sums;
pub mod plain_trigger;
pub mod random;
pub mod textures;
pub mod trained;

use wstac_core::features::Features;
use wstac_core::paper::trigger::Event;

/// An event that does not borrow its trigger.
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
    /// Whether it is reliable.
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

/// Returns a whole number from the environment, for runs that are longer than a test, or else the default of the test.
///
/// # Panics
///
/// If it is no whole number.
pub fn how_many(variable: &str, usual: u64) -> u64 {
    let Ok(text) = std::env::var(variable) else { return usual };
    text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}, expected a whole number"))
}
