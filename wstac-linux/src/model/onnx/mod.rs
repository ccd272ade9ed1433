//! Models in ONNX, as skl2onnx writes them for scikit-learn.
//!
//! Of the graph, what computes the label is followed: from the input through casts and a scaler to a classifier, whose
//! first output, cast at most, is an output of the graph. What becomes of scores and probabilities does not matter.

mod linear;
mod proto;
#[cfg(test)]
mod tests;
mod trees;

use self::proto::{Attribute, Model, Node};
use super::trained::{Trained, guess_task};

const CLASSIFIERS: [&str; 3] = ["TreeEnsembleClassifier", "LinearClassifier", "SVMClassifier"];
const UNDERSTOOD: &str =
    "Cast, Identity, Scaler, TreeEnsembleClassifier, LinearClassifier, SVMClassifier (linear kernel)";

/// What is done to inputs before the classifier: (x − offset) · scale.
struct Scaler {
    offset: Vec<f32>,
    scale: Vec<f32>,
}

/// The model in a file, with the labels given, or with its own.
pub(super) fn read(bytes: &[u8], labels: Option<Vec<String>>) -> Result<(Trained, String), String> {
    let unknown = |why| format!("expected JSON or UBJSON of XGBoost, or ONNX; as ONNX it {why}");
    let model = proto::model(bytes).map_err(unknown)?;
    let (classifier, scaler) = chain(&model)?;
    let (inputs, kind, classes) = match classifier.kind.as_str() {
        "TreeEnsembleClassifier" => trees::read(classifier, scaler.as_ref(), model.width)?,
        "LinearClassifier" => linear::classifier(classifier, scaler.as_ref())?,
        _ => linear::svm(classifier, scaler.as_ref())?,
    };
    let labels = match labels {
        Some(labels) if labels.len() == classes.len() => labels,
        Some(labels) => return Err(format!("has {} classes, and --labels names {}", classes.len(), labels.len())),
        None => classes,
    };
    let task = guess_task(&labels);
    let trainer = if model.producer.is_empty() { "ONNX".into() } else { format!("ONNX of {}", model.producer) };
    Ok((Trained { labels, task, inputs, kind }, trainer))
}

/// The classifier, and the scaler before it.
fn chain<'m, 'a>(model: &'m Model<'a>) -> Result<(&'m Node<'a>, Option<Scaler>), String> {
    let mut found = model.nodes.iter().filter(|node| CLASSIFIERS.contains(&node.kind.as_str()));
    let (Some(classifier), None) = (found.next(), found.next()) else {
        let mut kinds: Vec<&str> = model.nodes.iter().map(|node| node.kind.as_str()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        kinds.truncate(20);
        let kinds = kinds.join(", ");
        return Err(format!("ONNX nodes {kinds}, expected one classifier; understood are {UNDERSTOOD}"));
    };
    let plain = |kind: &str| kind == "Cast" || kind == "Identity";
    // Forwards: the label.
    let mut name = classifier.outputs.first().ok_or("the ONNX classifier has no output")?;
    for _ in 0..=model.nodes.len() {
        if model.outputs.contains(name) {
            break;
        }
        let next = model.nodes.iter().find(|node| node.inputs.contains(name));
        let next = next.ok_or_else(|| format!("ONNX output {name} of the classifier is no output of the graph"))?;
        if !plain(&next.kind) {
            return Err(format!("ONNX node {} after the label, expected Cast or Identity", next.kind));
        }
        name = next.outputs.first().ok_or("an ONNX node has no output")?;
    }
    // Backwards: the input.
    let mut scaler = None;
    let mut name = classifier.inputs.first().ok_or("the ONNX classifier has no input")?;
    for _ in 0..=model.nodes.len() {
        if model.inputs.contains(name) {
            return Ok((classifier, scaler));
        }
        let before = model.nodes.iter().find(|node| node.outputs.contains(name));
        let before = before.ok_or_else(|| format!("ONNX input {name} comes from nowhere"))?;
        if before.kind == "Scaler" && scaler.is_none() {
            let (offset, scale) = (floats(before, "offset")?.to_vec(), floats(before, "scale")?.to_vec());
            scaler = Some(Scaler { offset, scale });
        } else if !plain(&before.kind) {
            return Err(format!("ONNX node {} before the classifier; understood are {UNDERSTOOD}", before.kind));
        }
        name = before.inputs.first().ok_or("an ONNX node has no input")?;
    }
    Err("the ONNX graph goes in a circle".into())
}

fn attribute<'m, 'a>(node: &'m Node<'a>, name: &str) -> Option<&'m Attribute<'a>> {
    node.attributes.iter().find(|attribute| attribute.name == name)
}

fn floats<'m>(node: &'m Node, name: &str) -> Result<&'m [f32], String> {
    if attribute(node, &format!("{name}_as_tensor")).is_some_and(|attribute| attribute.tensor) {
        return Err(format!("{}: {name}_as_tensor, expected {name}: a model in float32", node.kind));
    }
    Ok(attribute(node, name).map_or(&[], |attribute| &attribute.floats))
}

fn integers<'m>(node: &'m Node, name: &str) -> &'m [i64] {
    attribute(node, name).map_or(&[], |attribute| &attribute.integers)
}

/// Labels, text or integers.
fn labels(node: &Node, integer_names: &str) -> Result<Vec<String>, String> {
    let texts = attribute(node, "classlabels_strings").map_or(&[][..], |attribute| &attribute.texts);
    let numbers = integers(node, integer_names);
    let count = texts.len().max(numbers.len());
    if count == 0 || count > wstac_core::model::file::MOST_CLASSES {
        return Err(format!("{}: {count} labels, expected 1 to {}", node.kind, wstac_core::model::file::MOST_CLASSES));
    }
    if texts.is_empty() {
        return Ok(numbers.iter().map(i64::to_string).collect());
    }
    let text = |label: &&[u8]| String::from_utf8(label.to_vec());
    texts.iter().map(text).collect::<Result<_, _>>().map_err(|_| format!("{}: a label is not UTF-8", node.kind))
}

/// What is done to scores in the end.
fn post_transform(node: &Node) -> String {
    let text = attribute(node, "post_transform").and_then(|attribute| attribute.text).unwrap_or(b"NONE");
    String::from_utf8_lossy(text).into_owned()
}

impl Scaler {
    /// Offset and scale of an input; a list of one is for all inputs.
    fn of(&self, input: usize) -> Result<(f32, f32), String> {
        let get = |list: &[f32], none: f32| match list {
            [] => Some(none),
            [one] => Some(*one),
            _ => list.get(input).copied(),
        };
        match (get(&self.offset, 0.0), get(&self.scale, 1.0)) {
            (Some(offset), Some(scale)) if offset.is_finite() && scale.is_finite() => Ok((offset, scale)),
            _ => Err(format!("Scaler: offset or scale of input {input} is missing or no finite number")),
        }
    }
}
