//! Records as a program in C reads them.

use std::ffi::{CString, c_char};
use std::ptr;

use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_host::json::{confidence, no_speed, rounded, unclear};
use wstac_host::output::{FaultReport, FrameFeatures, Output, SampleFrames, TactileEvent};
use wstac_host::texture::Texture;

use crate::status::c_string;

/// Features of a frame: five rows, then five columns.
pub const WSTAC_FEATURES: usize = 10;
/// Frames of a sample.
pub const WSTAC_SAMPLE_FRAMES: usize = 70;
/// What a feature is in units of: 1/2048 of a natural logarithm.
pub const WSTAC_FEATURE_ONE: i32 = 2048;

const _: () = assert!(WSTAC_FEATURES == FEATURES && WSTAC_SAMPLE_FRAMES == SAMPLE_FRAMES);
const _: () = assert!(WSTAC_FEATURE_ONE == FEATURE_ONE);

/// What a record is.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WstacKind {
    /// Nothing yet: ask again, or push more frames.
    Waiting = 0,
    /// The features of a frame, where options ask for them: frame and features.
    Features = 1,
    /// A tactile event: frame and event.
    Event = 2,
    /// What a model that needs fewer than 70 frames says before the event is complete, which will say the same: frame and texture.
    Texture = 3,
    /// A sample that a long gap interrupted: frame, and frames of it that had arrived.
    Incomplete = 4,
    /// Something happened to the source, which goes on: fault and message.
    Fault = 5,
    /// The end: frame is the number of feature frames, and end says more.
    End = 6,
}

/// What texture models say. Texts are UTF-8, null where no model tells.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacTexture {
    /// The specimen, such as Saw3.
    pub specimen: *const c_char,
    /// The pattern, such as Saw.
    pub pattern: *const c_char,
    /// The depth of the pattern in mm; NAN where no model tells.
    pub depth_mm: f64,
    /// The class of a model that tells something else apart.
    pub other: *const c_char,
}

/// A tactile event: what `wstac run --json` prints.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacEvent {
    /// Sliding speed in mm/s, to a tenth, as `wstac run` prints it; NAN where there is none.
    pub speed_mm_s: f64,
    /// The speed is outside the range that the law was fitted on.
    pub speed_extrapolated: bool,
    /// Of a slide that is cut off: it was at most this fast, in mm/s; NAN otherwise.
    pub speed_at_most_mm_s: f64,
    /// Lit frames, last less first: 0 to 69; -1 where no frame is lit.
    pub duration_frames: i32,
    /// Sliding direction in degrees: 0, 90, 180 or 270, counter-clockwise from +x; NAN where it is unclear.
    pub direction_deg: f64,
    /// 0 to 1, to four decimals.
    pub direction_confidence: f64,
    /// Frames of the sample that were filled: 0 to 70.
    pub frames_filled: u32,
    /// The baseline was quiet, and at most a tenth of the sample was filled.
    pub reliable: bool,
    /// Why there is no speed; null where there is one.
    pub why_no_speed: *const c_char,
    /// Why there is no direction; null where there is one.
    pub why_no_direction: *const c_char,
    /// The sample: 70 frames of ten features each, natural logarithms in units of 1/2048.
    pub sample: *const [i16; 10],
}

/// How a stream ended.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacEnd {
    /// Camera frames that were lost or unusable.
    pub dropped: u64,
    /// The stream was long enough for the baseline.
    pub baseline_complete: bool,
    /// Number of the first frame of the sample that was under way.
    pub incomplete_frame: u64,
    /// Frames of it that had arrived; 0 where none was under way.
    pub incomplete_frames: u32,
}

/// What wstac_next gives. Which parts mean something is said at its kind; the others are as of an event without answers, and null.
#[repr(C)]
pub struct WstacRecord {
    /// What it is.
    pub kind: WstacKind,
    /// Number of a feature frame, from 0: of an event the first of its sample, of a fault the one that comes next.
    pub frame: u64,
    /// Natural logarithms in units of 1/2048.
    pub features: [i16; 10],
    /// Of an event.
    pub event: WstacEvent,
    /// Of an event with models, or a texture.
    pub texture: WstacTexture,
    /// Frames of an interrupted sample that had arrived, or that a model looked at.
    pub frames: u32,
    /// Kind of a fault in a word, such as disconnected.
    pub fault: *const c_char,
    /// What happened, for a person.
    pub message: *const c_char,
    /// Of the end.
    pub end: WstacEnd,
}

/// A record that says nothing.
const EMPTY: WstacRecord = WstacRecord {
    kind: WstacKind::Waiting,
    frame: 0,
    features: [0; FEATURES],
    event: WstacEvent {
        speed_mm_s: f64::NAN,
        speed_extrapolated: false,
        speed_at_most_mm_s: f64::NAN,
        duration_frames: -1,
        direction_deg: f64::NAN,
        direction_confidence: 0.0,
        frames_filled: 0,
        reliable: false,
        why_no_speed: ptr::null(),
        why_no_direction: ptr::null(),
        sample: ptr::null(),
    },
    texture: NO_TEXTURE,
    frames: 0,
    fault: ptr::null(),
    message: ptr::null(),
    end: WstacEnd { dropped: 0, baseline_complete: false, incomplete_frame: 0, incomplete_frames: 0 },
};

const NO_TEXTURE: WstacTexture =
    WstacTexture { specimen: ptr::null(), pattern: ptr::null(), depth_mm: f64::NAN, other: ptr::null() };

/// What the last record points to.
#[derive(Default)]
pub(super) struct Given {
    texts: Vec<CString>,
    sample: Option<Box<SampleFrames>>,
}

impl Given {
    /// Returns a record that says that there is none yet. Frees what the last record points to.
    pub(super) fn waiting(&mut self) -> WstacRecord {
        *self = Self::default();
        EMPTY
    }

    /// Returns the record of an output; `None` for lost frames and a disturbed baseline, which have none. Frees what the last record
    /// points to.
    pub(super) fn record(&mut self, output: Output) -> Option<WstacRecord> {
        *self = Self::default();
        Some(match output {
            Output::Features(FrameFeatures { frame, features }) => {
                WstacRecord { kind: WstacKind::Features, frame, features, ..EMPTY }
            }
            Output::Event(event) => WstacRecord {
                kind: WstacKind::Event,
                frame: event.frame,
                texture: self.texture(event.texture.as_ref()),
                event: self.event(*event),
                ..EMPTY
            },
            Output::EarlyTexture(early) => WstacRecord {
                kind: WstacKind::Texture,
                frame: early.frame,
                texture: self.texture(Some(&early.texture)),
                frames: u32::from(early.frames),
                ..EMPTY
            },
            Output::Interrupted(sample) => WstacRecord {
                kind: WstacKind::Incomplete,
                frame: sample.frame,
                frames: u32::from(sample.frames),
                ..EMPTY
            },
            Output::Fault(FaultReport { frame, fault }) => WstacRecord {
                kind: WstacKind::Fault,
                frame,
                fault: self.keep(fault.kind.name()),
                message: self.keep(&fault.message),
                ..EMPTY
            },
            Output::End(end) => WstacRecord {
                kind: WstacKind::End,
                frame: end.frames,
                end: WstacEnd {
                    dropped: end.dropped,
                    baseline_complete: end.baseline_complete,
                    incomplete_frame: end.incomplete.map_or(0, |sample| sample.frame),
                    incomplete_frames: end.incomplete.map_or(0, |sample| u32::from(sample.frames)),
                },
                ..EMPTY
            },
            _ => return None,
        })
    }

    fn event(&mut self, event: TactileEvent) -> WstacEvent {
        let direction = event.direction;
        self.sample = event.sample;
        WstacEvent {
            speed_mm_s: event.speed.map_or(f64::NAN, |speed| rounded(speed.mm_s)),
            speed_extrapolated: event.speed.is_ok_and(|speed| speed.extrapolated),
            speed_at_most_mm_s: event.speed_at_most.map_or(f64::NAN, |speed| rounded(speed.mm_s)),
            duration_frames: event.lit_frames.map_or(-1, i32::from),
            direction_deg: direction.heading.map_or(f64::NAN, |heading| f64::from(heading.degrees())),
            direction_confidence: confidence(direction),
            frames_filled: u32::from(event.frames_filled),
            reliable: event.reliable,
            why_no_speed: self.keep_any(event.speed.err().map(no_speed)),
            why_no_direction: self.keep_any(direction.heading.err().map(unclear)),
            sample: self.sample.as_ref().map_or(ptr::null(), |sample| sample.as_ptr()),
        }
    }

    fn texture(&mut self, texture: Option<&Texture>) -> WstacTexture {
        let Some(texture) = texture else { return NO_TEXTURE };
        WstacTexture {
            specimen: self.keep_any(texture.specimen.as_deref()),
            pattern: self.keep_any(texture.pattern.as_deref()),
            depth_mm: texture.depth_mm.unwrap_or(f64::NAN),
            other: self.keep_any(texture.class.as_deref()),
        }
    }

    /// Keeps a text until the next record. Its bytes do not move when more texts are kept.
    fn keep(&mut self, text: &str) -> *const c_char {
        self.texts.push(c_string(text));
        self.texts.last().map_or(ptr::null(), |text| text.as_ptr())
    }

    fn keep_any(&mut self, text: Option<&str>) -> *const c_char {
        text.map_or(ptr::null(), |text| self.keep(text))
    }
}
