//! As much of ONNX as models need: nodes with their attributes, constants, inputs and
//! outputs.

use super::tensor::Tensor;
use wstac_host::protobuf::{Field, Fields};

/// A model, as far as it is read.
#[derive(Debug, Default)]
pub(super) struct Model<'a> {
    pub(super) producer: String,
    pub(super) nodes: Vec<Node<'a>>,
    pub(super) inputs: Vec<Input>,
    pub(super) outputs: Vec<String>,
    /// Constants with their names.
    pub(super) constants: Vec<(String, Tensor)>,
}

/// What the whole computation takes.
#[derive(Debug, Default)]
pub(super) struct Input {
    pub(super) name: String,
    /// ONNX's number of its type; 0 where none is stated.
    pub(super) kind: u64,
    /// Its last dimension, where it is stated.
    pub(super) width: Option<usize>,
}

/// A step of the computation.
#[derive(Debug, Default)]
pub(super) struct Node<'a> {
    pub(super) inputs: Vec<String>,
    pub(super) outputs: Vec<String>,
    pub(super) kind: String,
    pub(super) attributes: Vec<Attribute<'a>>,
}

/// What a step is told.
#[derive(Debug, Default)]
pub(super) struct Attribute<'a> {
    pub(super) name: String,
    pub(super) integer: Option<i64>,
    pub(super) text: Option<&'a [u8]>,
    pub(super) floats: Vec<f32>,
    pub(super) integers: Vec<i64>,
    pub(super) texts: Vec<&'a [u8]>,
    pub(super) tensor: Option<Tensor>,
}

/// Most nodes of a model: what memory they take is far more than their bytes.
const MOST_NODES: usize = 20_000;

pub(super) fn text(bytes: &[u8]) -> Result<String, String> {
    String::from_utf8(bytes.to_vec()).map_err(|_| "has a name that is not UTF-8".into())
}

/// Reads a model.
pub(super) fn model(bytes: &[u8]) -> Result<Model<'_>, String> {
    let mut model = Model::default();
    let mut version = String::new();
    let mut fields = Fields { rest: bytes };
    let mut graphs = 0;
    while let Some((number, field)) = fields.next()? {
        match (number, field) {
            (2, Field::Bytes(bytes)) => model.producer = text(bytes)?,
            (3, Field::Bytes(bytes)) => version = text(bytes)?,
            (7, Field::Bytes(bytes)) => {
                graphs += 1;
                graph(bytes, &mut model)?;
            }
            _ => {}
        }
    }
    if graphs != 1 {
        return Err(format!("has {graphs} graphs, expected one"));
    }
    if !version.is_empty() {
        model.producer = format!("{} {version}", model.producer);
    }
    Ok(model)
}

fn graph<'a>(bytes: &'a [u8], model: &mut Model<'a>) -> Result<(), String> {
    let mut fields = Fields { rest: bytes };
    while let Some((number, field)) = fields.next()? {
        if let (1, Field::Bytes(bytes)) = (number, field) {
            if model.nodes.len() == MOST_NODES {
                return Err(format!("has more than {MOST_NODES} nodes"));
            }
            model.nodes.push(node(bytes)?);
        } else if let (5 | 11 | 12, Field::Bytes(bytes)) = (number, field) {
            if model.inputs.len().max(model.outputs.len()).max(model.constants.len()) == MOST_NODES {
                return Err(format!("has more than {MOST_NODES} inputs, outputs or constants"));
            }
            match number {
                5 => model.constants.push(Tensor::read(bytes)?),
                11 => model.inputs.push(input(bytes)?),
                _ => model.outputs.push(input(bytes)?.name),
            }
        }
    }
    Ok(())
}

/// An input or output: its name, and of the type of tensors that is in its type the elements' type and the shape.
fn input(bytes: &[u8]) -> Result<Input, String> {
    let mut input = Input::default();
    let mut fields = Fields { rest: bytes };
    while let Some((number, field)) = fields.next()? {
        match (number, field) {
            (1, Field::Bytes(bytes)) => input.name = text(bytes)?,
            (2, Field::Bytes(bytes)) => {
                let Some(tensor) = last(bytes, 1)? else { continue };
                let mut fields = Fields { rest: tensor };
                while let Some((number, field)) = fields.next()? {
                    match (number, field) {
                        (1, Field::Varint(kind)) => input.kind = kind,
                        (2, Field::Bytes(shape)) => input.width = width(shape)?,
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    Ok(input)
}

/// The last dimension of a shape, where it is a number.
fn width(shape: &[u8]) -> Result<Option<usize>, String> {
    let Some(dimension) = last(shape, 1)? else { return Ok(None) };
    let first = Fields { rest: dimension }.next()?;
    Ok(if let Some((1, Field::Varint(length))) = first { usize::try_from(length).ok() } else { None })
}

/// The last field of a number that holds bytes.
fn last(bytes: &[u8], wanted: u64) -> Result<Option<&[u8]>, String> {
    let mut fields = Fields { rest: bytes };
    let mut found = None;
    while let Some((number, field)) = fields.next()? {
        if let Field::Bytes(bytes) = field
            && number == wanted
        {
            found = Some(bytes);
        }
    }
    Ok(found)
}

fn node(bytes: &[u8]) -> Result<Node<'_>, String> {
    let mut node = Node::default();
    let mut fields = Fields { rest: bytes };
    while let Some((number, field)) = fields.next()? {
        match (number, field) {
            (1, Field::Bytes(bytes)) => node.inputs.push(text(bytes)?),
            (2, Field::Bytes(bytes)) => node.outputs.push(text(bytes)?),
            (4, Field::Bytes(bytes)) => node.kind = text(bytes)?,
            (5, Field::Bytes(bytes)) => {
                if node.attributes.len() == 1000 {
                    return Err("has a node of more than 1000 attributes".into());
                }
                node.attributes.push(attribute(bytes)?);
            }
            _ => {}
        }
    }
    Ok(node)
}

fn attribute(bytes: &[u8]) -> Result<Attribute<'_>, String> {
    let mut attribute = Attribute::default();
    let mut fields = Fields { rest: bytes };
    while let Some((number, field)) = fields.next()? {
        match (number, field) {
            (1, Field::Bytes(bytes)) => attribute.name = text(bytes)?,
            (3, Field::Varint(number)) => attribute.integer = Some(number as i64),
            (4, Field::Bytes(bytes)) => attribute.text = Some(bytes),
            (5, Field::Bytes(bytes)) => attribute.tensor = Some(Tensor::read(bytes)?.1),
            // Lists are packed or not, at the writer's choice.
            (7, Field::Fixed32(float)) => attribute.floats.push(f32::from_le_bytes(float)),
            (7, Field::Bytes(bytes)) => {
                let (floats, rest) = bytes.as_chunks::<4>();
                if !rest.is_empty() {
                    return Err("has a list of floats that ends inside one".into());
                }
                attribute.floats.extend(floats.iter().map(|float| f32::from_le_bytes(*float)));
            }
            (8, Field::Varint(number)) => attribute.integers.push(number as i64),
            (8, Field::Bytes(bytes)) => {
                let mut numbers = Fields { rest: bytes };
                while !numbers.rest.is_empty() {
                    attribute.integers.push(numbers.varint()? as i64);
                }
            }
            (9, Field::Bytes(bytes)) => {
                if attribute.texts.len() == crate::model::trained::MOST_NODES {
                    return Err("has a list of too many texts".into());
                }
                attribute.texts.push(bytes);
            }
            _ => {}
        }
    }
    Ok(attribute)
}
