//! Sources of frames: files, scenes and cameras, read item by item or to their end.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use numpy::PyArray1;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use wstac_core::params::{COLUMNS, FEATURES, ROWS};
use wstac_host::config::Config as Parsed;
use wstac_host::error::Error;
use wstac_host::reading::{Reading, Wanted};
use wstac_scene::SceneConfig;
use crate::open;
use wstac_scene::source::script;
use wstac_scene::source::SceneSource;
use wstac_host::source::{SourceEvent, Source as Frames, config_of};

use crate::asked::Asked;
use crate::config::{Config, table};
use crate::dataset::name;
use crate::gathered::{Gathered, Given, shaped};
use crate::kept::{Kept, NoMemory};
use crate::model::textures;
use crate::pipeline::whole_frame;
use crate::refused;
use crate::stream::{self, Rate};

/// A source under way.
#[pyclass(frozen, module = "wstac._wstac")]
pub(crate) struct Source {
    state: Mutex<State>,
    about: String,
    /// Four-character code, width, height, bytes from row to row, of its frames.
    shape: (String, u32, u32, u32),
    rate: Rate,
    labels: BTreeMap<String, String>,
    models: Vec<String>,
    config: Parsed,
    /// Bytes of a frame, the last row's padding included.
    frame_bytes: usize,
}

struct State {
    /// Nothing after its end.
    source: Option<Box<dyn Frames>>,
    reading: Reading<'static>,
    gathered: Gathered,
    /// Why it ended, until it is told.
    error: Option<Error>,
    /// Camera frames so far, lost ones included.
    frames: u64,
}

/// Opens a source, as `wstac run` would.
#[pyfunction]
pub(crate) fn open_source(py: Python<'_>, spec: &str, asked: Asked, features: bool) -> PyResult<Source> {
    let options = asked.options()?;
    let source = py.detach(|| open(spec, &options)).map_err(refused)?;
    Source::new(source, &asked, features)
}

/// Opens a scene, of its short form or file, or of a table in JSON; and what truly happens in it, in JSON.
#[pyfunction]
pub(crate) fn open_scene(scene: &str, is_table: bool, asked: Asked) -> PyResult<(Source, String)> {
    let script =
        if is_table { SceneConfig::from_table("scene", table("scene", scene)?) } else { script(scene, &asked.options()?) };
    let source = SceneSource::new(&script.map_err(refused)?).map_err(refused)?;
    let truth = source.truth().iter().map(|truth| {
        serde_json::json!({
            "specimen": name(&truth.slide.specimen),
            "speed": truth.slide.speed_mm_s,
            "direction": truth.slide.heading.degrees(),
            "start_frame": truth.start_frame(),
            "start_s": truth.start_s,
            "end_s": truth.end_s,
        })
    });
    let truth = truth.collect::<serde_json::Value>().to_string();
    Ok((Source::new(Box::new(source), &asked, true)?, truth))
}

/// Whether a source is a camera.
#[pyfunction]
pub(crate) fn is_camera(spec: &str) -> bool {
    wstac_linux::source::is_camera(spec)
}

#[pymethods]
impl Source {
    /// What it is, for a person.
    #[getter]
    fn about(&self) -> &str {
        &self.about
    }

    /// Four-character code of its frames, their width and height, and bytes from row to row.
    #[getter]
    fn shape(&self) -> (String, u32, u32, u32) {
        self.shape.clone()
    }

    /// Numerator and denominator of frames a second.
    #[getter]
    fn rate(&self) -> Rate {
        self.rate
    }

    /// What a person said of a recording.
    #[getter]
    fn labels(&self) -> BTreeMap<String, String> {
        self.labels.clone()
    }

    /// Texture models that a recording was made with.
    #[getter]
    fn models(&self) -> Vec<String> {
        self.models.clone()
    }

    /// The configuration that it is read with.
    #[getter]
    fn config(&self) -> Config {
        Config(self.config.clone())
    }

    /// The next records, one at least; none at the end.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Vec<Given<'py>>> {
        loop {
            py.check_signals()?;
            let (goes_on, mut gathered, error) = self.locked(py, |state| {
                let goes_on = state.step(None)?;
                let error = if state.gathered.is_empty() { state.error.take() } else { None };
                Ok::<_, Failure>((goes_on, std::mem::take(&mut state.gathered), error))
            })?;
            if let Some(error) = error {
                return Err(refused(error));
            }
            let records = gathered.records(py)?;
            if !goes_on || !records.is_empty() {
                return Ok(records);
            }
        }
    }

    /// Reads all of it: records, features and their numbers; taxels, numbers and timestamps of camera frames, and, where they are
    /// wanted, their bytes.
    fn gather<'py>(&self, py: Python<'py>, with_frames: bool) -> PyResult<Bound<'py, PyDict>> {
        let mut kept = Kept::default();
        let frame_bytes = with_frames.then_some(self.frame_bytes);
        loop {
            py.check_signals()?;
            if !self.locked(py, |state| state.step(Some((&mut kept, frame_bytes))))? {
                break;
            }
        }
        let (mut gathered, error) =
            self.locked(py, |state| Ok::<_, Error>((std::mem::take(&mut state.gathered), state.error.take())))?;
        if let Some(error) = error {
            return Err(refused(error));
        }
        let (frames, features) = (kept.numbers.len(), gathered.numbers.len());
        let all = PyDict::new(py);
        all.set_item("records", gathered.records(py)?)?;
        all.set_item("features", shaped(PyArray1::from_vec(py, gathered.features), [features, FEATURES])?)?;
        all.set_item("feature_frames", PyArray1::from_vec(py, gathered.numbers))?;
        all.set_item("taxels", shaped(PyArray1::from_vec(py, kept.taxels), [frames, ROWS, COLUMNS])?)?;
        all.set_item("frame_numbers", PyArray1::from_vec(py, kept.numbers))?;
        all.set_item("timestamps", PyArray1::from_vec(py, kept.timestamps))?;
        // A simulated sensor may make no pixels.
        if kept.bytes.len() == frames * self.frame_bytes {
            all.set_item("frames", shaped(PyArray1::from_vec(py, kept.bytes), [frames, self.frame_bytes])?)?;
        }
        Ok(all)
    }

    /// Lets go of the file or camera.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.locked(py, |state| {
            state.source = None;
            Ok::<(), Error>(())
        })
    }
}

impl Source {
    fn new(source: Box<dyn Frames>, asked: &Asked, features: bool) -> PyResult<Self> {
        let mut info = source.info().clone();
        if (asked.matrix.is_some() || asked.range.is_some()) && !info.format.is_ycbcr() {
            let about = &info.about;
            return Err(refused(format_args!("{about}: matrix and range are for YCbCr sources, expected neither")));
        }
        info.color = stream::color(info.color, asked.matrix.as_deref(), asked.range.as_deref())?;
        let given = asked.config.as_ref().map(|given| given.0.clone());
        let config = config_of(source.as_ref(), given).map_err(refused)?;
        let wanted = Wanted { features, samples: true };
        let reading = Reading::new(&info, &config, wanted).map_err(refused)?.with_textures(textures(&asked.models)?);
        let (width, height) = info.size.into();
        Ok(Self {
            about: info.about,
            shape: (stream::code(info.format), width, height, info.bytes_per_row),
            rate: info.rate.into(),
            labels: source.labels().cloned().unwrap_or_default(),
            models: source.models().to_vec(),
            config,
            frame_bytes: *whole_frame(&reading).end(),
            state: Mutex::new(State {
                source: Some(source),
                reading,
                gathered: Gathered::default(),
                error: None,
                frames: 0,
            }),
        })
    }

    /// Something of the state, without the interpreter's lock: another thread that has the state may be waiting for that.
    fn locked<T: Send, E: Into<Failure> + Send>(
        &self,
        py: Python<'_>,
        of: impl FnOnce(&mut State) -> Result<T, E> + Send,
    ) -> PyResult<T> {
        // Nothing in here panics, so the lock is never poisoned.
        let result = py.detach(|| of(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)));
        result.map_err(|error| match error.into() {
            Failure::Refused(error) => refused(error),
            Failure::NoMemory => PyMemoryError::new_err("frames: no memory is left for another one"),
        })
    }
}

/// Why reading stops.
enum Failure {
    Refused(Error),
    NoMemory,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Refused(error)
    }
}

impl From<NoMemory> for Failure {
    fn from(_: NoMemory) -> Self {
        Self::NoMemory
    }
}

impl State {
    /// Takes one item. Whether the source goes on.
    fn step(&mut self, keep: Option<(&mut Kept, Option<usize>)>) -> Result<bool, Failure> {
        let Self { source, reading, gathered, error, frames } = self;
        let Some(open) = source else { return Ok(false) };
        let item = match open.next_event() {
            Ok(item) => item,
            Err(failed) => {
                *error = Some(failed);
                reading.finish(|record| gathered.take(record))?;
                *source = None;
                return Ok(false);
            }
        };
        let goes_on = reading.take(&item, |record| gathered.take(record))?;
        if let Some((kept, frame_bytes)) = keep {
            kept.take(&item, reading.taxels(), frame_bytes, *frames)?;
        }
        match item {
            SourceEvent::Frame { .. } | SourceEvent::Taxels(_) => *frames += 1,
            SourceEvent::Lost { frames: lost, why } => {
                gathered.lost(*frames, lost, why);
                *frames = frames.saturating_add(lost);
            }
            SourceEvent::Fault(_) | SourceEvent::Waiting => {}
            SourceEvent::End => *source = None,
        }
        Ok(goes_on)
    }
}
