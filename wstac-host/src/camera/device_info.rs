//! A video device and its modes.

use std::fmt::{self, Write as _};
use std::path::PathBuf;

use serde::Serialize;

use super::formats;
use super::modes::{Mode, RateRange};
use crate::visible::OneLine;

/// A video node that captures, or that may capture.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DeviceInfo {
    /// Its path, such as `/dev/video0`.
    pub path: PathBuf,
    /// The maker's name for it.
    pub card: String,
    /// The kernel's driver.
    pub driver: String,
    /// The place where it is plugged in.
    pub bus: String,
    /// The paths that stay the same when it is plugged in again: by its serial number first, then by its place.
    pub links: Vec<PathBuf>,
    /// Its serial number; `None` if it is not on USB or has none.
    pub serial: Option<String>,
    /// The formats that it offers.
    pub modes: Vec<Mode>,
    /// The reason why it cannot be used, or why its formats are not known.
    pub problem: Option<String>,
}

/// A control's value at a moment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ControlValue {
    /// Its name, as `v4l2-ctl -l` spells it.
    pub name: String,
    /// Its value; `None` if it cannot be read.
    pub value: Option<i32>,
    /// Whether the driver says that the hardware changes it.
    pub volatile: bool,
    /// Whether it only reports something, such as a temperature.
    pub read_only: bool,
}

impl fmt::Display for DeviceInfo {
    /// Writes several lines: the node, its lasting names, then a line per format and size.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", OneLine(self.path.display()))?;
        if !self.card.is_empty() {
            write!(f, "  {} ({}, {})", OneLine(&self.card), OneLine(&self.driver), OneLine(&self.bus))?;
        }
        if let Some(serial) = &self.serial {
            write!(f, "  serial {}", OneLine(serial))?;
        }
        for link in &self.links {
            write!(f, "\n  also {}", OneLine(link.display()))?;
        }
        if let Some(problem) = &self.problem {
            write!(f, "\n  cannot be used: {}", OneLine(problem))?;
        }
        for mode in self.modes.iter().filter(|mode| mode.readable) {
            write_mode(f, mode)?;
        }
        let others: Vec<_> = self.modes.iter().filter(|mode| !mode.readable).map(|mode| mode.fourcc).collect();
        if !others.is_empty() {
            write!(f, "\n  not read: {}", formats::list(others))?;
        }
        Ok(())
    }
}

/// Writes a format. Sizes with the same rates share a line.
fn write_mode(f: &mut fmt::Formatter<'_>, mode: &Mode) -> fmt::Result {
    let mut lines: Vec<(String, &[RateRange])> = Vec::new();
    for sizes in &mode.sizes {
        match lines.last_mut() {
            Some((text, rates)) if *rates == sizes.rates => write!(text, ", {}", sizes.range)?,
            _ => lines.push((sizes.range.to_string(), &sizes.rates)),
        }
    }
    let name = formats::name(mode.fourcc);
    if lines.is_empty() {
        return write!(f, "\n  {name:4}  {}", OneLine(&mode.description));
    }
    for (sizes, rates) in lines {
        write!(f, "\n  {name:4}  {sizes}")?;
        if !rates.is_empty() {
            let rates: Vec<_> = rates.iter().map(ToString::to_string).collect();
            write!(f, "  {} fps", rates.join(", "))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::modes::{SizeRange, Sizes};
    use super::*;
    use wstac_core::rate::FrameRate;

    fn camera() -> DeviceInfo {
        let rate = |fps| {
            let rate = FrameRate::new(fps, 1).unwrap();
            RateRange { slowest: rate, fastest: rate }
        };
        let sizes = |width, height, rates: &[u32]| Sizes {
            range: SizeRange::one(width, height),
            rates: rates.iter().copied().map(rate).collect(),
        };
        let mode = |fourcc, readable, sizes| Mode { fourcc, description: "A format".into(), readable, sizes };
        DeviceInfo {
            path: "/dev/video2".into(),
            card: "Camera".into(),
            driver: "uvcvideo".into(),
            bus: "usb-1".into(),
            links: vec!["/dev/v4l/by-id/usb-Camera".into()],
            serial: Some("A1B2".into()),
            modes: vec![
                mode(
                    *b"YUYV",
                    true,
                    vec![sizes(640, 480, &[30, 15]), sizes(800, 600, &[30, 15]), sizes(1280, 720, &[10])],
                ),
                mode(*b"GREY", true, vec![]),
                mode(*b"H264", false, vec![]),
            ],
            problem: None,
        }
    }

    #[test]
    fn a_camera_in_words() {
        let text = "\
/dev/video2  Camera (uvcvideo, usb-1)  serial A1B2
  also /dev/v4l/by-id/usb-Camera
  YUYV  640x480, 800x600  30, 15 fps
  YUYV  1280x720  10 fps
  GREY  A format
  not read: H264";
        assert_eq!(camera().to_string(), text);
        let refused =
            DeviceInfo { path: "/dev/video0".into(), problem: Some("because".into()), ..DeviceInfo::default() };
        assert_eq!(refused.to_string(), "/dev/video0\n  cannot be used: because");
    }

    #[test]
    fn a_camera_in_json() {
        let json = serde_json::to_value(camera()).unwrap();
        assert_eq!(json["path"], "/dev/video2");
        assert_eq!(json["modes"][0]["fourcc"], "YUYV");
        assert_eq!(json["modes"][0]["sizes"][2]["largest"], serde_json::json!([1280, 720]));
        assert_eq!(json["modes"][0]["sizes"][2]["rates"][0]["fastest"], serde_json::json!([10, 1]));
    }
}
