//! A number for every cell of a picture.

/// The numbers, row by row.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    pub(super) values: Vec<f32>,
}

impl Plane {
    /// Returns the number at a column and row, or `None` outside.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<f32> {
        let [columns, rows] = self.size;
        if x < columns && y < rows { self.values.get(y * columns + x).copied() } else { None }
    }

    /// Returns the means of squares of 2 `reach` + 1 cells, computed twice.
    ///
    /// The result is nearly that of a round window of that size.
    pub(super) fn smoothed(&self, reach: usize) -> Self {
        let mut plane = self.clone();
        for _ in 0..4 {
            plane = plane.rows_smoothed(reach);
        }
        plane
    }

    /// Returns the running means of the rows, as the columns of a transposed plane.
    fn rows_smoothed(&self, reach: usize) -> Self {
        let [columns, rows] = self.size;
        let mut turned = vec![0.0; self.values.len()];
        for (y, row) in self.values.chunks_exact(columns.max(1)).enumerate() {
            let mut sum: f64 = row.iter().take(reach).map(|&value| f64::from(value)).sum();
            for x in 0..columns {
                sum += row.get(x + reach).map_or(0.0, |&value| f64::from(value));
                if let Some(passed) = x.checked_sub(reach + 1) {
                    sum -= row.get(passed).map_or(0.0, |&value| f64::from(value));
                }
                let count = (x + reach + 1).min(columns) - x.saturating_sub(reach);
                if let Some(mean) = turned.get_mut(x * rows + y) {
                    *mean = (sum / count as f64) as f32;
                }
            }
        }
        Self { size: [rows, columns], values: turned }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_lies_outside() {
        let plane = Plane { size: [7, 4], values: vec![0.25; 28] };
        assert_eq!(plane.at(6, 3), Some(0.25));
        // A spot at the first row or column looks one cell before it.
        let before = 0_usize.wrapping_sub(1);
        for (x, y) in [(7, 0), (0, 4), (before, 0), (0, before)] {
            assert_eq!(plane.at(x, y), None);
        }
    }

    #[test]
    fn smoothing_keeps_what_is_even_and_spreads_a_point_evenly() {
        let even = Plane { size: [7, 4], values: vec![0.25; 28] };
        assert!(even.smoothed(2).values.iter().all(|value| (value - 0.25).abs() < 1e-6));
        let mut point = Plane { size: [31, 21], values: vec![0.0; 31 * 21] };
        point.values[10 * 31 + 15] = 1.0;
        let spread = point.smoothed(2);
        assert_eq!(spread.size, point.size);
        assert!((spread.values.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        for (a, b) in [([13, 10], [17, 10]), ([15, 8], [15, 12]), ([13, 10], [15, 8])] {
            assert_eq!(spread.at(a[0], a[1]), spread.at(b[0], b[1]));
        }
        assert!(spread.at(15, 10) > spread.at(14, 10) && spread.at(14, 10) > spread.at(12, 10));
        assert_eq!(spread.at(31, 0), None);
    }
}
