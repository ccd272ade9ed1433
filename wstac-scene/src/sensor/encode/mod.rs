//! Values of pixels → the bytes of one pixel format. A format is an [`Encoder`] in a file and a line of [`encoder`].

mod bayer;
mod packed_rgb;
mod packed_ycbcr;
mod planar_ycbcr;
mod rgb565;
mod words;
mod ycbcr;

use std::fmt::Debug;
use std::sync::Arc;

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::YcbcrEncoding;

pub(super) use self::bayer::{Mosaic, Site};
use self::packed_rgb::PackedRgb;
use self::packed_ycbcr::PackedPairs;
use self::planar_ycbcr::{Chroma, Planar};
pub(super) use self::rgb565::{GREEN_LEVELS, green_level, nearest_green};
use self::words::{Bytes, Words};
use self::ycbcr::Conversion;
use super::format::SensorFormat;

/// Pixels in rows, of one color or of three.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<'a> {
    /// First column: a multiple of the encoder's cell.
    pub(super) left: usize,
    /// First row, likewise.
    pub(super) top: usize,
    /// Columns, likewise: the last of them may be outside of the frame, and so may the last row.
    pub(super) width: usize,
    /// Red, green and blue values of 0..=G, row by row; of encoders for one color, only green ones.
    pub(super) colors: [&'a [u16]; 3],
}

impl<'a> Block<'a> {
    /// The rows of a color and their numbers in the frame.
    fn rows(&self, color: usize) -> impl Iterator<Item = (usize, &'a [u16])> {
        let values = self.colors.get(color).copied().unwrap_or_default();
        (self.top..).zip(values.chunks_exact(self.width.max(1)))
    }

    /// Pixels of the only row, as red, green and blue.
    fn pixels(&self) -> impl Iterator<Item = [u16; 3]> {
        let [red, green, blue] = self.colors;
        red.iter().zip(green).zip(blue).map(|((&red, &green), &blue)| [red, green, blue])
    }
}

/// A frame's bytes and how they lie.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// All bytes; of planar formats luma first.
    pub(super) bytes: Vec<u8>,
    /// Bytes from row to row, of luma.
    pub(super) bytes_per_row: usize,
    /// Rows.
    pub(super) height: usize,
}

impl Frame {
    /// Bytes of row `y` from `start` on, up to `length` of them: fewer at the row's end, none below the last row.
    fn row(&mut self, y: usize, start: usize, length: usize) -> &mut [u8] {
        let end = if y < self.height { (start + length).min(self.bytes_per_row) } else { start };
        let at = y * self.bytes_per_row;
        self.bytes.get_mut(at + start..at + end).unwrap_or_default()
    }

    /// Bytes of a plane after luma that starts `offset` bytes after it and has `bytes_per_row` bytes a row.
    fn plane_row(&mut self, offset: usize, bytes_per_row: usize, y: usize, start: usize, length: usize) -> &mut [u8] {
        let at = self.bytes_per_row * self.height + offset + y * bytes_per_row;
        let end = (start + length).min(bytes_per_row);
        self.bytes.get_mut(at + start..at + end).unwrap_or_default()
    }
}

/// A pixel format's way from values to bytes.
pub(super) trait Encoder: Debug + Send + Sync {
    /// Whether it needs red and blue beside green.
    fn is_colored(&self) -> bool;

    /// Columns and rows of the cells that blocks consist of: of pixels that share bytes.
    fn cell(&self) -> [usize; 2] {
        [1, 1]
    }

    /// Writes a block that is as many rows high as a cell.
    fn encode(&self, block: &Block<'_>, frame: &mut Frame);
}

/// The encoder of a format; JPEG pictures are made from R G B.
pub(super) fn encoder(format: SensorFormat, color: YcbcrEncoding) -> Arc<dyn Encoder> {
    let conversion = Conversion::new(color);
    match format.pixels() {
        PixelFormat::Gray | PixelFormat::Bayer8(_) => Arc::new(Bytes),
        PixelFormat::Y10 | PixelFormat::Y12 | PixelFormat::Y16 | PixelFormat::Bayer10(_) | PixelFormat::Bayer12(_) => {
            Arc::new(Words)
        }
        PixelFormat::Rgb24 => Arc::new(PackedRgb::<3>::RGB),
        PixelFormat::Bgr24 => Arc::new(PackedRgb::<3>::BGR),
        PixelFormat::Rgbx32 | PixelFormat::Xrgb32 => Arc::new(PackedRgb::<4>::of(format.code())),
        PixelFormat::Rgb565 => Arc::new(rgb565::Rgb565),
        PixelFormat::Yuyv => Arc::new(PackedPairs::<0>(conversion)),
        PixelFormat::Uyvy => Arc::new(PackedPairs::<1>(conversion)),
        PixelFormat::Nv12 => Arc::new(Planar { conversion, chroma: Chroma::Interleaved }),
        PixelFormat::Yu12 => Arc::new(Planar { conversion, chroma: Chroma::Quarter }),
        PixelFormat::Yuv422p => Arc::new(Planar { conversion, chroma: Chroma::Half }),
        PixelFormat::Yuv444p => Arc::new(Planar { conversion, chroma: Chroma::Full }),
    }
}

#[cfg(test)]
mod tests;
