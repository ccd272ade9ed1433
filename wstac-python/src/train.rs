//! Training of texture models, as `wstac train` does it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use wstac_core::model::file::{Input, Task};
use wstac_host::atomic_write::AtomicFile;
use wstac_host::config::Config as Parsed;
use wstac_host::error::{Error, ErrorKind};
use wstac_train::dataset::random::RandomSweep;
use wstac_train::dataset::recordings::{comparable, find, read, read_paths};
use wstac_train::train::{TrainOptions, TrainedModel, TrainingSet, wilson};

use crate::config::Config;
use crate::failed;

/// Time between two looks for Ctrl-C.
const BETWEEN_LOOKS: Duration = Duration::from_millis(200);

/// What to train, and where the model goes.
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
    let choice = |what: &str, found: &str, expected: &str| {
        crate::refused(format_args!("{what} is {found:?}, expected {expected}"))
    };
    let input = match input {
        "frames" => Input::Frames,
        "path" => Input::Path,
        "taxel-path" | "taxel_path" => Input::TaxelPath,
        _ => return Err(choice("input", input, "frames, path or taxel-path")),
    };
    let task = match task {
        "specimen" => Task::Specimen,
        "pattern" => Task::Pattern,
        "depth" => Task::Depth,
        "other" => Task::Other,
        _ => return Err(choice("task", task, "specimen, pattern, depth or other")),
    };
    if !(0.0..1.0).contains(&test) {
        return Err(choice("test", &test.to_string(), "a fraction: at least 0 and below 1"));
    }
    let options = TrainOptions { input, task, test, note };
    let config = config.map(|config| config.0.clone());
    let job = Job { sets, output, options, config, threads, force };
    // It runs in a thread of its own, so that Ctrl-C ends the wait at once; the thread then writes nothing.
    let stop = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let stopped = Arc::clone(&stop);
    std::thread::spawn(move || {
        let result = job.run(&stopped);
        // Nobody waits for it after Ctrl-C.
        let _ = sender.send(result);
    });
    // A receiver is for one thread at a time.
    let receiver = std::sync::Mutex::new(receiver);
    let next = || receiver.lock().map_or(Err(RecvTimeoutError::Disconnected), |from| from.recv_timeout(BETWEEN_LOOKS));
    loop {
        match py.detach(next) {
            Ok(result) => return facts(py, &result.map_err(|error| failed(py, &error))?),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            }
            Err(RecvTimeoutError::Disconnected) => return Err(crate::refused("train: ended without a result")),
        }
    }
}

impl Job {
    fn run(&self, stop: &AtomicBool) -> Result<TrainedModel, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads.map_or(0, usize::from)).build();
        let pool = pool.map_err(|error| Error::with_cause(ErrorKind::Usage, "threads", error))?;
        pool.install(|| {
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
            for file in find(&recordings)? {
                if stop.load(Ordering::Relaxed) {
                    return Err(stopped());
                }
                let read = if options.input == Input::Frames { read } else { read_paths };
                all.push(read(&file, self.config.as_ref())?);
            }
            comparable(&all)?;
            set.extend(TrainingSet::of_recordings(&all, options)?);
        }
        Ok(set)
    }
}

/// The error after Ctrl-C, which nobody sees.
fn stopped() -> Error {
    Error::new(ErrorKind::Usage, "train", "was stopped")
}

/// Returns the facts about a trained model.
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
        all.set_item("interval", wilson(trial.right(), trial.slides()).to_vec())?;
        all.set_item("confusion", &trial.counts)?;
    }
    Ok(all)
}
