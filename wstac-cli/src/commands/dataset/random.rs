//! `wstac dataset --input path` makes a data set of random slides.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use wstac_core::model::file::Input;

use super::progress::Progress;
use super::{Arguments, Ending, finishing, note, number, outputs, pool, write_all};
use crate::commands::output::Stop;
use wstac_host::plural::counted;
use wstac_train::dataset::path::{PathSlide, write_split};
use wstac_train::dataset::random::RandomSweep;

/// Makes the data set of a sweep's file, or of the defaults.
pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let sweep = sweep(arguments.sources.first())?;
    let input: Input = arguments.sample().into();
    let outputs = outputs(arguments);
    outputs.check([arguments.output()])?;
    let slides = simulate(&sweep, &pool(arguments.threads)?)?;
    without_path(slides.iter().filter(|slide| slide.sample(input).is_none()).count(), slides.len());
    let is_for_tests = |sensor| sweep.is_for_tests(sensor);
    write_all(&outputs, arguments.output(), |file| write_split(file, &slides, input, is_for_tests))?;
    let tests = slides.iter().filter(|slide| sweep.is_for_tests(slide.sensor)).count();
    let (path, count) = (arguments.output().display(), counted(slides.len(), "slide"));
    note(format_args!("{path}: {count}, {tests} of them on sensors for tests"));
    Ok(())
}

/// Reads a sweep's file; without one, the defaults hold.
pub(in crate::commands) fn sweep(file: Option<&PathBuf>) -> Result<RandomSweep, Stop> {
    Ok(file.map(|file| RandomSweep::read(file)).transpose()?.unwrap_or_default())
}

/// Simulates the slides of a sweep.
pub(in crate::commands) fn simulate(sweep: &RandomSweep, threads: &rayon::ThreadPool) -> Result<Vec<PathSlide>, Stop> {
    finishing(Ending::InTime);
    let signal = number();
    let progress = Mutex::new((Progress::new("slides", 0, sweep.slides.slides), 0));
    let goes_on = || {
        if let Ok(mut progress) = progress.lock() {
            progress.1 += 1;
            let done = progress.1;
            progress.0.say(done);
        }
        signal.load(Ordering::Relaxed) == 0
    };
    let slides = threads.install(|| sweep.slides.all_while(goes_on))?;
    slides.ok_or_else(|| Stop::Interrupted(signal.load(Ordering::Relaxed) as u8))
}

/// Prints how many samples are missing.
pub(super) fn without_path(missing: usize, of: usize) {
    if missing > 0 {
        let of = counted(of, "sample");
        note(format_args!("{missing} of {of} are zero: no event, no velocity, or too little of the path"));
    }
}
