//! Outputs of a session on their way to Python: objects of `wstac._answers`, and numbers for arrays.

use std::time::SystemTime;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::call::PyCallArgs;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyModule};
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::paper::direction::{Direction, Heading};
use wstac_core::paper::speed::Speed;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_core::touch::wave::{Basis, Measured};
use wstac_host::error::Error;
use wstac_host::json::{angle, baseline, confidence, millimeters, rounded, seconds, spread, within_ms};
use wstac_host::output::{MotionReport, Output, Paths, SampleFrames, TactileEvent};
use wstac_host::session::{Observer, Poll, Processor, Session};
use wstac_host::source::SourceEvent;
use wstac_host::texture::Texture;
use wstac_train::dataset::path::frames_of;
use wstac_train::model::trained::in_set_order;

use crate::failed;

/// An output, with the number of the camera frame that comes next: what becomes an object.
pub(crate) type Numbered = (u64, Output);

/// Gathers what passes through a session.
#[derive(Default)]
pub(crate) struct Gathered {
    /// The features of each feature frame, ten per frame, in units of 2^-11.
    pub(crate) features: Vec<i16>,
    /// The number of each feature frame.
    pub(crate) numbers: Vec<i64>,
    /// All other outputs.
    pub(crate) outputs: Vec<Numbered>,
    /// The camera frames, if they are asked for.
    pub(crate) frames: Option<Frames>,
    /// Camera frames so far, lost ones included.
    count: u64,
}

/// The camera frames that arrived.
#[derive(Default)]
pub(crate) struct Frames {
    /// The size of a frame in bytes; `None` if bytes are not asked for.
    pub(crate) size: Option<usize>,
    /// The bytes of all frames.
    pub(crate) bytes: Vec<u8>,
    /// The number of each frame, lost ones counted.
    pub(crate) numbers: Vec<i64>,
    /// The time of each frame in seconds: the driver's own, or that by its number and the rate; NaN if the driver gives
    /// that frame none.
    pub(crate) timestamps: Vec<f64>,
    /// Frames per second, if frames have no times of their own.
    pub(crate) rate: Option<f64>,
    /// The 25 taxels of each frame.
    pub(crate) taxels: Vec<f32>,
}

/// Why reading stops.
pub(crate) enum ReadFailure {
    /// The source cannot be read any further.
    Source(Error),
    /// No memory is left for another frame.
    NoMemory,
}

impl From<Error> for ReadFailure {
    fn from(error: Error) -> Self {
        Self::Source(error)
    }
}

impl From<ReadFailure> for PyErr {
    fn from(failure: ReadFailure) -> Self {
        match failure {
            ReadFailure::Source(error) => Python::attach(|py| failed(py, &error)),
            ReadFailure::NoMemory => PyMemoryError::new_err("frames: no memory is left for another one"),
        }
    }
}

impl Gathered {
    /// Pushes an event into a session and gathers the outputs that follow.
    pub(crate) fn push(&mut self, session: &mut Session, event: &SourceEvent<'_>) -> Result<(), Error> {
        session.push(event);
        while let Poll::Output(output) = session.poll()? {
            self.take(output);
        }
        self.count(event);
        Ok(())
    }

    /// Adds what was gathered after this.
    pub(crate) fn append(&mut self, mut more: Self) {
        self.features.append(&mut more.features);
        self.numbers.append(&mut more.numbers);
        self.outputs.append(&mut more.outputs);
    }

    /// Returns what was gathered. Frames are counted on, and gathered on in the same way.
    pub(crate) fn take_all(&mut self) -> Self {
        let frames =
            self.frames.as_ref().map(|frames| Frames { size: frames.size, rate: frames.rate, ..Frames::default() });
        let next = Self { count: self.count, frames, ..Self::default() };
        std::mem::replace(self, next)
    }

    fn take(&mut self, output: Output) {
        match output {
            Output::Features(frame) => {
                self.features.extend(frame.features);
                self.numbers.push(frame.frame as i64);
            }
            // Events say that they are not reliable.
            Output::BaselineDisturbed { .. } => {}
            output => self.outputs.push((self.count, output)),
        }
    }

    fn count(&mut self, event: &SourceEvent<'_>) {
        let frames = match event {
            SourceEvent::Frame(_) | SourceEvent::Taxels(_) => 1,
            SourceEvent::Lost { frames, .. } => *frames,
            _ => 0,
        };
        self.count = self.count.saturating_add(frames);
    }
}

impl Observer for Gathered {
    type Error = ReadFailure;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), ReadFailure> {
        match (event, &mut self.frames) {
            (SourceEvent::Frame(_), Some(Frames { size: Some(size), bytes, .. })) => {
                bytes.try_reserve(*size).map_err(|_| ReadFailure::NoMemory)
            }
            _ => Ok(()),
        }
    }

    fn output(&mut self, output: Output) -> Result<(), ReadFailure> {
        self.take(output);
        Ok(())
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        if let (Some(frames), Some(taxels)) = (&mut self.frames, processor.taxels()) {
            frames.take(event, &taxels, self.count);
        }
        self.count(event);
        true
    }
}

impl Frames {
    /// Keeps a frame that could be read.
    fn take(&mut self, event: &SourceEvent<'_>, taxels: &[f32; TAXELS], number: u64) {
        let (bytes, timestamp) = match event {
            SourceEvent::Frame(frame) => (frame.bytes, frame.timestamp),
            SourceEvent::Taxels(frame) => (&[][..], frame.timestamp),
            _ => return,
        };
        self.numbers.push(number as i64);
        self.timestamps.push(match self.rate {
            Some(rate) => number as f64 / rate,
            None => timestamp.map_or(f64::NAN, |time| time.as_secs_f64()),
        });
        self.taxels.extend(taxels);
        if let (Some(size), false) = (self.size, bytes.is_empty()) {
            // Bytes that a driver appends are not part of the frame. The last row's padding may be missing.
            let part = bytes.get(..size).unwrap_or(bytes);
            self.bytes.extend_from_slice(part);
            self.bytes.resize(self.bytes.len() + size - part.len(), 0);
        }
    }
}

pub(crate) fn objects(py: Python<'_>, outputs: Vec<Numbered>) -> PyResult<Vec<Bound<'_, PyAny>>> {
    let classes = Classes(py.import("wstac._answers")?);
    outputs.into_iter().filter_map(|(at, output)| classes.object(at, output).transpose()).collect()
}

/// The times of a record: nanoseconds, the wall clock and its uncertainty in milliseconds.
#[derive(Clone, Copy, Default)]
struct Times(Option<u64>, Option<SystemTime>, Option<f64>);

impl Times {
    fn of(output: &Output) -> Self {
        let stamp = output.stamp();
        Self(output.time_ns(), stamp.map(|stamp| stamp.time), stamp.map(within_ms))
    }
}

/// The classes of `wstac._answers`.
struct Classes<'py>(Bound<'py, PyModule>);

impl<'py> Classes<'py> {
    fn make(&self, class: &str, fields: impl PyCallArgs<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.getattr(class)?.call1(fields)
    }

    /// Returns the object of an output; `None` for outputs that become none. `at` is the number of the camera frame
    /// that comes next.
    fn object(&self, at: u64, output: Output) -> PyResult<Option<Bound<'py, PyAny>>> {
        let moment = Times::of(&output);
        let object = match output {
            Output::Event(event) => self.event(*event),
            Output::EarlyTexture(early) => self.make(
                "EarlyTexture",
                (early.frame, early.frames, self.texture(&early.texture)?, moment.0, moment.1, moment.2),
            ),
            Output::Interrupted(sample) => self.incomplete(sample.frame, sample.frames, moment),
            Output::Motion(report) => self.motion(&report, moment),
            Output::ContactEnd(end) => {
                let time_s = end.time_s.map(seconds);
                self.make("ContactEnd", (end.frame, end.event_frame, time_s, moment.0, moment.1, moment.2))
            }
            Output::Lost(lost) => self.make("Lost", (at, lost.frames, lost.reason.name())),
            Output::Fault(report) => {
                let fault = (report.fault.kind.name(), report.fault.to_string());
                self.make("Fault", (report.frame, fault.0, fault.1, moment.0, moment.1, moment.2))
            }
            Output::End(end) => {
                let sample = end.incomplete;
                let incomplete = sample.map(|sample| self.incomplete(sample.frame, sample.frames, Times::default()));
                let (incomplete, clock) = (incomplete.transpose()?, end.clock.as_str());
                let Times(time_ns, stamp, within) = moment;
                let (lost, readout) = (end.dropped_by.iter().into_py_dict(self.0.py())?, end.readout.ms());
                let (frames, dropped, baseline) = (end.frames, end.dropped, baseline(&end));
                let fields = (frames, dropped, baseline, incomplete, clock, time_ns, stamp, within, lost, readout);
                self.make("End", fields)
            }
            _ => return Ok(None),
        };
        object.map(Some)
    }

    fn event(&self, event: TactileEvent) -> PyResult<Bound<'py, PyAny>> {
        let py = self.0.py();
        let (why, why_texture) = (PyDict::new(py), event.why_texture());
        let (direction, paths) = (event.direction, event.paths.as_deref());
        let missing = [
            ("speed", event.speed.err().map(Reason::as_str)),
            ("direction", direction.degrees.err().map(Reason::as_str)),
            ("texture", why_texture.as_deref()),
            ("reliable", event.doubt.map(Reason::as_str)),
        ];
        for (answer, reason) in missing {
            if let Some(reason) = reason {
                why.set_item(answer, reason)?;
            }
        }
        let speed = event.speed.ok().map(|speed| self.speed(speed)).transpose()?;
        let speed_at_most = event.speed_at_most.map(|speed| self.speed(speed)).transpose()?;
        let fields = [
            ("frame", event.frame.into_bound_py_any(py)?),
            ("frames", SAMPLE_FRAMES.into_bound_py_any(py)?),
            ("time_ns", event.time_ns.into_bound_py_any(py)?),
            ("completed_ns", event.completed_ns.into_bound_py_any(py)?),
            ("touch_frame", event.touch_frame.into_bound_py_any(py)?),
            ("end_frame", event.end_frame.into_bound_py_any(py)?),
            ("time_s", event.time.map(|time| seconds(time.touch_s)).into_bound_py_any(py)?),
            ("completed_s", event.time.map(|time| seconds(time.completed_s)).into_bound_py_any(py)?),
            ("stamp", event.stamp.map(|stamp| stamp.time).into_bound_py_any(py)?),
            ("stamp_within_ms", event.stamp.map(within_ms).into_bound_py_any(py)?),
            ("contact", event.contact.map(Contact::as_str).into_bound_py_any(py)?),
            ("duration_frames", event.lit_frames.into_bound_py_any(py)?),
            ("speed", speed.into_bound_py_any(py)?),
            ("speed_at_most", speed_at_most.into_bound_py_any(py)?),
            ("direction", self.direction(direction)?.into_bound_py_any(py)?),
            ("basis", event.basis.map(Basis::as_str).into_bound_py_any(py)?),
            ("place_mm", self.measured(event.extent.and_then(|extent| extent.place_mm))?),
            ("width_mm", self.measured(event.extent.and_then(|extent| extent.width_mm))?),
            ("contacts", event.extent.map(|extent| extent.contacts).into_bound_py_any(py)?),
            ("acceleration", self.acceleration(event.acceleration)?),
            ("texture", event.texture.ok().map(|texture| self.texture(&texture)).transpose()?.into_bound_py_any(py)?),
            ("frames_filled", event.frames_filled.into_bound_py_any(py)?),
            ("reliable", event.reliable.into_bound_py_any(py)?),
            ("why", why.into_any()),
            ("sample", event.sample.map(|sample| over_time(py, &sample)).transpose()?.into_bound_py_any(py)?),
            ("path_sample", along_path(py, paths, Input::Path)?),
            ("taxel_path_sample", along_path(py, paths, Input::TaxelPath)?),
        ];
        self.0.getattr("Event")?.call((), Some(&fields.into_py_dict(py)?))
    }

    fn motion(&self, report: &MotionReport, moment: Times) -> PyResult<Bound<'py, PyAny>> {
        let velocity = report.velocity;
        let speed = self.speed(Speed::by_arrival(velocity.mm_s, velocity.mm_s_sd))?;
        let degrees = angle(velocity.degrees).into_bound_py_any(self.0.py())?;
        let direction = self.make("Direction", (degrees, Some(spread(velocity.degrees_sd)), None::<f64>))?;
        let time_s = report.time_s.map(seconds);
        let basis = report.basis.map(Basis::as_str);
        self.make("Motion", (report.frame, time_s, speed, direction, moment.0, moment.1, moment.2, basis))
    }

    fn measured(&self, measured: Option<Measured>) -> PyResult<Bound<'py, PyAny>> {
        let of = |Measured { value, sd }| self.make("Measured", (millimeters(value), millimeters(sd)));
        measured.map(of).transpose()?.into_bound_py_any(self.0.py())
    }

    fn acceleration(&self, measured: Option<Measured>) -> PyResult<Bound<'py, PyAny>> {
        let of = |Measured { value, sd }| self.make("Acceleration", (millimeters(value), millimeters(sd).max(0.01)));
        measured.map(of).transpose()?.into_bound_py_any(self.0.py())
    }

    fn speed(&self, speed: Speed) -> PyResult<Bound<'py, PyAny>> {
        let sd = speed.sd.map(rounded);
        // Only a law of durations was fitted on a range.
        let extrapolated = sd.is_none().then_some(speed.extrapolated);
        self.make("Speed", (rounded(speed.mm_s), sd, extrapolated))
    }

    /// Returns the object of a direction; `None` if arrival times give none.
    fn direction(&self, direction: Direction) -> PyResult<Option<Bound<'py, PyAny>>> {
        let py = self.0.py();
        let fields = if let Some(confidence) = confidence(direction) {
            // By centroids, one of four whole numbers.
            let degrees = direction.heading().map(Heading::degrees);
            (degrees.into_bound_py_any(py)?, None, Some(confidence))
        } else {
            let (Ok(degrees), Some(sd)) = (direction.degrees, direction.sd) else { return Ok(None) };
            (angle(degrees).into_bound_py_any(py)?, Some(spread(sd)), None)
        };
        self.make("Direction", fields).map(Some)
    }

    fn texture(&self, texture: &Texture) -> PyResult<Bound<'py, PyAny>> {
        let Texture { specimen, pattern, depth_mm, class, confidence, known } = texture;
        self.make("Texture", (specimen, pattern, *depth_mm, class, *confidence, *known))
    }

    fn incomplete(&self, frame: u64, frames: u8, moment: Times) -> PyResult<Bound<'py, PyAny>> {
        self.make("Incomplete", (frame, frames, moment.0, moment.1, moment.2))
    }
}

/// Returns a sample as an array: ten features over 70 frames.
fn over_time<'py>(py: Python<'py>, sample: &SampleFrames) -> PyResult<Bound<'py, PyAny>> {
    let values = (0..FEATURES).flat_map(|feature| sample.iter().map(move |frame| frame[feature]));
    shaped(PyArray1::from_vec(py, values.collect()), [FEATURES, SAMPLE_FRAMES])
}

/// Returns a sample along the path as data sets have it: zeros if there is none, or if it shows too little of the path.
/// It is `None` if none was asked for.
fn along_path<'py>(py: Python<'py>, paths: Option<&Paths>, input: Input) -> PyResult<Bound<'py, PyAny>> {
    let Some(paths) = paths else { return Ok(py.None().into_bound(py)) };
    let sample = if input == Input::TaxelPath { &paths.taxels } else { &paths.sums };
    let whole = sample.as_ref().filter(|sample| sample.covers(frames_of(input)));
    let numbers = whole.map_or([0; INPUTS], |sample| in_set_order(sample.numbers()));
    shaped(PyArray1::from_slice(py, &numbers), [FEATURES, SAMPLE_FRAMES])
}

pub(crate) fn shaped<T: numpy::Element, const N: usize>(
    array: Bound<'_, PyArray1<T>>,
    shape: [usize; N],
) -> PyResult<Bound<'_, PyAny>> {
    Ok(array.reshape(&shape[..])?.into_any())
}
