//! Short text in messages. It is borrowed, and never longer than a message has room for.

use core::fmt::{self, Write};

use serde::de::Error as _;
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::model::labels::Label;

/// Text of at most `MOST` bytes of UTF-8.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a, const MOST: usize = 63>(TextContent<'a>);

#[derive(Clone, Copy, Debug)]
enum TextContent<'a> {
    Str(&'a str),
    /// Text of a class's name, which lies in a model file.
    Label(Label<'a>),
}

impl<'a, const MOST: usize> Text<'a, MOST> {
    /// Creates a text, cut after the last whole character of its first `MOST` bytes.
    pub fn new(text: &'a str) -> Self {
        let end = text.floor_char_boundary(MOST);
        Self(TextContent::Str(text.get(..end).unwrap_or_default()))
    }

    /// Returns the bytes of the text, in UTF-8.
    pub fn bytes(&self) -> impl Iterator<Item = u8> + use<'a, MOST> {
        // One of the two is empty.
        let (text, label) = match self.0 {
            TextContent::Str(text) => (text, None),
            TextContent::Label(label) => ("", Some(label)),
        };
        text.bytes().chain(label.into_iter().flat_map(Label::bytes))
    }

    /// Returns the number of bytes.
    pub fn len(&self) -> usize {
        match self.0 {
            TextContent::Str(text) => text.len(),
            TextContent::Label(label) => label.bytes().len(),
        }
    }

    /// Returns whether there are no bytes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Creates the text of a class's name. A name that is too long becomes an empty text.
impl<'a> From<Label<'a>> for Text<'a> {
    fn from(label: Label<'a>) -> Self {
        if label.bytes().len() > 63 { Self::new("") } else { Self(TextContent::Label(label)) }
    }
}

impl<const MOST: usize> PartialEq for Text<'_, MOST> {
    fn eq(&self, other: &Self) -> bool {
        self.bytes().eq(other.bytes())
    }
}

impl<const MOST: usize> fmt::Display for Text<'_, MOST> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            TextContent::Str(text) => f.write_str(text),
            TextContent::Label(label) => label.chars().try_for_each(|character| f.write_char(character)),
        }
    }
}

/// Serializes the text as a sequence of bytes, since a label is no `str` in memory. Postcard writes both alike.
impl<const MOST: usize> Serialize for Text<'_, MOST> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut sequence = serializer.serialize_seq(Some(self.len()))?;
        self.bytes().try_for_each(|byte| sequence.serialize_element(&byte))?;
        sequence.end()
    }
}

impl<'de: 'a, 'a, const MOST: usize> Deserialize<'de> for Text<'a, MOST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <&str>::deserialize(deserializer)?;
        if text.len() > MOST {
            return Err(D::Error::custom("a text is longer than it may be"));
        }
        Ok(Self(TextContent::Str(text)))
    }
}
