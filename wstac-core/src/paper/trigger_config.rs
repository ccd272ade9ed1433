//! The trigger's parameters: window, multiplier, backtrack, rule and margin, checked together (SPEC §3).

use crate::error::ConfigError;
use crate::fixed::Q16;
use crate::params::{
    BASELINE_WINDOWS, DEFAULT_BACKTRACK, DEFAULT_MARGIN, DEFAULT_MULTIPLIER, DEFAULT_WINDOW, SAMPLE_FRAMES,
};

/// The rule by which a window's threshold follows from the baseline η.
///
/// Sums and comparisons are exact. A decision differs from that of real numbers only because features and parameters
/// are rounded. Let ε be a feature's error, 0.507 units of 2^-11
/// ([`FeatureScale::feature`](crate::features::FeatureScale::feature)). A sum of m features is off by m ε, and so is η,
/// a mean of such sums. b is off by 2^-17, and m · margin by m · 2^-17. In units of 2^-11 in a window sum, the edge of
/// the decision is off by at most
///
/// - `Literal`: m ε + (b + 2^-17) m ε + |η| 2^-17,
/// - `Signed`: 2 m ε + max((b + 2^-17 − 1) m ε + |η| 2^-17, m 2^-6).
///
/// If the real window sum is further from the real threshold than that, both decide alike. With the default parameters
/// the bound is 5.94 units, or 1.19 units per frame: 0.058 % of the light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
// It is exhaustive: a rule that a program does not know must not be taken for another.
pub enum Rule {
    /// The threshold is b · η (paper). η is usually negative, and then any b above 1 fires on every window.
    Literal,
    /// The threshold is η + max((b − 1) · |η|, m · margin), with b ≥ 1 (decided). A higher b is harder to fire for
    /// every η.
    #[default]
    Signed,
}

impl Rule {
    /// Returns the least multiplier in units of 2^-16.
    const fn least(self) -> u32 {
        match self {
            Self::Literal => 0,
            Self::Signed => Q16::ONE.bits(),
        }
    }
}

/// Checks that a window and a backtrack of so many frames can be used.
const fn check_frames(window: u32, backtrack: u32) -> Result<(), ConfigError> {
    if window == 0 || window > SAMPLE_FRAMES as u32 {
        return Err(ConfigError::Window(window));
    }
    let (before, within) = (BASELINE_WINDOWS * window, SAMPLE_FRAMES as u32 - window);
    let most = if before < within { before } else { within };
    if backtrack > most { Err(ConfigError::Backtrack { found: backtrack, most }) } else { Ok(()) }
}

/// The trigger's parameters, checked together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "TriggerFields"))]
pub struct TriggerConfig {
    window: u8,
    backtrack: u8,
    rule: Rule,
    multiplier: Q16,
    margin: Q16,
    per_touch: bool,
}

/// The trigger's parameters before they are checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct TriggerFields {
    window: u8,
    backtrack: u8,
    rule: Rule,
    multiplier: Q16,
    margin: Q16,
    per_touch: bool,
}

#[cfg(feature = "serde")]
impl TryFrom<TriggerFields> for TriggerConfig {
    type Error = ConfigError;
    fn try_from(fields: TriggerFields) -> Result<Self, ConfigError> {
        let TriggerFields { window, backtrack, rule, multiplier, margin, per_touch } = fields;
        check_frames(u32::from(window), u32::from(backtrack))?;
        // Without arithmetic of double precision, which a board would have for nothing else.
        if multiplier.bits() < rule.least() {
            return Err(ConfigError::Multiplier(f64::from(multiplier.bits()) / 65_536.0));
        }
        Ok(Self { window, backtrack, rule, multiplier, margin, per_touch })
    }
}

impl TriggerConfig {
    /// Creates the parameters: window m and backtrack c in frames, multiplier b, and margin in units of a feature's
    /// natural logarithm per frame.
    ///
    /// # Errors
    /// Returns [`ConfigError::Window`] unless 1 ≤ m ≤ 70, and [`ConfigError::Backtrack`] unless c ≤ 5m and c + m ≤ 70.
    /// Returns [`ConfigError::Multiplier`] unless 0 ≤ b < 65536 and, with [`Rule::Signed`], b ≥ 1. Returns
    /// [`ConfigError::Margin`] unless 0 ≤ margin < 65536.
    pub const fn new(
        window: u32,
        multiplier: f64,
        backtrack: u32,
        rule: Rule,
        margin: f64,
    ) -> Result<Self, ConfigError> {
        attempt!(check_frames(window, backtrack));
        let b = match Q16::new(multiplier) {
            Some(b) if b.bits() >= rule.least() => b,
            _ => return Err(ConfigError::Multiplier(multiplier)),
        };
        let Some(margin) = Q16::new(margin) else {
            return Err(ConfigError::Margin(margin));
        };
        Ok(Self { window: window as u8, backtrack: backtrack as u8, rule, multiplier: b, margin, per_touch: false })
    }

    /// Returns the parameters of a trigger that gives one event per touch, however long the touch is.
    ///
    /// Without this call, as published, a touch that is longer than a sample is another event after each 70 frames.
    /// With it, no event starts until the light has left for [`DARK_FRAMES`](crate::params::DARK_FRAMES) frames, and
    /// events know where the touch begins and ends.
    #[must_use]
    pub const fn one_event_per_touch(self) -> Self {
        Self { per_touch: true, ..self }
    }

    /// Returns whether the trigger gives one event per touch.
    pub const fn is_per_touch(&self) -> bool {
        self.per_touch
    }

    /// Returns the number of frames of a window, m: 1..=70.
    pub const fn window(&self) -> u8 {
        self.window
    }

    /// Returns the number of frames of a sample before the window that fired, c: 0..=69.
    pub const fn backtrack(&self) -> u8 {
        self.backtrack
    }

    /// Returns the rule by which the threshold follows from the baseline.
    pub const fn rule(&self) -> Rule {
        self.rule
    }

    /// Returns the multiplier, b.
    pub const fn multiplier(&self) -> Q16 {
        self.multiplier
    }

    /// Returns the least distance of the signed rule's threshold from the baseline.
    pub const fn margin(&self) -> Q16 {
        self.margin
    }

    /// Returns the number of frames of the baseline, 5m.
    pub const fn baseline_frames(&self) -> u16 {
        self.window as u16 * BASELINE_WINDOWS as u16
    }
}

impl Default for TriggerConfig {
    fn default() -> Self {
        const DEFAULT: TriggerConfig = match TriggerConfig::new(
            DEFAULT_WINDOW as u32,
            DEFAULT_MULTIPLIER,
            DEFAULT_BACKTRACK as u32,
            Rule::Signed,
            DEFAULT_MARGIN,
        ) {
            Ok(config) => config,
            Err(_) => panic!("the defaults are valid: decided at compile time"),
        };
        DEFAULT
    }
}
