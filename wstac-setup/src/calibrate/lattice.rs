//! Assigns spots to whiskers.
//!
//! From a start spot, a walk visits neighbors at the places that the steps so far predict, until it finds no more. The
//! numbered spots are compared with a smooth model of a lattice; spots that are far from it are left out.

use wstac_core::params::{COLUMNS, ROWS, TAXELS};

use super::Refusal;
use super::fit::Fit;
use super::spots::Spot;
use wstac_host::plural::counted;
use wstac_host::statistics::{median, rms};

/// Largest distance of a neighbor from its predicted place on the walk, in steps.
const WALK: f64 = 0.3;
/// Largest distance of a spot from the smooth model, in steps.
const LEAST_OFF: f64 = 0.1;
/// Largest root mean square distance of the spots from the smooth model, in steps.
const MOST_OFF: f64 = 0.05;
/// Number of whiskers that may be missing.
const MISSING: usize = 1;
/// Largest rotation, in degrees: 15, plus the contribution of tilt and lens.
const MOST_ROTATION: f64 = 20.0;
/// Largest slope of the step to a neighbor on the right: 27°.
const SLANT: f64 = 0.51;

/// The whiskers' bases.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// The bases' places in cells, row by row: those of their light, or the expected ones if they gave no light.
    pub(super) centers: [[f64; 2]; TAXELS],
    pub(super) spots: [Option<usize>; TAXELS],
    /// Median steps to the right and down, in cells.
    pub(super) pitch: [f64; 2],
    /// Root mean square distance of the spots from a smooth lattice, in cells.
    pub(super) off: f64,
    /// Rotation of the picture in degrees, counterclockwise.
    pub(super) rotation_degrees: f64,
}

/// A spot with its column and row, counted from the start of the walk.
type Numbered = (usize, [i32; 2]);

/// Finds the lattice in a picture of `size` cells.
///
/// # Errors
/// No lattice can be identified; the error holds the reason and the spots that were numbered on the way.
pub(super) fn lattice(spots: &[Spot], size: [usize; 2]) -> Result<Lattice, Refusal> {
    let refused = |numbered: &[Numbered], message: String| Refusal {
        message,
        lattice: numbered.iter().map(|&(spot, _)| spot).collect(),
    };
    let walks = (0..spots.len()).map(|start| walk(spots, start));
    // Of the longest walks, the first.
    let longest = walks.reduce(|best, walk| if walk.len() > best.len() { walk } else { best });
    let numbered = longest.unwrap_or_default();
    if spots.len() < TAXELS - MISSING {
        let found = spots.len();
        let message = format!("found {} of light, expected {TAXELS} whiskers, or all but one", counted(found, "spot"));
        return Err(refused(&numbered, message));
    }
    let [columns, rows] = [0, 1].map(|axis| extent(&numbered, axis));
    let (count, found) = (numbered.len(), (columns.1, rows.1));
    if count < TAXELS - MISSING {
        let message = format!(
            "{count} of {} spots of light are on a lattice, expected {TAXELS} whiskers, or all but one",
            spots.len()
        );
        return Err(refused(&numbered, message));
    }
    if found != (COLUMNS, ROWS) {
        let message =
            format!("the lattice has {} columns and {} rows, expected {COLUMNS} and {ROWS}", found.0, found.1);
        return Err(refused(&numbered, message));
    }
    let mut named = [None; TAXELS];
    for &(spot, [column, row]) in &numbered {
        let taxel = (row - rows.0) as usize * COLUMNS + (column - columns.0) as usize;
        if let Some(place) = named.get_mut(taxel) {
            *place = Some(spot);
        }
    }
    settled(spots, size, named).map_err(|message| refused(&numbered, message))
}

/// Returns the smallest column or row, and the number of columns or rows.
fn extent(numbered: &[Numbered], axis: usize) -> (i32, usize) {
    let along = || numbered.iter().map(|(_, place)| place[axis]);
    let (least, most) = (along().min().unwrap_or(0), along().max().unwrap_or(0));
    (least, (most - least + 1) as usize)
}

/// Numbers spots by walking from `start`.
fn walk(spots: &[Spot], start: usize) -> Vec<Numbered> {
    let neighbor = |along: fn([f64; 2]) -> [f64; 2]| {
        let ways = spots.iter().map(|spot| step(&spots[start], spot));
        let ahead = ways.filter(|way| along(*way)[0] > 0.0 && along(*way)[1].abs() < SLANT * along(*way)[0]);
        ahead.min_by(|a, b| length(*a).total_cmp(&length(*b)))
    };
    let (Some(right), Some(down)) = (neighbor(|way| way), neighbor(|[x, y]| [y, x])) else {
        return Vec::new();
    };
    let mut numbered: Vec<(usize, [i32; 2], [[f64; 2]; 2])> = vec![(start, [0, 0], [right, down])];
    let mut used = vec![false; spots.len()];
    used[start] = true;
    let mut next = 0;
    while let Some(&(from, [column, row], steps)) = numbered.get(next) {
        next += 1;
        for (axis, sign) in [(0, 1), (1, 1), (0, -1), (1, -1)] {
            let mut place = [column, row];
            place[axis] += sign;
            if numbered.iter().any(|(_, there, _)| *there == place) {
                continue;
            }
            let expected = steps[axis].map(|step| step * f64::from(sign));
            let off = |spot: usize| {
                let way = step(&spots[from], &spots[spot]);
                (way[0] - expected[0]).hypot(way[1] - expected[1])
            };
            let free = (0..spots.len()).filter(|&spot| !used[spot]);
            let nearest = free.min_by(|&a, &b| off(a).total_cmp(&off(b)));
            let Some(spot) = nearest.filter(|&spot| off(spot) < WALK * length(expected)) else { continue };
            let way = step(&spots[from], &spots[spot]).map(|way| way * f64::from(sign));
            let mut steps = steps;
            steps[axis] = [0, 1].map(|k| f64::midpoint(steps[axis][k], way[k]));
            used[spot] = true;
            numbered.push((spot, place, steps));
        }
    }
    numbered.into_iter().map(|(spot, place, _)| (spot, place)).collect()
}

/// Compares named spots with a smooth lattice, removes the one that is too far from it, and fills in the missing one.
fn settled(spots: &[Spot], size: [usize; 2], mut named: [Option<usize>; TAXELS]) -> Result<Lattice, String> {
    let middle = size.map(|side| (side as f64 - 1.0) / 2.0);
    let half = size[0].min(size[1]) as f64 / 2.0;
    let place = |spot: usize| [0, 1].map(|k| (spots[spot].center[k] - middle[k]) / half);
    let pitch = [1, COLUMNS].map(|step| pitch(spots, &named, step));
    let mut turn = mean_step(spots, &named);
    turn = turn.map(|step| step / length(turn).max(1e-9));
    let (right, down) = (turn.map(|t| t * pitch[0] / half), [-turn[1], turn[0]].map(|t| t * pitch[1] / half));
    let step = pitch[0].min(pitch[1]);
    loop {
        let seen: Vec<_> =
            named.iter().enumerate().filter_map(|(taxel, spot)| Some((point(taxel), place((*spot)?)))).collect();
        if seen.len() < TAXELS - MISSING {
            let (found, sure) = (TAXELS - MISSING, seen.len());
            return Err(format!("only {sure} spots are where a lattice has its points, expected at least {found}"));
        }
        let fit = Fit::new(&seen, right, down);
        let seen_at = |taxel: usize| [0, 1].map(|k| middle[k] + half * fit.place(point(taxel))[k]);
        let off = |taxel: usize, spot: usize| {
            let at = seen_at(taxel);
            (spots[spot].center[0] - at[0]).hypot(spots[spot].center[1] - at[1])
        };
        let offs = || named.iter().enumerate().filter_map(|(taxel, spot)| Some((taxel, off(taxel, (*spot)?))));
        let farthest = offs().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((taxel, _)) = farthest.filter(|(_, off)| *off > LEAST_OFF * step) {
            named[taxel] = None;
            continue;
        }
        let rms = rms(offs().map(|(_, off)| off)).unwrap_or(0.0);
        if rms > MOST_OFF * step {
            let share = 100.0 * rms / step;
            return Err(format!(
                "the spots are {share:.0} % of a step off a lattice, expected at most {:.0} %",
                100.0 * MOST_OFF
            ));
        }
        let rotation_degrees = fit.rotation_degrees();
        if rotation_degrees.abs() > MOST_ROTATION {
            let limits = "expected at most 15: turn the camera, so that it is clear which row is the first";
            return Err(format!("the lattice is turned by {rotation_degrees:.0} degrees, {limits}"));
        }
        let centers =
            core::array::from_fn(|taxel| named[taxel].map_or_else(|| seen_at(taxel), |spot| spots[spot].center));
        return Ok(Lattice { centers, spots: named, pitch, off: rms, rotation_degrees });
    }
}

/// Returns the column and row of a taxel, counted from the lattice's middle.
fn point(taxel: usize) -> [f64; 2] {
    [(taxel % COLUMNS) as f64 - (COLUMNS / 2) as f64, (taxel / COLUMNS) as f64 - (ROWS / 2) as f64]
}

/// Returns the steps from each taxel to the next one, `next` taxels on: 1 for right, [`COLUMNS`] for down.
fn ways(spots: &[Spot], named: &[Option<usize>; TAXELS], next: usize) -> Vec<[f64; 2]> {
    let pairs = (0..TAXELS - next).filter(|taxel| next != 1 || taxel % COLUMNS + 1 < COLUMNS);
    pairs.filter_map(|taxel| Some(step(&spots[named[taxel]?], &spots[named[taxel + next]?]))).collect()
}

/// Returns the median length of a step.
fn pitch(spots: &[Spot], named: &[Option<usize>; TAXELS], next: usize) -> f64 {
    median(ways(spots, named, next).into_iter().map(length).collect()).unwrap_or(0.0)
}

/// Returns the mean step to the right.
fn mean_step(spots: &[Spot], named: &[Option<usize>; TAXELS]) -> [f64; 2] {
    let ways = ways(spots, named, 1);
    let sum = ways.iter().fold([0.0; 2], |sum, way| [sum[0] + way[0], sum[1] + way[1]]);
    sum.map(|sum| sum / ways.len().max(1) as f64)
}

fn step(from: &Spot, to: &Spot) -> [f64; 2] {
    [to.center[0] - from.center[0], to.center[1] - from.center[1]]
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns spots on a lattice of this many columns and rows, in a picture of 400 × 400.
    fn grid(columns: usize, rows: usize, turned_degrees: f64) -> Vec<Spot> {
        let (sin, cos) = turned_degrees.to_radians().sin_cos();
        let places = (0..columns * rows).map(|k| {
            let [x, y] = [(k % columns) as f64 - 2.0, (k / columns) as f64 - 2.0].map(|at| at * 60.0);
            [199.5 + x * cos + y * sin, 199.5 + y * cos - x * sin]
        });
        places.map(|center| Spot { center, light: 0.1, area: 700, stretch: 1.0, saturated: 0.0, cut: false }).collect()
    }

    fn refusal(spots: &[Spot]) -> String {
        lattice(spots, [400, 400]).unwrap_err().message
    }

    #[test]
    fn a_turned_lattice_is_numbered_row_by_row_whatever_the_order_of_the_spots() {
        for turned in [-17.0, -8.0, 0.0, 15.0, 18.0] {
            let mut spots = grid(5, 5, turned);
            spots.reverse();
            let found = lattice(&spots, [400, 400]).unwrap();
            assert_eq!(found.spots, core::array::from_fn(|taxel| Some(24 - taxel)));
            assert!((found.rotation_degrees - turned).abs() < 1e-6 && found.off < 1e-6);
            assert!(found.pitch.iter().all(|pitch| (pitch - 60.0).abs() < 1e-6));
        }
    }

    #[test]
    fn each_missing_whisker_is_found_from_the_others_and_strays_are_left_out() {
        for missing in 0..TAXELS {
            let mut spots = grid(5, 5, 9.0);
            let expected = spots.remove(missing).center;
            // A reflection next to the dead whisker, and one outside.
            spots.push(Spot { center: [expected[0] + 11.0, expected[1] - 6.0], ..spots[0] });
            spots.push(Spot { center: [8.0, 392.0], ..spots[0] });
            let found = lattice(&spots, [400, 400]).unwrap();
            assert_eq!(found.spots.iter().filter(|spot| spot.is_none()).count(), 1);
            let [x, y] = found.centers[missing];
            assert!((x - expected[0]).hypot(y - expected[1]) < 1e-3, "{missing}: {x} {y}, expected {expected:?}");
        }
    }

    #[test]
    fn what_is_no_lattice_of_25_is_refused() {
        assert!(refusal(&[]).contains("found 0 spots"));
        assert!(refusal(&grid(4, 4, 0.0)).contains("found 16 spots"));
        assert!(refusal(&grid(6, 5, 3.0)).contains("6 columns and 5 rows, expected 5 and 5"));
        assert!(refusal(&grid(6, 4, 3.0)).contains("6 columns and 4 rows"));
        assert!(refusal(&grid(5, 5, 24.0)).contains("turned by 24 degrees, expected at most 15"));
        let mut three = grid(5, 5, 0.0);
        three.drain(6..9);
        assert!(refusal(&three).contains("found 22 spots"));
        // Scattered: a walk does not get far.
        let scattered: Vec<Spot> = (0..30)
            .map(|k| Spot { center: [f64::from(k * 97 % 400), f64::from(k * k * 31 % 400)], ..three[0] })
            .collect();
        assert!(refusal(&scattered).contains("are on a lattice, expected 25"), "{}", refusal(&scattered));
    }
}
