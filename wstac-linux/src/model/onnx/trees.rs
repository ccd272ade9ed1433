//! `TreeEnsembleClassifier`, as a forest.

use std::collections::HashMap;

use super::proto::Node as OnnxNode;
use super::{Scaler, attribute, floats, integers, labels, post_transform};
use crate::model::trained::{Kind, MOST_NODES, Node, Tree};

type Leaf = Vec<(u16, f64)>;

/// Units of a feature.
const ONE: f64 = 2048.0;

/// A forest of `TreeEnsembleClassifier`.
pub(super) fn read(
    node: &OnnxNode,
    scaler: Option<&Scaler>,
    inputs: Option<usize>,
) -> Result<(usize, Kind, Vec<String>), String> {
    let labels = labels(node, "classlabels_int64s")?;
    let transform = post_transform(node);
    if transform != "NONE" {
        return Err(format!("TreeEnsembleClassifier: post_transform {transform}, expected NONE: a forest"));
    }
    if floats(node, "base_values")?.iter().any(|&base| base != 0.0) {
        return Err("TreeEnsembleClassifier: base_values, expected none: a forest".into());
    }
    let mut ensemble = Ensemble::read(node, scaler)?;
    ensemble.weights(node, labels.len())?;
    let count = ensemble.trees.len() as f64;
    for (number, tree) in ensemble.trees.iter_mut().enumerate() {
        for node in &mut tree.nodes {
            if let Node::Leaf(leaf) = node {
                whole(leaf, count, ensemble.single, number)?;
            }
        }
    }
    let inputs = inputs
        .ok_or("TreeEnsembleClassifier: the number of inputs is not stated, expected 700 in the shape of the input")?;
    Ok((inputs, Kind::Forest(ensemble.trees), labels))
}

struct Ensemble {
    trees: Vec<Tree<Leaf>>,
    /// Number of a tree and number of a node of it, by their names in the file.
    places: HashMap<(i64, i64), (usize, usize)>,
    /// Whether weights are of the second of two classes only.
    single: bool,
}

impl Ensemble {
    fn read(node: &OnnxNode, scaler: Option<&Scaler>) -> Result<Self, String> {
        let trees = integers(node, "nodes_treeids");
        let lists = ["nodes_nodeids", "nodes_featureids", "nodes_truenodeids", "nodes_falsenodeids"];
        let [names, inputs, left, right] = lists.map(|list| integers(node, list));
        let thresholds = floats(node, "nodes_values")?;
        let modes = attribute(node, "nodes_modes").map_or(&[][..], |attribute| &attribute.texts);
        let count = trees.len();
        let lengths = [names.len(), inputs.len(), left.len(), right.len(), thresholds.len(), modes.len()];
        if count == 0 || lengths.iter().any(|&length| length != count) {
            return Err(format!(
                "TreeEnsembleClassifier: lists of {lengths:?} nodes, expected {count} in each, as in nodes_treeids"
            ));
        }
        if count > MOST_NODES {
            return Err(format!("TreeEnsembleClassifier: {count} nodes, expected at most {MOST_NODES}"));
        }
        let mut ensemble = Self { trees: Vec::new(), places: HashMap::with_capacity(count), single: false };
        let mut roots = HashMap::new();
        for (&tree, &name) in trees.iter().zip(names) {
            let number = *roots.entry(tree).or_insert_with(|| {
                ensemble.trees.push(Tree { nodes: Vec::new() });
                ensemble.trees.len() - 1
            });
            if number >= usize::from(u16::MAX) {
                return Err("TreeEnsembleClassifier: more than 65535 trees".into());
            }
            let nodes = &mut ensemble.trees[number].nodes;
            if ensemble.places.insert((tree, name), (number, nodes.len())).is_some() {
                return Err(format!("TreeEnsembleClassifier: tree {tree} has two nodes {name}"));
            }
            nodes.push(Node::Leaf(Vec::new()));
        }
        for at in 0..count {
            let (tree, name) = (trees[at], names[at]);
            let wrong = |what: String| format!("TreeEnsembleClassifier: tree {tree}, node {name}: {what}");
            let strict = match modes[at] {
                b"BRANCH_LEQ" => false,
                b"BRANCH_LT" => true,
                b"LEAF" => continue,
                other => {
                    let mode = String::from_utf8_lossy(other);
                    return Err(wrong(format!("mode {mode}, expected BRANCH_LEQ, BRANCH_LT or LEAF")));
                }
            };
            let child = |child: i64| {
                let place = ensemble.places.get(&(tree, child)).map(|place| place.1);
                place.ok_or_else(|| wrong(format!("child {child}, expected a node of the tree")))
            };
            let (left, right) = (child(left[at])?, child(right[at])?);
            let input = usize::try_from(inputs[at]).ok().filter(|&input| input < 700);
            let input = input.ok_or_else(|| wrong(format!("input {}, expected one below 700", inputs[at])))?;
            let (mut threshold, mut strict) = (f64::from(thresholds[at]), strict);
            if let Some(scaler) = scaler {
                (threshold, strict) = (unscaled(thresholds[at], strict, scaler.of(input)?).map_err(wrong)?, false);
            }
            if let Some(&(number, node)) = ensemble.places.get(&(tree, name)) {
                ensemble.trees[number].nodes[node] = Node::Split { input, threshold, strict, left, right };
            }
        }
        Ok(ensemble)
    }

    /// Gives leaves their weights of classes.
    fn weights(&mut self, node: &OnnxNode, labels: usize) -> Result<(), String> {
        let lists = ["class_treeids", "class_nodeids", "class_ids"];
        let [trees, names, classes] = lists.map(|list| integers(node, list));
        let weights = floats(node, "class_weights")?;
        let lengths = [names.len(), classes.len(), weights.len()];
        if lengths.iter().any(|&length| length != trees.len()) {
            return Err(format!(
                "TreeEnsembleClassifier: lists of {lengths:?} weights, expected {} in each",
                trees.len()
            ));
        }
        // With weights of one class only, they are of the second of two, above one half.
        self.single = labels == 2 && classes.windows(2).all(|two| two[0] == two[1]);
        for at in 0..trees.len() {
            let (tree, name) = (trees[at], names[at]);
            let wrong = |what: &str| format!("TreeEnsembleClassifier: weight {at}: {what}");
            let place = self.places.get(&(tree, name)).ok_or_else(|| wrong("its node is none"))?;
            let Node::Leaf(leaf) = &mut self.trees[place.0].nodes[place.1] else {
                return Err(wrong("its node is no leaf"));
            };
            let class = if self.single { Some(1) } else { u16::try_from(classes[at]).ok() };
            let class = class.filter(|&class| usize::from(class) < labels).ok_or_else(|| wrong("its class is none"))?;
            if leaf.iter().any(|share| share.0 == class) {
                return Err(wrong("its leaf has one of this class already"));
            }
            leaf.push((class, f64::from(weights[at])));
        }
        Ok(())
    }
}

/// How far weights in float32 may be from what they were.
const NEAR: f64 = 1e-6;

/// Shares of one vote, of weights that were divided by the number of trees.
fn whole(leaf: &mut Leaf, trees: f64, single: bool, tree: usize) -> Result<(), String> {
    for (_, weight) in leaf.iter_mut() {
        *weight *= trees;
        if (*weight - weight.round()).abs() < NEAR {
            *weight = weight.round();
        }
    }
    if single {
        let second = leaf.first().map_or(0.0, |share| share.1);
        leaf.push((0, 1.0 - second));
    }
    leaf.retain(|share| share.1 != 0.0);
    let sum: f64 = leaf.iter().map(|share| share.1).sum();
    if (sum - 1.0).abs() > 1e-4 || leaf.iter().any(|share| share.1 < 0.0) {
        return Err(format!(
            "TreeEnsembleClassifier: a leaf of tree {tree} has weights of {sum} times the number of trees, expected 1: a forest of votes"
        ));
    }
    Ok(())
}

/// The threshold of unscaled inputs that decides for every integer as the scaled one does, in float32 as ONNX computes.
fn unscaled(threshold: f32, strict: bool, (offset, scale): (f32, f32)) -> Result<f64, String> {
    if scale <= 0.0 || !threshold.is_finite() {
        return Err(format!("threshold {threshold} of an input scaled by {scale}, expected finite and above 0"));
    }
    let left = |x: i32| {
        let scaled = ((f64::from(x) / ONE) as f32 - offset) * scale;
        if strict { scaled < threshold } else { scaled <= threshold }
    };
    // Left is a range from the lowest on, as the scale is above 0.
    let (mut from, mut to) = (i32::from(i16::MIN), i32::from(i16::MAX) + 1);
    while from < to {
        // Rounded down, unlike i32::midpoint: otherwise a range of two negative numbers would never end.
        let middle = (from + to) >> 1;
        if left(middle) { from = middle + 1 } else { to = middle }
    }
    Ok(f64::from(from - 1) / ONE)
}
