//! A case of the golden vectors, as the manifest and the files of `tests/golden` describe it.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use wstac_core::features::Features;
use wstac_core::frame::Stride;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::speed::{Law, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{ContactEnd, InterruptedSample, Rule, TriggerConfig};
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_tests::formats::COLORS;

#[derive(Deserialize)]
pub(super) struct Manifest {
    pub(super) version: u32,
    pub(super) cases: Vec<Case>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Case {
    pub(super) name: String,
    #[serde(rename = "about")]
    pub(super) _about: String,
    pub(super) format: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) bytes_per_line: u32,
    pub(super) frame_bytes: usize,
    pub(super) fps: (u32, u32),
    pub(super) matrix: String,
    pub(super) range: String,
    pub(super) yuv: YcbcrMethod,
    pub(super) stride: u32,
    pub(super) layout: LayoutOf,
    pub(super) floor_levels: f64,
    pub(super) trigger: TriggerOf,
    pub(super) speed: SpeedOf,
    pub(super) frames: usize,
    pub(super) lost: Vec<(usize, u64)>,
    /// Where its frames begin in `frames.raw`.
    pub(super) at: usize,
}

#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum LayoutOf {
    Preset { preset: String },
    Corners { taxel: [u16; 2], corners: Vec<[u16; 2]> },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TriggerOf {
    pub(super) window: u32,
    pub(super) multiplier: f64,
    pub(super) backtrack: u32,
    pub(super) rule: Rule,
    pub(super) margin: f64,
    follow: Option<u32>,
    per_touch: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SpeedOf {
    pub(super) law: String,
    pub(super) threshold: f64,
    pub(super) threshold_on: ThresholdOn,
    range_mm_s: Option<[f32; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Expected {
    pub(super) pixels: u32,
    pub(super) full_scale: u32,
    pub(super) added: u32,
    pub(super) sums: Option<Vec<Vec<u32>>>,
    pub(super) features: Vec<Features>,
    pub(super) feature_frames: Option<Vec<u64>>,
    pub(super) partial_frames: Option<Vec<u64>>,
    pub(super) trigger: Option<Thresholds>,
    pub(super) events: Vec<EventOf>,
    pub(super) incomplete_samples: Vec<InterruptedSample>,
    #[serde(default)]
    pub(super) contact_ends: Vec<ContactEnd>,
    pub(super) end: End,
    pub(super) robust: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Thresholds {
    pub(super) baseline_sum: [i32; 10],
    pub(super) eta: [f64; 10],
    pub(super) threshold_floor: [i32; 10],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EventOf {
    pub(super) frame: u64,
    pub(super) frames_filled: u8,
    pub(super) reliable: bool,
    pub(super) duration_frames: Option<u8>,
    pub(super) first_valid: Option<u8>,
    pub(super) last_valid: Option<u8>,
    pub(super) speed: SpeedAnswer,
    pub(super) direction: DirectionAnswer,
    /// The first lit frame of the touch, and the first dark one behind it.
    #[serde(default)]
    pub(super) touch: [Option<u64>; 2],
    pub(super) sample: Option<Vec<Vec<i16>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SpeedAnswer {
    pub(super) mm_s: Option<f64>,
    pub(super) extrapolated: bool,
    pub(super) why: Option<String>,
    pub(super) bound_mm_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DirectionAnswer {
    pub(super) deg: Option<u16>,
    pub(super) confidence: f64,
    pub(super) row_slope: f64,
    pub(super) column_slope: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct End {
    pub(super) frames: u64,
    pub(super) dropped: u64,
    pub(super) baseline: String,
    pub(super) quiet: Option<bool>,
    pub(super) incomplete: Option<InterruptedSample>,
}

/// Frames of a stream of taxels.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum Frames<T> {
    Lost(()),
    /// So many dark frames.
    Dark(usize),
    One([T; TAXELS]),
}

/// Returns each frame of a stream, whose dark taxels have this number; `None` is a lost frame.
pub(super) fn each<T: Copy>(frames: &[Frames<T>], dark: T) -> impl Iterator<Item = Option<[T; TAXELS]>> {
    frames.iter().flat_map(move |frames| match frames {
        Frames::Lost(()) => vec![None],
        Frames::Dark(count) => vec![Some([dark; TAXELS]); *count],
        Frames::One(taxels) => vec![Some(*taxels)],
    })
}

/// A file of vectors.
#[derive(Deserialize)]
pub(super) struct Cases<C> {
    pub(super) cases: Vec<C>,
}

pub(super) fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

/// Panics with the file's name if it cannot be used. A missing vector is a failure.
pub(super) fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> T {
    let text = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

impl Case {
    pub(super) fn pixel_format(&self) -> PixelFormat {
        use PixelFormat as F;
        // Green is at the same place in both.
        let stored = match self.format.as_str() {
            "BGRX32" => "RGBX32",
            "XBGR32" => "XRGB32",
            stored => stored,
        };
        let name = |format: &F| match *format {
            F::Gray => "GREY".to_owned(),
            F::Bayer8(order) => format!("{order:?}8"),
            F::Bayer10(order) => format!("{order:?}10"),
            F::Bayer12(order) => format!("{order:?}12"),
            format => format!("{format:?}"),
        };
        let mut named = F::all().filter(|format| name(format).to_uppercase() == stored);
        named.next().unwrap_or_else(|| panic!("{}: pixel format {stored}", self.name))
    }

    pub(super) fn camera(&self) -> FrameGeometry<Any> {
        let color = format!("{} {}", self.matrix, self.range);
        let name = |color: &YcbcrEncoding| format!("{:?} {:?}", color.matrix, color.range).to_lowercase();
        let encoding = COLORS.into_iter().find(|encoding| name(encoding) == color).expect(&color);
        let size = FrameSize::new(self.width, self.height).unwrap();
        let layout = match &self.layout {
            LayoutOf::Preset { preset } => {
                assert_eq!(preset, "paper");
                Layout::paper(size).unwrap()
            }
            LayoutOf::Corners { taxel, corners } => {
                Layout::new(size, *taxel, corners.as_slice().try_into().unwrap()).unwrap()
            }
        };
        let green = Any::new(self.pixel_format(), encoding, self.yuv);
        FrameGeometry::with_stride(green, layout, self.rate(), Stride::try_from(self.stride).unwrap())
            .and_then(|camera| camera.with_bytes_per_row(self.bytes_per_line))
            .unwrap()
    }

    pub(super) fn rate(&self) -> FrameRate {
        FrameRate::new(self.fps.0, self.fps.1).unwrap()
    }

    pub(super) fn trigger(&self) -> TriggerConfig {
        let t = &self.trigger;
        let config = TriggerConfig::new(t.window, t.multiplier, t.backtrack, t.rule, t.margin).unwrap();
        if t.per_touch == Some(true) { config.one_event_per_touch() } else { config }
    }

    pub(super) fn following(&self) -> Option<TrackingBaseline> {
        self.trigger.follow.map(|windows| TrackingBaseline::new(windows).unwrap())
    }

    pub(super) fn speed(&self) -> SpeedConfig {
        assert!(matches!(self.speed.law.as_str(), "paper" | "published"), "law {}", self.speed.law);
        let config =
            SpeedConfig::new(Law::PUBLISHED, self.speed.threshold, self.speed.threshold_on, self.rate()).unwrap();
        self.speed.range_mm_s.map_or(config, |[slowest, fastest]| config.fitted_on(slowest, fastest).unwrap())
    }
}
