//! The options for cameras.

use wstac_core::rate::FrameRate;
use wstac_host::camera::ControlSetting;
use wstac_host::source::FramePolicy;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::option_text::{control, four_characters, frame_rate, size};

/// The options that every camera is asked for. A scene is simulated with them.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct CameraOptions {
    /// Frames per second to ask every camera for, such as 30 or 30000/1001
    ///
    /// A scene is simulated at this rate. Of a file, it replaces the stated one.
    #[arg(long, value_name = "RATE", value_parser = frame_rate)]
    fps: Option<FrameRate>,

    /// Pixel format to ask every camera for, such as YUYV, GREY or MJPG
    ///
    /// It is a four-character code. wstac devices lists those of a camera.
    #[arg(long, value_name = "FOURCC", value_parser = four_characters)]
    format: Option<[u8; 4]>,

    /// Frame size to ask every camera for, or to simulate
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<(u32, u32)>,

    /// Do not lock the cameras' controls
    #[arg(long)]
    keep_controls: bool,

    /// Set a control of every camera, such as gain=20; can be given several times
    #[arg(long = "control", value_name = "NAME=VALUE", value_parser = control)]
    controls: Vec<ControlSetting>,
}

impl CameraOptions {
    /// Returns the options to open a source with; of a recording of several sensors, it is that of this name.
    pub(crate) fn to_open(&self, delivery: FramePolicy, sensor: Option<String>) -> OpenOptions {
        let Self { fps, format, size, keep_controls, controls } = self.clone();
        OpenOptions { fps, format, size, delivery, keep_controls, controls, sensor }
    }
}
