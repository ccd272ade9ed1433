//! The results of calls, and their texts.

use core::ffi::{CStr, c_char};

use wstac_core::error::{ConfigError, FrameError};
use wstac_core::model::file::ModelError;

/// The result of a call. Errors are below 0; then nothing has changed, and nothing was written.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WstacFwStatus {
    /// Done.
    Ok = 0,
    /// Done, and an event is complete. Ask for it before the next push.
    Event = 1,
    /// Done, but the requested value does not exist.
    None = 2,
    /// A pointer is null.
    Null = -1,
    /// The memory is too small, or not aligned.
    Memory = -2,
    /// The pipeline or model has not been set up, or the call does not fit what it has done.
    State = -3,
    /// The format is not one of this library's.
    Format = -4,
    /// Width or height is out of range.
    FrameSize = -5,
    /// A taxel holds no pixel.
    EmptyTaxel = -6,
    /// A taxel reaches outside the frame.
    TaxelOutside = -7,
    /// Sums do not fit 32 bits, because taxels are too large.
    SumTooLarge = -8,
    /// The stride is unknown.
    Stride = -9,
    /// Bytes per row are too few.
    BytesPerRow = -10,
    /// The frame rate is zero.
    FrameRate = -11,
    /// A frame has too few bytes.
    FrameTooShort = -12,
    /// A stripe is not whole rows.
    StripeNotWholeRows = -13,
    /// A stripe has more rows than the frame has left.
    StripeTooLong = -14,
    /// A stripe has a planar format.
    StripeOfPlanar = -15,
    /// A whole frame arrived while one is under way in stripes.
    FrameUnderWay = -16,
    /// The window is out of range.
    Window = -17,
    /// The backtrack is too long.
    Backtrack = -18,
    /// The multiplier is out of range.
    Multiplier = -19,
    /// The margin is out of range.
    Margin = -20,
    /// The time constant of a tracking baseline is out of range.
    Follow = -21,
    /// Floor levels are out of range.
    FloorLevels = -22,
    /// The speed threshold is out of range.
    SpeedThreshold = -23,
    /// The fitted speeds are not a range.
    FittedRange = -24,
    /// A parameter of the speed law is out of range.
    SpeedLaw = -25,
    /// The bytes are not a model file.
    ModelMagic = -26,
    /// The model file is of another version.
    ModelVersion = -27,
    /// The model file is cut off, or has too many bytes.
    ModelLength = -28,
    /// The model file is damaged.
    ModelChecksum = -29,
    /// The model file's bytes are not aligned to four.
    ModelAlignment = -30,
    /// The model file has impossible content.
    ModelContent = -31,
    /// The parameters have another fault.
    Other = -32,
    /// The distance between neighboring whiskers is out of range.
    Pitch = -33,
    /// A choice is neither 0 nor 1.
    Choice = -34,
    /// The model takes another sample than that over time.
    ModelInput = -35,
    /// A text is not UTF-8, or has no 0 at its end.
    Text = -36,
}

/// A choice of a program: 0 or 1, `false` or `true`. Any other byte is refused.
pub type WstacFwBool = u8;

/// Returns a choice of a program.
///
/// # Errors
/// Returns a status if the byte is neither 0 nor 1.
pub(crate) fn choice(byte: WstacFwBool) -> Result<bool, WstacFwStatus> {
    match byte {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(WstacFwStatus::Choice),
    }
}

/// The text of every status.
const TEXTS: [(WstacFwStatus, &CStr); 39] = {
    use WstacFwStatus as S;
    [
        (S::Ok, c"done"),
        (S::Event, c"done, and an event is complete"),
        (S::None, c"done, and there is nothing to give"),
        (S::Null, c"a pointer is null, expected memory"),
        (S::Memory, c"the memory is too small or not aligned, expected the size and alignment of its type in wstac_fw.h"),
        (S::State, c"the call does not fit: not set up yet, started or ended already, or no event to ask for"),
        (S::Format, c"format is none of this library's, expected the address of a WSTAC_FW_ format"),
        (S::FrameSize, c"width or height is out of range, expected 1 to 16384 pixels"),
        (S::EmptyTaxel, c"a taxel holds no pixel, expected at least one pixel (for Bayer formats two) each way"),
        (S::TaxelOutside, c"a taxel reaches outside the frame, expected all 25 inside"),
        (S::SumTooLarge, c"5 taxels at full scale over the frames added up do not fit 32 bits, expected smaller taxels or a larger stride"),
        (S::Stride, c"stride is unknown, expected 1, 2, 3 or 5"),
        (S::BytesPerRow, c"bytes per row are too few, expected at least those of a row of pixels"),
        (S::FrameRate, c"frame rate is zero, expected numerator and denominator above 0"),
        (S::FrameTooShort, c"the frame has too few bytes, expected all of its rows"),
        (S::StripeNotWholeRows, c"the stripe ends within a row, expected whole rows"),
        (S::StripeTooLong, c"the stripe has more rows than the frame has left, expected at most those"),
        (S::StripeOfPlanar, c"stripe of a planar format, expected whole frames"),
        (S::FrameUnderWay, c"whole frame while one is under way in stripes, expected the rest of it"),
        (S::Window, c"window is out of range, expected 1 to 70 frames"),
        (S::Backtrack, c"backtrack is too long, expected at most 5 windows, and with a window at most 70 frames"),
        (S::Multiplier, c"multiplier is out of range, expected 0 to below 65536, and at least 1 with the signed rule"),
        (S::Margin, c"margin is out of range, expected 0 to below 65536"),
        (S::Follow, c"follow is out of range, expected 0, or a power of two from 16 to 32768 windows"),
        (S::FloorLevels, c"floor levels are out of range, expected 0 to the full scale of the format"),
        (S::SpeedThreshold, c"speed threshold is out of range, expected above 0 and at most 5"),
        (S::FittedRange, c"fitted speeds are no range, expected the slowest, above 0, then the fastest"),
        (S::SpeedLaw, c"a parameter of the speed law is out of range, expected finite numbers, slope and track above 0"),
        (S::ModelMagic, c"the model does not start with WSM1, expected the bytes of a .wsm file"),
        (S::ModelVersion, c"the model is of another version, expected WSM1: import it again"),
        (S::ModelLength, c"the model is cut off or has bytes too many, expected the length that its header says"),
        (S::ModelChecksum, c"the model's checksum is wrong: it is damaged"),
        (S::ModelAlignment, c"the model's bytes are not whole words aligned to four, or this machine is not little-endian"),
        (S::ModelContent, c"the model says something impossible: it was not made by wstac model import"),
        (S::Pitch, c"pitch is out of range, expected 0, or above 0 and at most 1000 mm"),
        (S::ModelInput, c"the model takes another sample, expected a model of frames"),
        (S::Text, c"a text is not UTF-8, or has no 0 at its end"),
        (S::Choice, c"a choice is neither 0 nor 1, expected false or true"),
        (S::Other, c"the parameters do not fit each other"),
    ]
};

impl From<ConfigError> for WstacFwStatus {
    fn from(error: ConfigError) -> Self {
        match error {
            ConfigError::FrameSize { .. } => Self::FrameSize,
            ConfigError::EmptyTaxel { .. } => Self::EmptyTaxel,
            ConfigError::TaxelOutside { .. } => Self::TaxelOutside,
            ConfigError::SumTooLarge { .. } => Self::SumTooLarge,
            ConfigError::Stride(_) => Self::Stride,
            ConfigError::BytesPerRow { .. } => Self::BytesPerRow,
            ConfigError::FrameRate { .. } => Self::FrameRate,
            ConfigError::Window(_) => Self::Window,
            ConfigError::Backtrack { .. } => Self::Backtrack,
            ConfigError::Multiplier(_) => Self::Multiplier,
            ConfigError::Margin(_) => Self::Margin,
            ConfigError::TrackingBaseline(_) => Self::Follow,
            ConfigError::FloorLevels(_) => Self::FloorLevels,
            ConfigError::SpeedThreshold(_) => Self::SpeedThreshold,
            ConfigError::FittedRange { .. } => Self::FittedRange,
            ConfigError::SpeedLaw { .. } => Self::SpeedLaw,
            ConfigError::Pitch(_) => Self::Pitch,
            _ => Self::Other,
        }
    }
}

impl From<FrameError> for WstacFwStatus {
    fn from(error: FrameError) -> Self {
        match error {
            FrameError::FrameTooShort { .. } => Self::FrameTooShort,
            FrameError::StripeNotWholeRows { .. } => Self::StripeNotWholeRows,
            FrameError::StripeTooLong { .. } => Self::StripeTooLong,
            FrameError::StripeOfPlanar => Self::StripeOfPlanar,
            FrameError::FrameUnderWay { .. } => Self::FrameUnderWay,
            _ => Self::Other,
        }
    }
}

impl From<ModelError> for WstacFwStatus {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::Magic => Self::ModelMagic,
            ModelError::Version(_) => Self::ModelVersion,
            ModelError::Length { .. } => Self::ModelLength,
            ModelError::Checksum { .. } => Self::ModelChecksum,
            ModelError::Alignment => Self::ModelAlignment,
            _ => Self::ModelContent,
        }
    }
}

/// Returns a call's status from its result.
pub(crate) fn status(result: Result<WstacFwStatus, WstacFwStatus>) -> WstacFwStatus {
    result.unwrap_or_else(|error| error)
}

/// Returns the text of a status, in English, with a 0 at its end. The text stays valid. It says so if a number is not a
/// status.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_fw_status_text(status: i32) -> *const c_char {
    let known = TEXTS.iter().find(|(known, _)| *known as i32 == status);
    known.map_or(c"no status of this library", |(_, text)| text).as_ptr()
}
