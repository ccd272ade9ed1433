//! Turns pixel values into the bytes of one pixel format. A format is an [`Encoder`] in a file and a line of
//! [`encoder`].

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
use self::words::Words;
use self::ycbcr::Conversion;
use super::format::SensorFormat;

/// Light of red, green and blue as fractions of that of green (a guess).
///
/// ZnS:Cu shines at about 520 nm, and a camera's red and blue filters let some of that through.
pub(super) const SHARES: [f64; 3] = [0.25, 1.0, 0.3];

/// Pixels in rows, of one color or of three.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<'a> {
    /// First column: a multiple of the encoder's cell.
    pub(super) left: usize,
    /// First row: a multiple of the encoder's cell.
    pub(super) top: usize,
    /// Number of columns, a multiple of the encoder's cell. The last column and the last row may be outside of the
    /// frame.
    pub(super) width: usize,
    /// Red, green and blue values of 0..=G, row by row; for encoders of one color, only green ones.
    pub(super) colors: [&'a [u16]; 3],
}

impl<'a> Block<'a> {
    /// Iterates over the rows of a color and their numbers in the frame.
    fn rows(&self, color: usize) -> impl Iterator<Item = (usize, &'a [u16])> {
        let values = self.colors.get(color).copied().unwrap_or_default();
        (self.top..).zip(values.chunks_exact(self.width.max(1)))
    }

    /// Iterates over the pixels of the only row, as red, green and blue.
    fn pixels(&self) -> impl Iterator<Item = [u16; 3]> {
        let [red, green, blue] = self.colors;
        red.iter().zip(green).zip(blue).map(|((&red, &green), &blue)| [red, green, blue])
    }
}

/// The bytes of a frame and their arrangement.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// All bytes; planar formats have luma first.
    pub(super) bytes: Vec<u8>,
    /// Bytes from row to row; for planar formats, of luma.
    pub(super) bytes_per_row: usize,
    /// Number of rows.
    pub(super) height: usize,
}

impl Frame {
    /// Returns up to `length` bytes of row `y` from `start` on: fewer at the row's end, none below the last row.
    fn row(&mut self, y: usize, start: usize, length: usize) -> &mut [u8] {
        let end = if y < self.height { (start + length).min(self.bytes_per_row) } else { start };
        let at = y * self.bytes_per_row;
        self.bytes.get_mut(at + start..at + end).unwrap_or_default()
    }

    /// Returns a row of a plane that starts `offset` bytes after luma and has `bytes_per_row` bytes in each row.
    fn plane_row(&mut self, offset: usize, bytes_per_row: usize, y: usize, start: usize, length: usize) -> &mut [u8] {
        let at = self.bytes_per_row * self.height + offset + y * bytes_per_row;
        let end = (start + length).min(bytes_per_row);
        self.bytes.get_mut(at + start..at + end).unwrap_or_default()
    }
}

/// The conversion of a pixel format from values to bytes.
pub(super) trait Encoder: Debug + Send + Sync {
    /// Returns `true` if it needs red and blue in addition to green.
    fn is_colored(&self) -> bool {
        true
    }

    /// Returns the columns and rows of a cell: the pixels that share bytes. Blocks consist of cells.
    fn cell(&self) -> [usize; 2] {
        [1, 1]
    }

    /// Writes a block whose height is that of a cell.
    fn encode(&self, block: &Block<'_>, frame: &mut Frame);
}

/// Returns the encoder of a format, or `None` if there is none; JPEG pictures are made from R G B.
pub(super) fn encoder(format: SensorFormat, color: YcbcrEncoding) -> Option<Arc<dyn Encoder>> {
    let conversion = Conversion::new(color);
    Some(match format.pixels() {
        PixelFormat::Gray | PixelFormat::Bayer8(_) => Arc::new(Words::<1>),
        PixelFormat::Y10 | PixelFormat::Y12 | PixelFormat::Y16 | PixelFormat::Bayer10(_) | PixelFormat::Bayer12(_) => {
            Arc::new(Words::<2>)
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
        _ => return None,
    })
}

#[cfg(test)]
mod tests;
