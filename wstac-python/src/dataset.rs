//! Data sets of simulated slides, as `wstac dataset` makes them.

use std::ffi::{OsStr, OsString};
use std::io::Cursor;
use std::path::Path;
use std::sync::atomic::Ordering;

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use wstac_host::config::Config as Parsed;
use wstac_host::error::Error;
use wstac_train::dataset::path::{PathRow, write_split};
use wstac_train::dataset::random::RandomSweep;
use wstac_train::dataset::sweep::Sweep;
use wstac_train::dataset::{Outcome, arrays, each_sample};

use crate::config::{Config, table};
use crate::train::{in_thread, input_of, pool, stopped};
use crate::{refused, waiting};

/// The data set of a sweep, of its file or of a table in JSON: the bytes of the file that `wstac dataset` writes, and
/// how many slides had no event, and an incomplete sample.
#[pyfunction]
pub(crate) fn dataset<'py>(
    py: Python<'py>,
    sweep: OsString,
    is_table: bool,
    config: Option<&Config>,
    threads: Option<u16>,
) -> PyResult<(Bound<'py, PyBytes>, usize, usize)> {
    let sweep = if is_table {
        Sweep::parse("sweep", &text_of(&sweep)?).map_err(crate::failed_by)?
    } else {
        waiting(py, || Sweep::read(Path::new(&sweep)))?
    };
    let config = config.map_or_else(Parsed::default, |config| config.0.clone());
    let (bytes, no_event, incomplete) = in_thread(py, move |stop| {
        let numbers: Vec<u32> = (0..sweep.count()).collect();
        let mut outcomes = Vec::new();
        let take = |number, outcome| {
            outcomes.push((number, outcome));
            if stop.load(Ordering::Relaxed) { Err(stopped()) } else { Ok(()) }
        };
        pool(threads)?.install(|| each_sample(&numbers, |number| sweep.script(number), &config, take))?;
        outcomes.sort_by_key(|(number, _)| *number);
        let count = |what: &Outcome| outcomes.iter().filter(|(_, outcome)| outcome == what).count();
        let mut file = Cursor::new(Vec::new());
        arrays::write(&mut file, &sweep, &outcomes).map_err(|error| Error::io("sweep", error))?;
        Ok((file.into_inner(), count(&Outcome::NoEvent), count(&Outcome::Incomplete)))
    })?;
    Ok((PyBytes::new(py, &bytes), no_event, incomplete))
}

/// Returns the text of a sweep that is a table in JSON.
fn text_of(sweep: &OsStr) -> PyResult<String> {
    let text = toml::to_string(&table("sweep", &sweep.to_string_lossy())?);
    text.map_err(|error| refused(format_args!("sweep: {error}")))
}

/// The data set of a sweep of random slides along the path, as the bytes of the file that `wstac dataset --input`
/// writes.
#[pyfunction]
pub(crate) fn path_dataset<'py>(
    py: Python<'py>,
    sweep: OsString,
    is_table: bool,
    input: &str,
    threads: Option<u16>,
) -> PyResult<Bound<'py, PyBytes>> {
    let input = input_of(input)?;
    let sweep = if is_table {
        RandomSweep::parse("sweep", &text_of(&sweep)?).map_err(crate::failed_by)?
    } else {
        waiting(py, || RandomSweep::read(Path::new(&sweep)))?
    };
    let bytes = in_thread(py, move |stop| {
        let goes_on = || !stop.load(Ordering::Relaxed);
        let row = |slide| PathRow::of(&slide, input);
        let slides = pool(threads)?.install(|| sweep.slides.some_while(0..sweep.slides.slides, goes_on, row))?;
        let mut file = Cursor::new(Vec::new());
        let written = write_split(&mut file, &slides.ok_or_else(stopped)?, input, |sensor| sweep.is_for_tests(sensor));
        written.map_err(|error| Error::io("sweep", error))?;
        Ok(file.into_inner())
    })?;
    Ok(PyBytes::new(py, &bytes))
}
