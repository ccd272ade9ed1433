use super::*;
use crate::model::write::{Options, write};

/// Encodes a field of bytes.
fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
    let mut field = vec![number << 3 | 2];
    let mut length = bytes.len();
    while length >= 0x80 {
        field.push(length as u8 | 0x80);
        length >>= 7;
    }
    field.push(length as u8);
    field.extend(bytes);
    field
}

fn attribute_of(name: &str, more: &[Vec<u8>]) -> Vec<u8> {
    field(5, &[field(1, name.as_bytes()), more.concat()].concat())
}

fn floats_of(name: &str, floats: &[f32]) -> Vec<u8> {
    // The first number is alone, the others are packed.
    let (first, rest) = floats.split_first().unwrap();
    let packed: Vec<u8> = rest.iter().flat_map(|float| float.to_le_bytes()).collect();
    attribute_of(name, &[[&[7 << 3 | 5][..], &first.to_le_bytes()].concat(), field(7, &packed)])
}

fn integers_of(name: &str, numbers: &[u8]) -> Vec<u8> {
    attribute_of(name, &[vec![8 << 3, numbers[0]], field(8, &numbers[1..])])
}

fn texts_of(name: &str, texts: &[&str]) -> Vec<u8> {
    attribute_of(name, &texts.iter().map(|text| field(9, text.as_bytes())).collect::<Vec<_>>())
}

fn node(kind: &str, input: &str, output: &str, attributes: &[Vec<u8>]) -> Vec<u8> {
    let names = [field(1, input.as_bytes()), field(2, output.as_bytes()), field(4, kind.as_bytes())];
    field(1, &[names.concat(), attributes.concat()].concat())
}

fn model(nodes: &[Vec<u8>]) -> Vec<u8> {
    model_of(nodes, &[1 << 3, 0xBC, 5])
}

/// Encodes a model whose input's last dimension is `width`: a field of a number, or empty.
fn model_of(nodes: &[Vec<u8>], width: &[u8]) -> Vec<u8> {
    let shape = field(2, &[field(1, &[]), field(1, width)].concat());
    let input = field(11, &[field(1, b"X"), field(2, &field(1, &shape))].concat());
    let graph = [nodes.concat(), input, field(12, &field(1, b"label"))].concat();
    [field(2, b"test"), field(3, b"1"), field(7, &graph)].concat()
}

fn forest(mode: &str, threshold: f32) -> Vec<Vec<u8>> {
    vec![
        integers_of("nodes_treeids", &[0, 0, 0]),
        integers_of("nodes_nodeids", &[0, 1, 2]),
        integers_of("nodes_featureids", &[71, 0, 0]),
        integers_of("nodes_truenodeids", &[1, 0, 0]),
        integers_of("nodes_falsenodeids", &[2, 0, 0]),
        floats_of("nodes_values", &[threshold, 0.0, 0.0]),
        texts_of("nodes_modes", &[mode, "LEAF", "LEAF"]),
        integers_of("class_treeids", &[0, 0]),
        integers_of("class_nodeids", &[1, 2]),
        integers_of("class_ids", &[0, 1]),
        floats_of("class_weights", &[1.0, 1.0]),
        texts_of("classlabels_strings", &["Saw", "Tri"]),
    ]
}

/// Returns the answers of a model for these values of feature 1 of frame 1.
fn answers_to(found: &Trained, values: impl IntoIterator<Item = i16>) -> Result<Vec<u8>, String> {
    let words = write(found, "", Options::default())?.words;
    let read = wstac_core::model::Model::from_words(&words).unwrap();
    let answer = |x| {
        let mut sample = [0; 700];
        sample[11] = x;
        read.classify(&sample)
    };
    Ok(values.into_iter().map(answer).collect())
}

/// Returns the answers of a model for feature 1 of frame 1 at its least value, 0, 1 and its largest value.
fn answers(nodes: &[Vec<u8>]) -> Result<[u8; 4], String> {
    let found = read(&model(nodes), None)?.0;
    answers_to(&found, [i16::MIN, 0, 1, i16::MAX]).map(|all| all.try_into().unwrap())
}

/// Checks that a file is refused with these words.
#[track_caller]
fn is_refused(bytes: &[u8], says: &str) {
    let error = read(bytes, None).unwrap_err();
    assert!(error.contains(says), "{error}");
}

#[test]
fn boosted_trees_have_starts_and_a_class_for_a_tie() {
    // The tree's leaves: a class and a weight for x at most 0, and for x above 0.
    let boosted = |transform: &str, labels: &[&str], leaves: &[(u8, u8, f32)], base: &[f32], missing: u8| {
        let mut lists = forest("BRANCH_LEQ", 0.0);
        lists[7] = integers_of("class_treeids", &vec![0; leaves.len()]);
        lists[8] = integers_of("class_nodeids", &leaves.iter().map(|leaf| leaf.0).collect::<Vec<_>>());
        lists[9] = integers_of("class_ids", &leaves.iter().map(|leaf| leaf.1).collect::<Vec<_>>());
        lists[10] = floats_of("class_weights", &leaves.iter().map(|leaf| leaf.2).collect::<Vec<_>>());
        lists[11] = texts_of("classlabels_strings", labels);
        lists.push(attribute_of("post_transform", &[field(4, transform.as_bytes())]));
        lists.push(integers_of("nodes_missing_value_tracks_true", &[missing, 0, 0]));
        lists.extend((!base.is_empty()).then(|| floats_of("base_values", base)));
        vec![node("TreeEnsembleClassifier", "X", "label", &lists)]
    };
    let (two, three) = (&["a", "b"][..], &["a", "b", "c"][..]);
    let single = &[(1, 0, -0.5), (2, 0, 0.75)][..];
    assert_eq!(answers(&boosted("LOGISTIC", two, single, &[], 0)), Ok([0, 0, 1, 1]));
    assert_eq!(answers(&boosted("LOGISTIC", two, single, &[0.625], 0)), Ok([1; 4]));
    assert_eq!(answers(&boosted("LOGISTIC", two, single, &[0.25, -0.75], 0)), Ok([0; 4]));
    let mirrored = &[(1, 0, 0.5), (1, 1, -0.5), (2, 0, -0.25), (2, 1, 0.25)][..];
    let nodes = boosted("LOGISTIC", two, mirrored, &[], 0);
    assert_eq!(answers(&nodes), Ok([0, 0, 1, 1]));
    let Kind::Boosted(trees) = read(&model(&nodes), None).unwrap().0.kind else { panic!() };
    assert_eq!(trees.scores.len(), 1);
    assert_eq!(answers(&boosted("SOFTMAX", two, mirrored, &[0.0, -0.5], 0)), Ok([0; 4]));
    let many = &[(1, 0, 0.5), (1, 2, 0.75), (2, 1, 0.25)][..];
    assert_eq!(answers(&boosted("SOFTMAX", three, many, &[], 0)), Ok([2, 2, 1, 1]));
    assert_eq!(answers(&boosted("NONE", three, many, &[0.0, 0.0, -1.0], 0)), Ok([0, 0, 1, 1]));
    assert_eq!(answers(&boosted("LOGISTIC", three, many, &[0.5, 0.0, 0.0], 0)), Ok([0; 4]));
    // A score of 0 is the first class's, except in GradientBoostingClassifier, whose nodes hold nothing about NaN.
    let tie = |producer: &str, missing| {
        let bytes = model(&boosted("LOGISTIC", two, &[(1, 0, 0.0), (2, 0, 0.0)], &[0.0], missing));
        let named = [&field(2, producer.as_bytes())[..], &bytes[6..]].concat();
        answers_to(&read(&named, None).unwrap().0, [0]).unwrap()[0]
    };
    assert_eq!([tie("skl2onnx", 0), tie("skl2onnx", 1), tie("OnnxMLTools", 0)], [1, 0, 0]);
    are_refused(&[
        (boosted("SOFTMAX", two, single, &[], 0), "SOFTMAX with weights of one class"),
        (boosted("PROBIT", two, single, &[], 0), "post_transform PROBIT, expected NONE, LOGISTIC or SOFTMAX"),
        (boosted("NONE", two, single, &[1.0], 0), "base_values, expected none in a forest"),
        (boosted("SOFTMAX", three, many, &[1.0, 0.0], 0), "2 base_values, expected none or 3"),
        (boosted("SOFTMAX", three, many, &[1.0, f32::INFINITY, 0.0], 0), "base_values[1] is inf"),
    ]);
}

/// Checks that models of these nodes are refused with these words.
#[track_caller]
fn are_refused(cases: &[(Vec<Vec<u8>>, &str)]) {
    for (nodes, says) in cases {
        let error = answers(nodes).unwrap_err();
        assert!(error.contains(says), "{error}");
    }
}

/// Encodes a node with several inputs.
fn node_of(kind: &str, inputs: &[&str], output: &str, attributes: &[Vec<u8>]) -> Vec<u8> {
    let inputs: Vec<u8> = inputs.iter().flat_map(|input| field(1, input.as_bytes())).collect();
    field(1, &[inputs, field(2, output.as_bytes()), field(4, kind.as_bytes()), attributes.concat()].concat())
}

/// Encodes a constant of floats (type 1) or 64-bit integers (type 7), beside the nodes of a graph.
fn constant_of(name: &str, kind: u8, shape: &[u8], raw: &[u8]) -> Vec<u8> {
    let shape: Vec<u8> = shape.iter().flat_map(|&length| [1 << 3, length]).collect();
    // 700 takes two bytes.
    let shape = if shape.len() == 4 && shape[1] == 70 { [&[1 << 3, 0xBC, 5][..], &shape[2..]].concat() } else { shape };
    field(5, &[shape, vec![2 << 3, kind], field(8, name.as_bytes()), field(9, raw)].concat())
}

fn raw(floats: &[f32]) -> Vec<u8> {
    floats.iter().flat_map(|float| float.to_le_bytes()).collect()
}

/// Returns the weights of a `MatMul` in which only feature 1 of frame 1 counts.
fn weights(row: &[f32]) -> Vec<u8> {
    let mut list = vec![0.0; 700 * row.len()];
    list[71 * row.len()..][..row.len()].copy_from_slice(row);
    constant_of("w", 1, &[70, row.len() as u8], &raw(&list))
}

#[test]
fn weighted_sums_are_those_of_any_network() {
    let product = || node_of("MatMul", &["X", "w"], "y", &[]);
    let bias = |list: &[f32]| constant_of("b", 1, &[list.len() as u8], &raw(list));
    let add = |output: &str| node_of("Add", &["y", "b"], output, &[]);
    let highest = |of: &str| node("ArgMax", of, "label", &[number_of("axis", 1)]);
    // Two sums; three, of which the one with the highest bias wins until the features are large.
    let of = |constant: Vec<u8>| vec![constant, product(), highest("y")];
    let two = || of(weights(&[1.0, 2.0]));
    let behind = |kind: &str| {
        let product = node_of("MatMul", &["x", "w"], "y", &[]);
        vec![weights(&[1.0, 2.0]), node(kind, "X", "x", &[]), product, highest("y")]
    };
    assert_eq!(answers(&two()), Ok([0, 0, 1, 1]));
    let three = |last| vec![weights(&[-1.0, 0.0, 1.0]), bias(&[0.0, 2.0, 0.0]), product(), add("z"), last];
    assert_eq!(answers(&three(highest("z"))), Ok([0, 1, 1, 2]));
    // Scores without an ArgMax.
    assert_eq!(answers(&three(node("Softmax", "z", "label", &[]))), Ok([0, 1, 1, 2]));
    let found = read(&model(&three(node("Softmax", "z", "label", &[]))), None).unwrap().0;
    assert_eq!(found.remarks, ["the file gives scores: the highest is the answer"]);
    let remarks = read(&model(&three(node("Sigmoid", "z", "label", &[]))), None).unwrap().0.remarks;
    assert!(remarks[1].starts_with("a Sigmoid of float32 is 1 from a score of about 17 on"), "{remarks:?}");
    // One sum is the second class's: with a Sigmoid, or beside its opposite.
    let one = |more: &[Vec<u8>]| [vec![weights(&[1.0]), bias(&[-0.25]), product(), add("z")], more.to_vec()].concat();
    assert_eq!(answers(&one(&[node("Sigmoid", "z", "label", &[])])), Ok([0, 0, 0, 1]));
    let opposite = |inputs: &[&str]| {
        [node("Neg", "z", "n", &[]), node_of("Concat", inputs, "c", &[number_of("axis", 1)]), highest("c")]
    };
    assert_eq!(answers(&one(&opposite(&["n", "z"]))), Ok([0, 0, 0, 1]));
    let opposite_of = |of: &str, axis: u8| {
        let both = node_of("Concat", &["n", of], "c", &[number_of("axis", axis)]);
        vec![node("Neg", of, "n", &[]), both, highest("c")]
    };
    are_refused(&[
        (one(&[highest("z")]), "ONNX node ArgMax after the scores"),
        (one(&[node("Identity", "z", "label", &[])]), "gives one score, expected a Sigmoid after it"),
        (
            [two(), vec![node_of("MatMul", &["X", "w"], "other", &[])]].concat(),
            "has 2 MatMul or Gemm, and 1 of them decide; help: export",
        ),
        (behind("Tanh"), "; help: train it with activation="),
        (one(&opposite(&["z", "n"])), "ONNX node Neg after the scores"),
        // Of a probability, the opposite decides at 0 instead of a half; other samples are no classes.
        (one(&[vec![node("Sigmoid", "z", "p", &[])], opposite_of("p", 1)].concat()), "ONNX node Neg after the scores"),
        (one(&opposite_of("z", 0)), "ONNX node Neg after the scores"),
        // Of one score these decide nothing.
        (one(&[node("Softmax", "z", "label", &[])]), "ONNX node Softmax after the scores"),
        (
            one(&[node("Sigmoid", "z", "p", &[]), node("Sigmoid", "p", "label", &[])]),
            "ONNX node Sigmoid after the scores",
        ),
        (three(node("Relu", "z", "label", &[])), "ONNX node Relu after the scores"),
        (three(node("Softmax", "z", "label", &[number_of("axis", 0)])), "ONNX node Softmax after the scores"),
        (
            vec![weights(&[1.0, 2.0]), bias(&[1.0, 2.0, 3.0]), product(), add("z"), highest("z")],
            "Add: 3 biases, expected 2",
        ),
        (behind("Relu"), "a hidden layer has 700 sums, expected 1 to 128"),
        (of(constant_of("w", 1, &[2, 2], &raw(&[1.0; 4]))), "gives the classifier 700 numbers, expected 2"),
        (of(constant_of("w", 1, &[2, 3], &raw(&[1.0; 4]))), "4 weights of 2 inputs and 3 outputs"),
        (of(weights(&[1.0, f32::NAN])), "second input is no constant"),
        (of(field(5, &[field(8, b"w"), field(13, b"w")].concat())), "in a file of their own"),
    ]);
}

#[test]
fn steps_before_a_classifier_have_a_limit() {
    let name = |at: usize| if at == 0 { "X".to_owned() } else { format!("x{at}") };
    let mut nodes: Vec<Vec<u8>> = (0..66).map(|at| node("Relu", &name(at), &name(at + 1), &[])).collect();
    nodes.extend([weights(&[1.0, 2.0]), node_of("MatMul", &["x66", "w"], "y", &[])]);
    nodes.push(node("ArgMax", "y", "label", &[number_of("axis", 1)]));
    are_refused(&[(nodes, "65 steps of 0 weights before the classifier, expected at most 64")]);
}

#[test]
fn a_network_has_rectifiers_between_weighted_sums() {
    let bias = constant_of("b", 1, &[2], &raw(&[-2.0, 0.0]));
    let gemm = |more: &[Vec<u8>]| node_of("Gemm", &["r", "v", "b"], "s", more);
    // Class 0 wins if the feature is further than 2 from 0.
    let nodes = |last: Vec<u8>| {
        vec![
            weights(&[1.0, -1.0]),
            constant_of("v", 1, &[2, 2], &raw(&[1.0, 0.0, 1.0, 0.0])),
            bias.clone(),
            node_of("MatMul", &["X", "w"], "y", &[]),
            node("Dropout", "y", "d", &[]),
            node("Relu", "d", "r", &[]),
            last,
            node("ArgMax", "s", "label", &[number_of("axis", 1)]),
        ]
    };
    assert_eq!(answers(&nodes(gemm(&[]))), Ok([0, 1, 1, 0]));
    let found = read(&model(&nodes(gemm(&[]))), None).unwrap().0;
    let Kind::Network(network) = found.kind else { panic!("{:?}", found.kind) };
    let sums: Vec<usize> = network.layers.iter().map(Vec::len).collect();
    // Of two classes, one sum decides.
    assert_eq!(sums, [2, 1]);
    are_refused(&[(nodes(gemm(&[number_of("transA", 1)])), "4 weights of 2 inputs and 2 outputs")]);
}

#[test]
fn steps_before_a_classifier_are_folded() {
    let list = |name: &str, list: &[f32]| constant_of(name, 1, &[list.len() as u8], &raw(list));
    let pick = |at: u64| {
        [
            constant_of("i", 7, &[2], &[at.to_le_bytes(), 5_u64.to_le_bytes()].concat()),
            node_of("ArrayFeatureExtractor", &["X", "i"], "p", &[]),
        ]
        .concat()
    };
    let mut lists = forest("BRANCH_LEQ", 1.0);
    lists[2] = integers_of("nodes_featureids", &[0, 0, 0]);
    let tree = |input: &str| node("TreeEnsembleClassifier", input, "label", &lists);
    assert_eq!(answers(&[pick(71), tree("p")]), Ok([0, 0, 0, 1]));
    assert_eq!(answers(&[pick(72), tree("p")]), Ok([0; 4]));
    // 2 x + 1 is above 1 from the first number above 0 on; (x − 1) / 2 at 3.
    let scaled = [
        list("f", &[2.0]),
        list("g", &[1.0]),
        pick(71),
        node_of("Mul", &["f", "p"], "m", &[]),
        node_of("Add", &["m", "g"], "a", &[]),
    ];
    assert_eq!(answers(&[&scaled[..], &[tree("a")]].concat()), Ok([0, 0, 1, 1]));
    let scaled = [
        list("f", &[2.0]),
        list("g", &[1.0]),
        pick(71),
        node_of("Sub", &["p", "g"], "m", &[]),
        node_of("Div", &["m", "f"], "a", &[]),
    ];
    let nodes = [&scaled[..], &[tree("a")]].concat();
    assert_eq!(answers(&nodes), Ok([0, 0, 0, 1]));
    // A batch's mean of 0.25 and deviation of 2: (x − 0.25) / 2 · 4 + 1.4995 is above 1 there as well. A Flatten
    // changes nothing.
    let batch = [("g", 4.0), ("s", 1.4995), ("m", 0.25), ("v", 4.0)].map(|(name, number)| list(name, &[number; 2]));
    let normal = |inputs: &[&str]| node_of("BatchNormalization", inputs, "a", &[]);
    let scaled_batch = [pick(71), node("Flatten", "p", "q", &[]), normal(&["q", "g", "s", "m", "v"]), tree("a")];
    assert_eq!(answers(&[&batch[..], &scaled_batch].concat()), Ok([0, 0, 1, 1]));
    // The same before weighted sums: the second class has (x − 1) / 2 + 0.5, which is x / 2.
    let sums = [
        node_of("MatMul", &["a", "w"], "y", &[]),
        node_of("Add", &["y", "b"], "z", &[]),
        node("ArgMax", "z", "label", &[number_of("axis", 1)]),
    ];
    let constants = [constant_of("w", 1, &[2, 2], &raw(&[0.0, 1.0, 0.0, 0.0])), list("b", &[0.0, 0.5])];
    assert_eq!(answers(&[&scaled[..], &constants, &sums].concat()), Ok([0, 0, 1, 1]));
    // PCA: sums before sums; −2 x, of which the second class has −1.
    let before = [weights(&[1.0, -2.0]), node_of("MatMul", &["X", "w"], "a", &[])];
    let after = [constant_of("v", 1, &[2, 2], &raw(&[0.0, 0.0, 0.0, -1.0])), node_of("MatMul", &["a", "v"], "y", &[])];
    let end = [node("ArgMax", "y", "label", &[number_of("axis", 1)])];
    assert_eq!(answers(&[&before[..], &after, &end].concat()), Ok([0, 0, 1, 1]));
    let imputer = |value: f32| {
        let value = attribute_of("replaced_value_float", &[[&[2 << 3 | 5][..], &value.to_le_bytes()].concat()]);
        vec![
            node("Imputer", "X", "p", &[value]),
            node("TreeEnsembleClassifier", "p", "label", &forest("BRANCH_LEQ", 0.0)),
        ]
    };
    assert_eq!(answers(&imputer(f32::NAN)), Ok([0, 0, 1, 1]));
    are_refused(&[
        (imputer(0.0), "Imputer of numbers"),
        (vec![pick(700), tree("p")], "input 700 is selected, expected below 700"),
        (
            vec![pick(71), node("TreeEnsembleClassifier", "p", "label", &forest("BRANCH_LEQ", 0.0))],
            "input 71, expected below 2",
        ),
        ([&before[..], &[tree("a")]].concat(), "its input is a weighted sum"),
        (vec![list("f", &[-2.0]), node_of("Mul", &["X", "f"], "a", &[]), tree("a")], "scaled by -2, expected above 0"),
        (vec![list("f", &[0.0]), node_of("Div", &["X", "f"], "a", &[]), tree("a")], "scaled by 0, expected above 0"),
        (
            vec![list("f", &[1.0; 3]), node_of("Add", &["X", "f"], "a", &[]), tree("a")],
            "scaling has 3 numbers, expected 1 or 700",
        ),
        (
            vec![list("f", &[1.0]), node_of("Sub", &["f", "X"], "a", &[]), tree("a")],
            "ONNX node Sub before the classifier",
        ),
        (vec![node_of("Gather", &["X", "X"], "a", &[]), tree("a")], "selects by other numbers"),
        (vec![normal(&["X", "X"]), tree("a")], "BatchNormalization before the classifier, expected constants"),
        (vec![node("Flatten", "X", "a", &[number_of("axis", 0)]), tree("a")], "help: train it on X.reshape(-1, 700)"),
    ]);
}

fn number_of(name: &str, number: u8) -> Vec<u8> {
    attribute_of(name, &[vec![3 << 3, number]])
}

/// Encodes a tensor in an attribute: type 1 is floats, type 2 is bytes, both raw.
fn tensor_of(name: &str, kind: u8, raw: &[u8]) -> Vec<u8> {
    attribute_of(name, &[field(5, &[vec![2 << 3, kind], field(9, raw)].concat())])
}

/// Encodes two trees of `TreeEnsemble` for three classes.
///
/// One has a split of feature 1 of frame 1 at −1. The other is a leaf of class 2 and weight 1.5.
fn five(weights: [f32; 2], classes: [u8; 2]) -> Vec<Vec<u8>> {
    vec![
        tensor_of("nodes_modes", 2, &[0, 0]),
        tensor_of("nodes_splits", 1, &raw(&[-1.0, 0.0])),
        tensor_of("leaf_weights", 1, &raw(&[weights[0], weights[1], 1.5])),
        integers_of("nodes_featureids", &[71, 0]),
        integers_of("nodes_truenodeids", &[0, 2]),
        integers_of("nodes_falsenodeids", &[1, 2]),
        integers_of("nodes_trueleafs", &[1, 1]),
        integers_of("nodes_falseleafs", &[1, 1]),
        integers_of("leaf_targetids", &[classes[0], classes[1], 2]),
        integers_of("tree_roots", &[0, 1]),
        number_of("n_targets", 3),
    ]
}

#[test]
fn trees_of_version_5_add_or_vote() {
    let read = |weights: &[f32; 2], classes: &[u8; 2]| {
        let argmax = node("ArgMax", "scores", "label", &[number_of("axis", 1)]);
        let (found, _) =
            read(&model(&[node("TreeEnsemble", "X", "scores", &five(*weights, *classes)), argmax]), None).unwrap();
        assert_eq!((found.labels.join(",").as_str(), found.inputs), ("0,1,2", 700));
        answers_to(&found, [-2048, -2047]).unwrap()
    };
    // Votes of equal weight: a tie goes to the lower class.
    assert_eq!(read(&[1.5, 1.5], &[0, 1]), [0, 1]);
    assert_eq!(read(&[1.5, 1.5], &[2, 1]), [2, 1]);
    // Scores: 1.25 is less than the other tree's 1.5, 1.75 is more.
    assert_eq!(read(&[1.25, 1.75], &[1, 1]), [2, 1]);
    assert_eq!(read(&[1.5, -1.0], &[1, 1]), [1, 2]);
    // Leaves of one tree may be of different classes.
    assert_eq!(read(&[1.25, 1.75], &[0, 1]), [2, 1]);
}

#[test]
fn labels_are_followed_to_the_output() {
    let classifier = |output: &str| {
        let mut attributes = forest("BRANCH_LEQ", 0.0);
        *attributes.last_mut().unwrap() = integers_of("classlabels_int64s", &[1, 0]);
        node("TreeEnsembleClassifier", "X", output, &attributes)
    };
    let encoder = [integers_of("keys_int64s", &[0, 1, 2]), texts_of("values_strings", &["Fla", "Sin", "Saw"])];
    let encoded = model(&[classifier("y"), node("LabelEncoder", "y", "label", &encoder)]);
    assert_eq!(read(&encoded, None).unwrap().0.labels, ["Sin", "Fla"]);
    // The answer is a position in a constant list of labels.
    let list = field(5, &[vec![2 << 3, 8], field(6, b"Tri"), field(6, b"Saw")].concat());
    let constant = node("Constant", "none", "list", &[field(5, &[field(1, b"value"), list].concat())]);
    let names = [field(1, b"list"), field(1, b"y"), field(2, b"label"), field(4, b"ArrayFeatureExtractor")];
    let picks = field(1, &names.concat());
    let picked = model(&[constant, classifier("y"), picks]);
    assert_eq!(read(&picked, None).unwrap().0.labels, ["Saw", "Tri"]);
    let cast = node("Cast", "y", "label", &[number_of("to", 7)]);
    let found = read(&model(&[classifier("y"), cast.clone()]), None).unwrap().0;
    assert_eq!((found.labels, found.remarks), (vec!["1".into(), "0".into()], vec![]));
    // Another node also makes labels of it.
    let found = read(&model(&[classifier("y"), cast, node("Identity", "y", "other", &[])]), None).unwrap().0;
    assert_eq!(found.remarks, ["the file gives labels in several ways: the first behind y are taken"]);
}

#[test]
fn shares_that_float32_took_are_given_back() {
    // One third and two thirds of one of three votes, as a file stores them.
    for (of, exact) in [(3.0_f64, true), (1021.0, true), (2_000_003.0, false)] {
        let mut attributes = forest("BRANCH_LEQ", 0.0);
        attributes[7] = integers_of("class_treeids", &[0, 0, 0]);
        attributes[8] = integers_of("class_nodeids", &[1, 2, 2]);
        attributes[9] = integers_of("class_ids", &[0, 0, 1]);
        let share = |parts: f64| (parts / of) as f32;
        attributes[10] = floats_of("class_weights", &[1.0, share(1.0), share(of - 1.0)]);
        let bytes = model(&[node("TreeEnsembleClassifier", "X", "label", &attributes)]);
        let said = write(&read(&bytes, None).unwrap().0, "", Options::default()).unwrap().exactness;
        assert_eq!(said == "thresholds and votes are exact", exact, "{of}: {said}");
    }
}

#[test]
fn rows_of_two_classes_without_intercepts_are_told_by_the_inputs() {
    // The second class's row, or the first's and the second's: x is feature 0 of frame 0, times 2 or 1 − 3.
    let linear = |numbers: &[(usize, f32)], count: usize, intercepts: &[f32]| {
        let mut coefficients = vec![0.0; count];
        for &(at, number) in numbers {
            coefficients[at] = number;
        }
        let mut lists = vec![floats_of("coefficients", &coefficients), integers_of("classlabels_ints", &[0, 1])];
        lists.extend((!intercepts.is_empty()).then(|| floats_of("intercepts", intercepts)));
        vec![node("LinearClassifier", "X", "label", &lists)]
    };
    let whole = [1 << 3, 0xBC, 5];
    let half = [1 << 3, 0xDE, 2];
    let (one, two) = (&[(0, 2.0)][..], &[(0, 3.0), (700, 1.0)][..]);
    for (nodes, width, inputs, above) in [
        (linear(one, 700, &[]), &whole[..], 700, 1),
        (linear(two, 1400, &[]), &whole, 700, 0),
        (linear(&[(0, 3.0), (350, 1.0)], 700, &[]), &half, 350, 0),
        (linear(one, 350, &[]), &half, 350, 1),
        (linear(two, 1400, &[]), &[], 700, 0),
        (linear(one, 700, &[0.0]), &[], 700, 1),
        (linear(&[(0, 3.0), (350, 1.0)], 700, &[0.0, 0.0]), &[], 350, 0),
    ] {
        let found = read(&model_of(&nodes, width), None).unwrap().0;
        assert_eq!(found.inputs, inputs);
        let words = write(&found, "", Options::default()).unwrap().words;
        let mut sample = [0; 700];
        sample[0] = 2048;
        assert_eq!(wstac_core::model::Model::from_words(&words).unwrap().classify(&sample), above);
    }
    for (nodes, width, says) in [
        (linear(one, 700, &[]), &[][..], "one row or two"),
        (linear(one, 710, &[]), &whole, "710 coefficients of 2 classes and 700 inputs"),
        (linear(one, 7, &[]), &[], "7 coefficients of 2 classes and inputs of unknown number"),
    ] {
        is_refused(&model_of(&nodes, width), says);
    }
}

#[test]
fn probabilities_of_an_svm_do_not_change_its_label() {
    let svm = |more: &[Vec<u8>]| {
        let (mut vectors, coefficients) = (vec![0.0; 1400], [1.0, -1.0]);
        (vectors[0], vectors[700]) = (1.0, -1.0);
        let lists = [
            integers_of("classlabels_ints", &[0, 1]),
            integers_of("vectors_per_class", &[1, 1]),
            floats_of("support_vectors", &vectors),
            floats_of("coefficients", &coefficients),
            floats_of("rho", &[0.5]),
        ];
        let bytes = model(&[node("SVMClassifier", "X", "label", &[lists.concat(), more.concat()])]);
        let (model, origin) = read(&bytes, None).unwrap();
        (write(&model, "", Options::default()).unwrap().words, origin.spreads)
    };
    let probabilities = [floats_of("prob_a", &[-3.5]), floats_of("prob_b", &[f32::NAN])];
    assert_eq!(svm(&probabilities).0, svm(&[]).0);
    // Two coefficients of about 2^-24, each times a product of -2.5.
    assert!(svm(&[]).1.iter().all(|spread| (8e-8..9e-8).contains(spread)), "{:?}", svm(&[]).1);
}

#[test]
fn numbers_that_are_not_finite_are_named() {
    let changed = |list: &str, index: usize, number: f32| {
        let mut attributes = forest("BRANCH_LEQ", 0.0);
        let at = if list == "nodes_values" { 5 } else { 10 };
        let mut numbers = vec![0.0; if at == 5 { 3 } else { 2 }];
        numbers[index] = number;
        attributes[at] = floats_of(list, &numbers);
        node("TreeEnsembleClassifier", "X", "label", &attributes)
    };
    let numbers_of = |list: &'static str, place: usize, number: f32| {
        move |name: &str, count: usize| {
            let changed = |at: usize| if name == list && at == place { number } else { 1.0 };
            floats_of(name, &(0..count).map(changed).collect::<Vec<_>>())
        }
    };
    let linear = |list: &'static str, number: f32| {
        let numbers = numbers_of(list, 1, number);
        let labels = integers_of("classlabels_ints", &[0, 1]);
        let scaler = node("Scaler", "X", "y", &[numbers("offset", 700), numbers("scale", 700)]);
        let lists = [numbers("coefficients", 1400), numbers("intercepts", 2), labels];
        vec![scaler, node("LinearClassifier", "y", "label", &lists)]
    };
    let svm = |list: &'static str, number: f32| {
        let numbers = numbers_of(list, 0, number);
        let counts = [integers_of("classlabels_ints", &[0, 1]), integers_of("vectors_per_class", &[1, 1])];
        let lists = [numbers("support_vectors", 1400), numbers("coefficients", 2), numbers("rho", 2)];
        vec![node("SVMClassifier", "X", "label", &[counts.concat(), lists.concat()])]
    };
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for (nodes, says) in [
            (vec![changed("class_weights", 1, number)], "class_weights[1] is"),
            (linear("offset", number), "Scaler: offset[1] is"),
            (linear("scale", number), "Scaler: scale[1] is"),
            (linear("coefficients", number), "coefficients[1] is"),
            (linear("intercepts", number), "intercepts[1] is"),
            (svm("support_vectors", number), "support_vectors[0] is"),
            (svm("coefficients", number), "coefficients[0] is"),
            (svm("rho", number), "rho[0] is"),
        ] {
            let error = read(&model(&nodes), None).unwrap_err();
            assert!(error.contains(says) && error.contains(&number.to_string()), "{error}");
        }
    }
    is_refused(&model(&[changed("nodes_values", 0, f32::NAN)]), "nodes_values[0] is NaN");
    // Subnormal numbers are valid numbers: the threshold is just above 0. No number is on the other side of infinity.
    for (threshold, expected) in
        [(f32::from_bits(1), [0, 0, 1, 1]), (f32::INFINITY, [0; 4]), (f32::NEG_INFINITY, [1; 4])]
    {
        let nodes = [node("TreeEnsembleClassifier", "X", "label", &forest("BRANCH_LT", threshold))];
        assert_eq!(answers(&nodes), Ok(expected));
    }
}

fn whole() -> Vec<u8> {
    model(&[
        node("Cast", "X", "cast", &[number_of("to", 1)]),
        node("Scaler", "cast", "scaled", &[floats_of("offset", &[0.5]), floats_of("scale", &[2.0])]),
        node("TreeEnsembleClassifier", "scaled", "raw", &forest("BRANCH_LEQ", -1.0)),
        node("Identity", "raw", "label", &[]),
    ])
}

#[test]
fn a_forest_is_read_with_its_labels() {
    let bytes = model(&[node("TreeEnsembleClassifier", "X", "label", &forest("BRANCH_LT", -1.0))]);
    let (found, trainer) = read(&bytes, None).unwrap();
    let expected = ("Saw,Tri".into(), 700, "ONNX of test 1");
    assert_eq!((found.labels.join(","), found.inputs, trainer.tool.as_str()), expected);
    assert_eq!(answers_to(&found, [-2049, -2048, 0]).unwrap(), [0, 1, 1]);
}

#[test]
fn other_names_and_numbers_of_classes_are_remarked() {
    let remarks = |labels: &[u8], given: Option<[&str; 2]>| {
        let mut attributes = forest("BRANCH_LT", -1.0);
        *attributes.last_mut().unwrap() = labels.to_vec();
        let bytes = model(&[node("TreeEnsembleClassifier", "X", "label", &attributes)]);
        let labels = given.map(|names| names.map(str::to_owned).to_vec());
        crate::model::trained(bytes, &crate::model::Import { labels, ..Default::default() }).unwrap().0.remarks
    };
    let [named, numbered] =
        [texts_of("classlabels_strings", &["Saw", "Tri"]), integers_of("classlabels_int64s", &[1, 0])];
    assert_eq!(remarks(&named, Some(["Tri", "Saw"])), ["--labels renames Saw to Tri, Tri to Saw"]);
    assert_eq!(remarks(&named, Some(["Saw", "Tri"])), [""; 0]);
    assert_eq!(remarks(&named, None), [""; 0]);
    assert_eq!(remarks(&numbered, Some(["Saw", "Tri"])), [""; 0]);
    let hint = "the classes are numbers: --labels A,B,… gives these 2 names, in this order";
    assert_eq!(remarks(&numbered, None), [hint]);
}

/// Encodes boosted trees behind a selection, and weighted sums behind scaling, of ten inputs.
fn others() -> [Vec<u8>; 2] {
    let mut lists = forest("BRANCH_GT", 1.0);
    lists[2] = integers_of("nodes_featureids", &[1, 0, 0]);
    lists.push(attribute_of("post_transform", &[field(4, b"LOGISTIC")]));
    lists.push(floats_of("base_values", &[0.5, 0.25]));
    let list = |name: &str, shape: &[u8], list: &[f32]| constant_of(name, 1, shape, &raw(list));
    let trees = [
        constant_of("i", 7, &[2], &[3_u64.to_le_bytes(), 5_u64.to_le_bytes()].concat()),
        node_of("ArrayFeatureExtractor", &["X", "i"], "p", &[]),
        node("TreeEnsembleClassifier", "p", "label", &lists),
    ];
    let sums = [
        list("s", &[1], &[2.0]),
        list("w", &[10, 2], &[0.5; 20]),
        list("b", &[2], &[0.0, 1.0]),
        node_of("Div", &["X", "s"], "a", &[]),
        node_of("Gemm", &["a", "w", "b"], "y", &[number_of("transA", 0)]),
        node("ArgMax", "y", "label", &[number_of("axis", 1)]),
    ];
    [model_of(&trees, &[1 << 3, 10]), model_of(&sums, &[1 << 3, 10])]
}

#[test]
fn what_is_damaged_is_an_error_and_no_panic() {
    for whole in [vec![whole()], others().to_vec()].concat() {
        read(&whole, None).unwrap();
        for at in 0..whole.len() {
            read(&whole[..at], None).unwrap_err();
            for byte in [0, 1, 2, 7, 0x0A, 0x7F, 0x80, 0xFF, whole[at] ^ 1, whole[at] ^ 0x10] {
                let mut damaged = whole.clone();
                damaged[at] = byte;
                if let Ok((model, _)) = read(&damaged, None) {
                    // Some are other models, or cannot be written; neither may panic.
                    let _ = write(&model, "", Options::default());
                }
            }
        }
    }
}

#[test]
fn what_is_not_understood_is_named() {
    let classifier = || node("TreeEnsembleClassifier", "X", "label", &forest("BRANCH_EQ", 0.0));
    let named = |output: &str| node("TreeEnsembleClassifier", "X", output, &forest("BRANCH_LEQ", 0.0));
    let cast = |to: u8| number_of("to", to);
    for (nodes, says) in [
        (vec![classifier()], "tree 0, node 0: mode BRANCH_EQ"),
        (vec![node("Relu", "X", "label", &[])], "nodes Relu, expected one classifier"),
        (vec![node("Gemm", "X", "label", &[])], "node Gemm: it has fewer than two inputs"),
        (
            vec![node("Relu", "X", "y", &[]), node("TreeEnsembleClassifier", "y", "label", &forest("BRANCH_LEQ", 0.0))],
            "its input is a weighted sum, expected trees of single features",
        ),
        (vec![named("y"), node("Gemm", "y", "label", &[])], "node Gemm after"),
        (vec![node("Identity", "y", "y", &[]), node("LinearClassifier", "y", "label", &[])], "in a circle"),
        // Inputs lose a part on the way.
        (vec![node("Cast", "X", "y", &[cast(7)]), node("LinearClassifier", "y", "label", &[])], "Cast to 7 before"),
        (vec![named("y"), node("Cast", "y", "label", &[cast(9)])], "Cast to bool"),
        (vec![node("TreeEnsemble", "X", "label", &five([1.0, 2.0], [0, 1]))], "expected ArgMax after it"),
        (vec![node("TreeEnsemble", "X", "y", &five([1.0, 2.0], [0, 1])), node("Less", "y", "label", &[])], "node Less"),
        (vec![node("TreeEnsemble", "X", "y", &five([1.0, f32::NAN], [0, 1]))], "leaf_weights[1] is NaN"),
        (vec![node("TreeEnsemble", "X", "y", &five([1.0, 1.0], [0, 3]))], "leaf_targetids[1] is 3, expected below 3"),
    ] {
        is_refused(&model(&nodes), says);
    }
}

#[test]
fn scaled_thresholds_are_those_of_every_integer() {
    let (found, _) = read(&whole(), None).unwrap();
    let all = i16::MIN..=i16::MAX;
    for (x, answer) in all.clone().zip(answers_to(&found, all).unwrap()) {
        assert_eq!(answer, u8::from((f32::from(x) / 2048.0 - 0.5) * 2.0 > -1.0), "{x}");
    }
}
