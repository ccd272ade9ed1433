//! A smooth model of the lattice: the places at which a camera with a tilt and a curved lens sees its points.
//!
//! Point (x, y) of the lattice is counted from its middle. It is seen at r = q · (1 + k |q|²) from the picture's
//! middle, with q = (a x + b y + c, d x + e y + f) / (g x + h y + 1). Levenberg's and Marquardt's method finds the
//! least squares of these nine numbers.

use wstac_host::statistics::solve;

const NUMBERS: usize = 9;
/// Largest number of iterations; ten are usual.
const STEPS: usize = 60;

/// A point of the lattice, and the place at which it was seen.
type Point = ([f64; 2], [f64; 2]);

/// A lattice as a camera sees it, in any unit of length that is about half a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit([f64; NUMBERS]);

impl Fit {
    /// Fits a lattice to the places at which some of its points were seen: (point, place).
    ///
    /// `right` and `down` are the approximate directions of a step on the lattice.
    pub(super) fn new(seen: &[Point], right: [f64; 2], down: [f64; 2]) -> Self {
        let count = seen.len().max(1) as f64;
        let mean = |of: fn(&Point) -> [f64; 2]| {
            let sum = seen.iter().map(of).fold([0.0; 2], |sum, place| [sum[0] + place[0], sum[1] + place[1]]);
            sum.map(|sum| sum / count)
        };
        let (point, place) = (mean(|seen| seen.0), mean(|seen| seen.1));
        let middle = [0, 1].map(|k| place[k] - point[0] * right[k] - point[1] * down[k]);
        let mut fit = Self([right[0], down[0], middle[0], right[1], down[1], middle[1], 0.0, 0.0, 0.0]);
        let (mut damping, mut error) = (1e-3, fit.error(seen));
        for _ in 0..STEPS {
            let next = fit.step(seen, damping);
            let after = next.error(seen);
            if after < error {
                let done = error - after < 1e-14 * error;
                (fit, error, damping) = (next, after, damping * 0.2);
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e9 {
                    break;
                }
            }
        }
        fit
    }

    /// Returns the place at which a point of the lattice is seen.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d, e, f, g, h, k] = self.0;
        let away = g * x + h * y + 1.0;
        let (right, down) = ((a * x + b * y + c) / away, (d * x + e * y + f) / away);
        let lens = 1.0 + k * (right * right + down * down);
        [right * lens, down * lens]
    }

    /// Returns the rotation of the picture in degrees, counterclockwise.
    ///
    /// It is the direction of the mean of a step to the right and a step down, the latter rotated.
    pub(super) fn rotation_degrees(&self) -> f64 {
        let [a, b, _, d, e, ..] = self.0;
        (b - d).atan2(a + e).to_degrees()
    }

    /// Returns the sum of the squared distances.
    fn error(&self, seen: &[Point]) -> f64 {
        let squares = seen.iter().map(|(point, place)| {
            let found = self.place(*point);
            (found[0] - place[0]).powi(2) + (found[1] - place[1]).powi(2)
        });
        let error: f64 = squares.sum();
        if error.is_finite() { error } else { f64::INFINITY }
    }

    /// Takes one step downhill; more damping makes it shorter.
    fn step(&self, seen: &[Point], damping: f64) -> Self {
        const DIFFERENCE: f64 = 1e-6;
        let mut normal = [[0.0; NUMBERS + 1]; NUMBERS];
        for (point, place) in seen {
            let found = self.place(*point);
            let slopes: [[f64; 2]; NUMBERS] = core::array::from_fn(|n| {
                let mut other = *self;
                other.0[n] += DIFFERENCE;
                let moved = other.place(*point);
                [0, 1].map(|k| (moved[k] - found[k]) / DIFFERENCE)
            });
            for (row, slope) in normal.iter_mut().zip(&slopes) {
                for (entry, other) in row.iter_mut().zip(&slopes) {
                    *entry += slope[0] * other[0] + slope[1] * other[1];
                }
                row[NUMBERS] += slope[0] * (place[0] - found[0]) + slope[1] * (place[1] - found[1]);
            }
        }
        for (n, row) in normal.iter_mut().enumerate() {
            row[n] += damping * row[n].max(1e-9);
        }
        let step = solve(normal).map_or([0.0; NUMBERS], |rows| rows.map(|row| row[NUMBERS]));
        Self(core::array::from_fn(|n| self.0[n] + step[n]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_is_found_again_and_a_missing_point_with_it() {
        let truth = Fit([0.39, 0.08, 0.02, -0.09, 0.37, -0.03, 0.03, -0.04, -0.06]);
        let points = (0..25).map(|k| [f64::from(k % 5) - 2.0, f64::from(k / 5) - 2.0]);
        let seen: Vec<_> =
            points.enumerate().filter(|(k, _)| *k != 4).map(|(_, point)| (point, truth.place(point))).collect();
        let fit = Fit::new(&seen, [0.4, 0.0], [0.0, 0.4]);
        for point in [[2.0, -2.0], [0.0, 0.0], [-2.0, 1.0]] {
            let (found, expected) = (fit.place(point), truth.place(point));
            assert!((found[0] - expected[0]).hypot(found[1] - expected[1]) < 1e-6, "{point:?}: {found:?}");
        }
        assert!((fit.rotation_degrees() - 12.6).abs() < 0.5, "{}", fit.rotation_degrees());
    }
}
