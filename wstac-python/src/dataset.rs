//! Data sets of simulated slides, as `wstac dataset` makes them.

use std::ffi::OsString;
use std::io::Cursor;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::rate::FrameRate;
use wstac_host::config::Config as Parsed;
use wstac_host::error::Error;
use wstac_scene::Touch;
use wstac_scene::specimen::{Pattern, Specimen};
use wstac_train::dataset::path::{PathRow, write_split};
use wstac_train::dataset::random::RandomSweep;
use wstac_train::dataset::sweep::Sweep;
use wstac_train::dataset::{Outcome, each_sample};

use crate::config::{Config, table};
use crate::outputs::shaped;
use crate::train::{in_thread, input_of, pool, stopped};
use crate::{refused, waiting};

/// Time between two looks for Ctrl-C, and most slides between them.
const BETWEEN_LOOKS: Duration = Duration::from_millis(200);
const MOST_AT_A_TIME: usize = 4096;

/// The arrays of a sweep: of its file, or of a table in JSON.
#[pyfunction]
pub(crate) fn dataset<'py>(
    py: Python<'py>,
    sweep: OsString,
    is_table: bool,
    config: Option<&Config>,
    threads: Option<u16>,
) -> PyResult<Bound<'py, PyDict>> {
    let sweep = if is_table {
        let text = toml::to_string(&table("sweep", &sweep.to_string_lossy())?);
        Sweep::parse("sweep", &text.map_err(|error| refused(format_args!("sweep: {error}")))?).map_err(refused)?
    } else {
        waiting(py, || Sweep::read(Path::new(&sweep)))?
    };
    let config = config.map_or_else(Parsed::default, |config| config.0.clone());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from)).build();
    let pool = pool.map_err(|error| refused(format_args!("threads: {error}")))?;
    let numbers: Vec<u32> = (0..sweep.count()).collect();
    let mut outcomes = Vec::new();
    let (mut rest, mut at_a_time) = (&numbers[..], pool.current_num_threads());
    while !rest.is_empty() {
        py.check_signals()?;
        let (numbers, more) = rest.split_at(at_a_time.min(rest.len()));
        rest = more;
        let started = Instant::now();
        let made = py.detach(|| {
            pool.install(|| {
                each_sample(
                    numbers,
                    |number| sweep.script(number),
                    &config,
                    |number, outcome| {
                        outcomes.push((number, outcome));
                        Ok::<(), Error>(())
                    },
                )
            })
        });
        made.map_err(refused)?;
        // As many slides at a time as take about as long as Ctrl-C may wait.
        if started.elapsed() < BETWEEN_LOOKS / 2 {
            at_a_time = (2 * at_a_time).min(MOST_AT_A_TIME);
        } else if started.elapsed() > BETWEEN_LOOKS {
            at_a_time = (at_a_time / 2).max(pool.current_num_threads());
        }
    }
    outcomes.sort_by_key(|(number, _)| *number);
    arrays(py, &sweep, &outcomes)
}

/// The data set of a sweep of random slides along the path, as the bytes of the file that `wstac dataset --input` writes.
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
        let text = toml::to_string(&table("sweep", &sweep.to_string_lossy())?);
        let text = text.map_err(|error| refused(format_args!("sweep: {error}")))?;
        RandomSweep::parse("sweep", &text).map_err(refused)?
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

/// The arrays of what became of slides, in their order.
fn arrays<'py>(py: Python<'py>, sweep: &Sweep, outcomes: &[(u32, Outcome)]) -> PyResult<Bound<'py, PyDict>> {
    let samples: Vec<_> = outcomes
        .iter()
        .filter_map(|(number, outcome)| match outcome {
            Outcome::Sample(sample, facts) => Some((sweep.slide(*number), sample, facts)),
            Outcome::NoEvent | Outcome::Incomplete => None,
        })
        .collect();
    let count = |what: &Outcome| outcomes.iter().filter(|(_, outcome)| outcome == what).count();
    let slides = || samples.iter().map(|((slide, seed), ..)| (slide, *seed));
    let text = |of: &dyn Fn(&Specimen) -> String| slides().map(|(slide, _)| of(&slide.specimen)).collect::<Vec<_>>();
    let values: Vec<i16> = samples.iter().flat_map(|(_, sample, _)| sample.as_flattened()).copied().collect();
    let all = PyDict::new(py);
    all.set_item("X", shaped(PyArray1::from_vec(py, values), [samples.len(), FEATURES, SAMPLE_FRAMES])?)?;
    all.set_item("y_specimen", text(&name))?;
    all.set_item("y_pattern", text(&|specimen| specimen.pattern.name().into()))?;
    all.set_item("y_depth", PyArray1::from_iter(py, slides().map(|(slide, _)| slide.specimen.depth_mm)))?;
    all.set_item("whole_depths", sweep.specimens().iter().all(|specimen| specimen.depth_mm.fract() == 0.0))?;
    all.set_item("speed", PyArray1::from_iter(py, slides().map(|(slide, _)| slide.speed_mm_s)))?;
    let degrees = || slides().map(|(slide, _)| slide.direction_deg);
    if sweep.directions_deg().iter().all(|degrees| degrees.fract() == 0.0) {
        all.set_item("direction", PyArray1::from_iter(py, degrees().map(|degrees| degrees as i64)))?;
    } else {
        all.set_item("direction", PyArray1::from_iter(py, degrees()))?;
    }
    all.set_item("seed", PyArray1::from_iter(py, slides().map(|(_, seed)| seed)))?;
    all.set_item("reliable", PyArray1::from_iter(py, samples.iter().map(|(.., facts)| facts.reliable)))?;
    let durations = samples.iter().map(|(.., facts)| facts.duration.map_or(-1, i64::from));
    all.set_item("duration", PyArray1::from_iter(py, durations))?;
    let source = slides().map(|(slide, seed)| format!("scene: {}, seed {seed}", Touch::Slide(*slide)));
    all.set_item("source", source.collect::<Vec<_>>())?;
    let rate: FrameRate = sweep.rate();
    all.set_item("rate", (rate.numerator(), rate.denominator()))?;
    all.set_item("no_event", count(&Outcome::NoEvent))?;
    all.set_item("incomplete", count(&Outcome::Incomplete))?;
    Ok(all)
}

/// The name alone, whatever else is unusual: `Saw3`, `Saw3.5`, `Sphere`.
pub(crate) fn name(specimen: &Specimen) -> String {
    match specimen.pattern {
        Pattern::Sphere => specimen.pattern.name().into(),
        pattern => format!("{}{}", pattern.name(), specimen.depth_mm),
    }
}
