//! Tensors in ONNX: numbers and texts of a constant, flat; shapes do not matter to models.

use wstac_host::protobuf::{Field, Fields};

/// What a constant holds; of the three lists, the one of its type.
#[derive(Clone, Debug, Default)]
pub(super) struct Tensor {
    /// ONNX's number of its type: 1 is float, 2 uint8, 7 int64, 8 string, 11 double.
    pub(super) kind: u64,
    /// Floats and doubles; a float is exact.
    pub(super) floats: Vec<f64>,
    pub(super) integers: Vec<i64>,
    pub(super) texts: Vec<Vec<u8>>,
}

/// Most texts of a constant: their memory is far more than their bytes.
const MOST_TEXTS: usize = 65_536;

pub(super) const FLOAT: u64 = 1;
const UINT8: u64 = 2;
const INT8: u64 = 3;
const INT32: u64 = 6;
pub(super) const INT64: u64 = 7;
pub(super) const STRING: u64 = 8;
pub(super) const DOUBLE: u64 = 11;

impl Tensor {
    /// A tensor and its name.
    pub(super) fn read(bytes: &[u8]) -> Result<(String, Self), String> {
        let mut tensor = Self::default();
        let (mut name, mut raw) = (String::new(), &[][..]);
        let mut fields = Fields { rest: bytes };
        while let Some((number, field)) = fields.next()? {
            match (number, field) {
                (2, Field::Varint(kind)) => tensor.kind = kind,
                (4, Field::Fixed32(float)) => tensor.floats.push(f64::from(f32::from_le_bytes(float))),
                (4, Field::Bytes(bytes)) => tensor.floats.extend(singles(bytes)?),
                // Of these two, each type uses one.
                (5 | 7, Field::Varint(number)) => tensor.integers.push(number as i64),
                (5 | 7, Field::Bytes(bytes)) => {
                    let mut numbers = Fields { rest: bytes };
                    while !numbers.rest.is_empty() {
                        tensor.integers.push(numbers.varint()? as i64);
                    }
                }
                (6, Field::Bytes(bytes)) => {
                    if tensor.texts.len() == MOST_TEXTS {
                        return Err(format!("has a constant of more than {MOST_TEXTS} texts"));
                    }
                    tensor.texts.push(bytes.to_vec());
                }
                (8, Field::Bytes(bytes)) => name = super::proto::text(bytes)?,
                (9, Field::Bytes(bytes)) => raw = bytes,
                (10, Field::Fixed64(double)) => tensor.floats.push(f64::from_le_bytes(double)),
                (10, Field::Bytes(bytes)) => tensor.floats.extend(doubles(bytes)?),
                (13, _) => return Err("has numbers in a file of their own, expected them inside".into()),
                _ => {}
            }
        }
        match tensor.kind {
            FLOAT => tensor.floats.extend(singles(raw)?),
            DOUBLE => tensor.floats.extend(doubles(raw)?),
            UINT8 => tensor.integers.extend(raw.iter().map(|&byte| i64::from(byte))),
            INT8 => tensor.integers.extend(raw.iter().map(|&byte| i64::from(byte as i8))),
            INT32 => tensor.integers.extend(whole::<4>(raw)?.iter().map(|bytes| i64::from(i32::from_le_bytes(*bytes)))),
            INT64 => tensor.integers.extend(whole::<8>(raw)?.iter().map(|bytes| i64::from_le_bytes(*bytes))),
            STRING => {}
            // Constants of other types are none that a model needs.
            _ => return Ok((name, Self { kind: tensor.kind, ..Self::default() })),
        }
        Ok((name, tensor))
    }
}

/// Numbers of `N` bytes each.
fn whole<const N: usize>(bytes: &[u8]) -> Result<&[[u8; N]], String> {
    let (whole, rest) = bytes.as_chunks();
    if rest.is_empty() { Ok(whole) } else { Err("has a list of numbers that ends inside one".into()) }
}

/// A packed list of float32.
fn singles(bytes: &[u8]) -> Result<impl Iterator<Item = f64>, String> {
    Ok(whole(bytes)?.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))))
}

/// A packed list of float64.
fn doubles(bytes: &[u8]) -> Result<impl Iterator<Item = f64>, String> {
    Ok(whole(bytes)?.iter().map(|bytes| f64::from_le_bytes(*bytes)))
}
