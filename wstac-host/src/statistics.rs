//! Means, percentiles, least-squares lines and linear equations, for all crates that need them.

/// Returns the mean, or `None` of no numbers.
///
/// ```
/// use wstac_host::statistics::mean;
///
/// assert_eq!(mean([1.0, 2.0, 6.0]), Some(3.0));
/// assert_eq!(mean([]), None);
/// ```
pub fn mean(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = numbers.into_iter().fold((0.0, 0_u32), |(sum, count), number| (sum + number, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Returns the root of the mean square, or `None` of no numbers.
///
/// ```
/// assert_eq!(wstac_host::statistics::rms([3.0, -4.0, 5.0, 0.0]), Some(12.5_f64.sqrt()));
/// ```
pub fn rms(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(numbers.into_iter().map(|number| number * number)).map(f64::sqrt)
}

/// Returns the median, or `None` of no numbers. Of an even number of numbers it is the upper of the two in the middle.
///
/// ```
/// assert_eq!(wstac_host::statistics::median(vec![4.0, 1.0, 3.0, 2.0]), Some(3.0));
/// ```
pub fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}

/// Returns the least number that at least `fraction` of all do not exceed, or `None` of no numbers.
///
/// ```
/// assert_eq!(wstac_host::statistics::percentile(vec![4.0, 1.0, 3.0, 2.0], 0.75), Some(3.0));
/// ```
pub fn percentile(mut numbers: Vec<f64>, fraction: f64) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    let rank = (fraction * numbers.len() as f64).ceil() as usize;
    numbers.get(rank.saturating_sub(1)).copied()
}

/// A least-squares line, y = intercept + slope · x, with its standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// The value of y at x = 0.
    pub intercept: f64,
    /// Standard error of the intercept.
    pub intercept_error: f64,
    /// The change of y per unit of x.
    pub slope: f64,
    /// Standard error of the slope.
    pub slope_error: f64,
    /// Fraction of the variance of y that the line explains, 0 to 1.
    pub r2: f64,
    /// Root mean square of the residuals, over n − 2.
    pub deviation: f64,
}

impl Line {
    /// Returns the line through points, or `None` if there are fewer than three, or all x or all y are the same.
    ///
    /// Sums are rounded once, so that the order of points does not matter beyond the last digit.
    pub fn fit(points: &[[f64; 2]]) -> Option<Self> {
        let n = points.len() as f64;
        let mean = |of: fn(&[f64; 2]) -> f64| sum(points.iter().map(of)) / n;
        let (mean_x, mean_y) = (mean(|[x, _]| *x), mean(|[_, y]| *y));
        let products = |of: fn(f64, f64) -> f64| sum(points.iter().map(|[x, y]| of(x - mean_x, y - mean_y)));
        let (sxx, sxy, syy) = (products(|x, _| x * x), products(|x, y| x * y), products(|_, y| y * y));
        if points.len() < 3 || !(sxx > 0.0 && syy > 0.0) {
            return None;
        }
        let slope = sxy / sxx;
        let intercept = mean_y - slope * mean_x;
        let residuals = sum(points.iter().map(|[x, y]| (y - intercept - slope * x).powi(2)));
        let variance = residuals / (n - 2.0);
        Some(Self {
            intercept,
            intercept_error: (variance * (1.0 / n + mean_x * mean_x / sxx)).sqrt(),
            slope,
            slope_error: (variance / sxx).sqrt(),
            r2: sxy * sxy / (sxx * syy),
            deviation: variance.sqrt(),
        })
    }
}

/// Solves linear equations. A row has the factors of an equation, and behind them its right sides.
///
/// Returns the rows with the solutions in place of the right sides; `None` if there is no single solution.
///
/// ```
/// let solved = wstac_host::statistics::solve([[0.0, 1.0, 2.0], [2.0, 1.0, 4.0]]).unwrap();
/// assert_eq!(solved.map(|row| row[2]), [1.0, 2.0]);
/// assert_eq!(wstac_host::statistics::solve([[0.1, 0.3, 1.0], [0.3, 0.9, 2.0]]), None);
/// ```
pub fn solve<const N: usize, const ALL: usize>(mut rows: [[f64; ALL]; N]) -> Option<[[f64; ALL]; N]> {
    let largest = |number: f64, row: &[f64; ALL]| row[..N].iter().fold(number, |most, factor| most.max(factor.abs()));
    // Rounding makes smaller ones of 0.
    let least = 1e-12 * rows.iter().fold(0.0, largest);
    for column in 0..N {
        // The largest number of the column, for the least rounding.
        let pivot = (column..N).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        let divisor = rows[column][column];
        if divisor.abs() <= least {
            return None;
        }
        let own = rows[column].map(|number| number / divisor);
        for row in &mut rows {
            let times = row[column];
            row.iter_mut().zip(own).for_each(|(number, own)| *number -= times * own);
        }
        rows[column] = own;
    }
    rows.iter().flatten().all(|number| number.is_finite()).then_some(rows)
}

/// Returns a sum whose rounding errors are added up, too (Neumaier 1974).
fn sum(numbers: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for number in numbers {
        let next = sum + number;
        lost += if sum.abs() >= number.abs() { (sum - next) + number } else { (number - next) + sum };
        sum = next;
    }
    sum + lost
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with `numpy.polyfit(x, y, 1, cov=True)` and `numpy.corrcoef(x, y)[0, 1] ** 2` (numpy 2.4.6).
    #[test]
    fn as_numpy_has_it() {
        let points = [[2.0, 39.0], [2.05, 35.5], [2.1, 33.0], [2.1, 32.0], [2.2, 27.5], [2.3, 21.0]];
        let line = Line::fit(&points).unwrap();
        for (found, expected) in [
            (line.slope, -58.297_872_340_426),
            (line.intercept, 155.216_312_056_74),
            (line.slope_error, 2.224_735_764_731_7),
            (line.intercept_error, 4.732_686_341_183_4),
            (line.r2, 0.994_208_528_295_22),
        ] {
            assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
        }
    }

    #[test]
    fn percentiles_are_numbers_that_are_there() {
        let numbers: Vec<f64> = (1..=20).rev().map(f64::from).collect();
        assert_eq!(percentile(numbers.clone(), 0.95), Some(19.0));
        assert_eq!(percentile(numbers.clone(), 0.951), Some(20.0));
        assert_eq!((median(numbers), median(vec![3.0, 1.0, 2.0])), (Some(11.0), Some(2.0)));
        assert_eq!((percentile(vec![3.0], 0.95), percentile(vec![], 0.95)), (Some(3.0), None));
        assert_eq!((median(vec![]), mean([]), rms([])), (None, None, None));
    }

    #[test]
    fn what_is_no_line() {
        assert_eq!(Line::fit(&[[1.0, 2.0], [2.0, 3.0]]), None);
        assert_eq!(Line::fit(&[[1.0, 2.0], [1.0, 3.0], [1.0, 4.0]]), None);
        assert_eq!(Line::fit(&[[1.0, 2.0], [2.0, 2.0], [3.0, 2.0]]), None);
    }
}
