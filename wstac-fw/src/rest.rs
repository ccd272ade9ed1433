//! Lets a sensor rest that has not seen light for a while: it sends fewer frames until the first lit one. A build
//! without `WSTAC_REST` has none of it.
//!
//! Frames that are not sent count as lost, so an event that begins while the sensor rests is not reliable ([`RESTS`]).
//!
//! [`RESTS`]: crate::sensor::RESTS

use core::mem;

use crate::sensor::{RESTS, Setting};
use crate::setup;

/// 1 in a build that lets a sensor rest, else 0.
pub const BUILDS: usize = (setup::REST != 0) as usize;
/// The dark frames in a row after which a sensor of such a build rests.
pub const DARK: u32 = setup::REST * setup::FPS;

/// The fewest frames of backtrack with which a sensor rests: with fewer, an event at rest might be reliable.
pub const FEWEST_BACKTRACK: u8 = 10;
/// The frames that may come late when a sensor returns: one whose length was decided before, and one more.
const LATE: u16 = 2;

/// The frames that a sensor sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestState {
    /// It sends every frame.
    Full,
    /// It was told to send few.
    Resting,
    /// It was told to send every frame. The next one may still come late.
    Returning,
    /// It was told so long ago, and frames are still missing.
    Overdue,
}

/// The rest of a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Rest {
    /// The settings with which the sensor sends every frame.
    pub awake: &'static [&'static [Setting]],
    /// The dark frames in a row after which it rests.
    after: u32,
    /// The last frames without light, at most `after`.
    dark: u32,
    state: RestState,
    /// The frames since it was told to send every one.
    returning: u16,
    /// Whether frames are missing in front of the next one.
    has_gap: bool,
}

impl Rest {
    /// Creates the state of a sensor with these settings, which sends every frame, and rests after so many dark ones.
    pub const fn new(awake: &'static [&'static [Setting]], after: u32) -> Self {
        Self { awake, after, dark: 0, state: RestState::Full, returning: 0, has_gap: false }
    }

    /// Begins anew: the sensor sends every frame.
    pub fn restart(&mut self) {
        *self = Self::new(self.awake, self.after);
    }

    /// Takes note that frames are missing. Returns whether the sensor was not to send them.
    pub fn note_gap(&mut self) -> bool {
        self.has_gap = true;
        self.is_slow() && self.returning < LATE
    }

    /// Returns whether frames may come late.
    pub fn is_slow(&self) -> bool {
        self.state != RestState::Full
    }

    /// Takes the next frame. Returns what the sensor sends from now on, if that changes.
    pub fn push(&mut self, is_lit: bool) -> Option<RestState> {
        let has_gap = mem::take(&mut self.has_gap);
        self.dark = if is_lit { 0 } else { self.after.min(self.dark.saturating_add(1)) };
        let before = self.state;
        self.state = match before {
            RestState::Full if self.dark >= self.after => RestState::Resting,
            RestState::Resting if is_lit => RestState::Returning,
            RestState::Returning if !has_gap => RestState::Full,
            RestState::Returning if self.returning + 1 >= 2 * RESTS => RestState::Overdue,
            state => state,
        };
        self.returning = if before == RestState::Returning { self.returning + 1 } else { 0 };
        (self.state != before).then_some(self.state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_rests_in_the_dark_and_returns_at_the_first_light() {
        let mut rest = Rest::new(&[], 3);
        // Light begins the count anew.
        assert_eq!([false, false, true, false, false].map(|is_lit| rest.push(is_lit)), [None; 5]);
        assert_eq!(rest.push(false), Some(RestState::Resting));
        assert!(rest.note_gap());
        assert_eq!(rest.push(false), None);
        assert!(rest.note_gap());
        assert_eq!(rest.push(true), Some(RestState::Returning));
        // A frame that comes late does not show that the sensor is back, dark or not.
        assert!(rest.note_gap());
        assert_eq!(rest.push(false), None);
        assert_eq!(rest.push(true), Some(RestState::Full));
        assert!(!rest.note_gap());
        // It stays awake as long as before.
        assert_eq!([false; 3].map(|is_lit| rest.push(is_lit)), [None, None, Some(RestState::Resting)]);
    }

    #[test]
    fn a_sensor_that_does_not_return_is_reported() {
        let mut rest = Rest::new(&[], 1);
        assert_eq!([false, true].map(|is_lit| rest.push(is_lit)), [RestState::Resting, RestState::Returning].map(Some));
        for frame in 1..=2 * RESTS {
            // Frames that are missing in front of the first two were not sent; the others are lost.
            assert_eq!(rest.note_gap(), frame <= LATE, "{frame}");
            assert_eq!(rest.push(true), (frame == 2 * RESTS).then_some(RestState::Overdue), "{frame}");
        }
        rest.restart();
        assert!(!rest.note_gap() && !rest.is_slow());
        assert_eq!(rest.push(true), None);
    }
}
