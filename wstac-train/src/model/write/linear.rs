//! Linear models: one scale for all rows, so that their sums can be compared.
//!
//! For pairs of classes only signs count, so each row has its own scale.

use wstac_core::model::linear_svm::BLOCK;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};

use super::super::check::USE_SCALE;
use super::super::trained::{Linear, Row, ends, file_order};
use super::{Body, ONE, Weights};

/// Range of the features of a camera of 8 bits at the default floor: ln(2.5/255) to ln 5.
pub(super) const USUAL: (f64, f64) = (-9471.0, 3296.0);
/// The margin that scores are trained for: the hinge of an SVM, targets of −1 and 1, log-odds of 1.
const MARGIN: f64 = 1.0;
/// The range of scores for usual features, in margins: 100 to 1500 for models of a simulated sweep.
const REACH: f64 = 400.0;
/// Units of the second row of int16 in one of the first.
const WIDE: f64 = 32_768.0;

/// Largest weight of each type: one of int32 is two of int16, the second in units of 2^-15 of the first.
pub(super) const fn largest(weights: Weights) -> f64 {
    match weights {
        Weights::Int8 => 127.0,
        Weights::Int16 => 32_767.0,
        Weights::Int32 => 32_767.0 * WIDE,
    }
}

/// The end of a warning if the answers were not counted.
pub(in super::super) const COUNTED_BY_CHECK: &str = "; --check SET.npz counts the answers that change";

/// Returns the number of a type in a file.
pub(super) const fn number_of(weights: Weights) -> u16 {
    match weights {
        Weights::Int8 => 1,
        Weights::Int16 => 2,
        Weights::Int32 => 4,
    }
}

pub(super) fn body(
    model: &Linear,
    classes: usize,
    frames: usize,
    weights: Option<Weights>,
    mean: Option<&[f64]>,
) -> Result<Body, String> {
    let (body, is_unsure) = body_of(model, classes, frames, weights.unwrap_or(Weights::Int16), mean)?;
    if weights.is_some() || !is_unsure {
        return Ok(body);
    }
    let (mut body, _) = body_of(model, classes, frames, Weights::Int32, mean)?;
    body.exactness.insert_str(0, "weights are int32, twice as large, because rounding to int16 may change answers: ");
    Ok(body)
}

/// Returns the part of the file, and whether rounding may change answers.
fn body_of(
    model: &Linear,
    classes: usize,
    frames: usize,
    width: Weights,
    mean: Option<&[f64]>,
) -> Result<(Body, bool), String> {
    let inputs = frames * FEATURES;
    let pairs = classes * (classes - 1) / 2;
    let expected = if model.pairs { pairs } else { classes };
    let rows = model.rows.len();
    if rows != expected && (model.pairs || rows != 1 || classes != 2) {
        return Err(format!("{rows} weighted sums of {classes} classes, expected {expected}"));
    }
    for (number, row) in model.rows.iter().enumerate() {
        if row.weights.len() != inputs {
            return Err(format!("weighted sum {number} has {} weights, expected {inputs}", row.weights.len()));
        }
        if let Some(weight) = row.weights.iter().chain([&row.bias]).find(|weight| !weight.is_finite()) {
            return Err(format!("weighted sum {number}: weight {weight}, expected a finite number"));
        }
    }
    let full = largest(width);
    let most_bias = 2.0_f64.powi(61) / ONE;
    let common = scale(&model.rows, full, most_bias);
    let mut scaled = Vec::with_capacity(rows);
    let (mut anywhere, mut usual) = (0.0_f64, 0.0_f64);
    let mut bounds = Vec::with_capacity(rows);
    for row in &model.rows {
        let scale = if model.pairs { scale(std::slice::from_ref(row), full, most_bias) } else { common };
        let mut weights = vec![0_i32; inputs];
        let integers = rounded(row, scale, full, frames, mean.is_some());
        let bias = (corrected(row, &integers, scale, mean) * scale * ONE).round();
        let off = bias / (scale * ONE) - row.bias;
        let (mut any, mut low, mut high) = (off.abs(), -off, off);
        for (input, (weight, &rounded)) in row.weights.iter().zip(&integers).enumerate() {
            weights[file_order(input, frames)] = rounded as i32;
            let off = rounded / scale - weight;
            any += off.abs() * 16.0;
            let ends = [off * USUAL.0 / ONE, off * USUAL.1 / ONE];
            low -= ends[0].min(ends[1]);
            high += ends[0].max(ends[1]);
        }
        anywhere = anywhere.max(any);
        bounds.push(low.max(high));
        usual = usual.max(low.max(high));
        scaled.push((weights, bias as i64));
    }
    let mut halves = vec![rows as u16, 0];
    push_rows(&mut halves, &scaled, width);
    let (warning, is_unsure) = warning(model, classes, &bounds);
    let exactness = format!(
        "weights are in units of {:.2e}{}: a score is off by {usual:.2e} at most for features of {:.2} to {:.2}, by {anywhere:.2e} for any{}",
        1.0 / common,
        if model.pairs { " or finer" } else { "" },
        USUAL.0 / ONE,
        USUAL.1 / ONE,
        warning
    );
    let kind = if model.pairs { 2 } else { 1 };
    let body = Body { kind, number: number_of(width), halves, exactness, score_bound: usual, ..Body::default() };
    Ok((body, is_unsure))
}

/// Appends rows of weights in the order of a file, and their biases.
pub(super) fn push_rows(halves: &mut Vec<u16>, rows: &[(Vec<i32>, i64)], width: Weights) {
    let split: Vec<_>;
    let rows = if width == Weights::Int32 {
        split = rows.iter().flat_map(halves_of).collect();
        &split
    } else {
        rows
    };
    halves.extend(rows.iter().flat_map(|(_, bias)| (0..4).map(move |half| (bias >> (16 * half)) as u16)));
    for block in rows.chunks(BLOCK) {
        let inputs = block.first().map_or(0, |(weights, _)| weights.len());
        if width == Weights::Int8 {
            // Rows of a block alternate, with four inputs each: first, third, second, fourth. Missing inputs are 0.
            for first in (0..inputs).step_by(4) {
                for (weights, _) in block {
                    let byte = |input: usize| weights.get(input).map_or(0, |weight| u16::from(*weight as u8));
                    halves.extend([0, 1].map(|at| byte(first + at) | byte(first + at + 2) << 8));
                }
            }
        } else {
            for first in (0..inputs).step_by(2) {
                halves.extend(block.iter().flat_map(|(weights, _)| [weights[first] as u16, weights[first + 1] as u16]));
            }
        }
    }
}

/// Returns a row of int32 as two of int16; the first counts 2^15.
fn halves_of((weights, bias): &(Vec<i32>, i64)) -> [(Vec<i32>, i64); 2] {
    const LOW: i32 = WIDE as i32;
    let high: Vec<i32> = weights.iter().map(|weight| (weight + LOW / 2).div_euclid(LOW)).collect();
    let low = weights.iter().zip(&high).map(|(weight, high)| weight - high * LOW).collect();
    [(high, bias.div_euclid(LOW.into())), (low, bias.rem_euclid(LOW.into()))]
}

/// Returns a warning if sums decide nothing for usual features, or if their rounding may decide, otherwise no text; and
/// whether it may decide.
///
/// `bounds` are the largest errors of the sums for usual features.
fn warning(model: &Linear, classes: usize, bounds: &[f64]) -> (String, bool) {
    let (rows, is_of_classes) = (&model.rows, !model.pairs && model.rows.len() == classes);
    let what = match rows.len() {
        _ if is_of_classes => "classes",
        1 => "pair of classes",
        _ => "pairs of classes",
    };
    let zero = Row { weights: vec![0.0; rows.first().map_or(0, |row| row.weights.len())], bias: 0.0 };
    let is_fixed = |row: &&Row| {
        if is_of_classes {
            return rows.iter().any(|other| range(row, other).1 < 0.0);
        }
        let (least, most) = range(row, &zero);
        least > 0.0 || most <= 0.0
    };
    let (fixed, count) = (rows.iter().filter(is_fixed).count(), rows.len());
    let most = rows.iter().map(|row| range(row, &zero)).fold(0.0, |most, (least, largest)| (largest - least).max(most));
    // Scores that cannot reach the margin have a unit of their own.
    let margin = if most < 2.0 * MARGIN { most / REACH } else { MARGIN };
    // Scores of classes are compared with each other, so that the errors of two of them count.
    let other = |row: usize| (0..count).filter(|&other| other != row).fold(0.0, |most, other| bounds[other].max(most));
    let off = |row: usize| bounds[row] + if is_of_classes { other(row) } else { 0.0 };
    let unsure = (0..count).filter(|&row| off(row) >= margin && off(row) > 0.0).count();
    let is_unsure = unsure > 0 && classes > 1;
    if fixed > 0 {
        let never = if is_of_classes { "can never be the answer" } else { "can have only one winner" };
        let [low, high] = [USUAL.0, USUAL.1].map(|end| end / ONE);
        let text = format!(
            "; warning: {fixed} of {count} {what} {never} for features of {low:.2} to {high:.2}: was it trained on X times \
             its scale?; {USE_SCALE}"
        );
        return (text, is_unsure);
    }
    if !is_unsure {
        return (String::new(), false);
    }
    let text = format!(
        "; warning: rounded weights may change the scores of {unsure} of {count} {what} by the margin of their training or \
         more, and with them answers; help: train an SVM or a logistic regression on X * scale without a StandardScaler, \
         import it with --weights int16 or int32{COUNTED_BY_CHECK}"
    );
    (text, true)
}

/// Returns a row's bias with what rounding takes from the sum of the mean.
///
/// Then most of it does not reach other samples either.
pub(super) fn corrected(row: &Row, integers: &[f64], scale: f64, mean: Option<&[f64]>) -> f64 {
    let lost = |((weight, integer), mean): ((&f64, &f64), &f64)| (weight - integer / scale) * mean;
    row.bias + mean.map_or(0.0, |mean| row.weights.iter().zip(integers).zip(mean).map(lost).sum())
}

/// Returns a row's weights as integers up to `full`, each to the nearest, or with what rounding left of the frame
/// before.
///
/// Light changes little from frame to frame, so that what is left then hardly changes a sum.
pub(super) fn rounded(row: &Row, scale: f64, full: f64, frames: usize, carries: bool) -> Vec<f64> {
    let mut left = 0.0;
    let whole = |(input, weight): (usize, &f64)| {
        let wanted = weight * scale + if carries && input % frames.min(SAMPLE_FRAMES) > 0 { left } else { 0.0 };
        let whole = wanted.round().clamp(-full, full);
        left = wanted - whole;
        whole
    };
    row.weights.iter().enumerate().map(whole).collect()
}

/// Returns the least and the largest difference of two sums for usual features.
fn range(row: &Row, other: &Row) -> (f64, f64) {
    let weights = row.weights.iter().zip(&other.weights).map(|(weight, other)| weight - other);
    ends(row.bias - other.bias, weights.map(|weight| (weight, [USUAL.0 / ONE, USUAL.1 / ONE])))
}

/// Returns the factor for weights with which the largest of these rows is `full`, and no bias times it exceeds
/// `most_bias`.
pub(super) fn scale(rows: &[Row], full: f64, most_bias: f64) -> f64 {
    let largest = rows.iter().flat_map(|row| &row.weights).fold(0.0_f64, |most, weight| most.max(weight.abs()));
    // Without weights only biases count; any scale at which they fit is suitable.
    let largest_bias = rows.iter().fold(0.0_f64, |most, row| most.max(row.bias.abs()));
    (full / largest.max(1e-290)).min(most_bias / largest_bias.max(1e-290))
}
