//! Bayer mosaics: every site sees one color. The bytes are those of a gray format of the same depth.

use wstac_core::green::any::PixelFormat;
use wstac_core::green::bayer::BayerOrder;

/// The color that a site sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sensor) enum Site {
    Red,
    Green,
    Blue,
}

/// A mosaic's order of colors.
#[derive(Clone, Copy, Debug)]
pub(in crate::sensor) struct Mosaic(BayerOrder);

impl Mosaic {
    pub(in crate::sensor) fn of(format: PixelFormat) -> Option<Self> {
        match format {
            PixelFormat::Bayer8(order) | PixelFormat::Bayer10(order) | PixelFormat::Bayer12(order) => Some(Self(order)),
            _ => None,
        }
    }

    /// Returns the color that the site in this column and row sees.
    pub(in crate::sensor) fn site(self, x: usize, y: usize) -> Site {
        use Site::{Blue, Green, Red};
        let cell = match self.0 {
            BayerOrder::Rggb => [Red, Green, Green, Blue],
            BayerOrder::Grbg => [Green, Red, Blue, Green],
            BayerOrder::Gbrg => [Green, Blue, Red, Green],
            BayerOrder::Bggr => [Blue, Green, Green, Red],
        };
        let [first, second, third, fourth] = cell;
        match (x & 1, y & 1) {
            (0, 0) => first,
            (_, 0) => second,
            (0, _) => third,
            _ => fourth,
        }
    }
}
