#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | what it has |
//! | --- | --- |
//! | [`source`] | a camera as a source, which reconnects |
//! | [`rpicam`] | a camera of a Raspberry Pi as a source |
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
mod readout;
pub mod rpicam;
pub(crate) mod same;
mod silence;
pub mod source;
mod timeline;
mod wall_clock;

use std::path::Path;

use v4l::v4l_sys as sys;

use buffers::{Buffers, Stream};
use device::Device;
pub use devices::{device_at, devices};
pub use negotiate::Negotiated;
use wstac_host::camera::CameraState;
use wstac_host::camera::formats;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::open::OpenOptions;

/// A camera that streams.
#[derive(Debug)]
pub struct Camera {
    /// Its identity, and the state of its controls.
    pub state: CameraState,
    /// The properties of its frames.
    pub negotiated: Negotiated,
    /// The stream.
    pub(crate) buffers: Box<dyn Stream>,
}

impl Camera {
    /// Opens the camera of a device node, such as `/dev/video0`: agrees with its driver on format, size and rate, locks
    /// its controls, and starts the stream.
    ///
    /// Without options it is asked for the paper's 1280x720 at 30 frames per second, in the format that suits these
    /// best.
    ///
    /// # Errors
    /// There is no such camera, it may not be opened, another program uses it, or it offers no format that is read. A
    /// control that is to be set may be missing or out of range, or the driver may refuse. A control that cannot be
    /// locked is no error: the state says so.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, Error> {
        let device = Device::open(path)?;
        let identity = device.identity().map_err(|error| device.error("cannot be used", error))?;
        if let Some(reason) = unusable(identity.capabilities) {
            return Err(Error::new(ErrorKind::Unsupported, path.display(), reason));
        }
        let negotiated = negotiate::negotiate(&device, options)?;
        let controls = controls::lock(&device, &options.controls, options.keep_controls);
        let mut controls = controls.map_err(|message| Error::new(ErrorKind::Usage, path.display(), message))?;
        let buffers = Box::new(Buffers::start(device)?);
        controls::hold(buffers.device(), &mut controls);
        let state = CameraState {
            path: path.to_path_buf(),
            links: devices::links_to(path),
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
        Camera::open(Path::new(path), &OpenOptions::default()).unwrap_err().to_string()
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
