//! Tensors in ONNX: numbers and texts of a constant, flat.

use super::messages::TensorProto;

/// The values of a constant: of the three lists, the one of its type is used.
#[derive(Clone, Debug, Default)]
pub(super) struct Tensor {
    /// ONNX's number of its type: 1 is float, 2 uint8, 7 int64, 8 string, 11 double.
    pub(super) kind: u64,
    /// Floats and doubles; a float is exact.
    pub(super) floats: Vec<f64>,
    pub(super) integers: Vec<i64>,
    pub(super) texts: Vec<Vec<u8>>,
    pub(super) shape: Vec<usize>,
}

pub(super) const FLOAT: u64 = 1;
const UINT8: u64 = 2;
const INT8: u64 = 3;
pub(super) const INT32: u64 = 6;
pub(super) const INT64: u64 = 7;
pub(super) const STRING: u64 = 8;
pub(super) const DOUBLE: u64 = 11;

impl Tensor {
    pub(super) fn of(message: &TensorProto) -> Result<Self, String> {
        if !message.external_data.is_empty() {
            return Err("has numbers in a file of their own, expected them inside".into());
        }
        let kind = message.data_type() as u64;
        let raw = message.raw_data();
        // Each type uses one of the lists of floats and one of those of integers.
        let mut tensor = Self {
            kind,
            floats: message.double_data.clone(),
            integers: message.int64_data.clone(),
            texts: message.string_data.clone(),
            shape: message.dims.iter().map(|&length| usize::try_from(length).unwrap_or(0)).collect(),
        };
        tensor.floats.extend(message.float_data.iter().copied().map(f64::from));
        tensor.integers.extend(message.int32_data.iter().copied().map(i64::from));
        match tensor.kind {
            FLOAT => tensor.floats.extend(singles(raw)?),
            DOUBLE => tensor.floats.extend(doubles(raw)?),
            UINT8 => tensor.integers.extend(raw.iter().map(|&byte| i64::from(byte))),
            INT8 => tensor.integers.extend(raw.iter().map(|&byte| i64::from(byte as i8))),
            INT32 => tensor.integers.extend(whole::<4>(raw)?.iter().map(|bytes| i64::from(i32::from_le_bytes(*bytes)))),
            INT64 => tensor.integers.extend(whole::<8>(raw)?.iter().map(|bytes| i64::from_le_bytes(*bytes))),
            STRING => {}
            // Models need no constants of other types.
            _ => return Ok(Self { kind: tensor.kind, ..Self::default() }),
        }
        Ok(tensor)
    }
}

/// Splits bytes into numbers of `N` bytes each.
fn whole<const N: usize>(bytes: &[u8]) -> Result<&[[u8; N]], String> {
    let (whole, rest) = bytes.as_chunks();
    if rest.is_empty() { Ok(whole) } else { Err("has a list of numbers that ends inside one".into()) }
}

/// Iterates over a packed list of float32.
fn singles(bytes: &[u8]) -> Result<impl Iterator<Item = f64>, String> {
    Ok(whole(bytes)?.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))))
}

/// Iterates over a packed list of float64.
fn doubles(bytes: &[u8]) -> Result<impl Iterator<Item = f64>, String> {
    Ok(whole(bytes)?.iter().map(|bytes| f64::from_le_bytes(*bytes)))
}
