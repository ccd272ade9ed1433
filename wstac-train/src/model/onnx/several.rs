//! Several classifiers that are joined: linear models one-vs-rest, and forests whose votes are averaged.

use super::path::{ClassifierOutput, before};
use super::proto::{Graph, Node};
use super::sums::{highest, joins_classes, linear, whole};
use super::{Read, attribute, classifier, integers, linear::rows, not_one, post_transform};
use crate::model::trained::{Kind, MOST_NODES};

/// Reads classifiers of one kind.
pub(super) fn read(graph: &Graph, classifiers: &[&Node], producer: &str) -> Result<Read, String> {
    let all = |kind| classifiers.iter().all(|node| node.op_type() == kind);
    let read = if all("LinearClassifier") {
        one_vs_rest(graph, classifiers)?
    } else if all("TreeEnsembleClassifier") {
        bagging(graph, classifiers, producer)?
    } else {
        None
    };
    read.ok_or_else(|| not_one(graph))
}

/// Reads one linear model a class, or `None` if a `Concat` does not join the scores of their second classes.
fn one_vs_rest(graph: &Graph, classifiers: &[&Node]) -> Result<Option<Read>, String> {
    let of = |name: &String| {
        let pick = graph.node.iter().find(|node| node.output.contains(name))?;
        let number = |input| pick.input.get(input).and_then(|name| whole(graph, name));
        let is_second = match pick.op_type() {
            "ArrayFeatureExtractor" => number(1)? == [1],
            // Begin, end and axis.
            "Slice" => number(1)? == [1] && number(2)? == [2] && number(3)? == [1],
            _ => false,
        };
        classifiers.iter().find(|node| is_second && node.output.get(1) == pick.input.first())
    };
    let joined = graph.node.iter().find_map(|node| {
        let all: Vec<&&Node> = node.input.iter().map(of).collect::<Option<_>>()?;
        (node.op_type() == "Concat" && joins_classes(node) && all.len() == classifiers.len())
            .then_some((node.output.first()?, all))
    });
    let Some((scores, ordered)) = joined else { return Ok(None) };
    let transform = post_transform(ordered[0]);
    let (mut sums, mut steps, mut inputs) = (Vec::new(), Vec::new(), 0);
    for node in ordered {
        let before = before(graph, node)?;
        let (mut both, labels) = rows(node, &before)?;
        if labels.len() != 2 || post_transform(node) != transform || transform == "SOFTMAX" {
            return Err("LinearClassifier, one of several: expected two classes, and NONE or LOGISTIC in all".into());
        }
        inputs = before.inputs(Some(both[0].weights.len()))?;
        sums.extend(both.pop());
        steps.push(before);
    }
    // skl2onnx takes scores of any kind for probabilities here.
    let answer = highest(graph, scores, sums.len().max(2), Some(&mut sums), false)?;
    linear(sums, steps, inputs, answer).map(Some)
}

/// Reads forests of as many trees each, or `None` if a `ReduceMean` does not average their votes.
fn bagging(graph: &Graph, classifiers: &[&Node], producer: &str) -> Result<Option<Read>, String> {
    let next = |name: Option<&String>, kind| {
        graph.node.iter().find(|node| node.op_type() == kind && name.is_some_and(|name| node.input.contains(name)))
    };
    // Each of them once, one behind the other.
    let of_all = |node: &&Node| {
        let axis = attribute(node, "axis").and_then(|axis| axis.i);
        node.input.len() == classifiers.len() && axis == Some(0)
    };
    let joined = |node: &Node| {
        next(next(node.output.get(1), "Reshape")?.output.first(), "Concat").filter(of_all)?.output.first()
    };
    let Some(votes) = joined(classifiers[0]) else { return Ok(None) };
    let Some(mean) = next(Some(votes), "ReduceMean") else { return Ok(None) };
    let axes = mean.input.get(1).and_then(|axes| whole(graph, axes)).unwrap_or_else(|| integers(mean, "axes").to_vec());
    if axes != [0] || attribute(mean, "keepdims").and_then(|keep| keep.i) != Some(0) {
        return Ok(None);
    }
    let (mut trees, mut first, mut all) = (Vec::new(), None, 0);
    for node in classifiers {
        if joined(node) != Some(votes) {
            return Ok(None);
        }
        let Read { kind: Kind::Forest(some), answer: ClassifierOutput::Label(labels), before, .. } =
            classifier::read(node, before(graph, node)?, producer)?
        else {
            return Err("TreeEnsembleClassifier, one of several: expected forests".into());
        };
        all += some.iter().map(|tree| tree.nodes.len()).sum::<usize>();
        let count = some.len();
        let (_, trees_of_first, classes) = first.get_or_insert_with(|| (before, count, labels.clone()));
        if *trees_of_first != count || *classes != labels || all > MOST_NODES {
            return Err(
                "TreeEnsembleClassifier, one of several: expected as many trees and the same classes in all".into()
            );
        }
        trees.extend(some);
    }
    let Some((before, _, classes)) = first else { return Ok(None) };
    let name = mean.output.first().ok_or("an ONNX node has no output")?;
    let answer = highest(graph, name, classes.len(), None, true)?;
    Ok(Some(Read { inputs: before.inputs(None)?, kind: Kind::Forest(trees), answer, before }))
}
