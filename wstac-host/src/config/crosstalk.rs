//! `[layout] crosstalk`: the light of each whisker that other taxels see.

use wstac_core::params::TAXELS;
use wstac_core::touch::crosstalk::{Correction, WEIGHT_BITS};

use crate::plural::counted;

/// Largest fraction of a whisker's light that another taxel may see.
const MOST: f64 = 0.5;

/// Returns the correction of a cross-talk matrix. An error names the key, what was found and what was expected.
pub(super) fn correction(matrix: &[Vec<f64>]) -> Result<Correction, String> {
    const EXPECTED: &str = "expected 25 rows of 25 numbers";
    if matrix.len() != TAXELS {
        return Err(format!("[layout] crosstalk has {}, {EXPECTED}", counted(matrix.len(), "row")));
    }
    let mut rows = [[0.0; 2 * TAXELS]; TAXELS];
    for (number, (row, given)) in rows.iter_mut().zip(matrix).enumerate() {
        if given.len() != TAXELS {
            return Err(format!("[layout] crosstalk[{number}] has {}, {EXPECTED}", counted(given.len(), "number")));
        }
        let bounds = |at: usize| if at == number { 1.0..=1.0 } else { 0.0..=MOST };
        if let Some((at, found)) = given.iter().enumerate().find(|(at, found)| !bounds(*at).contains(*found)) {
            let expected = if at == number { "1, a taxel's own whisker".into() } else { format!("0 to {MOST}") };
            return Err(format!("[layout] crosstalk[{number}][{at}] is {found}, expected {expected}"));
        }
        row[..TAXELS].copy_from_slice(given);
        row[TAXELS + number] = 1.0;
    }
    let wrong = || "[layout] crosstalk has no inverse, or one that raises noise four times: expected less cross-talk";
    let weights = inverse(rows).and_then(Correction::new);
    weights.ok_or_else(|| wrong().into())
}

/// Returns the inverse of a matrix with the unit matrix behind it, in fixed point; `None` if it is too large.
fn inverse(mut rows: [[f64; 2 * TAXELS]; TAXELS]) -> Option<[[i16; TAXELS]; TAXELS]> {
    for column in 0..TAXELS {
        // The largest number of the column, for the least rounding.
        let pivot = (column..TAXELS).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        let divisor = rows[column][column];
        let own = rows[column].map(|number| number / divisor);
        for row in &mut rows {
            let times = row[column];
            row.iter_mut().zip(own).for_each(|(number, own)| *number -= times * own);
        }
        rows[column] = own;
    }
    let weight = |number: f64| (number * f64::from(1 << WEIGHT_BITS) + 0.5).floor();
    let is_small = |number: &f64| weight(*number).abs() <= f64::from(i16::MAX);
    let weights = rows.map(|row| core::array::from_fn(|at| row[TAXELS + at]));
    // A number that is not finite is not small.
    weights.iter().flatten().all(is_small).then(|| weights.map(|row: [f64; TAXELS]| row.map(|at| weight(at) as i16)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn neighbors(share: f64) -> Vec<Vec<f64>> {
        let far = |a: usize, b: usize| (a / 5).abs_diff(b / 5) + (a % 5).abs_diff(b % 5);
        let fraction = |far| if far == 0 { 1.0 } else { share * f64::from(u8::from(far == 1)) };
        (0..TAXELS).map(|row| (0..TAXELS).map(|column| fraction(far(row, column))).collect()).collect()
    }

    #[test]
    fn mixed_light_is_that_of_each_whisker_again() {
        let own: [u16; TAXELS] = core::array::from_fn(|taxel| 300 + 40 * (taxel as u16 * 7 % 25));
        for share in [0.0, 0.05, 0.12] {
            let matrix = neighbors(share);
            let mix = |row: &Vec<f64>| row.iter().zip(own).map(|(part, own)| part * f64::from(own)).sum::<f64>();
            let seen = core::array::from_fn(|taxel| mix(&matrix[taxel]).round() as u16);
            let found = correction(&matrix).unwrap().apply(&seen);
            assert!(found.iter().zip(own).all(|(found, own)| found.abs_diff(own) <= 3), "{found:?}, expected {own:?}");
        }
        assert_eq!(correction(&neighbors(0.0)).unwrap().apply(&own), own);
        // Black stays black, and full scale does not wrap.
        let strong = correction(&neighbors(0.12)).unwrap();
        assert_eq!(strong.apply(&[0; TAXELS]), [0; TAXELS]);
        let one_lit: [u16; TAXELS] = core::array::from_fn(|taxel| if taxel == 12 { u16::MAX } else { 0 });
        let found = strong.apply(&one_lit);
        assert_eq!((found[12], found[7], found[13]), (u16::MAX, 0, 0), "{found:?}");
    }

    #[test]
    fn what_is_no_matrix_of_cross_talk_is_refused() {
        let changed = |row: usize, column: usize, number: f64| {
            let mut matrix = neighbors(0.05);
            matrix[row][column] = number;
            matrix
        };
        let longer = |rows: usize, columns: usize| vec![vec![0.0; columns]; rows];
        for (matrix, says) in [
            (longer(26, 25), "crosstalk has 26 rows, expected 25 rows of 25"),
            (longer(25, 24), "crosstalk[0] has 24 numbers"),
            (changed(3, 4, f64::NAN), "crosstalk[3][4] is NaN, expected 0 to 0.5"),
            (changed(3, 4, -0.01), "crosstalk[3][4] is -0.01"),
            (changed(3, 4, 1e300), "expected 0 to 0.5"),
            (changed(24, 24, 0.9), "crosstalk[24][24] is 0.9, expected 1,"),
            // Singular, and nearly so.
            (neighbors(0.5), "has no inverse"),
            (neighbors(0.28), "has no inverse, or one that raises noise"),
            (vec![vec![0.5; TAXELS]; TAXELS], "crosstalk[0][0] is 0.5"),
        ] {
            let error = correction(&matrix).unwrap_err();
            assert!(error.starts_with("[layout] crosstalk") && error.contains(says), "{error}, expected {says}");
        }
    }
}
