//! Reads UBJSON, as XGBoost writes it, into the same structures as JSON; only the requested values are kept.
//!
//! The project has its own reader: no maintained UBJSON library skips unwanted lists and limits its allocations.

use std::fmt;

use serde::de::value::Error;
use serde::de::{self, DeserializeOwned, DeserializeSeed, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

/// Largest nesting depth of arrays and objects.
const DEEPEST: usize = 64;

pub(super) fn from_slice<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Error> {
    let mut reader = UbjsonReader { bytes, at: 0, depth: 0 };
    let marker = reader.marker()?;
    T::deserialize(Value { reader: &mut reader, marker })
}

struct UbjsonReader<'a> {
    bytes: &'a [u8],
    at: usize,
    depth: usize,
}

impl<'a> UbjsonReader<'a> {
    fn error<T>(&self, what: impl fmt::Display) -> Result<T, Error> {
        Err(de::Error::custom(format_args!("byte {}: {what}", self.at)))
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Error> {
        let Some(taken) = self.bytes.get(self.at..).and_then(|rest| rest.get(..count)) else {
            return self.error(format_args!("the file ends, expected {count} bytes more"));
        };
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// Returns the next marker that has a meaning.
    fn marker(&mut self) -> Result<u8, Error> {
        loop {
            let [marker] = self.array()?;
            if marker != b'N' {
                return Ok(marker);
            }
        }
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn integer(&mut self, marker: u8) -> Result<i64, Error> {
        Ok(match marker {
            b'i' => i64::from(i8::from_be_bytes(self.array()?)),
            b'U' => i64::from(u8::from_be_bytes(self.array()?)),
            b'I' => i64::from(i16::from_be_bytes(self.array()?)),
            b'l' => i64::from(i32::from_be_bytes(self.array()?)),
            b'L' => i64::from_be_bytes(self.array()?),
            other => return self.error(format_args!("marker {:?}, expected an integer", char::from(other))),
        })
    }

    fn count(&mut self) -> Result<usize, Error> {
        let marker = self.marker()?;
        let count = self.integer(marker)?;
        usize::try_from(count).or_else(|_| self.error(format_args!("a count of {count}")))
    }

    fn text(&mut self) -> Result<&'a str, Error> {
        let count = self.count()?;
        let text = self.take(count)?;
        std::str::from_utf8(text).or_else(|_| self.error("text that is not UTF-8"))
    }

    /// Reads the start of an array or an object: the type of all elements and their count, if they are given.
    fn start(&mut self) -> Result<(Option<u8>, Option<usize>), Error> {
        let mut kind = None;
        if self.peek() == Some(b'$') {
            self.at += 1;
            let [marker] = self.array()?;
            // Elements without bytes would make long lists of empty values.
            if !matches!(marker, b'i' | b'U' | b'I' | b'l' | b'L' | b'd' | b'D' | b'S' | b'C' | b'H' | b'[' | b'{') {
                return self.error(format_args!("a list of {:?}, expected numbers or text", char::from(marker)));
            }
            kind = Some(marker);
        }
        let mut count = None;
        if self.peek() == Some(b'#') {
            self.at += 1;
            count = Some(self.count()?);
        } else if kind.is_some() {
            return self.error("a list of one type without a count");
        }
        Ok((kind, count))
    }
}

/// A value whose marker has been read.
struct Value<'r, 'a> {
    reader: &'r mut UbjsonReader<'a>,
    marker: u8,
}

impl<'de> de::Deserializer<'de> for Value<'_, 'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let Self { reader, marker } = self;
        match marker {
            b'Z' => visitor.visit_unit(),
            b'T' => visitor.visit_bool(true),
            b'F' => visitor.visit_bool(false),
            b'i' | b'U' | b'I' | b'l' | b'L' => visitor.visit_i64(reader.integer(marker)?),
            b'd' => visitor.visit_f32(f32::from_be_bytes(reader.array()?)),
            b'D' => visitor.visit_f64(f64::from_be_bytes(reader.array()?)),
            b'C' => visitor.visit_char(char::from(reader.array::<1>()?[0])),
            b'S' | b'H' => visitor.visit_borrowed_str(reader.text()?),
            b'[' | b'{' => {
                if reader.depth == DEEPEST {
                    return reader.error(format_args!("more than {DEEPEST} lists inside each other"));
                }
                reader.depth += 1;
                let (kind, left) = reader.start()?;
                let mut items = Items { end: if marker == b'[' { b']' } else { b'}' }, reader, kind, left };
                let value =
                    if marker == b'[' { visitor.visit_seq(&mut items)? } else { visitor.visit_map(&mut items)? };
                if !items.ended()? {
                    return items.reader.error("a list is longer than expected");
                }
                items.reader.depth -= 1;
                Ok(value)
            }
            other => reader.error(format_args!("marker {:?}, expected a value", char::from(other))),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        if self.marker == b'Z' { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// The contents of an array or an object.
struct Items<'r, 'a> {
    reader: &'r mut UbjsonReader<'a>,
    kind: Option<u8>,
    /// Number of remaining items, if it is known; otherwise there is an end marker.
    left: Option<usize>,
    end: u8,
}

impl Items<'_, '_> {
    /// Returns `true` if there are no more items; called once after each item, and again after the last.
    fn ended(&mut self) -> Result<bool, Error> {
        if let Some(left) = self.left {
            return Ok(left == 0);
        }
        while self.reader.peek() == Some(b'N') {
            self.reader.at += 1;
        }
        match self.reader.peek() {
            None => self.reader.error("the file ends inside a list"),
            Some(marker) if marker == self.end => {
                self.reader.at += 1;
                self.left = Some(0);
                Ok(true)
            }
            Some(_) => Ok(false),
        }
    }

    fn marker(&mut self) -> Result<u8, Error> {
        if let Some(left) = &mut self.left {
            *left -= 1;
        }
        self.kind.map_or_else(|| self.reader.marker(), Ok)
    }
}

impl<'a> SeqAccess<'a> for Items<'_, 'a> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'a>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        if self.ended()? {
            return Ok(None);
        }
        let marker = self.marker()?;
        seed.deserialize(Value { reader: self.reader, marker }).map(Some)
    }
}

impl<'a> MapAccess<'a> for Items<'_, 'a> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        if self.ended()? {
            return Ok(None);
        }
        // A key is text without its marker.
        seed.deserialize(Value { reader: self.reader, marker: b'S' }).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'a>>(&mut self, seed: T) -> Result<T::Value, Error> {
        let marker = self.marker()?;
        seed.deserialize(Value { reader: self.reader, marker })
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, Deserialize, PartialEq)]
    struct Sample {
        a: Vec<i32>,
        b: Vec<f32>,
        c: Option<String>,
        d: Vec<Vec<u8>>,
    }

    /// Encodes the same in UBJSON, with typed lists, plain lists and unused members.
    fn bytes() -> Vec<u8> {
        let mut bytes = b"{U\x01a[$l#L\0\0\0\0\0\0\0\x02".to_vec();
        bytes.extend([-1_i32, 70_000].iter().flat_map(|number| number.to_be_bytes()));
        bytes.extend(b"i\x01xZi\x01y[[#U\x02TF{i\x01zNCq}]i\x01b[$d#U\x02");
        bytes.extend([0.1_f32, -3.5].iter().flat_map(|number| number.to_be_bytes()));
        bytes.extend(b"I\0\x01cSU\x03abcL\0\0\0\0\0\0\0\x01d[[$U#U\x02\x01\xFF[i\x07N]]}");
        bytes
    }

    #[test]
    fn the_same_as_in_json() {
        let json = r#"{"a": [-1, 70000], "x": null, "b": [0.1, -3.5], "c": "abc", "d": [[1, 255], [7]]}"#;
        let expected: Sample = serde_json::from_str(json).unwrap();
        assert_eq!(from_slice::<Sample>(&bytes()).unwrap(), expected);
    }

    #[test]
    fn what_is_cut_off_or_damaged_is_an_error_and_no_panic() {
        let whole = bytes();
        for length in 0..whole.len() {
            from_slice::<Sample>(&whole[..length]).unwrap_err();
        }
        for at in 0..whole.len() {
            for byte in 0..=255 {
                let mut damaged = whole.clone();
                damaged[at] = byte;
                // Some bytes are other numbers or letters, and are read without an error.
                let _ = from_slice::<Sample>(&damaged);
            }
        }
    }

    #[test]
    fn depth_and_counts_are_limited() {
        let error = from_slice::<de::IgnoredAny>(&b"[".repeat(100_000)).unwrap_err().to_string();
        assert!(error.contains("inside each other"), "{error}");
        for (bytes, says) in [
            (&b"[#L\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF"[..], "the file ends"),
            (b"[$T#L\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF", "a list of 'T'"),
            (b"[#L\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", "a count of -1"),
            (b"SL\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF", "the file ends"),
            (b"[$d]", "without a count"),
        ] {
            let error = from_slice::<de::IgnoredAny>(bytes).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
