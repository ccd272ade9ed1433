//! Texture models as Python objects.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use wstac_core::model::Model as Checked;
use wstac_core::model::file::INPUTS;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_host::model_file::ModelFile;
use wstac_host::texture::task_name;
use wstac_host::texture::Textures;

use crate::refused;

/// A texture model: what slid, by the sample of an event.
#[pyclass(frozen, module = "wstac._wstac", from_py_object)]
#[derive(Clone)]
pub(crate) struct Model {
    file: &'static ModelFile,
    model: Checked<'static>,
}

#[pymethods]
impl Model {
    /// Reads and checks a model file (`wstac model import` makes one), or one that comes with wstac: `builtin:svm`, `builtin:forest`,
    /// `builtin:boosted`. Raises `wstac.Error` where it cannot be read or used.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let file = ModelFile::open(&path).map_err(refused)?;
        file.model().map_err(refused)?;
        let [file] = kept(vec![file]) else { return Err(refused("model: expected one file")) };
        Ok(Self { file, model: file.model().map_err(refused)? })
    }

    /// What it was loaded from.
    #[getter]
    fn name(&self) -> &str {
        self.file.about()
    }

    /// Names of its classes.
    #[getter]
    fn labels(&self) -> Vec<String> {
        let labels = self.model.labels();
        (0..labels.len()).filter_map(|class| labels.get(class)).map(|label| label.to_string()).collect()
    }

    /// What it tells apart: `specimen`, `pattern`, `depth` or `other`.
    #[getter]
    fn task(&self) -> &'static str {
        task_name(self.model.task())
    }

    /// Frames of a sample that it looks at, from the first on: 1 to 70.
    #[getter]
    fn frames(&self) -> u8 {
        self.model.frames()
    }

    /// Number of the class of each sample: int16 (n, 700), feature by feature, in units of 1/2048.
    fn classes<'py>(&self, py: Python<'py>, samples: PyReadonlyArray2<'py, i16>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let inputs = samples.as_slice()?;
        let classes: Vec<u8> = py.detach(|| {
            let samples = inputs.as_chunks::<INPUTS>().0.iter();
            samples.map(|sample| self.model.classify(&frame_by_frame(sample))).collect()
        });
        Ok(PyArray1::from_vec(py, classes))
    }

    fn __repr__(&self) -> String {
        let labels = self.labels().len();
        format!("wstac.Model({:?}: {labels} classes, {} of {SAMPLE_FRAMES} frames)", self.name(), self.frames())
    }
}

/// A sample as models take it, of one that is stored feature by feature.
fn frame_by_frame(sample: &[i16; INPUTS]) -> [i16; INPUTS] {
    let mut frames = [0; INPUTS];
    for (feature, values) in sample.as_chunks::<SAMPLE_FRAMES>().0.iter().enumerate() {
        for (frame, value) in values.iter().enumerate() {
            frames[frame * FEATURES + feature] = *value;
        }
    }
    frames
}

/// The models for a stream's events; each must tell something else apart.
pub(crate) fn textures(models: &[Model]) -> PyResult<Textures<'static>> {
    Textures::new(kept(models.iter().map(|model| model.file.clone()).collect())).map_err(refused)
}

/// Keeps model files until the program ends, since readings borrow them for as long as they like; those that were kept
/// before are not kept twice.
fn kept(files: Vec<ModelFile>) -> &'static [ModelFile] {
    static KEPT: Mutex<Vec<&'static [ModelFile]>> = Mutex::new(Vec::new());
    if files.is_empty() {
        return &[];
    }
    let same = |before: &[ModelFile]| {
        before.len() == files.len()
            && before
                .iter()
                .zip(&files)
                .all(|(one, other)| one.about() == other.about() && one.words() == other.words())
    };
    // Nothing in here panics, so the lock is never poisoned.
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(before) = kept.iter().find(|before| same(before)) {
        return before;
    }
    let files: &'static [ModelFile] = Box::leak(files.into_boxed_slice());
    kept.push(files);
    files
}
