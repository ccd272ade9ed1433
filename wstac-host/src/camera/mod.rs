//! Facts about cameras that do not depend on how a camera is read: pixel formats, modes, controls, JPEG pictures.

mod device_info;
pub mod formats;
#[cfg(feature = "jpeg")]
pub mod mjpeg;
pub mod modes;
mod state;

pub use device_info::{ControlValue, DeviceInfo};
pub use state::{CameraState, ControlSetting, LockedControl, UnlockedReason};
