//! The path of the label through a graph: from the input to the classifier, and from its answer to an output.
//!
//! Operations on scores and probabilities off this path do not matter. An operator on the path that is not understood
//! is rejected by its name.

use super::messages::TensorProto;
use super::proto::{Graph, Node, type_of};
use super::tensor::{DOUBLE, FLOAT, STRING, Tensor};
use super::{Scaler, UNDERSTOOD, attribute, floats};

/// ONNX's number of the boolean type.
const BOOL: i64 = 9;

/// The operators before the classifier.
pub(super) struct Before {
    /// The last dimension of the input, if it is stated.
    pub(super) width: Option<usize>,
    /// Scalers, in their order.
    pub(super) scalers: Vec<Scaler>,
}

/// The first output of a classifier.
pub(super) enum ClassifierOutput {
    /// The label, one of these.
    Label(Vec<String>),
    /// A score for each class, and the number of classes.
    Scores(usize),
}

/// Follows the path backwards from the classifier to the input.
pub(super) fn before(graph: &Graph, classifier: &Node) -> Result<Before, String> {
    let mut scalers = Vec::new();
    let mut name = classifier.input.first().ok_or("the ONNX classifier has no input")?;
    for _ in 0..=graph.node.len() {
        if let Some(input) = graph.input.iter().find(|input| input.name() == name) {
            let (kind, width) = type_of(input);
            if kind != 0 && !is_real(kind) {
                return Err(format!(
                    "ONNX input {name} is of type {kind}, expected float (1) or double (11): features times their scale"
                ));
            }
            if kind == DOUBLE && !scalers.is_empty() {
                return Err(format!("ONNX input {name} is double before a Scaler, expected float"));
            }
            scalers.reverse();
            return Ok(Before { width, scalers });
        }
        let before = graph.node.iter().find(|node| node.output.contains(name));
        let before = before.ok_or_else(|| format!("ONNX input {name} comes from nowhere"))?;
        match before.op_type() {
            "Identity" => {}
            // Other types lose a part of the input.
            "Cast" if to(before).and_then(|to| u64::try_from(to).ok()) == Some(DOUBLE) && !scalers.is_empty() => {
                return Err("ONNX node Cast to double (11) before a Scaler, expected float (1)".into());
            }
            "Cast" if to(before).and_then(|to| u64::try_from(to).ok()).is_some_and(is_real) => {}
            "Cast" => {
                let to = to(before).unwrap_or(0);
                return Err(format!(
                    "ONNX node Cast to {to} before the classifier, expected to float (1) or double (11)"
                ));
            }
            "Scaler" => scalers.push(Scaler::new(floats(before, "offset")?, floats(before, "scale")?)),
            other => return Err(format!("ONNX node {other} before the classifier; understood are {UNDERSTOOD}")),
        }
        name = before.input.first().ok_or("an ONNX node has no input")?;
    }
    Err("the ONNX graph goes in a circle".into())
}

/// Follows the path forwards from the classifier to an output, and returns the resulting labels of its classes.
pub(super) fn labels(graph: &Graph, classifier: &Node, answer: ClassifierOutput) -> Result<Vec<String>, String> {
    let mut name = classifier.output.first().ok_or("the ONNX classifier has no output")?;
    let mut labels = match answer {
        ClassifierOutput::Label(labels) => labels,
        ClassifierOutput::Scores(classes) => {
            name = highest(graph, name)?;
            (0..classes).map(|class| class.to_string()).collect()
        }
    };
    for _ in 0..=graph.node.len() {
        if graph.output.iter().any(|output| output.name() == name) {
            return Ok(labels);
        }
        let next = graph.node.iter().find(|node| node.input.contains(name));
        let next = next.ok_or_else(|| format!("ONNX output {name} of the classifier is no output of the graph"))?;
        match next.op_type() {
            "Identity" | "Reshape" | "Flatten" | "Squeeze" | "Unsqueeze" => {}
            "Cast" if to(next).is_some_and(|to| to != BOOL) => {}
            "Cast" => return Err("ONNX node Cast to bool (9) after the label, expected a number or text".into()),
            // Both pick from a list that is their first input.
            "ArrayFeatureExtractor" | "Gather" => labels = picked(graph, next, name, &labels)?,
            "LabelEncoder" => labels = encoded(next, &labels)?,
            other => return Err(format!("ONNX node {other} after the label; understood are {UNDERSTOOD}")),
        }
        name = next.output.first().ok_or("an ONNX node has no output")?;
    }
    Err("the ONNX graph goes in a circle after the classifier".into())
}

/// Finds the output that holds the number of the highest score.
fn highest<'m>(graph: &'m Graph, scores: &'m String) -> Result<&'m String, String> {
    let mut name = scores;
    for _ in 0..=graph.node.len() {
        let mut next = graph.node.iter().filter(|node| node.input.contains(name));
        if let Some(node) = next.clone().find(|node| node.op_type() == "ArgMax") {
            let number = |name, default| attribute(node, name).and_then(|found| found.i).unwrap_or(default);
            if !matches!(number("axis", 0), 1 | -1) || number("select_last_index", 0) != 0 {
                return Err("ArgMax: expected axis 1 or -1, and the first index of those that are equal".into());
            }
            return node.output.first().ok_or_else(|| "an ONNX node has no output".into());
        }
        // These keep the order of scores; of other operators only the unknown one is of interest. A Softmax does over
        // the classes of a sample, but not over samples.
        let axis = |node: &Node| attribute(node, "axis").and_then(|found| found.i).unwrap_or(-1);
        let keeps =
            |node: &&Node| node.op_type() == "Identity" || node.op_type() == "Softmax" && matches!(axis(node), 1 | -1);
        match (next.clone().find(keeps), next.next()) {
            (Some(node), _) => name = node.output.first().ok_or("an ONNX node has no output")?,
            (None, Some(node)) => {
                return Err(format!(
                    "ONNX node {} after TreeEnsemble, expected ArgMax, or Softmax of axis 1",
                    node.op_type()
                ));
            }
            (None, None) => {
                return Err("ONNX TreeEnsemble gives scores, expected ArgMax after it, which gives classes".into());
            }
        }
    }
    Err("the ONNX graph goes in a circle after the classifier".into())
}

/// Returns labels of a constant list in which the given labels are positions.
fn picked(graph: &Graph, node: &Node, name: &String, labels: &[String]) -> Result<Vec<String>, String> {
    let kind = node.op_type();
    let (Some(list), Some(index)) = (node.input.first(), node.input.get(1)) else {
        return Err(format!("ONNX node {kind} has less than two inputs"));
    };
    if index != name {
        return Err(format!("ONNX node {kind} picks from the label, expected a pick of a label from a list"));
    }
    let list = texts(constant(graph, list).ok_or_else(|| format!("ONNX node {kind}: {list} is no constant"))?)?;
    let picked = |label: &String| label.parse::<usize>().ok().and_then(|place| list.get(place)).cloned();
    let all: Option<Vec<String>> = labels.iter().map(picked).collect();
    all.ok_or_else(|| {
        format!("ONNX node {kind} has {} labels, expected one for each of {} classes", list.len(), labels.len())
    })
}

fn encoded(node: &Node, labels: &[String]) -> Result<Vec<String>, String> {
    let list = |names: [&str; 3]| -> Option<Result<Vec<String>, String>> {
        let attribute = names.iter().find_map(|name| attribute(node, name))?;
        if let Some(tensor) = &attribute.t {
            return Some(texts(tensor));
        }
        let texts = attribute.strings.iter().map(|text| String::from_utf8_lossy(text).into_owned());
        Some(Ok(texts.chain(attribute.ints.iter().map(i64::to_string)).collect()))
    };
    let keys = list(["keys_int64s", "keys_strings", "keys_tensor"]);
    let values = list(["values_strings", "values_int64s", "values_tensor"]);
    let (Some(keys), Some(values)) = (keys, values) else {
        return Err("LabelEncoder: expected keys and values, both integers or text".into());
    };
    let (keys, values) = (keys?, values?);
    let value = |label: &String| keys.iter().position(|key| key == label).and_then(|at| values.get(at)).cloned();
    let all: Option<Vec<String>> = labels.iter().map(value).collect();
    all.ok_or_else(|| format!("LabelEncoder: {} keys, expected one for each of {} classes", keys.len(), labels.len()))
}

fn constant<'g>(graph: &'g Graph, name: &String) -> Option<&'g TensorProto> {
    let node = || graph.node.iter().find(|node| node.op_type() == "Constant" && node.output.contains(name));
    let listed = graph.initializer.iter().find(|constant| constant.name() == name);
    listed.or_else(|| attribute(node()?, "value")?.t.as_ref())
}

/// Returns a list of labels.
fn texts(tensor: &TensorProto) -> Result<Vec<String>, String> {
    let tensor = Tensor::of(tensor)?;
    Ok(match tensor.kind {
        STRING => tensor.texts.iter().map(|text| String::from_utf8_lossy(text).into_owned()).collect(),
        FLOAT | DOUBLE => tensor.floats.iter().map(f64::to_string).collect(),
        _ => tensor.integers.iter().map(i64::to_string).collect(),
    })
}

fn is_real(kind: u64) -> bool {
    matches!(kind, FLOAT | DOUBLE)
}

/// Returns the type that a `Cast` produces.
fn to(cast: &Node) -> Option<i64> {
    attribute(cast, "to").and_then(|to| to.i)
}
