//! The configuration file: TOML, every key optional, defaults from the sensor's published or decided parameters.

// The path is given because the firmware reads this file, too, from its place here.
mod crosstalk;
mod speed;

use std::error::Error as StdError;
use std::path::Path;

use serde::{Deserialize, Serialize};
use wstac_core::error::ConfigError;
use wstac_core::frame::Stride;
use wstac_core::green::any::YcbcrMethod;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::speed::SpeedConfig;
use wstac_core::paper::trigger::{Rule, TriggerConfig};
use wstac_core::params;
use wstac_core::rate::FrameRate;
use wstac_core::touch::crosstalk::Correction;
use wstac_core::touch::motion::MotionConfig;

pub use self::speed::{Estimator, SensorKeys, SpeedKeys};
use crate::error::{Error, ErrorKind};
use crate::text_file::{from_toml, whole_if_any};

/// Everything that a configuration file can say.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The name of the configuration in messages: the file that it was read from.
    #[serde(skip)]
    origin: Option<String>,
    /// The places of the taxels.
    pub layout: LayoutConfig,
    /// The way from pixels to green.
    pub green: GreenConfig,
    /// The way from sums to features.
    pub features: FeaturesConfig,
    /// The condition for the start of an event.
    pub trigger: TriggerKeys,
    /// The sensor itself.
    pub sensor: SensorKeys,
    /// The way to an event's speed, direction and kind of touch.
    pub speed: SpeedKeys,
    /// The way to an event's direction.
    pub direction: DirectionConfig,
}

/// `[layout]`: a preset, or a taxel size with 25 corners.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct LayoutConfig {
    preset: Option<Preset>,
    /// Width and height of the frames that the layout is for; `None` if it is for frames of any size.
    #[serde(deserialize_with = "whole_if_any")]
    frame: Option<[u16; 2]>,
    taxel: Option<Vec<u16>>,
    corners: Option<Vec<Vec<u16>>>,
    /// The light of each whisker that each taxel sees, as a fraction of what the whisker's own taxel sees: a row for
    /// each taxel.
    crosstalk: Option<Vec<Vec<f64>>>,
    /// How bright each whisker is beside the others, row by row: 1 is as bright as expected at its place.
    gains: Option<Vec<f64>>,
}

/// A layout by name.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Preset {
    Paper,
}

/// `[green]`.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct GreenConfig {
    /// The way from YCbCr to green.
    pub yuv: YcbcrMethod,
    /// The pixels that are counted.
    pub stride: Stride,
}

/// A log kernel by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kernel {
    /// A chord table, integers only.
    #[default]
    Fixed,
    /// `libm` in 64-bit floating point.
    Libm,
    /// `micromath` in 32-bit floating point.
    Micromath,
}

/// `[features]`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct FeaturesConfig {
    /// Log kernel.
    pub ln: Kernel,
    /// Darkness floor, in gray levels of a taxel.
    pub floor_levels: f64,
}

impl Default for FeaturesConfig {
    fn default() -> Self {
        Self { ln: Kernel::default(), floor_levels: params::DEFAULT_FLOOR_LEVELS }
    }
}

/// `[trigger]`, before it is checked.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct TriggerKeys {
    window: u32,
    multiplier: f64,
    backtrack: u32,
    rule: Rule,
    margin: f64,
    /// Time constant of a baseline that follows drift, in windows; 0 for a fixed baseline.
    follow: u32,
}

impl Default for TriggerKeys {
    fn default() -> Self {
        Self {
            window: u32::from(params::DEFAULT_WINDOW),
            multiplier: params::DEFAULT_MULTIPLIER,
            backtrack: u32::from(params::DEFAULT_BACKTRACK),
            rule: Rule::default(),
            margin: params::DEFAULT_MARGIN,
            follow: 0,
        }
    }
}

/// `[direction]`.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct DirectionConfig {
    /// The way to the time of a row or column.
    pub method: DirectionMethod,
}

/// A direction method by name.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DirectionMethod {
    /// Centroid of the light above baseline.
    #[default]
    Centroid,
}

impl Config {
    /// Reads a file and checks everything that can be checked without a camera.
    ///
    /// # Errors
    /// The file cannot be read, or a key is wrong. The error names the file, the key, what was found and what was
    /// expected.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::of_file(path, &crate::text_file::file_text(path)?)
    }

    /// Reads a file as [`read`](Self::read) does, but no pipe and no device, whose bytes could be waited for forever.
    ///
    /// # Errors
    /// The errors of [`read`](Self::read), and if it is no regular file.
    pub fn read_stored(path: &Path) -> Result<Self, Error> {
        Self::of_file(path, &crate::text_file::stored_text(path)?)
    }

    fn of_file(path: &Path, text: &str) -> Result<Self, Error> {
        let config = Self::parse(text).map_err(|error| error.about(path.display()))?;
        Ok(Self { origin: Some(path.display().to_string()), ..config })
    }

    /// Creates an error that shows only with a source. It names the configuration and the source.
    pub fn does_not_fit(&self, source: &str, table: &str, error: impl Into<Box<dyn StdError + Send + Sync>>) -> Error {
        let error = error.into();
        match &self.origin {
            Some(file) => {
                let message = format_args!("{table} {error} (source: {source})");
                Error::new(ErrorKind::Config, file, message).caused_by(error)
            }
            None => Error::with_cause(ErrorKind::Config, source, error),
        }
    }

    /// Reads and checks a configuration's text.
    ///
    /// # Errors
    /// A key is wrong. The error names the key, what was found and what was expected. Its subject is `configuration`;
    /// [`Error::about`] replaces it.
    pub fn parse(text: &str) -> Result<Self, Error> {
        const SUBJECT: &str = "configuration";
        let wrong = |message: String| Error::new(ErrorKind::Config, SUBJECT, message);
        let in_table = |table: &str, error: ConfigError| wrong(format!("{table} {error}")).caused_by(error);
        let config: Self = from_toml(text).map_err(|message| wrong(removed_law(text).unwrap_or(message)))?;
        config.layout.check().map_err(wrong)?;
        config.speed.check().map_err(wrong)?;
        config.trigger().map_err(|error| in_table("[trigger]", error))?;
        config.following().map_err(|error| in_table("[trigger]", error))?;
        MotionConfig::new(config.sensor.pitch_mm, FrameRate::NOMINAL).map_err(|error| in_table("[sensor]", error))?;
        config.durations(FrameRate::NOMINAL).map_err(|error| in_table("[speed]", error))?;
        if !(config.features.floor_levels >= 0.0 && config.features.floor_levels.is_finite()) {
            return Err(in_table("[features]", ConfigError::FloorLevels(config.features.floor_levels)));
        }
        Ok(config)
    }

    /// Reads and checks a recording's configuration, without `[speed]` if that has a law that was removed.
    ///
    /// # Errors
    /// The errors of [`parse`](Self::parse).
    pub(crate) fn parse_recorded(text: &str) -> Result<Self, Error> {
        match text.parse::<toml::Table>() {
            Ok(mut table) if removed_law(text).is_some() => {
                // The default of that time.
                let speed = toml::Table::from_iter([("estimator".to_owned(), "coherence".into())]);
                table.insert("speed".to_owned(), speed.into());
                Self::parse(&table.to_string())
            }
            _ => Self::parse(text),
        }
    }

    /// Returns all of the configuration as TOML, with the defaults written out. [`parse`](Self::parse) reads the same
    /// configuration from it.
    ///
    /// # Errors
    /// The errors of writing TOML. None is known to happen.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let mut full = Self { speed: self.speed.in_full(), ..self.clone() };
        if full.layout.explicit().is_none() {
            full.layout.preset = Some(Preset::Paper);
        }
        toml::to_string(&full)
    }

    /// Returns this configuration with what a calibration measures, as `calibration` has it: `[layout]` (with the
    /// cross-talk of its taxels, or none), `[features]` floor_levels, `[trigger]` margin, `[speed]` threshold and
    /// threshold_on.
    #[must_use]
    pub fn calibrated(&self, calibration: &Self) -> Self {
        // It is no file's configuration any more.
        let mut own = Self { origin: None, layout: calibration.layout.clone(), ..self.clone() };
        own.features.floor_levels = calibration.features.floor_levels;
        own.trigger.margin = calibration.trigger.margin;
        own.speed.threshold = calibration.speed.threshold;
        own.speed.threshold_on = calibration.speed.threshold_on;
        own.sensor.readout = calibration.sensor.readout.or(own.sensor.readout);
        own
    }

    /// Returns the trigger's parameters. By arrival times it gives one event per touch; a law of durations leaves it as
    /// it was published.
    ///
    /// # Errors
    /// The errors of [`TriggerConfig::new`].
    pub fn trigger(&self) -> Result<TriggerConfig, ConfigError> {
        let keys = &self.trigger;
        let trigger = TriggerConfig::new(keys.window, keys.multiplier, keys.backtrack, keys.rule, keys.margin)?;
        Ok(if self.speed.law().is_none() { trigger.one_event_per_touch() } else { trigger })
    }

    /// Returns how the baseline follows drift; `None` if it is fixed.
    ///
    /// # Errors
    /// The errors of [`TrackingBaseline::new`].
    pub fn following(&self) -> Result<Option<TrackingBaseline>, ConfigError> {
        match self.trigger.follow {
            0 => Ok(None),
            windows => TrackingBaseline::new(windows).map(Some),
        }
    }

    /// Returns the law of durations for a camera of this rate: the one in force, or else the published one.
    ///
    /// # Errors
    /// The errors of [`SpeedConfig::new`] and [`SpeedConfig::fitted_on`].
    pub fn durations(&self, rate: FrameRate) -> Result<SpeedConfig, ConfigError> {
        self.speed.of_durations(rate)
    }

    /// Returns the layout for frames of this size.
    ///
    /// # Errors
    /// The errors of [`Layout::new`] and [`Layout::paper`].
    pub fn layout(&self, frame: FrameSize) -> Result<Layout, ConfigError> {
        match self.layout.explicit() {
            Some((taxel, corners)) => Layout::new(frame, taxel, corners),
            None => Layout::paper(frame),
        }
    }
}

/// Returns what to use instead of the law `"physical"`, if a configuration names it or one of its keys.
fn removed_law(text: &str) -> Option<String> {
    let table = text.parse::<toml::Table>().ok()?;
    let speed = table.get("speed")?;
    let names_it = speed.get("law").and_then(toml::Value::as_str) == Some("physical");
    let found = if names_it {
        "law = \"physical\""
    } else {
        *["track_mm", "afterglow_frames"].iter().find(|key| speed.get(**key).is_some())?
    };
    Some(format!(
        "[speed] has {found}, which was removed (expected law = \"arrival\" or \"published\"); help: \
         law = \"arrival\" holds for slides of any length, and --config gives a recording another law"
    ))
}

impl LayoutConfig {
    /// Returns whether a key of the taxels' places is given. Without one, they are where the publication has them.
    pub fn is_stated(&self) -> bool {
        self.preset.is_some() || self.frame.is_some() || self.taxel.is_some() || self.corners.is_some()
    }

    /// Returns the width and height of the frames that the layout is for; `None` if it is for frames of any size.
    pub fn frame(&self) -> Option<[u16; 2]> {
        self.frame
    }

    /// Refuses frames of another size than the layout is for, because its taxels would lie beside the whiskers.
    ///
    /// # Errors
    /// The size is another. The error names the key, what was found and what was expected.
    pub fn check_frame(&self, frame: FrameSize) -> Result<(), String> {
        let found = [frame.width(), frame.height()];
        match self.frame {
            Some([width, height]) if found != [width, height] => Err(format!(
                "frame is [{width}, {height}], but frames are {} x {} pixels: expected frames of {width} x {height}, or \
                 another calibration",
                found[0], found[1]
            )),
            _ => Ok(()),
        }
    }

    /// Returns the taxel size and the corners; `None` if the layout is a preset.
    pub fn explicit(&self) -> Option<([u16; 2], [[u16; 2]; params::TAXELS])> {
        let mut corners = [[0; 2]; params::TAXELS];
        for (corner, given) in corners.iter_mut().zip(self.corners.as_ref()?) {
            *corner = pair(given)?;
        }
        Some((pair(self.taxel.as_ref()?)?, corners))
    }

    /// Returns the correction of cross-talk and gains; `None` if neither is stated.
    pub fn correction(&self) -> Option<Correction> {
        // It was checked when it was read.
        self.checked_correction().ok().flatten()
    }

    fn checked_correction(&self) -> Result<Option<Correction>, String> {
        crosstalk::correction(self.crosstalk.as_deref(), self.gains.as_deref())
    }

    fn check(&self) -> Result<(), String> {
        self.checked_correction()?;
        match (self.preset, &self.taxel, &self.corners) {
            (Some(Preset::Paper) | None, None, None) => Ok(()),
            (Some(_), ..) => Err("[layout] has a preset beside taxel or corners; leave one of them out".into()),
            (None, Some(taxel), Some(corners)) => {
                if pair(taxel).is_none() {
                    return Err(format!("[layout] taxel has {} numbers, expected width and height", taxel.len()));
                }
                if corners.len() != params::TAXELS {
                    return Err(format!("[layout] corners has {} entries, expected {}", corners.len(), params::TAXELS));
                }
                match corners.iter().position(|corner| pair(corner).is_none()) {
                    Some(k) => Err(format!("[layout] corners[{k}] has {} numbers, expected x and y", corners[k].len())),
                    None => Ok(()),
                }
            }
            (None, Some(_), None) => Err("[layout] has taxel but no corners, expected both".into()),
            (None, None, Some(_)) => Err("[layout] has corners but no taxel, expected both".into()),
        }
    }
}

/// Returns two numbers; `None` if there are more or fewer.
fn pair(numbers: &[u16]) -> Option<[u16; 2]> {
    numbers.try_into().ok()
}

/// A configuration file with every key at its default.
pub const DEFAULT_CONFIGURATION: &str = include_str!("config/default.toml");

#[cfg(test)]
mod tests {
    use wstac_core::green::any::PixelFormat;
    use wstac_core::law::{AnyLaw, ByWave};

    use super::*;
    use crate::source::StreamInfo;

    /// Returns the law for frames of the paper's shape.
    fn law(config: &Config) -> AnyLaw {
        let size = FrameSize::new(400, 400).unwrap();
        config.law_of(&StreamInfo::new("", size, PixelFormat::Gray, FrameRate::NOMINAL)).unwrap()
    }

    /// The configuration as `wstac help config` prints it.
    const DOCUMENTED: &str = DEFAULT_CONFIGURATION;

    #[test]
    fn the_documented_values_are_the_defaults() {
        let (documented, default) = (Config::parse(DOCUMENTED).unwrap(), Config::parse("").unwrap());
        // The preset and the law's parameters are written out.
        let without = |config: &Config| {
            format!("{:?} {:?} {:?} {:?}", config.green, config.features, config.trigger, config.direction)
        };
        assert_eq!(without(&documented), without(&default));
        assert_eq!(law(&documented), law(&default));
        assert_eq!(default.trigger().unwrap(), TriggerConfig::default().one_event_per_touch());
        assert_eq!(law(&default), AnyLaw::Wave(ByWave(MotionConfig::published(FrameRate::NOMINAL))));
    }

    #[test]
    fn the_documentation_says_which_key_is_the_triggers_threshold() {
        // The comments of a key, as one line.
        let comment = |key: &str| {
            let begin = DOCUMENTED.find(&format!("\n{key} = ")).unwrap() + 1;
            let of_key = |&(k, line): &(usize, &str)| k == 0 || line.trim_start().starts_with('#');
            let lines = DOCUMENTED[begin..].lines().enumerate().take_while(of_key);
            lines.map(|(_, line)| line.split_once('#').unwrap().1.trim()).collect::<Vec<_>>().join(" ")
        };
        assert!(comment("multiplier").contains("the trigger's threshold is above the baseline"));
        assert!(comment("margin").contains("the trigger's threshold is at least this far above the baseline"));
        assert!(comment("threshold").starts_with("not the trigger's threshold: only laws of durations"));
    }

    #[test]
    fn a_law_of_durations_leaves_the_trigger_as_it_was_published() {
        let published = Config::parse("[speed]\nlaw = \"published\"").unwrap();
        assert_eq!(published.trigger().unwrap(), TriggerConfig::default());
        let durations = SpeedConfig::published(FrameRate::NOMINAL);
        assert_eq!(law(&published), AnyLaw::Duration(durations));
        assert_eq!(published.durations(FrameRate::NOMINAL).unwrap(), durations);
    }

    #[test]
    fn a_configuration_in_full_is_the_same_again() {
        let corners: Vec<String> = (0..25).map(|k| format!("[{}, {}]", 10 + 6 * (k % 5), 20 + 7 * (k / 5))).collect();
        let row = |own: usize| {
            (0..25).map(move |k| ["0", "0.05", "1"][usize::from(k + 1 == own) + 2 * usize::from(k == own)])
        };
        let rows: Vec<_> = (0..25).map(|own| format!("[{}]", row(own).collect::<Vec<_>>().join(", "))).collect();
        let mixed = format!("[layout]\ncrosstalk = [{}]", rows.join(", "));
        assert!(Config::parse(&mixed).unwrap().layout.correction().is_some());
        let explicit = format!("[layout]\nframe = [1280, 720]\ntaxel = [5, 6]\ncorners = [{}]", corners.join(", "));
        for text in [
            "",
            &explicit,
            "[green]\nyuv = \"linear\"\nstride = 3\n[features]\nln = \"libm\"\nfloor_levels = 0.1",
            "[trigger]\nrule = \"literal\"\nmultiplier = 0.7\nwindow = 7\n[speed]\nlaw = \"published\"\nintercept = 101.3",
            "[speed]\nlaw = \"published\"\nslope = 56.123\nthreshold_on = \"above_baseline\"",
            "[trigger]\nfollow = 64\n[speed]\nlaw = \"published\"\nrange_mm_s = [80.1, 212.5]",
            "[sensor]\npitch_mm = 3.5\n[speed]\nestimator = \"edges\"",
            &mixed,
        ] {
            let config = Config::parse(text).unwrap();
            let full = config.to_toml().unwrap();
            let again = Config::parse(&full).unwrap();
            assert_eq!((again.to_toml().unwrap().as_str(), full.contains("floor_levels = ")), (full.as_str(), true));
            let frame = FrameSize::new(1280, 720).unwrap();
            assert_eq!(again.layout(frame), config.layout(frame), "{full}");
            assert_eq!(again.layout.frame, config.layout.frame, "{full}");
            assert_eq!(again.layout.correction(), config.layout.correction(), "{full}");
            assert_eq!(again.trigger(), config.trigger(), "{full}");
            assert_eq!(format!("{:?}", again.following()), format!("{:?}", config.following()), "{full}");
            assert_eq!(config.following().unwrap().is_some(), text.contains("follow"), "{full}");
            assert_eq!(law(&again), law(&config), "{full}");
            assert_eq!(again.durations(FrameRate::NOMINAL), config.durations(FrameRate::NOMINAL), "{full}");
            let rest = |config: &Config| format!("{:?} {:?} {:?}", config.green, config.features, config.direction);
            assert_eq!(rest(&again), rest(&config), "{full}");
        }
    }

    #[test]
    fn the_published_law_keeps_its_earlier_name() {
        let text = |law: &str| format!("[speed]\nlaw = \"{law}\"\nintercept = 140.5");
        let [earlier, now] = ["paper", "published"].map(|law| Config::parse(&text(law)).unwrap().to_toml().unwrap());
        assert_eq!(earlier, now);
        assert!(now.contains("law = \"published\""), "{now}");
    }

    #[test]
    fn errors_name_the_key_what_was_found_and_what_was_expected() {
        for (text, parts) in [
            ("[trigger]\nwindw = 5", vec!["windw", "window"]),
            ("[trigger]\nwindow = 0", vec!["[trigger]", "window is 0", "1 to 70"]),
            ("[trigger]\nwindow = \"five\"", vec!["[trigger] window: found \"five\", expected a whole number"]),
            ("[trigger]\nmultiplier = 0.9", vec!["multiplier is 0.9", "signed"]),
            ("[trigger]\nmultiplier = nan", vec!["multiplier is NaN"]),
            ("[trigger]\nbacktrack = 26", vec!["backtrack is 26", "25"]),
            ("[trigger]\nfollow = 100", vec!["[trigger]", "follow is 100 windows", "power of two from 16 to 32768"]),
            ("[trigger]\nfollow = 65536", vec!["follow is 65536 windows"]),
            ("[trigger]\nfollow = -1", vec!["follow", "-1"]),
            (
                "[speed]\nlaw = \"published\"\nrange_mm_s = [200, 100]",
                vec!["[speed]", "range_mm_s is [200, 100]", "slowest"],
            ),
            ("[speed]\nlaw = \"published\"\nrange_mm_s = [0, 100]", vec!["range_mm_s is [0, 100]", "above 0"]),
            ("[speed]\nlaw = \"published\"\nrange_mm_s = [1, inf]", vec!["range_mm_s is [1, inf]"]),
            ("[speed]\nlaw = \"published\"\nrange_mm_s = [1]", vec!["range_mm_s", "list of 1"]),
            ("[green]\nstride = 4", vec!["stride is 4", "1, 2, 3 or 5"]),
            ("[green]\nyuv = \"fast\"", vec!["fast", "exact"]),
            ("[features]\nfloor_levels = -1", vec!["floor_levels is -1"]),
            ("[speed]\nthreshold = inf", vec!["threshold is inf"]),
            ("[speed]\nlaw = \"published\"\nslope = 0", vec!["slope is 0"]),
            ("[speed]\nslope = 4.0", vec!["[speed] slope needs law = \"published\"", "found law = \"arrival\""]),
            ("[speed]\nrange_mm_s = [1, 2]", vec!["range_mm_s needs law = \"published\""]),
            ("[speed]\nlaw = \"published\"\nestimator = \"edges\"", vec!["estimator needs law = \"arrival\""]),
            (
                "[speed]\ntrack_mm = 9.0\nlaw = \"physical\"",
                vec!["has law = \"physical\"", "removed", "help: law = \"arrival\""],
            ),
            ("[speed]\nafterglow_frames = 5.0", vec!["[speed] has afterglow_frames", "\"arrival\" or \"published\""]),
            ("[speed]\nestimator = \"fast\"", vec!["fast", "coherence"]),
            ("[speed]\nlaw = \"fast\"", vec!["fast", "arrival", "published"]),
            ("[sensor]\npitch_mm = 0", vec!["[sensor]", "0", "above 0"]),
            ("[sensor]\nreadout_ms = -1001", vec!["[sensor] readout_ms is -1001", "-1000 to 1000"]),
            ("[sensor]\nreadout_ms = nan", vec!["[sensor] readout_ms is NaN", "-1000 to 1000"]),
            ("[layout]\npreset = \"paper\"\ntaxel = [5, 5]", vec!["preset"]),
            ("[layout]\ntaxel = [5, 5]\ncorners = [[0, 0]]", vec!["corners has 1", "25"]),
            ("[layout]\ntaxel = [5, 5, 9]\ncorners = []", vec!["taxel has 3", "width and height"]),
            ("[layout]\ncrosstalk = [[1]]", vec!["[layout] crosstalk has 1 row,", "25 rows of 25 numbers"]),
            ("[layout]\ntaxel = 5", vec!["taxel", "a list"]),
            ("layout = 5", vec!["layout", "a table"]),
            ("[layout]\nframe = [5]", vec!["frame", "list of 1"]),
            ("[layout", vec!["TOML"]),
        ] {
            let error = Config::parse(text).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Config, "{text:?}");
            let message = error.message();
            for part in parts {
                assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
            }
        }
    }
}
