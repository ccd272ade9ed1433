//! `[layout] crosstalk` and `gains`: the light of each whisker that other taxels see, and how bright whiskers are.

use wstac_core::params::TAXELS;
use wstac_core::touch::crosstalk::{Correction, WEIGHT_BITS};

use crate::plural::counted;
use crate::statistics::solve;

/// Largest fraction of a whisker's light that another taxel may see.
const MOST: f64 = 0.5;

/// Smallest and largest gain, and the smallest that is corrected in full: beside a smaller one, all light is lowered.
const GAINS: [f64; 2] = [0.05, 20.0];
const LEAST_FULL: f64 = 0.3;

/// Returns the correction of a cross-talk matrix and of gains, if one is stated. An error names the key, what was found
/// and what was expected.
pub(super) fn correction(matrix: Option<&[Vec<f64>]>, gains: Option<&[f64]>) -> Result<Option<Correction>, String> {
    if matrix.is_none() && gains.is_none() {
        return Ok(None);
    }
    let mut rows = [[0.0; 2 * TAXELS]; TAXELS];
    (0..TAXELS).for_each(|taxel| (rows[taxel][taxel], rows[taxel][TAXELS + taxel]) = (1.0, 1.0));
    if let Some(matrix) = matrix {
        set_crosstalk(&mut rows, matrix)?;
    }
    if let Some(gains) = gains {
        if gains.len() != TAXELS {
            return Err(format!("[layout] gains has {}, expected 25", counted(gains.len(), "number")));
        }
        if let Some((at, found)) = gains.iter().enumerate().find(|(_, gain)| !(GAINS[0]..=GAINS[1]).contains(*gain)) {
            return Err(format!("[layout] gains[{at}] is {found}, expected {} to {}", GAINS[0], GAINS[1]));
        }
        let least = gains.iter().copied().fold(f64::INFINITY, f64::min);
        let factor = (LEAST_FULL / least).max(1.0);
        for row in &mut rows {
            row.iter_mut().zip(gains).for_each(|(number, gain)| *number *= factor * gain);
        }
    }
    let wrong = || "[layout] crosstalk has no inverse, or one that raises noise four times: expected less cross-talk";
    let weights = inverse(&rows).and_then(Correction::new);
    weights.map(Some).ok_or_else(|| wrong().into())
}

fn set_crosstalk(rows: &mut [[f64; 2 * TAXELS]; TAXELS], matrix: &[Vec<f64>]) -> Result<(), String> {
    const EXPECTED: &str = "expected 25 rows of 25 numbers";
    if matrix.len() != TAXELS {
        return Err(format!("[layout] crosstalk has {}, {EXPECTED}", counted(matrix.len(), "row")));
    }
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
    }
    Ok(())
}

/// Returns the inverse of a matrix with the unit matrix behind it, in fixed point; `None` if it is too large.
fn inverse(rows: &[[f64; 2 * TAXELS]; TAXELS]) -> Option<[[i16; TAXELS]; TAXELS]> {
    let weight = |number: f64| (number * f64::from(1 << WEIGHT_BITS) + 0.5).floor();
    let is_small = |number: &f64| weight(*number).abs() <= f64::from(i16::MAX);
    let weights = solve(*rows)?.map(|row| core::array::from_fn(|at| row[TAXELS + at]));
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

    fn of(matrix: &[Vec<f64>]) -> Correction {
        correction(Some(matrix), None).unwrap().unwrap()
    }

    #[test]
    fn mixed_light_is_that_of_each_whisker_again() {
        let own: [u16; TAXELS] = core::array::from_fn(|taxel| 300 + 40 * (taxel as u16 * 7 % 25));
        for share in [0.0, 0.05, 0.12] {
            let matrix = neighbors(share);
            let mix = |row: &Vec<f64>| row.iter().zip(own).map(|(part, own)| part * f64::from(own)).sum::<f64>();
            let seen = core::array::from_fn(|taxel| mix(&matrix[taxel]).round() as u16);
            let found = of(&matrix).apply(&seen);
            assert!(found.iter().zip(own).all(|(found, own)| found.abs_diff(own) <= 3), "{found:?}, expected {own:?}");
        }
        assert_eq!(of(&neighbors(0.0)).apply(&own), own);
        // Black stays black, and full scale does not wrap.
        let strong = of(&neighbors(0.12));
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
            let error = correction(Some(&matrix), None).unwrap_err();
            assert!(error.starts_with("[layout] crosstalk") && error.contains(says), "{error}, expected {says}");
        }
    }

    #[test]
    fn whiskers_of_other_gains_are_alike_again() {
        let gains: Vec<f64> = (0..TAXELS).map(|taxel| 0.4 + 0.05 * taxel as f64).collect();
        let seen = |gains: &[f64]| core::array::from_fn(|taxel| (10_000.0 * gains[taxel]).round() as u16);
        let found = correction(None, Some(&gains)).unwrap().unwrap().apply(&seen(&gains));
        assert!(found.iter().all(|light| light.abs_diff(10_000) <= 3), "{found:?}");
        // Cross-talk is of light with gains.
        let matrix = neighbors(0.05);
        let mix = |row: &Vec<f64>| row.iter().zip(&gains).map(|(part, gain)| 10_000.0 * part * gain).sum::<f64>();
        let mixed = core::array::from_fn(|taxel| mix(&matrix[taxel]).round() as u16);
        let found = correction(Some(&matrix), Some(&gains)).unwrap().unwrap().apply(&mixed);
        // Weights are rounded: the limit is half a unit and the sum of all light times 2^-14.
        assert!(found.iter().all(|light| light.abs_diff(10_000) <= 18), "{found:?}");
        // Beside a whisker with 15 % of the light, all others are lowered.
        let weak: Vec<f64> = (0..TAXELS).map(|taxel| if taxel == 3 { 0.15 } else { 1.0 }).collect();
        let found = correction(None, Some(&weak)).unwrap().unwrap().apply(&seen(&weak));
        assert!(found.iter().all(|light| light.abs_diff(5000) <= 3), "{found:?}");
        assert_eq!(correction(None, None), Ok(None));
        for (gains, says) in [
            (vec![1.0; 24], "gains has 24 numbers, expected 25"),
            (vec![0.0; 25], "gains[0] is 0, expected 0.05 to 20"),
            (vec![f64::NAN; 25], "gains[0] is NaN"),
        ] {
            let error = correction(None, Some(&gains)).unwrap_err();
            assert!(error.starts_with("[layout] gains") && error.contains(says), "{error}, expected {says}");
        }
    }
}
