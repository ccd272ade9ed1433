//! Training of texture models, as `wstac train` does it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde_json::json;
use wstac_core::model::file::{Input, Task};
use wstac_host::atomic_write::AtomicFile;
use wstac_host::config::Config as Parsed;
use wstac_host::error::{Error, ErrorKind};
use wstac_train::dataset::random::RandomSweep;
use wstac_train::dataset::recordings::{comparable, find, parts, read, read_paths};
use wstac_train::model::calibrate::{LabeledSamples, projection_of};
use wstac_train::model::eval::is_sample;
use wstac_train::model::trained::{guess_task, vec_in_file_order};
use wstac_train::model::{Import, import_bytes};
use wstac_train::train::{LabeledSlide, TrainOptions, TrainedModel, TrainingSet, wilson};

use crate::config::Config;
use crate::failed;
use crate::model::{Model, bytes_of};

/// Time between two looks for Ctrl-C.
const BETWEEN_LOOKS: Duration = Duration::from_millis(200);

/// The data and options of a training, and the place of the model.
struct Job {
    sets: Vec<PathBuf>,
    output: PathBuf,
    options: TrainOptions,
    config: Option<Parsed>,
    threads: Option<u16>,
    force: bool,
}

/// Trains a model, writes its file, and returns facts about it.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the package calls it, by one keyword each")]
pub(crate) fn train<'py>(
    py: Python<'py>,
    sets: Vec<PathBuf>,
    output: PathBuf,
    input: &str,
    task: &str,
    test: f64,
    note: Option<String>,
    config: Option<&Config>,
    threads: Option<u16>,
    force: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (input, task) = (input_of(input)?, task_of(task)?);
    if !(0.0..1.0).contains(&test) {
        return Err(choice("test", &test.to_string(), "a fraction: at least 0 and below 1"));
    }
    let options = TrainOptions { input, task, test, note };
    let config = config.map(|config| config.0.clone());
    let job = Job { sets, output, options, config, threads, force };
    facts(py, &in_thread(py, move |stop| job.run(stop))?)
}

fn choice(what: &str, found: &str, expected: &str) -> PyErr {
    crate::refused(format_args!("{what} is {found:?}, expected {expected}"))
}

pub(crate) fn input_of(name: &str) -> PyResult<Input> {
    let all = [Input::Frames, Input::Path, Input::TaxelPath, Input::Taxels];
    let expected = "\"frames\", \"path\", \"taxel-path\" (also \"taxel_path\") or \"taxels\"";
    let found = all.into_iter().find(|input| input.name() == name.replace('-', "_"));
    found.ok_or_else(|| choice("input", name, expected))
}

fn task_of(name: &str) -> PyResult<Task> {
    let all = [Task::Specimen, Task::Pattern, Task::Depth, Task::Other];
    let found = all.into_iter().find(|task| task.name() == name);
    found.ok_or_else(|| choice("task", name, "specimen, pattern, depth or other"))
}

/// Trains a model on samples (n, 700) with their labels and groups, without a test. Returns the bytes of its file.
#[pyfunction]
pub(crate) fn fit<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray2<'py, i16>,
    labels: Vec<String>,
    groups: Vec<String>,
    input: &str,
    task: Option<&str>,
    threads: Option<u16>,
) -> PyResult<Bound<'py, PyBytes>> {
    let input = input_of(input)?;
    let task = match task {
        None => guess_task(&labels),
        Some(name) => task_of(name)?,
    };
    let options = TrainOptions { input, task, test: 0.0, note: None };
    let samples = samples.as_slice()?.chunks_exact(input.numbers());
    let slides = samples.zip(labels).zip(groups).map(|((sample, label), group)| LabeledSlide {
        numbers: is_sample(sample).then(|| sample.to_vec()),
        label,
        group,
        speed_mm_s: None,
        is_test: None,
    });
    let set = TrainingSet { slides: slides.collect(), sources: vec!["arrays".into()], simulated: 0 };
    let trained = in_thread(py, move |_| pool(threads)?.install(|| wstac_train::train::train(set, &options)))?;
    Ok(PyBytes::new(py, &trained.written.bytes()))
}

pub(crate) fn pool(threads: Option<u16>) -> Result<rayon::ThreadPool, Error> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from)).build();
    pool.map_err(|error| Error::with_cause(ErrorKind::Usage, "threads", error))
}

/// Runs a job in a thread of its own, so that Ctrl-C ends the wait at once. The job then hears that it is to stop, and
/// writes nothing.
pub(crate) fn in_thread<T: Send + 'static>(
    py: Python<'_>,
    job: impl FnOnce(&AtomicBool) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let stopped = Arc::clone(&stop);
    std::thread::spawn(move || {
        let result = job(&stopped);
        // Nobody waits for it after Ctrl-C.
        let _ = sender.send(result);
    });
    // A receiver is for one thread at a time.
    let receiver = std::sync::Mutex::new(receiver);
    let next = || receiver.lock().map_or(Err(RecvTimeoutError::Disconnected), |from| from.recv_timeout(BETWEEN_LOOKS));
    loop {
        match py.detach(next) {
            Ok(result) => return result.map_err(|error| failed(py, &error)),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(crate::refused("the computation ended without a result"));
            }
        }
    }
}

impl Job {
    fn run(&self, stop: &AtomicBool) -> Result<TrainedModel, Error> {
        pool(self.threads)?.install(|| {
            self.check_output()?;
            let trained = wstac_train::train::train(self.gathered(stop)?, &self.options)?;
            if stop.load(Ordering::Relaxed) {
                return Err(stopped());
            }
            let mut file = AtomicFile::create(&self.output)?;
            let written = file.write_all(&trained.written.bytes());
            written.map_err(|error| Error::io(self.output.display(), error))?;
            if self.force { file.commit() } else { file.commit_new() }?;
            Ok(trained)
        })
    }

    /// Refuses an output that is an input, or that exists.
    fn check_output(&self) -> Result<(), Error> {
        let Ok(real) = self.output.canonicalize() else { return Ok(()) };
        let is_input = |set: &PathBuf| set.canonicalize().is_ok_and(|set| real == set || real.parent() == Some(&*set));
        let message = if self.sets.iter().any(is_input) {
            "is an input, expected a new file"
        } else if self.force {
            return Ok(());
        } else {
            "exists, expected a new file, or force=True"
        };
        Err(Error::new(ErrorKind::AlreadyExists, self.output.display(), message))
    }

    /// Reads all sets; without any, simulates slides by default.
    fn gathered(&self, stop: &AtomicBool) -> Result<TrainingSet, Error> {
        let ends = |path: &Path, with: &str| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(with));
        let options = &self.options;
        let simulated = |sweep: &RandomSweep| {
            let slides = sweep.slides.all_while(|| !stop.load(Ordering::Relaxed))?;
            Ok(TrainingSet::of_sweep(sweep, &slides.ok_or_else(stopped)?, options))
        };
        if self.sets.is_empty() {
            return simulated(&RandomSweep::default());
        }
        let (mut set, mut recordings) = (TrainingSet::default(), Vec::new());
        for path in &self.sets {
            if ends(path, "npz") {
                set.extend(TrainingSet::read(path, options)?);
            } else if ends(path, "toml") {
                let mut slides = simulated(&RandomSweep::read(path)?)?;
                slides.sources = vec![path.display().to_string()];
                set.extend(slides);
            } else {
                recordings.push(path.clone());
            }
        }
        if !recordings.is_empty() {
            let mut all = Vec::new();
            for part in parts(find(&recordings)?) {
                if stop.load(Ordering::Relaxed) {
                    return Err(stopped());
                }
                let read = if options.input == Input::Frames { read } else { read_paths };
                all.push(read(&part, self.config.as_ref())?);
            }
            comparable(&all)?;
            set.extend(TrainingSet::of_recordings(&all, options)?);
        }
        Ok(set)
    }
}

/// The error after Ctrl-C, which nobody sees.
pub(crate) fn stopped() -> Error {
    Error::new(ErrorKind::Usage, "the computation", "was stopped")
}

fn facts<'py>(py: Python<'py>, trained: &TrainedModel) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("labels", &trained.labels)?;
    all.set_item("slides", trained.slides)?;
    all.set_item("groups", trained.groups)?;
    all.set_item("left_out", trained.left_out)?;
    all.set_item("calibrated", trained.calibration.is_some())?;
    if let Some(trial) = &trained.trial {
        all.set_item("test_slides", trial.slides())?;
        all.set_item("test_groups", trial.groups)?;
        all.set_item("right", trial.right())?;
        all.set_item("answered", trial.answered())?;
        all.set_item("interval", wilson(trial.right(), trial.slides()).to_vec())?;
        all.set_item("confusion", &trial.counts)?;
    }
    Ok(all)
}

/// Makes a model file of the bytes of a trainer's file. `samples` are int16 of one
/// length, as data sets have them. Returns the file's bytes.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the package calls it, by one keyword each")]
pub(crate) fn import_model<'py>(
    py: Python<'py>,
    name: &str,
    content: Vec<u8>,
    labels: Option<Vec<String>>,
    task: Option<&str>,
    input: Option<&str>,
    samples: PyReadonlyArray2<'py, i16>,
    note: Option<String>,
) -> PyResult<Bound<'py, PyBytes>> {
    let (task, input) = (task.map(task_of).transpose()?, input.map(input_of).transpose()?);
    let samples = samples.as_slice()?.chunks_exact(samples.shape()[1].max(1)).map(<[i16]>::to_vec).collect();
    let wanted = Import { labels, task, input, note, samples: Some(samples), ..Import::default() };
    let made = py.detach(|| import_bytes(name, content, &wanted));
    Ok(PyBytes::new(py, &made.map_err(|why| crate::refused(format_args!("{name}: {why}")))?.1.bytes()))
}

/// Makes a model of new textures from samples (n, 700) and the name of each, as `wstac model learn` does. Returns the
/// file's bytes.
#[pyfunction]
pub(crate) fn learn<'py>(
    py: Python<'py>,
    base: &Model,
    samples: PyReadonlyArray2<'py, i16>,
    names: Vec<String>,
    note: Option<String>,
) -> PyResult<Bound<'py, PyBytes>> {
    let mut slides = LabeledSamples::default();
    for (sample, name) in samples.as_slice()?.chunks_exact(base.inputs()).zip(names) {
        if is_sample(sample) {
            let numbers = vec![vec_in_file_order(sample)];
            slides.append(LabeledSamples { numbers, labels: vec![0], names: vec![name] });
        }
    }
    let base = base.file().clone();
    let words = in_thread(py, move |_| {
        let refused = |what: &str, why: String| Error::new(ErrorKind::Data, what, why);
        projection_of(base.words()).map_err(|why| refused(base.about(), why))?;
        let mut facts = json!({ "learned_from": ["arrays"], "base": base.about(), "slides": slides.numbers.len() });
        if let Some(note) = note {
            facts["note"] = note.into();
        }
        let learned = wstac_train::model::learn::learn(base.words(), &slides, &facts.to_string());
        Ok(learned.map_err(|why| refused("X and y", why))?.words)
    })?;
    Ok(PyBytes::new(py, &bytes_of(&words)))
}
