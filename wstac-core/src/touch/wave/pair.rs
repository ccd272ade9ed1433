//! Motions by two planes through whiskers' times: of two contacts that have one velocity, and of a corner's two edges.

use super::fit::length;
use super::squares::{ONE_FRAME, Plane, Points};
use super::{FEWEST, LATE_FROM};
use crate::touch::motion::sqrt;

/// Limits of two contacts: of the mean and the largest lateness, by the slowness and [`LATE_FROM`], and of what slownesses
/// differ.
const LATE_OF_CONTACTS: [f32; 2] = [0.04, 0.08];
const MOST_DIFFERENCE: f32 = 0.03;
/// Limits of the mean and the largest lateness of a corner.
const LATE_OF_CORNER: [f32; 2] = [0.08, 0.18];
/// A corner has an angle of 75 to 105 degrees, and its edges are at 12 degrees or more to the motion. Round things light
/// fewer whiskers.
const MOST_COSINE: f32 = 0.26;
const LEAST_SINE: f32 = 0.2;
const FEWEST_OF_CORNER: u32 = 18;
const ROUNDS: usize = 6;
/// Factor of the speed's deviation by a corner. Fitted on slides.
const FACTOR: f32 = 0.8;
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
    /// Returns the motion of two contacts by the middles of their light; `None` if they have not one velocity.
    #[inline(never)]
    pub(super) fn of_contacts(sides: &[Points; 2], delays: [f32; 2]) -> Option<Self> {
        let planes = sides.each_ref().map(|points| Plane::new(points.iter()));
        let [left, right] = &planes;
        let both = left.with(right);
        let slope = both.slope(RIDGES[0]);
        let slowness = delayed(slope, delays);
        let whole = length(slowness);
        let unit = [slowness[0] / whole, slowness[1] / whole];
        for plane in &planes {
            let own = dot(plane.without(slope).slope(RIDGES[1]), unit);
            if own.abs() > MOST_DIFFERENCE * ONE_FRAME * whole {
                return None;
            }
        }
        let rests = sides
            .iter()
            .zip(&planes)
            .flat_map(|(points, plane)| points.iter().map(move |point| (point.weight, plane.rest(slope, point))));
        let variance = variance(rests, whole, LATE_OF_CONTACTS, 4)?;
        let inverse = both.inverse(RIDGES[0]);
        let sd =
            [unit, [0.0 - unit[1], unit[0]]].map(|way| sqrt(variance * square(inverse, way)) / (ONE_FRAME * whole));
        Some(Self { slowness, sd })
    }

    /// Returns the motion of a corner, of which both edges have the slowness along it; `None` without a corner.
    #[inline(never)]
    pub(super) fn of_corner(points: &Points, delays: [f32; 2]) -> Option<Self> {
        let whole = Plane::new(points.iter());
        let [x, y] = whole.slope(RIDGES[0]);
        // An edge comes later the farther its whiskers are from the corner: on each side the later plane holds.
        let mut is_left = points.each_ref().map(|point| whole.across([x, y], point.place) > 0.0);
        let mut number = 0;
        let (planes, slopes) = loop {
            let side =
                |is: bool| Plane::new(points.iter().zip(&is_left).filter(move |each| *each.1 == is).map(|each| each.0));
            let planes = [side(true), side(false)];
            let slopes = planes.each_ref().map(|plane| plane.slope(RIDGES[0]));
            let next =
                points.each_ref().map(|point| planes[0].rest(slopes[0], point) < planes[1].rest(slopes[1], point));
            number += 1;
            if next == is_left || number == ROUNDS {
                break (planes, slopes);
            }
            is_left = next;
        };
        let count =
            |is: bool| points.iter().zip(&is_left).filter(|each| each.0.weight > 0 && *each.1 == is).count() as u32;
        let counts = [count(true), count(false)];
        if counts[0].min(counts[1]) < FEWEST || counts[0] + counts[1] < FEWEST_OF_CORNER {
            return None;
        }
        // In frames to the pitch. Over the way of a frame both edges are one frame late.
        let [a, b] = slopes.map(|slope| delayed(slope, delays));
        let determinant = a[0] * b[1] - a[1] * b[0];
        if determinant == 0.0 {
            return None;
        }
        let velocity = [(b[1] - a[1]) / determinant, (a[0] - b[0]) / determinant];
        let speed = length(velocity);
        let lengths = [length(a), length(b)];
        if dot(a, b).abs() > MOST_COSINE * lengths[0] * lengths[1]
            || lengths[0].max(lengths[1]) * speed * LEAST_SINE > 1.0
        {
            return None;
        }
        let rests = points
            .iter()
            .map(|point| (point.weight, planes[0].rest(slopes[0], point).min(planes[1].rest(slopes[1], point))));
        let variance = variance(rests, 1.0 / speed, LATE_OF_CORNER, 6)?;
        let late = planes.map(|plane| square(plane.inverse(RIDGES[0]), velocity));
        let unit = velocity.map(|part| part / speed);
        let sd = [unit, [0.0 - unit[1], unit[0]]].map(|way| {
            let [of_a, of_b] = [b, a].map(|edge| edge[1] * way[0] - edge[0] * way[1]);
            sqrt(variance * (late[0] * of_a * of_a + late[1] * of_b * of_b)) / (determinant.abs() * speed * ONE_FRAME)
        });
        Some(Self { slowness: unit.map(|part| part / speed), sd: [FACTOR * sd[0], sd[1]] })
    }
}

fn delayed(slope: [f32; 2], delays: [f32; 2]) -> [f32; 2] {
    [slope[0] * (1.0 / ONE_FRAME) + delays[0], slope[1] * (1.0 / ONE_FRAME) + delays[1]]
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// Returns the product of a symmetric matrix with a vector on either side.
fn square([xx, xy, yy]: [f32; 3], [x, y]: [f32; 2]) -> f32 {
    xx * x * x + 2.0 * xy * x * y + yy * y * y
}

/// Returns the variance of a time of weight 1; `None` if times are later than limits by the slowness allow.
fn variance(rests: impl Iterator<Item = (i32, f32)>, slowness: f32, late: [f32; 2], used: i32) -> Option<f32> {
    let (mut count, mut whole, mut squares) = (0, 0.0_f32, 0.0);
    let (mut heaviest, mut farthest) = (0, 0.0_f32);
    for (weight, rest) in rests {
        let of_weight = weight as f32 * rest;
        count += i32::from(weight > 0);
        whole += weight as f32;
        squares += of_weight * rest;
        heaviest = heaviest.max(weight);
        farthest = farthest.max(of_weight.abs());
    }
    let unit = (slowness + LATE_FROM) * ONE_FRAME;
    let fits = squares <= late[0] * late[0] * unit * unit * whole && farthest <= late[1] * unit * heaviest as f32;
    (fits && count > used).then(|| squares / (count - used) as f32)
}
