//! Textures that a board learns from slides while a host watches.

use core::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The most textures that a board keeps.
pub const MOST_TEXTURES: usize = 10;
/// The longest name of a texture that a board learns, in bytes.
pub const LONGEST_TEXTURE_NAME: usize = 23;

/// The name of a texture that a board learns: 1 to [`LONGEST_TEXTURE_NAME`] bytes of UTF-8.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct TextureName {
    /// Zeros behind the text.
    bytes: [u8; LONGEST_TEXTURE_NAME],
    length: u8,
}

impl TextureName {
    /// Creates a name; `None` for an empty text, or one that is too long.
    pub fn new(text: &str) -> Option<Self> {
        let mut bytes = [0; LONGEST_TEXTURE_NAME];
        bytes.get_mut(..text.len())?.copy_from_slice(text.as_bytes());
        (!text.is_empty()).then_some(Self { bytes, length: text.len() as u8 })
    }

    /// Returns the name.
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..usize::from(self.length)).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }
}

impl fmt::Debug for TextureName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

impl fmt::Display for TextureName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for TextureName {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=str}", self.as_str());
    }
}

impl Serialize for TextureName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for TextureName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <&str>::deserialize(deserializer)?;
        Self::new(text).ok_or_else(|| D::Error::custom("a name of a texture is empty or too long"))
    }
}

/// The state of learning a texture. It is sent when learning begins, after each touch, and when it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Learning {
    /// The name of the texture.
    pub name: TextureName,
    /// The number of slides that were taken.
    pub slides: u8,
    /// The number of slides that are needed.
    pub needed: u8,
    /// The last step.
    pub step: LearningStep,
}

impl Learning {
    /// Creates the state after so many slides of those that are needed.
    pub const fn new(name: TextureName, slides: u8, needed: u8, step: LearningStep) -> Self {
        Self { name, slides, needed, step }
    }
}

/// The last step of learning a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LearningStep {
    /// Learning has begun, and the board waits for slides.
    Begun,
    /// A slide was taken.
    Taken,
    /// A touch was not taken.
    NotTaken(NotTaken),
    /// All slides were taken, and the texture is kept. This is the end.
    Learned,
    /// The texture is not learned. This is the end.
    Failed(NotLearned),
}

impl LearningStep {
    /// Returns whether it is the end.
    pub const fn is_end(&self) -> bool {
        matches!(self, Self::Learned | Self::Failed(_))
    }
}

/// The reason why a touch teaches nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NotTaken {
    /// The touch is no slide.
    NoSlide,
    /// Speed and direction of the slide are not reliable.
    Unreliable,
    /// The sample shows too little of the path: the slide is too short or too slow.
    TooShort,
    /// Frames of the sample were lost.
    LostFrames,
}

impl fmt::Display for NotTaken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoSlide => "the touch is no slide",
            Self::Unreliable => "speed and direction are not reliable",
            Self::TooShort => "too short or too slow for the model",
            Self::LostFrames => "frames were lost",
        })
    }
}

/// The reason why a board does not learn a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NotLearned {
    /// The board has no model, or one that does not tell what is unknown.
    NoModel,
    /// The board keeps as many textures as it can.
    Full,
    /// The memory for textures failed.
    Memory,
    /// A host has asked to stop, or has not asked for the state for [`LEARNING_MS`].
    Stopped,
}

/// The milliseconds after which a board stops learning if no host asks for the state.
pub const LEARNING_MS: u32 = 10_000;

impl fmt::Display for NotLearned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoModel => f.write_str("its texture model cannot learn, expected a calibrated model"),
            Self::Full => write!(f, "it has {MOST_TEXTURES} learned textures, expected fewer: forget one"),
            Self::Memory => f.write_str("the board's memory for textures failed"),
            Self::Stopped => f.write_str("learning was stopped"),
        }
    }
}

/// The textures that a board has learned: the answer to [`Request::Textures`](super::Request::Textures).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LearnedTextures {
    /// The name of each; unused places are `None`.
    pub names: [Option<TextureName>; MOST_TEXTURES],
    /// The texture that is being learned.
    pub learning: Option<Learning>,
}

#[cfg(test)]
pub(super) mod tests {
    use std::string::{String, ToString};

    use super::super::tests::{check_requests, refused};
    use super::super::{Message, Quantity, Request};
    use super::*;

    fn longest() -> TextureName {
        TextureName::new(&"x".repeat(LONGEST_TEXTURE_NAME)).unwrap()
    }

    fn learning(step: LearningStep) -> Learning {
        Learning::new(longest(), 5, 5, step)
    }

    #[test]
    fn names_are_text_of_1_to_23_bytes() {
        for text in ["a", "Käse", "x x", &"é".repeat(11)] {
            let name = TextureName::new(text).unwrap();
            assert_eq!((name.as_str(), name.to_string()), (text, String::from(text)));
        }
        assert_eq!((TextureName::new(""), TextureName::new(&"é".repeat(12))), (None, None));
    }

    #[test]
    fn requests_are_read_as_they_were_written_and_have_the_last_numbers() {
        let name = TextureName::new("carpet").unwrap();
        let numbers = check_requests(&[
            Request::Forget,
            Request::Textures,
            Request::Learn(name),
            Request::Learn(longest()),
            Request::StopLearning,
            Request::ForgetTexture(name),
        ]);
        assert_eq!(numbers, [0, 1, 2, 2, 3, 4].map(|more| numbers[0] + more));
    }

    /// Returns messages about textures, the longest first.
    pub(in super::super) fn messages() -> [Message<'static>; 4] {
        let full = LearnedTextures {
            names: [Some(longest()); MOST_TEXTURES],
            learning: Some(learning(LearningStep::NotTaken(NotTaken::TooShort))),
        };
        [
            Message::Textures(full),
            Message::Textures(LearnedTextures::default()),
            Message::Learning(learning(LearningStep::Begun)),
            Message::Learning(learning(LearningStep::Failed(NotLearned::Memory))),
        ]
    }

    #[test]
    fn more_slides_than_are_needed_are_impossible() {
        assert!(!LearningStep::Begun.is_end() && LearningStep::Learned.is_end());
        for (slides, needed) in [(6, 5), (0, 0)] {
            let state = Learning::new(longest(), slides, needed, LearningStep::Taken);
            let textures = LearnedTextures { learning: Some(state), ..LearnedTextures::default() };
            for message in [Message::Learning(state), Message::Textures(textures)] {
                assert_eq!(refused(&message), Some(Quantity::Slides));
            }
        }
    }
}
