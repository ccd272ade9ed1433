//! Finds spots of light in the glow, each with a center finer than a cell.
//!
//! Cells are visited from the brightest to the darkest. A cell next to no visited cell starts a spot, and one next to a
//! spot joins it. One between two spots ends the dimmer of them. The height of that spot above this level is its
//! certainty.

use super::plane::Plane;
use super::watch::Seen;

/// Half of the smoothing window, as a fraction of the picture's shorter side.
const SMOOTHING: f64 = 0.006;
/// Smallest height of a spot in standard deviations of the noise.
const LEAST_DEVIATIONS: f64 = 8.0;
/// Smallest height as a fraction of the height of the spot that has [`BRIGHT`] brighter ones.
const LEAST_OF_BRIGHT: f64 = 0.03;
const BRIGHT: usize = 5;
/// Smallest height as a fraction of its own peak, so that unevenness within a spot is not a spot.
const LEAST_OF_PEAK: f64 = 0.3;
/// Smallest height as a fraction of full scale: a tenth of a level of 255, as the mean over all frames.
const LEAST_LIGHT: f64 = 0.0004;
/// Fraction of the light above half a spot's light from which all cells weigh the same.
///
/// Light that is stronger on one side of a spot must not pull its center there.
const RAMP: f32 = 0.4;
/// Largest number of spots that are examined; the sensor has 25.
const MOST_SPOTS: usize = 200;

/// A spot of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// The center of the spot in cells; whole numbers are the middle of a cell.
    pub(super) center: [f64; 2],
    /// The height of the spot, as a fraction of full scale and the mean over all frames.
    pub(super) light: f64,
    /// Number of cells brighter than half of that height.
    pub(super) area: usize,
    /// The length of the spot divided by its width.
    pub(super) stretch: f64,
    /// Fraction of its cells that ever reached the camera's highest brightness.
    pub(super) saturated: f64,
    /// `true` if the picture's edge cuts it.
    pub(super) cut: bool,
}

/// A summit, and the level at which a higher one was met.
#[derive(Clone, Copy, Debug)]
struct Summit {
    cell: usize,
    peak: f32,
    meets: f32,
}

/// Returns the spots that stand out, the most certain first.
pub(super) fn spots(seen: &Seen) -> Vec<Spot> {
    let [columns, rows] = seen.light.size;
    let reach = ((columns.min(rows) as f64 * SMOOTHING).round() as usize).max(1);
    let light = seen.light.smoothed(reach);
    // The mean of two windows acts about like one window that is half as large again.
    let window = 1.5 * (2 * reach + 1) as f64;
    let least = (LEAST_DEVIATIONS * seen.noise / window).max(LEAST_LIGHT);
    let stands_out = |summit: &Summit| f64::from(summit.peak - summit.meets);
    let mut summits = summits(&light);
    summits.retain(|summit| stands_out(summit) >= least.max(LEAST_OF_PEAK * f64::from(summit.peak)));
    summits.sort_by(|a, b| stands_out(b).total_cmp(&stands_out(a)));
    let bright = summits.get(BRIGHT).map_or(0.0, stands_out);
    summits.retain(|summit| stands_out(summit) >= LEAST_OF_BRIGHT * bright);
    summits.truncate(MOST_SPOTS);
    summits.iter().filter_map(|summit| spot(seen, &light, summit)).collect()
}

/// Returns all local maxima.
///
/// The highest meets no other: it stands on the picture's usual level.
fn summits(light: &Plane) -> Vec<Summit> {
    const NONE: u32 = u32::MAX;
    let [columns, rows] = light.size;
    let value = |cell: usize| light.values.get(cell).copied().unwrap_or(0.0);
    let mut order: Vec<u32> = (0..(columns * rows) as u32).collect();
    order.sort_unstable_by(|&a, &b| value(b as usize).total_cmp(&value(a as usize)).then(a.cmp(&b)));
    let usual = order.get(order.len() / 2).map_or(0.0, |&cell| value(cell as usize));
    let mut parent = vec![NONE; columns * rows];
    let mut found = Vec::new();
    for &cell in &order {
        let (at, level) = (cell as usize, value(cell as usize));
        if level <= usual {
            break;
        }
        let (x, y) = (at % columns, at / columns);
        parent[at] = cell;
        let beside = [
            (x > 0).then(|| at - 1),
            (x + 1 < columns).then_some(at + 1),
            (y > 0).then(|| at - columns),
            (y + 1 < rows).then_some(at + columns),
        ];
        for other in beside.into_iter().flatten().filter(|&other| value(other) >= level) {
            if parent[other] == NONE {
                continue;
            }
            // A root is the summit of its spot: the cell that was visited first.
            let (a, b) = (root(&mut parent, at as u32), root(&mut parent, other as u32));
            if a == b {
                continue;
            }
            // Of two equal heights, the cell that was visited first wins.
            let higher = |a: u32, b: u32| value(a as usize).total_cmp(&value(b as usize)).then(b.cmp(&a)).is_gt();
            let (high, low) = if higher(a, b) { (a, b) } else { (b, a) };
            if low != cell {
                found.push(Summit { cell: low as usize, peak: value(low as usize), meets: level });
            }
            parent[low as usize] = high;
        }
    }
    let left = order.iter().take_while(|&&cell| value(cell as usize) > usual);
    let highest = left.filter(|&&cell| parent[cell as usize] == cell);
    found.extend(highest.map(|&cell| Summit { cell: cell as usize, peak: value(cell as usize), meets: usual }));
    found
}

/// Returns the root of a cell, and moves all cells on the path nearer to it.
fn root(parent: &mut [u32], mut cell: u32) -> u32 {
    while parent[cell as usize] != cell {
        let above = parent[parent[cell as usize] as usize];
        parent[cell as usize] = above;
        cell = above;
    }
    cell
}

/// Measures the cells that are connected with a summit and brighter than half of its height.
fn spot(seen: &Seen, light: &Plane, summit: &Summit) -> Option<Spot> {
    let [columns, rows] = light.size;
    let level = f32::midpoint(summit.peak, summit.meets);
    let ramp = RAMP * (summit.peak - level);
    let mut inside = std::collections::HashSet::from([summit.cell]);
    let mut open = vec![summit.cell];
    let (mut weights, mut sums, mut squares) = (0.0, [0.0; 2], [0.0; 3]);
    let (mut saturated, mut cut) = (0, false);
    let start = [summit.cell % columns, summit.cell / columns].map(|at| at as f64);
    while let Some(cell) = open.pop() {
        let (x, y) = (cell % columns, cell / columns);
        let weight = f64::from(((light.values.get(cell)? - level) / ramp).min(1.0));
        let [right, down] = [x as f64 - start[0], y as f64 - start[1]];
        weights += weight;
        sums = [sums[0] + weight * right, sums[1] + weight * down];
        squares = [
            squares[0] + weight * right * right,
            squares[1] + weight * right * down,
            squares[2] + weight * down * down,
        ];
        saturated += usize::from(seen.saturated(cell));
        cut |= x == 0 || y == 0 || x + 1 == columns || y + 1 == rows;
        let beside = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)]
            .into_iter()
            .filter(|&(x, y)| light.at(x, y).is_some_and(|value| value > level));
        for (x, y) in beside {
            if inside.insert(y * columns + x) {
                open.push(y * columns + x);
            }
        }
    }
    let mean = sums.map(|sum| sum / weights);
    let spread = [
        squares[0] / weights - mean[0] * mean[0],
        squares[1] / weights - mean[0] * mean[1],
        squares[2] / weights - mean[1] * mean[1],
    ];
    // The ratio of the axes of the ellipse with these moments; a cell has an extent.
    let (half, apart) =
        (f64::midpoint(spread[0], spread[2]) + 1.0 / 12.0, ((spread[0] - spread[2]) / 2.0).hypot(spread[1]));
    let stretch = ((half + apart) / (half - apart).max(1e-9)).sqrt();
    (weights > 0.0).then_some(Spot {
        center: [start[0] + mean[0], start[1] + mean[1]],
        light: f64::from(summit.peak - summit.meets),
        area: inside.len(),
        stretch,
        saturated: saturated as f64 / inside.len() as f64,
        cut,
    })
}
