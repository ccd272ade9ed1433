//! Weighted sums by the operators of any network (`MatMul`, `Gemm`), and the way from scores to a class.

use super::path::{ClassifierOutput, before, constant};
use super::proto::{Graph, Node};
use super::steps::{Before, Step};
use super::tensor::{DOUBLE, FLOAT, INT32, INT64, Tensor};
use super::{Read, attribute, not_one};
use crate::model::trained::{Kind, Linear, Network, Row};

/// Reads a linear model or a network whose last sums are a `MatMul` or `Gemm`.
pub(super) fn read(graph: &Graph) -> Result<Read, String> {
    // Nodes are in the order of computation.
    let Some(last) = graph.node.iter().rfind(|node| is_product(node)) else {
        return Err(not_one(graph));
    };
    let mut rows = sums(graph, last)?;
    let before = before(graph, last)?;
    let count = graph.node.iter().filter(|node| is_product(node)).count();
    let used = 1 + before.steps.iter().filter(|step| matches!(step, Step::Sums(_))).count();
    if count != used {
        return Err(format!(
            "the ONNX graph has {count} MatMul or Gemm, and {used} of them decide; help: export the classes as the only output"
        ));
    }
    let name = last.output.first().ok_or("an ONNX node has no output")?;
    let answer = highest(graph, name, rows.len().max(2), Some(&mut rows), true)?;
    let inputs = before.inputs(Some(rows[0].weights.len()))?;
    linear(rows, vec![before], inputs, answer)
}

/// Finishes a linear model, or a network: `before` is of all rows, or one for each.
pub(super) fn linear(
    mut rows: Vec<Row>,
    mut before: Vec<Before>,
    inputs: usize,
    answer: ClassifierOutput,
) -> Result<Read, String> {
    let mut layers = Vec::new();
    if let [all] = &before[..] {
        layers = all.layers(rows, inputs)?;
        rows = layers.pop().unwrap_or_default();
    } else {
        rows.chunks_mut(1).zip(&before).try_for_each(|(row, before)| before.fold(row, inputs))?;
    }
    if let [first, second] = &mut rows[..] {
        // For two classes one sum is enough: the second class wins if its sum is above that of the first.
        second.weights.iter_mut().zip(&first.weights).for_each(|(second, first)| *second -= first);
        second.bias -= first.bias;
        rows.remove(0);
    }
    let kind = if layers.is_empty() {
        Kind::Linear(Linear { pairs: false, rows })
    } else {
        layers.push(rows);
        Kind::Network(Network { layers, tops: None })
    };
    Ok(Read { inputs, kind, answer, before: before.swap_remove(0) })
}

fn is_product(node: &Node) -> bool {
    matches!(node.op_type(), "MatMul" | "Gemm")
}

/// Reads the weighted sums of `MatMul` or `Gemm`, one for each output: their weights, and their biases.
pub(super) fn sums(graph: &Graph, node: &Node) -> Result<Vec<Row>, String> {
    let wrong = |why: String| format!("ONNX node {}: {why}", node.op_type());
    let flag = |name| attribute(node, name).and_then(|found| found.i).unwrap_or(0) != 0;
    let factor = |name| f64::from(attribute(node, name).and_then(|found| found.f).unwrap_or(1.0));
    let name = node.input.get(1).ok_or_else(|| wrong("it has fewer than two inputs".into()))?;
    if constant(graph, name).is_some_and(|weights| !weights.external_data.is_empty()) {
        let help = "help: torch.onnx.export(…, external_data=False)";
        return Err(wrong(format!("its weights are in a file of their own, expected them inside; {help}")));
    }
    let (weights, shape) = reals(graph, name).ok_or_else(|| {
        wrong("its second input is no constant of finite float (1) or double (11), expected the weights there".into())
    })?;
    let [height, width] = shape[..] else {
        return Err(wrong(format!("weights have {} dimensions, expected 2", shape.len())));
    };
    let (inputs, outputs) = if flag("transB") { (width, height) } else { (height, width) };
    if flag("transA") || inputs == 0 || outputs == 0 || Some(weights.len()) != inputs.checked_mul(outputs) {
        return Err(wrong(format!("{} weights of {inputs} inputs and {outputs} outputs", weights.len())));
    }
    let at =
        |input: usize, output: usize| if flag("transB") { output * inputs + input } else { input * outputs + output };
    let mut rows: Vec<Row> = (0..outputs)
        .map(|output| Row {
            weights: (0..inputs).map(|input| factor("alpha") * weights[at(input, output)]).collect(),
            bias: 0.0,
        })
        .collect();
    if let Some(name) = node.input.get(2).filter(|name| !name.is_empty()) {
        let bias = reals(graph, name).ok_or_else(|| wrong("its biases are no constant of finite numbers".into()))?;
        add(&mut rows, &bias, factor("beta")).map_err(wrong)?;
    }
    Ok(rows)
}

/// Adds biases to rows; a single one is for all.
fn add(rows: &mut [Row], (list, shape): &(Vec<f64>, Vec<usize>), factor: f64) -> Result<(), String> {
    if ![1, rows.len()].contains(&list.len()) || shape.last().is_some_and(|&last| last != list.len()) {
        return Err(format!("{} biases, expected {}", list.len(), rows.len()));
    }
    rows.iter_mut().zip(list.iter().cycle()).for_each(|(row, bias)| row.bias += factor * bias);
    Ok(())
}

/// Returns a constant of real numbers and its shape, or `None` if it is no such constant or not finite.
pub(super) fn reals(graph: &Graph, name: &String) -> Option<(Vec<f64>, Vec<usize>)> {
    let node = graph.node.iter().find(|node| node.output.contains(name));
    let mut list = match node.map(|node| (node.op_type(), node.input.first())) {
        Some(("Identity", Some(of))) => return reals(graph, of),
        // A whitened PCA divides by the root of variances.
        Some(("Sqrt", Some(of))) => {
            let (list, shape) = reals(graph, of)?;
            (list.into_iter().map(|variance| f64::from((variance as f32).sqrt())).collect(), shape)
        }
        _ => {
            let tensor =
                Tensor::of(constant(graph, name)?).ok().filter(|tensor| matches!(tensor.kind, FLOAT | DOUBLE))?;
            (tensor.floats, tensor.shape)
        }
    };
    if list.1.is_empty() && list.0.len() == 1 {
        list.1 = vec![1];
    }
    list.0.iter().all(|number| number.is_finite()).then_some(list)
}

/// Returns a constant of integers.
pub(super) fn whole(graph: &Graph, name: &String) -> Option<Vec<i64>> {
    let tensor = Tensor::of(constant(graph, name)?).ok()?;
    matches!(tensor.kind, INT32 | INT64).then_some(tensor.integers)
}

/// Finds the class with the highest score, behind operators that keep the order of scores.
///
/// Biases of weighted sums are added to `rows`. Then an output that holds the scores is understood, too, and for two
/// classes the score of the second alone. `is_sum` is `false` for probabilities.
pub(super) fn highest(
    graph: &Graph,
    scores: &String,
    classes: usize,
    mut rows: Option<&mut Vec<Row>>,
    mut is_sum: bool,
) -> Result<ClassifierOutput, String> {
    let mut name = scores;
    let mut is_single = rows.as_ref().is_some_and(|rows| rows.len() == 1);
    let mut probabilities = None;
    for _ in 0..=graph.node.len() {
        let next = || graph.node.iter().filter(|node| node.input.contains(name));
        let found = next().find(|node| node.op_type() == "ArgMax");
        if let Some(node) = found.filter(|_| !is_single) {
            let number = |name, default| attribute(node, name).and_then(|found| found.i).unwrap_or(default);
            if !matches!(number("axis", 0), 1 | -1) || number("select_last_index", 0) != 0 {
                return Err("ArgMax: expected axis 1 or -1, and the first index of those that are equal".into());
            }
            let class = node.output.first().ok_or("an ONNX node has no output")?;
            return Ok(ClassifierOutput::Class(class.clone(), classes));
        }
        // A score of the second class beside its opposite, or beside its probability's.
        if is_single && let Some(node) = next().find(|node| is_opposite(graph, node, name, is_sum)) {
            name = node.output.first().ok_or("an ONNX node has no output")?;
            (is_sum, is_single) = (false, false);
            continue;
        }
        if let Some(rows) = &mut rows
            && is_sum
            && let Some(node) = next().find(|node| node.op_type() == "Add")
            && let Some(bias) = node.input.iter().find(|input| *input != name).and_then(|name| reals(graph, name))
        {
            add(rows, &bias, 1.0).map_err(|why| format!("ONNX node Add: {why}"))?;
            name = node.output.first().ok_or("an ONNX node has no output")?;
            continue;
        }
        // Of a single score a Softmax is 1, and a second Sigmoid above a half.
        let decides = |kind: &str| !is_single || kind == "Identity" || kind == "Sigmoid" && is_sum;
        if let Some(node) = next().find(|node| keeps(node) && decides(node.op_type())) {
            is_sum &= node.op_type() == "Identity";
            name = node.output.first().ok_or("an ONNX node has no output")?;
            continue;
        }
        // SGDClassifier's probabilities, which are divided by their sum.
        let product = next().find(|node| normalizes(graph, node, name, probabilities));
        let end = sigmoid(graph, name).filter(|_| is_sum || !is_single);
        if let Some(end) = end.or_else(|| product?.output.first()) {
            is_sum = false;
            probabilities.get_or_insert(end);
            name = end;
            continue;
        }
        // One score alone is that of the second class only if it is a probability.
        if rows.is_some() && (!is_single || !is_sum) && graph.output.iter().any(|output| output.name() == name) {
            return Ok(ClassifierOutput::Given(classes));
        }
        return Err(match next().next() {
            Some(node) => {
                let kind = node.op_type();
                format!("ONNX node {kind} after the scores, expected ArgMax, or Softmax of axis 1")
            }
            None if is_single => {
                "ONNX classifier gives one score, expected a Sigmoid after it: the second class wins above one half"
                    .into()
            }
            None => "ONNX classifier gives scores, expected ArgMax after it, which gives classes".into(),
        });
    }
    Err("the ONNX graph goes in a circle after the classifier".into())
}

/// Returns `true` for operators that keep the order of scores.
///
/// A Softmax does over the classes of a sample, but not over samples. A Sigmoid of float32 is 1 from a score of about
/// 17 on: of several such scores the highest is taken here, and ONNX takes the first.
fn keeps(node: &Node) -> bool {
    let axis = attribute(node, "axis").and_then(|found| found.i).unwrap_or(-1);
    match node.op_type() {
        "Identity" | "Sigmoid" => true,
        "Softmax" | "LogSoftmax" => matches!(axis, 1 | -1),
        _ => false,
    }
}

/// Returns the output of 1 / (1 + exp(−x)) if it is in single operators.
fn sigmoid<'g>(graph: &'g Graph, mut name: &'g String) -> Option<&'g String> {
    for (kind, number) in [("Mul", Some(-1.0)), ("Exp", None), ("Add", Some(1.0)), ("Reciprocal", None)] {
        let node = graph.node.iter().find(|node| node.op_type() == kind && node.input.first() == Some(name))?;
        let is = |number| reals(graph, node.input.get(1)?).map(|found| found.0 == [number]);
        if number.is_some_and(|number| is(number) != Some(true)) {
            return None;
        }
        name = node.output.first()?;
    }
    Some(name)
}

/// Returns `true` for a sum with, or a division by, what is the same for all probabilities of a sample.
fn normalizes(graph: &Graph, node: &Node, name: &String, probabilities: Option<&String>) -> bool {
    matches!(node.op_type(), "Add" | "Div")
        && node.input.first() == Some(name)
        && probabilities.is_some_and(|all| node.input.get(1).is_some_and(|other| is_total(graph, other, all, 0)))
}

/// Returns `true` for what is computed of a sample's total of probabilities alone.
fn is_total(graph: &Graph, name: &String, probabilities: &String, depth: usize) -> bool {
    let of = |name: &String| is_total(graph, name, probabilities, depth + 1);
    let node = graph.node.iter().find(|node| node.output.contains(name));
    depth < 10
        && match node.map(|node| (node.op_type(), &node.input[..])) {
            Some(("ReduceSum", [all, axis])) => all == probabilities && whole(graph, axis) == Some(vec![1]),
            Some(("Cast" | "Not" | "Add" | "Mul", inputs)) => inputs.iter().all(of),
            _ => reals(graph, name).is_some_and(|found| matches!(found.0[..], [one] if one >= 0.0)),
        }
}

/// Returns `true` for a `Concat` along the classes of −x and a sum x, or of 1 − x and a probability x.
fn is_opposite(graph: &Graph, node: &Node, name: &String, is_sum: bool) -> bool {
    let ("Concat", [first, second]) = (node.op_type(), &node.input[..]) else { return false };
    let Some(of) = graph.node.iter().find(|node| node.output.contains(first)) else { return false };
    let is = |input: usize, number| {
        of.input.get(input).and_then(|name| reals(graph, name)).is_some_and(|found| found.0 == [number])
    };
    let opposite = match of.op_type() {
        "Neg" => is_sum,
        "Mul" => is_sum && (is(0, -1.0) || is(1, -1.0)),
        "Sub" => !is_sum && is(0, 1.0),
        _ => false,
    };
    second == name && opposite && of.input.contains(name) && joins_classes(node)
}

/// Returns `true` for a `Concat` of numbers of one sample.
pub(super) fn joins_classes(node: &Node) -> bool {
    matches!(attribute(node, "axis").and_then(|axis| axis.i), Some(1 | -1))
}
