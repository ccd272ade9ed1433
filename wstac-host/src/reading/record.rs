//! What a reading gives: a line of output each.

use serde::Serialize;
use wstac_core::params::FEATURES;
use wstac_core::trigger::InterruptedSample;

use crate::texture::TextureRecord;

/// One line of output: what `--json` prints, and what the text is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Record {
    /// The features of a frame.
    Features {
        /// Number of the feature frame.
        frame: u64,
        /// Natural logarithms, exact multiples of 1/2048.
        f: [f64; FEATURES],
    },
    /// A tactile event.
    Event(Box<EventRecord>),
    /// What a model that needs no more frames says of a sample that is still being captured.
    Texture(EarlyTextureRecord),
    /// A sample that a long gap interrupted.
    Incomplete(IncompleteRecord),
    /// Something happened to the source, which goes on.
    Fault(FaultRecord),
    /// How the stream ended.
    End(EndRecord),
}

impl Record {
    /// The same with frames counted from frame `zero` on.
    #[must_use]
    pub fn counted_from(mut self, zero: u64) -> Self {
        let count = |frame: &mut u64| *frame = frame.saturating_sub(zero);
        match &mut self {
            Self::Features { frame, .. } => count(frame),
            Self::Event(event) => count(&mut event.frame),
            Self::Texture(texture) => count(&mut texture.frame),
            Self::Incomplete(sample) => count(&mut sample.frame),
            Self::Fault(fault) => count(&mut fault.frame),
            Self::End(end) => {
                count(&mut end.frames);
                if let Some(sample) = &mut end.incomplete {
                    count(&mut sample.frame);
                }
            }
        }
        self
    }
}

/// An event and its answers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// Number of the first frame of the sample.
    pub frame: u64,
    /// Frames of the sample.
    pub frames: usize,
    /// Lit frames, last less first; nothing where no frame is lit.
    pub duration_frames: Option<u8>,
    /// Sliding speed.
    pub speed: Option<SpeedRecord>,
    /// What the speed law makes of the part of a cut-off event that was seen: the slide lasted longer, so it was slower.
    /// As good as the law is there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_at_most: Option<SpeedRecord>,
    /// Sliding direction.
    pub direction: DirectionRecord,
    /// Texture: what the models say, where there are any.
    pub texture: Option<TextureRecord>,
    /// Frames of the sample that were filled.
    pub frames_filled: u8,
    /// Baseline quiet, and at most a tenth of the sample filled.
    pub reliable: bool,
    /// Why an answer is missing.
    #[serde(skip_serializing_if = "Why::is_empty")]
    pub why: Why,
    /// The sample: ten features over 70 frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<Vec<Vec<f64>>>,
}

/// A texture before its event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EarlyTextureRecord {
    /// Number of the first frame of the sample: that of the event to come.
    pub frame: u64,
    /// Frames of the sample that were looked at.
    pub frames: u8,
    /// What the model says; the event will say the same.
    pub texture: TextureRecord,
}

/// A sliding speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedRecord {
    /// mm/s: one decimal, or four significant digits where that is finer.
    pub mm_s: f64,
    /// Outside the range that the law was fitted on.
    pub extrapolated: bool,
}

/// A sliding direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DirectionRecord {
    /// 0, 90, 180 or 270, counter-clockwise from +x; nothing where it is unclear.
    pub deg: Option<u16>,
    /// 0 to 1, to four decimals.
    pub confidence: f64,
}

/// Why an answer is missing, by answer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Why {
    /// Why there is no speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<&'static str>,
    /// Why there is no direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
    /// Why there is no texture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texture: Option<&'static str>,
}

impl Why {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A sample that ended before it was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct IncompleteRecord {
    /// Number of its first frame.
    pub frame: u64,
    /// Frames of it that had arrived.
    pub frames: u8,
}

impl From<InterruptedSample> for IncompleteRecord {
    fn from(sample: InterruptedSample) -> Self {
        Self { frame: sample.frame, frames: sample.frames }
    }
}

/// Something that happened to a source, which goes on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FaultRecord {
    /// Number of the feature frame that comes next.
    pub frame: u64,
    /// Its kind in a word.
    pub fault: &'static str,
    /// What happened, for a person.
    pub message: String,
}

/// How a stream ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct EndRecord {
    /// Feature frames on the time line, lost ones included.
    pub frames: u64,
    /// Camera frames that were lost or unusable.
    pub dropped: u64,
    /// Whether the stream was long enough for the baseline.
    pub baseline: Completeness,
    /// The sample that was under way.
    pub incomplete: Option<IncompleteRecord>,
}

/// Whether something was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Completeness {
    /// It was.
    Complete,
    /// It was not.
    Incomplete,
}
