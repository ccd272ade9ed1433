//! Texture models as Python objects.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use wstac_core::model::calibration::CONFIDENCE_ONE;
use wstac_core::params::SAMPLE_FRAMES;
use wstac_host::model_file::{ModelFile, OwnedModel};
use wstac_host::texture::Textures;
use wstac_train::model::eval::{is_sample, labels_of};
use wstac_train::model::trained::in_file_order;

use crate::outputs::shaped;
use crate::waiting;

/// Samples between two looks for Ctrl-C.
const AT_A_TIME: usize = 256;

/// A texture model: names what slid, from the sample of an event.
#[pyclass(frozen, module = "wstac._wstac", from_py_object)]
#[derive(Clone)]
pub(crate) struct Model {
    file: ModelFile,
    model: Arc<OwnedModel>,
}

#[pymethods]
impl Model {
    /// Reads and checks a model file, or one that comes with wstac. Raises `wstac.Error` if it cannot be read or used.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        waiting(py, || {
            let file = ModelFile::open(&path)?;
            let model = file.owned()?;
            Ok(Self { file, model })
        })
    }

    /// Checks the bytes of a model file; `name` is its name for messages.
    #[staticmethod]
    fn from_bytes(name: String, content: &[u8]) -> PyResult<Self> {
        let file = ModelFile::of_bytes(name, content).map_err(crate::failed_by)?;
        let model = file.owned().map_err(crate::failed_by)?;
        Ok(Self { file, model })
    }

    /// Returns the bytes of its file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &bytes_of(self.file.words()))
    }

    /// Returns what it was loaded from.
    #[getter]
    fn name(&self) -> &str {
        self.file.about()
    }

    /// Returns the names of its classes.
    #[getter]
    fn labels(&self) -> Vec<String> {
        labels_of(self.model.get())
    }

    /// Returns what it tells apart: `specimen`, `pattern`, `depth` or `other`.
    #[getter]
    fn task(&self) -> &'static str {
        self.model.get().task().name()
    }

    /// Returns how many frames of a sample it reads, from the first on: 1 to 70.
    #[getter]
    fn frames(&self) -> u8 {
        self.model.get().frames()
    }

    /// Returns the number of the class of each sample: int16 (n, 700), or (n, 1750) of taxels, feature by feature, in
    /// units of 1/2048.
    fn classes<'py>(&self, py: Python<'py>, samples: PyReadonlyArray2<'py, i16>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let classes = self.of_each(py, &samples, |model, sample| model.classify(&in_file_order(sample)))?;
        Ok(PyArray1::from_vec(py, classes))
    }

    /// Returns whether each sample is known; a row of zeros is not. `None` for a model that does not tell.
    fn known<'py>(
        &self,
        py: Python<'py>,
        samples: PyReadonlyArray2<'py, i16>,
    ) -> PyResult<Option<Bound<'py, PyArray1<bool>>>> {
        if !self.model.get().tells_unknown() {
            return Ok(None);
        }
        let is_known = |model: &wstac_core::model::Model<'_>, sample: &[i16]| {
            is_sample(sample) && model.classification(&in_file_order(sample)).known == Some(true)
        };
        Ok(Some(PyArray1::from_vec(py, self.of_each(py, &samples, is_known)?)))
    }

    /// Returns the sample that it takes: `frames`, `path`, `taxel-path` or `taxels`.
    #[getter]
    fn input(&self) -> String {
        self.model.get().input().name().replace('_', "-")
    }

    /// Returns the score of each class for each sample, (n, classes).
    fn scores<'py>(&self, py: Python<'py>, samples: PyReadonlyArray2<'py, i16>) -> PyResult<Bound<'py, PyAny>> {
        let each = self.of_each(py, &samples, |model, sample| {
            let mut scores = Vec::new();
            model.each_score(&in_file_order(sample), |_, score| scores.push(score as f64));
            scores
        })?;
        rows(py, each, self.model.get().labels().len())
    }

    /// Returns the probability of each class for each sample, (n, classes); NaN for a row of zeros. It is `None` for a
    /// model without a calibration.
    fn probabilities<'py>(
        &self,
        py: Python<'py>,
        samples: PyReadonlyArray2<'py, i16>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let classes = self.model.get().labels().len();
        if !self.model.get().is_calibrated() {
            return Ok(None);
        }
        let each = self.of_each(py, &samples, |model, sample| {
            let found = model.probabilities(&in_file_order(sample)).filter(|_| is_sample(sample));
            let real = |units: u16| f64::from(units) / f64::from(CONFIDENCE_ONE);
            found.map_or_else(|| vec![f64::NAN; classes], |units| units.into_iter().take(classes).map(real).collect())
        })?;
        rows(py, each, classes).map(Some)
    }

    fn __repr__(&self) -> String {
        let labels = self.labels().len();
        format!("wstac.Model({:?}: {labels} classes, {} of {SAMPLE_FRAMES} frames)", self.name(), self.frames())
    }
}

/// Returns rows of so many numbers as an array.
fn rows(py: Python<'_>, rows: Vec<Vec<f64>>, width: usize) -> PyResult<Bound<'_, PyAny>> {
    let shape = [rows.len(), width];
    shaped(PyArray1::from_vec(py, rows.into_iter().flatten().collect()), shape)
}

/// Returns the bytes of a file's words.
pub(crate) fn bytes_of(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

impl Model {
    /// Returns how many numbers its sample has.
    pub(crate) fn inputs(&self) -> usize {
        self.model.get().input().numbers()
    }

    pub(crate) fn file(&self) -> &ModelFile {
        &self.file
    }

    /// Returns what a function returns for each sample.
    fn of_each<T: Send>(
        &self,
        py: Python<'_>,
        samples: &PyReadonlyArray2<'_, i16>,
        of: impl Fn(&wstac_core::model::Model<'_>, &[i16]) -> T + Sync,
    ) -> PyResult<Vec<T>> {
        let (mut all, width) = (Vec::new(), samples.shape()[1].max(1));
        for samples in samples.as_slice()?.chunks(AT_A_TIME * width) {
            py.check_signals()?;
            // Without the lock, other threads may write to the array: the samples are copied.
            let samples = samples.to_vec();
            all.extend(py.detach(|| {
                let model = self.model.get();
                samples.chunks_exact(width).map(|sample| of(model, sample)).collect::<Vec<T>>()
            }));
        }
        Ok(all)
    }
}

/// Returns the models for a stream's events; each must have another task.
pub(crate) fn textures(models: &[Model]) -> PyResult<Textures> {
    let files: Vec<_> = models.iter().map(|model| model.file.clone()).collect();
    Textures::new(&files).map_err(crate::failed_by)
}
