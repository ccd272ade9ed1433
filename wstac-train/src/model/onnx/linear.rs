//! `LinearClassifier`, and `SVMClassifier` with a linear kernel, as weighted sums.

use super::path::ClassifierOutput;
use super::proto::Node;
use super::steps::Before;
use super::sums::linear;
use super::{Read, attribute, floats, integers, labels, post_transform};
use crate::model::check::FLOAT32_SPREAD;
use crate::model::trained::{Kind, Linear, Row, frames};
use crate::model::usual_mean;

/// Reads `LinearClassifier`.
pub(super) fn classifier(node: &Node, before: Before) -> Result<Read, String> {
    let (rows, labels) = rows(node, &before)?;
    let inputs = before.inputs(Some(rows[0].weights.len()))?;
    linear(rows, vec![before], inputs, ClassifierOutput::Label(labels))
}

/// Reads the weighted sums of `LinearClassifier`, and its labels.
pub(super) fn rows(node: &Node, before: &Before) -> Result<(Vec<Row>, Vec<String>), String> {
    let labels = labels(node, "classlabels_ints")?;
    let transform = post_transform(node);
    // All of them keep the order of scores, so the label is the same.
    if !matches!(transform.as_str(), "NONE" | "SOFTMAX" | "LOGISTIC") {
        return Err(format!("LinearClassifier: post_transform {transform}, expected NONE, SOFTMAX or LOGISTIC"));
    }
    let (coefficients, intercepts) = (floats(node, "coefficients")?, floats(node, "intercepts")?);
    let classes = labels.len();
    let count = match intercepts.len() {
        0 => {
            let given = before.width.map(|width| before.given(width)).transpose()?;
            rows_without_intercepts(coefficients.len(), classes, given)?
        }
        rows => rows,
    };
    if count != classes && !(count == 1 && classes == 2)
        || coefficients.is_empty()
        || !coefficients.len().is_multiple_of(count)
    {
        let (found, biases) = (coefficients.len(), intercepts.len());
        return Err(format!("LinearClassifier: {found} coefficients and {biases} intercepts for {classes} classes"));
    }
    let rows = coefficients.chunks(coefficients.len() / count).enumerate().map(|(row, weights)| Row {
        weights: weights.iter().map(|&weight| f64::from(weight)).collect(),
        bias: f64::from(intercepts.get(row).copied().unwrap_or(0.0)),
    });
    Ok((rows.collect(), labels))
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
pub(super) fn svm(node: &Node, mut before: Before) -> Result<Read, String> {
    let labels = labels(node, "classlabels_ints")?;
    let classes = labels.len();
    let kernel = attribute(node, "kernel_type").and_then(|attribute| attribute.s.as_deref()).unwrap_or(b"LINEAR");
    if kernel != b"LINEAR" {
        let kernel = String::from_utf8_lossy(kernel);
        return Err(format!(
            "SVMClassifier: kernel_type {kernel}, expected LINEAR: train SVC(kernel=\"linear\"), or trees"
        ));
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
        let [numbers, factors, rho] = [vectors.len(), coefficients.len(), rho.len()];
        return Err(format!(
            "SVMClassifier: {numbers} numbers of {count} support vectors, {factors} coefficients and {rho} rho do not \
             belong together"
        ));
    }
    let taken = vectors.len() / count;
    // There may be many pairs, so the number of inputs must be limited.
    let inputs = before.inputs(Some(taken))?;
    let mut rows = Vec::with_capacity(pairs);
    // Coefficients are rounded to float32, and multiply sums of many products, which cancel if all vectors are alike.
    let usual = before.applied(vec![usual_mean(inputs); inputs]);
    let product = |vector: &[f32]| vector.iter().zip(&usual).map(|(&x, usual)| f64::from(x) * usual).sum::<f64>();
    let products: Vec<f64> = vectors.chunks_exact(taken.max(1)).map(product).collect();
    for first in 0..classes {
        for second in first + 1..classes {
            let mut variance = 0.0;
            let mut row = Row { weights: vec![0.0; taken], bias: f64::from(rho[rows.len()]) };
            // libsvm keeps a vector's coefficients against the other classes in rows, without its own class.
            for (class, line) in [(first, second - 1), (second, first)] {
                let start: usize = counts[..class].iter().sum();
                for vector in start..start + counts[class] {
                    let coefficient = f64::from(coefficients[line * count + vector]);
                    variance += (coefficient * products[vector] * FLOAT32_SPREAD).powi(2);
                    if coefficient != 0.0 {
                        let vector = &vectors[vector * taken..][..taken];
                        row.weights.iter_mut().zip(vector).for_each(|(sum, &x)| *sum += coefficient * f64::from(x));
                    }
                }
            }
            rows.push(row);
            before.spreads.push(variance.sqrt());
        }
    }
    before.fold(&mut rows, inputs)?;
    let kind = Kind::Linear(Linear { pairs: true, rows });
    Ok(Read { inputs, kind, answer: ClassifierOutput::Label(labels), before })
}
