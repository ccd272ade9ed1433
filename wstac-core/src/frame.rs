//! Borrowed rows of pixels: a whole frame, or a stripe of one.

use core::ops::Range;

use crate::layout::Layout;
use crate::params::COLUMNS;

/// Borrows rows of one frame as a camera lays them out.
///
/// The number of bytes is not checked. Access out of bounds returns an empty slice.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    bytes: &'a [u8],
    bytes_per_row: usize,
    /// Frame row that `bytes` starts with.
    first: u16,
    /// Rows of the whole frame, behind which a planar format's chroma starts.
    height: u16,
}

impl<'a> Rows<'a> {
    /// Creates the rows of a whole frame of `height` rows.
    ///
    /// It is for programs that want other sums of a [`GreenChannel`](crate::green::GreenChannel) than those of taxels.
    pub fn of_frame(bytes: &'a [u8], bytes_per_row: usize, height: u16) -> Self {
        Self::new(bytes, bytes_per_row, 0, height)
    }

    pub(crate) fn new(bytes: &'a [u8], bytes_per_row: usize, first: u16, height: u16) -> Self {
        Self { bytes, bytes_per_row, first, height }
    }

    /// Returns `length` bytes of frame row `y` from byte `start` on. In a planar format it is a row of the luma plane.
    #[inline(always)]
    pub fn row(&self, y: u16, start: usize, length: usize) -> &'a [u8] {
        let at = usize::from(y.wrapping_sub(self.first)) * self.bytes_per_row + start;
        self.bytes.get(at..at + length).unwrap_or(&[])
    }

    /// Returns `length` bytes from byte `start` on of each of `count` frame rows from row `y` on. Returns `None` if any
    /// of them are missing.
    #[inline(always)]
    pub fn block(&self, y: u16, count: u16, start: usize, length: usize) -> Option<Block<'a>> {
        let at = usize::from(y.wrapping_sub(self.first)) * self.bytes_per_row + start;
        Block::new(self.bytes.get(at..)?, self.bytes_per_row, length, usize::from(count))
    }

    /// Returns the bytes of frame row `y` from byte `start` to the row's end.
    #[inline(always)]
    pub fn row_to_end(&self, y: u16, start: usize) -> &'a [u8] {
        self.row(y, start, self.bytes_per_row.saturating_sub(start))
    }

    /// Returns bytes of a plane that lies `offset` bytes after the luma plane and has `bytes_per_row` bytes per row.
    #[inline(always)]
    pub fn plane_row(&self, offset: usize, bytes_per_row: usize, y: u16, start: usize, length: usize) -> &'a [u8] {
        let at = self.luma_bytes() + offset + usize::from(y) * bytes_per_row + start;
        self.bytes.get(at..at + length).unwrap_or(&[])
    }

    /// Returns a block of rows of a plane that lies `offset` bytes after the luma plane; `None` if any of them are
    /// missing.
    ///
    /// `rows` is the first row and the number of rows. `bytes` is the first byte in each row and the number of bytes.
    #[cfg(simd)]
    #[inline(always)]
    pub(crate) fn plane_block(
        &self,
        offset: usize,
        bytes_per_row: usize,
        rows: (u16, u16),
        bytes: (usize, usize),
    ) -> Option<Block<'a>> {
        let at = self.luma_bytes() + offset + usize::from(rows.0) * bytes_per_row + bytes.0;
        Block::new(self.bytes.get(at..)?, bytes_per_row, bytes.1, usize::from(rows.1))
    }

    /// Returns the number of bytes of the luma plane.
    pub fn luma_bytes(&self) -> usize {
        self.bytes_per_row * usize::from(self.height)
    }

    /// Returns the number of bytes from row to row of the luma plane.
    pub fn bytes_per_row(&self) -> usize {
        self.bytes_per_row
    }

    /// Returns the number of rows of the whole frame.
    pub fn height(&self) -> u16 {
        self.height
    }
}

/// A block of bytes: equally many in each of some rows, one below the other. No byte is missing.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    bytes: &'a [u8],
    bytes_per_row: usize,
    width: usize,
    rows: usize,
}

impl<'a> Block<'a> {
    /// Creates a block of the first `width` bytes of `rows` rows that are `bytes_per_row` bytes apart. Returns `None`
    /// if there are not enough bytes.
    #[inline(always)]
    pub fn new(bytes: &'a [u8], bytes_per_row: usize, width: usize, rows: usize) -> Option<Self> {
        // The product of small numbers is one instruction. A Cortex-M0 has no instruction that detects the overflow of
        // a product.
        let before = match (u16::try_from(rows), u16::try_from(bytes_per_row)) {
            (Ok(rows), Ok(bytes)) => (u32::from(rows.saturating_sub(1)) * u32::from(bytes)) as usize,
            _ => rows.saturating_sub(1).checked_mul(bytes_per_row)?,
        };
        let there = bytes.len().checked_sub(before)? >= width;
        there.then_some(Self { bytes, bytes_per_row, width, rows })
    }

    /// Returns the bytes from the first row's first byte on.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Returns the number of bytes from row to row.
    pub fn bytes_per_row(&self) -> usize {
        self.bytes_per_row
    }

    /// Returns the number of bytes in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the bytes of row `row`; an empty slice if there are not as many rows.
    #[inline(always)]
    pub(crate) fn row(self, row: usize) -> &'a [u8] {
        let at = row * self.bytes_per_row;
        self.bytes.get(at..at + self.width).unwrap_or_default()
    }

    /// Returns the rows, `width` bytes each.
    pub fn each_row(self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.rows).map(move |row| self.row(row))
    }
}

/// The blocks of taxels side by side: the same rows of each, and a column of its own that it begins with. They count
/// every pixel.
#[derive(Clone, Debug)]
#[cfg_attr(not(dsp), expect(dead_code, reason = "only a Cortex-M4 or M7 has a kernel for them"))]
pub struct Blocks<'a> {
    rows: Rows<'a>,
    corners: &'a [[u16; 2]; COLUMNS],
    layout: &'a Layout,
    y: Range<u16>,
}

impl<'a> Blocks<'a> {
    /// Creates the blocks of taxels of the layout, whose corners are a row of it. They have the frame rows `y`.
    #[inline(always)]
    pub(crate) fn new(rows: Rows<'a>, corners: &'a [[u16; 2]; COLUMNS], layout: &'a Layout, y: Range<u16>) -> Self {
        Self { rows, corners, layout, y }
    }

    /// Returns the rows of a frame of one byte per pixel as one block of less than 2^16 bytes a row, with the corners
    /// of its taxels and their width. Returns `None` if any bytes are missing.
    ///
    /// A taxel of a layout does not leave its frame, so all blocks lie in that block.
    #[cfg(dsp)]
    #[inline(always)]
    pub(crate) fn of_bytes(&self) -> Option<(Block<'a>, &'a [[u16; 2]; COLUMNS], usize)> {
        let Rows { bytes, bytes_per_row, first, .. } = self.rows;
        let (width, row) = (usize::from(self.layout.frame().width()), u16::try_from(bytes_per_row).ok()?);
        // Products of 16-bit numbers, and one more of them, fit 32 bits.
        let at = |rows: u16| (u32::from(rows) * u32::from(row)) as usize;
        let (from, count) = (self.y.start.wrapping_sub(first), self.y.end.wrapping_sub(self.y.start));
        let (bytes, before) = (bytes.get(at(from)..)?, at(count.wrapping_sub(1)));
        if count == 0 || bytes.len() < before + width {
            return None;
        }
        let block = Block { bytes, bytes_per_row, width, rows: usize::from(count) };
        Some((block, self.corners, usize::from(self.layout.taxel()[0])))
    }
}

/// A run of pixels in one row of one taxel.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// The frame row.
    pub y: u16,
    /// The first column.
    pub x: u16,
    /// The number of columns.
    pub width: u16,
    /// The stride: every s-th column is counted, starting with the first.
    pub stride: Stride,
}

/// The pixel stride s: every s-th row and column of a taxel is counted (for Bayer formats, every s-th cell).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u32", into = "u32"))]
pub enum Stride {
    /// Counts every pixel.
    #[default]
    One = 1,
    /// Counts every second row and column: a quarter of the pixels.
    Two = 2,
    /// Counts every third row and column: a ninth of the pixels.
    Three = 3,
    /// Counts every fifth row and column: a twenty-fifth of the pixels.
    Five = 5,
}

impl Stride {
    /// Returns the stride in pixels (or cells).
    pub const fn get(self) -> u16 {
        self as u16
    }

    /// Returns how many of `length` pixels (or cells) are counted.
    pub const fn counted(self, length: u16) -> u16 {
        length.div_ceil(self.get())
    }
}

impl TryFrom<u32> for Stride {
    type Error = crate::error::ConfigError;
    fn try_from(stride: u32) -> Result<Self, Self::Error> {
        match stride {
            1 => Ok(Self::One),
            2 => Ok(Self::Two),
            3 => Ok(Self::Three),
            5 => Ok(Self::Five),
            other => Err(crate::error::ConfigError::Stride(other)),
        }
    }
}

impl From<Stride> for u32 {
    fn from(stride: Stride) -> Self {
        u32::from(stride.get())
    }
}
