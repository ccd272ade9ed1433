//! `TreeEnsembleClassifier`, read as a forest.

use std::collections::HashMap;

use super::path::{Before, ClassifierOutput};
use super::proto::Node as OnnxNode;
use super::scaler::Scaler;
use super::trees::{Leaf, split, votes};
use super::{Read, attribute, integers, labels, numbers, post_transform};
use crate::model::trained::{Kind, MOST_NODES, Node, Tree};

/// Advice for trees that are not a forest.
const BOOSTED: &str = "of boosted trees import what XGBoost's save_model writes, which is exact";

/// Reads a forest from `TreeEnsembleClassifier`.
pub(super) fn read(node: &OnnxNode, before: &Before) -> Result<Read, String> {
    let wrong = |why: String| format!("TreeEnsembleClassifier: {why}");
    let labels = labels(node, "classlabels_int64s")?;
    let transform = post_transform(node);
    if transform != "NONE" {
        return Err(wrong(format!("post_transform {transform}, expected NONE, a forest; {BOOSTED}")));
    }
    if numbers(node, "base_values")?.iter().any(|&base| base != 0.0) {
        return Err(wrong(format!("base_values, expected a forest, which has none; {BOOSTED}")));
    }
    let mut ensemble = Ensemble::read(node, &before.scalers).map_err(wrong)?;
    ensemble.weights(node, labels.len()).map_err(wrong)?;
    votes(&mut ensemble.trees, ensemble.single).map_err(|why| wrong(format!("{why}; {BOOSTED}")))?;
    let inputs = before.width.ok_or("the ONNX input's shape does not say how many inputs there are, expected 700")?;
    Ok(Read { inputs, kind: Kind::Forest(ensemble.trees), answer: ClassifierOutput::Label(labels) })
}

struct Ensemble {
    trees: Vec<Tree<Leaf>>,
    /// Numbers of a tree and of a node in it, by their names in the file.
    places: HashMap<(i64, i64), (usize, usize)>,
    /// `true` if weights are only those of the second of two classes.
    single: bool,
}

impl Ensemble {
    fn read(node: &OnnxNode, scalers: &[Scaler]) -> Result<Self, String> {
        let trees = integers(node, "nodes_treeids");
        let lists = ["nodes_nodeids", "nodes_featureids", "nodes_truenodeids", "nodes_falsenodeids"];
        let [names, inputs, yes, no] = lists.map(|list| integers(node, list));
        let thresholds = numbers(node, "nodes_values")?;
        let modes = attribute(node, "nodes_modes").map_or(&[][..], |attribute| &attribute.strings);
        let count = trees.len();
        let lengths = [names.len(), inputs.len(), yes.len(), no.len(), thresholds.len(), modes.len()];
        if count == 0 || lengths.iter().any(|&length| length != count) {
            return Err(format!("lists of {lengths:?} nodes, expected {count} in each, as in nodes_treeids"));
        }
        if count > MOST_NODES {
            return Err(format!("{count} nodes, expected at most {MOST_NODES}"));
        }
        let mut ensemble = Self { trees: Vec::new(), places: HashMap::with_capacity(count), single: false };
        let mut roots = HashMap::new();
        for (&tree, &name) in trees.iter().zip(names) {
            let number = *roots.entry(tree).or_insert_with(|| {
                ensemble.trees.push(Tree { nodes: Vec::new() });
                ensemble.trees.len() - 1
            });
            if number >= usize::from(u16::MAX) {
                return Err("more than 65535 trees".into());
            }
            let nodes = &mut ensemble.trees[number].nodes;
            if ensemble.places.insert((tree, name), (number, nodes.len())).is_some() {
                return Err(format!("tree {tree} has two nodes {name}"));
            }
            nodes.push(Node::Leaf(Vec::new()));
        }
        for at in 0..count {
            let (tree, name) = (trees[at], names[at]);
            if modes[at] == b"LEAF" {
                continue;
            }
            let wrong = |what: String| format!("tree {tree}, node {name}: {what}");
            let child = |child: i64| {
                let place = ensemble.places.get(&(tree, child)).map(|place| place.1);
                place.ok_or_else(|| wrong(format!("child {child}, expected a node of the tree")))
            };
            let children = (child(yes[at])?, child(no[at])?);
            let mode = String::from_utf8_lossy(&modes[at]);
            let split = split(&mode, inputs[at], thresholds[at], children, scalers).map_err(wrong)?;
            if let Some(&(number, node)) = ensemble.places.get(&(tree, name)) {
                ensemble.trees[number].nodes[node] = split;
            }
        }
        Ok(ensemble)
    }

    /// Gives the leaves their weights of classes.
    fn weights(&mut self, node: &OnnxNode, labels: usize) -> Result<(), String> {
        let lists = ["class_treeids", "class_nodeids", "class_ids"];
        let [trees, names, classes] = lists.map(|list| integers(node, list));
        let weights = numbers(node, "class_weights")?;
        let lengths = [names.len(), classes.len(), weights.len()];
        if lengths.iter().any(|&length| length != trees.len()) {
            return Err(format!("lists of {lengths:?} weights, expected {} in each", trees.len()));
        }
        // Weights of a single class belong to the second of two, which wins above one half.
        self.single = labels == 2 && classes.windows(2).all(|two| two[0] == two[1]);
        for at in 0..trees.len() {
            let (tree, name) = (trees[at], names[at]);
            let wrong = |what: &str| format!("weight {at}: {what}");
            let place = self.places.get(&(tree, name)).ok_or_else(|| wrong("its node is none"))?;
            let Node::Leaf(leaf) = &mut self.trees[place.0].nodes[place.1] else {
                return Err(wrong("its node is no leaf"));
            };
            let class = if self.single { Some(1) } else { u16::try_from(classes[at]).ok() };
            let class = class.filter(|&class| usize::from(class) < labels).ok_or_else(|| wrong("its class is none"))?;
            if leaf.iter().any(|share| share.0 == class) {
                return Err(wrong("its leaf has one of this class already"));
            }
            leaf.push((class, weights[at]));
        }
        Ok(())
    }
}
