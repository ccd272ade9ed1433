//! The table `[speed]`: the law, its parameters and range, and the threshold for light.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use wstac_core::params;
use wstac_core::speed::{Law, ThresholdOn};

/// A speed law by name.
#[derive(Clone, Copy, Debug, Default, Serialize)]
#[serde(rename_all = "lowercase")]
enum LawName {
    #[default]
    Published,
    Physical,
}

impl<'de> Deserialize<'de> for LawName {
    /// Reads `"paper"`, too, the name in configurations and recordings of before. An alias of serde would be in messages.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match String::deserialize(deserializer)?.as_str() {
            "published" | "paper" => Ok(Self::Published),
            "physical" => Ok(Self::Physical),
            other => Err(D::Error::unknown_variant(other, &["published", "physical"])),
        }
    }
}

/// `[speed]`, before it is checked. A law's own parameters default to the published ones.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct SpeedKeys {
    law: LawName,
    /// The threshold above which a row or column is lit: a fraction of full scale, summed over its five taxels.
    pub threshold: f64,
    /// The quantity that the threshold is compared with.
    pub threshold_on: ThresholdOn,
    intercept: Option<f32>,
    slope: Option<f32>,
    track_mm: Option<f32>,
    afterglow_frames: Option<f32>,
    range_mm_s: Option<[f32; 2]>,
}

impl Default for SpeedKeys {
    fn default() -> Self {
        Self {
            law: LawName::default(),
            threshold: params::VALID_THRESHOLD,
            threshold_on: ThresholdOn::default(),
            intercept: None,
            slope: None,
            track_mm: None,
            afterglow_frames: None,
            range_mm_s: None,
        }
    }
}

impl SpeedKeys {
    /// Returns the law with its parameters.
    pub fn law(&self) -> Law {
        match self.law {
            LawName::Published => Law::Published {
                intercept: self.intercept.unwrap_or(params::SPEED_INTERCEPT),
                slope: self.slope.unwrap_or(params::SPEED_SLOPE),
            },
            LawName::Physical => Law::Physical {
                track: self.track_mm.unwrap_or(params::TRACK_LENGTH),
                afterglow: self.afterglow_frames.unwrap_or(params::AFTERGLOW_FRAMES),
            },
        }
    }

    /// Returns the slowest and the fastest speed that the law was fitted on, in mm/s.
    pub fn range(&self) -> [f32; 2] {
        self.range_mm_s.unwrap_or([params::SLOWEST_FITTED, params::FASTEST_FITTED])
    }

    /// Returns the keys with all parameters of the law written out, those of its defaults included.
    pub(super) fn in_full(self) -> Self {
        let range_mm_s = Some(self.range());
        match self.law() {
            Law::Published { intercept, slope } => {
                Self { intercept: Some(intercept), slope: Some(slope), range_mm_s, ..self }
            }
            Law::Physical { track, afterglow } => {
                Self { track_mm: Some(track), afterglow_frames: Some(afterglow), range_mm_s, ..self }
            }
        }
    }

    /// Refuses a parameter of a law that is not in force, because it would silently change nothing.
    pub(super) fn check(&self) -> Result<(), String> {
        let (law, other, key) = match self.law {
            LawName::Published => (
                "published",
                "physical",
                self.track_mm.map(|_| "track_mm").or(self.afterglow_frames.map(|_| "afterglow_frames")),
            ),
            LawName::Physical => {
                ("physical", "published", self.intercept.map(|_| "intercept").or(self.slope.map(|_| "slope")))
            }
        };
        key.map_or(Ok(()), |key| {
            Err(format!("[speed] has {key} with law = \"{law}\", expected it with law = \"{other}\" only"))
        })
    }
}
