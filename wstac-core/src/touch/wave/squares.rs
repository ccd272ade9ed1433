//! Weighted least squares over whiskers' places, for polynomials of at most two degrees.

use core::ops::{Add, Shl, Sub};

use super::fit::place_of;
use crate::params::{self, TAXELS};
use crate::touch::motion::sqrt;

/// Exponents of the monomials of a polynomial: of the column's number from the middle, and of the row's.
const MONOMIALS: [[usize; 2]; 6] = [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]];

/// A polynomial of a place, by its six monomials.
pub(super) type Polynomial = [f32; 6];

/// Sums over whiskers of weights times the monomials of up to four degrees.
#[derive(Clone, Copy, Default)]
pub(super) struct Moments([[i32; 5]; 5]);

/// Returns the sums of five values, at the places from -2 to 2, times the place's powers.
fn powers([a, b, c, d, e]: [i32; 5]) -> [i32; 5] {
    let (near, far, first, second) = (b + d, a + e, d - b, 2 * (e - a));
    [c + near + far, first + second, near + 4 * far, first + 4 * second, near + 16 * far]
}

impl Moments {
    /// Sums up the weights of all whiskers, each below 2^19.
    #[inline(never)]
    pub(super) fn new(weights: &[i32; TAXELS]) -> Self {
        let rows = weights.as_chunks::<{ params::COLUMNS }>().0;
        let of_x: [[i32; 5]; 5] = core::array::from_fn(|row| powers(rows.get(row).copied().unwrap_or_default()));
        let [a, b, c, d, e] = &of_x;
        Self(core::array::from_fn(|k| {
            let of = |row: &[i32; 5]| row.get(k).copied().unwrap_or(0);
            powers([of(a), of(b), of(c), of(d), of(e)])
        }))
    }

    fn product(&self, a: [usize; 2], b: [usize; 2]) -> f32 {
        self.0.get(a[0] + b[0]).and_then(|row| row.get(a[1] + b[1])).map_or(0.0, |&sum| sum as f32)
    }

    /// Returns the sums of weights times products of two monomials.
    pub(super) fn products(&self) -> Products {
        MONOMIALS.map(|a| MONOMIALS.map(|b| self.product(a, b)))
    }

    /// Returns the sums of weights times the six monomials.
    pub(super) fn plane(&self) -> Polynomial {
        let [[one, y, yy, ..], [x, xy, ..], [xx, ..], ..] = self.0;
        [one, x, y, xx, xy, yy].map(|sum| sum as f32)
    }
}

/// Returns the whiskers at which a plane is above 0, a bit for each.
#[inline(never)]
pub(super) fn above(points: &Points, plane: [f32; 3]) -> u32 {
    // Of 2^-4 units. Sums are below 2^29.
    let most = (1 << 26) as f32;
    let [middle, along_x, along_y] = plane.map(|part| (16.0 * part).clamp(0.0 - most, most) as i32);
    let mut whiskers = 0;
    for (taxel, Point { weight, .. }) in points.iter().enumerate() {
        let [x, y] = place_of(taxel);
        whiskers |= u32::from(*weight > 0 && middle + along_x * x + along_y * y > 0) << (taxel & 31);
    }
    whiskers
}

/// Weighted sums of products of two monomials.
pub(super) type Products = [Polynomial; 6];

/// Returns the sums of all whiskers' values times the six monomials, without a product of long numbers.
#[inline(never)]
pub(crate) fn sums<T>(values: &[T; TAXELS]) -> [T; 6]
where
    T: Copy + Default + Add<Output = T> + Sub<Output = T> + Shl<u32, Output = T>,
{
    // The sums of five values, at the places from -2 to 2, times 1, the place and its square.
    let of_line = |[a, b, c, d, e]: [T; 5]| {
        let (near, far) = (b + d, a + e);
        [c + near + far, d - b + ((e - a) << 1), near + (far << 2)]
    };
    let [mut whole, mut along, mut square] = [[T::default(); 5]; 3];
    let rows = values.as_chunks::<{ params::COLUMNS }>().0.iter();
    for (((&row, whole), along), square) in rows.zip(&mut whole).zip(&mut along).zip(&mut square) {
        [*whole, *along, *square] = of_line(row);
    }
    let ([one, y, yy], [x, xy, _]) = (of_line(whole), of_line(along));
    [one, x, y, of_line(square)[0], xy, yy]
}

/// Fraction bits of a frame in a whisker's time, and what one frame is.
pub(super) const TIME_SHIFT: u32 = 9;
pub(super) const ONE_FRAME: f32 = (1 << TIME_SHIFT) as f32;

/// A whisker's time in units of 2^-9 frames, and its weight, below 2^12; no whisker has the weight 0.
#[derive(Clone, Copy, Default)]
pub(super) struct Point {
    pub(super) time: i32,
    pub(super) weight: i32,
}

pub(super) type Points = [Point; TAXELS];

/// A plane through weighted times, by sums about their means.
#[derive(Clone, Copy)]
pub(super) struct TimePlane {
    /// Means of x, of y and of the time.
    mean: [f32; 3],
    /// Sums of x², x y and y².
    square: [f32; 3],
    /// Sums of the time with x and with y.
    mixed: [f32; 2],
}

impl TimePlane {
    /// Creates the plane through the points of some whiskers, a bit for each.
    #[inline(never)]
    pub(super) fn new(points: &Points, whiskers: u32) -> Self {
        let (mut weights, mut times) = ([0; TAXELS], [0_i64; TAXELS]);
        for (taxel, ((point, weight), time)) in points.iter().zip(&mut weights).zip(&mut times).enumerate() {
            if whiskers >> taxel & 1 == 1 {
                // Below 2^29.
                (*weight, *time) = (point.weight, i64::from(point.weight * point.time));
            }
        }
        Self::of_sums(sums(&weights).map(|sum| sum as f32), sums(&times).map(|sum| sum as f32))
    }

    /// Returns the plane by the sums of weights times 1, x, y and their products, and of times with 1, x and y.
    #[inline(never)]
    pub(super) fn of_sums([w, wx, wy, wxx, wxy, wyy]: Polynomial, [one, x, y, ..]: Polynomial) -> Self {
        let w = if w > 0.0 { w } else { 1.0 };
        Self {
            mean: [wx / w, wy / w, one / w],
            square: [wxx - wx * wx / w, wxy - wx * wy / w, wyy - wy * wy / w],
            mixed: [x - one * wx / w, y - one * wy / w],
        }
    }

    /// Returns the elements xx, xy and yy of the inverse of the squares with a ridge, or zeros.
    #[inline(never)]
    pub(super) fn inverse(&self, ridge: f32) -> [f32; 3] {
        let [xx, xy, yy] = self.square;
        let more = ridge * (xx + yy);
        let (xx, yy) = (xx + more, yy + more);
        let determinant = xx * yy - xy * xy;
        if determinant > 0.0 { [yy, 0.0 - xy, xx].map(|part| part / determinant) } else { [0.0; 3] }
    }

    pub(super) fn slope(&self, ridge: f32) -> [f32; 2] {
        let ([xx, xy, yy], [x, y]) = (self.inverse(ridge), self.mixed);
        [xx * x + xy * y, xy * x + yy * y]
    }

    /// Returns the plane of this slope through the means: its time in the middle, and its slope.
    pub(super) fn level(&self, [along_x, along_y]: [f32; 2]) -> [f32; 3] {
        let [x, y, time] = self.mean;
        [time - along_x * x - along_y * y, along_x, along_y]
    }

    /// Returns how far a place is from the mean, to the left of a slope, as the plane has it.
    pub(super) fn across(&self, [along_x, along_y]: [f32; 2]) -> [f32; 3] {
        let [x, y, _] = self.mean;
        [along_y * x - along_x * y, 0.0 - along_y, along_x]
    }

    /// Returns the plane through what a slope leaves.
    pub(super) fn without(&self, [along_x, along_y]: [f32; 2]) -> Self {
        let ([xx, xy, yy], [x, y]) = (self.square, self.mixed);
        Self { mixed: [x - xx * along_x - xy * along_y, y - xy * along_x - yy * along_y], ..*self }
    }

    /// Returns the plane whose slope both have, each with a time of its own.
    pub(super) fn with(&self, other: &Self) -> Self {
        let [xx, xy, yy] = self.square;
        let [with_xx, with_xy, with_yy] = other.square;
        let ([x, y], [with_x, with_y]) = (self.mixed, other.mixed);
        Self { square: [xx + with_xx, xy + with_xy, yy + with_yy], mixed: [x + with_x, y + with_y], ..*self }
    }
}

/// Returns the sum of products. Most factors `a` are 0, and a processor without a floating-point unit skips them.
#[inline(never)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    // The bits of the exponent, since comparing floats is a call there, and a compiler makes that of all bits.
    let mut counted = a.iter().zip(b).filter(|(a, _)| cfg!(fpu) || a.to_bits() >> 23 & 255 != 0);
    // Nothing is added to 0, which would take it as long.
    let mut sum = counted.next().map_or(0.0, |(a, b)| a * b);
    for (a, b) in counted {
        sum += a * b;
    }
    // No negative zero.
    if sum.to_bits() == 1 << 31 { 0.0 } else { sum }
}

/// Most columns of a fit, and of fits of the same values. Fewer are as if the others were of zeros: one size takes less
/// code than three.
const COLUMNS: usize = 5;
const ALL: usize = 6;
type Matrix = [[f32; COLUMNS]; COLUMNS];

/// Coefficients of the columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) coefficients: [f32; COLUMNS],
    inverse: Matrix,
    /// The variance of a value of weight 1.
    pub(super) variance: f32,
}

impl Fit {
    /// Returns the standard deviation of a coefficient.
    pub(super) fn deviation(&self, k: usize) -> f32 {
        sqrt(self.variance_of(k, self.variance))
    }

    /// Returns the variance of a coefficient, if values of weight 1 have that variance.
    pub(super) fn variance_of(&self, k: usize, variance: f32) -> f32 {
        variance * at(&self.inverse, k, k).max(0.0)
    }

    /// Returns the standard deviation of the difference of two coefficients.
    pub(super) fn deviation_between(&self, a: usize, b: usize) -> f32 {
        let of = |row, column| at(&self.inverse, row, column);
        sqrt(self.variance * (of(a, a) + of(b, b) - 2.0 * of(a, b)).max(0.0))
    }

    /// Returns a coefficient of other values, whose sums with columns are `right`. This fit has the first of these.
    #[inline(never)]
    pub(super) fn of_others(&self, k: usize, right: &[f32; ALL]) -> f32 {
        self.inverse.get(k).map_or(0.0, |row| dot(row, right))
    }
}

/// The normal equations of columns: the matrix's diagonal and what is below it, and the right side.
pub(super) struct Normal {
    matrix: [[f32; ALL]; ALL],
    right: [f32; ALL],
}

impl Normal {
    /// Multiplies columns with each other, and with values' weighted `sums` with every monomial.
    #[inline(never)]
    pub(super) fn new(products: &Products, columns: &[Polynomial], sums: &Polynomial) -> Self {
        let mut matrix = [[0.0_f32; ALL]; ALL];
        for (number, (row, a)) in matrix.iter_mut().zip(columns).enumerate() {
            let times = products.each_ref().map(|row| dot(a, row));
            for (place, b) in row.iter_mut().zip(columns).take(number + 1) {
                *place = dot(b, &times);
            }
        }
        Self { matrix, right: with_each(columns, sums) }
    }

    /// Fits values by some of the columns; `squares` is the weighted sum of their squares.
    ///
    /// Returns `None` if the normal equations are singular in spite of the ridge.
    #[inline(never)]
    pub(super) fn fit(&self, columns: &[usize], squares: f32, count: usize, ridge: f32) -> Option<Fit> {
        let (mut normal, mut right, mut trace) = ([[0.0_f32; COLUMNS]; COLUMNS], [0.0_f32; COLUMNS], 0.0);
        for ((row, right), &a) in normal.iter_mut().zip(&mut right).zip(columns) {
            *right = *self.right.get(a)?;
            trace += self.matrix.get(a)?.get(a)?;
            for (place, &b) in row.iter_mut().zip(columns) {
                *place = *self.matrix.get(a.max(b))?.get(a.min(b))?;
            }
        }
        let mut inverse = normal;
        for (k, row) in inverse.iter_mut().enumerate().take(columns.len()) {
            let place = row.get_mut(k)?;
            *place = *place + ridge * *place + 1e-6 * trace;
        }
        invert(&mut inverse, columns.len())?;
        let coefficients = inverse.each_ref().map(|row| dot(row, &right));
        // The rest of the squares.
        let normal = normal.each_ref().map(|row| dot(row, &coefficients));
        let explained = 2.0 * dot(&coefficients, &right) - dot(&coefficients, &normal);
        let variance = (squares - explained).max(0.0) / count.saturating_sub(columns.len()).max(1) as f32;
        Some(Fit { coefficients, inverse, variance })
    }
}

fn at(matrix: &Matrix, row: usize, column: usize) -> f32 {
    matrix.get(row).and_then(|row| row.get(column)).copied().unwrap_or(0.0)
}

/// Returns the sums of values with each column; 0 without one.
#[inline(never)]
pub(super) fn with_each(columns: &[Polynomial], sums: &Polynomial) -> [f32; ALL] {
    core::array::from_fn(|k| columns.get(k).map_or(0.0, |column| dot(column, sums)))
}

/// Inverts a symmetric matrix of this size whose leading minors are above 0, by Gauss and Jordan in place.
fn invert(matrix: &mut Matrix, size: usize) -> Option<()> {
    for k in 0..size {
        let mut of_pivot = *matrix.get(k)?;
        let pivot = core::mem::replace(of_pivot.get_mut(k)?, 1.0);
        if pivot.is_nan() || pivot <= f32::MIN_POSITIVE {
            return None;
        }
        let by = 1.0 / pivot;
        for place in of_pivot.iter_mut().take(size) {
            *place *= by;
        }
        for (_, row) in matrix.iter_mut().enumerate().take(size).filter(|(number, _)| *number != k) {
            let factor = core::mem::replace(row.get_mut(k)?, 0.0);
            if factor != 0.0 {
                for (place, part) in row.iter_mut().zip(&of_pivot).take(size) {
                    *place -= factor * part;
                }
            }
        }
        *matrix.get_mut(k)? = of_pivot;
    }
    Some(())
}
