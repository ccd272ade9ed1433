//! The time from the first to the last row of a picture, as the driver of the sensor tells it.
//!
//! V4L2 has no control for it. `HBLANK`, `VBLANK` and `PIXEL_RATE` give the time of a row: that of the active pixels
//! and the blanking behind them. A global shutter has the same controls, so the sensor must be known to have none.

use std::path::{Path, PathBuf};

use v4l::v4l_sys as sys;
use wstac_core::rate::FrameRate;
use wstac_host::source::ReadoutTime;

use crate::controls::Controls;
use crate::device::Device;

/// The folder of the kernel's video nodes and of the parts behind them.
pub(crate) const PARTS: &str = "/sys/class/video4linux";
/// Sensors that read one row after the other, and those that expose all rows at once, by their drivers' names.
const ROLLING: [&str; 21] = [
    "gc2145", "imx214", "imx219", "imx258", "imx290", "imx327", "imx335", "imx378", "imx412", "imx415", "imx462",
    "imx477", "imx519", "imx708", "ov13850", "ov2640", "ov5640", "ov5645", "ov5647", "ov5648", "ov8858",
];
const GLOBAL: [&str; 8] = ["ar0144", "ar0234", "imx296", "ov2311", "ov7251", "ov9281", "ov9282", "ov9782"];
/// Motors of lenses, which are parts, too.
const LENSES: [&str; 4] = ["ad5398", "ak7375", "dw9714", "dw9807"];
/// Part of a frame's time by which the product of its rows and their time may differ from it.
const NEAR: f64 = 0.02;

/// Returns the parts of cameras on the buses of sensors, `imx219 10-0010`: the name of the driver, and the node.
pub(crate) fn sensors(parts: &Path) -> Vec<(String, PathBuf)> {
    let entries = std::fs::read_dir(parts).into_iter().flatten().flatten();
    let sensor = |entry: std::fs::DirEntry| {
        let node = entry.file_name().into_string().ok().filter(|node| node.starts_with("v4l-subdev"))?;
        let text = std::fs::read_to_string(entry.path().join("name")).ok()?;
        let (name, place) = text.trim().split_once(' ')?;
        let (bus, address) = place.split_once('-')?;
        let is_bus = bus.parse::<u32>().is_ok() && u32::from_str_radix(address, 16).is_ok();
        // A driver may state its variant: imx708_wide.
        let name = name.split('_').next().unwrap_or(name);
        (is_bus && !LENSES.contains(&name)).then(|| (name.to_owned(), Path::new("/dev").join(node)))
    };
    let mut sensors: Vec<_> = entries.filter_map(sensor).collect();
    sensors.sort();
    sensors
}

/// Returns the readout of a camera whose own node has the sensor's controls; `None` if it is not certain.
///
/// The node does not name its sensor, so all sensors of this machine must have a rolling shutter.
pub(crate) fn of_camera(node: &impl Controls, size: (u32, u32), rate: FrameRate, parts: &Path) -> Option<ReadoutTime> {
    let sensors = sensors(parts);
    let is_rolling = !sensors.is_empty() && sensors.iter().all(|(name, _)| ROLLING.contains(&name.as_str()));
    let row_ms = is_rolling.then(|| row_ms(node, size, 1000.0 / rate.per_second()))??;
    ReadoutTime::from_ms((row_ms * f64::from(size.1.saturating_sub(1))) as f32)
}

/// Returns the readout of a picture of a sensor with this name, in this mode of its own; `None` if it is not certain.
///
/// The picture shows as much of the mode as its shape allows, from the middle.
pub(crate) fn of_sensor(name: &str, mode: (u32, u32), picture: (u32, u32), period_ms: f64) -> Option<ReadoutTime> {
    let name = name.split('_').next().unwrap_or(name);
    if GLOBAL.contains(&name) {
        return Some(ReadoutTime::GLOBAL);
    }
    if !ROLLING.contains(&name) {
        return None;
    }
    let nodes = sensors(Path::new(PARTS)).into_iter().filter(|(found, _)| found == name);
    let mut rows = nodes.filter_map(|(_, node)| row_ms(&Device::open(&node).ok()?, mode, period_ms));
    let row_ms = rows.next()?;
    // Two sensors of one kind that differ: which one it is, is not known.
    let ms = rows.all(|other| (other / row_ms - 1.0).abs() < 1e-6).then(|| row_ms * shown_rows(mode, picture))?;
    ReadoutTime::from_ms(ms as f32)
}

/// Returns the rows of a mode from the first to the last one that a picture shows.
fn shown_rows((width, height): (u32, u32), picture: (u32, u32)) -> f64 {
    let shown = f64::from(width) * f64::from(picture.1) / f64::from(picture.0);
    shown.min(f64::from(height)) - 1.0
}

/// Returns the time of a row in ms.
///
/// The controls are those of the sensor's active array. A picture of another size was cropped or scaled behind the
/// sensor, and its rows are not the sensor's: then rows and their time do not make up a frame's time, and there is no
/// answer.
fn row_ms(sensor: &impl Controls, (width, height): (u32, u32), period_ms: f64) -> Option<f64> {
    let blanking = |id| Some(f64::from(u32::try_from(sensor.get(id).ok()?).ok()?));
    let pixels_per_ms = sensor.fixed(sys::V4L2_CID_PIXEL_RATE).filter(|rate| *rate > 0)? as f64 / 1000.0;
    let row_ms = (f64::from(width) + blanking(sys::V4L2_CID_HBLANK)?) / pixels_per_ms;
    let frame_ms = row_ms * (f64::from(height) + blanking(sys::V4L2_CID_VBLANK)?);
    ((frame_ms / period_ms - 1.0).abs() < NEAR).then_some(row_ms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controls::Control;
    use std::io;

    /// The controls of a sensor's mode: horizontal and vertical blanking, and pixels per second.
    struct Sensor(i32, i32, Option<i64>);

    impl Controls for Sensor {
        fn list(&self) -> Vec<Control> {
            Vec::new()
        }

        fn get(&self, id: u32) -> io::Result<i32> {
            match id {
                sys::V4L2_CID_HBLANK => Ok(self.0),
                sys::V4L2_CID_VBLANK => Ok(self.1),
                _ => Err(io::Error::from_raw_os_error(libc::EINVAL)),
            }
        }

        fn set(&self, _: u32, _: i32) -> io::Result<()> {
            Err(io::Error::from_raw_os_error(libc::EACCES))
        }

        fn fixed(&self, id: u32) -> Option<i64> {
            self.2.filter(|_| id == sys::V4L2_CID_PIXEL_RATE)
        }
    }

    /// A folder like the kernel's with these parts.
    fn parts(test: &str, names: &[&str]) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("wstac-readout-{test}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        for (number, name) in names.iter().enumerate() {
            let part = folder.join(format!("v4l-subdev{number}"));
            std::fs::create_dir_all(&part).unwrap();
            std::fs::write(part.join("name"), format!("{name}\n")).unwrap();
        }
        folder
    }

    #[test]
    fn a_sensors_rows_and_blanking_are_its_readout() {
        let folder = parts("rows", &["imx219 10-0010", "unicam-subdev", "dw9807 10-000c"]);
        // The IMX219 in its mode of 1640x1232: 3448 pixels a row, 182.4 MHz, 1763 rows at 30 frames per second.
        let sensor = Sensor(3448 - 1640, 1763 - 1232, Some(182_400_000));
        let of = |sensor: &Sensor, size| of_camera(sensor, size, FrameRate::NOMINAL, &folder);
        let found = of(&sensor, (1640, 1232)).unwrap().ms();
        assert!((found - 23.27).abs() < 0.01, "{found}");
        // A picture that was cropped or scaled, a camera of other times, and drivers that do not state all.
        assert_eq!(of(&sensor, (1640, 922)), None);
        assert_eq!(of(&sensor, (640, 480)), None);
        assert_eq!(of_camera(&sensor, (1640, 1232), FrameRate::new(60, 1).unwrap(), &folder), None);
        for broken in [Sensor(1808, 531, None), Sensor(1808, 531, Some(0)), Sensor(-1, 531, Some(182_400_000))] {
            assert_eq!(of(&broken, (1640, 1232)), None);
        }
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_shutter_that_is_not_known_to_roll_has_no_readout() {
        let sensor = Sensor(3448 - 1640, 1763 - 1232, Some(182_400_000));
        for (test, names) in
            [("none", &["unicam"][..]), ("global", &["ov9281 10-0060"]), ("two", &["imx219 10-0010", "vc 0-0060"])]
        {
            let folder = parts(test, names);
            assert_eq!(of_camera(&sensor, (1640, 1232), FrameRate::NOMINAL, &folder), None, "{names:?}");
            let _ = std::fs::remove_dir_all(folder);
        }
        assert_eq!(of_sensor("imx296", (1456, 1088), (1280, 720), 33.3), Some(ReadoutTime::GLOBAL));
        assert_eq!(of_sensor("some", (1456, 1088), (1280, 720), 33.3), None);
    }

    #[test]
    fn a_picture_shows_the_rows_that_its_shape_allows() {
        assert!((shown_rows((1640, 1232), (640, 480)) - 1229.0).abs() < 1e-9);
        assert!((shown_rows((1640, 1232), (1280, 720)) - 921.5).abs() < 1e-9);
        assert!((shown_rows((1640, 1232), (480, 480)) - 1231.0).abs() < 1e-9);
    }
}
