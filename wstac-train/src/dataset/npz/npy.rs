//! An array's `.npy`: the type of its elements, and the header before them.

/// Types of numbers in an array, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    /// True or false, one byte each.
    Bool,
    /// 16 bits, signed.
    Int16,
    /// 64 bits, signed.
    Int64,
    /// 64 bits, unsigned.
    Uint64,
    /// 64 bits, floating point.
    Float64,
    /// Strings of up to this many code points, of 4 bytes each, padded with zeros.
    Unicode(usize),
}

/// A number that an array can hold.
pub trait Number: Copy {
    /// Its type in an array.
    const DTYPE: Dtype;

    /// Appends its bytes.
    fn append_to(self, bytes: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($number:ty: $dtype:ident),*) => {$(
        impl Number for $number {
            const DTYPE: Dtype = Dtype::$dtype;

            fn append_to(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    )*};
}

numbers!(i16: Int16, i64: Int64, u64: Uint64, f64: Float64);

impl Number for bool {
    const DTYPE: Dtype = Dtype::Bool;

    fn append_to(self, bytes: &mut Vec<u8>) {
        bytes.push(self.into());
    }
}

impl Dtype {
    /// Returns NumPy's name of the type, but for the size, and the size: of an element, or of its code points.
    fn facts(self) -> (&'static str, usize) {
        match self {
            Self::Bool => ("|b", 1),
            Self::Int16 => ("<i", 2),
            Self::Int64 => ("<i", 8),
            Self::Uint64 => ("<u", 8),
            Self::Float64 => ("<f", 8),
            Self::Unicode(points) => ("<U", points),
        }
    }

    /// Returns the number of bytes of an element.
    pub(super) fn bytes(self) -> u64 {
        let (kind, size) = self.facts();
        size as u64 * if kind == "<U" { 4 } else { 1 }
    }
}

/// Returns the header of a `.npy`; the data after it starts at a multiple of 64 bytes.
pub(super) fn header(dtype: Dtype, shape: &[usize]) -> Vec<u8> {
    let shape = match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    };
    let (kind, size) = dtype.facts();
    let text = format!("{{'descr': '{kind}{size}', 'fortran_order': False, 'shape': {shape}, }}");
    // The text ends with a line feed; ten bytes precede it.
    let padded = (10 + text.len() + 1).next_multiple_of(64) - 10;
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((padded as u16).to_le_bytes());
    header.extend(format!("{text:0$}\n", padded - 1).into_bytes());
    header
}
