//! Scales frames of any pixel format down to a small picture in green light.
//!
//! ```
//! use wstac_core::{green::any::PixelFormat, layout::FrameSize, rate::FrameRate};
//! use wstac_host::picture::Sampler;
//! use wstac_host::source::StreamInfo;
//!
//! let info = StreamInfo::new("my camera", FrameSize::new(1280, 720)?, PixelFormat::Gray, FrameRate::NOMINAL);
//! let picture = Sampler::new(&info).picture(&[255; 1280 * 720]);
//! assert_eq!(picture.size, [213, 120]);
//! assert!(picture.light.iter().all(|light| *light == 1.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use wstac_core::frame::{Rows, Run, Stride};
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::FrameSize;

use crate::source::StreamInfo;

/// Largest width and height of a picture, which are enough for a terminal and for a page.
const MOST: [u32; 2] = [240, 160];
/// The number of rows of a block that are read, because light at the bases of whiskers is smooth.
const ROWS: u32 = 4;

/// A frame with few pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels of the picture, each at least 1.
    pub size: [usize; 2],
    /// Green light of each pixel, row by row, as a fraction of full scale.
    pub light: Vec<f32>,
}

/// Makes small pictures of the frames of a stream.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    green: Any,
    size: FrameSize,
    bytes_per_row: usize,
    /// Side of the block that becomes one pixel.
    block: u32,
}

impl Sampler {
    /// Creates a sampler for frames as `info` describes them.
    pub fn new(info: &StreamInfo) -> Self {
        // Linear, because the colors that are shown are coarse anyway.
        let green = Any::new(info.format, info.color, YcbcrMethod::Linear);
        let (width, height) = (u32::from(info.size.width()), u32::from(info.size.height()));
        let block = width.div_ceil(MOST[0]).max(height.div_ceil(MOST[1]));
        // Blocks contain whole cells of subsampled formats.
        let block = if block > 1 || green.cell() > 1 { block.next_multiple_of(2) } else { block };
        Self { green, size: info.size, bytes_per_row: info.bytes_per_row as usize, block }
    }

    /// Returns the picture of a frame. Missing bytes are dark.
    pub fn picture(&self, bytes: &[u8]) -> Picture {
        let rows = Rows::of_frame(bytes, self.bytes_per_row, self.size.height());
        let [width, height] =
            [self.size.width(), self.size.height()].map(|side| (u32::from(side) / self.block).max(1) as usize);
        let light = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let light = light.map(|(x, y)| self.light(&rows, x as u32 * self.block, y as u32 * self.block)).collect();
        Picture { size: [width, height], light }
    }

    /// Returns the mean light of the block at (`x`, `y`).
    fn light(&self, rows: &Rows<'_>, x: u32, y: u32) -> f32 {
        let cell = u32::from(self.green.cell());
        let within = |from: u32, most: u32, side: u16| most.min(u32::from(side) - from) / cell * cell;
        let (width, height) =
            (within(x, self.block, self.size.width()), within(y, ROWS.min(self.block), self.size.height()));
        let counted = width * height / cell;
        let mut sum = Default::default();
        let run = Run { y: y as u16, x: x as u16, width: width as u16, stride: Stride::One };
        self.green.add_block(&mut sum, rows, run, height as u16);
        let full = (self.green.full_scale() * counted).max(1);
        self.green.total(&sum, counted) as f32 / full as f32
    }
}

impl Picture {
    /// Returns the picture in `width` × `height` pixels, each the mean of the pixels that fall into it.
    pub fn scaled(&self, [width, height]: [usize; 2]) -> Vec<f32> {
        let [own_width, own_height] = self.size;
        let range = |at: usize, count: usize, own: usize| {
            let from = at * own / count.max(1);
            from..((at + 1) * own / count.max(1)).max(from + 1).min(own)
        };
        let mean = |x: usize, y: usize| {
            let columns = range(x, width, own_width);
            let rows = range(y, height, own_height);
            let count = (columns.len() * rows.len()).max(1);
            let sum: f32 = rows.flat_map(|row| &self.light[row * own_width..][columns.clone()]).sum();
            sum / count as f32
        };
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::green::any::PixelFormat;
    use wstac_core::rate::FrameRate;

    #[test]
    fn missing_bytes_are_dark() {
        let size = FrameSize::new(1280, 720).unwrap();
        let info = StreamInfo::new("half a frame", size, PixelFormat::Gray, FrameRate::NOMINAL);
        let picture = Sampler::new(&info).picture(&vec![255; 1280 * 100]);
        assert!(picture.light[0] > 0.99 && picture.light.last() == Some(&0.0));
    }

    #[test]
    fn scaled_pictures_have_the_same_mean() {
        let picture = Picture { size: [4, 2], light: vec![0.0, 0.2, 0.4, 0.6, 0.2, 0.4, 0.6, 0.8] };
        for (size, expected) in [([1, 1], vec![0.4]), ([2, 1], vec![0.2, 0.6]), ([1, 2], vec![0.3, 0.5])] {
            let scaled = picture.scaled(size);
            let is_near = scaled.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(is_near && scaled.len() == expected.len(), "{size:?}: {scaled:?}");
        }
    }
}
