//! Bayer mosaics: every site sees one color. The bytes are those of a gray format of the same depth.

use wstac_core::green::any::PixelFormat;
use wstac_core::green::bayer::BayerOrder;

use super::SHARES;

/// The color that a site sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sensor) enum Site {
    Red,
    Green,
    Blue,
}

impl Site {
    /// Returns the light that it gets, as a fraction of that of green.
    pub(in crate::sensor) fn share(self) -> f64 {
        SHARES[self as usize]
    }
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
        cell[(x & 1) + 2 * (y & 1)]
    }
}
