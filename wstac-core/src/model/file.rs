//! The model file: its byte layout, and the checks that all later code relies on.
//!
//! A file is 32-bit little-endian words. It is used where it lies, aligned to four bytes, and never unpacked. Places in
//! it are counted in *halves* of 16 bits: a word holds two, the first one low. Larger numbers are two or four halves,
//! the low one first.
//!
//! | half | content |
//! | --- | --- |
//! | 0–1 | `WSM1`; `WSM2` of a network and of weights of int32, which software before version 0.4 cannot read |
//! | 2–3 | CRC-32 (IEEE) of the bytes from half 4 to the end |
//! | 4–5 | length of the file, in words |
//! | 6 | kind: 1 linear, one-vs-rest; 2 linear, one-vs-one; 3 forest; 4 boosted trees; 5 network |
//! | 7 | type of weights and leaves: 1 int8, 2 int16, 3 float32, 4 int32; 0 in a forest |
//! | 8 | classes, 1 to [`MOST_CLASSES`] |
//! | 9 | low byte, task: 0 unstated, 1 specimen, 2 pattern, 3 depth |
//! |  | high byte: the fastest slide of the training in 4 mm/s; 0 if its speeds are not stated ([`super::speeds`]) |
//! | 10 | frames of the sample that it needs, from the first on: 1 to 70; of a path and of taxels, tens of numbers |
//! | 11 | trees |
//! | 12–13 | half at which the labels start |
//! | 14 | low byte: shift of the trees' lengths and offsets, 0 to 8; from 1 on for trees of taxels |
//! |  | high byte: the slowest slide of the training in 2 mm/s, at most the fastest |
//! | 15 | low byte, input: 0 the sample over time; 1 along the path, of ten sums; 2 along the path, of 25 taxels; |
//! |  | 3 over time, of 25 taxels |
//! |  | high byte: 1 if there is a calibration; else 0 |
//! | 16– | the part of its kind: [`super::linear_svm`], [`super::forest`], [`super::boosted`],
//! |  | [`super::network`] |
//! | … | the calibration, if there is one: [`super::calibration`] |
//! | labels | the class names, then the training facts, then up to three bytes of 0 |
//!
//! For each class there is its name's length in bytes, 0 to 63 (one byte), and the name. The training facts are stored
//! likewise, but with two bytes of length, the low one first. All text is UTF-8.
//!
//! Features are counted frame by frame, ten per frame: feature k of frame t is 10 t + k. (Data sets hold 70 frames of
//! feature 0, then of feature 1 and so on; an importer reorders them.) Numbers along a path have their own order
//! ([`crate::touch::path_sample`]). Of 25 taxels over time, taxel i of frame t is 25 t + i.

use super::speeds::KnownSpeeds;
use crate::crc;
use crate::params::{FEATURES, SAMPLE_FRAMES, TAXELS};

/// The most classes that a model may have.
pub const MOST_CLASSES: usize = 64;
/// The number of numbers in a sample.
pub const INPUTS: usize = FEATURES * SAMPLE_FRAMES;
/// The number of numbers in a sample of 25 taxels over time, the longest one.
pub const TAXEL_INPUTS: usize = TAXELS * SAMPLE_FRAMES;
/// The number of halves of the header, before the part that a kind defines.
pub const HEADER_HALVES: usize = 16;
/// The largest shift of lengths and offsets.
pub const MOST_SHIFT: u16 = 8;
/// The first four bytes.
pub const MAGIC: [u16; 2] = [u16::from_le_bytes(*b"WS"), u16::from_le_bytes(*b"M1")];
/// The first four bytes of a network's file, and of one with weights of int32.
pub const MAGIC_2: [u16; 2] = [MAGIC[0], u16::from_le_bytes(*b"M2")];
/// The newest layout that this version reads: the digit behind `WSM`.
pub const NEWEST_LAYOUT: u8 = 2;

/// The kinds of models, by their numbers.
pub(super) const ONE_AGAINST_REST: u16 = 1;
pub(super) const ONE_AGAINST_ONE: u16 = 2;
pub(super) const FOREST: u16 = 3;
pub(super) const BOOSTED: u16 = 4;
pub(super) const NETWORK: u16 = 5;

/// The reason why bytes are not a valid model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModelError {
    /// The file does not start with `WSM`.
    Magic,
    /// The file has a version of this layout that is not known: this is its fourth byte.
    Version(u8),
    /// The file's length is not what its header says, or the file is cut off.
    Length {
        /// The number of words found.
        found: u32,
        /// The number of words that its header states.
        expected: u32,
    },
    /// Behind the training facts there is more than up to three bytes of 0.
    End,
    /// The checksum is wrong: the file is damaged.
    Checksum {
        /// The checksum of its bytes.
        found: u32,
        /// The checksum that its header states.
        expected: u32,
    },
    /// The file's model is of another kind than expected.
    Kind {
        /// The kind found.
        found: u16,
        /// The expected kind; of the two linear kinds, the first.
        expected: u16,
    },
    /// A number of the header is out of range.
    Header {
        /// The half of the number.
        half: u8,
        /// The number found.
        found: u16,
    },
    /// A part reaches beyond the file's end, or parts do not follow each other, at this half.
    Part(u32),
    /// A tree's node is impossible at this half: a feature out of range, or an invalid child or leaf.
    Node(u32),
    /// Scores could exceed the type that they are summed in.
    Overflow,
    /// The calibration is not valid at this half: a number out of range, or a part that is too long or too short.
    Calibration(u32),
    /// A label or the training facts are not valid text, at this byte.
    Label(u32),
    /// The bytes are not whole words, or not aligned to four, or the machine is not little-endian.
    Alignment,
}

impl ModelError {
    /// Returns what is wrong, in words.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::Magic => "does not start with WSM1 or WSM2, expected a model file, as wstac model import makes",
            Self::Version(_) => "is a model file of another version, expected WSM1 or WSM2: import the model again",
            Self::Length { .. } => "its length is not what its header says: it is cut off or has bytes too many",
            Self::End => "does not end with its training facts, expected at most three bytes of 0 behind them",
            Self::Checksum { .. } => "its checksum is wrong: it is damaged",
            Self::Kind { .. } => "is a model of another kind than expected",
            Self::Header { .. } => "a number of its header is out of range",
            Self::Part(_) => "its parts do not follow each other",
            Self::Node(_) => "a tree has an impossible node",
            Self::Overflow => "its scores could exceed what they are summed in",
            Self::Calibration(_) => "its calibration is not valid",
            Self::Label(_) => "a label is no text",
            Self::Alignment => "its bytes are no whole words aligned to four, or this machine is not little-endian",
        }
    }
}

impl core::fmt::Display for ModelError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.describe())?;
        match *self {
            Self::Version(found) => write!(f, " (byte 3 is {found})"),
            Self::Length { found, expected } => write!(f, " ({found} words, expected {expected})"),
            Self::Checksum { found, expected } => write!(f, " ({found:08X}, expected {expected:08X})"),
            Self::Kind { found, expected } => write!(f, " ({}, expected {})", name(found), name(expected)),
            Self::Header { half, found } => write!(f, " (half {half} is {found}, expected {})", range(half)),
            Self::Part(half) | Self::Node(half) | Self::Calibration(half) => write!(f, " (half {half})"),
            Self::Label(byte) => write!(f, " (byte {byte})"),
            Self::Magic | Self::End | Self::Overflow | Self::Alignment => Ok(()),
        }
    }
}

const fn name(kind: u16) -> &'static str {
    match kind {
        ONE_AGAINST_REST | ONE_AGAINST_ONE => "a linear model",
        FOREST => "a forest",
        BOOSTED => "boosted trees",
        NETWORK => "a network",
        _ => "none",
    }
}

/// Returns the range of a half of the header, in words.
const fn range(half: u8) -> &'static str {
    match half {
        6 => "1 to 4, or 5 of WSM2",
        7 => {
            "what its kind can be of: 1 or 2 of a linear model or a network, or 4 of WSM2, 0 of a forest, \
             2 or 3 of boosted trees"
        }
        8 => "1 to 64",
        9 => "a task of 0 to 3 in its low byte",
        10 => "1 to 70, or to 175 of taxels",
        11 => "as many trees as there are, and none of a linear model or a network",
        12 => "a place within the file",
        14 => "a shift of 0 to 8, of trees of taxels 1 to 8, and a slowest speed of at most the fastest",
        15 => "0 to 3, or 256 to 259 with a calibration",
        _ => "0",
    }
}

impl core::error::Error for ModelError {}

/// The task of a model: what it tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Task {
    /// A task that is not stated.
    Other = 0,
    /// Tells apart specimens: pattern and depth.
    Specimen = 1,
    /// Tells apart patterns.
    Pattern = 2,
    /// Tells apart depths in mm.
    Depth = 3,
}

impl Task {
    /// Returns the task's number in a file.
    pub const fn number(self) -> u16 {
        self as u16
    }

    /// Returns the task's name, as files and messages spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Other => "other",
            Self::Specimen => "specimen",
            Self::Pattern => "pattern",
            Self::Depth => "depth",
        }
    }
}

/// The sample that a model takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Input {
    /// Ten features over 70 frames ([`crate::paper::sample::Sample`]).
    #[default]
    Frames = 0,
    /// Light of ten sums along the path of a touch ([`crate::touch::path_sample::PathSample::of_sums`]).
    Path = 1,
    /// Light of 25 taxels along the path of a touch ([`crate::touch::path_sample::PathSample::of_taxels`]).
    TaxelPath = 2,
    /// Light of 25 taxels over 70 frames ([`TaxelRing::numbers`](crate::touch::taxel_ring::TaxelRing::numbers)).
    Taxels = 3,
}

impl Input {
    /// Returns the input's number in a file.
    pub const fn number(self) -> u16 {
        self as u16
    }

    /// Returns how many numbers a sample has.
    pub const fn numbers(self) -> usize {
        if let Self::Taxels = self { TAXEL_INPUTS } else { INPUTS }
    }

    /// Returns the input's name, as files and messages spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Path => "path",
            Self::TaxelPath => "taxel_path",
            Self::Taxels => "taxels",
        }
    }
}

/// The header of a file. The checks that all kinds have in common have been made.
#[derive(Clone, Copy, Debug)]
pub struct Header {
    /// The version of the layout.
    pub(super) layout: u8,
    pub(super) kind: u16,
    pub(super) number: u16,
    pub(super) classes: u8,
    pub(super) task: Task,
    pub(super) frames: u8,
    pub(super) input: Input,
    pub(super) trees: u16,
    pub(super) shift: u8,
    pub(super) speeds: Option<KnownSpeeds>,
    /// The half at which the part that a kind defines must end.
    pub(super) end: usize,
    /// The half at which the labels start.
    pub(super) labels: usize,
}

impl Header {
    /// Checks everything except the part that a kind defines.
    pub(super) const fn read(words: &[u32]) -> Result<Self, ModelError> {
        let layout = match [half(words, 0), half(words, 1)] {
            MAGIC => 1,
            MAGIC_2 => 2,
            _ => return Err(other_start(words)),
        };
        if words.len() < HEADER_HALVES / 2 {
            return Err(ModelError::Length { found: words.len() as u32, expected: HEADER_HALVES as u32 / 2 });
        }
        if words[2] as usize != words.len() {
            return Err(ModelError::Length { found: words.len() as u32, expected: words[2] });
        }
        let checksum = crc(words);
        if checksum != words[1] {
            return Err(ModelError::Checksum { found: checksum, expected: words[1] });
        }
        // The checksum does not reach the version: each file has the first one that can hold it.
        if (layout > 1) != (half(words, 6) == NETWORK || half(words, 7) == super::rows::INT32) {
            return Err(other_start(words));
        }
        let classes = half(words, 8);
        if classes == 0 || classes as usize > MOST_CLASSES {
            return Err(ModelError::Header { half: 8, found: half(words, 8) });
        }
        let task = match half(words, 9) & 0xFF {
            0 => Task::Other,
            1 => Task::Specimen,
            2 => Task::Pattern,
            3 => Task::Depth,
            _ => return Err(ModelError::Header { half: 9, found: half(words, 9) }),
        };
        let labels = long(words, 12) as usize;
        if labels < HEADER_HALVES || labels > 2 * words.len() {
            return Err(ModelError::Header { half: 12, found: half(words, 12) });
        }
        let (slowest, fastest) = (half(words, 14) >> 8, half(words, 9) >> 8);
        if half(words, 14) & 0xFF > MOST_SHIFT || slowest > 2 * fastest {
            return Err(ModelError::Header { half: 14, found: half(words, 14) });
        }
        let input = match half(words, 15) & 0xFF {
            0 => Input::Frames,
            1 => Input::Path,
            2 => Input::TaxelPath,
            3 => Input::Taxels,
            _ => return Err(ModelError::Header { half: 15, found: half(words, 15) }),
        };
        let frames = half(words, 10);
        if frames == 0 || frames as usize > input.numbers() / FEATURES {
            return Err(ModelError::Header { half: 10, found: half(words, 10) });
        }
        let end = match half(words, 15) >> 8 {
            0 => labels,
            1 => attempt!(super::calibration::start(words, labels)),
            _ => return Err(ModelError::Header { half: 15, found: half(words, 15) }),
        };
        attempt!(super::labels::check(words, labels, classes as u8));
        Ok(Self {
            layout,
            kind: half(words, 6),
            number: half(words, 7),
            classes: classes as u8,
            task,
            frames: frames as u8,
            input,
            trees: half(words, 11),
            shift: half(words, 14) as u8,
            speeds: KnownSpeeds::of_file(slowest as u8, fastest as u8),
            end,
            labels,
        })
    }

    /// Returns how many numbers of the sample the model may use.
    pub(super) const fn inputs(&self) -> usize {
        self.frames as usize * FEATURES
    }
}

/// Returns the error of a file that does not start with the four bytes of this layout.
const fn other_start(words: &[u32]) -> ModelError {
    let [name @ .., version] = long(words, 0).to_le_bytes();
    if let b"WSM" = &name { ModelError::Version(version) } else { ModelError::Magic }
}

/// Returns the first 700 numbers of a sample.
#[inline(always)]
pub(super) const fn start<const N: usize>(sample: &[i16; N]) -> &[i16; INPUTS] {
    const { assert!(N >= INPUTS, "a sample has 700 numbers or more") };
    match sample.first_chunk() {
        Some(start) => start,
        None => &[0; INPUTS],
    }
}

/// Returns 16 bits; 0 beyond the end. The checks make sure that later code never reads there, but the compiler cannot
/// know that otherwise.
pub(super) const fn half(words: &[u32], at: usize) -> u16 {
    if at / 2 < words.len() { (words[at / 2] >> (16 * (at % 2))) as u16 } else { 0 }
}

/// Returns the 32 bits of two halves.
pub(super) const fn long(words: &[u32], at: usize) -> u32 {
    half(words, at) as u32 | (half(words, at + 1) as u32) << 16
}

/// Returns the words from one place to another; no words if the places are not in order.
pub(super) const fn part(words: &[u32], from: usize, to: usize) -> &[u32] {
    match words.split_at_checked(to) {
        Some((before, _)) => match before.split_at_checked(from) {
            Some((_, part)) => part,
            None => &[],
        },
        None => &[],
    }
}

/// The remainders of CRC-32 for every byte.
const CRC_TABLE: [u32; 256] = crc::remainders(8);

/// Returns the CRC-32 (IEEE) of a file's bytes behind its own checksum.
pub const fn crc(words: &[u32]) -> u32 {
    let mut rest = u32::MAX;
    let mut at = 2;
    while at < words.len() {
        // Each step takes in one byte of the word. The rest of the word is shifted down with the remainder.
        rest ^= words[at];
        rest = rest >> 8 ^ CRC_TABLE[(rest & 0xFF) as usize];
        rest = rest >> 8 ^ CRC_TABLE[(rest & 0xFF) as usize];
        rest = rest >> 8 ^ CRC_TABLE[(rest & 0xFF) as usize];
        rest = rest >> 8 ^ CRC_TABLE[(rest & 0xFF) as usize];
        at += 1;
    }
    !rest
}
