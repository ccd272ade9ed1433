//! The parts of ONNX that models need: nodes with their attributes, constants, inputs and outputs.
//!
//! `messages.rs` is written by `ci/generated protobuf --write`.

use prost::Message;

use super::limits;
use super::messages::{AttributeProto, ModelProto, NodeProto, ValueInfoProto};
use super::tensor::Tensor;

/// The parts of a model that are read.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) producer: String,
    pub(super) nodes: Vec<Node>,
    pub(super) inputs: Vec<Input>,
    pub(super) outputs: Vec<String>,
    /// Constants with their names.
    pub(super) constants: Vec<(String, Tensor)>,
}

/// An input of the whole computation.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) name: String,
    /// ONNX's number of its type, or 0 if none is stated.
    pub(super) kind: u64,
    /// Its last dimension, if it is stated.
    pub(super) width: Option<usize>,
}

/// A step of the computation.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) inputs: Vec<String>,
    pub(super) outputs: Vec<String>,
    pub(super) kind: String,
    pub(super) attributes: Vec<Attribute>,
}

/// An attribute of a step.
#[derive(Debug)]
pub(super) struct Attribute {
    pub(super) name: String,
    pub(super) integer: Option<i64>,
    pub(super) text: Option<Vec<u8>>,
    pub(super) floats: Vec<f32>,
    pub(super) integers: Vec<i64>,
    pub(super) texts: Vec<Vec<u8>>,
    pub(super) tensor: Option<Tensor>,
}

/// Reads a model.
pub(super) fn model(bytes: &[u8]) -> Result<Model, String> {
    limits::check(bytes)?;
    let model = ModelProto::decode(bytes).map_err(|error| format!("cannot be decoded: {error}"))?;
    let producer = match (model.producer_name(), model.producer_version()) {
        (name, "") => name.to_owned(),
        (name, version) => format!("{name} {version}"),
    };
    let graph = model.graph.ok_or("has no graph, expected one")?;
    let constant = |constant| Tensor::new(constant);
    Ok(Model {
        producer,
        nodes: graph.node.into_iter().map(node).collect::<Result<_, _>>()?,
        inputs: graph.input.into_iter().map(input).collect(),
        outputs: graph.output.into_iter().map(|output| output.name.unwrap_or_default()).collect(),
        constants: graph.initializer.into_iter().map(constant).collect::<Result<_, _>>()?,
    })
}

fn input(input: ValueInfoProto) -> Input {
    let tensor = input.r#type.and_then(|kind| kind.tensor_type);
    let dimension = tensor.as_ref().and_then(|tensor| tensor.shape.as_ref()?.dim.last()?.dim_value);
    Input {
        name: input.name.unwrap_or_default(),
        kind: tensor.map_or(0, |tensor| tensor.elem_type() as u64),
        width: dimension.and_then(|length| usize::try_from(length).ok()),
    }
}

fn node(node: NodeProto) -> Result<Node, String> {
    Ok(Node {
        kind: node.op_type.unwrap_or_default(),
        inputs: node.input,
        outputs: node.output,
        attributes: node.attribute.into_iter().map(attribute).collect::<Result<_, _>>()?,
    })
}

fn attribute(attribute: AttributeProto) -> Result<Attribute, String> {
    Ok(Attribute {
        name: attribute.name.unwrap_or_default(),
        integer: attribute.i,
        text: attribute.s,
        floats: attribute.floats,
        integers: attribute.ints,
        texts: attribute.strings,
        tensor: attribute.t.map(|tensor| Tensor::new(tensor).map(|(_, tensor)| tensor)).transpose()?,
    })
}
