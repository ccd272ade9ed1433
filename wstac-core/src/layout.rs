//! The positions of the 25 taxels in a frame (SPEC §1).

use crate::error::ConfigError;
use crate::params::{
    COLUMNS, LARGEST_FRAME_SIDE, PAPER_FIRST_CORNER, PAPER_IMAGE_SIDE, PAPER_PITCH, PAPER_TAXEL_SIDE, TAXELS,
};

/// The width and height of a frame, each 1..=16384 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "(u32, u32)", into = "(u32, u32)"))]
pub struct FrameSize {
    width: u16,
    height: u16,
}

impl FrameSize {
    /// Creates the size of a frame of `width` × `height` pixels.
    ///
    /// # Errors
    /// Returns [`ConfigError::FrameSize`] if a side is 0 or above 16384.
    pub const fn new(width: u32, height: u32) -> Result<Self, ConfigError> {
        if width == 0 || height == 0 || width > LARGEST_FRAME_SIDE || height > LARGEST_FRAME_SIDE {
            return Err(ConfigError::FrameSize { width, height });
        }
        Ok(Self { width: width as u16, height: height as u16 })
    }

    /// Returns the width in pixels.
    pub const fn width(self) -> u16 {
        self.width
    }

    /// Returns the height in pixels.
    pub const fn height(self) -> u16 {
        self.height
    }
}

impl TryFrom<(u32, u32)> for FrameSize {
    type Error = ConfigError;
    fn try_from((width, height): (u32, u32)) -> Result<Self, ConfigError> {
        Self::new(width, height)
    }
}

impl From<FrameSize> for (u32, u32) {
    fn from(size: FrameSize) -> Self {
        (u32::from(size.width), u32::from(size.height))
    }
}

/// One taxel size and 25 corners, with all taxels inside one frame size.
///
/// Taxels may overlap and may be as large as the frame.
///
/// ```
/// use wstac_core::layout::{FrameSize, Layout};
/// let layout = Layout::paper(FrameSize::new(1280, 720)?)?;
/// assert_eq!(layout.taxel(), [90, 90]);
/// assert_eq!(layout.corners()[0], [280 + 27, 27]);
/// assert_eq!(layout.corners()[24], [280 + 27 + 4 * 144, 27 + 4 * 144]);
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "LayoutFields"))]
pub struct Layout {
    frame: FrameSize,
    taxel: [u16; 2],
    corners: [[u16; 2]; TAXELS],
}

/// The parts of a layout before they are checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct LayoutFields {
    frame: FrameSize,
    taxel: [u16; 2],
    corners: [[u16; 2]; TAXELS],
}

#[cfg(feature = "serde")]
impl TryFrom<LayoutFields> for Layout {
    type Error = ConfigError;
    fn try_from(fields: LayoutFields) -> Result<Self, ConfigError> {
        Self::new(fields.frame, fields.taxel, fields.corners)
    }
}

impl Layout {
    /// Creates a layout from its parts: `taxel` is width and height, `corners` are left and top, row by row.
    ///
    /// # Errors
    /// Returns [`ConfigError::EmptyTaxel`] if a side is 0, and [`ConfigError::TaxelOutside`] for the first taxel that
    /// leaves the frame.
    pub const fn new(frame: FrameSize, taxel: [u16; 2], corners: [[u16; 2]; TAXELS]) -> Result<Self, ConfigError> {
        let [width, height] = [taxel[0] as u32, taxel[1] as u32];
        if width == 0 || height == 0 {
            return Err(ConfigError::EmptyTaxel { width, height });
        }
        let mut k = 0;
        while k < TAXELS {
            let end = (corners[k][0] as u32 + width, corners[k][1] as u32 + height);
            if end.0 > frame.width as u32 || end.1 > frame.height as u32 {
                return Err(ConfigError::TaxelOutside { taxel: k as u8, end, frame: (frame.width, frame.height) });
            }
            k += 1;
        }
        Ok(Self { frame, taxel, corners })
    }

    /// Creates the paper's layout in the centered largest square of a frame.
    ///
    /// In a 400 × 400 image, taxels of 50 px have a pitch of 80 px, the first at (15, 15). Each number is scaled and
    /// rounded to the nearest pixel; ties round up.
    ///
    /// # Errors
    /// Returns [`ConfigError::EmptyTaxel`] if the square has fewer than 4 pixels per side.
    pub const fn paper(frame: FrameSize) -> Result<Self, ConfigError> {
        let (width, height) = (frame.width as u32, frame.height as u32);
        let side = if width < height { width } else { height };
        let taxel = nearest(PAPER_TAXEL_SIDE * side, PAPER_IMAGE_SIDE) as u16;
        let mut corners = [[0; 2]; TAXELS];
        let mut k = 0;
        while k < TAXELS {
            corners[k] = [
                paper_corner(width - side, side, (k % COLUMNS) as u32),
                paper_corner(height - side, side, (k / COLUMNS) as u32),
            ];
            k += 1;
        }
        Self::new(frame, [taxel, taxel], corners)
    }

    /// Returns the frame size that the layout was checked against.
    pub const fn frame(&self) -> FrameSize {
        self.frame
    }

    /// Returns the width and height of every taxel, in pixels.
    pub const fn taxel(&self) -> [u16; 2] {
        self.taxel
    }

    /// Returns the left and top of each taxel, row by row, in pixels.
    pub const fn corners(&self) -> &[[u16; 2]; TAXELS] {
        &self.corners
    }

    /// Returns the layout with corners and sizes rounded down to multiples of `cell` pixels (a power of two).
    ///
    /// # Errors
    /// Returns [`ConfigError::EmptyTaxel`] if a taxel is smaller than a cell.
    pub(crate) fn snapped(mut self, cell: u16) -> Result<Self, ConfigError> {
        let mask = !(cell - 1);
        let [width, height] = self.taxel;
        self.taxel = [width & mask, height & mask];
        for corner in &mut self.corners {
            *corner = [corner[0] & mask, corner[1] & mask];
        }
        if self.taxel[0] == 0 || self.taxel[1] == 0 {
            return Err(ConfigError::EmptyTaxel { width: u32::from(width), height: u32::from(height) });
        }
        Ok(self)
    }
}

/// Returns the left of column `k` (or the top of row `k`) if `spare` pixels lie outside the centered square of `side`.
const fn paper_corner(spare: u32, side: u32, k: u32) -> u16 {
    let half = PAPER_IMAGE_SIDE / 2;
    nearest(spare * half + (PAPER_FIRST_CORNER + k * PAPER_PITCH) * side, PAPER_IMAGE_SIDE) as u16
}

/// Returns `numerator / denominator` rounded to the nearest integer; ties round up.
const fn nearest(numerator: u32, denominator: u32) -> u32 {
    (numerator + denominator / 2) / denominator
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_layout_fits_every_square_of_at_least_four_pixels() {
        for side in 1..=2000 {
            for spare in [0, 1, 560] {
                let layout = Layout::paper(FrameSize::new(side + spare, side).unwrap());
                assert_eq!(layout.is_ok(), side >= 4, "side {side}, {spare} px wider");
            }
        }
        Layout::paper(FrameSize::new(LARGEST_FRAME_SIDE, LARGEST_FRAME_SIDE).unwrap()).unwrap();
    }

    #[test]
    fn a_taxel_that_leaves_the_frame_is_named() {
        let mut corners = [[0, 0]; TAXELS];
        corners[7] = [6, 0];
        let error = Layout::new(FrameSize::new(10, 10).unwrap(), [5, 5], corners).unwrap_err();
        assert_eq!(error, ConfigError::TaxelOutside { taxel: 7, end: (11, 5), frame: (10, 10) });
    }
}
