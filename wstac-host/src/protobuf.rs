//! As much of protocol buffers as others' files need: the fields of a message, read and written.

/// A field of a message.
#[derive(Clone, Copy, Debug)]
pub enum Field<'a> {
    Varint(u64),
    Fixed32([u8; 4]),
    Bytes(&'a [u8]),
    Fixed64([u8; 8]),
}

/// The fields of a message.
pub struct Fields<'a> {
    pub rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub fn varint(&mut self) -> Result<u64, String> {
        let mut number = 0;
        for place in 0..10 {
            let (&byte, rest) = self.rest.split_first().ok_or("ends inside a number")?;
            self.rest = rest;
            number |= u64::from(byte & 0x7F) << (7 * place);
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("has a number of more than 64 bits".into())
    }

    fn take(&mut self, count: u64) -> Result<&'a [u8], String> {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let (taken, rest) = self.rest.split_at_checked(count).ok_or("ends inside a field")?;
        self.rest = rest;
        Ok(taken)
    }

    /// The next field's number and what it holds.
    pub fn next(&mut self) -> Result<Option<(u64, Field<'a>)>, String> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let tag = self.varint()?;
        let field = match tag & 7 {
            0 => Field::Varint(self.varint()?),
            1 => Field::Fixed64(self.take(8)?.try_into().map_err(|_| "ends inside a number")?),
            2 => {
                let count = self.varint()?;
                Field::Bytes(self.take(count)?)
            }
            5 => Field::Fixed32(self.take(4)?.try_into().map_err(|_| "ends inside a number")?),
            other => return Err(format!("has a field of wire type {other}, expected 0, 1, 2 or 5")),
        };
        if tag >> 3 == 0 {
            return Err("has a field of number 0".into());
        }
        Ok(Some((tag >> 3, field)))
    }
}

/// A message that is being written, field by field.
#[derive(Clone, Debug, Default)]
pub struct Message(Vec<u8>);

impl Message {
    /// An empty message with room for this many bytes.
    pub fn with_capacity(bytes: usize) -> Self {
        Self(Vec::with_capacity(bytes))
    }

    fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.0.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.0.push(number as u8);
    }

    /// An integer or the number of an enumeration's value. As everywhere in proto3, 0 is left out.
    #[must_use]
    pub fn varint(mut self, field: u32, value: u64) -> Self {
        if value != 0 {
            self.number(u64::from(field) << 3);
            self.number(value);
        }
        self
    }

    /// A `fixed32`.
    #[must_use]
    pub fn fixed32(mut self, field: u32, value: u32) -> Self {
        self.number(u64::from(field) << 3 | 5);
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Bytes, a string or a message.
    #[must_use]
    pub fn bytes(mut self, field: u32, bytes: &[u8]) -> Self {
        self.number(u64::from(field) << 3 | 2);
        self.number(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
        self
    }

    /// A message inside this one.
    #[must_use]
    pub fn message(self, field: u32, message: &Self) -> Self {
        self.bytes(field, &message.0)
    }

    /// Its bytes.
    pub fn finish(self) -> Vec<u8> {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let inner = Message::default().varint(1, 300);
        let bytes = Message::default().varint(1, 0).varint(2, u64::MAX).fixed32(7, 9).message(100, &inner).finish();
        let mut fields = Fields { rest: &bytes };
        assert!(matches!(fields.next(), Ok(Some((2, Field::Varint(u64::MAX))))));
        assert!(matches!(fields.next(), Ok(Some((7, Field::Fixed32([9, 0, 0, 0]))))));
        assert!(matches!(fields.next(), Ok(Some((100, Field::Bytes([8, 0xAC, 2]))))));
        assert!(matches!(fields.next(), Ok(None)));
    }
}
