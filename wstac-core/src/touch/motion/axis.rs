//! The slowness along one axis: five rows, or five columns.

use super::edges::{self, LINES};
use super::shape::Shapes;
use super::shift;
use crate::paper::trigger::Event;

/// The slowness along one axis, and how well it is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Frames per pitch; positive if the light moves from the first line to the last.
    pub slowness: f32,
    /// Standard deviation of the slowness that the fit itself gives.
    pub sd: f32,
    /// Standard deviation of the slowness by how far the lines' arrival times are off their straight line.
    pub scatter: f32,
    /// The largest of these distances, in frames.
    pub farthest: f32,
    /// How far the slowness of a part of the touch, or of its leading edges, is off: in frames per pitch.
    pub change: f32,
    /// Whether the touch crosses all lines.
    pub is_crossed: bool,
    /// The part of the lines' energy that one shape explains, 0 to 1.
    pub coherence: f32,
    /// The number of lines that are lit.
    pub lit: u8,
}

/// Fewest lit lines that have a slowness.
const FEWEST_LIT: u8 = 3;
/// Levels of rising edges from which the search starts, in units of 2^-7 of the peak: 30, 15 and 50 %.
const LEVELS: [i32; 3] = [38, 19, 64];
/// Starts that are nearer to each other count as one, in units of 2^-16 frames per pitch.
const SAME_START: i32 = 1 << 14;
/// Coherence at which no other start is tried.
const ENOUGH: f32 = 0.98;
/// Most steps from one start.
const STEPS: u32 = 5;
/// Slowness from which leading edges are not compared: 5 frames per pitch, in units of 2^-16.
const SLOW: i32 = 5 << 16;
/// Weight of the distance between the slowness of leading edges and that of all light, in units of 2^-16: 0.4 of a
/// change.
const RISING: f32 = 0.4 / 65_536.0;
/// Most frames per pitch of a start.
const FARTHEST_START: i32 = 14 << 16;

impl Axis {
    const fn unknown(lit: u8) -> Self {
        let (change, is_crossed) = (0.0, false);
        Self { slowness: 0.0, sd: 0.0, scatter: 0.0, farthest: 0.0, change, is_crossed, coherence: 0.0, lit }
    }
}

/// Returns what coherence says about the lines `first..first + LINES`.
#[inline(never)]
pub(super) fn by_coherence(event: &Event<'_>, first: usize) -> Axis {
    let mut shapes = Shapes::DARK;
    shapes.fill(event, first);
    if shapes.lit() < FEWEST_LIT {
        return Axis::unknown(shapes.lit());
    }
    let mut best: Option<(i32, shift::Fit)> = None;
    let mut starts = [i32::MAX; LEVELS.len()];
    for (number, level) in LEVELS.iter().enumerate() {
        let start = start(&shapes, *level);
        if starts.iter().any(|&other| other.abs_diff(start) < SAME_START as u32) {
            continue;
        }
        if let Some(place) = starts.get_mut(number) {
            *place = start;
        }
        let found = refined(&shapes, start);
        if let Some(found) = found
            && best.is_none_or(|best| found.1.coherence > best.1.coherence)
        {
            best = Some(found);
        }
        if best.is_some_and(|best| best.1.coherence > ENOUGH) {
            break;
        }
    }
    let Some((slowness, step)) = best else { return Axis::unknown(shapes.lit()) };
    // Leading edges at a low level. A slower texture passes line by line, and has edges of its own.
    let rising = if slowness.abs() < SLOW { start(&shapes, LEVELS[1]).abs_diff(slowness) } else { 0 };
    let slowness = slowness as f32 / 65_536.0;
    Axis {
        slowness,
        sd: step.sd,
        scatter: step.scatter,
        farthest: step.farthest,
        change: step.change.max(rising as f32 * RISING),
        is_crossed: shapes.is_crossed,
        coherence: step.coherence,
        lit: shapes.lit(),
    }
}

/// Returns the slowness of the rising edges at a level.
// It is not inlined, so that the edges do not lie on the stack of the steps.
#[inline(never)]
fn start(shapes: &Shapes, level: i32) -> i32 {
    shapes.edges(level).slope().clamp(-FARTHEST_START, FARTHEST_START)
}

/// Returns the slowness to which steps from `start` lead, and the last step.
fn refined(shapes: &Shapes, start: i32) -> Option<(i32, shift::Fit)> {
    let mut slowness = start;
    let mut last = None;
    for _ in 0..STEPS {
        let Some(step) = shift::step(shapes, slowness) else { break };
        slowness -= step.excess;
        last = Some(step);
        // A hundredth of the slowness, or of 0.2 frames.
        if step.excess.unsigned_abs() < (slowness.unsigned_abs() / 100).max(131) {
            break;
        }
    }
    last.map(|step| (slowness, step))
}

/// Returns what rising edges say about the lines `first..first + LINES`.
pub(super) fn by_edges(event: &Event<'_>, first: usize) -> Axis {
    let edges = edges::of_event(event, first);
    let lit = edges.lit();
    if lit < FEWEST_LIT {
        return Axis::unknown(lit);
    }
    let (slowness, scatter, farthest, coherence) = edges.fit();
    Axis { slowness, sd: 0.0, scatter, farthest, change: 0.0, is_crossed: true, coherence, lit }
}

const _: () = assert!(LINES == crate::params::ROWS && LINES == crate::params::COLUMNS);
