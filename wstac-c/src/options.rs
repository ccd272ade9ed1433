//! Options of a C program, read and checked.

use std::ffi::c_char;
use std::path::{Path, PathBuf};

use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::status::{Failure, WstacStatus, failed, failed_by, path, text, text_if_any};
use super::types::WstacBool;
use wstac_host::config::Config;
use wstac_host::model_file::ModelFile;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{FramePolicy, StreamInfo};
use wstac_scene::sensor::SensorFormat;

fn choice(name: &str, byte: WstacBool) -> Result<bool, Failure> {
    match byte {
        0 | 1 => Ok(byte == 1),
        other => Err(failed(WstacStatus::Option, format_args!("{name} is {other}, expected 0 or 1"))),
    }
}

/// Options of a sensor. Zeros are the defaults: `WstacOptions options = {0};`.
#[repr(C)]
pub struct WstacOptions {
    /// Path of a configuration file (TOML). Null: the source's own configuration, or else the default.
    pub config: *const c_char,
    /// Texture models: paths of .wsm files, or names such as "builtin". The last one is null. Null: no model.
    pub models: *const *const c_char,
    /// Frames per second, numerator: requested from a camera, and assumed of a file. 0 and 0: no request.
    pub fps_numerator: u32,
    /// Frames per second, denominator.
    pub fps_denominator: u32,
    /// Four-character code of the pixel format requested from a camera, such as "YUYV". Null: no request.
    pub format: *const c_char,
    /// Width in pixels requested from a camera. 0 and 0: no request.
    pub width: u32,
    /// Height in pixels requested from a camera.
    pub height: u32,
    /// Give the features of every frame as a record.
    pub features: WstacBool,
    /// Take every frame of a camera, the oldest first, as long as the driver has buffers. Otherwise a slow program
    /// gets the newest frame.
    pub every_frame: WstacBool,
    /// Leave the controls of a camera as they are instead of locking them.
    pub keep_controls: WstacBool,
    /// Give speed and direction of every frame as a record while something slides.
    pub motion: WstacBool,
    /// Give an event as soon as its answers are certain, without a sample, instead of after 70 frames.
    pub at_once: WstacBool,
    /// The sensor to read of a recording of several. Null: the recording has one.
    pub sensor: *const c_char,
    /// Content of a configuration file, in UTF-8, instead of `config`. Null: none.
    pub config_text: *const c_char,
}

/// Describes frames that a program pushes.
#[repr(C)]
pub struct WstacFrames {
    /// Width in pixels, 1 to 16384.
    pub width: u32,
    /// Height in pixels, 1 to 16384.
    pub height: u32,
    /// Four-character code of the pixel format, such as "GREY", "YUYV" or "RGB3".
    pub format: *const c_char,
    /// Bytes from row to row. 0: rows without padding.
    pub bytes_per_row: u32,
    /// Frames per second, numerator. 0 and 0: 30 per second. Above 45 per second, frames are added up to about 30 per
    /// second.
    pub fps_numerator: u32,
    /// Frames per second, denominator.
    pub fps_denominator: u32,
    /// YCbCr is encoded as ITU-R BT.709 instead of BT.601.
    pub bt709: WstacBool,
    /// YCbCr has full range instead of limited range.
    pub full_range: WstacBool,
}

pub(super) struct Options {
    pub(super) config: Option<Config>,
    pub(super) models: Vec<ModelFile>,
    pub(super) open: OpenOptions,
    pub(super) features: bool,
    /// Whether the motion of every frame is a record.
    pub(super) motion: bool,
    /// Whether events are answered at once.
    pub(super) at_once: bool,
}

/// Reads a program's options.
///
/// # Errors
/// An option is wrong, or a file that it names.
///
/// # Safety
/// `options` is null or options whose strings end in 0 and whose list of models ends in null.
pub(super) unsafe fn read(options: *const WstacOptions) -> Result<Options, Failure> {
    // SAFETY: null or options (the caller).
    let Some(options) = (unsafe { options.as_ref() }) else {
        let open = OpenOptions { delivery: FramePolicy::Newest, ..OpenOptions::default() };
        return Ok(Options { config: None, models: Vec::new(), open, features: false, motion: false, at_once: false });
    };
    let wrong = |error| failed_by(WstacStatus::Config, &error);
    let config = match (options.config.is_null(), options.config_text.is_null()) {
        (true, true) => None,
        (false, true) => {
            // SAFETY: the caller's.
            let path = unsafe { path("config", options.config) }?;
            Some(Config::read(Path::new(path)).map_err(wrong)?)
        }
        (true, false) => {
            // SAFETY: the caller's.
            let text = unsafe { text("config_text", options.config_text) }?;
            Some(Config::parse(text).map_err(wrong)?)
        }
        (false, false) => {
            let message = "config and config_text are both given: give one of them";
            return Err(failed(WstacStatus::Option, message));
        }
    };
    let features = choice("features", options.features)?;
    // SAFETY: the caller's.
    let names = unsafe { names(options.models) }?;
    let models = ModelFile::open_all(&names).map_err(|error| failed_by(WstacStatus::Model, &error))?;
    // SAFETY: as above.
    let format = unsafe { text_if_any("format", options.format) }?;
    let format = format.map(|format| Ok(sensor_format(format)?.code())).transpose()?;
    let size = match (options.width, options.height) {
        (0, 0) => None,
        (0, _) | (_, 0) => {
            let message =
                format_args!("size is {}x{}, expected both above 0, or neither", options.width, options.height);
            return Err(failed(WstacStatus::Option, message));
        }
        size => Some(size),
    };
    let open = OpenOptions {
        fps: rate(options.fps_numerator, options.fps_denominator)?,
        format,
        size,
        delivery: if choice("every_frame", options.every_frame)? { FramePolicy::Every } else { FramePolicy::Newest },
        baud: None,
        keep_controls: choice("keep_controls", options.keep_controls)?,
        controls: Vec::new(),
        // SAFETY: as above.
        sensor: unsafe { text_if_any("sensor", options.sensor) }?.map(str::to_owned),
    };
    let motion = choice("motion", options.motion)?;
    let at_once = choice("at_once", options.at_once)?;
    Ok(Options { config, models, open, features, motion, at_once })
}

impl Options {
    /// Refuses options that choose a source.
    ///
    /// # Errors
    /// Such an option is set. The message names it.
    pub(super) fn without_source(&self) -> Result<(), Failure> {
        let OpenOptions { fps, format, size, delivery, keep_controls, sensor, .. } = &self.open;
        let asked = [
            ("fps", fps.is_some()),
            ("format", format.is_some()),
            ("width and height", size.is_some()),
            ("every_frame", *delivery == FramePolicy::Every),
            ("keep_controls", *keep_controls),
            ("sensor", sensor.is_some()),
        ];
        asked.iter().find(|(_, asked)| *asked).map_or(Ok(()), |(name, _)| {
            let message = format_args!("options: {name} is set, expected only with wstac_open");
            Err(failed(WstacStatus::Option, message))
        })
    }
}

impl WstacFrames {
    /// Returns what the frames have in common.
    ///
    /// # Errors
    /// The size, the format or the rate is wrong.
    ///
    /// # Safety
    /// `format` is null or a string that ends in 0.
    pub(super) unsafe fn info(&self) -> Result<StreamInfo, Failure> {
        let wrong = |error| failed(WstacStatus::Option, format_args!("frames: {error}"));
        let size = FrameSize::new(self.width, self.height).map_err(wrong)?;
        // SAFETY: the caller's.
        let format = sensor_format(unsafe { text("frames: format", self.format) }?)?;
        if format.is_jpeg() {
            return Err(failed(WstacStatus::Option, format_args!("frames: format is {format}, expected pixels")));
        }
        let rate = rate(self.fps_numerator, self.fps_denominator)?.unwrap_or(FrameRate::NOMINAL);
        let about = format!("frames of {}x{} {format}", self.width, self.height);
        let mut info = StreamInfo::new(about, size, format.pixels(), rate);
        info.color = YcbcrEncoding {
            matrix: if choice("frames: bt709", self.bt709)? { YcbcrMatrix::Bt709 } else { YcbcrMatrix::Bt601 },
            range: if choice("frames: full_range", self.full_range)? {
                QuantizationRange::Full
            } else {
                QuantizationRange::Limited
            },
        };
        if self.bytes_per_row != 0 {
            let least = Any::new(info.format, info.color, YcbcrMethod::Exact).row_bytes(size.width());
            if (self.bytes_per_row as usize) < least {
                let found = self.bytes_per_row;
                let message = format_args!("frames: bytes_per_row is {found}, expected 0 or at least {least}");
                return Err(failed(WstacStatus::Option, message));
            }
            info.bytes_per_row = self.bytes_per_row;
        }
        Ok(info)
    }
}

/// Returns a frame rate; `None` for 0 and 0.
fn rate(numerator: u32, denominator: u32) -> Result<Option<FrameRate>, Failure> {
    if (numerator, denominator) == (0, 0) {
        return Ok(None);
    }
    FrameRate::new(numerator, denominator).map(Some).map_err(|error| failed(WstacStatus::Option, error))
}

/// Returns the pixel format of a four-character code.
fn sensor_format(code: &str) -> Result<SensorFormat, Failure> {
    code.parse().map_err(|error: String| failed(WstacStatus::Option, error))
}

/// Most texture models: there is one per task.
const MOST_MODELS: usize = 16;

/// Returns the names of a list that ends in null.
///
/// # Safety
/// `list` is null or such a list of strings that end in 0.
unsafe fn names(list: *const *const c_char) -> Result<Vec<PathBuf>, Failure> {
    let mut names = Vec::new();
    if list.is_null() {
        return Ok(names);
    }
    loop {
        // SAFETY: the list has not ended before (the caller).
        let at = unsafe { list.add(names.len()) };
        // SAFETY: as above.
        let name = unsafe { at.read() };
        if name.is_null() {
            return Ok(names);
        }
        if names.len() == MOST_MODELS {
            let message = format_args!("models has more than {MOST_MODELS} names, expected a null after the last");
            return Err(failed(WstacStatus::Option, message));
        }
        // SAFETY: the caller's.
        names.push(PathBuf::from(unsafe { path("models", name) }?));
    }
}
