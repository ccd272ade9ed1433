//! The kinds of touches.

use core::fmt;

/// The kind of a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Contact {
    /// Something slides: it arrives at one side and leaves at the other.
    Slide,
    /// Something is pressed on all whiskers at once, or leaves them at once.
    Press,
    /// One or two whiskers of a row and of a column are touched.
    Poke,
    /// None of these, or none for certain.
    Unclear,
}

impl Contact {
    /// Returns its name. JSON output and `Display` use this name.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Slide => "slide",
            Self::Press => "press",
            Self::Poke => "poke",
            Self::Unclear => "unclear",
        }
    }
}

impl fmt::Display for Contact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
