//! `TreeEnsembleClassifier`, read as a forest or as trees that add up to scores.

use std::collections::HashMap;

use super::path::ClassifierOutput;
use super::proto::Node as OnnxNode;
use super::steps::Before;
use super::trees::{Leaf, scores, split, votes};
use super::{Read, attribute, integers, labels, numbers, post_transform, thresholds};
use crate::model::trained::{Boosted, Kind, MOST_NODES, Node, Tree};

/// Advice for trees that are not a forest.
const BOOSTED: &str = "boosted trees have post_transform LOGISTIC or SOFTMAX; of XGBoost import what save_model writes";

/// Reads a forest, or trees that add up to scores, from `TreeEnsembleClassifier`.
pub(super) fn read(node: &OnnxNode, before: Before, producer: &str) -> Result<Read, String> {
    let wrong = |why: String| format!("TreeEnsembleClassifier: {why}");
    let labels = labels(node, "classlabels_int64s")?;
    let (transform, base) = (post_transform(node), numbers(node, "base_values")?);
    let inputs = before.inputs(None)?;
    let mut ensemble = Ensemble::read(node, &before).map_err(wrong)?;
    ensemble.weights(node, labels.len()).map_err(wrong)?;
    let mut forest = ensemble.trees.clone();
    let is_vote = if base.iter().all(|&base| base == 0.0) {
        votes(&mut forest, ensemble.single)
    } else {
        Err("base_values, expected none in a forest".into())
    };
    let kind = match (transform.as_str(), is_vote) {
        ("NONE", Ok(())) => Kind::Forest(forest),
        // The bound of a single score would be 0 or one half: the file does not say which.
        ("NONE", Err(why)) if ensemble.single => return Err(wrong(format!("{why}; {BOOSTED}"))),
        // All of them keep the order of scores.
        ("NONE" | "LOGISTIC" | "SOFTMAX", _) => {
            let is_logistic = transform == "LOGISTIC";
            let mut boosted = ensemble.boosted(&base, labels.len(), is_logistic).map_err(wrong)?;
            let missing = integers(node, "nodes_missing_value_tracks_true");
            // For a score of 0, GradientBoostingClassifier answers the second class and all others the first.
            // HistGradientBoostingClassifier has the same operator, but its missing values go to the larger child.
            if boosted.scores.len() == 1 && producer.starts_with("skl2onnx") && missing.iter().all(|&left| left == 0) {
                boosted.bound = -f32::MIN_POSITIVE;
            }
            Kind::Boosted(boosted)
        }
        (other, _) => return Err(wrong(format!("post_transform {other}, expected NONE, LOGISTIC or SOFTMAX"))),
    };
    Ok(Read { inputs, kind, answer: ClassifierOutput::Label(labels), before })
}

struct Ensemble {
    trees: Vec<Tree<Leaf>>,
    /// Numbers of a tree and of a node in it, by their names in the file.
    places: HashMap<(i64, i64), (usize, usize)>,
    /// `true` if weights are only those of the second of two classes.
    single: bool,
}

impl Ensemble {
    fn read(node: &OnnxNode, before: &Before) -> Result<Self, String> {
        let trees = integers(node, "nodes_treeids");
        let lists = ["nodes_nodeids", "nodes_featureids", "nodes_truenodeids", "nodes_falsenodeids"];
        let [names, inputs, yes, no] = lists.map(|list| integers(node, list));
        let thresholds = thresholds(node, "nodes_values")?;
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
            let split = split(&mode, inputs[at], thresholds[at], children, before).map_err(wrong)?;
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

    /// Returns the trees as sums: a score for each class, or the second class's alone if it decides.
    fn boosted(mut self, base: &[f64], classes: usize, is_logistic: bool) -> Result<Boosted, String> {
        if self.single && !is_logistic {
            return Err("post_transform SOFTMAX with weights of one class, expected weights of both".into());
        }
        // Converters write a single 0 for classes that all start at 0.
        let fits = base.len() == classes || self.single && base.len() == 1 || matches!(base, [] | [0.0]);
        if !fits {
            return Err(format!("{} base_values, expected none or {classes}", base.len()));
        }
        // CatBoost gives the first of two classes the negative weights of the second.
        let opposite = |leaf: &Leaf| matches!(leaf[..], [(0, first), (1, second)] if first + second == 0.0);
        let is_mirrored = classes == 2 && base.is_empty() && self.trees.iter().flat_map(Tree::leaves).all(opposite);
        for node in self.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            let Node::Leaf(leaf) = node else { continue };
            leaf.retain(|share| !is_mirrored || share.0 == 1);
            for share in leaf {
                share.1 = f64::from(share.1 as f32);
            }
        }
        let mut boosted = scores(&self.trees, classes)?;
        if self.single || is_mirrored {
            boosted.scores.remove(0);
        }
        for (score, &base) in boosted.scores.iter_mut().rev().zip(base.iter().rev()) {
            score.start = base as f32;
        }
        Ok(boosted)
    }
}
