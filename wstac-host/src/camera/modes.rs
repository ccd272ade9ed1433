//! Formats × sizes × frame rates, as far as a driver lists them.

use std::fmt;

use serde::{Serialize, Serializer};
use wstac_core::rate::FrameRate;

use super::formats::{self, FourCc};

/// Frame sizes from `smallest` to `largest` in steps; both are the same if there is one size only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SizeRange {
    /// Least width and height.
    pub smallest: (u32, u32),
    /// Greatest width and height.
    pub largest: (u32, u32),
    /// Pixels from one width, or height, to the next.
    pub step: (u32, u32),
}

impl SizeRange {
    /// Creates a range of one size.
    pub fn one(width: u32, height: u32) -> Self {
        Self { smallest: (width, height), largest: (width, height), step: (1, 1) }
    }

    /// Returns the size of the range that is nearest to `wanted`, rounded down to a step.
    pub fn nearest(self, wanted: (u32, u32)) -> (u32, u32) {
        let side = |wanted: u32, smallest: u32, largest: u32, step: u32| {
            let inside = wanted.min(largest).max(smallest);
            inside - (inside - smallest).checked_rem(step).unwrap_or(0)
        };
        (
            side(wanted.0, self.smallest.0, self.largest.0, self.step.0),
            side(wanted.1, self.smallest.1, self.largest.1, self.step.1),
        )
    }
}

impl fmt::Display for SizeRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ((width, height), (most_width, most_height)) = (self.smallest, self.largest);
        write!(f, "{width}x{height}")?;
        if self.smallest != self.largest {
            write!(f, " to {most_width}x{most_height}")?;
        }
        Ok(())
    }
}

/// Frame rates from `slowest` to `fastest`; both are the same if there is one rate only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct RateRange {
    /// Least rate.
    pub slowest: FrameRate,
    /// Greatest rate.
    pub fastest: FrameRate,
}

impl fmt::Display for RateRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.slowest == self.fastest {
            return f.write_str(&fps(self.fastest));
        }
        write!(f, "{} to {}", fps(self.slowest), fps(self.fastest))
    }
}

/// Frame sizes and the rates at them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Sizes {
    /// The sizes.
    #[serde(flatten)]
    pub range: SizeRange,
    /// The rates. For a range of sizes, they are those at the size nearest to 1280x720 or to the requested one. They
    /// are empty if the driver does not list them.
    pub rates: Vec<RateRange>,
}

/// A format that a device offers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mode {
    /// Four-character code.
    #[serde(serialize_with = "as_text")]
    pub fourcc: FourCc,
    /// The driver's name for it.
    pub description: String,
    /// Whether it is read.
    pub readable: bool,
    /// Sizes and rates; empty if the driver does not list them.
    pub sizes: Vec<Sizes>,
}

/// Returns a rate for a person: `30`, `29.97`, `7.5`.
pub fn fps(rate: FrameRate) -> String {
    let value = rate.per_second();
    let digits = if value < 1.0 { 4 } else { 2 };
    let text = format!("{value:.digits$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn as_text<S: Serializer>(fourcc: &FourCc, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&formats::name(*fourcc))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_written_short() {
        for (rate, text) in [
            ((30, 1), "30"),
            ((30_000, 1001), "29.97"),
            ((15, 2), "7.5"),
            ((10_000_000, 333_333), "30"),
            ((1, 60), "0.0167"),
            ((100, 1), "100"),
            ((1, 1000), "0.001"),
        ] {
            assert_eq!(fps(FrameRate::new(rate.0, rate.1).unwrap()), text);
        }
    }

    #[test]
    fn the_nearest_size_keeps_to_the_steps() {
        let range = SizeRange { smallest: (16, 16), largest: (1920, 1080), step: (32, 2) };
        assert_eq!(range.nearest((1280, 720)), (1264, 720));
        assert_eq!(range.nearest((1, 5000)), (16, 1080));
        assert_eq!(SizeRange::one(640, 480).nearest((1280, 720)), (640, 480));
        // Senseless ranges of a driver do no harm.
        let nonsense = SizeRange { smallest: (9, 9), largest: (2, 2), step: (0, 0) };
        assert_eq!(nonsense.nearest((5, 5)), (9, 9));
    }
}
