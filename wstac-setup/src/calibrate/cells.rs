//! Converts frames of any pixel format into cells of green: squares of pixels, small against a whisker's spot of light.

use wstac_core::frame::{Rows, Run, Stride};
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::params::TAXELS;
use wstac_core::taxels::FrameGeometry;

use wstac_host::error::Error;
use wstac_host::source::StreamInfo;

/// Smallest number of cells along the shorter side of a frame: a whisker's spot is at least 20 of them wide.
const FINENESS: u16 = 300;

/// The conversion of one stream's frames into cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    camera: FrameGeometry<Any>,
    green: Any,
    /// Pixels of a cell's side: a multiple of a Bayer cell.
    pub(super) side: u16,
    /// Columns and rows of cells; pixels that fill none are left out.
    pub(super) size: [usize; 2],
}

impl Cells {
    /// Creates the conversion for a stream.
    ///
    /// # Errors
    /// The frame's size, format and bytes per row do not fit each other.
    pub(super) fn new(info: &StreamInfo) -> Result<Self, Error> {
        let (width, height) = (info.size.width(), info.size.height());
        let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
        let cell = green.cell();
        let side = (width.min(height) / FINENESS).max(1).next_multiple_of(cell);
        let size = [width / side, height / side].map(usize::from);
        let camera = Layout::new(info.size, [cell; 2], [[0; 2]; TAXELS])
            .and_then(|layout| FrameGeometry::new(green, layout, info.rate))
            .and_then(|camera| camera.with_bytes_per_row(info.bytes_per_row))
            .map_err(|error| Error::config(&info.about, error))?;
        Ok(Self { camera, green, side, size })
    }

    /// Returns the smallest number of bytes in a frame.
    pub(super) fn frame_bytes(&self) -> usize {
        self.camera.frame_bytes()
    }

    /// Computes the mean green of every cell as a fraction of full scale, row by row.
    pub(super) fn read(&self, bytes: &[u8], shares: &mut Vec<f32>) {
        let [columns, rows] = self.size;
        let height = self.camera.layout().frame().height();
        let frame = Rows::of_frame(bytes, self.camera.bytes_per_row(), height);
        // In a mosaic, every row of two pixels has one green site.
        let pixels = u32::from(self.side * self.side / self.green.cell());
        let full = (f64::from(pixels) * f64::from(self.green.full_scale())) as f32;
        shares.clear();
        shares.extend((0..rows * columns).map(|k| {
            let [x, y] = [k % columns, k / columns].map(|at| at as u16 * self.side);
            let mut sum = <Any as GreenChannel>::Sum::default();
            let run = Run { y, x, width: self.side, stride: Stride::One };
            self.green.add_block(&mut sum, &frame, run, self.side);
            self.green.total(&sum, pixels) as f32 / full
        }));
    }

    /// Returns for every cell whether all of its pixels are known.
    pub(super) fn known(&self, info: &StreamInfo) -> Vec<bool> {
        let [columns, rows] = self.size;
        let Some(crop) = info.crop else { return vec![true; columns * rows] };
        let spans = [(crop.at()[0], crop.size().width()), (crop.at()[1], crop.size().height())];
        let is_inside = |(from, length): (u16, u16), cell: usize| {
            let (first, side) = (cell * usize::from(self.side), usize::from(self.side));
            first >= usize::from(from) && first + side <= usize::from(from) + usize::from(length)
        };
        let cells = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        cells.map(|(x, y)| is_inside(spans[0], x) && is_inside(spans[1], y)).collect()
    }

    /// Returns the pixel at a place among cells; whole numbers are the middle of a pixel or cell.
    pub(super) fn pixel(&self, place: [f64; 2]) -> [f64; 2] {
        place.map(|at| at * f64::from(self.side) + (f64::from(self.side) - 1.0) / 2.0)
    }
}
