//! The properties that frames have in common, in Python's words.

use pyo3::prelude::*;
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_host::camera::formats;
use wstac_host::source::StreamInfo;
use wstac_scene::sensor::SensorFormat;

use crate::refused;

/// Numerator and denominator of frames per second.
pub(crate) type Rate = (u32, u32);

/// Describes frames of a four-character code, a size in pixels and a rate. Rows have no padding unless `bytes_per_row`
/// says more.
pub(crate) fn info(
    format: &str,
    size: (u32, u32),
    bytes_per_row: Option<u32>,
    rate: Rate,
    color: YcbcrEncoding,
) -> PyResult<StreamInfo> {
    let about = format!("frames of {}x{} {format}", size.0, size.1);
    let in_frames = |error: wstac_core::error::ConfigError| refused(format_args!("{about}: {error}"));
    let pixels = pixels(format)?;
    let size = FrameSize::new(size.0, size.1).map_err(in_frames)?;
    let rate = FrameRate::new(rate.0, rate.1).map_err(in_frames)?;
    let mut info = StreamInfo::new(about.clone(), size, pixels, rate);
    info.color = color;
    info.bytes_per_row = bytes_per_row.unwrap_or(info.bytes_per_row);
    Ok(info)
}

/// Returns the bytes of a row of pixels; for a planar format those of its luma.
pub(crate) fn row(format: PixelFormat, width: u16) -> usize {
    Any::new(format, YcbcrEncoding::default(), YcbcrMethod::Exact).row_bytes(width)
}

/// The code of planar YCbCr without subsampling, which files have and no camera: V4L2 has no code for it.
const PLANAR_444: &str = "444P";

/// Returns the pixel format of a four-character code.
pub(crate) fn pixels(format: &str) -> PyResult<PixelFormat> {
    if format == PLANAR_444 {
        return Ok(PixelFormat::Yuv444p);
    }
    let format: SensorFormat = format.parse().map_err(refused)?;
    if format.is_jpeg() {
        return Err(refused(format_args!("format is {format}, expected pixels: decode the picture first, as RGB3")));
    }
    Ok(format.pixels())
}

/// Returns the four-character code of a pixel format.
pub(crate) fn code(format: PixelFormat) -> String {
    format.facts().codes.first().map_or_else(|| PLANAR_444.to_owned(), |&&code| formats::name(code))
}

/// Returns the YCbCr encoding: `given`, with what Python says instead.
pub(crate) fn color(given: YcbcrEncoding, matrix: Option<&str>, range: Option<&str>) -> PyResult<YcbcrEncoding> {
    let matrix = match matrix {
        None => given.matrix,
        Some("bt601") => YcbcrMatrix::Bt601,
        Some("bt709") => YcbcrMatrix::Bt709,
        Some(other) => return Err(refused(format_args!("matrix is {other:?}, expected \"bt601\" or \"bt709\""))),
    };
    let range = match range {
        None => given.range,
        Some("limited") => QuantizationRange::Limited,
        Some("full") => QuantizationRange::Full,
        Some(other) => return Err(refused(format_args!("range is {other:?}, expected \"limited\" or \"full\""))),
    };
    Ok(YcbcrEncoding { matrix, range })
}
