//! The actions that a program allows a page besides showing a sensor.

use std::fmt;
use std::path::PathBuf;

use wstac_host::camera::{ControlValue, DeviceInfo};
use wstac_host::error::Error;

/// The actions that a page has besides showing a sensor. By default it may calibrate and examine the sensor; nothing is
/// written.
#[derive(Default)]
pub struct Tools {
    /// The folder of recordings; `None` refuses them.
    pub record_to: Option<PathBuf>,
    /// The file of a calibration; with `None` the page offers it as a download.
    pub calibrate_to: Option<CalibrationFile>,
    /// The camera, for the examination of its controls; `None` for other sources.
    pub camera: Option<Box<dyn ExaminedCamera>>,
    /// The frames per second that the camera was asked for.
    pub asked_fps: Option<f64>,
}

impl fmt::Debug for Tools {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.calibrate_to.as_ref().map(|file| &file.name);
        f.debug_struct("Tools").field("record_to", &self.record_to).field("calibrate_to", &file).finish_non_exhaustive()
    }
}

/// The file that a calibration is written to.
pub struct CalibrationFile {
    /// Its name, for people.
    pub name: String,
    /// Writes the text of a configuration, completely or not at all. A later calibration replaces the file.
    pub write: Box<WriteFile>,
}

/// Writes the text of a file.
pub type WriteFile = dyn FnMut(&str) -> Result<(), Error> + Send;

impl fmt::Debug for CalibrationFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CalibrationFile").field("name", &self.name).finish_non_exhaustive()
    }
}

/// A camera whose controls the doctor compares.
pub trait ExaminedCamera: Send {
    /// Returns the values of all controls.
    ///
    /// # Errors
    /// The camera cannot be asked.
    fn controls(&self) -> Result<Vec<ControlValue>, Error>;

    /// Returns the identity of the camera.
    ///
    /// # Errors
    /// The camera is gone.
    fn device(&self) -> Result<DeviceInfo, Error>;
}
