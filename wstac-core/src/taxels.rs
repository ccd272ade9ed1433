//! Rows of pixels → 25 taxel sums: exact integers, from whole frames or stripes (SPEC §1).

use core::ops::Range;

use crate::error::{ConfigError, FrameError};
use crate::frame::{Blocks, Rows, Run, Stride};
use crate::green::GreenChannel;
use crate::layout::Layout;
use crate::params::{COLUMNS, ROWS, TAXELS};
use crate::rate::FrameRate;

/// Describes how one camera's frames are summed: format, layout, stride and rate, checked together once.
#[derive(Clone, Copy, Debug)]
pub struct FrameGeometry<G> {
    green: G,
    layout: Layout,
    /// The rows of frames that each row of taxels has ([`bands`]). A stripe skips most of them.
    bands: [[u16; 2]; ROWS],
    stride: Stride,
    bytes_per_row: u32,
    pixels: u32,
    rate: FrameRate,
}

impl<G: GreenChannel> FrameGeometry<G> {
    /// Creates the geometry of this pixel format, layout and rate. Every pixel is counted, and rows have no padding.
    ///
    /// # Errors
    /// Returns [`ConfigError::EmptyTaxel`] if a Bayer format's taxels hold no 2 × 2 cell. Returns
    /// [`ConfigError::SumTooLarge`] if 5 · A · G · (frames added up) exceeds `u32::MAX`.
    pub fn new(green: G, layout: Layout, rate: FrameRate) -> Result<Self, ConfigError> {
        Self::with_stride(green, layout, rate, Stride::One)
    }

    /// Creates the geometry with a pixel stride. A is the number of pixels that it counts.
    ///
    /// # Errors
    /// Returns the errors of [`FrameGeometry::new`].
    pub fn with_stride(green: G, layout: Layout, rate: FrameRate, stride: Stride) -> Result<Self, ConfigError> {
        let layout = layout.snapped(green.cell())?;
        let bytes_per_row = green.row_bytes(layout.frame().width()) as u32;
        let mut camera = Self { green, layout, bands: bands(&layout), stride, bytes_per_row, pixels: 0, rate };
        camera.count_pixels()?;
        Ok(camera)
    }

    /// Returns the geometry with this many bytes from row to row.
    ///
    /// # Errors
    /// Returns [`ConfigError::BytesPerRow`] if that is less than a row of pixels.
    pub fn with_bytes_per_row(mut self, bytes_per_row: u32) -> Result<Self, ConfigError> {
        let expected = self.green.row_bytes(self.layout.frame().width()) as u32;
        if bytes_per_row < expected {
            return Err(ConfigError::BytesPerRow { found: bytes_per_row, expected });
        }
        self.bytes_per_row = bytes_per_row;
        Ok(self)
    }

    /// Counts the pixels of a taxel (A of the SPEC) and checks that five taxels' sums fit 32 bits.
    fn count_pixels(&mut self) -> Result<(), ConfigError> {
        let cell = self.green.cell();
        let [width, height] = self.layout.taxel();
        let cells = u32::from(self.stride.counted(width / cell)) * u32::from(self.stride.counted(height / cell));
        self.pixels = cells * u32::from(cell);
        let (full_scale, frames) = (self.green.full_scale(), self.rate.frames_added());
        // There are at most 2^28 pixels, 2^16 levels and 2^31 frames. 5 · A · G fits 64 bits, but its product with the
        // frames may not.
        let fits = (5 * u64::from(self.pixels) * u64::from(full_scale))
            .checked_mul(u64::from(frames))
            .is_some_and(|most| u32::try_from(most).is_ok());
        if fits { Ok(()) } else { Err(ConfigError::SumTooLarge { pixels: self.pixels, full_scale, frames }) }
    }

    /// Returns the layout as it is used: rounded down to cells for Bayer formats.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the number of pixels counted in a taxel, A.
    pub fn pixels(&self) -> u32 {
        self.pixels
    }

    /// Returns the green full scale of one pixel, G.
    pub fn full_scale(&self) -> u32 {
        self.green.full_scale()
    }

    /// Returns the number of camera frames per second.
    pub fn rate(&self) -> FrameRate {
        self.rate
    }

    /// Returns the number of bytes from row to row.
    pub fn bytes_per_row(&self) -> usize {
        self.bytes_per_row as usize
    }

    /// Returns the least bytes of a whole frame. The last row's padding may be missing.
    pub fn frame_bytes(&self) -> usize {
        self.green.least_frame_bytes(self.layout.frame(), self.bytes_per_row())
    }

    /// Adds the frame rows `y` to the sums of a row of taxels, one taxel after the other.
    // It is not inlined, so that it takes no registers from a kernel for all of them.
    #[inline(never)]
    fn add_one_by_one(&self, sums: &mut [G::Sum; COLUMNS], corners: &[[u16; 2]; COLUMNS], bytes: &[u8], y: Range<u16>) {
        let rows = Rows::new(bytes, self.bytes_per_row(), y.start, self.layout.frame().height());
        let [width, height] = self.layout.taxel();
        let cell_rows = self.green.cell() == 2;
        for (sum, &[x, top]) in sums.iter_mut().zip(corners) {
            let (from, to) = (y.start.max(top), y.end.min(top + height));
            if from >= to {
                continue;
            }
            let run = Run { y: from, x, width, stride: self.stride };
            if self.stride == Stride::One {
                self.green.add_block(sum, &rows, run, to - from);
                continue;
            }
            for y in from..to {
                if ((y - top) >> u16::from(cell_rows)) % self.stride.get() == 0 {
                    self.green.add_run(sum, &rows, Run { y, ..run });
                }
            }
        }
    }

    /// Returns the least bytes of `rows` rows of a packed format.
    fn packed_bytes(&self, rows: usize) -> usize {
        self.green.packed_bytes(self.layout.frame().width(), rows, self.bytes_per_row())
    }
}

/// Returns the first frame row and the one behind the last, for each row of taxels. The first is at most that of the
/// next row of taxels, so that a stripe that ends above it has nothing of any later one.
fn bands(layout: &Layout) -> [[u16; 2]; ROWS] {
    let [_, height] = layout.taxel();
    let mut bands = [[u16::MAX, 0]; ROWS];
    for (band, corners) in bands.iter_mut().zip(layout.corners().as_chunks::<COLUMNS>().0) {
        for [_, top] in corners {
            *band = [band[0].min(*top), band[1].max(top + height)];
        }
    }
    let mut highest = u16::MAX;
    for [top, _] in bands.iter_mut().rev() {
        highest = highest.min(*top);
        *top = highest;
    }
    bands
}

/// Sums the 25 taxels of one camera's frames, and keeps track of how far the present frame has come.
#[derive(Clone, Debug)]
pub struct TaxelSums<G: GreenChannel> {
    camera: FrameGeometry<G>,
    /// The sums of a complete frame stay here until the next frame's first row.
    sums: [G::Sum; TAXELS],
    /// Rows of the frame under way that have arrived.
    rows: u16,
    is_complete: bool,
}

impl<G: GreenChannel> TaxelSums<G> {
    /// Creates empty sums.
    pub fn new(camera: FrameGeometry<G>) -> Self {
        Self { camera, sums: [G::Sum::default(); TAXELS], rows: 0, is_complete: false }
    }

    /// Returns the geometry of the frames that are summed.
    pub fn camera(&self) -> &FrameGeometry<G> {
        &self.camera
    }

    /// Sums a whole frame. Returns the 25 taxel sums S, row by row.
    ///
    /// # Errors
    /// Returns [`FrameError::FrameTooShort`] or [`FrameError::FrameUnderWay`]; then the sums stay as they were.
    pub fn push_frame(&mut self, bytes: &[u8]) -> Result<[u32; TAXELS], FrameError> {
        let expected = self.camera.frame_bytes();
        if bytes.len() < expected {
            return Err(FrameError::FrameTooShort { found: bytes.len(), expected });
        }
        if self.rows != 0 {
            return Err(FrameError::FrameUnderWay { rows: self.rows });
        }
        self.add_rows(bytes, self.camera.layout.frame().height());
        Ok(self.complete())
    }

    /// Adds the next rows of a frame. Returns the 25 taxel sums when the last row has arrived.
    ///
    /// The sums are bit-identical to those of the whole frame.
    ///
    /// # Errors
    /// Returns [`FrameError::StripeNotWholeRows`], [`FrameError::StripeTooLong`] or [`FrameError::StripeOfPlanar`];
    /// then the sums stay as they were.
    // It is not inlined, so that it is there once.
    #[inline(never)]
    pub fn push_stripe(&mut self, bytes: &[u8]) -> Result<Option<[u32; TAXELS]>, FrameError> {
        let camera = &self.camera;
        let (height, bytes_per_row) = (camera.layout.frame().height(), camera.bytes_per_row());
        if camera.green.chroma_bytes(bytes_per_row, height).is_some() {
            return Err(FrameError::StripeOfPlanar);
        }
        let rows = bytes.len().div_ceil(bytes_per_row.max(1));
        if bytes.len() < camera.packed_bytes(rows) {
            return Err(FrameError::StripeNotWholeRows { found: bytes.len(), bytes_per_row });
        }
        let left = height - self.rows;
        if rows > usize::from(left) {
            return Err(FrameError::StripeTooLong { found: rows, left: usize::from(left) });
        }
        self.add_rows(bytes, rows as u16);
        // Most stripes do not end a frame, and have no sums to copy.
        if self.rows < height {
            return Ok(None);
        }
        Ok(Some(self.complete()))
    }

    /// Returns whether so many bytes are the rest of the frame, or more.
    pub(crate) fn is_completed_by(&self, bytes: &[u8]) -> bool {
        bytes.len().div_ceil(self.camera.bytes_per_row().max(1))
            >= usize::from(self.camera.layout.frame().height() - self.rows)
    }

    /// Returns the taxel sums of the last frame, until the first row of the next one arrives. Returns `None` before the
    /// first frame and after [`TaxelSums::abandon_frame`].
    pub fn taxels(&self) -> Option<[u32; TAXELS]> {
        self.is_complete.then(|| self.totals())
    }

    /// Forgets the rows of a frame whose rest will not arrive.
    pub fn abandon_frame(&mut self) {
        self.rows = 0;
        self.is_complete = false;
    }

    /// Forgets the rows of a frame under way. The sums of a complete frame stay.
    pub(crate) fn abandon_rows(&mut self) {
        self.rows = 0;
    }

    /// Forgets the sums of a complete frame. The rows of a frame under way stay.
    pub(crate) fn forget_taxels(&mut self) {
        self.is_complete = false;
    }

    /// Adds the frame's next `count` rows to the taxels that they cross.
    // It is not inlined, so that its cost does not depend on what else a program links.
    #[inline(never)]
    fn add_rows(&mut self, bytes: &[u8], count: u16) {
        if self.rows == 0 {
            if count == 0 {
                return;
            }
            self.sums = [G::Sum::default(); TAXELS];
            self.is_complete = false;
        }
        let camera = &self.camera;
        let frame_rows = camera.layout.frame().height();
        let (first, end) = (self.rows, self.rows + count);
        // Most stripes skip four bands of five: words are compared faster than parts of words.
        let (before, behind) = (u32::from(first), u32::from(end));
        let every_pixel = camera.stride == Stride::One;
        let height = camera.layout.taxel()[1];
        let (sums, corners) =
            (self.sums.as_chunks_mut::<COLUMNS>().0, camera.layout.corners().as_chunks::<COLUMNS>().0);
        for ((sums, corners), &[top, bottom]) in sums.iter_mut().zip(corners).zip(&camera.bands) {
            // No later band begins higher.
            if u32::from(top) >= behind {
                break;
            }
            if u32::from(bottom) <= before {
                continue;
            }
            // Taxels side by side share their rows if they are on a grid.
            let rows = Rows::new(bytes, camera.bytes_per_row(), first, frame_rows);
            let y = first.max(top)..end.min(bottom);
            if every_pixel
                && bottom - top == height
                && camera.green.add_blocks(sums, Blocks::new(rows, corners, &camera.layout, y))
            {
                continue;
            }
            camera.add_one_by_one(sums, corners, bytes, first..end);
        }
        self.rows = end;
    }

    /// Ends the frame whose last row has arrived. Returns its taxel sums.
    fn complete(&mut self) -> [u32; TAXELS] {
        self.rows = 0;
        self.is_complete = true;
        self.totals()
    }

    /// Returns the taxel sums of the complete frame.
    fn totals(&self) -> [u32; TAXELS] {
        let mut totals = [0; TAXELS];
        for (total, sum) in totals.iter_mut().zip(&self.sums) {
            *total = self.camera.green.total(sum, self.camera.pixels);
        }
        totals
    }
}
