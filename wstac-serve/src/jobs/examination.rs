//! The doctor's examination of a sensor that nothing touches.

use serde::Serialize;
use wstac_host::camera::ControlValue;
use wstac_host::error::Error;
use wstac_host::source::SourceEvent;
use wstac_host::station::Station;
use wstac_setup::doctor::controls::compare;
use wstac_setup::doctor::measure::{Limit, Measurement};
use wstac_setup::doctor::verdict::Finding;
use wstac_setup::doctor::{CameraReport, Known, examine};

use crate::tools::Tools;

/// Seconds of an examination, as of `wstac doctor` without `--seconds`.
const SECONDS: f64 = 10.0;

pub(super) struct Examining {
    measurement: Box<Measurement>,
    /// The controls of the camera at the start.
    before: Option<Vec<ControlValue>>,
    /// Why it has failed: the source broke off.
    failure: Option<Error>,
}

/// An examination in progress, as the page gets it.
#[derive(Debug, Serialize)]
pub(super) struct ExaminationProgress {
    /// Seconds so far, and all of them.
    seconds: [f64; 2],
}

/// The result of an examination, as the page gets it.
#[derive(Debug, Default, Serialize)]
pub(super) struct Examined {
    /// Why there is none.
    error: Option<String>,
    verdict: Vec<Finding>,
    /// The report of `wstac doctor`.
    text: String,
}

impl Examined {
    pub(super) fn failed(error: &Error) -> Self {
        Self { error: Some(error.to_string()), ..Self::default() }
    }
}

impl Examining {
    /// Starts an examination.
    ///
    /// # Errors
    /// The camera cannot be asked for its controls.
    pub(super) fn start(station: &Station, tools: &Tools) -> Result<Self, Error> {
        // The camera has settled: it is read all the time.
        let limit = Limit { settling: 0, seconds: SECONDS, frames: None };
        let before = tools.camera.as_ref().map(|camera| camera.controls()).transpose()?;
        let measurement = Box::new(Measurement::new(station.info(), station.config(), limit)?);
        Ok(Self { measurement, before, failure: None })
    }

    pub(super) fn take(&mut self, event: &SourceEvent<'_>) {
        if !self.is_over() {
            self.failure = self.measurement.take(event).err();
        }
    }

    /// Returns whether it takes no more events.
    pub(super) fn is_over(&self) -> bool {
        self.failure.is_some() || !self.measurement.goes_on()
    }

    pub(super) fn progress(&self) -> ExaminationProgress {
        let seconds = (10.0 * self.measurement.seconds()).round() / 10.0;
        ExaminationProgress { seconds: [seconds.min(SECONDS), SECONDS] }
    }

    /// Ends the examination.
    ///
    /// # Errors
    /// The source broke off, there were too few frames, or the camera is gone.
    pub(super) fn finish(self, station: &Station, tools: &Tools) -> Result<Examined, Error> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let state = station.session().info().camera.as_deref();
        let measured = self.measurement.finish()?;
        let examined = match (&tools.camera, self.before, state) {
            (Some(camera), Some(before), Some(state)) => {
                let controls = compare(&state.controls, &before, &camera.controls()?);
                (Some(CameraReport { device: camera.device()?, format: state.format.clone() }), controls)
            }
            _ => (None, Vec::new()),
        };
        let known = Known { asked_fps: tools.asked_fps, black: None };
        // MJPEG is compared by opening the camera again, which `wstac doctor` does.
        let report = examine(station.info(), station.config(), &measured, known, examined, None)?;
        Ok(Examined { error: None, text: report.to_string(), verdict: report.verdict })
    }
}
