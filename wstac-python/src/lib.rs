//! The extension module `wstac._wstac`: what the package `wstac` is made of.
//!
//! It converts, and no more. Frames come in as rows of bytes. Typed outputs go out as objects of `wstac._answers`,
//! numbers as NumPy arrays. What a Python program sees of them is in `wstac/`. Long calls release the interpreter's
//! lock.

mod config;
mod dataset;
mod model;
mod outputs;
mod pipeline;
mod skin;
mod source;
mod stream;
mod train;

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::types::{PyAnyMethods, PyString, PyStringMethods};
use pyo3::{Bound, PyErr, PyResult, Python, create_exception};
use wstac_host::error::ErrorKind;
use wstac_host::visible;

create_exception!(
    wstac,
    Error,
    PyValueError,
    "What cannot be used: what was found and what was expected, in the words of the command wstac.

>>> import wstac
>>> try:
...     wstac.open(\"scene:Saw3@0\")
... except wstac.Error as error:
...     print(error)
scene:Saw3@0: speed is \"0\", expected 1 to 1000 mm/s

`kind` is one of not_found, already_exists, busy, io, device, config, frame, format, data, unsupported and usage, or None."
);

/// Makes an error of the core or the host Python's.
fn refused(error: impl Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// Makes an error of the host Python's, with its kind. That of a file that does not exist is a `FileNotFoundError`,
/// too.
fn failed(py: Python<'_>, error: &wstac_host::error::Error) -> PyErr {
    let made = py.import("wstac._errors").and_then(|module| {
        let class = if error.kind() == ErrorKind::NotFound { "NotFoundError" } else { "Error" };
        let made = module.getattr(class)?.call1((error.to_string(),))?;
        made.setattr("kind", error.kind().name()).map(|()| made)
    });
    made.map_or_else(|other| other, PyErr::from_value)
}

/// Makes an error of the host Python's, as [`failed`] does.
#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn failed_by(error: wstac_host::error::Error) -> PyErr {
    Python::attach(|py| failed(py, &error))
}

/// Runs a call that may wait, without the interpreter's lock. Ctrl-C ends it as a `KeyboardInterrupt`.
fn waiting<T: Send>(py: Python<'_>, call: impl FnOnce() -> Result<T, wstac_host::error::Error> + Send) -> PyResult<T> {
    let result = py.detach(call);
    // A signal ends the wait for a pipe with an error, which is not the reason.
    py.check_signals()?;
    result.map_err(|error| failed(py, &error))
}

/// Returns a text of several lines in which no character controls a terminal. Line feeds and tabs stay.
#[pyo3::pyfunction]
fn visible_lines(text: &Bound<'_, PyString>) -> String {
    visible::lines(&text.to_string_lossy()).into_owned()
}

/// Returns a text that is one line and in which no character controls a terminal.
#[pyo3::pyfunction]
fn visible_line(text: &Bound<'_, PyString>) -> String {
    visible::line(&text.to_string_lossy()).into_owned()
}

#[pyo3::pymodule]
mod _wstac {
    #[pymodule_export]
    use super::config::Config;
    #[pymodule_export]
    use super::dataset::{dataset, path_dataset};
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::pipeline::{Pipeline, row_bytes};
    #[pymodule_export]
    use super::skin::Skin;
    #[pymodule_export]
    use super::source::{Source, is_board, is_camera, open_scene, open_source};
    #[pymodule_export]
    use super::train::{fit, import_model, learn, train};
    #[pymodule_export]
    use super::{Error, visible_line, visible_lines};

    /// The version of the package.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
