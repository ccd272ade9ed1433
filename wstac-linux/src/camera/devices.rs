//! Which cameras there are.

use std::fmt::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::device::Device;
use super::formats;
use super::modes::{Mode, RateRange, modes};
use super::unusable;
use v4l::v4l_sys as sys;

/// A video node that captures, or might.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DeviceInfo {
    /// Its path, such as `/dev/video0`.
    pub path: PathBuf,
    /// What the maker calls it.
    pub card: String,
    /// The kernel's driver.
    pub driver: String,
    /// Where it is plugged in.
    pub bus: String,
    /// Paths that stay the same when it is plugged in again: by its serial number first, then by its place.
    pub links: Vec<PathBuf>,
    /// Its serial number, where it is on USB and has one.
    pub serial: Option<String>,
    /// What it offers.
    pub modes: Vec<Mode>,
    /// Why it cannot be used, or its formats are not known.
    pub problem: Option<String>,
}

/// All video nodes that capture, or that cannot be asked, in natural order: 2 before 10.
pub fn devices() -> Vec<DeviceInfo> {
    nodes().iter().filter_map(|path| device_at(path)).collect()
}

/// All video nodes, in natural order.
pub(super) fn nodes() -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev").into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    in_order(names).into_iter().map(|name| Path::new("/dev").join(name)).collect()
}

/// The names of video nodes, by their numbers.
fn in_order(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut numbered: Vec<(u64, String)> = names
        .filter_map(|name| Some((name.strip_prefix("video")?.parse().ok()?, name)))
        .filter(|(_, name)| name["video".len()..].bytes().all(|byte| byte.is_ascii_digit()))
        .collect();
    numbered.sort();
    numbered.into_iter().map(|(_, name)| name).collect()
}

/// What there is to know about a node; nothing where it does not capture video.
pub fn device_at(path: &Path) -> Option<DeviceInfo> {
    let (links, serial) = (links_to(path), serial_of(path));
    let info = DeviceInfo { path: path.to_owned(), links, serial, ..DeviceInfo::default() };
    let asked = Device::open(path).and_then(|device| {
        let identity = device.identity().map_err(|error| device.error("cannot be asked", &error))?;
        Ok((device, identity))
    });
    let (device, identity) = match asked {
        Ok(asked) => asked,
        Err(error) => {
            // The path is said already.
            let text = error.to_string();
            let reason = text.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&text);
            return Some(DeviceInfo { problem: Some(reason.to_owned()), ..info });
        }
    };
    let captures = sys::V4L2_CAP_VIDEO_CAPTURE | sys::V4L2_CAP_VIDEO_CAPTURE_MPLANE;
    if identity.capabilities & captures == 0 {
        return None;
    }
    let modes = modes(&device, (1280, 720));
    let problem = unusable(identity.capabilities).map(str::to_owned).or_else(|| {
        (!modes.iter().any(|mode| mode.readable))
            .then(|| format!("none of its formats is read; read are {}", formats::readable()))
    });
    Some(DeviceInfo { card: identity.card, driver: identity.driver, bus: identity.bus, modes, problem, ..info })
}

/// The links to a node that outlast its number.
pub(super) fn links_to(path: &Path) -> Vec<PathBuf> {
    let Ok(target) = path.canonicalize() else { return Vec::new() };
    let mut links = Vec::new();
    for directory in ["/dev/v4l/by-id", "/dev/v4l/by-path"] {
        let entries = std::fs::read_dir(directory).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut found: Vec<_> =
            entries.filter(|link| link.canonicalize().is_ok_and(|points_to| points_to == target)).collect();
        found.sort();
        links.extend(found);
    }
    links
}

/// The serial number of the USB device that a node belongs to.
fn serial_of(path: &Path) -> Option<String> {
    let node = path.canonicalize().ok()?;
    let interface = Path::new("/sys/class/video4linux").join(node.file_name()?).join("device").canonicalize().ok()?;
    serial_above(&interface)
}

/// The serial number of the nearest USB device at or above a folder of sysfs. Others' serial numbers, such as a disk's
/// or a hub's further up, are none of the camera's.
fn serial_above(folder: &Path) -> Option<String> {
    let device = folder.ancestors().find(|folder| folder.join("idVendor").exists())?;
    let serial = std::fs::read_to_string(device.join("serial")).ok()?;
    Some(serial.trim().to_owned()).filter(|serial| !serial.is_empty())
}

impl fmt::Display for DeviceInfo {
    /// Several lines: the node, its lasting names, then a line a format and size.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if !self.card.is_empty() {
            write!(f, "  {} ({}, {})", self.card, self.driver, self.bus)?;
        }
        if let Some(serial) = &self.serial {
            write!(f, "  serial {serial}")?;
        }
        for link in &self.links {
            write!(f, "\n  also {}", link.display())?;
        }
        if let Some(problem) = &self.problem {
            write!(f, "\n  cannot be used: {problem}")?;
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

/// A format: sizes with the same rates share a line.
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
        return write!(f, "\n  {name:4}  {}", mode.description);
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

    #[test]
    fn numbers_are_compared_as_numbers() {
        let names = ["video10", "video2", "video", "videos", "video-1", "video+3", "vbi0", "video0", "video1x"];
        assert_eq!(in_order(names.map(str::to_owned).into_iter()), ["video0", "video2", "video10"]);
    }

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

    #[test]
    fn the_serial_number_is_that_of_the_usb_device() {
        let root = std::env::temp_dir().join(format!("wstac-serial-{}", std::process::id()));
        let interface = root.join("hub/camera/interface/video4linux");
        std::fs::create_dir_all(&interface).unwrap();
        std::fs::write(root.join("hub/serial"), "hub").unwrap();
        std::fs::write(root.join("hub/idVendor"), "1").unwrap();
        assert_eq!(serial_above(&interface).as_deref(), Some("hub"));
        std::fs::write(root.join("hub/camera/idVendor"), "046d").unwrap();
        assert_eq!(serial_above(&interface), None, "a camera without one has not its hub's");
        std::fs::write(root.join("hub/camera/serial"), "A1B2\n").unwrap();
        assert_eq!(serial_above(&interface).as_deref(), Some("A1B2"));
        std::fs::remove_dir_all(&root).unwrap();
    }
}
