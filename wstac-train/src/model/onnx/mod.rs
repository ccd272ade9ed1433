//! Models in ONNX, as skl2onnx writes them for scikit-learn, and from other programs with the same operators.
//!
//! [`limits`], [`proto`] and [`tensor`] read the file, [`path`] finds the operators before and after the classifier,
//! [`steps`] are those before it, and the others read classifiers.

mod classifier;
mod ensemble;
mod limits;
mod linear;
#[allow(dead_code, unreachable_pub, clippy::pedantic, reason = "generated")]
mod messages;
mod path;
mod proto;
mod several;
mod steps;
mod sums;
mod tensor;
#[cfg(test)]
mod tests;
mod trees;

use self::path::ClassifierOutput;
use self::proto::{Attribute, Graph, Node};
use self::steps::Before;
use self::tensor::Tensor;
use super::trained::{Kind, Origin, Score, Trained, Tree, guess_task};
use wstac_core::model::file::{Input, MOST_CLASSES};

const CLASSIFIERS: [&str; 4] = ["TreeEnsembleClassifier", "TreeEnsemble", "LinearClassifier", "SVMClassifier"];
const UNDERSTOOD: &str = "TreeEnsembleClassifier, TreeEnsemble, LinearClassifier, SVMClassifier (linear kernel), \
     MatMul and Gemm; before them Relu (a network of one or two hidden layers), BatchNormalization, Cast, Identity, \
     Dropout, Flatten, Scaler, Imputer, \
     Add, Sub, Mul and Div with constants, ArrayFeatureExtractor and Gather; for scores Softmax, Sigmoid and ArgMax; and \
     for labels LabelEncoder, ArrayFeatureExtractor and Gather";

/// The part of a classifier that is read.
struct Read {
    inputs: usize,
    kind: Kind,
    answer: ClassifierOutput,
    before: Before,
}

/// Reads the model in a file, with the labels given or its own, and its origin.
pub(super) fn read(bytes: &[u8], labels: Option<Vec<String>>) -> Result<(Trained, Origin), String> {
    let unknown = |why| format!("expected JSON or UBJSON of XGBoost, or ONNX; as ONNX it {why}");
    let (graph, producer) = proto::graph(bytes).map_err(unknown)?;
    let found: Vec<&Node> = graph.node.iter().filter(|node| CLASSIFIERS.contains(&node.op_type())).collect();
    let is_used = |name: &String| {
        graph.output.iter().any(|output| output.name() == name)
            || graph.node.iter().any(|node| node.input.contains(name))
    };
    let Read { inputs, kind, answer, before } = match &found[..] {
        [] => sums::read(&graph)?,
        [node] if node.op_type() != "LinearClassifier" || node.output.first().is_none_or(is_used) => {
            let before = path::before(&graph, node)?;
            match node.op_type() {
                "TreeEnsembleClassifier" => classifier::read(node, before, &producer)?,
                "TreeEnsemble" => ensemble::read(&graph, node, before)?,
                "LinearClassifier" => linear::classifier(node, before)?,
                _ => linear::svm(node, before)?,
            }
        }
        all => several::read(&graph, all, &producer)?,
    };
    let is_given = matches!(answer, ClassifierOutput::Given(_));
    let mut remarks = Vec::new();
    let classes = path::labels(&graph, found.first().copied(), answer, &mut remarks)?;
    let labels = match labels {
        Some(labels) if labels.len() == classes.len() => {
            remarks.extend(renamed(&classes, &labels));
            labels
        }
        Some(labels) => return Err(format!("has {} classes, and --labels names {}", classes.len(), labels.len())),
        None => classes,
    };
    let task = guess_task(&labels);
    let tool = if producer.is_empty() { "ONNX".into() } else { format!("ONNX of {producer}") };
    let mean = before.mean(inputs);
    if is_given {
        remarks.push("the file gives scores: the highest is the answer".into());
    }
    let is_of_sums = matches!(kind, Kind::Linear(_) | Kind::Network(_));
    if is_of_sums && labels.len() > 2 && graph.node.iter().any(|node| node.op_type() == "Sigmoid") {
        let why = "of several such scores ONNX answers the first, and this file the highest";
        remarks.push(format!("a Sigmoid of float32 is 1 from a score of about 17 on: {why}"));
    }
    if before.scales() && !is_of_sums {
        let why = "the trainer itself may answer otherwise where a scaled feature is next to one";
        remarks.push(format!("thresholds are those of the ONNX file, which scales in float32: {why}"));
    }
    if let Kind::Boosted(boosted) = &kind {
        let far =
            boosted.scores.iter().map(rounding).fold(0.0, f64::max) * if boosted.scores.len() == 1 { 1.0 } else { 2.0 };
        remarks.push(format!(
            "a trainer that adds float64 may answer otherwise where scores differ by less than {far:.1e}"
        ));
    }
    Ok((
        Trained { labels, task, input: Input::Frames, inputs, speeds: None, kind, remarks, mean },
        Origin { tool, spreads: before.spreads },
    ))
}

/// Describes a graph without one classifier.
fn not_one(graph: &Graph) -> String {
    let mut kinds: Vec<&str> = graph.node.iter().map(Node::op_type).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds.truncate(20);
    let has = |kind| kinds.contains(&kind);
    let help = if has("TopK") || has("CDist") {
        "; help: neighbors compare with every sample of the training: train trees, or SVC(kernel=\"linear\")"
    } else if has("TreeEnsembleClassifier") {
        "; help: trees with weights, as of AdaBoost, are not read: train a RandomForest or boosted trees"
    } else {
        ""
    };
    let kinds = kinds.join(", ");
    format!("ONNX nodes {kinds}, expected one classifier; understood are {UNDERSTOOD}{help}")
}

/// Returns a bound of what float32 takes from a score: in the start, in every leaf and in every addition.
fn rounding(score: &Score) -> f64 {
    let largest = |tree: &Tree<f32>| tree.leaves().map(|leaf| f64::from(leaf.abs())).fold(0.0, f64::max);
    let most = f64::from(score.start.abs()) + score.trees.iter().map(largest).sum::<f64>();
    most * (score.trees.len() + 1) as f64 / 16_777_216.0
}

fn attribute<'m>(node: &'m Node, name: &str) -> Option<&'m Attribute> {
    node.attribute.iter().find(|attribute| attribute.name() == name)
}

/// Returns a list of floats; all of them must be finite.
fn floats<'m>(node: &'m Node, name: &str) -> Result<&'m [f32], String> {
    let list = attribute(node, name).map_or(&[][..], |attribute| &attribute.floats);
    finite(node, name, list.iter().map(|&number| f64::from(number)))?;
    Ok(list)
}

/// Returns a list of numbers, either floats or a tensor of floats or doubles; all of them must be finite.
fn numbers(node: &Node, name: &str) -> Result<Vec<f64>, String> {
    let list = thresholds(node, name)?;
    finite(node, name, list.iter().copied())?;
    Ok(list)
}

/// Returns a list of thresholds, which may be infinite: a forest that was trained with NaN splits NaN from all numbers.
fn thresholds(node: &Node, name: &str) -> Result<Vec<f64>, String> {
    let tensor = [name.to_owned(), format!("{name}_as_tensor")]
        .iter()
        .find_map(|name| attribute(node, name).and_then(|attribute| attribute.t.as_ref()));
    let list = match tensor.map(Tensor::of).transpose()? {
        Some(tensor) if matches!(tensor.kind, tensor::FLOAT | tensor::DOUBLE) => tensor.floats,
        Some(tensor) => {
            let (node, kind) = (node.op_type(), tensor.kind);
            return Err(format!("{node}: {name} is a tensor of type {kind}, expected float (1) or double (11)"));
        }
        None => attribute(node, name).map_or_else(Vec::new, |list| list.floats.iter().map(|&x| f64::from(x)).collect()),
    };
    finite(node, name, list.iter().map(|&number| if number.is_infinite() { 0.0 } else { number }))?;
    Ok(list)
}

fn finite(node: &Node, name: &str, mut list: impl Iterator<Item = f64>) -> Result<(), String> {
    // The message names the number as well as its position, which helps more than the position alone.
    match list.by_ref().enumerate().find(|(_, number)| !number.is_finite()) {
        Some((at, number)) => Err(format!("{}: {name}[{at}] is {number}, expected a finite number", node.op_type())),
        None => Ok(()),
    }
}

fn integers<'m>(node: &'m Node, name: &str) -> &'m [i64] {
    attribute(node, name).map_or(&[], |attribute| &attribute.ints)
}

/// Returns what other names than the file's own are given to its classes; `None` if it numbers them.
fn renamed(own: &[String], given: &[String]) -> Option<String> {
    let pairs = own.iter().zip(given).filter(|(own, given)| own != given && own.parse::<i64>().is_err());
    let pairs: Vec<String> = pairs.map(|(own, given)| format!("{own} to {given}")).collect();
    (!pairs.is_empty()).then(|| format!("--labels renames {}", pairs.join(", ")))
}

/// Returns the labels, text or integers.
fn labels(node: &Node, integer_names: &str) -> Result<Vec<String>, String> {
    let texts = attribute(node, "classlabels_strings").map_or(&[][..], |attribute| &attribute.strings);
    let numbers = integers(node, integer_names);
    let count = texts.len().max(numbers.len());
    if count == 0 || count > MOST_CLASSES {
        return Err(format!("{}: {count} labels, expected 1 to {MOST_CLASSES}", node.op_type()));
    }
    if texts.is_empty() {
        return Ok(numbers.iter().map(i64::to_string).collect());
    }
    let text = |label: &Vec<u8>| String::from_utf8(label.clone());
    texts.iter().map(text).collect::<Result<_, _>>().map_err(|_| format!("{}: a label is not UTF-8", node.op_type()))
}

/// Returns the operation on the final scores.
fn post_transform(node: &Node) -> String {
    let text = attribute(node, "post_transform").and_then(|attribute| attribute.s.as_deref()).unwrap_or(b"NONE");
    String::from_utf8_lossy(text).into_owned()
}
