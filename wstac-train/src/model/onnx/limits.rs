//! Rejects ONNX files with more parts than a model has, before they are decoded.
//!
//! An empty part takes two bytes of a file, and up to a hundred times that in memory.

use crate::model::trained::MOST_NODES as MOST_TEXTS;

/// The largest number of parts of one kind in a message.
struct Limit {
    /// The field that holds a part.
    field: usize,
    name: &'static str,
    most: usize,
    /// Limits within a part.
    within: &'static [Self],
}

impl Limit {
    const fn new(field: usize, name: &'static str, most: usize, within: &'static [Self]) -> Self {
        Self { field, name, most, within }
    }
}

/// Largest number of steps, constants, inputs or outputs in a model.
const MOST_NODES: usize = 20_000;
const MOST_NAMES: usize = 65_536;
const TENSOR: &[Limit] =
    &[Limit::new(6, "texts of a constant", MOST_NAMES, &[]), Limit::new(13, "places of a constant", 16, &[])];
const ATTRIBUTE: &[Limit] =
    &[Limit::new(5, "tensors of an attribute", 1, TENSOR), Limit::new(9, "texts of an attribute", MOST_TEXTS, &[])];
const NODE: &[Limit] = &[
    Limit::new(1, "inputs of a node", MOST_NAMES, &[]),
    Limit::new(2, "outputs of a node", MOST_NAMES, &[]),
    Limit::new(5, "attributes of a node", 1000, ATTRIBUTE),
];
const SHAPE: &[Limit] = &[Limit::new(1, "dimensions of a shape", 64, &[])];
const TENSOR_TYPE: &[Limit] = &[Limit::new(2, "shapes of a type", 1, SHAPE)];
const TYPE: &[Limit] = &[Limit::new(1, "tensors of a type", 1, TENSOR_TYPE)];
const VALUE: &[Limit] = &[Limit::new(2, "types of a value", 1, TYPE)];
const GRAPH: &[Limit] = &[
    Limit::new(1, "nodes", MOST_NODES, NODE),
    Limit::new(5, "constants", MOST_NODES, TENSOR),
    Limit::new(11, "inputs", MOST_NODES, VALUE),
    Limit::new(12, "outputs", MOST_NODES, VALUE),
];
const MODEL: &[Limit] = &[Limit::new(7, "graph", 1, GRAPH)];

/// Largest number of parts that have parts themselves, in a whole model; `MOST_TEXTS` limits texts and names.
const MOST_PARTS: usize = 100_000;

/// Rejects a model with more parts than these.
pub(super) fn check(model: &[u8]) -> Result<(), String> {
    check_message(model, MODEL, &mut [MOST_PARTS, MOST_TEXTS])
}

/// Checks one message; `left` holds the remaining permitted numbers of parts with parts, and of parts without.
fn check_message(mut rest: &[u8], limits: &[Limit], left: &mut [usize; 2]) -> Result<(), String> {
    let mut counts = [0; 4];
    while !rest.is_empty() {
        let tag = number(&mut rest)?;
        let length = match tag & 7 {
            0 => rest.iter().position(|&byte| byte < 0x80).ok_or("ends inside a number")? + 1,
            1 => 8,
            2 => number(&mut rest)?,
            5 => 4,
            other => return Err(format!("has a field of wire type {other}, expected 0, 1, 2 or 5")),
        };
        let (part, after) = rest.split_at_checked(length).ok_or("ends inside a field")?;
        rest = after;
        let found = limits.iter().zip(&mut counts).find(|(limit, _)| tag & 7 == 2 && tag >> 3 == limit.field);
        if let Some((limit, count)) = found {
            *count += 1;
            if *count > limit.most {
                return Err(format!("has more than {} {}", limit.most, limit.name));
            }
            let (kind, most, name) = if limit.within.is_empty() {
                (1, MOST_TEXTS, "names and texts")
            } else {
                (0, MOST_PARTS, "nodes, attributes, constants, inputs and outputs")
            };
            left[kind] = left[kind].checked_sub(1).ok_or_else(|| format!("has more than {most} {name}"))?;
            if !limit.within.is_empty() {
                check_message(part, limit.within, left)?;
            }
        }
    }
    Ok(())
}

fn number(rest: &mut &[u8]) -> Result<usize, String> {
    prost::decode_length_delimiter(rest).map_err(|_| "ends inside a number".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodes a field of bytes.
    fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
        let mut field = vec![number << 3 | 2];
        prost::encode_length_delimiter(bytes.len(), &mut field).unwrap();
        field.extend(bytes);
        field
    }

    #[test]
    fn as_many_parts_as_there_may_be_and_one_more() {
        // Fields on the path from the model down to the repeated part.
        for (way, most, name) in [
            (&[7][..], 1, "graph"),
            (&[7, 1], 20_000, "nodes"),
            (&[7, 12], 20_000, "outputs"),
            (&[7, 1, 5], 1000, "attributes of a node"),
            (&[7, 1, 5, 5, 6], 65_536, "texts of a constant"),
            (&[7, 5, 6], 65_536, "texts of a constant"),
            (&[7, 11, 2, 1, 2, 1], 64, "dimensions of a shape"),
        ] {
            let (last, above) = way.split_last().unwrap();
            // Texts are any bytes; these are not a message.
            let part: &[u8] = if matches!(last, 6) { b"\xFF" } else { &[] };
            let model =
                |count| above.iter().rfold(field(*last, part).repeat(count), |part, above| field(*above, &part));
            assert_eq!(check(&model(most)), Ok(()));
            assert_eq!(check(&model(most + 1)), Err(format!("has more than {most} {name}")));
        }
    }

    #[test]
    fn all_parts_together_are_limited_too() {
        // A graph of 200 nodes with 499 attributes each: with the graph, one part more than permitted without the last.
        let node = field(1, &field(5, &[]).repeat(499));
        let graph = |nodes: usize| field(7, &node.repeat(nodes));
        assert_eq!(check(&graph(199)), Ok(()));
        let parts = "nodes, attributes, constants, inputs and outputs";
        assert_eq!(check(&graph(200)), Err(format!("has more than 100000 {parts}")));
        // 256 nodes of 65,536 names.
        let node = field(1, &field(1, &[]).repeat(MOST_NAMES));
        let graph = |nodes: usize| field(7, &node.repeat(nodes));
        assert_eq!(check(&graph(256)), Ok(()));
        assert_eq!(check(&graph(257)), Err(format!("has more than {MOST_TEXTS} names and texts")));
    }

    #[test]
    fn other_fields_are_passed_over() {
        // A number, a fixed one of 8 bytes, one of 4, and bytes that look like two graphs.
        let others = [&[8, 0xFF, 0x7F, 9, 1, 2, 3, 4, 5, 6, 7, 8, 13, 1, 2, 3, 4][..], &field(2, &[0x3A, 0, 0x3A, 0])];
        assert_eq!(check(&others.concat()), Ok(()));
        for cut in [1, 2, 4, 11, 14, 18, 19] {
            assert!(check(&others.concat()[..cut]).is_err(), "{cut}");
        }
        assert_eq!(check(&[11]), Err("has a field of wire type 3, expected 0, 1, 2 or 5".into()));
    }
}
