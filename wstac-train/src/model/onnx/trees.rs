//! Code that both operators of trees share: comparisons, and the combination of leaf weights.

use std::collections::HashMap;

use super::steps::Before;
use crate::model::trained::{Boosted, MOST_NODES, Node, Score, Tree};

/// The classes of a leaf, and its contribution to each.
pub(super) type Leaf = Vec<(u16, f64)>;

/// Largest error of a fraction from float32, relative to 1.
const NEAR: f64 = 1.5e-7;
/// Largest number of training samples in a leaf whose fractions are recognized.
const MOST_SAMPLES: u32 = 1024;
/// Largest deviation of the total weight of a leaf from one vote.
const ABOUT: f64 = 1e-4;

/// Creates a node that compares; its children are those for a true and for a false comparison.
pub(super) fn split(
    mode: &str,
    input: i64,
    threshold: f64,
    (yes, no): (usize, usize),
    before: &Before,
) -> Result<Node<Leaf>, String> {
    let (strict, left, right) = match mode {
        "BRANCH_LEQ" => (false, yes, no),
        "BRANCH_LT" => (true, yes, no),
        // At least is the opposite of below, above is the opposite of at most.
        "BRANCH_GTE" => (true, no, yes),
        "BRANCH_GT" => (false, no, yes),
        _ => return Err(format!("mode {mode}, expected BRANCH_LEQ, BRANCH_LT, BRANCH_GTE, BRANCH_GT or a leaf")),
    };
    let index = usize::try_from(input).map_err(|_| format!("input {input}, expected a number from 0 on"))?;
    let (input, threshold, strict) = before.split(index, threshold, strict)?;
    Ok(Node::Split { input, threshold, strict, left, right })
}

/// Turns weights into votes.
///
/// The weights of each leaf have the same total: 1, or 1 divided by the number of trees, or any other. If `single` is
/// set, weights are those of the second of two classes, and the first has the rest.
pub(super) fn votes(trees: &mut [Tree<Leaf>], single: bool) -> Result<(), String> {
    let count = trees.len() as f64;
    let sum = |leaf: &Leaf| leaf.iter().map(|share| share.1).sum::<f64>();
    let first = trees.first().and_then(|tree| tree.leaves().next()).map_or(0.0, sum);
    let factor = if single || (first * count - 1.0).abs() <= ABOUT {
        count
    } else if (first - 1.0).abs() <= ABOUT || first <= 0.0 {
        1.0
    } else {
        1.0 / first
    };
    for (number, tree) in trees.iter_mut().enumerate() {
        for node in &mut tree.nodes {
            let Node::Leaf(leaf) = node else { continue };
            for share in &mut *leaf {
                share.1 *= factor;
            }
            if single {
                let second = leaf.first().map_or(0.0, |share| share.1);
                // If the second class has the whole vote, float32 leaves a tiny rest for the first.
                let first = 1.0 - second;
                leaf.push((0, if first.abs() <= NEAR { 0.0 } else { first }));
            }
            unrounded(leaf);
            leaf.retain(|share| share.1 != 0.0);
            if (sum(leaf) - 1.0).abs() > ABOUT || leaf.iter().any(|share| share.1 < 0.0) {
                let found = sum(leaf) / factor;
                return Err(format!(
                    "a leaf of tree {number} has weights of {found} together, expected {} as in a forest of votes",
                    1.0 / factor
                ));
            }
        }
    }
    Ok(())
}

/// Restores the fractions that weights were before float32, if all of a leaf have one small denominator.
///
/// Votes that were equal become equal again.
fn unrounded(leaf: &mut Leaf) {
    let numerator = |share: f64, of: f64| {
        let whole = (share * of).round();
        ((share * of - whole).abs() <= NEAR * of * share.abs().max(NEAR)).then_some(whole)
    };
    let fits = |of: &f64| leaf.iter().all(|share| numerator(share.1, *of).is_some());
    if let Some(of) = (1..=MOST_SAMPLES).map(f64::from).find(fits) {
        for share in &mut *leaf {
            share.1 = (share.1 * of).round() / of;
        }
    }
}

/// Merges trees that differ only in the class of each leaf.
///
/// Operators with one class for each leaf write a forest's tree as several trees.
pub(super) fn merged(trees: &[Tree<Leaf>]) -> Vec<Tree<Leaf>> {
    let mut groups: Vec<Tree<Leaf>> = Vec::new();
    // The last groups of a shape, which still lack classes.
    let mut open: HashMap<Vec<u64>, usize> = HashMap::new();
    for tree in trees {
        let shape = shape(tree);
        if let Some(&group) = open.get(&shape)
            && let Some(both) = both(&groups[group], tree)
        {
            groups[group] = both;
        } else {
            open.insert(shape, groups.len());
            groups.push(tree.clone());
        }
    }
    groups
}

/// Returns all properties of a tree's nodes except their leaves; trees of one operator list their nodes in the same
/// way.
fn shape(tree: &Tree<Leaf>) -> Vec<u64> {
    let mut shape = Vec::with_capacity(tree.nodes.len());
    for node in &tree.nodes {
        match node {
            Node::Leaf(_) => shape.push(u64::MAX),
            Node::Split { input, threshold, strict, left, right } => {
                shape.extend([
                    *input as u64 * 2 + u64::from(*strict),
                    threshold.to_bits(),
                    *left as u64,
                    *right as u64,
                ]);
            }
        }
    }
    shape
}

/// Merges two trees of one shape, or returns `None` if a leaf has the same class in both.
fn both(first: &Tree<Leaf>, second: &Tree<Leaf>) -> Option<Tree<Leaf>> {
    let mut nodes = Vec::with_capacity(first.nodes.len());
    for pair in first.nodes.iter().zip(&second.nodes) {
        nodes.push(match pair {
            (Node::Leaf(first), Node::Leaf(second)) => {
                if first.iter().any(|share| second.iter().any(|other| other.0 == share.0)) {
                    return None;
                }
                Node::Leaf([first.as_slice(), second].concat())
            }
            (node, _) => node.clone(),
        });
    }
    Some(Tree { nodes })
}

/// Returns trees that add up to scores, in float32 and in their order.
///
/// A tree of several classes becomes one for each, with leaves of 0 for the others. To add 0 changes no sum.
pub(super) fn scores(trees: &[Tree<Leaf>], classes: usize) -> Result<Boosted, String> {
    let mut scores = vec![Score { start: 0.0, trees: Vec::new() }; classes];
    let mut room = MOST_NODES;
    for (number, tree) in trees.iter().enumerate() {
        let inexact = |weight: &f64| f64::from(*weight as f32).to_bits() != weight.to_bits();
        if let Some(weight) = tree.leaves().flatten().map(|share| share.1).find(inexact) {
            return Err(format!("tree {number} has weight {weight}, expected a number of float32"));
        }
        for (class, score) in scores.iter_mut().enumerate() {
            let of_class = |leaf: &Leaf| leaf.iter().find(|share| usize::from(share.0) == class).map(|share| share.1);
            if tree.leaves().all(|leaf| of_class(leaf).is_none()) {
                continue;
            }
            room = room.checked_sub(tree.nodes.len()).ok_or_else(|| format!("more than {MOST_NODES} nodes"))?;
            let node = |node: &Node<Leaf>| match node {
                Node::Leaf(leaf) => Node::Leaf(of_class(leaf).unwrap_or(0.0) as f32),
                Node::Split { input, threshold, strict, left, right } => {
                    Node::Split { input: *input, threshold: *threshold, strict: *strict, left: *left, right: *right }
                }
            };
            score.trees.push(Tree { nodes: tree.nodes.iter().map(node).collect() });
        }
    }
    Ok(Boosted { scores, bound: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_classes_with_one_weight_a_leaf_are_votes_for_any_number_of_trees() {
        for count in 1..=300_usize {
            for second in [0.0, 0.25, 1.0] {
                let weight = f64::from((second / count as f64) as f32);
                let mut trees = vec![Tree { nodes: vec![Node::Leaf(vec![(1, weight)])] }; count];
                votes(&mut trees, true).unwrap();
                let Node::Leaf(leaf) = &trees[0].nodes[0] else { panic!() };
                let shares = [0, 1].map(|class| leaf.iter().filter(|share| share.0 == class).map(|s| s.1).sum::<f64>());
                assert!((shares[0] - (1.0 - second)).abs() < 1e-12, "{count} {leaf:?}");
                assert!((shares[1] - second).abs() < 1e-12, "{count} {leaf:?}");
            }
        }
    }

    #[test]
    fn shares_are_the_fractions_that_they_were() {
        for of in 1..=300_u32 {
            for part in 0..=of {
                for trees in [1.0, 3.0, 100.0, 777.0] {
                    let exact = [part, of - part].map(|part| f64::from(part) / f64::from(of));
                    let mut leaf: Leaf = (0..)
                        .zip(exact)
                        .map(|(class, share)| (class, f64::from((share / trees) as f32) * trees))
                        .collect();
                    unrounded(&mut leaf);
                    // The same fraction, but with its smallest denominator.
                    assert!((leaf[0].1 - exact[0]).abs() < 1e-15, "{part}/{of}");
                    assert!((leaf[1].1 - exact[1]).abs() < 1e-15, "{part}/{of}");
                }
            }
        }
    }

    #[test]
    fn shares_that_are_no_fractions_stay() {
        let share = std::f64::consts::FRAC_1_SQRT_2;
        let mut leaf = vec![(0, share), (1, 1.0 - share)];
        let before = leaf.clone();
        unrounded(&mut leaf);
        assert_eq!(leaf, before);
    }
}
