//! Whiskers whose overlaps a program states, as a physics engine does.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use wstac_core::params::TAXELS;
use wstac_scene::sensor::Fidelity;
use wstac_scene::{SceneConfig, SkinCamera};

use crate::config::table;
use crate::outputs::shaped;
use crate::stream::{Rate, code};
use crate::{failed_by, refused};

/// A skin before a camera.
#[pyclass(frozen, module = "wstac._wstac")]
pub(crate) struct Skin(Mutex<SkinCamera>);

#[pymethods]
impl Skin {
    /// Creates the skin of a scene without touches, a table in JSON.
    #[new]
    fn new(scene: &str) -> PyResult<Self> {
        let mut script = SceneConfig::from_table_without_touches("skin", table("skin", scene)?).map_err(failed_by)?;
        script.fidelity = Fidelity::Taxel;
        Ok(Self(Mutex::new(SkinCamera::new(&script).map_err(failed_by)?)))
    }

    /// Advances by a time in s. Returns the light of the frame that ends in it, float64 (25,); `None` if none does.
    fn step<'py>(
        &self,
        py: Python<'py>,
        overlap_mm: PyReadonlyArray1<'py, f64>,
        rubbing_mm_s: PyReadonlyArray1<'py, f64>,
        seconds: f64,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let (overlap_mm, rubbing_mm_s) = (numbers(&overlap_mm)?, numbers(&rubbing_mm_s)?);
        let light = self.with(|camera| camera.step(&overlap_mm, &rubbing_mm_s, seconds)).map_err(failed_by)?;
        Ok(light.map(|light| PyArray1::from_slice(py, &light)))
    }

    /// Returns the taxel sums of the next frame with this light, uint32 (25,), noise included.
    fn sums<'py>(&self, py: Python<'py>, light: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let light = numbers(&light)?;
        if light.iter().any(|light| !(0.0..=1e6).contains(light)) {
            return Err(refused("light: a number is not 0 to 1e6, expected what step returned"));
        }
        Ok(PyArray1::from_slice(py, &self.with(|camera| camera.sums(&light))))
    }

    /// Returns the four-character code of the camera's frames, their width and height, and their rate.
    #[getter]
    fn camera(&self) -> (String, u32, u32, Rate) {
        self.with(|camera| {
            let (sensor, rate) = (camera.sensor(), camera.sensor().rate());
            let (width, height) = sensor.layout().frame().into();
            (code(sensor.format()), width, height, (rate.numerator(), rate.denominator()))
        })
    }

    /// Returns the length of a whisker, and for each its place to the right and above, and how far its tip is lowered,
    /// float64 (25, 3); all in mm. A whisker that is not there has NaN.
    #[getter]
    fn whiskers<'py>(&self, py: Python<'py>) -> PyResult<(f64, Bound<'py, PyAny>)> {
        let (length, whiskers) = self.with(|camera| (camera.skin().length_mm(), camera.skin().whiskers()));
        let places = whiskers.iter().flat_map(|of| of.map_or([f64::NAN; 3], |of| [of.x, of.y, of.lowered]));
        Ok((length, shaped(PyArray1::from_iter(py, places), [TAXELS, 3])?))
    }
}

impl Skin {
    fn with<T>(&self, of: impl FnOnce(&mut SkinCamera) -> T) -> T {
        // Nothing in here panics, so the lock is never poisoned.
        of(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn numbers(array: &PyReadonlyArray1<'_, f64>) -> PyResult<[f64; TAXELS]> {
    let numbers = array.as_slice()?;
    let wrong = |_| refused(format_args!("skin: an array has {} numbers, expected {TAXELS}", numbers.len()));
    numbers.try_into().map_err(wrong)
}
