//! The parts of ONNX that models need.
//!
//! `messages.rs` is written by `ci/generated protobuf --write`.

use prost::Message;

use super::limits;
use super::messages::ModelProto;
pub(super) use super::messages::{AttributeProto as Attribute, GraphProto as Graph, NodeProto as Node, ValueInfoProto};

/// Reads a model's computation, and the name and version of the program that wrote it.
pub(super) fn graph(bytes: &[u8]) -> Result<(Graph, String), String> {
    limits::check(bytes)?;
    let model = ModelProto::decode(bytes).map_err(|error| format!("cannot be decoded: {error}"))?;
    let producer = [model.producer_name(), model.producer_version()].join(" ").trim().to_owned();
    Ok((model.graph.ok_or("has no graph")?, producer))
}

/// Returns ONNX's number of an input's type, or 0 if none is stated, and its last dimension, if it is stated.
pub(super) fn type_of(input: &ValueInfoProto) -> (u64, Option<usize>) {
    let tensor = input.r#type.as_ref().and_then(|kind| kind.tensor_type.as_ref());
    let dimension = tensor.and_then(|tensor| tensor.shape.as_ref()?.dim.last()?.dim_value);
    let kind = tensor.map_or(0, |tensor| tensor.elem_type() as u64);
    (kind, dimension.and_then(|length| usize::try_from(length).ok()))
}
