//! Errors of configurations and of frames: one variant for each cause.
//!
//! Whatever builds a part of the pipeline returns a [`ConfigError`]. Whatever takes a frame or a stripe returns a
//! [`FrameError`]. A function that does both returns an [`Error`], into which `?` turns them.

use core::fmt;

/// The reason why a layout, a window, a threshold, a law or another part of a configuration cannot be used.
///
/// Every variant names what was found and what was expected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ConfigError {
    /// A frame's width or height is outside 1..=16384 pixels.
    FrameSize {
        /// Width found, in pixels.
        width: u32,
        /// Height found, in pixels.
        height: u32,
    },
    /// A taxel holds no pixel: the frame is too small for the paper layout, or a side is 0.
    EmptyTaxel {
        /// Width found, in pixels.
        width: u32,
        /// Height found, in pixels.
        height: u32,
    },
    /// A taxel reaches outside the frame.
    TaxelOutside {
        /// The taxel's number, counted row by row from 0.
        taxel: u8,
        /// The taxel's right and bottom end (exclusive), in pixels.
        end: (u32, u32),
        /// Width and height of the frame, in pixels.
        frame: (u16, u16),
    },
    /// 5 · A · G · (frames added up) does not fit 32 bits.
    SumTooLarge {
        /// Pixels counted in a taxel, A.
        pixels: u32,
        /// Green full scale, G.
        full_scale: u32,
        /// Consecutive frames added up.
        frames: u32,
    },
    /// The pixel stride is not 1, 2, 3 or 5.
    Stride(u32),
    /// There are fewer bytes from row to row than a row of pixels needs.
    BytesPerRow {
        /// Bytes found.
        found: u32,
        /// Least bytes expected.
        expected: u32,
    },
    /// The frame rate is zero or has a zero denominator.
    FrameRate {
        /// Numerator found.
        numerator: u32,
        /// Denominator found.
        denominator: u32,
    },
    /// The window has 0 frames, or more than a sample has.
    Window(u32),
    /// The backtrack is longer than the baseline (5m), or it does not leave room for the window (l − m).
    Backtrack {
        /// Frames found.
        found: u32,
        /// Most frames allowed.
        most: u32,
    },
    /// The multiplier is not a number from 0 (rule `signed`: from 1) to below 65536.
    Multiplier(f64),
    /// The margin is not a number from 0 to below 65536.
    Margin(f64),
    /// The time constant of a tracking baseline, in windows, is not a power of two from 16 to 32768.
    TrackingBaseline(u32),
    /// The floor levels are not a number from 0 to full scale.
    FloorLevels(f64),
    /// The darkness floor is for pixels of another green full scale.
    FloorFullScale {
        /// Full scale that the floor is for.
        found: u32,
        /// Full scale of the camera's pixels.
        expected: u32,
    },
    /// The speed threshold is not a number above 0 and at most 5.
    SpeedThreshold(f64),
    /// The distance between whiskers is not a number above 0 and at most 1000 mm.
    Pitch(f32),
    /// The speeds that a law was fitted on are not a range of finite numbers above 0, slowest first.
    FittedRange {
        /// Slowest found, in mm/s.
        slowest: f32,
        /// Fastest found, in mm/s.
        fastest: f32,
    },
    /// A parameter of a speed law is not finite, or not above zero although it must be.
    SpeedLaw {
        /// The parameter.
        parameter: LawParameter,
        /// Number found.
        found: f32,
    },
}

/// A parameter of a speed law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum LawParameter {
    /// The frames at 1 mm/s.
    Intercept,
    /// The frames per decade.
    Slope,
}

/// The reason why a frame or a stripe was not taken.
///
/// Every variant names what was found and what was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum FrameError {
    /// A frame's bytes end before its last row.
    FrameTooShort {
        /// Bytes found.
        found: usize,
        /// Least bytes expected.
        expected: usize,
    },
    /// A stripe does not consist of whole rows.
    StripeNotWholeRows {
        /// Bytes found.
        found: usize,
        /// Bytes from row to row.
        bytes_per_row: usize,
    },
    /// A stripe has more rows than the frame has left.
    StripeTooLong {
        /// Rows found.
        found: usize,
        /// Rows left in the frame.
        left: usize,
    },
    /// A stripe has a planar format, whose chroma follows all its luma. Such formats take whole frames only.
    StripeOfPlanar,
    /// A whole frame arrived while a frame was under way in stripes.
    FrameUnderWay {
        /// Rows of that frame that have arrived.
        rows: u16,
    },
}

/// The error of a function that both builds a pipeline and pushes frames.
///
/// No function of this crate returns it. It is for functions of yours, on machines without `Box<dyn Error>`.
///
/// ```
/// use wstac_core::{error::Error, green::gray::Gray, layout::{FrameSize, Layout}};
/// use wstac_core::{rate::FrameRate, taxels::{FrameGeometry, TaxelSums}};
///
/// fn sums(frame: &[u8]) -> Result<[u32; 25], Error> {
///     let layout = Layout::paper(FrameSize::new(400, 400)?)?;
///     Ok(TaxelSums::new(FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?).push_frame(frame)?)
/// }
///
/// assert!(matches!(sums(&[7; 400]), Err(Error::Frame(_))));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Error {
    /// A configuration cannot be used.
    Config(ConfigError),
    /// A frame or a stripe was not taken.
    Frame(FrameError),
}

impl From<ConfigError> for Error {
    fn from(error: ConfigError) -> Self {
        Self::Config(error)
    }
}

impl From<FrameError> for Error {
    fn from(error: FrameError) -> Self {
        Self::Frame(error)
    }
}

/// Returns the ending of a noun: of a single one, or of several.
const fn s(single: bool) -> &'static str {
    if single { "" } else { "s" }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::FrameSize { width, height } => {
                write!(f, "frame size is {width}x{height}, expected 1 to 16384 pixels each way")
            }
            Self::EmptyTaxel { width, height } => write!(
                f,
                "taxel size is {width}x{height}, expected at least one pixel (for Bayer formats two) each way"
            ),
            Self::TaxelOutside { taxel, end, frame } => write!(
                f,
                "taxel {taxel} ends at ({}, {}), expected inside the {}x{} frame",
                end.0, end.1, frame.0, frame.1
            ),
            Self::SumTooLarge { pixels, full_scale, frames } => write!(
                f,
                "5 taxels of {pixels} counted pixels at full scale {full_scale} over {frames} frame{} do not fit 32 bits, \
                 expected at most 4294967295",
                s(frames == 1)
            ),
            Self::Stride(found) => write!(f, "stride is {found}, expected 1, 2, 3 or 5"),
            Self::BytesPerRow { found, expected } => {
                write!(f, "bytes per row are {found}, expected at least {expected}")
            }
            Self::FrameRate { numerator, denominator } => {
                write!(f, "frame rate is {numerator}:{denominator}, expected above 0")
            }
            Self::Window(found) => write!(f, "window is {found} frames, expected 1 to 70"),
            Self::Backtrack { found, most } => {
                write!(f, "backtrack is {found} frame{}, expected at most {most} for this window", s(found == 1))
            }
            Self::Multiplier(found) => {
                write!(f, "multiplier is {found}, expected 0 to below 65536, and at least 1 with rule \"signed\"")
            }
            Self::Margin(found) => write!(f, "margin is {found}, expected 0 to below 65536"),
            Self::TrackingBaseline(found) => {
                write!(f, "follow is {found} window{}, expected a power of two from 16 to 32768", s(found == 1))
            }
            Self::FloorFullScale { found, expected } => {
                write!(f, "the darkness floor is for a full scale of {found}, expected {expected}")
            }
            Self::FloorLevels(found) => {
                write!(f, "floor_levels is {found}, expected 0 to the full scale of the pixel format")
            }
            Self::SpeedThreshold(found) => {
                write!(f, "speed threshold is {found}, expected above 0 and at most 5")
            }
            Self::Pitch(found) => write!(f, "pitch_mm is {found}, expected above 0 and at most 1000"),
            Self::FittedRange { slowest, fastest } => {
                write!(f, "range_mm_s is [{slowest}, {fastest}], expected the slowest speed, above 0, then the fastest")
            }
            Self::SpeedLaw { parameter, found } => match parameter {
                LawParameter::Intercept => write!(f, "intercept is {found}, expected a finite number"),
                LawParameter::Slope => write!(f, "slope is {found}, expected a finite number above 0"),
            },
        }
    }
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::FrameTooShort { found, expected } => {
                write!(f, "frame has {found} byte{}, expected at least {expected}", s(found == 1))
            }
            Self::StripeNotWholeRows { found, bytes_per_row } => {
                write!(f, "stripe has {found} byte{}, expected whole rows of {bytes_per_row}", s(found == 1))
            }
            Self::StripeTooLong { found, left } => {
                write!(
                    f,
                    "stripe has {found} row{}, expected at most the {left} that the frame has left",
                    s(found == 1)
                )
            }
            Self::StripeOfPlanar => f.write_str("stripe of a planar format, expected whole frames"),
            Self::FrameUnderWay { rows } => {
                write!(f, "whole frame after {rows} row{} of a frame in stripes, expected the rest of it", s(rows == 1))
            }
        }
    }
}

/// Writes the error that it holds.
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Config(error) => error.fmt(f),
            Self::Frame(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ConfigError {}
impl core::error::Error for FrameError {}
impl core::error::Error for Error {}
