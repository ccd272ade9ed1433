//! What a reading gives, on its way to Python.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_host::error::Error;
use wstac_host::output::Output;

use crate::refused;

/// A record as Python gets it: the line that `wstac run --json` prints, and an event's sample, int16 (10, 70).
pub(crate) type Given<'py> = (String, Option<Bound<'py, PyAny>>);

/// Records and features in their order.
#[derive(Default)]
pub(crate) struct Gathered {
    /// Features of each feature frame, ten a frame, in units of 2^-11.
    pub(crate) features: Vec<i16>,
    /// Number of each feature frame.
    pub(crate) numbers: Vec<i64>,
    /// Lines of JSON, and samples, feature by feature.
    records: Vec<(String, Option<Vec<i16>>)>,
}

impl Gathered {
    /// Takes a record. What [`Output::Features`] has becomes numbers, not a line.
    pub(crate) fn take(&mut self, record: Output) -> Result<(), Error> {
        let sample = match record {
            Output::Features { frame, f } => {
                self.features.extend(f.map(units));
                self.numbers.push(frame as i64);
                return Ok(());
            }
            Output::Event(mut event) => {
                let sample = event.sample.take();
                self.line(&Output::Event(event))?;
                sample
            }
            other => return self.line(&other),
        };
        if let Some((_, last)) = self.records.last_mut() {
            *last = sample.map(|features| features.iter().flatten().copied().map(units).collect());
        }
        Ok(())
    }

    fn line(&mut self, record: &Output) -> Result<(), Error> {
        let line = serde_json::to_string(record).map_err(|error| Error::new("record", error))?;
        self.records.push((line, None));
        Ok(())
    }

    /// Notes frames that the source lost before its camera frame `at`; the line of a recording's faults.
    pub(crate) fn lost(&mut self, at: u64, frames: u64, why: &str) {
        let line = serde_json::json!({ "kind": "lost", "at": at, "frames": frames, "why": why });
        self.records.push((line.to_string(), None));
    }

    /// Whether there is no record; features do not count.
    pub(crate) fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// The records, none of which stay.
    pub(crate) fn records<'py>(&mut self, py: Python<'py>) -> PyResult<Vec<Given<'py>>> {
        let records = std::mem::take(&mut self.records).into_iter().map(|(line, sample)| {
            let sample = sample.map(|sample| shaped(PyArray1::from_vec(py, sample), [FEATURES, SAMPLE_FRAMES]));
            Ok((line, sample.transpose()?))
        });
        records.collect()
    }
}

/// An array of another shape with as many numbers.
pub(crate) fn shaped<T: numpy::Element, const N: usize>(
    array: Bound<'_, PyArray1<T>>,
    shape: [usize; N],
) -> PyResult<Bound<'_, PyAny>> {
    Ok(array.reshape(&shape[..]).map_err(refused)?.into_any())
}
