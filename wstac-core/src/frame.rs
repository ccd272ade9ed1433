//! Borrowed rows of pixels: a whole frame, or a stripe of one.

/// Rows of one frame as a camera lays them out, borrowed and unchecked but never out of bounds: what lies outside
/// reads as nothing.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    bytes: &'a [u8],
    bytes_per_row: usize,
    /// Frame row that `bytes` starts with.
    first: u16,
    /// Rows of the whole frame: where a planar format's chroma starts.
    height: u16,
}

impl<'a> Rows<'a> {
    /// The rows of a whole frame of `height` rows, for those who want other sums of a [`GreenChannel`](crate::green::GreenChannel) than taxels'.
    pub fn of_frame(bytes: &'a [u8], bytes_per_row: usize, height: u16) -> Self {
        Self::new(bytes, bytes_per_row, 0, height)
    }

    pub(crate) fn new(bytes: &'a [u8], bytes_per_row: usize, first: u16, height: u16) -> Self {
        Self { bytes, bytes_per_row, first, height }
    }

    /// Bytes of frame row `y`, of a packed format or of a planar format's luma, from byte `start` on.
    #[inline(always)]
    pub fn row(&self, y: u16, start: usize, length: usize) -> &'a [u8] {
        let at = usize::from(y.wrapping_sub(self.first)) * self.bytes_per_row + start;
        self.bytes.get(at..at + length).unwrap_or(&[])
    }

    /// `length` bytes from byte `start` on of `count` frame rows, row `y` the first of them; nothing if not all are there.
    #[inline(always)]
    pub fn block(&self, y: u16, count: u16, start: usize, length: usize) -> Option<Block<'a>> {
        let at = usize::from(y.wrapping_sub(self.first)) * self.bytes_per_row + start;
        Block::new(self.bytes.get(at..)?, self.bytes_per_row, length, usize::from(count))
    }

    /// Bytes of frame row `y` from byte `start` to the row's end.
    #[inline(always)]
    pub fn row_to_end(&self, y: u16, start: usize) -> &'a [u8] {
        self.row(y, start, self.bytes_per_row.saturating_sub(start))
    }

    /// Bytes of a plane that lies `offset` bytes after the luma plane and has `bytes_per_row` bytes a row.
    #[inline(always)]
    pub fn plane_row(&self, offset: usize, bytes_per_row: usize, y: u16, start: usize, length: usize) -> &'a [u8] {
        let at = self.luma_bytes() + offset + usize::from(y) * bytes_per_row + start;
        self.bytes.get(at..at + length).unwrap_or(&[])
    }

    /// The same of rows: `rows` are the first and how many, `bytes` the first byte in each and how many; nothing if not all are there.
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

    /// Bytes of the luma plane.
    pub fn luma_bytes(&self) -> usize {
        self.bytes_per_row * usize::from(self.height)
    }

    /// Bytes from row to row of the luma plane.
    pub fn bytes_per_row(&self) -> usize {
        self.bytes_per_row
    }

    /// Rows of the whole frame.
    pub fn height(&self) -> u16 {
        self.height
    }
}

/// A block of bytes: as many in each of some rows, one below the other. There are as many as it says.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    bytes: &'a [u8],
    bytes_per_row: usize,
    width: usize,
    rows: usize,
}

impl<'a> Block<'a> {
    /// The first `width` bytes of `rows` rows, from each to the next of which it is `bytes_per_row` bytes; nothing if there are not as
    /// many bytes.
    #[inline(always)]
    pub fn new(bytes: &'a [u8], bytes_per_row: usize, width: usize, rows: usize) -> Option<Self> {
        // Small numbers' product is one instruction; a Cortex-M0 has none that tells whether a product overflows.
        let before = match (u16::try_from(rows), u16::try_from(bytes_per_row)) {
            (Ok(rows), Ok(bytes)) => (u32::from(rows.saturating_sub(1)) * u32::from(bytes)) as usize,
            _ => rows.saturating_sub(1).checked_mul(bytes_per_row)?,
        };
        let there = bytes.len().checked_sub(before)? >= width;
        there.then_some(Self { bytes, bytes_per_row, width, rows })
    }

    /// The bytes, from the first row's first one on.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Bytes from row to row.
    pub fn bytes_per_row(&self) -> usize {
        self.bytes_per_row
    }

    /// Bytes in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Row `row` of them; nothing if there are not as many.
    #[cfg(simd)]
    #[inline(always)]
    pub(crate) fn row(self, row: usize) -> &'a [u8] {
        let at = row * self.bytes_per_row;
        self.bytes.get(at..at + self.width).unwrap_or_default()
    }

    /// The rows, each `width` bytes.
    pub fn each_row(self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.rows).map(move |row| {
            let at = row * self.bytes_per_row;
            self.bytes.get(at..at + self.width).unwrap_or_default()
        })
    }
}

/// A run of pixels in one row of one taxel.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Frame row.
    pub y: u16,
    /// First column.
    pub x: u16,
    /// Columns.
    pub width: u16,
    /// Every how many columns one is counted, starting with the first.
    pub stride: Stride,
}

/// Pixel stride s: every s-th row and column of a taxel is counted (of Bayer formats, every s-th cell).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u32", into = "u32"))]
pub enum Stride {
    /// Every pixel.
    #[default]
    One,
    /// Every second row and column: a quarter of the pixels.
    Two,
    /// Every third row and column: a ninth.
    Three,
    /// Every fifth row and column: a twenty-fifth.
    Five,
}

impl Stride {
    /// The stride in pixels (or cells).
    pub const fn get(self) -> u16 {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Three => 3,
            Self::Five => 5,
        }
    }

    /// How many of `length` pixels (or cells) are counted.
    pub const fn counted(self, length: u16) -> u16 {
        length.div_ceil(self.get())
    }
}

impl TryFrom<u32> for Stride {
    type Error = crate::error::Error;
    fn try_from(stride: u32) -> Result<Self, Self::Error> {
        match stride {
            1 => Ok(Self::One),
            2 => Ok(Self::Two),
            3 => Ok(Self::Three),
            5 => Ok(Self::Five),
            other => Err(crate::error::Error::Stride(other)),
        }
    }
}

impl From<Stride> for u32 {
    fn from(stride: Stride) -> Self {
        u32::from(stride.get())
    }
}
