//! The configuration as a Python object.

use std::path::PathBuf;

use pyo3::prelude::*;
use wstac_core::touch::motion::ReadoutTime;
use wstac_host::config::Config as Parsed;

use crate::{Error, refused, waiting};

/// The configuration of `wstac run --config`, which says how frames become features and events.
///
/// A text in TOML, all keys of which have defaults; unknown keys are errors. `wstac help config` describes them.
///
/// >>> import wstac
/// >>> "window = 7" in wstac.Config("[trigger]\nwindow = 7").toml
/// True
#[pyclass(frozen, module = "wstac._wstac", from_py_object)]
#[derive(Clone)]
pub(crate) struct Config(pub(crate) Parsed);

#[pymethods]
impl Config {
    #[new]
    #[pyo3(signature = (toml = ""))]
    fn new(toml: &str) -> PyResult<Self> {
        Parsed::parse(toml).map(Self).map_err(crate::failed_by)
    }

    /// The configuration in a file. Raises `wstac.Error` where it cannot be read or used.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        waiting(py, || Parsed::read(&path).map(Self))
    }

    /// Reads a configuration of tables of keys, such as `{"trigger": {"window": 7}}`, in JSON.
    #[staticmethod]
    fn from_json(json: &str) -> PyResult<Self> {
        let table = table("configuration", json)?;
        let toml = toml::to_string(&table).map_err(|error| refused(format_args!("configuration: {error}")))?;
        Self::new(&toml)
    }

    /// Returns the configuration with this readout in ms, unless it has one of its own.
    fn with_readout(&self, ms: f32) -> Self {
        let mut config = self.0.clone();
        config.sensor.readout = config.sensor.readout.or(ReadoutTime::from_ms(ms));
        Self(config)
    }

    /// All of it as TOML, defaults included.
    #[getter]
    fn toml(&self) -> PyResult<String> {
        self.0.to_toml().map_err(|error| refused(format_args!("configuration: {error}")))
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("wstac.Config({:?})", self.toml()?))
    }

    fn __eq__(&self, other: &Self) -> PyResult<bool> {
        Ok(self.toml()? == other.toml()?)
    }

    fn __hash__(&self) -> PyResult<u64> {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        self.toml()?.hash(&mut hasher);
        Ok(hasher.finish())
    }
}

/// A mapping that Python has written as JSON; `subject` names it in errors.
pub(crate) fn table(subject: &str, json: &str) -> PyResult<toml::Table> {
    serde_json::from_str(json).map_err(|error| Error::new_err(format!("{subject}: {error}")))
}
