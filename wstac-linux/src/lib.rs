#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | what it has |
//! | --- | --- |
//! | [`source`] | a camera as a source, which reconnects |
//! | [`devices`](mod@devices) | the cameras of this machine |
//! | [`controls`] | exposure, gain, white balance and focus: locked, and reapplied |
//!
//! The `v4l` crate gives the kernel's structures and the raw calls. The capture stream is this crate's own: it ends its
//! waits, survives faults, and separates damaged buffers from good ones.

pub(crate) mod buffers;
pub(crate) mod choose;
mod color;
pub mod controls;
mod device;
pub mod devices;
mod negotiate;
pub(crate) mod same;
pub mod source;
mod timeline;
mod wall_clock;

use std::path::PathBuf;

use v4l::v4l_sys as sys;
use wstac_core::rate::FrameRate;

use buffers::Buffers;
use device::Device;
pub use devices::{device_at, devices};
pub use negotiate::Negotiated;
use wstac_host::camera::formats::{self, FourCc};
use wstac_host::camera::{CameraState, ControlSetting};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::FramePolicy;

/// A camera, and the format and control values to ask it for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraRequest {
    /// Its device node, such as `/dev/video0`.
    pub path: PathBuf,
    /// Four-character code of the pixel format; `None` for the one that suits size and rate best.
    pub format: Option<FourCc>,
    /// Width and height in pixels; `None` for the paper's 1280x720.
    pub size: Option<(u32, u32)>,
    /// Frames per second; `None` for the paper's 30.
    pub rate: Option<FrameRate>,
    /// The choice of frames that are handed out if the program is slower.
    pub delivery: FramePolicy,
    /// Whether the controls are left as they are, instead of being locked.
    pub keep_controls: bool,
    /// The values of controls to set, whether the others are locked or not.
    pub controls: Vec<ControlSetting>,
}

impl CameraRequest {
    /// Creates a request for this camera with all defaults.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let (format, size, rate, delivery) = (None, None, None, FramePolicy::default());
        Self { path: path.into(), format, size, rate, delivery, keep_controls: false, controls: Vec::new() }
    }
}

/// A camera that streams.
#[derive(Debug)]
pub struct Camera {
    /// Its identity, and the state of its controls.
    pub state: CameraState,
    /// The properties of its frames.
    pub negotiated: Negotiated,
    /// The stream.
    pub(crate) buffers: Buffers,
}

impl Camera {
    /// Opens a camera, agrees with its driver on format, size and rate, locks its controls, and starts the stream.
    ///
    /// # Errors
    /// There is no such camera, it may not be opened, another program uses it, or it offers no format that is read. A
    /// control that is to be set may be missing or out of range, or the driver may refuse. A control that cannot be
    /// locked is no error: the state says so.
    pub fn open(request: &CameraRequest) -> Result<Self, Error> {
        let device = Device::open(&request.path)?;
        let identity = device.identity().map_err(|error| device.error("cannot be used", error))?;
        if let Some(reason) = unusable(identity.capabilities) {
            return Err(Error::new(ErrorKind::Unsupported, request.path.display(), reason));
        }
        let negotiated = negotiate::negotiate(&device, request)?;
        let controls = controls::lock(&device, &request.controls, request.keep_controls);
        let mut controls = controls.map_err(|message| Error::new(ErrorKind::Usage, request.path.display(), message))?;
        let buffers = Buffers::start(device)?;
        controls::hold(buffers.device(), &mut controls);
        let state = CameraState {
            path: request.path.clone(),
            links: devices::links_to(&request.path),
            card: identity.card,
            driver: identity.driver,
            bus: identity.bus,
            format: formats::name(negotiated.fourcc),
            controls,
        };
        Ok(Self { state, negotiated, buffers })
    }
}

/// Returns why a node with these capabilities gives no frames.
fn unusable(capabilities: u32) -> Option<&'static str> {
    if capabilities & sys::V4L2_CAP_VIDEO_CAPTURE == 0 {
        return Some(if capabilities & sys::V4L2_CAP_VIDEO_CAPTURE_MPLANE != 0 {
            "a multi-planar capture device, which is not supported"
        } else {
            "does not capture video (an output, metadata or other node); wstac devices lists the cameras"
        });
    }
    if capabilities & sys::V4L2_CAP_STREAMING == 0 {
        return Some("the driver cannot stream");
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(path: &str) -> String {
        Camera::open(&CameraRequest::new(path)).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_camera_is_said_so() {
        assert!(error_of("/dev/video-none").contains("no such file"));
        assert!(error_of("/dev").contains("not a camera"));
        assert!(error_of("/dev/null").contains("not a video device"), "{}", error_of("/dev/null"));
        assert!(error_of("/proc/self/exe").contains("not a camera"));
    }

    #[test]
    fn nodes_that_do_not_capture_are_named() {
        let streaming = sys::V4L2_CAP_STREAMING;
        assert_eq!(unusable(streaming | sys::V4L2_CAP_VIDEO_CAPTURE), None);
        assert!(unusable(streaming | sys::V4L2_CAP_VIDEO_OUTPUT).unwrap().contains("does not capture"));
        assert!(unusable(streaming | sys::V4L2_CAP_VIDEO_CAPTURE_MPLANE).unwrap().contains("multi-planar"));
        assert!(unusable(sys::V4L2_CAP_VIDEO_CAPTURE).unwrap().contains("cannot stream"));
    }
}
