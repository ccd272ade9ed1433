//! The names of a model's classes and its training facts: text in the file.

use super::file::{Header, ModelError, half};

/// The length of the longest class name, in bytes.
pub const LONGEST_LABEL: usize = 63;

/// Checks that labels and training facts are text, up to the very end of the file.
pub(super) const fn check(words: &[u32], start: usize, classes: u8) -> Result<(), ModelError> {
    let mut at = 2 * start;
    let mut class = 0;
    while class <= classes {
        let text = text(words, at, class == classes);
        if text.end > 4 * words.len() || class < classes && text.end - text.start > LONGEST_LABEL {
            return Err(ModelError::Label(at as u32));
        }
        at = text.start;
        while at < text.end {
            match character(words, at, text.end) {
                Some((_, bytes)) => at += bytes,
                None => return Err(ModelError::Label(at as u32)),
            }
        }
        at = text.end;
        class += 1;
    }
    if 4 * words.len() - at > 3 {
        return Err(ModelError::End);
    }
    while at < 4 * words.len() {
        if byte(words, at) != 0 {
            return Err(ModelError::End);
        }
        at += 1;
    }
    Ok(())
}

/// Returns the text behind the length at byte `at`: one byte of length, or two for a long text.
const fn text(words: &[u32], at: usize, long: bool) -> Label<'_> {
    let low = byte(words, at) as usize;
    let (start, length) = if long { (at + 2, low | (byte(words, at + 1) as usize) << 8) } else { (at + 1, low) };
    Label { words, start, end: start + length }
}

const fn byte(words: &[u32], at: usize) -> u8 {
    (half(words, at / 2) >> (8 * (at % 2))) as u8
}

/// Returns the character that starts at a byte, and its length in UTF-8; `None` if there is no valid one.
const fn character(words: &[u32], at: usize, end: usize) -> Option<(char, usize)> {
    let first = byte(words, at) as u32;
    let (length, mut code, least) = match first {
        0..=0x7F => (1, first, 0),
        0xC0..=0xDF => (2, first & 0x1F, 0x80),
        0xE0..=0xEF => (3, first & 0xF, 0x800),
        0xF0..=0xF7 => (4, first & 7, 0x1_0000),
        _ => return None,
    };
    if length > end - at {
        return None;
    }
    let mut next = 1;
    while next < length {
        let more = byte(words, at + next) as u32;
        if more & 0xC0 != 0x80 {
            return None;
        }
        code = code << 6 | more & 0x3F;
        next += 1;
    }
    match char::from_u32(code) {
        Some(character) if code >= least => Some((character, length)),
        _ => None,
    }
}

/// A class's name, or the training facts: text that lies in the file.
#[derive(Clone, Copy, Debug)]
pub struct Label<'a> {
    words: &'a [u32],
    /// The bytes of the file.
    start: usize,
    end: usize,
}

impl<'a> Label<'a> {
    /// Returns the characters.
    pub fn chars(self) -> impl Iterator<Item = char> + use<'a> {
        let mut at = self.start;
        core::iter::from_fn(move || {
            let (character, bytes) = if at < self.end { character(self.words, at, self.end)? } else { return None };
            at = at.wrapping_add(bytes);
            Some(character)
        })
    }

    /// Returns the bytes, in UTF-8.
    pub fn bytes(self) -> impl ExactSizeIterator<Item = u8> + use<'a> {
        (self.start..self.end).map(move |at| byte(self.words, at))
    }
}

impl core::fmt::Display for Label<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        use core::fmt::Write;
        self.chars().try_for_each(|character| f.write_char(character))
    }
}

impl PartialEq<str> for Label<'_> {
    fn eq(&self, other: &str) -> bool {
        self.chars().eq(other.chars())
    }
}

/// The names of a model's classes.
#[derive(Clone, Copy, Debug)]
pub struct Labels<'a> {
    words: &'a [u32],
    /// The byte of the file at which they start.
    start: usize,
    classes: u8,
}

impl<'a> Labels<'a> {
    pub(super) const fn new(words: &'a [u32], header: &Header) -> Self {
        Self { words, start: 2 * header.labels, classes: header.classes }
    }

    pub(super) const fn checksum(&self) -> u32 {
        super::file::long(self.words, 2)
    }

    /// Returns the number of classes.
    pub fn len(&self) -> usize {
        usize::from(self.classes)
    }

    /// Returns false: a model always has a class.
    pub fn is_empty(&self) -> bool {
        self.classes == 0
    }

    /// Returns the name of a class; `None` if there is no such class.
    pub fn get(&self, class: usize) -> Option<Label<'a>> {
        (class < self.len()).then(|| self.text(class))
    }

    /// Returns the name of a class that the model has just returned, so there is one.
    pub(crate) fn of(&self, class: u8) -> Label<'a> {
        self.text(usize::from(class))
    }

    /// Returns the trainer's text about the training.
    pub fn training(&self) -> Label<'a> {
        self.text(self.len())
    }

    /// Returns the text of this number. The training facts come behind the classes.
    fn text(&self, number: usize) -> Label<'a> {
        let mut at = self.start;
        for _ in 0..number {
            at = text(self.words, at, false).end;
        }
        text(self.words, at, number == self.len())
    }
}
