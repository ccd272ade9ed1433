//! The core behind frames that Python has.

use std::ops::RangeInclusive;
use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::params::{COLUMNS, FEATURES, ROWS};
use wstac_host::error::Error;
use wstac_host::reading::{Reading, Wanted};
use wstac_host::source::SourceEvent;

use crate::config::Config;
use crate::gathered::{Gathered, Given, shaped};
use crate::model::{Model, textures};
use crate::refused;
use crate::stream::{self, Rate};

/// Bytes of a row of `width` pixels, of a planar format those of its luma.
#[pyfunction]
pub(crate) fn row_bytes(format: &str, width: u16) -> PyResult<usize> {
    Ok(stream::row(stream::pixels(format)?, width))
}

/// Frames in, records and features out.
#[pyclass(frozen, module = "wstac._wstac")]
pub(crate) struct Pipeline {
    state: Mutex<State>,
    about: String,
    /// Bytes that a frame may have: the last row's padding may be missing.
    frame_bytes: RangeInclusive<usize>,
}

struct State {
    reading: Reading<'static>,
    ended: bool,
}

/// What a push gives: records, features (k, 10) and the numbers of their frames.
type Pushed<'py> = (Vec<Given<'py>>, Bound<'py, PyAny>, Bound<'py, PyArray1<i64>>);

#[pymethods]
impl Pipeline {
    #[new]
    #[pyo3(signature = (format, size, bytes_per_row, rate, matrix, range, config, models))]
    #[expect(clippy::too_many_arguments, reason = "the package calls it, by one keyword each")]
    fn new(
        format: &str,
        size: (u32, u32),
        bytes_per_row: Option<u32>,
        rate: Rate,
        matrix: Option<&str>,
        range: Option<&str>,
        config: &Config,
        models: Vec<Model>,
    ) -> PyResult<Self> {
        let color = stream::color(YcbcrEncoding::default(), matrix, range)?;
        let info = stream::info(format, size, bytes_per_row, rate, color)?;
        let wanted = Wanted { features: true, samples: true };
        let reading = Reading::new(&info, &config.0, wanted).map_err(refused)?.with_textures(textures(&models)?);
        let frame_bytes = whole_frame(&reading);
        Ok(Self { state: Mutex::new(State { reading, ended: false }), about: info.about, frame_bytes })
    }

    /// Takes frames, uint8 (n, bytes), one after the other.
    fn push<'py>(&self, py: Python<'py>, frames: PyReadonlyArray2<'py, u8>) -> PyResult<Pushed<'py>> {
        let (bytes, &[count, length]) = (frames.as_slice()?, frames.shape()) else {
            return Err(refused("frames: expected two dimensions"));
        };
        let (least, most) = (*self.frame_bytes.start(), *self.frame_bytes.end());
        if !self.frame_bytes.contains(&length) {
            let padded = if least == most { String::new() } else { format!(" to {most}") };
            return Err(refused(format_args!("{}: frame has {length} bytes, expected {least}{padded}", self.about)));
        }
        self.take(py, move |reading, gathered| {
            let mut frames = bytes.chunks_exact(length).take(count);
            frames.try_for_each(|bytes| {
                let frame = SourceEvent::Frame { bytes, timestamp: None, sequence: None, encoded: None };
                reading.take(&frame, |record| gathered.take(record)).map(drop)
            })
        })
    }

    /// Keeps the place of lost frames in time.
    fn lose<'py>(&self, py: Python<'py>, frames: u64) -> PyResult<Pushed<'py>> {
        self.take(py, move |reading, gathered| {
            let lost = SourceEvent::Lost { frames, why: "said to be lost" };
            reading.take(&lost, |record| gathered.take(record)).map(drop)
        })
    }

    /// Ends the stream: what was pending, then its end. Once.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Pushed<'py>> {
        let pushed = self.take(py, |reading, gathered| reading.finish(|record| gathered.take(record)))?;
        self.locked(py, |state| state.ended = true);
        Ok(pushed)
    }

    /// Taxels of the last frame, float32 (5, 5), each a share of full scale; nothing where it was lost.
    fn taxels<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let taxels = self.locked(py, |state| state.reading.taxels());
        taxels.map(|taxels| shaped(PyArray1::from_vec(py, taxels.to_vec()), [ROWS, COLUMNS])).transpose()
    }

    /// Number of the feature frame that comes next.
    fn next_frame(&self, py: Python<'_>) -> u64 {
        self.locked(py, |state| state.reading.trigger().next_frame())
    }
}

impl Pipeline {
    /// Something of the state, without the interpreter's lock: another thread that has the state may be waiting for that.
    fn locked<T: Send>(&self, py: Python<'_>, of: impl FnOnce(&mut State) -> T + Send) -> T {
        // Nothing in here panics, so the lock is never poisoned.
        py.detach(|| of(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    fn take<'py>(
        &self,
        py: Python<'py>,
        with: impl FnOnce(&mut Reading<'static>, &mut Gathered) -> Result<(), Error> + Send,
    ) -> PyResult<Pushed<'py>> {
        let mut gathered = Gathered::default();
        let about = &self.about;
        let result = self.locked(py, |state| {
            if state.ended {
                return Err(Error::new(about, "the pipeline is finished, expected a new one for more frames"));
            }
            with(&mut state.reading, &mut gathered)
        });
        result.map_err(refused)?;
        let records = gathered.records(py)?;
        let count = gathered.numbers.len();
        let features = shaped(PyArray1::from_vec(py, gathered.features), [count, FEATURES])?;
        Ok((records, features, PyArray1::from_vec(py, gathered.numbers)))
    }
}

/// Bytes that a whole frame may have: with or without the last row's padding.
pub(crate) fn whole_frame(reading: &Reading<'_>) -> RangeInclusive<usize> {
    let camera = reading.camera();
    let least = camera.frame_bytes();
    let rows = usize::from(camera.layout().frame().height());
    least..=camera.bytes_per_row().saturating_mul(rows).max(least)
}
