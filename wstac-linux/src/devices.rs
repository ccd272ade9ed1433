//! The cameras of this machine.

use std::path::{Path, PathBuf};

use super::device::Device;
use super::unusable;
use v4l::v4l_sys as sys;
use wstac_host::camera::DeviceInfo;
use wstac_host::camera::formats;
use wstac_host::camera::modes::{Mode, Sizes};

/// Returns all video nodes that capture, or that cannot be asked, in natural order: 2 before 10.
pub fn devices() -> Vec<DeviceInfo> {
    nodes().iter().filter_map(|path| device_at(path)).collect()
}

/// Returns all video nodes, in natural order.
pub(super) fn nodes() -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev").into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    in_order(names).into_iter().map(|name| Path::new("/dev").join(name)).collect()
}

/// Returns the names of video nodes, by their numbers.
fn in_order(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut numbered: Vec<(u64, String)> = names
        .filter_map(|name| Some((name.strip_prefix("video")?.parse().ok()?, name)))
        .filter(|(_, name)| name["video".len()..].bytes().all(|byte| byte.is_ascii_digit()))
        .collect();
    numbered.sort();
    numbered.into_iter().map(|(_, name)| name).collect()
}

/// Returns the facts about a node; `None` if it does not capture video.
pub fn device_at(path: &Path) -> Option<DeviceInfo> {
    let (links, serial) = (links_to(path), serial_of(path));
    let info = DeviceInfo { path: path.to_owned(), links, serial, ..DeviceInfo::default() };
    let asked = Device::open(path).and_then(|device| {
        let identity = device.identity().map_err(|error| device.error("cannot be asked", error))?;
        Ok((device, identity))
    });
    let (device, identity) = match asked {
        Ok(asked) => asked,
        Err(error) => {
            // The path is part of the device's entry already.
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

/// Returns the links to a node that outlast its number.
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

/// Returns the serial number of the USB device that a node belongs to.
fn serial_of(path: &Path) -> Option<String> {
    let node = path.canonicalize().ok()?;
    let interface = Path::new("/sys/class/video4linux").join(node.file_name()?).join("device").canonicalize().ok()?;
    serial_above(&interface)
}

/// Returns the serial number of the nearest USB device at or above a folder of sysfs.
///
/// The numbers of other devices, such as a disk or a hub further up, do not belong to the camera.
fn serial_above(folder: &Path) -> Option<String> {
    let device = folder.ancestors().find(|folder| folder.join("idVendor").exists())?;
    let serial = std::fs::read_to_string(device.join("serial")).ok()?;
    Some(serial.trim().to_owned()).filter(|serial| !serial.is_empty())
}

/// Returns everything that a device offers. For a range of sizes, it has the rates at the size nearest to `size`.
pub(super) fn modes(device: &Device, size: (u32, u32)) -> Vec<Mode> {
    let sizes = |fourcc| {
        let ranges = device.sizes(fourcc).into_iter();
        ranges.map(|range| Sizes { range, rates: device.rates(fourcc, range.nearest(size)) }).collect()
    };
    let formats = device.formats().into_iter();
    formats
        .map(|(fourcc, description)| {
            let readable = formats::coding(fourcc).is_some();
            Mode { fourcc, description, readable, sizes: sizes(fourcc) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_compared_as_numbers() {
        let names = ["video10", "video2", "video", "videos", "video-1", "video+3", "vbi0", "video0", "video1x"];
        assert_eq!(in_order(names.map(str::to_owned).into_iter()), ["video0", "video2", "video10"]);
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
