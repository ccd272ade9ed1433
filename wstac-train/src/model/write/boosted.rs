//! Boosted trees: leaves as they are, or rounded to int16 with one scale.

use super::super::exact;
use super::super::integers::{Part, integers};
use super::super::trained::{Boosted, Tree, input_for};
use super::layout::{LeafSize, lay_out};
use super::{Body, Leaves, push_long};

/// Boosted trees with integer thresholds.
pub(in crate::model) struct Sums {
    /// The start value and the trees of each score.
    ///
    /// Starts are bits of float32 or int32; leaves are bits of float32 or int16.
    pub(in crate::model) scores: Vec<(u32, Vec<Vec<Part>>)>,
    /// Bound of a single score, as bits of float32 or int32: above it the second class is the answer.
    pub(in crate::model) bound: u32,
    /// `true` if leaves are int16.
    pub(in crate::model) short: bool,
    /// Agreement of sums with those of the trained model, in words.
    pub(in crate::model) exactness: String,
}

/// Converts boosted trees to integer thresholds, with the bits of their leaves.
pub(in crate::model) fn sums(model: &Boosted, classes: usize, inputs: usize, leaves: Leaves) -> Result<Sums, String> {
    let trees = model.scores.iter().map(|score| score.trees.len()).sum::<usize>();
    u16::try_from(trees).map_err(|_| format!("{trees} trees, expected at most 65535"))?;
    if model.scores.len() != classes && !(model.scores.len() == 1 && classes == 2) {
        return Err(format!("{} scores, expected one for each of {classes} classes", model.scores.len()));
    }
    let numbers = || model.scores.iter().map(|score| score.start).chain([model.bound]);
    if let Some(number) = numbers().find(|&number| !is_moderate(number)) {
        return Err(format!("a score starts with, or is compared to, {number}, expected a finite number below 2^96"));
    }
    let proven = if leaves == Leaves::Float32 { None } else { exact::units(model) };
    let short = leaves == Leaves::Int16 || proven.is_some();
    let scale = if short { proven.unwrap_or_else(|| scale(model)) } else { 1.0 };
    let bits = |number: f32| {
        if short { (f64::from(number) * scale).round() as i32 as u32 } else { number.to_bits() }
    };
    // Whole numbers are above the bound exactly if they are above its integer part.
    let bound = if short { (f64::from(model.bound) * scale).floor() as i32 as u32 } else { model.bound.to_bits() };
    let mut scores = Vec::with_capacity(model.scores.len());
    for (class, score) in model.scores.iter().enumerate() {
        let mut parts = Vec::with_capacity(score.trees.len());
        for (number, tree) in score.trees.iter().enumerate() {
            let tree = integers(tree, inputs, |&leaf| {
                if !is_moderate(leaf) {
                    return Err(format!("leaf {leaf}, expected a finite number below 2^96"));
                }
                Ok(if short { bits(leaf) & 0xFFFF } else { bits(leaf) })
            });
            parts.push(tree.map_err(|why| format!("tree {number} of score {class}: {why}"))?);
        }
        scores.push((bits(score.start), parts));
    }
    let most = model.scores.iter().map(|score| score.trees.len()).max().unwrap_or(0);
    let exactness = if proven.is_some() {
        "thresholds are exact; leaves are int16, and their sums proven to be those of float32".into()
    } else if short {
        let bound = (most as f64 + 1.0) * 0.5 / scale;
        format!(
            "thresholds are exact; leaves are in units of {:.2e}: a score is off by {bound:.2e} at most",
            1.0 / scale
        )
    } else {
        "thresholds, leaves and the order of their sums are exact".into()
    };
    Ok(Sums { scores, bound, short, exactness })
}

pub(super) fn body(model: &Boosted, classes: usize, inputs: usize, leaves: Leaves) -> Result<Body, String> {
    let sums = sums(model, classes, inputs, leaves)?;
    let mut halves = vec![sums.scores.len() as u16];
    push_long(&mut halves, sums.bound);
    for (start, trees) in &sums.scores {
        halves.push(trees.len() as u16);
        push_long(&mut halves, *start);
    }
    let trees: Vec<Vec<Part>> = sums.scores.into_iter().flat_map(|(_, trees)| trees).collect();
    let (number, size) = if sums.short { (2, LeafSize::Half) } else { (3, LeafSize::TwoHalves) };
    let (tree_halves, shift) = lay_out(&trees, size, input_for(inputs))?;
    halves.extend(tree_halves);
    let (count, exactness) = (trees.len() as u16, sums.exactness);
    Ok(Body { kind: 4, number, trees: count, shift, halves, exactness, ..Body::default() })
}

/// Returns the scale that makes the largest leaf 32 767, or less so that starts and sums fit in 32 bits.
fn scale(model: &Boosted) -> f64 {
    let mut scale = f64::MAX;
    for score in &model.scores {
        let leaves = score.trees.iter().flat_map(Tree::leaves).filter(|leaf| leaf.is_finite());
        let largest = leaves.map(|leaf| f64::from(leaf.abs())).fold(0.0, f64::max);
        let room = f64::from(i32::MAX) - 32_768.0 * score.trees.len() as f64 - 1.0;
        scale = scale.min(32_767.0 / largest.max(1e-30)).min(room.max(1.0) / f64::from(score.start.abs()).max(1e-30));
    }
    scale.min(f64::from(i32::MAX) / f64::from(model.bound.abs()).max(1e-30))
}

/// Returns `true` if a number is finite and so small that no sum of such numbers overflows.
fn is_moderate(number: f32) -> bool {
    number.abs() < 2.0_f32.powi(96)
}
