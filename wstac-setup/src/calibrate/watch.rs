//! Finds the light in frames: light above the untouched picture, added up cell by cell.

use super::cells::Cells;
use super::plane::Plane;
use wstac_core::layout::Layout;
use wstac_core::params::TAXELS;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::StreamInfo;
use wstac_host::statistics::median;

/// Number of untouched frames at the start: as many as the default baseline has.
pub const UNTOUCHED: usize = 25;
/// Approximate number of cells from which a frame's common shift is found.
const SAMPLED: usize = 4000;
/// Blocks along each side of a picture, to detect whether an untouched one changes: each is about a taxel.
const BLOCKS: usize = 8;
/// Largest change of a block, in standard deviations from frame to frame; 25 normal numbers have a range of 4.
const MOST_RANGE: f64 = 10.0;
/// Smallest change of a block that counts, as a fraction of full scale: half a level of 255.
const LEAST_RANGE: f64 = 0.002;
/// Blocks along each side of the pictures that are kept of all frames, and the most frames.
const KEPT_BLOCKS: usize = 48;
const MOST_KEPT: usize = 2000;
/// Standard deviation of normal numbers, in medians of the distance between two of them.
const STEP_DEVIATION: f64 = 1.048;
/// Fraction of full scale from which a cell is saturated.
const SATURATED: f32 = 0.985;

/// The observations of a sensor so far.
#[derive(Clone, Debug)]
pub struct Watch {
    pub(super) info: StreamInfo,
    pub(super) cells: Cells,
    /// Whether each cell is known: a recording may have a part of the picture only.
    known: Vec<bool>,
    /// The bytes of the untouched frames.
    pub(super) untouched: Vec<Vec<u8>>,
    /// The means of the untouched frames' blocks.
    blocks: Vec<Vec<f64>>,
    /// Every frame's means of smaller blocks; `None` for a lost frame.
    kept: Vec<Option<Vec<f32>>>,
    /// Mean of the untouched frames, in fractions of full scale, and the sum of squared deviations.
    mean: Vec<f32>,
    squares: Vec<f32>,
    /// Light above the mean, added up over the later frames.
    light: Vec<f32>,
    /// The brightest value of each cell.
    most: Vec<f32>,
    frames: u32,
    /// The current frame, and some of its cells.
    shares: Vec<f32>,
    sampled: Vec<f32>,
}

#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// Mean light above the untouched picture, in fractions of full scale.
    pub(super) light: Plane,
    /// Standard deviation of a cell's `light` from noise alone.
    pub(super) noise: f64,
    /// The untouched picture.
    pub(super) dark: Plane,
    /// Each cell's brightest value.
    pub(super) most: Plane,
}

impl Seen {
    /// Returns `true` if a cell ever reached the camera's highest brightness.
    pub(super) fn saturated(&self, cell: usize) -> bool {
        self.most.values.get(cell).is_some_and(|most| *most >= SATURATED)
    }
}

impl Watch {
    /// Creates a watch of a stream before its first frame.
    ///
    /// # Errors
    /// The stream has no pixels, or its size, format and bytes per row do not fit each other.
    pub fn new(info: &StreamInfo) -> Result<Self, Error> {
        if info.taxels_only {
            let message = "gives taxel sums, expected frames: a recording with pictures, or fidelity = \"rendered\"";
            return Err(Error::new(ErrorKind::Unsupported, &info.about, message));
        }
        let cells = Cells::new(info)?;
        let empty = vec![0.0; cells.size[0] * cells.size[1]];
        Ok(Self {
            info: info.clone(),
            cells,
            known: cells.known(info),
            untouched: Vec::with_capacity(UNTOUCHED),
            blocks: Vec::with_capacity(UNTOUCHED),
            kept: Vec::new(),
            mean: empty.clone(),
            squares: empty.clone(),
            light: empty.clone(),
            most: empty,
            frames: 0,
            shares: Vec::new(),
            sampled: Vec::new(),
        })
    }

    fn known_cells(&self) -> usize {
        self.known.iter().filter(|known| **known).count()
    }

    /// Returns the number of frames taken after the untouched ones.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Returns `true` if the untouched frames are complete.
    pub fn is_ready(&self) -> bool {
        self.untouched.len() == UNTOUCHED
    }

    /// Takes a frame; a frame that is too short is ignored.
    ///
    /// The first [`UNTOUCHED`] frames are the untouched ones.
    pub fn take(&mut self, bytes: &[u8]) {
        if bytes.len() < self.cells.frame_bytes() {
            return;
        }
        self.cells.read(bytes, &mut self.shares);
        if self.kept.len() < MOST_KEPT {
            let blocks = blocks(&self.shares, self.cells.size, KEPT_BLOCKS);
            self.kept.push(Some(blocks.into_iter().map(|mean| mean as f32).collect()));
        }
        for (most, share) in self.most.iter_mut().zip(&self.shares) {
            *most = most.max(*share);
        }
        if self.is_ready() {
            self.add();
        } else {
            self.add_untouched(bytes);
        }
    }

    /// Notes frames that were lost: a press during them tells no times.
    pub fn lose(&mut self, frames: u64) {
        let room = MOST_KEPT.saturating_sub(self.kept.len());
        self.kept.extend((0..frames).take(room).map(|_| None));
    }

    /// Returns the light in each taxel of a layout, in every frame that is kept; `None` for a lost frame.
    pub(super) fn taxels(&self, layout: &Layout) -> Vec<Option<[f64; TAXELS]>> {
        let sides = self.cells.size.map(|cells| cells as f64 * f64::from(self.cells.side) / KEPT_BLOCKS as f64);
        let size = layout.taxel();
        let inside = layout.corners().map(|corner| -> Vec<usize> {
            let range = |axis: usize| {
                let [from, length] = [corner[axis], size[axis]].map(|pixels| f64::from(pixels) / sides[axis]);
                from.round() as usize..((from + length).round() as usize).min(KEPT_BLOCKS)
            };
            range(1).flat_map(|y| range(0).map(move |x| y * KEPT_BLOCKS + x)).collect()
        });
        let sums = |blocks: &Vec<f32>| {
            core::array::from_fn(|taxel| inside[taxel].iter().map(|block| f64::from(blocks[*block])).sum())
        };
        self.kept.iter().map(|blocks| blocks.as_ref().map(sums)).collect()
    }

    fn add_untouched(&mut self, bytes: &[u8]) {
        self.untouched.push(bytes.to_vec());
        self.blocks.push(blocks(&self.shares, self.cells.size, BLOCKS));
        let count = self.untouched.len() as f32;
        for ((mean, squares), share) in self.mean.iter_mut().zip(&mut self.squares).zip(&self.shares) {
            let off = share - *mean;
            *mean += off / count;
            *squares += off * (share - *mean);
        }
    }

    /// Adds a frame's light above the untouched picture.
    ///
    /// Light that is common to the whole picture is not a whisker's but the room's, and is left out.
    fn add(&mut self) {
        self.frames += 1;
        let step = (self.known_cells() / SAMPLED).max(1);
        let cells = self.shares.iter().zip(&self.mean).zip(&self.known).filter(|(_, known)| **known);
        let off = cells.map(|((share, mean), _)| share - mean);
        self.sampled.clear();
        self.sampled.extend(off.step_by(step));
        let middle = self.sampled.len() / 2;
        let shift =
            if self.sampled.is_empty() { 0.0 } else { *self.sampled.select_nth_unstable_by(middle, f32::total_cmp).1 };
        let cells = self.light.iter_mut().zip(&self.shares).zip(&self.mean).zip(&self.known);
        for (((light, share), mean), _) in cells.filter(|(_, known)| **known) {
            *light += share - mean - shift;
        }
    }

    /// Returns the change of a block of the untouched picture as a fraction of full scale, if it is more than its
    /// noise.
    pub(super) fn disturbed(&self) -> Option<f64> {
        let changes = (0..BLOCKS * BLOCKS).filter_map(|block| {
            let values = || self.blocks.iter().map(|blocks| blocks[block]);
            let range = values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min);
            // A difference from frame to frame is noise; a slow change or a single jump is not.
            let steps = values().zip(values().skip(1)).map(|(a, b)| (b - a).abs()).collect();
            let quick = STEP_DEVIATION * median(steps).unwrap_or(0.0);
            (range > MOST_RANGE * quick && range > LEAST_RANGE).then_some(range)
        });
        changes.max_by(f64::total_cmp)
    }

    pub(super) fn seen(&self) -> Seen {
        let (frames, untouched) = (f64::from(self.frames.max(1)), self.untouched.len().max(2) as f64);
        let plane = |values: &[f32]| Plane { size: self.cells.size, values: values.to_vec() };
        let squares: f64 = self.squares.iter().map(|&square| f64::from(square)).sum();
        let variance = squares / self.known_cells().max(1) as f64 / (untouched - 1.0);
        let mut light = plane(&self.light);
        light.values.iter_mut().for_each(|light| *light /= frames as f32);
        // The noise of a mean over the frames, less a mean over the untouched ones.
        let noise = (variance * (1.0 / frames + 1.0 / untouched)).sqrt();
        Seen { light, noise, dark: plane(&self.mean), most: plane(&self.most) }
    }
}

/// Returns the means of a picture's blocks, so many along each side.
fn blocks(shares: &[f32], [columns, rows]: [usize; 2], blocks: usize) -> Vec<f64> {
    let (mut sums, mut counts) = (vec![0.0; blocks * blocks], vec![0_u32; blocks * blocks]);
    for (y, row) in shares.chunks_exact(columns.max(1)).enumerate() {
        for (x, &share) in row.iter().enumerate() {
            let block = y * blocks / rows * blocks + x * blocks / columns;
            sums[block] += f64::from(share);
            counts[block] += 1;
        }
    }
    sums.into_iter().zip(counts).map(|(sum, count): (f64, u32)| sum / f64::from(count.max(1))).collect()
}
