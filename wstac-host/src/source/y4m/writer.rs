//! The header line of a Y4M file that is written.

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrMatrix};

use super::MAGIC;
use crate::source::StreamInfo;

/// The header, newline included, of a stream whose frames follow as they are, each after a line `FRAME`.
///
/// # Errors
/// Where Y4M has no name for the format, or none for what its numbers mean: says what was found and what was expected.
pub fn header_of(info: &StreamInfo) -> Result<String, String> {
    let name = match info.format {
        PixelFormat::Gray => "mono",
        PixelFormat::Y10 => "mono10",
        PixelFormat::Y12 => "mono12",
        PixelFormat::Y16 => "mono16",
        PixelFormat::Yu12 => "420jpeg",
        PixelFormat::Yuv422p => "422",
        PixelFormat::Yuv444p => "444",
        other => return Err(format!("format is {other:?}, expected GREY, Y10, Y12, Y16, YU12 or 422P in Y4M")),
    };
    if info.format.is_ycbcr() && info.color.matrix != YcbcrMatrix::Bt601 {
        return Err("matrix is bt709, expected bt601: Y4M cannot say another".into());
    }
    let (width, height) = info.size.into();
    let rate = info.rate;
    let range = match (info.format.is_ycbcr(), info.color.range) {
        (false, _) => "",
        (true, QuantizationRange::Limited) => " XCOLORRANGE=LIMITED",
        (true, QuantizationRange::Full) => " XCOLORRANGE=FULL",
    };
    let magic = String::from_utf8_lossy(MAGIC);
    Ok(format!("{magic} W{width} H{height} F{}:{} Ip A1:1 C{name}{range}\n", rate.numerator(), rate.denominator()))
}
