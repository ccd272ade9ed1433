//! A camera's controls, and the locking of those that change what gray levels mean.

mod lock;
mod plan;

use std::io;
use std::path::Path;

use v4l::v4l_sys as sys;

use super::device::{Device, G_CTRL, QUERY_EXT_CTRL, QUERYCTRL, S_CTRL, text, zeroed};
pub(super) use lock::{hold, lock};
use wstac_host::camera::{ControlSetting, ControlValue};
use wstac_host::error::Error;

/// Most controls of a device that are read.
const MOST_CONTROLS: usize = 1024;

/// A control that holds a number, a switch or a choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Control {
    /// The identifier `V4L2_CID_*`.
    pub(crate) id: u32,
    /// The driver's name for it, spelled as `v4l2-ctl` does.
    pub(crate) name: String,
    /// Least and greatest value.
    pub(crate) range: (i32, i32),
    /// The difference from one value to the next.
    pub(crate) step: i32,
    /// `V4L2_CTRL_FLAG_*`.
    pub(crate) flags: u32,
}

impl Control {
    /// Returns whether the driver sets one of these flags.
    pub(crate) fn has(&self, flags: u32) -> bool {
        self.flags & flags != 0
    }
}

/// The calls for a device's controls.
pub(crate) trait Controls {
    /// Returns those that hold a number, a switch or a choice, in the driver's order.
    fn list(&self) -> Vec<Control>;

    /// Returns a control's value.
    ///
    /// # Errors
    /// The driver's error.
    fn get(&self, id: u32) -> io::Result<i32>;

    /// Sets a control. The driver may set another value than this.
    ///
    /// # Errors
    /// The driver's error.
    fn set(&self, id: u32, value: i32) -> io::Result<()>;

    /// Returns the value of a control of 64 bits that has only one; `None` if it has others.
    fn fixed(&self, id: u32) -> Option<i64>;
}

impl Controls for Device {
    fn list(&self) -> Vec<Control> {
        let ask = |id| {
            let mut raw: sys::v4l2_queryctrl = zeroed();
            raw.id = id;
            self.call(&QUERYCTRL, &mut raw).ok().map(|()| raw)
        };
        let mut all = Vec::new();
        let mut last = 0;
        while let Some(raw) = ask(last | sys::V4L2_CTRL_FLAG_NEXT_CTRL) {
            // A driver that does not go on must not be asked forever.
            if raw.id <= last || all.len() >= MOST_CONTROLS {
                break;
            }
            last = raw.id;
            all.push(raw);
        }
        // If a camera fails at one of its controls, the list ends there. The rest that matters is asked for one by one.
        let missed = plan::ids().filter(|id| all.iter().all(|raw| raw.id != *id));
        let missed: Vec<_> = missed.filter_map(ask).collect();
        all.into_iter().chain(missed).filter_map(control).collect()
    }

    fn get(&self, id: u32) -> io::Result<i32> {
        let mut raw = sys::v4l2_control { id, value: 0 };
        self.call(&G_CTRL, &mut raw).map(|()| raw.value)
    }

    fn set(&self, id: u32, value: i32) -> io::Result<()> {
        self.call(&S_CTRL, &mut sys::v4l2_control { id, value })
    }

    fn fixed(&self, id: u32) -> Option<i64> {
        let mut raw: sys::v4l2_query_ext_ctrl = zeroed();
        raw.id = id;
        self.call(&QUERY_EXT_CTRL, &mut raw).ok()?;
        (raw.minimum == raw.maximum && raw.nr_of_dims == 0).then_some(raw.maximum)
    }
}

/// Returns a control as the driver describes it; `None` for headings, buttons, texts and disabled controls.
fn control(raw: sys::v4l2_queryctrl) -> Option<Control> {
    let readable = matches!(
        raw.type_,
        sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER
            | sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BOOLEAN
            | sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_MENU
            | sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER_MENU
            | sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BITMASK
    );
    let unusable = sys::V4L2_CTRL_FLAG_DISABLED | sys::V4L2_CTRL_FLAG_WRITE_ONLY;
    (readable && raw.flags & unusable == 0).then(|| Control {
        id: raw.id,
        name: spelled(&text(&raw.name)),
        range: (raw.minimum, raw.maximum),
        step: raw.step,
        flags: raw.flags,
    })
}

/// Returns a name as `v4l2-ctl` spells it: letters and digits in lower case, one `_` for all characters between them.
fn spelled(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_").to_ascii_lowercase()
}

/// Returns all controls of a camera as they are now. Another program, or this one, may use it meanwhile.
///
/// # Errors
/// There is no such camera, or it may not be opened.
pub fn controls(path: &Path) -> Result<Vec<ControlValue>, Error> {
    let device = Device::open(path)?;
    let values = device.list().into_iter().map(|control| ControlValue {
        value: device.get(control.id).ok(),
        volatile: control.has(sys::V4L2_CTRL_FLAG_VOLATILE),
        read_only: control.has(sys::V4L2_CTRL_FLAG_READ_ONLY),
        name: control.name,
    });
    Ok(values.collect())
}

#[cfg(test)]
mod tests;
