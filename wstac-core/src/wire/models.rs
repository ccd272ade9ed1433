//! Texture models that a host sends to a board, which keeps one and uses it.

use core::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::model::file::{Input, NEWEST_LAYOUT};

/// The most bytes of a [`ModelPiece`], and the number of all but the last one: a multiple of the words of 32 bytes that
/// flash is written in.
pub const MODEL_PIECE: usize = 160;

/// The size and the checksum of a model's file, which tell it from others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// It is exhaustive: a host makes one of a file.
pub struct ModelId {
    /// The number of bytes.
    pub bytes: u32,
    /// The checksum of the file: [`Model::checksum`](crate::model::Model::checksum).
    pub checksum: u32,
}

/// A piece of a model's file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct ModelPiece {
    at: u32,
    length: u8,
    /// Zeros behind the piece.
    bytes: [u8; MODEL_PIECE],
}

impl ModelPiece {
    /// Creates the piece that begins at this byte of the file; `None` for no bytes, or too many.
    pub fn new(at: u32, piece: &[u8]) -> Option<Self> {
        let mut bytes = [0; MODEL_PIECE];
        bytes.get_mut(..piece.len())?.copy_from_slice(piece);
        (!piece.is_empty()).then_some(Self { at, length: piece.len() as u8, bytes })
    }

    /// Returns the byte of the file at which it begins.
    pub const fn at(&self) -> u32 {
        self.at
    }

    /// Returns its bytes.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or_default()
    }
}

impl fmt::Debug for ModelPiece {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ModelPiece({} bytes at {})", self.length, self.at)
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for ModelPiece {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=u8} bytes at {=u32}", self.length, self.at);
    }
}

impl Serialize for ModelPiece {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.at, self.bytes()).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ModelPiece {
    // It is not inlined, so that its bytes do not lie on the stack of every other request.
    #[inline(never)]
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (at, bytes) = <(u32, &[u8])>::deserialize(deserializer)?;
        Self::new(at, bytes).ok_or_else(|| D::Error::custom("a piece of a model is empty or too long"))
    }
}

/// The kind of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// It is exhaustive, as `Model` is: another kind is another version of the model file.
pub enum ModelKind {
    /// [`LinearSvm`](crate::model::linear_svm::LinearSvm).
    LinearSvm,
    /// [`Forest`](crate::model::forest::Forest).
    Forest,
    /// [`Boosted`](crate::model::boosted::Boosted).
    Boosted,
    /// [`Network`](crate::model::network::Network).
    Network,
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LinearSvm => "a linear model",
            Self::Forest => "a forest",
            Self::Boosted => "boosted trees",
            Self::Network => "a network",
        })
    }
}

/// The models that a board takes. Kind and sample are compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
// It is exhaustive: a board makes one.
pub struct AcceptedModels {
    /// The kind.
    pub kind: ModelKind,
    /// The sample.
    pub input: Input,
    /// The most bytes of a file; 0 if the board has no memory for models.
    pub most: u32,
}

/// The model of a board, and the one that is being sent to it: the answer to every request about models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BoardModel {
    /// The checksum of the model in use; `None` if there is no model.
    pub in_use: Option<u32>,
    /// Whether a host has sent it. If not, it was compiled in.
    pub sent: bool,
    /// The models that the board takes.
    pub accepts: AcceptedModels,
    /// The last step.
    pub step: ModelStep,
    /// The newest layout of model files that it reads; `None` from a board before version 0.4, which reads the first.
    #[serde(deserialize_with = "super::numbers::newest")]
    pub layout: Option<u8>,
}

impl BoardModel {
    /// Creates the state of a board of this version that uses the model with this checksum.
    pub const fn new(in_use: Option<u32>, sent: bool, accepts: AcceptedModels, step: ModelStep) -> Self {
        Self { in_use, sent, accepts, step, layout: Some(NEWEST_LAYOUT) }
    }
}

/// The last change of a board's models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModelStep {
    /// Nothing since the start.
    #[default]
    Rest,
    /// The board waits for a piece.
    Wants {
        /// The model.
        model: ModelId,
        /// The byte of the file at which the piece has to begin.
        at: u32,
    },
    /// The board has checked the model, and keeps it. It starts again and uses it.
    Kept(ModelId),
    /// The board has forgotten the models that were sent. It starts again.
    Forgotten,
    /// The board does not take the model, and goes on with the one that it has.
    Refused(ModelRefusal),
}

/// The reason why a board does not take a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModelRefusal {
    /// The file is empty, or larger than [`AcceptedModels::most`].
    Size {
        /// The number of bytes found.
        found: u32,
        /// The most bytes.
        most: u32,
    },
    /// The bytes are not those of the file, or no model.
    Damaged,
    /// The model is of another kind than this.
    Kind(ModelKind),
    /// The model takes another sample than this.
    Input(Input),
    /// The memory for models failed.
    Memory,
    /// The board has no memory for models.
    NoMemory,
}

impl fmt::Display for ModelRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { found, most } => write!(f, "it has {found} bytes, expected 1 to {most}"),
            Self::Damaged => f.write_str("it arrived damaged, or is no model"),
            Self::Kind(expected) => write!(f, "it is of another kind, expected {expected}"),
            Self::Input(expected) => write!(f, "it takes another sample, expected {}", expected.name()),
            Self::Memory => f.write_str("the board's memory for models failed"),
            Self::NoMemory => f.write_str("the board has no memory for models"),
        }
    }
}

impl core::error::Error for ModelRefusal {}

#[cfg(test)]
pub(super) mod tests {
    use std::string::ToString;

    use super::super::tests::{check_requests, frame_of};
    use super::super::{DecodeError, Decoder, LONGEST, LONGEST_REQUEST, Message, Request, encode};
    use super::*;

    const FILE: ModelId = ModelId { bytes: u32::MAX, checksum: u32::MAX };

    #[test]
    fn requests_are_read_as_they_were_written_and_have_the_last_numbers() {
        let zeros = ModelPiece::new(u32::MAX, &[0; MODEL_PIECE]).unwrap();
        let ones = ModelPiece::new(0, &[1; MODEL_PIECE]).unwrap();
        let requests = [
            Request::ForgetTexture(super::super::TextureName::new("x").unwrap()),
            Request::Model,
            Request::SendModel(FILE),
            Request::ModelPiece(zeros),
            Request::ModelPiece(ones),
            Request::ForgetModel,
        ];
        let numbers = check_requests(&requests);
        assert_eq!(numbers, [0, 1, 2, 3, 3, 4].map(|more| numbers[0] + more));
        let mut decoder = Decoder::<LONGEST_REQUEST>::new();
        // With the longest sequence number, too.
        let bytes = encode(&requests[4], u16::MAX, &mut [0; LONGEST]).to_vec();
        assert!(bytes.iter().any(|&byte| matches!(decoder.push::<Request>(byte), Some(Ok(_)))));
    }

    #[test]
    fn a_piece_has_bytes_and_not_too_many() {
        assert_eq!((ModelPiece::new(3, &[]), ModelPiece::new(3, &[7; MODEL_PIECE + 1])), (None, None));
        let piece = ModelPiece::new(3, &[7, 8]).unwrap();
        assert_eq!((piece.at(), piece.bytes()), (3, &[7, 8][..]));
        assert_eq!(std::format!("{piece:?}"), "ModelPiece(2 bytes at 3)");
        // The same over the link: a frame with a piece that is too long is whole, and no request.
        for length in [0, MODEL_PIECE as u8 + 1] {
            let number = encode(&Request::ModelPiece(piece), 1, &mut [0; LONGEST])[4];
            let mut content = std::vec![super::super::VERSION, 1, number, 3];
            // The length is a varint.
            content.extend(if length < 128 { std::vec![length] } else { std::vec![length, 1] });
            content.extend((0..length).map(|_| 7));
            let mut decoder = Decoder::<LONGEST>::new();
            let found = frame_of(&content).into_iter().find_map(|byte| decoder.push::<Request>(byte).map(Result::err));
            assert_eq!(found, Some(Some(DecodeError::Unknown)), "{length}");
        }
    }

    /// Returns a message with each step, and each kind of refusal.
    pub(in super::super) fn messages() -> [Message<'static>; 8] {
        let accepts = AcceptedModels { kind: ModelKind::Boosted, input: Input::TaxelPath, most: u32::MAX };
        [
            ModelStep::Rest,
            ModelStep::Wants { model: FILE, at: u32::MAX },
            ModelStep::Kept(FILE),
            ModelStep::Forgotten,
            ModelStep::Refused(ModelRefusal::Size { found: u32::MAX, most: u32::MAX }),
            ModelStep::Refused(ModelRefusal::Kind(ModelKind::Forest)),
            ModelStep::Refused(ModelRefusal::Input(Input::Path)),
            ModelStep::Refused(ModelRefusal::NoMemory),
        ]
        .map(|step| Message::Model(BoardModel::new(Some(u32::MAX), true, accepts, step)))
    }

    #[test]
    fn refusals_say_what_is_expected() {
        for (refusal, text) in [
            (ModelRefusal::Size { found: 9, most: 4 }, "it has 9 bytes, expected 1 to 4"),
            (ModelRefusal::Kind(ModelKind::LinearSvm), "it is of another kind, expected a linear model"),
            (ModelRefusal::Kind(ModelKind::Forest), "it is of another kind, expected a forest"),
            (ModelRefusal::Kind(ModelKind::Boosted), "it is of another kind, expected boosted trees"),
            (ModelRefusal::Kind(ModelKind::Network), "it is of another kind, expected a network"),
            (ModelRefusal::Input(Input::Frames), "it takes another sample, expected frames"),
            (ModelRefusal::NoMemory, "the board has no memory for models"),
        ] {
            assert_eq!(refusal.to_string(), text);
        }
    }
}
