//! `TreeEnsemble`, from version 5 of ONNX's machine learning operators: a forest, or trees that add up to scores.
//!
//! Each of its leaves has a weight of one class. So a forest of soft votes has a tree for each class, or only leaves of
//! one class.

use super::proto::{Graph, Node as OnnxNode};
use super::steps::Before;
use super::sums::highest;
use super::tensor::Tensor;
use super::trees::{Leaf, merged, scores, split, votes};
use super::{Read, attribute, integers, numbers, thresholds};
use crate::model::trained::{Kind, MOST_NODES, Node, Tree};

const MODES: [&str; 7] =
    ["BRANCH_LEQ", "BRANCH_LT", "BRANCH_GTE", "BRANCH_GT", "BRANCH_EQ", "BRANCH_NEQ", "BRANCH_MEMBER"];
const AVERAGE: i64 = 0;
const SUM: i64 = 1;
const NONE: i64 = 0;
const SOFTMAX: i64 = 1;

/// Reads the trees of `TreeEnsemble`.
pub(super) fn read(graph: &Graph, node: &OnnxNode, before: Before) -> Result<Read, String> {
    let wrong = |why: String| format!("TreeEnsemble: {why}");
    let number = |name, default| attribute(node, name).and_then(|found| found.i).unwrap_or(default);
    let (aggregate, transform) = (number("aggregate_function", SUM), number("post_transform", NONE));
    if !matches!(aggregate, AVERAGE | SUM) {
        return Err(wrong(format!("aggregate_function {aggregate}, expected AVERAGE (0) or SUM (1)")));
    }
    if !matches!(transform, NONE | SOFTMAX) {
        return Err(wrong(format!("post_transform {transform}, expected NONE (0) or SOFTMAX (1)")));
    }
    let most = wstac_core::model::file::MOST_CLASSES;
    let classes = usize::try_from(number("n_targets", 0)).ok().filter(|classes| (1..=most).contains(classes));
    let classes =
        classes.ok_or_else(|| wrong(format!("n_targets {}, expected 1 to {most}", number("n_targets", 0))))?;
    let inputs = before.inputs(None)?;
    let trees = Lists::read(node).and_then(|lists| lists.trees(classes, &before)).map_err(wrong)?;
    let scores_name = node.output.first().ok_or("an ONNX node has no output")?;
    let answer = highest(graph, scores_name, classes, None, true)?;
    // Leaves that all weigh the same are complete votes; others may be parts of votes.
    let mut single = trees.clone();
    if votes(&mut single, false).is_ok() {
        return Ok(Read { inputs, kind: Kind::Forest(single), answer, before });
    }
    let mut whole = merged(&trees);
    let Err(no_votes) = votes(&mut whole, false) else {
        return Ok(Read { inputs, kind: Kind::Forest(whole), answer, before });
    };
    if aggregate == AVERAGE {
        return Err(wrong(format!("{no_votes}; other trees are understood where they are added (SUM)")));
    }
    let boosted = scores(&trees, classes).map_err(|no_scores| wrong(format!("{no_votes}; {no_scores}")))?;
    Ok(Read { inputs, kind: Kind::Boosted(boosted), answer, before })
}

/// The operator's lists: one entry for each node, for each leaf, for each tree.
struct Lists<'m> {
    modes: Vec<i64>,
    inputs: &'m [i64],
    thresholds: Vec<f64>,
    /// Children for a true and for a false comparison: the number of the child, and whether it is a leaf.
    children: [(&'m [i64], &'m [i64]); 2],
    classes: &'m [i64],
    weights: Vec<f64>,
    roots: &'m [i64],
}

impl<'m> Lists<'m> {
    fn read(node: &'m OnnxNode) -> Result<Self, String> {
        let modes = attribute(node, "nodes_modes").and_then(|modes| modes.t.as_ref());
        let lists = Self {
            modes: Tensor::of(modes.ok_or("nodes_modes is missing, expected a tensor of uint8")?)?.integers,
            inputs: integers(node, "nodes_featureids"),
            thresholds: thresholds(node, "nodes_splits")?,
            children: [
                (integers(node, "nodes_truenodeids"), integers(node, "nodes_trueleafs")),
                (integers(node, "nodes_falsenodeids"), integers(node, "nodes_falseleafs")),
            ],
            classes: integers(node, "leaf_targetids"),
            weights: numbers(node, "leaf_weights")?,
            roots: integers(node, "tree_roots"),
        };
        let count = lists.modes.len();
        let [(yes, yes_leaf), (no, no_leaf)] = lists.children.map(|(child, leaf)| (child.len(), leaf.len()));
        let lengths = [lists.inputs.len(), lists.thresholds.len(), yes, yes_leaf, no, no_leaf];
        if count == 0 || lengths.iter().any(|&length| length != count) {
            return Err(format!("lists of {lengths:?} nodes, expected {count} in each, as in nodes_modes"));
        }
        let leaves = (lists.classes.len(), lists.weights.len());
        if leaves.0 != leaves.1 {
            return Err(format!("{} leaf_targetids and {} leaf_weights, expected as many", leaves.0, leaves.1));
        }
        if lists.roots.is_empty() || lists.roots.len() > usize::from(u16::MAX) {
            return Err(format!("{} tree_roots, expected 1 to 65535", lists.roots.len()));
        }
        Ok(lists)
    }

    fn trees(&self, classes: usize, before: &Before) -> Result<Vec<Tree<Leaf>>, String> {
        let mut reached = vec![false; self.modes.len()];
        let mut left = MOST_NODES;
        let mut trees = Vec::with_capacity(self.roots.len());
        for &root in self.roots {
            trees.push(self.tree(root, classes, before, &mut reached, &mut left)?);
        }
        Ok(trees)
    }

    /// Builds the tree of a root.
    fn tree(
        &self,
        root: i64,
        classes: usize,
        before: &Before,
        reached: &mut [bool],
        left: &mut usize,
    ) -> Result<Tree<Leaf>, String> {
        let mut nodes = vec![Node::Leaf(Vec::new())];
        // The remaining nodes, and the positions of their numbers.
        let mut waiting = vec![(Child::Node(root), 0)];
        while let Some((child, place)) = waiting.pop() {
            *left = left.checked_sub(1).ok_or_else(|| format!("more than {MOST_NODES} nodes"))?;
            let number = match child {
                Child::Node(number) => number,
                Child::Leaf(number) => {
                    nodes[place] = Node::Leaf(vec![self.leaf(number, classes)?]);
                    continue;
                }
            };
            let at = usize::try_from(number).ok().filter(|&at| at < self.modes.len());
            let at = at.ok_or_else(|| format!("node {number}, expected one of {}", self.modes.len()))?;
            if std::mem::replace(&mut reached[at], true) {
                return Err(format!("node {at} is reached twice, expected one parent or root for each node"));
            }
            let [yes, no] = self
                .children
                .map(|(child, is_leaf)| if is_leaf[at] == 0 { Child::Node(child[at]) } else { Child::Leaf(child[at]) });
            // A tree of one leaf is a node with the same leaf on both sides.
            if place == 0
                && let (Child::Leaf(yes), Child::Leaf(no)) = (yes, no)
                && yes == no
            {
                nodes[0] = Node::Leaf(vec![self.leaf(yes, classes)?]);
                continue;
            }
            let places = (nodes.len(), nodes.len() + 1);
            let mode = usize::try_from(self.modes[at]).ok().and_then(|mode| MODES.get(mode));
            let mode = mode.ok_or_else(|| format!("node {at}: mode {}, expected 0 to 3", self.modes[at]))?;
            let split = split(mode, self.inputs[at], self.thresholds[at], places, before);
            nodes[place] = split.map_err(|why| format!("node {at}: {why}"))?;
            nodes.extend([Node::Leaf(Vec::new()), Node::Leaf(Vec::new())]);
            waiting.extend([(yes, places.0), (no, places.1)]);
        }
        Ok(Tree { nodes })
    }

    /// Returns the class of a leaf, and its weight.
    fn leaf(&self, number: i64, classes: usize) -> Result<(u16, f64), String> {
        let at = usize::try_from(number).ok().filter(|&at| at < self.weights.len());
        let at = at.ok_or_else(|| format!("leaf {number}, expected one of {}", self.weights.len()))?;
        let class = u16::try_from(self.classes[at]).ok().filter(|&class| usize::from(class) < classes);
        let class =
            class.ok_or_else(|| format!("leaf_targetids[{at}] is {}, expected below {classes}", self.classes[at]))?;
        Ok((class, self.weights[at]))
    }
}

/// A child of a node, or a root.
#[derive(Clone, Copy)]
enum Child {
    Node(i64),
    Leaf(i64),
}
