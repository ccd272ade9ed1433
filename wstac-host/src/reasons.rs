//! Reasons and kinds that recordings keep as words: lost frames, faults of a source, controls that are not locked.

use std::cmp::Ordering;
use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Bytes of the longest words of a recording that are kept. Those of this program have less than half as many.
const LONGEST: usize = 200;

/// Makes an enumeration of words and the ways between both.
macro_rules! words {
    ($(#[$about:meta])* $name:ident: $($(#[$doc:meta])* $variant:ident = $word:literal,)*) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum $name {
            $($(#[$doc])* $variant,)*
            /// A word of a recording that this version does not know.
            Other(Box<str>),
        }

        impl $name {
            #[cfg_attr(not(test), allow(dead_code))]
            const ALL: &[Self] = &[$(Self::$variant),*];

            /// Returns the words for a person, as recordings have them.
            pub fn name(&self) -> &str {
                match self {
                    $(Self::$variant => $word,)*
                    Self::Other(word) => word,
                }
            }
        }

        impl From<&str> for $name {
            /// Recognizes the words of a recording. Words that are too long become `other`.
            fn from(word: &str) -> Self {
                match word {
                    $($word => Self::$variant,)*
                    _ if word.len() > LONGEST => Self::Other("other".into()),
                    _ => Self::Other(word.into()),
                }
            }
        }

        /// The order is alphabetical, as a person looks for words.
        impl Ord for $name {
            fn cmp(&self, other: &Self) -> Ordering {
                self.name().cmp(other.name())
            }
        }

        impl PartialOrd for $name {
            fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
                Some(self.cmp(other))
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

words! {
    /// The reason why frames were lost.
    LossReason:
    /// The driver had no buffer for them.
    Dropped = "dropped by the driver",
    /// The camera took fewer frames than were agreed on.
    NeverTaken = "never taken: the camera was slow",
    /// Newer frames were waiting ([`FramePolicy::Newest`](crate::source::FramePolicy::Newest)).
    Skipped = "skipped for newer ones",
    /// The driver reported an error for the frame.
    Unreadable = "the driver could not read it",
    /// The driver marked the frame as damaged.
    Damaged = "marked as damaged by the driver",
    /// The buffer has fewer bytes than a frame.
    Short = "shorter than a frame",
    /// The frame's JPEG data are corrupt.
    CorruptJpeg = "corrupt JPEG picture",
    /// The frame's JPEG data end too early.
    TruncatedJpeg = "JPEG picture that ends before its last block",
    /// The frame's bytes are no JPEG picture.
    NoJpeg = "no JPEG picture",
    /// The frame's JPEG coding is not decoded.
    UnsupportedJpeg = "JPEG picture of a kind that is not decoded",
    /// The frame has another size than the stream.
    OtherSize = "picture of another size",
    /// A file of a picture cannot be decoded.
    CorruptPicture = "picture that cannot be decoded",
    /// The camera's input had no signal.
    NoSignal = "no signal",
    /// The camera was disconnected.
    Disconnected = "the camera was away",
    /// A simulated driver dropped them.
    SimulatedDrop = "dropped by the simulated driver",
    /// A simulated camera exposed longer than a frame.
    SimulatedExposure = "auto-exposure slows the simulated camera down in the dark",
    /// The times of a video's frames or the numbers of a folder's pictures have a gap.
    Missing = "missing in the file",
    /// The times that a program pushes have a gap.
    MissingByTimes = "missing by the times of the others",
    /// The program that pushes frames reported them.
    Reported = "reported lost",
}

impl LossReason {
    /// Returns whether the frame came as a JPEG picture that was refused.
    pub fn is_of_jpeg(&self) -> bool {
        matches!(self, Self::CorruptJpeg | Self::TruncatedJpeg | Self::NoJpeg | Self::UnsupportedJpeg | Self::OtherSize)
    }
}

/// Lost frames, counted by reason up to 2³² − 1. Those of other versions count together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LossCounts([u32; LossReason::ALL.len() + 1]);

impl LossCounts {
    /// Counts frames that were lost for a reason.
    pub fn add(&mut self, frames: u64, reason: &LossReason) {
        let place = LossReason::ALL.iter().position(|known| known == reason);
        if let Some(count) = self.0.get_mut(place.unwrap_or(LossReason::ALL.len())) {
            *count = u32::try_from(frames).map_or(u32::MAX, |frames| count.saturating_add(frames));
        }
    }

    /// Returns the reasons that frames were lost for, in words, and how many.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, u32)> {
        let words = LossReason::ALL.iter().map(LossReason::name).chain(["other"]);
        words.zip(self.0).filter(|(_, frames)| *frames > 0)
    }

    /// Returns whether no frame was lost.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|frames| *frames == 0)
    }
}

impl Serialize for LossCounts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}

words! {
    /// The kind of a fault of a source.
    FaultKind:
    /// The stream broke off; the same camera is waited for.
    Disconnected = "disconnected",
    /// The camera is back.
    Reconnected = "reconnected",
    /// The camera is there and does not start yet.
    Refused = "refused",
    /// The input has no signal.
    NoSignal = "no-signal",
    /// The input has its signal again.
    Signal = "signal",
    /// The camera takes fewer frames than were agreed on.
    Slow = "slow",
    /// The camera takes the frames that were agreed on again.
    InTime = "in-time",
    /// The rate of the camera is more than 2 % below the one that was agreed on.
    Rate = "rate",
    /// The rate of the camera is more than 2 % above the one that was agreed on: speeds are too low, and not reliable.
    Fast = "fast",
    /// Controls have other values than before the break.
    Controls = "controls",
    /// A calibration reports something.
    Calibration = "calibration",
    /// The decoder of a video or of JPEG pictures reports something.
    Decoder = "decoder",
    /// Pictures are turned or mirrored as their files say.
    Turned = "turned",
    /// The frames of a file come unevenly from here on, or are damaged.
    Uneven = "uneven",
    /// The frames of a file come evenly again, and are whole.
    Even = "even",
    /// Says at the end of a file how many of its frames are missing or came unevenly.
    Spacing = "spacing",
    /// The line to a board says something: it is gone, it is back, events were lost.
    Board = "board",
}

words! {
    /// The reason why a control is not locked.
    UnlockedReason:
    /// The user asked that controls stay as they were.
    Kept = "left as it was",
    /// The user gave a value that leaves it automatic.
    SetAutomatic = "set as asked, which leaves it automatic",
    /// The driver took the value that switches it off, and it is still on.
    StillOn = "was switched off, but is not",
    /// The driver says that it is read-only, and it is on.
    OnReadOnly = "cannot be switched off: read-only",
    /// Another program holds it, and it is on.
    OnGrabbed = "cannot be switched off: another program holds it",
    /// Another control governs it, and it is on.
    OnInactive = "cannot be switched off: inactive: something else governs it",
    /// The driver refuses its value, because it is read-only.
    ReadOnly = "cannot be set: read-only",
    /// The driver refuses its value, because another program holds it.
    Grabbed = "cannot be set: another program holds it",
    /// The driver refuses its value, because another control governs it.
    Governed = "cannot be set: inactive: something else governs it",
    /// The driver says that the camera changes it.
    Volatile = "volatile: the camera changes it",
    /// The driver took its value, and another control governs it.
    Inactive = "inactive: something else governs it",
    /// The camera changed it at the start of the stream, and did not take the value once more.
    ChangedAtStart = "the camera changed it when the stream started",
}

/// A reason is stored as its words, as in recordings.
impl Serialize for UnlockedReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for UnlockedReason {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self::from(String::deserialize(deserializer)?.as_str()))
    }
}

/// A fault of a source that continues after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Its kind.
    pub kind: FaultKind,
    /// The fault in words for people, without the remedy.
    pub message: String,
    /// The action of the source; `None` if it needs no words.
    pub remedy: Option<Remedy>,
}

/// The action of a source after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Remedy {
    /// It waits for the same camera.
    AwaitCamera,
    /// It waits for the signal of its input.
    AwaitSignal,
    /// It starts the camera again and again until that works.
    Retry,
}

impl Remedy {
    const ALL: [Self; 3] = [Self::AwaitCamera, Self::AwaitSignal, Self::Retry];
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AwaitCamera => "waiting for the same camera, Ctrl-C ends",
            Self::AwaitSignal => "waiting for it",
            Self::Retry => "tried again until it starts",
        })
    }
}

impl Fault {
    /// Creates a fault without a remedy.
    pub fn new(kind: FaultKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), remedy: None }
    }

    /// Creates a fault from the text of a recorded one, which [`Display`](fmt::Display) made.
    pub fn from_text(kind: FaultKind, text: &str) -> Self {
        for remedy in Remedy::ALL {
            let message = text.strip_suffix(&remedy.to_string()).and_then(|text| text.strip_suffix("; "));
            if let Some(message) = message {
                return Self { kind, message: message.to_owned(), remedy: Some(remedy) };
            }
        }
        Self::new(kind, text)
    }
}

/// Writes the message, then the remedy. The kind is not part of the text.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        self.remedy.map_or(Ok(()), |remedy| write!(f, "; {remedy}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_survive_a_recording() {
        let remedies = Remedy::ALL.into_iter().map(Some).chain([None]);
        for remedy in remedies {
            let fault = Fault { remedy, ..Fault::new(FaultKind::Disconnected, "no frame; check the cable") };
            assert_eq!(Fault::from_text(FaultKind::Disconnected, &fault.to_string()), fault);
        }
        let fault = Fault { remedy: Some(Remedy::AwaitSignal), ..Fault::new(FaultKind::NoSignal, "no signal") };
        assert_eq!(fault.to_string(), "no signal; waiting for it");
        let other = "no signal; waiting for it, of a newer program";
        assert_eq!(Fault::from_text(FaultKind::NoSignal, other), Fault::new(FaultKind::NoSignal, other));
    }

    #[test]
    fn words_survive_a_recording() {
        for reason in LossReason::ALL {
            assert_eq!(LossReason::from(reason.name()), *reason);
        }
        for kind in FaultKind::ALL {
            assert_eq!(FaultKind::from(kind.name()), *kind);
        }
        for reason in UnlockedReason::ALL {
            let json = serde_json::to_string(reason).unwrap();
            assert_eq!(json, format!("\"{reason}\""));
            assert_eq!(serde_json::from_str::<UnlockedReason>(&json).unwrap(), *reason);
        }
        let other = UnlockedReason::Other("set to 3, but reads back 4".into());
        assert_eq!(serde_json::from_str::<UnlockedReason>("\"set to 3, but reads back 4\"").unwrap(), other);
        assert_eq!(LossReason::from("of a newer program").name(), "of a newer program");
        assert_eq!(FaultKind::from("x".repeat(LONGEST + 1).as_str()).name(), "other");
    }
}
