//! Outputs of a session on their way to Python: objects of `wstac._answers`, and numbers for arrays.

use std::time::SystemTime;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyModule};
use wstac_core::model::file::Input;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_host::error::Error;
use wstac_host::json::{JsonLine, within_ms};
use wstac_host::monitor::Report;
use wstac_host::output::{Output, Paths, SampleFrames};
use wstac_host::record::Recorder;
use wstac_host::session::{Observer, Poll, Processor, Session};
use wstac_host::source::SourceEvent;
use wstac_host::text::text_of;
use wstac_train::dataset::path::path_sample;
use wstac_train::model::trained::in_set_order;

use crate::failed;

/// The most notes that are kept of a board's line.
const MOST_NOTES: usize = 1000;

/// A thing that becomes an object, with the number of the frame that comes next: of the camera, or of a board's
/// features.
pub(crate) enum Found {
    Output(u64, Output),
    /// A fault of a board's line: its kind and a message.
    Fault(u64, &'static str, String),
}

/// Gathers what passes through a session.
#[derive(Default)]
pub(crate) struct Gathered {
    /// The features of each feature frame, ten per frame, in units of 2^-11.
    pub(crate) features: Vec<i16>,
    /// The number of each feature frame.
    pub(crate) numbers: Vec<i64>,
    /// The 25 taxel sums that each feature frame is made of; 0 of a board.
    pub(crate) taxel_sums: Vec<u32>,
    /// The number of the last camera frame that arrived of each feature frame.
    pub(crate) last_frames: Vec<i64>,
    /// All other outputs.
    pub(crate) outputs: Vec<Found>,
    /// The camera frames, if they are asked for.
    pub(crate) frames: Option<Frames>,
    /// Notes of a board's line.
    pub(crate) notes: Vec<String>,
    /// The recording of what is pushed, if there is one.
    pub(crate) recorder: Option<Recorder>,
    /// Camera frames so far, lost ones included.
    count: u64,
    /// The number of the last camera frame that arrived.
    last_frame: u64,
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
    /// The 25 taxels of each frame; NaN of a board.
    pub(crate) taxels: Vec<f32>,
    /// The 25 taxel sums of each frame; 0 of a board.
    pub(crate) sums: Vec<u32>,
    /// The wall-clock time of each frame, if the source knows it.
    pub(crate) stamps: Vec<Option<SystemTime>>,
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
    /// Pushes an event into a session, and gathers and records the outputs that follow. The end of the stream, or a
    /// full disk, ends the recording.
    pub(crate) fn push(&mut self, session: &mut Session, event: &SourceEvent<'_>) -> Result<(), Error> {
        if let Some(recorder) = &mut self.recorder {
            recorder.source_event(event);
        }
        session.push(event);
        while let Poll::Output(output) = session.poll()? {
            if let Some(recorder) = &mut self.recorder {
                let mut line = output.clone();
                if let Output::Event(event) = &mut line {
                    // It follows from the frames.
                    event.sample = None;
                }
                recorder.output(&line, &text_of(&line));
            }
            self.take(output);
        }
        self.count(event);
        let goes_on = self.recorder.as_mut().is_none_or(|recorder| recorder.processed(event, session.processor()));
        let ended = self.recorder.take_if(|_| !goes_on || matches!(event, SourceEvent::End));
        ended.map_or(Ok(()), |recorder| recorder.finish().map(drop))
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
        let recorder = self.recorder.take();
        let notes = std::mem::take(&mut self.notes);
        let Self { count, last_frame, .. } = *self;
        std::mem::replace(self, Self { frames, notes, recorder, count, last_frame, ..Self::default() })
    }

    fn take(&mut self, output: Output) {
        match output {
            Output::Features(frame) => {
                self.features.extend(frame.features);
                self.taxel_sums.extend(frame.sums.unwrap_or_default());
                self.numbers.push(frame.frame as i64);
            }
            // Events say that they are not reliable.
            Output::BaselineDisturbed { .. } => {}
            output => self.outputs.push(Found::Output(self.count, output)),
        }
    }

    /// Takes what a board has sent, but not its outputs. Its features stand for a frame.
    fn take_report(&mut self, report: &Report) {
        match report {
            Report::Output(Output::Features(features)) => {
                if let Some(frames) = &mut self.frames {
                    frames.numbers.push(features.frame as i64);
                    frames.timestamps.push(features.time_ns.map_or(f64::NAN, |time| time as f64 / 1e9));
                    frames.taxels.extend([f32::NAN; TAXELS]);
                    frames.sums.extend([0; TAXELS]);
                    frames.stamps.push(features.stamp.map(|stamp| stamp.time));
                }
                (self.last_frame, self.count) = (features.frame, features.frame.saturating_add(1));
            }
            Report::LostEvents(_) => {
                let message = report.message().unwrap_or_default().into_owned();
                self.outputs.push(Found::Fault(self.count, "lost_events", message));
            }
            Report::Note(note) => {
                self.notes.truncate(MOST_NOTES - 1);
                self.notes.push(note.clone());
            }
            _ => {}
        }
    }

    /// Notes a camera frame that arrived as the last one of a feature frame that it or a loss has completed.
    fn note_last(&mut self, event: &SourceEvent<'_>, processor: &Processor) {
        if matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_)) && processor.taxel_sums().is_some() {
            self.last_frame = self.count;
        }
        if self.last_frames.len() < self.numbers.len() {
            self.last_frames.push(self.last_frame as i64);
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
            (SourceEvent::Report(report), _) => {
                self.take_report(report);
                Ok(())
            }
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
        if let (Some(frames), Some(taxels), Some(sums)) = (&mut self.frames, processor.taxels(), processor.taxel_sums())
        {
            frames.take(event, &taxels, &sums, self.count);
        }
        self.note_last(event, processor);
        self.count(event);
        true
    }
}

impl Frames {
    /// Keeps a frame that could be read.
    fn take(&mut self, event: &SourceEvent<'_>, taxels: &[f32; TAXELS], sums: &[u32; TAXELS], number: u64) {
        let (bytes, timestamp, stamp) = match event {
            SourceEvent::Frame(frame) => (frame.bytes, frame.timestamp, frame.stamp),
            SourceEvent::Taxels(frame) => (&[][..], frame.timestamp, frame.stamp),
            _ => return,
        };
        self.numbers.push(number as i64);
        self.timestamps.push(match self.rate {
            Some(rate) => number as f64 / rate,
            None => timestamp.map_or(f64::NAN, |time| time.as_secs_f64()),
        });
        self.taxels.extend(taxels);
        self.sums.extend(sums);
        self.stamps.push(stamp.map(|stamp| stamp.time));
        if let (Some(size), false) = (self.size, bytes.is_empty()) {
            // Bytes that a driver appends are not part of the frame. The last row's padding may be missing.
            let part = bytes.get(..size).unwrap_or(bytes);
            self.bytes.extend_from_slice(part);
            self.bytes.resize(self.bytes.len() + size - part.len(), 0);
        }
    }
}

/// Returns the objects of `wstac._answers`. They are made from lines of JSON, so that fields have one list.
pub(crate) fn objects(py: Python<'_>, outputs: Vec<Found>) -> PyResult<Vec<Bound<'_, PyAny>>> {
    let classes = py.import("wstac._answers")?;
    let object = |found| match found {
        Found::Output(at, output) => object(&classes, at, output).transpose(),
        Found::Fault(at, kind, message) => {
            Some(classes.getattr("Fault").and_then(|class| class.call1((at, kind, message))))
        }
    };
    outputs.into_iter().filter_map(object).collect()
}

/// Returns the object of an output; `None` for outputs that become none. `at` is the number of the camera frame that
/// comes next.
fn object<'py>(classes: &Bound<'py, PyModule>, at: u64, mut output: Output) -> PyResult<Option<Bound<'py, PyAny>>> {
    let py = classes.py();
    let more = PyDict::new(py);
    match &mut output {
        Output::Lost(lost) => return classes.getattr("Lost")?.call1((at, lost.frames, lost.reason.name())).map(Some),
        Output::Event(event) => {
            let paths = event.paths.as_deref();
            more.set_item("path_sample", along_path(py, paths, Input::Path)?)?;
            more.set_item("taxel_path_sample", along_path(py, paths, Input::TaxelPath)?)?;
            more.set_item("taxels_sample", along_path(py, paths, Input::Taxels)?)?;
            more.set_item("sample", over_time(py, event.sample.as_deref())?)?;
        }
        _ => {}
    }
    if let Some(stamp) = output.stamp() {
        more.set_item("stamp", stamp.time)?;
        more.set_item("stamp_within_ms", within_ms(stamp))?;
    }
    let Some(line) = JsonLine::new(&output) else { return Ok(None) };
    let line = serde_json::to_string(&line).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    classes.getattr("of_line")?.call((line,), Some(&more)).map(Some)
}

/// Returns a sample as an array: ten features over 70 frames, or over none.
fn over_time<'py>(py: Python<'py>, sample: Option<&SampleFrames>) -> PyResult<Bound<'py, PyAny>> {
    let frames = sample.map_or(&[][..], |sample| sample.as_slice());
    let values = (0..FEATURES).flat_map(|feature| frames.iter().map(move |frame| frame[feature]));
    shaped(PyArray1::from_vec(py, values.collect()), [FEATURES, frames.len()])
}

/// Returns a sample along the path, or of taxels, as data sets have it: zeros if there is none, or if it shows too
/// little of the path. It is `None` if none was asked for.
fn along_path<'py>(py: Python<'py>, paths: Option<&Paths>, input: Input) -> PyResult<Bound<'py, PyAny>> {
    let Some(paths) = paths else { return Ok(py.None().into_bound(py)) };
    let numbers = path_sample(paths, input).map_or_else(|| vec![0; input.numbers()], in_set_order);
    let rows = numbers.len() / SAMPLE_FRAMES;
    shaped(PyArray1::from_vec(py, numbers), [rows, SAMPLE_FRAMES])
}

pub(crate) fn shaped<T: numpy::Element, const N: usize>(
    array: Bound<'_, PyArray1<T>>,
    shape: [usize; N],
) -> PyResult<Bound<'_, PyAny>> {
    Ok(array.reshape(&shape[..])?.into_any())
}
