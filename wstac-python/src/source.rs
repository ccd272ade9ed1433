//! Sources of frames: files, scenes and cameras, read event by event or to their end.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use wstac_core::params::{COLUMNS, FEATURES, ROWS};
use wstac_core::rate::FrameRate;
use wstac_host::camera::ControlSetting;
use wstac_host::config::Config as Parsed;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::monitor::port::port_of;
use wstac_host::output::OutputOptions;
use wstac_host::record::labels::check;
use wstac_host::record::{FinishedRecording, new_file};
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{FramePolicy, Labels, Recorded, Source as Open, StreamClock, config_of};
use wstac_host::station::{Station, Turn};
use wstac_scene::SceneConfig;
use wstac_scene::source::{SceneSource, script};
use wstac_train::dataset::arrays::name;

use crate::config::{Config, table};
use crate::model::{Model, textures};
use crate::outputs::{Frames, Gathered, ReadFailure, objects, shaped};
use crate::pipeline::whole_frame;
use crate::stream::{self, Rate};
use crate::{refused, waiting};

/// The options that Python requests of a source. `None` requests nothing.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of its own")]
pub(crate) struct SourceOptions {
    rate: Option<Rate>,
    format: Option<String>,
    size: Option<(u32, u32)>,
    matrix: Option<String>,
    range: Option<String>,
    every: bool,
    keep_controls: bool,
    controls: BTreeMap<String, i32>,
    config: Option<Config>,
    models: Vec<Model>,
    motion: bool,
    paths: bool,
    at_once: bool,
    sensor: Option<String>,
    paced: bool,
    baud: Option<u32>,
}

impl SourceOptions {
    /// Returns the outputs that are wanted.
    fn outputs(&self, features: bool) -> OutputOptions {
        OutputOptions { features, samples: !self.at_once || self.paths, motion: self.motion, paths: self.paths }
    }

    /// Returns the name of an option that is given and that a board cannot follow.
    fn not_of_boards(&self) -> Option<&'static str> {
        let given = [
            ("fps", self.rate.is_some()),
            ("format", self.format.is_some()),
            ("size", self.size.is_some()),
            ("matrix", self.matrix.is_some()),
            ("range", self.range.is_some()),
            ("controls", !self.controls.is_empty()),
            ("config", self.config.is_some()),
            ("models", !self.models.is_empty()),
            ("path_samples", self.paths),
            ("sensor", self.sensor.is_some()),
            ("every", self.every),
            ("keep_controls", self.keep_controls),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(name, _)| name)
    }

    /// Returns the part that opens the source.
    fn open(&self) -> PyResult<OpenOptions> {
        let rate = self.rate.map(|(numerator, denominator)| FrameRate::new(numerator, denominator));
        let format = self.format.as_deref().map(|format| {
            let padded = format!("{format:<4}");
            let code = <[u8; 4]>::try_from(padded.as_bytes()).ok().filter(|code| code.is_ascii());
            code.ok_or_else(|| {
                refused(format_args!("format is {format:?}, expected a four-character code such as YUYV"))
            })
        });
        let controls = self.controls.iter().map(|(name, &value)| ControlSetting { name: name.clone(), value });
        Ok(OpenOptions {
            fps: rate.transpose().map_err(refused)?,
            format: format.transpose()?,
            size: self.size,
            delivery: if self.every { FramePolicy::Every } else { FramePolicy::Newest },
            keep_controls: self.keep_controls,
            controls: controls.collect(),
            baud: self.baud,
            sensor: self.sensor.clone(),
        })
    }
}

/// A source that is being read.
#[pyclass(frozen, module = "wstac._wstac")]
pub(crate) struct Source {
    state: Mutex<ReadState>,
    /// The orders that wait for the state. A reader gives way to them: it would have the state again before they wake.
    asked: AtomicUsize,
    about: String,
    /// Four-character code, width, height, bytes from row to row.
    shape: (String, u32, u32, u32),
    rate: Rate,
    /// Whether frames have times of their own.
    has_times: bool,
    recorded: Recorded,
    config: Mutex<Parsed>,
    /// The encoding of `sensor_msgs/Image` for its pictures.
    ros: Option<&'static str>,
    /// The size of a frame in bytes, the last row's padding included.
    frame_bytes: usize,
}

/// A recording that has ended: its file, frames and bytes, and what a person should know of it.
type EndedRecording = (PathBuf, u64, u64, &'static str);

/// The result of a recording that nobody has taken yet.
type Ended = Option<Result<FinishedRecording, Error>>;

/// The reason why a board follows no order.
const IS_BOARD: &str = "is a board, which finds its events itself; wstac board changes its settings";

struct ReadState {
    /// `None` after the end: the file, camera or port is released.
    station: Option<Box<Station>>,
    /// Notes for a person about what nothing states of it.
    notes: Vec<String>,
    /// The result of a recording that the end of the source or a full disk has ended.
    ended: Ended,
    gathered: Gathered,
    /// Whether it was closed before its end.
    closed: bool,
    /// Why reading stopped, until it is raised.
    failure: Option<ReadFailure>,
}

/// Opens a source, as `wstac run` does.
#[pyfunction]
pub(crate) fn open_source(py: Python<'_>, spec: OsString, options: SourceOptions, features: bool) -> PyResult<Source> {
    match (port_of(&spec), options.baud) {
        (Some(port), baud) => {
            if let Some(name) = options.not_of_boards() {
                let message = format_args!("{}: a board finds events itself; leave {name} out", port.display());
                return Err(refused(message));
            }
            if baud.is_some() && !port.as_encoded_bytes().starts_with(b"/") {
                return Err(refused(format_args!("{}: is no serial line; leave baud out", port.display())));
            }
        }
        (None, Some(_)) => return Err(refused(format_args!("{}: is no board; leave baud out", spec.display()))),
        (None, None) => {}
    }
    let open_options = options.open()?;
    let source = waiting(py, || wstac::open_source(&spec, &open_options))?;
    Source::new(source, &options, features, options.paced && !wstac_linux::source::is_camera(spec))
}

/// A touch of a scene as it truly is: the fields of `wstac.Truth`.
type Truth = (&'static str, Option<String>, Option<f64>, Option<f64>, u64, f64, f64);

/// Opens a scene: its short form or file, or a table in JSON. Returns also what truly happens in it.
#[pyfunction]
pub(crate) fn open_scene(
    py: Python<'_>,
    scene: OsString,
    is_table: bool,
    options: SourceOptions,
) -> PyResult<(Source, Vec<Truth>)> {
    let script = if is_table {
        SceneConfig::from_table("scene", table("scene", &scene.to_string_lossy())?).map_err(crate::failed_by)?
    } else {
        let options = options.open()?;
        waiting(py, || script(&scene, &options))?
    };
    let source = waiting(py, || SceneSource::new(&script))?;
    let truth = source.truth().iter().map(|truth| {
        let slide = truth.touch.slide();
        let specimen = slide.map(|slide| name(&slide.specimen));
        let (speed, degrees) = (slide.map(|slide| slide.speed_mm_s), slide.map(|slide| slide.direction_deg));
        (truth.touch.kind(), specimen, speed, degrees, truth.start_frame(), truth.start_s, truth.end_s)
    });
    let truth = truth.collect();
    Ok((Source::new(Box::new(source), &options, true, false)?, truth))
}

#[pyfunction]
pub(crate) fn is_camera(spec: OsString) -> bool {
    wstac_linux::source::is_camera(spec)
}

#[pyfunction]
pub(crate) fn is_board(spec: OsString) -> bool {
    port_of(&spec).is_some()
}

#[pymethods]
impl Source {
    /// Returns what it is, for a person.
    #[getter]
    fn about(&self) -> &str {
        &self.about
    }

    /// Returns the four-character code of its frames, their width and height, and the bytes from row to row.
    #[getter]
    fn shape(&self) -> (String, u32, u32, u32) {
        self.shape.clone()
    }

    /// Returns the numerator and the denominator of frames per second.
    #[getter]
    fn rate(&self) -> Rate {
        self.rate
    }

    /// Returns the labels of a recording.
    #[getter]
    fn labels(&self) -> BTreeMap<String, String> {
        self.recorded.labels.clone()
    }

    /// Returns the texture models that a recording was made with.
    #[getter]
    fn models(&self) -> Vec<String> {
        self.recorded.models.clone()
    }

    /// Returns notes for a person about what nothing states of it.
    #[getter]
    fn notes(&self, py: Python<'_>) -> Vec<String> {
        self.asked(py, |state| state.notes.iter().chain(&state.gathered.notes).cloned().collect())
    }

    /// Returns the configuration that it is read with.
    #[getter]
    fn config(&self) -> Config {
        Config(self.config.lock().unwrap_or_else(PoisonError::into_inner).clone())
    }

    /// Returns the encoding of `sensor_msgs/Image` for its pictures.
    #[getter]
    fn ros_encoding(&self) -> Option<&'static str> {
        self.ros
    }

    /// Gathers a new baseline from the next frame on.
    fn restart_baseline(&self, py: Python<'_>) -> PyResult<()> {
        self.order(py, |station, _| {
            station.rezero();
            Ok(())
        })
    }

    /// Uses another configuration from the next frame on, with a new baseline.
    fn reconfigure(&self, py: Python<'_>, config: Config) -> PyResult<()> {
        self.order(py, |station, _| station.reconfigure(config.0.clone()))?;
        *self.config.lock().unwrap_or_else(PoisonError::into_inner) = config.0;
        Ok(())
    }

    /// Replaces the texture models.
    fn use_models(&self, py: Python<'_>, models: Vec<Model>) -> PyResult<()> {
        let textures = textures(&models)?;
        self.order(py, |station, _| {
            station.set_textures(textures);
            Ok(())
        })
    }

    /// Starts a recording with the next frame, and with a new baseline, in a new file.
    fn start_recording(&self, py: Python<'_>, path: PathBuf, labels: Labels, features_only: bool) -> PyResult<()> {
        check(&labels).map_err(refused)?;
        self.order(py, |station, ended| {
            // What ended the last recording is told before another one begins, and not as the end of that.
            if let Some(Err(error)) = ended.take_if(|ended| ended.is_err()) {
                return Err(error);
            }
            if station.info().taxels_only && !features_only {
                let about = &station.info().about;
                let message = "has taxel sums and no frames, expected features_only";
                return Err(Error::new(ErrorKind::Usage, about, message));
            }
            station.record(|| new_file(&path).map(|file| (file, path)), labels, features_only)?;
            *ended = None;
            Ok(())
        })
    }

    /// Ends the recording in progress, or returns the one that the end of the source or a full disk has ended.
    fn stop_recording(&self, py: Python<'_>) -> PyResult<Option<EndedRecording>> {
        let ended = self.asked(py, |state| match state.ended.take() {
            Some(ended) => ended.map(Some),
            None => state.station.as_mut().map_or(Ok(None), |station| station.end_recording()),
        });
        let ended = ended.map_err(crate::failed_by)?;
        Ok(ended.map(|ended| {
            let doubt = ended.doubt();
            (ended.path, ended.written.frames, ended.written.bytes, doubt)
        }))
    }

    /// Returns whether a recording is in progress.
    fn is_recording(&self, py: Python<'_>) -> bool {
        self.asked(py, |state| state.station.as_ref().is_some_and(|station| station.recording().is_some()))
    }

    /// Returns the next records, at least one; none at the end.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        loop {
            py.check_signals()?;
            let (goes_on, outputs, failure, closed) = self.read(py, |state| {
                let goes_on = state.step();
                let outputs = state.gathered.take_all().outputs;
                let failure = if outputs.is_empty() { state.failure.take() } else { None };
                (goes_on, outputs, failure, state.closed)
            });
            self.check_goes_on(failure, closed && outputs.is_empty())?;
            if !goes_on || !outputs.is_empty() {
                return objects(py, outputs);
            }
        }
    }

    /// Returns the next camera frame that arrives and what followed from it, and from lost ones before it, as
    /// [`gather`](Self::gather) does. At the end there is no frame, and then no record.
    fn next_frame<'py>(&self, py: Python<'py>, with_picture: bool) -> PyResult<Bound<'py, PyDict>> {
        self.gather_frames(py, with_picture);
        loop {
            py.check_signals()?;
            let (gathered, failure, closed) = self.read(py, |state| {
                let goes_on = state.step();
                let has_frame = state.gathered.frames.as_ref().is_some_and(|frames| !frames.numbers.is_empty());
                let gathered = (has_frame || !goes_on).then(|| state.gathered.take_all());
                // Frames and outputs before a failure are returned first.
                let is_all = !has_frame && gathered.as_ref().is_some_and(|gathered| gathered.outputs.is_empty());
                let failure = if is_all { state.failure.take() } else { None };
                (gathered, failure, state.closed && is_all)
            });
            self.check_goes_on(failure, closed)?;
            if let Some(gathered) = gathered {
                return self.arrays(py, gathered, with_picture);
            }
        }
    }

    /// Reads all of it: records, features and their numbers; taxels, numbers and timestamps of camera frames; on
    /// request also their bytes.
    fn gather<'py>(&self, py: Python<'py>, with_frames: bool) -> PyResult<Bound<'py, PyDict>> {
        self.gather_frames(py, with_frames);
        while self.read(py, ReadState::step) {
            py.check_signals()?;
        }
        let (gathered, failure, closed) =
            self.locked(py, |state| (state.gathered.take_all(), state.failure.take(), state.closed));
        self.check_goes_on(failure.filter(|_| !closed), closed)?;
        self.arrays(py, gathered, with_frames)
    }

    /// Releases the file or camera.
    fn close(&self, py: Python<'_>) {
        self.asked(py, ReadState::close);
    }
}

impl Source {
    /// Has camera frames gathered, with their bytes or without.
    fn gather_frames(&self, py: Python<'_>, with_bytes: bool) {
        let size = with_bytes.then_some(self.frame_bytes);
        let rate = (!self.has_times).then(|| f64::from(self.rate.0) / f64::from(self.rate.1));
        self.locked(py, |state| state.gathered.frames = Some(Frames { size, rate, ..Frames::default() }));
    }

    /// Returns what was gathered as objects and arrays.
    fn arrays<'py>(&self, py: Python<'py>, gathered: Gathered, with_frames: bool) -> PyResult<Bound<'py, PyDict>> {
        let Gathered { features, numbers, taxel_sums, last_frames, outputs, frames, .. } = gathered;
        let frames = frames.unwrap_or_default();
        let count = frames.numbers.len();
        let all = PyDict::new(py);
        all.set_item("records", objects(py, outputs)?)?;
        all.set_item("features", shaped(PyArray1::from_vec(py, features), [numbers.len(), FEATURES])?)?;
        all.set_item("taxel_sums", shaped(PyArray1::from_vec(py, taxel_sums), [numbers.len(), ROWS, COLUMNS])?)?;
        all.set_item("last_frames", PyArray1::from_vec(py, last_frames))?;
        all.set_item("feature_frames", PyArray1::from_vec(py, numbers))?;
        all.set_item("taxels", shaped(PyArray1::from_vec(py, frames.taxels), [count, ROWS, COLUMNS])?)?;
        all.set_item("frame_numbers", PyArray1::from_vec(py, frames.numbers))?;
        all.set_item("timestamps", PyArray1::from_vec(py, frames.timestamps))?;
        all.set_item("sums", shaped(PyArray1::from_vec(py, frames.sums), [count, ROWS, COLUMNS])?)?;
        all.set_item("stamps", frames.stamps)?;
        // A simulated sensor may make no pixels.
        if with_frames && frames.bytes.len() == count * self.frame_bytes {
            all.set_item("frames", shaped(PyArray1::from_vec(py, frames.bytes), [count, self.frame_bytes])?)?;
        }
        Ok(all)
    }

    fn new(source: Box<dyn Open>, options: &SourceOptions, features: bool, paced: bool) -> PyResult<Self> {
        let mut info = source.info().clone();
        if (options.matrix.is_some() || options.range.is_some()) && !info.format.is_ycbcr() {
            let about = &info.about;
            return Err(refused(format_args!("{about}: has no Y, Cb and Cr; leave matrix and range out")));
        }
        info.color = stream::color(info.color, options.matrix.as_deref(), options.range.as_deref())?;
        let given = options.config.as_ref().map(|given| given.0.clone());
        let config = config_of(&info, given).map_err(crate::failed_by)?;
        let models = textures(&options.models)?;
        let station = Station::new(source, info.clone(), config.clone(), models, options.outputs(features));
        let mut station = station.map_err(crate::failed_by)?;
        if paced {
            station = station.paced();
        }
        let shape = if info.is_board {
            Default::default()
        } else {
            (stream::code(info.format), info.size.width().into(), info.size.height().into(), info.bytes_per_row)
        };
        let notes = config.notes(&info).map(Cow::into_owned).collect();
        Ok(Self {
            about: info.about,
            shape,
            rate: info.rate.into(),
            has_times: info.clock != StreamClock::Frames,
            recorded: info.recorded.map_or_else(Recorded::default, |recorded| Recorded::clone(&recorded)),
            config: Mutex::new(config),
            ros: info.format.facts().ros.filter(|_| !info.taxels_only && !info.is_board),
            frame_bytes: if info.is_board { 0 } else { *whole_frame(station.processor()).end() },
            asked: AtomicUsize::new(0),
            state: Mutex::new(ReadState {
                station: Some(Box::new(station)),
                notes,
                ended: None,
                gathered: Gathered::default(),
                closed: false,
                failure: None,
            }),
        })
    }

    /// Has the station follow an order.
    ///
    /// # Errors
    /// It is refused, the source is a board or closed, or a recording is in progress, whose replay would not know of
    /// it.
    fn order(
        &self,
        py: Python<'_>,
        follow: impl FnOnce(&mut Station, &mut Ended) -> Result<(), Error> + Send,
    ) -> PyResult<()> {
        let about = &self.about;
        let followed = self.asked(py, |state| {
            let refuse = |kind, why: &str| Err(Error::new(kind, about, why));
            let ReadState { station, ended, .. } = state;
            match station {
                Some(station) if station.info().is_board => refuse(ErrorKind::Unsupported, IS_BOARD),
                Some(station) if station.recording().is_some() => {
                    refuse(ErrorKind::Usage, "has a recording in progress; stop it first")
                }
                Some(station) => follow(station, ended),
                None => refuse(ErrorKind::Usage, "has ended"),
            }
        });
        followed.map_err(crate::failed_by)
    }

    /// Refuses to go on after a failure, and after `close`.
    fn check_goes_on(&self, failure: Option<ReadFailure>, closed: bool) -> PyResult<()> {
        match failure {
            Some(failure) => Err(failure.into()),
            None if closed => Err(refused(format_args!("{}: the stream is closed; open its source again", self.about))),
            None => Ok(()),
        }
    }

    /// Reads on with the state, behind all orders that wait for it.
    fn read<T: Send>(&self, py: Python<'_>, of: impl FnOnce(&mut ReadState) -> T + Send) -> T {
        py.detach(|| {
            while self.asked.load(Ordering::Relaxed) > 0 {
                thread::sleep(Duration::from_millis(1));
            }
        });
        self.locked(py, of)
    }

    /// Does with the state what another thread than that of the reader may ask.
    fn asked<T: Send>(&self, py: Python<'_>, of: impl FnOnce(&mut ReadState) -> T + Send) -> T {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let done = self.locked(py, of);
        self.asked.fetch_sub(1, Ordering::Relaxed);
        done
    }

    /// Uses the state without the interpreter's lock: another thread that has the state may wait for that lock.
    fn locked<T: Send>(&self, py: Python<'_>, of: impl FnOnce(&mut ReadState) -> T + Send) -> T {
        // Nothing in here panics, so the lock is never poisoned.
        py.detach(|| of(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

impl ReadState {
    /// Takes one event of the source. Returns whether the source goes on.
    fn step(&mut self) -> bool {
        let Some(station) = &mut self.station else { return false };
        let turn = station.advance(&mut self.gathered);
        if let Some(ended) = station.take_recorded() {
            self.ended = Some(ended);
        }
        match turn {
            Ok(Turn::Over) => {}
            Ok(Turn::Read | Turn::Waited) => return true,
            Err(failure) => self.failure = Some(failure),
        }
        self.station = None;
        false
    }

    /// Releases what is read. A recording is complete then.
    fn close(&mut self) {
        if let Some(ended) = self.station.as_mut().and_then(|station| station.end_recording().transpose()) {
            self.ended = Some(ended);
        }
        self.closed |= self.station.take().is_some();
    }
}
