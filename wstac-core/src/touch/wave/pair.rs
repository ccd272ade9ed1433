//! Motions by two planes through whiskers' times: of two contacts that have one velocity, and of a corner's two edges.

use super::fit::{Whisker, Whiskers, place_of};
use super::squares::{ONE_FRAME, Points, TimePlane, above};
use super::{FEWEST, LATE_FROM};
use crate::touch::motion::{length, sqrt};

/// Limits of two contacts: of the mean and the largest lateness, by the slowness and [`LATE_FROM`]; of what the
/// slowness of each differs along and across the motion; and of what it may differ along, with a standard deviation.
const LATE_OF_CONTACTS: [f32; 2] = [0.04, 0.08];
const MOST_DIFFERENCE: [f32; 2] = [0.02, 0.05];
const MOST_POSSIBLE: f32 = 0.05;
/// Limits of the mean and the largest lateness of a corner.
const LATE_OF_CORNER: [f32; 2] = [0.08, 0.18];
/// A corner has an angle of 75 to 105 degrees, and its edges are at 12 degrees or more to the motion. Round things
/// light fewer whiskers.
const MOST_COSINE: f32 = 0.26;
const LEAST_SINE: f32 = 0.2;
const FEWEST_OF_CORNER: u32 = 18;
/// Rounds in which whiskers change their side, and most that may still do so in the last one.
const ROUNDS: usize = 6;
const MOST_MOVED: u32 = 2;
/// Factors of both deviations by two contacts, and of the speed's by a corner. Fitted on slides.
const FACTORS: [f32; 3] = [0.93, 1.03, 0.77];
/// Ridges of a slowness, and of what is left of it.
const RIDGES: [f32; 2] = [1e-4, 1e-3];

/// A motion by two groups of whiskers.
pub(super) struct Pair {
    /// Frames from a column to the next, and from a row to the one below it.
    pub(super) slowness: [f32; 2],
    /// Standard deviations of the speed as a fraction, and of the direction in radians.
    pub(super) sd: [f32; 2],
}

impl Pair {
    /// Returns the motion of two contacts, a bit for each whisker, by the middles of their light; `None` if they have
    /// not one velocity.
    #[inline(never)]
    pub(super) fn of_contacts(points: &Points, sides: [u32; 2], delays: [f32; 2]) -> Option<Self> {
        let planes = sides.map(|side| TimePlane::new(points, side));
        let both = planes[0].with(&planes[1]);
        let slope = both.slope(RIDGES[0]);
        let slowness = delayed(slope, delays);
        let whole = length(slowness);
        let unit = slowness.map(|part| part / whole);
        let ways = [unit, [0.0 - unit[1], unit[0]]];
        let variance = variance(points, sides[0], &planes, [slope; 2], whole, LATE_OF_CONTACTS, 4)?;
        for plane in &planes {
            let own = plane.without(slope).slope(RIDGES[1]);
            let [along, across] = ways.map(|way| dot(own, way).abs() / (ONE_FRAME * whole));
            let sd = sqrt(variance * square(plane.inverse(RIDGES[1]), unit)) / (ONE_FRAME * whole);
            // A contact of whiskers side by side does not tell its speed.
            if along > MOST_DIFFERENCE[0] || across > MOST_DIFFERENCE[1] || along + sd > MOST_POSSIBLE {
                return None;
            }
        }
        let inverse = both.inverse(RIDGES[0]);
        let sd = ways.map(|way| sqrt(variance * square(inverse, way)) / (ONE_FRAME * whole));
        Some(Self { slowness, sd: [FACTORS[0] * sd[0], FACTORS[1] * sd[1]] })
    }

    /// Returns the motion of a corner, of which both edges have the slowness along it; `None` without a corner.
    #[inline(never)]
    pub(super) fn of_corner(whiskers: &Whiskers<'_>, lit: u32, delays: [f32; 2]) -> Option<Self> {
        if lit.count_ones() < FEWEST_OF_CORNER {
            return None;
        }
        let points = &whiskers.points(Whisker::edge);
        let whole = TimePlane::new(points, lit);
        // An edge comes later the farther its whiskers are from the corner: on each side the later plane holds.
        let mut left = above(points, whole.across(whole.slope(RIDGES[0])));
        let mut number = 0;
        let (planes, slopes) = loop {
            let sides = [left, lit & !left];
            if sides.iter().any(|side| side.count_ones() < FEWEST) {
                return None;
            }
            let planes = sides.map(|side| TimePlane::new(points, side));
            let slopes = planes.each_ref().map(|plane| plane.slope(RIDGES[0]));
            let ([a, a_x, a_y], [b, b_x, b_y]) = (planes[0].level(slopes[0]), planes[1].level(slopes[1]));
            let later = above(points, [a - b, a_x - b_x, a_y - b_y]);
            let moved = (later ^ left).count_ones();
            number += 1;
            if moved == 0 || (number == ROUNDS && moved <= MOST_MOVED) {
                break (planes, slopes);
            }
            // A corner that opens forward changes its sides for ever.
            if number == ROUNDS {
                return None;
            }
            left = later;
        };
        // In frames to the pitch. Over the way of a frame both edges are one frame late.
        let [a, b] = slopes.map(|slope| delayed(slope, delays));
        let determinant = a[0] * b[1] - a[1] * b[0];
        if determinant == 0.0 {
            return None;
        }
        let velocity = [(b[1] - a[1]) / determinant, (a[0] - b[0]) / determinant];
        let (speed, lengths) = (length(velocity), [length(a), length(b)]);
        if dot(a, b).abs() > MOST_COSINE * lengths[0] * lengths[1]
            || lengths[0].max(lengths[1]) * speed * LEAST_SINE > 1.0
        {
            return None;
        }
        let slowness = 1.0 / speed;
        let variance = variance(points, left, &planes, slopes, slowness, LATE_OF_CORNER, 6)?;
        let late = planes.map(|plane| square(plane.inverse(RIDGES[0]), velocity));
        let unit = velocity.map(|part| part * slowness);
        let sd = [unit, [0.0 - unit[1], unit[0]]].map(|way| {
            let [of_a, of_b] = [b, a].map(|edge| edge[1] * way[0] - edge[0] * way[1]);
            let squares = late[0] * of_a * of_a + late[1] * of_b * of_b;
            sqrt(variance * squares) * slowness / (determinant.abs() * ONE_FRAME)
        });
        Some(Self { slowness: unit.map(|part| part * slowness), sd: [FACTORS[2] * sd[0], sd[1]] })
    }
}

fn delayed(slope: [f32; 2], delays: [f32; 2]) -> [f32; 2] {
    [slope[0] * (1.0 / ONE_FRAME) + delays[0], slope[1] * (1.0 / ONE_FRAME) + delays[1]]
}

#[inline(never)]
fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// Returns the product of a symmetric matrix with a vector on either side.
#[inline(never)]
fn square([xx, xy, yy]: [f32; 3], [x, y]: [f32; 2]) -> f32 {
    xx * x * x + 2.0 * xy * x * y + yy * y * y
}

/// Returns the variance of a time of weight 1, about the first plane for `first` and about the second one for all
/// others; `None` if times are later than limits by the slowness allow.
#[inline(never)]
fn variance(
    points: &Points,
    first: u32,
    planes: &[TimePlane; 2],
    slopes: [[f32; 2]; 2],
    slowness: f32,
    late: [f32; 2],
    used: i32,
) -> Option<f32> {
    let levels = [planes[0].level(slopes[0]), planes[1].level(slopes[1])];
    let (mut count, mut whole, mut heaviest) = (0, 0, 0);
    let (mut squares, mut farthest) = (0.0_f32, 0.0_f32);
    for (taxel, point) in points.iter().enumerate().filter(|(_, point)| point.weight > 0) {
        let [middle, along_x, along_y] = if first >> taxel & 1 == 1 { levels[0] } else { levels[1] };
        let [x, y] = place_of(taxel).map(|part| part as f32);
        let rest = point.time as f32 - middle - along_x * x - along_y * y;
        let of_weight = point.weight as f32 * rest;
        squares += of_weight * rest;
        farthest = farthest.max(of_weight.abs());
        (count, whole, heaviest) = (count + 1, whole + point.weight, heaviest.max(point.weight));
    }
    let unit = (slowness + LATE_FROM) * ONE_FRAME;
    let fits =
        squares <= late[0] * late[0] * unit * unit * whole as f32 && farthest <= late[1] * unit * heaviest as f32;
    (fits && count > used).then(|| squares / (count - used) as f32)
}
