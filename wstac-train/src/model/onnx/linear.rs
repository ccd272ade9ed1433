//! `LinearClassifier`, and `SVMClassifier` with a linear kernel, as weighted sums.

use super::path::{Before, ClassifierOutput};
use super::proto::Node;
use super::scaler::fold;
use super::{Read, attribute, floats, integers, labels, post_transform};
use crate::model::trained::{Kind, Linear, Row, frames};

/// Reads the weighted sums of `LinearClassifier`.
pub(super) fn classifier(node: &Node, before: &Before) -> Result<Read, String> {
    let labels = labels(node, "classlabels_ints")?;
    let transform = post_transform(node);
    // All of them keep the order of scores, so the label is the same.
    if !matches!(transform.as_str(), "NONE" | "SOFTMAX" | "LOGISTIC") {
        return Err(format!("LinearClassifier: post_transform {transform}, expected NONE, SOFTMAX or LOGISTIC"));
    }
    let (coefficients, intercepts) = (floats(node, "coefficients")?, floats(node, "intercepts")?);
    let classes = labels.len();
    let rows = match intercepts.len() {
        0 => rows_without_intercepts(coefficients.len(), classes, before.width)?,
        rows => rows,
    };
    if rows != classes && !(rows == 1 && classes == 2)
        || coefficients.is_empty()
        || !coefficients.len().is_multiple_of(rows)
    {
        let counts = (coefficients.len(), intercepts.len());
        return Err(format!(
            "LinearClassifier: {} coefficients and {} intercepts for {classes} classes",
            counts.0, counts.1
        ));
    }
    let inputs = coefficients.len() / rows;
    frames(inputs)?;
    let mut rows: Vec<Row> = coefficients
        .chunks(inputs)
        .enumerate()
        .map(|(row, weights)| Row {
            weights: weights.iter().map(|&weight| f64::from(weight)).collect(),
            bias: f64::from(intercepts.get(row).copied().unwrap_or(0.0)),
        })
        .collect();
    if let [first, second] = &mut rows[..] {
        // For two classes one sum is enough: the second class wins if its sum is above that of the first.
        second.weights.iter_mut().zip(&first.weights).for_each(|(second, first)| *second -= first);
        second.bias -= first.bias;
        rows.remove(0);
    }
    fold(&mut rows, &before.scalers)?;
    Ok(Read { inputs, kind: Kind::Linear(Linear { pairs: false, rows }), answer: ClassifierOutput::Label(labels) })
}

/// Returns the number of rows of coefficients if no intercepts show it.
///
/// For two classes it may be one, of the second class, or two.
fn rows_without_intercepts(coefficients: usize, classes: usize, width: Option<usize>) -> Result<usize, String> {
    let possible: Vec<usize> = [1, classes]
        .into_iter()
        .filter(|&rows| rows == classes || classes == 2)
        .filter(|&rows| coefficients.is_multiple_of(rows))
        .filter(|&rows| width.map_or(frames(coefficients / rows).is_ok(), |width| rows * width == coefficients))
        .collect();
    match possible[..] {
        [rows] => Ok(rows),
        [] => {
            let inputs = width.map_or("inputs of unknown number".into(), |width| format!("{width} inputs"));
            Err(format!("LinearClassifier: {coefficients} coefficients of {classes} classes and {inputs}"))
        }
        _ => Err(format!(
            "LinearClassifier: {coefficients} coefficients are one row or two, expected intercepts, or an ONNX input \
             whose shape says how many inputs there are"
        )),
    }
}

/// Reads the weighted sums of `SVMClassifier`: each pair of classes has its own, from the support vectors of both.
pub(super) fn svm(node: &Node, before: &Before) -> Result<Read, String> {
    let labels = labels(node, "classlabels_ints")?;
    let classes = labels.len();
    let kernel = attribute(node, "kernel_type").and_then(|attribute| attribute.s.as_deref()).unwrap_or(b"LINEAR");
    if kernel != b"LINEAR" {
        let kernel = String::from_utf8_lossy(kernel);
        return Err(format!("SVMClassifier: kernel_type {kernel}, expected LINEAR"));
    }
    // Votes decide the label also if there are numbers for probabilities (prob_a, prob_b).
    let (vectors, coefficients, rho) =
        (floats(node, "support_vectors")?, floats(node, "coefficients")?, floats(node, "rho")?);
    let counts: Option<Vec<usize>> =
        integers(node, "vectors_per_class").iter().map(|&count| usize::try_from(count).ok()).collect();
    let counts = counts.filter(|counts| counts.len() == classes && classes > 1);
    let counts = counts.ok_or("SVMClassifier: vectors_per_class, expected a count for each class")?;
    let count = counts.iter().try_fold(0_usize, |sum, &count| sum.checked_add(count)).unwrap_or(usize::MAX);
    let pairs = classes * (classes - 1) / 2;
    let fits =
        count > 0 && vectors.len().is_multiple_of(count) && Some(coefficients.len()) == count.checked_mul(classes - 1);
    if !fits || rho.len() != pairs {
        let found = (vectors.len(), coefficients.len(), rho.len());
        return Err(format!(
            "SVMClassifier: {} numbers of {count} support vectors, {} coefficients and {} rho do not belong together",
            found.0, found.1, found.2
        ));
    }
    let inputs = vectors.len() / count;
    // There may be many pairs, so the number of inputs must be limited.
    frames(inputs)?;
    let starts: Vec<usize> = counts
        .iter()
        .scan(0, |start, &count| {
            *start += count;
            Some(*start - count)
        })
        .collect();
    let mut rows = Vec::with_capacity(pairs);
    for first in 0..classes {
        for second in first + 1..classes {
            let mut row = Row { weights: vec![0.0; inputs], bias: f64::from(rho[rows.len()]) };
            // libsvm keeps a vector's coefficients against the other classes in rows, without its own class.
            for (class, line) in [(first, second - 1), (second, first)] {
                for vector in starts[class]..starts[class] + counts[class] {
                    let coefficient = f64::from(coefficients[line * count + vector]);
                    if coefficient != 0.0 {
                        let vector = &vectors[vector * inputs..][..inputs];
                        row.weights.iter_mut().zip(vector).for_each(|(sum, &x)| *sum += coefficient * f64::from(x));
                    }
                }
            }
            rows.push(row);
        }
    }
    fold(&mut rows, &before.scalers)?;
    Ok(Read { inputs, kind: Kind::Linear(Linear { pairs: true, rows }), answer: ClassifierOutput::Label(labels) })
}
