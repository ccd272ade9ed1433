//! The `[sensor]` table of a scene.
//!
//! ```toml
//! size = [1280, 720]     # width and height in pixels
//! fps = 30               # frames per second, also "30000/1001"
//! format = "GREY"        # a four-character code: GREY, Y10, RGB3, YUYV, NV12, RGGB, MJPG …
//! matrix = "bt601"       # matrix of YCbCr formats: "bt601" or "bt709"
//! range = "limited"      # range of YCbCr formats: "limited" or "full"
//! quality = 85           # quality of JPEG pictures, 1 to 100
//! readout_ms = 0.0       # time from the first to the last row; below 0 if the last is first
//! exposure = 1.0         # fraction of the frame interval during which the shutter is open
//! full_well = 25500.0    # electrons at full scale at a gain of 1
//! read_noise = 60.0      # electrons rms
//! black_level = 1.0      # in 1/255 of full scale
//! gain = 1.0             # analog gain
//! blur = 0.0             # deviation of the point spread, in pixels
//! noise = 1.0            # scale of the noise, 0 for none
//! dropped = 0.0          # fraction of frames that the driver drops
//! auto_exposure = false  # whether the camera lengthens its exposure in the dark
//! ```
//!
//! If the camera does not look straight on, there is also a table `[sensor.pose]`: [`Pose`].

use serde::Deserialize;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_host::source::option_text::frame_rate;
use wstac_host::text_file::whole_if_any;

use super::format::SensorFormat;
use super::pose::Pose;
use crate::keys::{key_table, within};

key_table! {
    /// A checked `[sensor]` table.
    #[derive(Clone, Debug, PartialEq, Deserialize)]
    #[serde(try_from = "Keys")]
    pub struct SensorConfig {
        /// Width and height of the frames (paper: 1280 × 720).
        pub size: FrameSize = DEFAULT_SIZE;
        /// Frames per second (paper: 30).
        pub rate: FrameRate = FrameRate::NOMINAL;
        /// Pixel format.
        pub format: SensorFormat = SensorFormat::GREY;
        /// Matrix and range; they matter only for YCbCr formats.
        pub color: YcbcrEncoding = YcbcrEncoding::default();
        /// JPEG quality, 1..=100; it matters only for JPEG pictures.
        pub quality: u8 = 85;
        /// Time from the first to the last row of the picture in ms, at most a frame interval: 0 for a global shutter,
        /// below 0 if the last row comes first.
        pub readout_ms: f64 = 0.0;
        /// Fraction of the frame interval during which the shutter is open, 0.01..=1.
        ///
        /// The sensor itself takes light that is already integrated.
        pub exposure: f64 = 1.0, in 0.01..=1.0;
        /// Electrons at full scale at a gain of 1, 1..=1e9 (a guess: 100 for each level of 255).
        pub full_well: f64 = 25_500.0, in 1.0..=1e9;
        /// Standard deviation of the read noise in electrons, at the pixel, 0..=1e6 (a guess: 0.6 of a level of 255).
        pub read_noise: f64 = 60.0, in 0.0..=1e6;
        /// Value of a pixel without light, in 1/255 of full scale, 0..=128.
        ///
        /// The default is a guess: below the speed law's threshold, as the paper's camera must be.
        pub black_level: f64 = 1.0, in 0.0..=128.0;
        /// Analog gain, 1..=1000.
        pub gain: f64 = 1.0, in 1.0..=1000.0;
        /// Standard deviation of the point spread in pixels, 0..=100.
        pub blur: f64 = 0.0, in 0.0..=100.0;
        /// Scale of all random deviations of the sensor, 0..=10 000; 0 for none.
        pub noise: f64 = 1.0, in 0.0..=10_000.0;
        /// Fraction of frames that the driver drops at random, 0..=0.9; the caller drops them.
        pub dropped: f64 = 0.0, in 0.0..=0.9;
        /// `true` if the camera lengthens its exposure in the dark: `AutoExposure`.
        pub auto_exposure: bool = false;
        /// The camera's pose, or `None` if it looks straight on; then only the pixels under whiskers are computed.
        pub pose: Option<Pose> = None;
    }
}

const DEFAULT_SIZE: FrameSize = match FrameSize::new(1280, 720) {
    Ok(size) => size,
    // Unreachable: evaluated at compile time.
    Err(_) => panic!(),
};

/// The table before it is checked.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
struct Keys {
    #[serde(deserialize_with = "whole_if_any")]
    size: Option<[i64; 2]>,
    fps: Option<Rate>,
    format: Option<String>,
    matrix: Option<String>,
    range: Option<String>,
    quality: Option<i64>,
    readout_ms: Option<f64>,
    exposure: Option<f64>,
    full_well: Option<f64>,
    read_noise: Option<f64>,
    black_level: Option<f64>,
    gain: Option<f64>,
    blur: Option<f64>,
    noise: Option<f64>,
    dropped: Option<f64>,
    auto_exposure: Option<bool>,
    pose: Option<Pose>,
}

/// Frames per second as a file states them.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number of frames per second, or a fraction such as \"30000/1001\"")]
enum Rate {
    Number(f64),
    Text(String),
}

impl Rate {
    fn checked(self) -> Result<FrameRate, String> {
        match self {
            Self::Number(number) => checked_rate(number),
            Self::Text(text) => {
                let rate = frame_rate(&text).map_err(|why| format!("fps is {why}"))?;
                checked_rate(rate.per_second()).map(|_| rate)
            }
        }
    }
}

impl TryFrom<Keys> for SensorConfig {
    type Error = String;

    /// Checks the table; an error names the key, the value found and the values expected.
    fn try_from(keys: Keys) -> Result<Self, String> {
        let default = Self::default();
        let config = Self {
            size: keys.size.map_or(Ok(default.size), checked_size)?,
            rate: keys.fps.map_or(Ok(default.rate), Rate::checked)?,
            format: keys.format.map_or(Ok(default.format), |format| format.parse())?,
            color: YcbcrEncoding {
                matrix: one_of("matrix", keys.matrix, [("bt601", YcbcrMatrix::Bt601), ("bt709", YcbcrMatrix::Bt709)])?,
                range: one_of(
                    "range",
                    keys.range,
                    [("limited", QuantizationRange::Limited), ("full", QuantizationRange::Full)],
                )?,
            },
            quality: keys.quality.map_or(Ok(default.quality), checked_quality)?,
            readout_ms: keys.readout_ms.unwrap_or(default.readout_ms),
            exposure: keys.exposure.unwrap_or(default.exposure),
            full_well: keys.full_well.unwrap_or(default.full_well),
            read_noise: keys.read_noise.unwrap_or(default.read_noise),
            black_level: keys.black_level.unwrap_or(default.black_level),
            gain: keys.gain.unwrap_or(default.gain),
            blur: keys.blur.unwrap_or(default.blur),
            noise: keys.noise.unwrap_or(default.noise),
            dropped: keys.dropped.unwrap_or(default.dropped),
            auto_exposure: keys.auto_exposure.unwrap_or(default.auto_exposure),
            pose: keys.pose,
        };
        config.check()?;
        Ok(config)
    }
}

impl SensorConfig {
    /// Checks the ranges that the types leave open: every field's description states its range.
    ///
    /// # Errors
    /// A value is out of range; the message names the key, the value found and the values expected.
    pub fn check(&self) -> Result<(), String> {
        checked_quality(self.quality.into())?;
        // To a tenth of a millisecond, since a rate of 30 per second leaves 33.3 ms.
        let most = libm::ceil(10_000.0 * f64::from(self.rate.denominator()) / f64::from(self.rate.numerator())) / 10.0;
        within("readout_ms", self.readout_ms, -most, most)?;
        if self.readout_ms != 0.0 && self.pose.is_some() {
            return Err(format!("readout_ms is {}, expected 0 with [sensor.pose]", self.readout_ms));
        }
        self.check_ranges()?;
        self.pose.map_or(Ok(()), |pose| pose.check())
    }
}

fn checked_quality(found: i64) -> Result<u8, String> {
    let quality = u8::try_from(found).ok().filter(|quality| (1..=100).contains(quality));
    quality.ok_or_else(|| format!("quality is {found}, expected 1 to 100"))
}

fn checked_size([width, height]: [i64; 2]) -> Result<FrameSize, String> {
    let size = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    let size = size.and_then(|(width, height)| FrameSize::new(width, height).ok());
    size.ok_or_else(|| format!("size is [{width}, {height}], expected width and height of 1 to 16384 pixels"))
}

/// Highest rate of a `[sensor]` table, in frames per second.
const HIGHEST_RATE: f64 = 10_000.0;

/// Returns the exact rate for a number in a file.
///
/// A rate that is written rounded, such as 29.97, stands for its exact fraction. Other rates are rounded to a
/// thousandth.
fn checked_rate(found: f64) -> Result<FrameRate, String> {
    let expected = || format!("fps is {found}, expected 1 to {HIGHEST_RATE} frames per second");
    if !(1.0..=HIGHEST_RATE).contains(&found) {
        return Err(expected());
    }
    let whole = libm::round(found * 1.001);
    let is_ntsc = libm::round(found) < whole + 0.5 && libm::fabs(whole / 1.001 - found) < 0.005 && found < 1000.0;
    let (numerator, denominator) = if libm::fabs(found - libm::round(found)) < 0.0005 {
        (libm::round(found) as u32, 1)
    } else if is_ntsc {
        (whole as u32 * 1000, 1001)
    } else {
        (libm::round(found * 1000.0) as u32, 1000)
    };
    FrameRate::new(numerator, denominator).map_err(|_| expected())
}

/// Returns the value of a name, or the default if there is no name.
fn one_of<T: Default>(key: &str, found: Option<String>, named: [(&str, T); 2]) -> Result<T, String> {
    let Some(found) = found else { return Ok(T::default()) };
    let expected = format!("{key} is {found:?}, expected {:?} or {:?}", named[0].0, named[1].0);
    named.into_iter().find(|(name, _)| *name == found).map(|(_, value)| value).ok_or(expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<SensorConfig, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn the_documented_values_are_the_defaults() {
        let source = include_str!("config.rs");
        let lines = source.lines().skip_while(|line| *line != "//! ```toml").skip(1);
        let table: String = lines
            .map_while(|line| line.strip_prefix("//! "))
            .take_while(|line| *line != "```")
            .fold(String::new(), |table, line| table + line + "\n");
        assert_eq!(table.lines().count(), 16);
        assert_eq!(read(&table).unwrap(), SensorConfig::default());
        assert_eq!(read("").unwrap(), SensorConfig::default());
    }

    #[test]
    fn keys_are_read() {
        let config = read("size = [100, 80]\nfps = 60\nformat = \"Y12\"\nrange = \"full\"\ngain = 2").unwrap();
        assert_eq!((config.size.width(), config.rate), (100, FrameRate::new(60, 1).unwrap()));
        assert_eq!((config.format.code(), config.color.range), (*b"Y12 ", QuantizationRange::Full));
        assert!((config.gain - 2.0).abs() < 1e-12);
    }

    #[test]
    fn rates_are_what_they_stand_for() {
        for (fps, expected) in [
            (30.0, (30, 1)),
            (29.97, (30_000, 1001)),
            (59.94, (60_000, 1001)),
            (23.976, (24_000, 1001)),
            (119.88, (120_000, 1001)),
            (12.5, (12_500, 1000)),
            (7.5, (7500, 1000)),
            (1.0, (1, 1)),
            (10_000.0, (10_000, 1)),
        ] {
            assert_eq!(<(u32, u32)>::from(checked_rate(fps).unwrap()), expected, "{fps}");
        }
        let rate = |text: &str| read(text).unwrap().rate;
        assert_eq!(rate("fps = \"30000/1001\""), rate("fps = 29.97"));
        assert_eq!(rate("fps = \"30\""), FrameRate::NOMINAL);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, parts) in [
            ("color = 1", ["color", "format"]),
            ("size = [0, 5]", ["size is [0, 5]", "1 to 16384"]),
            ("size = [-1, 5]", ["size is [-1, 5]", "1 to 16384"]),
            ("size = [1]", ["size", "2"]),
            ("fps = 0", ["fps is 0", "1 to 10000"]),
            ("fps = nan", ["fps is NaN", "1 to 10000"]),
            ("fps = \"1/2\"", ["fps is 0.5", "1 to 10000"]),
            ("fps = \"fast\"", ["fps is \"fast\"", "30000/1001"]),
            ("fps = true", ["a number of frames per second", "30000/1001"]),
            ("format = \"H264\"", ["format is \"H264\"", "YUYV"]),
            ("matrix = \"bt2020\"", ["matrix is \"bt2020\"", "\"bt601\" or \"bt709\""]),
            ("range = \"wide\"", ["range is \"wide\"", "\"limited\" or \"full\""]),
            ("quality = 0", ["quality is 0", "1 to 100"]),
            ("quality = 357", ["quality is 357", "1 to 100"]),
            ("exposure = 0", ["exposure is 0", "0.01 to 1"]),
            ("full_well = 0", ["full_well is 0", "expected 1 to"]),
            ("readout_ms = 34", ["readout_ms is 34", "-33.4 to 33.4"]),
            ("readout_ms = -20\n[pose]\nscale = 1", ["readout_ms is -20", "0 with [sensor.pose]"]),
            ("read_noise = -1", ["read_noise is -1", "0 to 1000000"]),
            ("black_level = 200", ["black_level is 200", "0 to 128"]),
            ("gain = 0.5", ["gain is 0.5", "1 to 1000"]),
            ("blur = inf", ["blur is inf", "0 to 100"]),
            ("noise = nan", ["noise is NaN", "0 to 100"]),
            ("dropped = 1", ["dropped is 1", "0 to 0.9"]),
            ("auto_exposure = 1", ["auto_exposure", "boolean"]),
            ("[pose]\nscale = 0", ["pose scale is 0", "0.1 to 10"]),
            ("[pose]\nroll = 0", ["roll", "rotation_degrees"]),
        ] {
            let message = read(text).unwrap_err();
            for part in parts {
                assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
            }
        }
    }
}
