//! The header line of Y4M: reading, checking and writing it.

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::params::LARGEST_FRAME_SIDE;
use wstac_core::rate::FrameRate;

use super::MAGIC;
use crate::camera::formats;
use crate::source::StreamInfo;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) size: FrameSize,
    pub(super) rate: FrameRate,
    /// The rate of the header, if it has one.
    pub(super) own_rate: Option<FrameRate>,
    pub(super) format: PixelFormat,
    pub(super) color: YcbcrEncoding,
    /// Whether the header does not state the range of Y, Cb and Cr, though it matters.
    pub(super) is_range_assumed: bool,
    /// The bits of gray that states limited range.
    pub(super) limited_bits: Option<u32>,
    /// The format's name in Y4M.
    pub(super) name: String,
}

impl Header {
    /// Reads the tags behind the magic word. `fps` replaces the header's rate.
    pub(super) fn parse(line: &[u8], fps: Option<FrameRate>) -> Result<Self, String> {
        let line = String::from_utf8_lossy(line);
        let tags = tags(&line)?;
        let value = |start: &str| tags.iter().rev().find_map(|tag| tag.strip_prefix(start));
        let size = FrameSize::new(side('W', value("W"))?, side('H', value("H"))?);
        let (rate, own_rate) = checked_rate(value("F"), fps)?;
        match value("I") {
            None | Some("?" | "p" | "t" | "b" | "m") => {}
            Some(other) => return Err(format!("I is {other:?}, expected ?, p, t, b or m")),
        }
        if let Some(aspect) = value("A").filter(|aspect| ratio(aspect).is_none()) {
            return Err(format!("A is {aspect:?}, expected two numbers as in 1:1"));
        }
        // X tags have no fixed meaning, but two of them change what the bytes mean. An old writer states sampling so.
        let range = match value("XCOLORRANGE=") {
            None => None,
            Some("FULL") => Some(QuantizationRange::Full),
            Some("LIMITED") => Some(QuantizationRange::Limited),
            Some(other) => return Err(format!("XCOLORRANGE is {other:?}, expected FULL or LIMITED")),
        };
        let (name, format) = checked_format(value("C"), value("XYSCSS="))?;
        let is_limited = range == Some(QuantizationRange::Limited);
        Ok(Self {
            size: size.map_err(|error| error.to_string())?,
            rate,
            own_rate,
            format,
            color: YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: range.unwrap_or(QuantizationRange::Limited) },
            is_range_assumed: range.is_none() && format.is_ycbcr(),
            limited_bits: name.strip_prefix("Cmono").filter(|_| is_limited).map(|bits| bits.parse().unwrap_or(8)),
            name,
        })
    }
}

/// Returns the tags of a header: at most one of each, but any number of X.
fn tags(line: &str) -> Result<Vec<&str>, String> {
    let mut tags = Vec::<&str>::new();
    for tag in line.split(' ').filter(|tag| !tag.is_empty()) {
        let key = tag.chars().next().unwrap_or_default();
        if !"WHFIACX".contains(key) {
            return Err(format!("header has a tag {tag:?}, expected W, H, F, I, A, C or X"));
        }
        if key != 'X' && tags.iter().any(|other| other.starts_with(key)) {
            return Err(format!("header has {key} twice, expected once"));
        }
        tags.push(tag);
    }
    Ok(tags)
}

fn side(key: char, found: Option<&str>) -> Result<u32, String> {
    let expected = || format!("expected a number from 1 to {LARGEST_FRAME_SIDE}");
    let found = found.ok_or_else(|| format!("{key} is missing, {}", expected()))?;
    let number = number(found).filter(|number| (1..=LARGEST_FRAME_SIDE).contains(number));
    number.ok_or_else(|| format!("{key} is {found:?}, {}", expected()))
}

/// Returns the rate that counts, and that of the header.
fn checked_rate(found: Option<&str>, fps: Option<FrameRate>) -> Result<(FrameRate, Option<FrameRate>), String> {
    let header = match found {
        None => None,
        Some(found) => match ratio(found) {
            Some((numerator, denominator)) => FrameRate::new(numerator, denominator).ok(),
            None => return Err(format!("F is {found:?}, expected a rate as in 30:1 or 30000:1001")),
        },
    };
    let rate = fps.or(header).ok_or_else(|| {
        let found = found.map_or("missing".into(), |found| format!("{found:?}"));
        format!("F is {found}, expected a rate as in 30:1; state the rate with --fps")
    })?;
    Ok((rate, header))
}

/// The names of formats. The first of a format is written.
#[rustfmt::skip]
const FORMATS: [(&str, PixelFormat); 10] = [
    ("420jpeg", PixelFormat::Yu12), ("420", PixelFormat::Yu12), ("420mpeg2", PixelFormat::Yu12),
    ("420paldv", PixelFormat::Yu12), ("422", PixelFormat::Yuv422p), ("444", PixelFormat::Yuv444p),
    ("mono", PixelFormat::Gray), ("mono10", PixelFormat::Y10), ("mono12", PixelFormat::Y12), ("mono16", PixelFormat::Y16),
];

/// Returns a format and its name. Without C it is 4:2:0, as the format's description says.
fn checked_format(found: Option<&str>, sampling: Option<&str>) -> Result<(String, PixelFormat), String> {
    let name = found.unwrap_or("420");
    let Some((_, format)) = FORMATS.iter().find(|(known, _)| *known == name) else {
        return Err(format!(
            "C is {name:?}, expected 420, 420jpeg, 420mpeg2, 420paldv, 422, 444, mono, mono10, mono12 or mono16; ffmpeg makes the first with -pix_fmt yuv420p"
        ));
    };
    match sampling {
        Some(other) if found.is_none() && !other.starts_with("420") => {
            Err(format!("XYSCSS is {other:?} and C is missing, expected 420 or a C"))
        }
        _ => Ok((format!("C{name}"), *format)),
    }
}

fn ratio(text: &str) -> Option<(u32, u32)> {
    let (numerator, denominator) = text.split_once(':')?;
    Some((number(numerator)?, number(denominator)?))
}

/// Reads decimal digits; `None` if there is anything else.
fn number(text: &str) -> Option<u32> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

/// Returns the header, newline included, of a stream whose frames follow as they are, each after a line `FRAME`.
///
/// # Errors
/// Y4M has no name for the format or for the meaning of its numbers. The error says what was found and what was
/// expected.
pub fn header_of(info: &StreamInfo) -> Result<String, String> {
    let Some((name, _)) = FORMATS.iter().find(|(_, format)| *format == info.format) else {
        let found = info.format.facts().codes.first().map_or("444P".into(), |&&code| formats::name(code));
        return Err(format!("format is {found}, expected GREY, Y10, Y12, Y16, YU12 or 422P in Y4M"));
    };
    if info.format.is_ycbcr() && info.color.matrix != YcbcrMatrix::Bt601 {
        return Err("matrix is bt709, expected bt601: Y4M cannot say another".into());
    }
    let (width, height) = info.size.into();
    let (frames, time): (u32, u32) = info.rate.into();
    // Gray is read as it is. ffmpeg would take it for limited range, and cut off what is dark, where nothing is stated.
    let is_limited = info.format.is_ycbcr() && info.color.range == QuantizationRange::Limited;
    let range = if is_limited { "LIMITED" } else { "FULL" };
    let magic = String::from_utf8_lossy(MAGIC);
    Ok(format!("{magic} W{width} H{height} F{frames}:{time} Ip A1:1 C{name} XCOLORRANGE={range}\n"))
}
