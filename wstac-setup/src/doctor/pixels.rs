//! Single pixels on an even grid over the frame: their noise, the darkest of them, and those at either end of the
//! scale.
//!
//! Their green is the core's, bit for bit, in any format. Each is a taxel of one pixel (of a Bayer mosaic: one cell,
//! two green sites), and 25 of them are a layout.

use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::params::{COLUMNS, ROWS, TAXELS};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{FrameGeometry, TaxelSums};

use wstac_host::error::Error;
use wstac_host::source::StreamInfo;

/// Pixels of the grid in either direction: 10 000 in all, if the frame has as many.
const SIDE: u16 = 100;
/// Fraction of pixels that are taken for dark: few enough to lie in shadow, enough for a mean.
const DARKEST: f64 = 0.01;

/// The statistics of single pixels, in gray levels of 255 and fractions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixels {
    /// Temporal noise of a pixel inside a taxel, rms; of all pixels if none is inside.
    pub noise: f64,
    /// Mean of the darkest 1 % of pixels.
    ///
    /// Every other frame selects them, and the remaining frames give their mean. So noise that makes a pixel look dark
    /// is not counted as black.
    pub darkest: f64,
    /// Fraction of pixels at full scale, over all frames.
    pub saturated: f64,
    /// Fraction of pixels that were 0 in every frame.
    pub clipped: f64,
}

/// One pixel over time, in sums of its cell.
#[derive(Clone, Copy, Debug, Default)]
struct History {
    inside: bool,
    last: u32,
    /// Sums of the first, third … frame, and sums of the others.
    sums: [u64; 2],
    squared_steps: f64,
    saturated: u64,
    brightest: u32,
}

/// The grid.
#[derive(Clone, Debug)]
pub struct PixelGrid {
    groups: Vec<(TaxelSums<Any>, [History; TAXELS])>,
    frames: u64,
    steps: u64,
}

impl PixelGrid {
    /// Creates a grid over frames that `info` describes; `taxels` selects the pixels inside of taxels.
    ///
    /// # Errors
    /// The frame is too small.
    pub fn new(info: &StreamInfo, taxels: &Layout) -> Result<Self, Error> {
        let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
        let cell = green.cell();
        let (width, height) = (info.size.width(), info.size.height());
        let (xs, ys) = (places(width, cell), places(height, cell));
        let mut groups = Vec::new();
        for ys in ys.as_chunks::<ROWS>().0 {
            for xs in xs.as_chunks::<COLUMNS>().0 {
                let mut corners = [[0; 2]; TAXELS];
                let places = ys.iter().flat_map(|y| xs.iter().map(move |x| [*x, *y]));
                corners.iter_mut().zip(places).for_each(|(corner, place)| *corner = place);
                let camera = Layout::new(info.size, [cell; 2], corners)
                    .and_then(|layout| FrameGeometry::new(green, layout, FrameRate::NOMINAL))
                    .and_then(|camera| camera.with_bytes_per_row(info.bytes_per_row))
                    .map_err(|error| Error::config(&info.about, error))?;
                let history = |corner| History { inside: is_inside(corner, taxels), ..History::default() };
                groups.push((TaxelSums::new(camera), corners.map(history)));
            }
        }
        Ok(Self { groups, frames: 0, steps: 0 })
    }

    /// Adds a frame; one that is too short is ignored.
    ///
    /// `follows` is `true` if no frame was lost before it.
    pub fn push(&mut self, bytes: &[u8], follows: bool) {
        let (follows, half) = (follows && self.frames > 0, (self.frames % 2) as usize);
        for (accumulators, histories) in &mut self.groups {
            let Ok(sums) = accumulators.push_frame(bytes) else { return };
            let camera = accumulators.camera();
            let full = camera.full_scale() * camera.pixels();
            for (history, sum) in histories.iter_mut().zip(sums) {
                if follows {
                    history.squared_steps += (f64::from(sum) - f64::from(history.last)).powi(2);
                }
                history.last = sum;
                history.sums[half] += u64::from(sum);
                history.saturated += u64::from(sum == full);
                history.brightest = history.brightest.max(sum);
            }
        }
        self.frames += 1;
        self.steps += u64::from(follows);
    }

    /// Returns the statistics of the pixels, or `None` before two consecutive frames.
    pub fn summary(&self) -> Option<Pixels> {
        let (accumulators, _) = self.groups.first()?;
        let camera = accumulators.camera();
        let pixels = f64::from(camera.pixels());
        let level = 255.0 / (f64::from(camera.full_scale()) * pixels);
        let all: Vec<&History> = self.groups.iter().flat_map(|(_, histories)| histories).collect();
        if self.steps == 0 {
            return None;
        }
        let inside: Vec<&History> = all.iter().copied().filter(|history| history.inside).collect();
        let looked_at = if inside.is_empty() { &all } else { &inside };
        let squares = looked_at.iter().map(|history| history.squared_steps).sum::<f64>();
        // A step contains the noise twice; a cell's sum has that of `pixels` pixels.
        let variance = squares / (2.0 * self.steps as f64 * looked_at.len() as f64 * pixels);
        let mut sums: Vec<[u64; 2]> = all.iter().map(|history| history.sums).collect();
        sums.sort_unstable_by_key(|[first, _]| *first);
        let dark = ((sums.len() as f64 * DARKEST) as usize).max(1);
        let darkest = sums[..dark].iter().map(|[_, others]| *others as f64).sum::<f64>();
        let share = |count: u64, of: f64| count as f64 / of;
        let saturated = all.iter().map(|history| history.saturated).sum();
        let clipped = all.iter().filter(|history| history.brightest == 0).count() as u64;
        Some(Pixels {
            noise: variance.sqrt() * level * pixels,
            darkest: level * darkest / (dark as f64 * (self.frames / 2) as f64),
            saturated: share(saturated, all.len() as f64 * self.frames as f64),
            clipped: share(clipped, all.len() as f64),
        })
    }
}

/// Returns the positions of the grid's pixels along a side: a multiple of five, each in the middle of its part.
fn places(length: u16, cell: u16) -> Vec<u16> {
    let count = (length / cell).min(SIDE) / 5 * 5;
    let count = u32::from(count.max(5));
    let last = length.saturating_sub(cell);
    let middle = |index: u32| ((2 * index + 1) * u32::from(length) / (2 * count)) as u16;
    (0..count).map(|index| (middle(index) / cell * cell).min(last)).collect()
}

fn is_inside([x, y]: [u16; 2], taxels: &Layout) -> bool {
    let [width, height] = taxels.taxel();
    let within = |at: u16, from: u16, length: u16| at >= from && u32::from(at) < u32::from(from) + u32::from(length);
    taxels.corners().iter().any(|[left, top]| within(x, *left, width) && within(y, *top, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_is_even_and_inside() {
        assert_eq!(places(1280, 1).len(), 100);
        assert_eq!(places(23, 1), places(23, 1).into_iter().filter(|x| *x < 23).collect::<Vec<_>>());
        assert_eq!((places(23, 1).len(), places(4, 2)), (20, vec![0, 0, 2, 2, 2]));
        assert!(places(1280, 2).iter().all(|x| x % 2 == 0));
        assert_eq!(places(1000, 1)[..3], [5, 15, 25]);
    }
}
