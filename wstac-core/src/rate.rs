//! Frame rates, and the number of camera frames per feature frame (SPEC §1, "Feature rate").

use crate::error::ConfigError;
use crate::params::{HIGHEST_SINGLE_FRAME_RATE, NOMINAL_FRAME_RATE};

/// A number of frames per second, as an exact fraction above zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "(u32, u32)", into = "(u32, u32)"))]
pub struct FrameRate {
    numerator: u32,
    denominator: u32,
}

impl FrameRate {
    /// The paper's 30 frames per second.
    pub const NOMINAL: Self = Self { numerator: NOMINAL_FRAME_RATE, denominator: 1 };

    /// Creates a rate of `numerator / denominator` frames per second.
    ///
    /// # Errors
    /// Returns [`ConfigError::FrameRate`] if either is 0.
    pub const fn new(numerator: u32, denominator: u32) -> Result<Self, ConfigError> {
        if numerator == 0 || denominator == 0 {
            return Err(ConfigError::FrameRate { numerator, denominator });
        }
        Ok(Self { numerator, denominator })
    }

    /// Returns the numerator of the fraction.
    pub const fn numerator(self) -> u32 {
        self.numerator
    }

    /// Returns the denominator of the fraction.
    pub const fn denominator(self) -> u32 {
        self.denominator
    }

    /// Returns the rate as the nearest real number.
    ///
    /// ```
    /// use wstac_core::rate::FrameRate;
    /// assert_eq!(FrameRate::new(15, 2)?.per_second(), 7.5);
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub const fn per_second(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    /// Returns the number of consecutive camera frames that are added up to one feature frame.
    ///
    /// It is 1 up to 45 frames per second, and round(fps / 30) above; ties round up.
    ///
    /// ```
    /// use wstac_core::rate::FrameRate;
    /// let frames = |numerator, denominator| FrameRate::new(numerator, denominator).unwrap().frames_added();
    /// assert_eq!([frames(30, 1), frames(45, 1), frames(46, 1)], [1, 1, 2]);
    /// assert_eq!([frames(60_000, 1001), frames(1000, 1)], [2, 33]);
    /// ```
    pub const fn frames_added(self) -> u32 {
        let (n, d) = (self.numerator as u64, self.denominator as u64);
        if n <= HIGHEST_SINGLE_FRAME_RATE as u64 * d {
            return 1;
        }
        let nominal = NOMINAL_FRAME_RATE as u64 * d;
        match (2 * n + nominal).checked_div(2 * nominal) {
            Some(frames) => frames as u32,
            // Not reached: the denominator is above 0.
            None => 1,
        }
    }

    /// Returns how many frames of the nominal 30 per second one feature frame lasts.
    pub const fn nominal_frames(self) -> f32 {
        let added = self.frames_added() as f32;
        added * NOMINAL_FRAME_RATE as f32 * self.denominator as f32 / self.numerator as f32
    }
}

impl TryFrom<(u32, u32)> for FrameRate {
    type Error = ConfigError;
    fn try_from((numerator, denominator): (u32, u32)) -> Result<Self, ConfigError> {
        Self::new(numerator, denominator)
    }
}

impl From<FrameRate> for (u32, u32) {
    fn from(rate: FrameRate) -> Self {
        (rate.numerator, rate.denominator)
    }
}
