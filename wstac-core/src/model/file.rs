//! The model file: its byte layout, and the checks that everything after them relies on.
//!
//! A file is 16-bit little-endian words; larger numbers are two or four words, the low one first. All of it can be used
//! where it lies: nothing is unpacked, and every part is aligned to its own size up to four bytes.
//!
//! | word | what |
//! | --- | --- |
//! | 0–1 | `WSM1` |
//! | 2–3 | CRC-32 (IEEE) of the bytes from word 4 to the end |
//! | 4–5 | length of the file, in words: even |
//! | 6 | kind: 1 linear, one against the rest; 2 linear, one against one; 3 forest; 4 boosted trees |
//! | 7 | what weights and leaves are: 1 int8, 2 int16, 3 float32; 0 in a forest |
//! | 8 | classes, 1 to [`MOST_CLASSES`] |
//! | 9 | task: 0 unstated, 1 specimen, 2 pattern, 3 depth |
//! | 10 | frames of the sample that it needs, from the first on: 1 to 70 |
//! | 11 | trees |
//! | 12–13 | word at which the labels start |
//! | 14 | shift of the trees' offsets, 0 to 8 |
//! | 15 | 0 |
//! | 16– | what its kind says: [`super::linear`], [`super::forest`], [`super::boosted`] |
//! | labels | for each class: UTF-16 units, their count before them; then the training facts, likewise but with two words of count; then 0 to 1 word of padding |
//!
//! Features are counted frame by frame, ten a frame: feature k of frame t is 10 t + k. (Data sets hold 70 frames of
//! feature 0, then of feature 1 and so on: an importer reorders.)

use crate::params::{FEATURES, SAMPLE_FRAMES};

/// Most classes that a model may have.
pub const MOST_CLASSES: usize = 64;
/// Numbers in a sample.
pub const INPUTS: usize = FEATURES * SAMPLE_FRAMES;
/// Words before what a kind defines.
pub const HEADER_WORDS: usize = 16;
/// The first four bytes.
pub const MAGIC: [u16; 2] = [u16::from_le_bytes(*b"WS"), u16::from_le_bytes(*b"M1")];

/// What is wrong with a model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ModelError {
    /// It does not start with `WSM1`.
    Magic,
    /// Its length is not what it says, or it is cut off.
    Length,
    /// Its checksum is wrong: it is damaged.
    Checksum,
    /// It is of another kind than what it is read as.
    Kind,
    /// A number of its header is out of range; the word.
    Header(u8),
    /// A part reaches beyond its end, or parts do not follow each other; the word.
    Part(u32),
    /// A tree's node is impossible: a feature out of range, a child that is none, a leaf that is none; the word.
    Node(u32),
    /// Scores could exceed what they are summed in.
    Overflow,
    /// A label or the training facts are no text.
    Label,
    /// Bytes that are not aligned to four, on a machine that is not little-endian, or of an odd count.
    Alignment,
}

impl ModelError {
    /// What is wrong, in words.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::Magic => "does not start with WSM1, expected a model file",
            Self::Length => "its length is not what its header says: it is cut off or has bytes too many",
            Self::Checksum => "its checksum is wrong: it is damaged",
            Self::Kind => "is a model of another kind than expected",
            Self::Header(_) => "a number of its header is out of range",
            Self::Part(_) => "its parts do not follow each other",
            Self::Node(_) => "a tree has an impossible node",
            Self::Overflow => "its scores could exceed what they are summed in",
            Self::Label => "a label is no text",
            Self::Alignment => "its bytes are not aligned to four, or this machine is not little-endian",
        }
    }
}

impl core::fmt::Display for ModelError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.describe())?;
        match self {
            Self::Header(word) => write!(f, " (word {word})"),
            Self::Part(word) | Self::Node(word) => write!(f, " (word {word})"),
            _ => Ok(()),
        }
    }
}

impl core::error::Error for ModelError {}

/// What a model tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Task {
    /// Unstated.
    Other,
    /// Specimens: pattern and depth.
    Specimen,
    /// Patterns.
    Pattern,
    /// Depths in mm.
    Depth,
}

/// The header of a file that has been checked as far as all kinds have it in common.
#[derive(Clone, Copy, Debug)]
pub struct Header {
    pub(super) kind: u16,
    pub(super) number: u16,
    pub(super) classes: u8,
    pub(super) task: Task,
    pub(super) frames: u8,
    pub(super) trees: u16,
    pub(super) shift: u8,
    /// Word at which the labels start: where what a kind defines must end.
    pub(super) labels: usize,
}

impl Header {
    /// Checks everything but what a kind defines.
    pub(super) const fn read(words: &[u16]) -> Result<Self, ModelError> {
        if words.len() < 2 || word(words, 0) != MAGIC[0] || word(words, 1) != MAGIC[1] {
            return Err(ModelError::Magic);
        }
        if words.len() < HEADER_WORDS || long(words, 4) as usize != words.len() || !words.len().is_multiple_of(2) {
            return Err(ModelError::Length);
        }
        if crc(words, 4) != long(words, 2) {
            return Err(ModelError::Checksum);
        }
        let classes = word(words, 8);
        if classes == 0 || classes as usize > MOST_CLASSES {
            return Err(ModelError::Header(8));
        }
        let task = match word(words, 9) {
            0 => Task::Other,
            1 => Task::Specimen,
            2 => Task::Pattern,
            3 => Task::Depth,
            _ => return Err(ModelError::Header(9)),
        };
        let frames = word(words, 10);
        if frames == 0 || frames as usize > SAMPLE_FRAMES {
            return Err(ModelError::Header(10));
        }
        let labels = long(words, 12) as usize;
        if labels < HEADER_WORDS || labels > words.len() {
            return Err(ModelError::Header(12));
        }
        if word(words, 14) > 8 {
            return Err(ModelError::Header(14));
        }
        if word(words, 15) != 0 {
            return Err(ModelError::Header(15));
        }
        if let Err(error) = check_labels(words, labels, classes) {
            return Err(error);
        }
        Ok(Self {
            kind: word(words, 6),
            number: word(words, 7),
            classes: classes as u8,
            task,
            frames: frames as u8,
            trees: word(words, 11),
            shift: word(words, 14) as u8,
            labels,
        })
    }

    /// Numbers of the sample that the model may look at.
    pub(super) const fn inputs(&self) -> usize {
        self.frames as usize * FEATURES
    }
}

/// Checks labels and training facts: text, up to the very end of the file.
const fn check_labels(words: &[u16], start: usize, classes: u16) -> Result<(), ModelError> {
    let mut at = start;
    let mut class = 0;
    while class <= classes {
        // The training facts come last and may be longer.
        let counts = if class < classes { 1 } else { 2 };
        if at + counts > words.len() {
            return Err(ModelError::Label);
        }
        let count = if counts == 1 { word(words, at) as usize } else { long(words, at) as usize };
        at += counts;
        if count > words.len() - at || !is_text(words, at, at + count) {
            return Err(ModelError::Label);
        }
        at += count;
        class += 1;
    }
    if words.len() - at > 1 { Err(ModelError::Length) } else { Ok(()) }
}

/// Whether UTF-16 units have their surrogates in pairs.
const fn is_text(words: &[u16], from: usize, to: usize) -> bool {
    let mut at = from;
    while at < to {
        match word(words, at) {
            0xD800..=0xDBFF => {
                if at + 1 >= to || !matches!(word(words, at + 1), 0xDC00..=0xDFFF) {
                    return false;
                }
                at += 2;
            }
            0xDC00..=0xDFFF => return false,
            _ => at += 1,
        }
    }
    true
}

/// A word; 0 beyond the end. What is checked first never reads there, and nothing else can tell the compiler so.
pub(super) const fn word(words: &[u16], at: usize) -> u16 {
    match words.split_at_checked(at) {
        Some((_, [word, ..])) => *word,
        _ => 0,
    }
}

/// 32 bits at two words.
pub(super) const fn long(words: &[u16], at: usize) -> u32 {
    word(words, at) as u32 | (word(words, at + 1) as u32) << 16
}

/// The words from one place to another; none where these are not in order.
pub(super) const fn part(words: &[u16], from: usize, to: usize) -> &[u16] {
    match words.split_at_checked(to) {
        Some((before, _)) => match before.split_at_checked(from) {
            Some((_, part)) => part,
            None => &[],
        },
        None => &[],
    }
}

/// Remainders of CRC-32 for every byte.
const CRC_TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut rest = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            rest = if rest & 1 == 1 { rest >> 1 ^ 0xEDB8_8320 } else { rest >> 1 };
            bit += 1;
        }
        table[byte] = rest;
        byte += 1;
    }
    table
};

/// CRC-32 (IEEE) of the bytes of the words from `from` on.
pub const fn crc(words: &[u16], from: usize) -> u32 {
    let mut rest = u32::MAX;
    let mut at = from;
    while at < words.len() {
        rest = rest >> 8 ^ CRC_TABLE[((rest ^ word(words, at) as u32) & 0xFF) as usize];
        rest = rest >> 8 ^ CRC_TABLE[((rest ^ (word(words, at) >> 8) as u32) & 0xFF) as usize];
        at += 1;
    }
    !rest
}

/// A class's name, or the training facts: text that lies in the file.
#[derive(Clone, Copy, Debug)]
pub struct Label<'a>(&'a [u16]);

impl<'a> Label<'a> {
    /// Its characters.
    pub fn chars(self) -> impl Iterator<Item = char> + use<'a> {
        char::decode_utf16(self.0.iter().copied()).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER))
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
    words: &'a [u16],
    classes: u8,
}

impl<'a> Labels<'a> {
    pub(super) const fn new(words: &'a [u16], header: &Header) -> Self {
        Self { words: part(words, header.labels, words.len()), classes: header.classes }
    }

    /// How many classes there are.
    pub fn len(&self) -> usize {
        usize::from(self.classes)
    }

    /// Never: a model has a class.
    pub fn is_empty(&self) -> bool {
        self.classes == 0
    }

    /// The name of a class; nothing for a class that there is not.
    pub fn get(&self, class: usize) -> Option<Label<'a>> {
        if class >= self.len() {
            return None;
        }
        let mut words = self.words;
        for _ in 0..class {
            let (count, rest) = words.split_first()?;
            words = rest.get(usize::from(*count)..)?;
        }
        let (count, rest) = words.split_first()?;
        rest.get(..usize::from(*count)).map(Label)
    }

    /// What the trainer wrote about the training.
    pub fn training(&self) -> Option<Label<'a>> {
        let mut words = self.words;
        for _ in 0..self.classes {
            let (count, rest) = words.split_first()?;
            words = rest.get(usize::from(*count)..)?;
        }
        let (&[low, high], rest) = words.split_first_chunk()?;
        rest.get(..(usize::from(low) | usize::from(high) << 16)).map(Label)
    }
}
