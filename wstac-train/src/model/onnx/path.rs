//! The path of the label through a graph: from the input to the classifier, and from its answer to an output.
//!
//! Operations on scores and probabilities off this path do not matter. An operator on the path that is not understood
//! is rejected by its name.

use super::messages::TensorProto;
use super::proto::{Graph, Node, type_of};
use super::steps::{Before, Step};
use super::sums::{reals, sums, whole};
use super::tensor::{DOUBLE, FLOAT, STRING, Tensor};
use super::{UNDERSTOOD, attribute, floats};

/// Most steps before a classifier, and most weights in them: a small file may use one list many times.
const MOST_STEPS: usize = 64;
const MOST_WEIGHTS: usize = 1 << 22;
/// ONNX's number of the boolean type.
const BOOL: i64 = 9;

/// The output of a classifier that leads to the answer.
pub(super) enum ClassifierOutput {
    /// In its first output the label, one of these.
    Label(Vec<String>),
    /// In an output of this name the number of the class, and the number of classes.
    Class(String, usize),
    /// An output of the graph holds the scores; the number of classes.
    Given(usize),
}

/// Follows the path backwards from the classifier to the input.
pub(super) fn before(graph: &Graph, classifier: &Node) -> Result<Before, String> {
    let (mut steps, mut is_double) = (Vec::new(), false);
    let mut name = classifier.input.first().ok_or("the ONNX classifier has no input")?;
    for _ in 0..=graph.node.len() {
        if let Some(input) = graph.input.iter().find(|input| input.name() == name) {
            let (kind, width) = type_of(input);
            if kind != 0 && !is_real(kind) {
                return Err(format!(
                    "ONNX input {name} is of type {kind}, expected float (1) or double (11): features times their scale"
                ));
            }
            steps.reverse();
            return Ok(Before { width, is_double: is_double || kind == DOUBLE, steps, spreads: Vec::new() });
        }
        let weights: usize = steps.iter().map(Step::weights).sum();
        if steps.len() > MOST_STEPS || weights > MOST_WEIGHTS {
            return Err(format!(
                "{} steps of {weights} weights before the classifier, expected at most {MOST_STEPS} of {MOST_WEIGHTS}",
                steps.len()
            ));
        }
        let before = graph.node.iter().find(|node| node.output.contains(name));
        let before = before.ok_or_else(|| format!("ONNX input {name} comes from nowhere"))?;
        let kind = before.op_type();
        name = before.input.first().ok_or("an ONNX node has no input")?;
        let second = before.input.get(1);
        match kind {
            "Identity" | "Dropout" => {}
            "Flatten" if attribute(before, "axis").and_then(|axis| axis.i).is_none_or(|axis| axis == 1) => {}
            "BatchNormalization" => steps.extend(normalization(graph, before)?),
            "Relu" => steps.push(Step::Rectify),
            // Other types lose a part of the input.
            "Cast" if to(before).and_then(|to| u64::try_from(to).ok()).is_some_and(is_real) => {
                is_double |= to(before) == Some(DOUBLE as i64);
            }
            "Cast" => {
                let to = to(before).unwrap_or(0);
                return Err(format!(
                    "ONNX node Cast to {to} before the classifier, expected to float (1) or double (11)"
                ));
            }
            "Scaler" => {
                let list =
                    |name| Ok::<_, String>(floats(before, name)?.iter().map(|&x| f64::from(x)).collect::<Vec<_>>());
                let (offset, scale) = (list("offset")?, list("scale")?);
                steps.extend((!scale.is_empty()).then_some(Step::Multiply(scale)));
                steps.extend((!offset.is_empty()).then_some(Step::Subtract(offset)));
            }
            // Features are never NaN.
            "Imputer" if attribute(before, "replaced_value_float").and_then(|of| of.f).is_some_and(f32::is_nan) => {}
            "Imputer" => {
                return Err("ONNX node Imputer of numbers before the classifier, expected an Imputer of NaN".into());
            }
            "ArrayFeatureExtractor" | "Gather" => {
                let axis = attribute(before, "axis").and_then(|axis| axis.i).unwrap_or(0);
                let list =
                    second.and_then(|list| whole(graph, list)).filter(|_| kind != "Gather" || matches!(axis, 1 | -1));
                let list = list.and_then(|list| list.into_iter().map(|at| usize::try_from(at).ok()).collect());
                let wrong = "selects by other numbers than constants along the features";
                steps.push(Step::Pick(list.ok_or_else(|| format!("ONNX node {kind} before the classifier {wrong}"))?));
            }
            "Add" | "Sub" | "Mul" | "Div" => {
                let (mut list, is_first) = (second.and_then(|list| reals(graph, list)), matches!(kind, "Add" | "Mul"));
                if let (None, true, Some(other)) = (&list, is_first, second) {
                    list = reals(graph, name);
                    name = other;
                }
                let list = list.filter(|(list, shape)| shape.last().is_none_or(|&last| last == list.len()));
                let wrong = "expected the features and constants";
                let (list, _) = list.ok_or_else(|| format!("ONNX node {kind} before the classifier, {wrong}"))?;
                steps.push(match kind {
                    "Add" => Step::Add(list),
                    "Sub" => Step::Subtract(list),
                    "Mul" => Step::Multiply(list),
                    _ => Step::Divide(list),
                });
            }
            "MatMul" | "Gemm" => steps.push(Step::Sums(sums(graph, before)?)),
            other => {
                let help = match other {
                    "Tanh" | "Sigmoid" | "LeakyRelu" | "Elu" | "Selu" | "Gelu" | "Softplus" => {
                        "; help: train it with activation=\"relu\""
                    }
                    "Flatten" | "Reshape" | "Transpose" => "; help: train it on X.reshape(-1, 700)",
                    _ => "",
                };
                return Err(format!("ONNX node {other} before the classifier; understood are {UNDERSTOOD}{help}"));
            }
        }
    }
    Err("the ONNX graph goes in a circle".into())
}

/// Returns the steps of a `BatchNormalization`, the last first.
fn normalization(graph: &Graph, node: &Node) -> Result<[Step; 3], String> {
    let list = |at: usize| node.input.get(at).and_then(|name| reals(graph, name)).map(|found| found.0);
    let [Some(scale), Some(start), Some(mean), Some(variance)] = [1, 2, 3, 4].map(list) else {
        return Err("ONNX node BatchNormalization before the classifier, expected constants of finite numbers".into());
    };
    let least = f64::from(attribute(node, "epsilon").and_then(|epsilon| epsilon.f).unwrap_or(1e-5));
    let factor = scale.iter().zip(&variance).map(|(scale, variance)| scale / (variance + least).sqrt());
    Ok([Step::Add(start), Step::Multiply(factor.collect()), Step::Subtract(mean)])
}

/// Follows the path forwards from the classifier to an output, and returns the resulting labels of its classes.
pub(super) fn labels(
    graph: &Graph,
    classifier: Option<&Node>,
    answer: ClassifierOutput,
    remarks: &mut Vec<String>,
) -> Result<Vec<String>, String> {
    let numbers = |classes| (0..classes).map(|class: usize| class.to_string()).collect();
    let (name, mut labels) = match answer {
        ClassifierOutput::Label(labels) => (classifier.and_then(|node| node.output.first().cloned()), labels),
        ClassifierOutput::Class(name, classes) => (Some(name), numbers(classes)),
        ClassifierOutput::Given(classes) => return Ok(numbers(classes)),
    };
    let name = name.ok_or("the ONNX classifier has no output")?;
    let mut name = &name;
    for _ in 0..=graph.node.len() {
        let is_output = graph.output.iter().any(|output| output.name() == name);
        let mut all = graph.node.iter().filter(|node| node.input.contains(name));
        let next = all.next();
        if next.is_some() && (is_output || all.next().is_some()) {
            remarks.push(format!("the file gives labels in several ways: the first behind {name} are taken"));
        }
        if is_output {
            return Ok(labels);
        }
        let next = next.ok_or_else(|| {
            format!(
                "ONNX output {name} of the classifier is no output of the graph; help: keep the label as an output; \
                 LightGBM's rf is not read"
            )
        })?;
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

/// Returns labels of a constant list in which the given labels are positions.
fn picked(graph: &Graph, node: &Node, name: &String, labels: &[String]) -> Result<Vec<String>, String> {
    let kind = node.op_type();
    let (Some(list), Some(index)) = (node.input.first(), node.input.get(1)) else {
        return Err(format!("ONNX node {kind} has fewer than two inputs"));
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

pub(super) fn constant<'g>(graph: &'g Graph, name: &String) -> Option<&'g TensorProto> {
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
