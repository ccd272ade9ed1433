//! A session of frames that Python pushes.

use std::fs::{self, File};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::params::{COLUMNS, FEATURES, ROWS};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::OutputOptions;
use wstac_host::record::about::About;
use wstac_host::record::labels::check;
use wstac_host::record::{Recorder, new_file};
use wstac_host::session::{Processor, Session};
use wstac_host::source::{Frame, Labels, LossReason, PushedTimes, SourceEvent, StreamClock, SummedFrame};

use crate::config::Config;
use crate::model::{Model, textures};
use crate::outputs::{Gathered, objects, shaped};
use crate::refused;
use crate::stream::{self, Rate};

/// Returns the bytes of a row of `width` pixels; for a planar format those of its luma.
#[pyfunction]
pub(crate) fn row_bytes(format: &str, width: u16) -> PyResult<usize> {
    Ok(stream::row(stream::pixels(format)?, width))
}

/// A session, and what it has given.
struct State {
    session: Session,
    gathered: Gathered,
    waiting: Option<Waiting>,
    /// Watches the frames' own times, if they have some.
    times: Option<PushedTimes>,
    /// Whether it takes sums; `None` before the first.
    of_sums: Option<bool>,
}

/// A recording before its first frame, which says what it has: frames or sums.
struct Waiting {
    /// `None` if the recording could not be started: its file was removed.
    file: Option<File>,
    path: PathBuf,
    about: About,
    /// Frames that were lost before the first.
    lost: u64,
}

impl Drop for Waiting {
    fn drop(&mut self) {
        if self.file.is_some() {
            // Nothing was recorded in it.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Turns frames or their sums into records and features.
#[pyclass(frozen, module = "wstac._wstac")]
pub(crate) struct Pipeline {
    state: Mutex<State>,
    about: String,
    /// The bytes that a frame may have: the last row's padding may be missing.
    frame_bytes: RangeInclusive<usize>,
}

/// The result of a push: records, and features (k, 10).
type Pushed<'py> = (Vec<Bound<'py, PyAny>>, Bound<'py, PyAny>);

#[pymethods]
impl Pipeline {
    #[new]
    #[pyo3(signature = (format, size, bytes_per_row, rate, matrix, range, config, models, motion, paths, at_once, timed, record, labels))]
    #[expect(
        clippy::too_many_arguments,
        clippy::fn_params_excessive_bools,
        reason = "the package calls it, by one keyword each"
    )]
    fn new(
        format: &str,
        size: (u32, u32),
        bytes_per_row: Option<u32>,
        rate: Rate,
        matrix: Option<&str>,
        range: Option<&str>,
        config: &Config,
        models: Vec<Model>,
        motion: bool,
        paths: bool,
        at_once: bool,
        timed: bool,
        record: Option<PathBuf>,
        labels: Labels,
    ) -> PyResult<Self> {
        let color = stream::color(YcbcrEncoding::default(), matrix, range)?;
        let mut info = stream::info(format, size, bytes_per_row, rate, color)?;
        let watch = timed.then(|| PushedTimes::new(&info));
        if timed {
            info.clock = StreamClock::Driver;
        }
        let about = info.about.clone();
        let session = Session::of_frames(info)
            .config(config.0.clone())
            .textures(textures(&models)?)
            .outputs(OutputOptions { features: true, samples: !at_once || paths, motion, paths })
            .build()
            .map_err(crate::failed_by)?;
        let frame_bytes = whole_frame(session.processor());
        let mut waiting = None;
        if let Some(path) = record {
            check(&labels).map_err(refused)?;
            let names = models.iter().map(|model| model.file().about().to_owned()).collect();
            let about = About::new(session.info(), &config.0, labels, names).map_err(crate::failed_by)?;
            let file = Some(new_file(&path).map_err(crate::failed_by)?);
            waiting = Some(Waiting { file, path, about, lost: 0 });
        }
        let state = State { session, gathered: Gathered::default(), waiting, times: watch, of_sums: None };
        Ok(Self { state: Mutex::new(state), about, frame_bytes })
    }

    /// Takes frames, uint8 (n, bytes), one after the other. `time_ns` is the time of a single one.
    #[pyo3(signature = (frames, time_ns = None))]
    fn push<'py>(
        &self,
        py: Python<'py>,
        frames: PyReadonlyArray2<'py, u8>,
        time_ns: Option<u64>,
    ) -> PyResult<Pushed<'py>> {
        let timestamp = time_ns.map(Duration::from_nanos);
        let (bytes, &[count, length]) = (frames.as_slice()?, frames.shape()) else {
            return Err(refused("frames: expected two dimensions"));
        };
        let (least, most) = (*self.frame_bytes.start(), *self.frame_bytes.end());
        if !self.frame_bytes.contains(&length) {
            let padded = if least == most { String::new() } else { format!(" to {most}") };
            return Err(refused(format_args!("{}: frame has {length} bytes, expected {least}{padded}", self.about)));
        }
        let (mut all, mut copy) = (Gathered::default(), Vec::with_capacity(length));
        for frame in bytes.chunks_exact(length).take(count) {
            py.check_signals()?;
            // Without the lock, other threads may write to the array: the frame is copied.
            copy.clear();
            copy.extend_from_slice(frame);
            all.append(self.take(py, SourceEvent::Frame(Frame { timestamp, ..Frame::new(&copy) }))?);
        }
        pushed(py, all)
    }

    /// Takes the 25 sums of a frame, row by row, in place of its bytes.
    #[pyo3(signature = (sums, time_ns = None))]
    fn push_sums<'py>(
        &self,
        py: Python<'py>,
        sums: PyReadonlyArray1<'py, f64>,
        time_ns: Option<u64>,
    ) -> PyResult<Pushed<'py>> {
        let numbers = sums.as_slice()?.to_vec();
        let frame = self.locked(py, |state| SummedFrame::from_numbers(&numbers, state.session.processor().geometry()));
        let timestamp = time_ns.map(Duration::from_nanos);
        let frame = SummedFrame { timestamp, ..frame.map_err(crate::failed_by)? };
        pushed(py, self.take(py, SourceEvent::Taxels(frame))?)
    }

    /// Keeps the place of lost frames in time.
    fn lose<'py>(&self, py: Python<'py>, frames: u64) -> PyResult<Pushed<'py>> {
        pushed(py, self.take(py, SourceEvent::Lost { frames, reason: LossReason::Reported })?)
    }

    /// Ends the stream, once: gives what was pending, then the end.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Pushed<'py>> {
        pushed(py, self.take(py, SourceEvent::End)?)
    }

    /// Returns the taxels of the last frame, float32 (5, 5), each a fraction of full scale; `None` if it was lost.
    fn taxels<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let taxels = self.locked(py, |state| state.session.processor().taxels());
        taxels.map(|taxels| shaped(PyArray1::from_vec(py, taxels.to_vec()), [ROWS, COLUMNS])).transpose()
    }

    /// Returns the number of the feature frame that comes next.
    fn next_frame(&self, py: Python<'_>) -> u64 {
        self.locked(py, |state| state.session.processor().pipeline().next_frame())
    }
}

impl Pipeline {
    /// Uses the state without the interpreter's lock: another thread that has the state may wait for that lock.
    fn locked<T: Send>(&self, py: Python<'_>, of: impl FnOnce(&mut State) -> T + Send) -> T {
        // Nothing in here panics, so the lock is never poisoned.
        py.detach(|| of(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    /// Takes an event, and returns what follows from it.
    fn take(&self, py: Python<'_>, event: SourceEvent<'_>) -> PyResult<Gathered> {
        self.locked(py, |state| state.take(&self.about, event)).map_err(crate::failed_by)
    }
}

impl State {
    fn take(&mut self, about: &str, event: SourceEvent<'_>) -> Result<Gathered, Error> {
        let usage = |message: &str| Err(Error::new(ErrorKind::Usage, about, message));
        if self.session.is_over() {
            return usage("the pipeline is finished, expected a new one for more frames");
        }
        let of_sums = matches!(event, SourceEvent::Taxels(_));
        match self.of_sums {
            Some(false) if of_sums => return usage("sums in a pipeline of frames, expected a pipeline for either"),
            Some(true) if matches!(event, SourceEvent::Frame(_)) => {
                return usage("a frame in a pipeline of sums, expected a pipeline for either");
            }
            _ => {}
        }
        if let SourceEvent::Lost { frames, .. } = &event {
            self.waiting.iter_mut().for_each(|waiting| waiting.lost = waiting.lost.saturating_add(*frames));
        } else {
            self.start_recording(of_sums)?;
            self.of_sums = Some(of_sums);
        }
        let Some(times) = &mut self.times else {
            self.gathered.push(&mut self.session, &event)?;
            return Ok(self.gathered.take_all());
        };
        // A full disk ends the recording; the frame is taken all the same.
        let mut pushed = Ok(());
        for event in times.take(event)? {
            pushed = pushed.and(self.gathered.push(&mut self.session, &event));
        }
        pushed?;
        Ok(self.gathered.take_all())
    }

    /// Starts the recording, if there is one and it has not begun. One that cannot be started goes on waiting.
    fn start_recording(&mut self, of_sums: bool) -> Result<(), Error> {
        let Some(waiting) = &mut self.waiting else { return Ok(()) };
        let file = waiting.file.take().map_or_else(|| new_file(&waiting.path), Ok)?;
        waiting.about.info.taxels_only = of_sums;
        let recorder = Recorder::new(file, &waiting.path, &waiting.about, self.session.processor());
        let mut recorder = recorder.inspect_err(|_| drop(fs::remove_file(&waiting.path)))?;
        if waiting.lost > 0 {
            recorder.source_event(&SourceEvent::Lost { frames: waiting.lost, reason: LossReason::Reported });
        }
        self.gathered.recorder = Some(recorder);
        self.waiting = None;
        Ok(())
    }
}

/// Returns records, and features (k, 10).
fn pushed(py: Python<'_>, all: Gathered) -> PyResult<Pushed<'_>> {
    let Gathered { outputs, features, numbers, .. } = all;
    Ok((objects(py, outputs)?, shaped(PyArray1::from_vec(py, features), [numbers.len(), FEATURES])?))
}

/// Returns the bytes that a whole frame may have: with or without the last row's padding.
pub(crate) fn whole_frame(processor: &Processor) -> RangeInclusive<usize> {
    let geometry = processor.geometry();
    let least = geometry.frame_bytes();
    let rows = usize::from(geometry.layout().frame().height());
    least..=geometry.bytes_per_row().saturating_mul(rows).max(least)
}
