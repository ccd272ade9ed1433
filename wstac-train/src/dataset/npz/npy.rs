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

#[cfg(test)]
mod tests {
    use super::Dtype;

    #[test]
    fn headers_are_as_numpy_writes_them_and_end_at_64() {
        let header = super::header(Dtype::Int16, &[3, 10, 70]);
        let text = "{'descr': '<i2', 'fortran_order': False, 'shape': (3, 10, 70), }";
        assert_eq!(header[..10], *b"\x93NUMPY\x01\x00\x76\x00");
        assert_eq!(header[10..], *format!("{text:117}\n").as_bytes());
        for (shape, said) in [(&[][..], "()"), (&[5], "(5,)"), (&[12_345, 10], "(12345, 10)")] {
            for dtype in [Dtype::Int64, Dtype::Uint64, Dtype::Float64, Dtype::Unicode(123_456)] {
                let header = super::header(dtype, shape);
                assert!(header.len().is_multiple_of(64) && header.ends_with(b"\n"));
                assert_eq!(u16::from_le_bytes([header[8], header[9]]) as usize, header.len() - 10);
                assert!(String::from_utf8_lossy(&header[10..]).contains(&format!("'shape': {said}, ")));
            }
        }
    }
}
