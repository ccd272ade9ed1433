//! The values of a source's options, as users write them.
//!
//! ```
//! use wstac_host::source::option_text::{frame_rate, size};
//!
//! assert_eq!(size("1280x720"), Ok((1280, 720)));
//! assert!((frame_rate("30000/1001").unwrap().per_second() - 29.97).abs() < 0.001);
//! assert!(size("1280").unwrap_err().contains("expected WIDTHxHEIGHT"));
//! ```

use wstac_core::rate::FrameRate;

use crate::camera::ControlSetting;

/// Parses frames per second: `30`, `29.97` or `30000/1001`.
///
/// # Errors
/// The text is no rate.
pub fn frame_rate(text: &str) -> Result<FrameRate, String> {
    let (numerator, denominator) = match text.split_once(['/', ':']) {
        Some((numerator, denominator)) => (numerator.parse().ok(), denominator.parse().ok()),
        None if text.bytes().all(|byte| byte.is_ascii_digit()) => (text.parse().ok(), Some(1)),
        None => (thousandths(text), Some(1000)),
    };
    let rate =
        numerator.zip(denominator).and_then(|(numerator, denominator)| FrameRate::new(numerator, denominator).ok());
    rate.ok_or_else(|| {
        format!(
            "{text:?} is no frame rate, expected a number above 0 and below 4294967, such as 30, 29.97 or 30000/1001"
        )
    })
}

/// Parses a decimal number into thousandths.
fn thousandths(text: &str) -> Option<u32> {
    let thousandths = (text.parse::<f64>().ok()? * 1000.0).round();
    // Also false for NaN.
    (thousandths >= 1.0 && thousandths <= f64::from(u32::MAX)).then_some(thousandths as u32)
}

/// Parses a four-character code; shorter ones are padded with spaces, like `Y10 `.
///
/// # Errors
/// The text is no such code.
pub fn four_characters(text: &str) -> Result<[u8; 4], String> {
    let bytes = text.as_bytes();
    if bytes.is_empty() || bytes.len() > 4 || !bytes.iter().all(u8::is_ascii) {
        return Err(format!("{text:?} is no four-character code, expected one such as YUYV, GREY or MJPG"));
    }
    let mut code = [b' '; 4];
    code[..bytes.len()].copy_from_slice(bytes);
    Ok(code)
}

/// Parses a width and a height in pixels: `1280x720`.
///
/// # Errors
/// The text is no size.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    sides.ok_or_else(|| format!("{text:?} is no size, expected WIDTHxHEIGHT such as 1280x720"))
}

/// Parses the value of a control: `exposure_time_absolute=200`.
///
/// # Errors
/// The text is no name with a number.
pub fn control(text: &str) -> Result<ControlSetting, String> {
    let parts = text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
    let (name, value) = parts
        .filter(|(name, _)| !name.is_empty())
        .ok_or_else(|| format!("{text:?} is no control, expected NAME=NUMBER such as exposure_time_absolute=200"))?;
    Ok(ControlSetting { name: name.to_owned(), value })
}
