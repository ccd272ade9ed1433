//! A Gauss-Newton step towards the slowness at which an axis's lines are most alike.

use super::edges::LINES;
use super::shape::Shapes;
use super::sqrt::sqrt;
use crate::params::SAMPLE_FRAMES;

/// One step, and how alike the lines were before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// The excess of the slowness, in units of 2^-16 frames per pitch: at most 1.5 frames.
    pub excess: i32,
    /// The part of the lines' energy that one shape explains, 0 to 1.
    pub coherence: f32,
    /// Standard deviation of the slowness, in frames per pitch, if errors of neighboring frames were independent.
    pub sd: f32,
    /// Standard deviation of the slowness, in frames per pitch, by how far the lines' arrival times are off their
    /// straight line.
    pub scatter: f32,
    /// The largest of these distances, in frames.
    pub farthest: f32,
    /// How far the slowness of a quarter of the frames is off that of all, at most, in frames per pitch: times the
    /// fourth root of the quarter's share of the derivative's energy.
    pub change: f32,
}

/// Fewest frames that all shifted lines must share.
const FEWEST_FRAMES: usize = 10;
/// Most frames that they can share: interpolation reads a frame before and two behind, of lines that may be at rest.
const MOST_FRAMES: usize = SAMPLE_FRAMES - 4;
/// Dark frames that are read before the first bright one, and after the last.
const MARGIN: usize = 5;
/// Largest step, in frames per pitch.
const LARGEST_STEP: f32 = 1.5;
/// Parts of the frames whose slowness must be that of all.
const PARTS: usize = 4;
/// Parts that have less than this fraction of the derivative's energy tell nothing.
const LEAST_TOLD: f32 = 0.03;
/// Unit of the sums of parts.
const TOLD: f32 = 256.0;

/// Returns the step from a slowness in units of 2^-16 frames per pitch; `None` if too few frames are left at it, or if
/// the lines have no shape.
#[inline(never)]
pub(super) fn step(shapes: &Shapes, slowness: i32) -> Option<Fit> {
    // All lines are shifted by at most two pitches. Interpolation needs a frame more before, and two after.
    let reach = (2 * slowness.unsigned_abs()).div_ceil(1 << 16) as usize + 2;
    // Frames that are dark in all lines say nothing.
    let [first, last] = shapes.span.map(usize::from);
    let from = reach.max(first.saturating_sub(MARGIN));
    let to = (last + MARGIN + 1).min(SAMPLE_FRAMES.saturating_sub(reach));
    let frames = to.checked_sub(from).filter(|&frames| frames >= FEWEST_FRAMES)?;
    let mut sum = [0_i32; MOST_FRAMES];
    for (k, line) in shapes.lit_lines() {
        let shifted = Shifted::new(line, k * slowness, from)?;
        for (sum, value) in sum.iter_mut().zip(shifted.values().take(frames)) {
            *sum += value;
        }
    }
    let sum = sum.get(..frames)?;
    // Windows of three frames, in parts that follow each other.
    let length = (frames - 2).div_ceil(PARTS);
    let (mut mm, mut md, mut dd) = (0_i64, 0_i64, 0_i64);
    let mut of_shape = [[0.0_f32; 3]; PARTS];
    for (number, of_part) in of_shape.iter_mut().enumerate() {
        let before = [mm, md, dd];
        for [before, here, after] in part(sum, number * length, length).array_windows() {
            let (m, d) = (i64::from(*here), i64::from(after - before));
            (mm, md, dd) = (mm + m * m, md + m * d, dd + d * d);
        }
        *of_part = [told(mm - before[0]), told(md - before[1]), told(dd - before[2])];
    }
    // Twice the derivative, without its part along the shape.
    let along = md as f32 / mm as f32;
    let dd = dd as f32 - along * md as f32;
    if mm == 0 || dd <= 0.0 {
        return None;
    }
    let mut lines = [[0.0_f32; 3]; LINES];
    // Sums over lines of what their light tells of a part, and of that times the line's number.
    let mut of_lines = [[0.0_f32; 2]; PARTS];
    let (mut weight, mut moment) = (0.0, 0.0);
    for ((k, line), place) in shapes.lit_lines().zip(&mut lines) {
        let shifted = Shifted::new(line, k * slowness, from)?;
        let (mut ym, mut yd, mut yy) = (0_i64, 0_i64, 0_i64);
        let mut of_line = [0.0; PARTS];
        for (number, of_part) in of_line.iter_mut().enumerate() {
            let before = [ym, yd];
            let first = number * length;
            for ([before, here, after], y) in part(sum, first, length).array_windows().zip(shifted.behind(first + 1)) {
                ym += product(y, *here);
                yd += product(y, after - before);
                yy += product(y, y);
            }
            *of_part = told(yd - before[1]) - along * told(ym - before[0]);
        }
        let gain = ym as f32 / mm as f32;
        for (sums, of_part) in of_lines.iter_mut().zip(of_line) {
            let told = gain * of_part;
            *sums = [sums[0] + told, sums[1] + k as f32 * told];
        }
        *place = [gain, yd as f32 - gain * md as f32, yy as f32 - gain * ym as f32];
        weight += gain * gain;
        moment += k as f32 * gain * gain;
    }
    let middle = moment / weight;
    let (mut numerator, mut spread, mut rest, mut energy, mut lit) = (0.0, 0.0, 0.0, 0.0, 0.0_f32);
    for (k, &[gain, along_derivative, unlike]) in shapes.lit_lines().map(|(k, _)| k as f32).zip(&lines) {
        if gain > 0.0 {
            let k = k - middle;
            numerator += k * gain * along_derivative;
            spread += k * k * gain * gain;
            rest += unlike;
            energy += unlike + gain * gain * mm as f32;
            lit += 1.0;
        }
    }
    let denominator = spread * dd;
    if denominator <= 0.0 || energy <= 0.0 {
        return None;
    }
    let rest = (rest - numerator * numerator / denominator).max(0.0);
    let step = (2.0 * numerator / denominator).clamp(-LARGEST_STEP, LARGEST_STEP);
    let free = (lit - 1.0) * (frames - 2) as f32 - lit;
    let sd = 2.0 * sqrt(rest / (free.max(1.0) * denominator));
    // The residual of each line's arrival time.
    let (mut squares, mut farthest) = (0.0, 0.0_f32);
    for (k, &[gain, along_derivative, _]) in shapes.lit_lines().map(|(k, _)| k as f32).zip(&lines) {
        if gain > 0.0 {
            let off = 2.0 * (along_derivative / (gain * dd) - (k - middle) * numerator / denominator);
            squares += gain * gain * off * off;
            farthest = farthest.max(off.abs());
        }
    }
    let mut change = 0.0_f32;
    for ([mm, md, part_dd], [sum, moment]) in of_shape.into_iter().zip(of_lines) {
        let part_dd = part_dd - along * (2.0 * md - along * mm);
        let share = part_dd * TOLD / dd;
        if share > LEAST_TOLD {
            // The shape itself tells nothing: the sum of (k - middle) times the square of the gain is 0.
            let off = 2.0 * ((moment - middle * sum) / (spread * part_dd) - numerator / denominator);
            // A part with little energy errs more.
            change = change.max(off.abs() * sqrt(sqrt(share)));
        }
    }
    let scatter = sqrt(squares / ((lit - 2.0).max(1.0) * spread));
    Some(Fit { scatter, farthest, change, excess: (step * 65_536.0) as i32, coherence: 1.0 - rest / energy, sd })
}

impl Shapes {
    /// Returns the lit lines with their numbers from the middle, −2 to 2.
    fn lit_lines(&self) -> impl Iterator<Item = (i32, &[i16; SAMPLE_FRAMES])> + Clone {
        let lines = (-(LINES as i32) / 2..).zip(self.lines.iter().zip(&self.is_lit));
        lines.filter(|(_, (_, is_lit))| **is_lit).map(|(k, (line, _))| (k, line))
    }
}

// Neither is inlined: small code counts here.
/// Returns the windows of three frames of a part of the shape, from `first` on.
#[inline(never)]
fn part(sum: &[i32], first: usize, length: usize) -> &[i32] {
    sum.get(first..sum.len().min(first + length + 2)).unwrap_or_default()
}

/// Returns a sum of a part in units of [`TOLD`]: less than 2^36 fits 32 bits, which a core turns to a number at once.
#[inline(never)]
fn told(sum: i64) -> f32 {
    (sum >> 8) as i32 as f32
}

/// Returns the product of a shifted line's light and a number of at most 17 bits: 31 bits hold it.
///
/// A Cortex-M0 has no product of 64 bits, and others add one in an instruction.
fn product(light: i32, number: i32) -> i64 {
    if cfg!(all(target_arch = "arm", not(thumb2))) {
        i64::from(light * number)
    } else {
        i64::from(light) * i64::from(number)
    }
}

/// A line shifted by a number of frames, by cubic convolution (Keys 1981).
struct Shifted<'a> {
    values: &'a [i16],
    /// In units of 2^-14.
    taps: [i32; 4],
}

impl<'a> Shifted<'a> {
    /// Shifts a line by `shift` in units of 2^-16 frames, and starts at frame `from` of the shape.
    fn new(line: &'a [i16; SAMPLE_FRAMES], shift: i32, from: usize) -> Option<Self> {
        let start = from as i32 + (shift >> 16) - 1;
        let u = (shift & 0xFFFF) >> 2;
        let square = (u * u) >> 14;
        let cube = (square * u) >> 14;
        let first = (2 * square - u - cube) >> 1;
        let third = (u + 4 * square - 3 * cube) >> 1;
        let last = (cube - square) >> 1;
        let taps = [first, (1 << 14) - first - third - last, third, last];
        Some(Self { values: line.get(usize::try_from(start).ok()?..)?, taps })
    }

    fn values(&self) -> impl Iterator<Item = i32> + use<'_> {
        self.of(self.values)
    }

    /// Returns the values behind the first `frames`.
    fn behind(&self, frames: usize) -> impl Iterator<Item = i32> + use<'_> {
        self.of(self.values.get(frames..).unwrap_or_default())
    }

    fn of(&self, values: &'a [i16]) -> impl Iterator<Item = i32> + use<'_> {
        let [a, b, c, d] = self.taps;
        // Each product is written out: in a small program, `map` of an array is a loop over memory.
        values.array_windows().map(move |&[p, q, r, s]| {
            let outer = a * i32::from(p) + d * i32::from(s);
            let inner = b * i32::from(q) + c * i32::from(r);
            (outer + inner + (1 << 13)) >> 14
        })
    }
}
