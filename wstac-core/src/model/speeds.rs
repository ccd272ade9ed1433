//! The speeds of the slides that a model was trained on.
//!
//! A model is asked about any slide. Far from the speeds of its training its answers are wrong more often than they
//! seem: where frames lie farther apart, one texture looks like another one. So a file may say these speeds, and then
//! no slide at another speed is known.

use core::fmt;

use crate::touch::motion::Velocity;

/// The slowest and the fastest speed in a file are bytes, in units of so many mm/s.
const SLOWEST_UNIT: u16 = 2;
const FASTEST_UNIT: u16 = 4;
/// The fastest slide that a file can state, in mm/s.
pub const FASTEST: u16 = FASTEST_UNIT * u8::MAX as u16;
/// Part of a speed that it may lie beyond those of the training: speeds are measured with an error.
const BEYOND: f32 = 1.0 / 32.0;

/// The speeds of the slides that a model was trained on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct KnownSpeeds {
    slowest: u8,
    fastest: u8,
}

impl KnownSpeeds {
    /// Creates the speeds of a training, in mm/s. The slowest is rounded down to an even number of at most 510, the
    /// fastest up to a multiple of four. `None` if they are not in order, or the fastest is 0 or above [`FASTEST`].
    ///
    /// ```
    /// use wstac_core::model::speeds::KnownSpeeds;
    ///
    /// let speeds = KnownSpeeds::new(51, 298).unwrap();
    /// assert_eq!((speeds.slowest(), speeds.fastest()), (50, 300));
    /// assert!(speeds.has(48.5) && speeds.has(309.0) && !speeds.has(320.0) && !speeds.has(f32::NAN));
    /// assert_eq!(KnownSpeeds::new(300, 50), None);
    /// ```
    pub const fn new(slowest: u16, fastest: u16) -> Option<Self> {
        if fastest == 0 || fastest > FASTEST || slowest > fastest {
            return None;
        }
        let slowest = slowest / SLOWEST_UNIT;
        let slowest = if slowest > u8::MAX as u16 { u8::MAX } else { slowest as u8 };
        Some(Self { slowest, fastest: fastest.div_ceil(FASTEST_UNIT) as u8 })
    }

    /// Takes the two bytes of a file, which must be in order; `None` if the file states no speeds.
    pub(super) const fn of_file(slowest: u8, fastest: u8) -> Option<Self> {
        if fastest == 0 { None } else { Some(Self { slowest, fastest }) }
    }

    /// Returns the two bytes of a file: the slowest in 2 mm/s, and the fastest in 4 mm/s.
    pub const fn in_file(self) -> [u8; 2] {
        [self.slowest, self.fastest]
    }

    /// Returns the slowest, in mm/s.
    pub const fn slowest(self) -> u16 {
        self.slowest as u16 * SLOWEST_UNIT
    }

    /// Returns the fastest, in mm/s: at most [`FASTEST`].
    pub const fn fastest(self) -> u16 {
        self.fastest as u16 * FASTEST_UNIT
    }

    /// Returns whether a measured speed in mm/s is one of them, or at most 1/32 beyond.
    pub fn has(self, mm_s: f32) -> bool {
        let (slowest, fastest) = (f32::from(self.slowest()), f32::from(self.fastest()));
        slowest * (1.0 - BEYOND) <= mm_s && mm_s <= fastest * (1.0 + BEYOND)
    }

    /// Returns whether a slide is known to have another speed.
    pub fn exclude(self, velocity: Option<Velocity>) -> bool {
        velocity.is_some_and(|velocity| !self.has(velocity.mm_s))
    }
}

impl fmt::Display for KnownSpeeds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {} mm/s", self.slowest(), self.fastest())
    }
}
