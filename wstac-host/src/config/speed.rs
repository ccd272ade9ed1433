//! The tables `[speed]` and `[sensor]`: the law from an event to speed, direction and kind of touch.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use wstac_core::error::ConfigError;
use wstac_core::law::{AnyLaw, ByCoherence, ByEdges, ByWave};
use wstac_core::paper::speed::{Law, SpeedConfig, ThresholdOn};
use wstac_core::params;
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::{MotionConfig, ReadoutTime};

use crate::text_file::whole_if_any;

/// A law by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum LawName {
    #[default]
    Arrival,
    Published,
}

impl LawName {
    fn name(self) -> &'static str {
        match self {
            Self::Arrival => "arrival",
            Self::Published => "published",
        }
    }
}

impl<'de> Deserialize<'de> for LawName {
    /// Reads `"paper"`, too, the name in configurations and recordings of before. An alias of serde would be in
    /// messages.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match String::deserialize(deserializer)?.as_str() {
            "arrival" => Ok(Self::Arrival),
            "published" | "paper" => Ok(Self::Published),
            other => Err(D::Error::unknown_variant(other, &["arrival", "published"])),
        }
    }
}

/// An estimator of arrival times by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Estimator {
    /// The coherence of ten lines' signals: for objects wider than the sensor.
    Coherence,
    /// The light of 25 taxels: for objects of any shape.
    #[default]
    Wave,
    /// The rising edges of the lines: cheapest.
    Edges,
}

/// `[sensor]`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct SensorKeys {
    /// The distance between neighboring whiskers, in mm.
    pub pitch_mm: f32,
    /// The time from the first to the last row of the unrotated picture; `None` if the source's own counts.
    #[serde(rename = "readout_ms", deserialize_with = "readout_time")]
    pub readout: Option<ReadoutTime>,
}

fn readout_time<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<ReadoutTime>, D::Error> {
    let found = f32::deserialize(deserializer)?;
    let wrong = || format!("[sensor] readout_ms is {found}, expected -1000 to 1000; 0 is a global shutter");
    ReadoutTime::from_ms(found).ok_or_else(|| D::Error::custom(wrong())).map(Some)
}

impl Default for SensorKeys {
    fn default() -> Self {
        Self { pitch_mm: params::PITCH_MM, readout: None }
    }
}

/// `[speed]`, before it is checked. A law's own parameters default to the published ones.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct SpeedKeys {
    law: LawName,
    estimator: Option<Estimator>,
    /// The threshold above which a row or column is lit: a fraction of full scale, summed over its five taxels.
    pub threshold: f64,
    /// The quantity that the threshold is compared with.
    pub threshold_on: ThresholdOn,
    intercept: Option<f32>,
    slope: Option<f32>,
    #[serde(deserialize_with = "whole_if_any")]
    range_mm_s: Option<[f32; 2]>,
}

impl Default for SpeedKeys {
    fn default() -> Self {
        Self {
            law: LawName::default(),
            estimator: None,
            threshold: params::VALID_THRESHOLD,
            threshold_on: ThresholdOn::default(),
            intercept: None,
            slope: None,
            range_mm_s: None,
        }
    }
}

impl SpeedKeys {
    /// Returns the law of durations with its parameters; `None` if the law is that of arrival times.
    pub fn law(&self) -> Option<Law> {
        match self.law {
            LawName::Arrival => None,
            LawName::Published => Some(Law {
                intercept: self.intercept.unwrap_or(params::SPEED_INTERCEPT),
                slope: self.slope.unwrap_or(params::SPEED_SLOPE),
            }),
        }
    }

    /// Returns how arrival times are estimated; `None` if the law is one of durations.
    pub fn estimator(&self) -> Option<Estimator> {
        (self.law == LawName::Arrival).then(|| self.estimator.unwrap_or_default())
    }

    /// Returns the keys with arrival times by this estimator, without the parameters of other laws. Without an
    /// estimator, the law is the one of durations in force, or else the published one.
    #[must_use]
    pub fn with_estimator(self, estimator: Option<Estimator>) -> Self {
        let Self { threshold, threshold_on, .. } = self;
        match (estimator, self.law) {
            (Some(_), _) => Self { law: LawName::Arrival, estimator, threshold, threshold_on, ..Self::default() },
            (None, LawName::Arrival) => Self { law: LawName::Published, threshold, threshold_on, ..Self::default() },
            (None, _) => self,
        }
    }

    /// Returns the slowest and the fastest speed that a law of durations was fitted on, in mm/s.
    pub fn range(&self) -> [f32; 2] {
        self.range_mm_s.unwrap_or([params::SLOWEST_FITTED, params::FASTEST_FITTED])
    }

    /// Returns the law of durations for a camera of this rate: the one in force, or else the published one.
    pub(super) fn of_durations(&self, rate: FrameRate) -> Result<SpeedConfig, ConfigError> {
        let [slowest, fastest] = self.range();
        let law = self.law().unwrap_or(Law::PUBLISHED);
        SpeedConfig::new(law, self.threshold, self.threshold_on, rate)?.fitted_on(slowest, fastest)
    }

    pub(crate) fn in_force(&self, motion: MotionConfig, rate: FrameRate) -> Result<AnyLaw, ConfigError> {
        let durations = self.of_durations(rate)?;
        Ok(match self.estimator() {
            Some(Estimator::Wave) => AnyLaw::Wave(ByWave(motion)),
            Some(Estimator::Coherence) => AnyLaw::Coherence(ByCoherence(motion)),
            Some(Estimator::Edges) => AnyLaw::Edges(ByEdges(motion)),
            None => AnyLaw::Duration(durations),
        })
    }

    /// Returns the keys with all parameters of the law written out, those of its defaults included.
    pub(super) fn in_full(self) -> Self {
        let range_mm_s = Some(self.range());
        match self.law() {
            None => Self { estimator: self.estimator(), ..self },
            Some(Law { intercept, slope }) => {
                Self { intercept: Some(intercept), slope: Some(slope), range_mm_s, ..self }
            }
        }
    }

    /// Refuses a parameter of a law that is not in force, because it would silently change nothing.
    pub(super) fn check(&self) -> Result<(), String> {
        let keys = [
            ("estimator", self.estimator.is_some(), LawName::Arrival),
            ("intercept", self.intercept.is_some(), LawName::Published),
            ("slope", self.slope.is_some(), LawName::Published),
            ("range_mm_s", self.range_mm_s.is_some(), LawName::Published),
        ];
        for (key, is_given, law) in keys {
            if is_given && law != self.law {
                let (found, expected) = (self.law.name(), law.name());
                return Err(format!("[speed] {key} needs law = \"{expected}\" (found law = \"{found}\")"));
            }
        }
        Ok(())
    }
}
