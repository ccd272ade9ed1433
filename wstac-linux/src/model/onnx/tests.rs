use super::*;
use crate::model::write::{Options, write};

/// A field of bytes.
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
    // One number alone, the others packed.
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
    let shape = field(2, &[field(1, &[]), field(1, &[1 << 3, 0xBC, 5])].concat());
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

fn whole() -> Vec<u8> {
    model(&[
        node("Scaler", "X", "scaled", &[floats_of("offset", &[0.5]), floats_of("scale", &[2.0])]),
        node("TreeEnsembleClassifier", "scaled", "raw", &forest("BRANCH_LEQ", -1.0)),
        node("Identity", "raw", "label", &[]),
    ])
}

#[test]
fn a_forest_is_read_with_its_labels() {
    let bytes = model(&[node("TreeEnsembleClassifier", "X", "label", &forest("BRANCH_LT", -1.0))]);
    let (found, trainer) = read(&bytes, None).unwrap();
    assert_eq!((found.labels.join(","), found.inputs, trainer.as_str()), ("Saw,Tri".into(), 700, "ONNX of test 1"));
    let words = write(&found, "", Options::default()).unwrap().words;
    let read = wstac_core::model::Model::from_words(&words).unwrap();
    // Feature 1 of frame 1.
    for (x, class) in [(-2049, 0), (-2048, 1), (0, 1)] {
        let mut sample = [0; 700];
        sample[11] = x;
        assert_eq!(read.classify(&sample), class, "{x}");
    }
}

#[test]
fn what_is_damaged_is_an_error_and_no_panic() {
    let whole = whole();
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

#[test]
fn what_is_not_understood_is_named() {
    let classifier = || node("TreeEnsembleClassifier", "X", "label", &forest("BRANCH_EQ", 0.0));
    for (nodes, says) in [
        (vec![classifier()], "tree 0, node 0: mode BRANCH_EQ"),
        (vec![node("Gemm", "X", "label", &[])], "nodes Gemm, expected one classifier"),
        (vec![node("Gemm", "X", "y", &[]), node("LinearClassifier", "y", "label", &[])], "node Gemm before"),
        (vec![node("LinearClassifier", "X", "y", &[]), node("Gemm", "y", "label", &[])], "node Gemm after"),
        (vec![node("Cast", "y", "y", &[]), node("LinearClassifier", "y", "label", &[])], "in a circle"),
    ] {
        let error = read(&model(&nodes), None).unwrap_err();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn scaled_thresholds_are_those_of_every_integer() {
    let bytes = whole();
    let (found, _) = read(&bytes, None).unwrap();
    let words = write(&found, "", Options::default()).unwrap().words;
    let read = wstac_core::model::Model::from_words(&words).unwrap();
    for x in i16::MIN..=i16::MAX {
        let mut sample = [0; 700];
        sample[11] = x;
        let expected = u8::from((f32::from(x) / 2048.0 - 0.5) * 2.0 > -1.0);
        assert_eq!(read.classify(&sample), expected, "{x}");
    }
}
