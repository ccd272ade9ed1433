//! `wstac dataset --input path` makes a data set of random slides.

use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

use super::{Arguments, Ending, finishing, note, outputs, pool, signals, units, write_all};
use crate::commands::output::Stop;
use crate::commands::progress::ProgressLine;
use wstac_host::plural::counted;
use wstac_train::dataset::path::{PathRow, PathSlide, write_split};
use wstac_train::dataset::random::RandomSweep;

/// Makes the data set of a sweep's file, or of the defaults.
pub(super) fn run(arguments: &Arguments, file: Option<&Path>) -> Result<(), Stop> {
    let sweep = sweep(file)?;
    let input = arguments.sample();
    let (outputs, output) = (outputs(arguments), &arguments.output);
    let units = units::chosen(arguments.units.as_ref(), sweep.slides.slides as usize, "slides")?;
    let rows = simulated(&sweep, units, &pool(arguments.threads)?, |slide| PathRow::of(&slide, input))?;
    without_path(rows.iter().filter(|row| row.sample.is_none()).count(), rows.len());
    let is_for_tests = |sensor| sweep.is_for_tests(sensor);
    write_all(&outputs, output, |file| write_split(file, &rows, input, is_for_tests))?;
    let tests = rows.iter().filter(|row| sweep.is_for_tests(row.sensor)).count();
    let (path, count) = (output.display(), counted(rows.len(), "slide"));
    note(format_args!("{path}: {count}, {tests} of them on sensors for tests"));
    Ok(())
}

/// Reads a sweep's file; without one, the defaults hold.
pub(in crate::commands) fn sweep(file: Option<&Path>) -> Result<RandomSweep, Stop> {
    Ok(file.map(RandomSweep::read).transpose()?.unwrap_or_default())
}

pub(in crate::commands) fn simulate(sweep: &RandomSweep, threads: &rayon::ThreadPool) -> Result<Vec<PathSlide>, Stop> {
    simulated(sweep, 0..sweep.slides.slides, threads, |slide| slide)
}

/// Simulates the slides of some numbers, and returns what `keep` makes of each, in order.
fn simulated<T: Send>(
    sweep: &RandomSweep,
    numbers: Range<u32>,
    threads: &rayon::ThreadPool,
    keep: impl Fn(PathSlide) -> T + Send + Sync,
) -> Result<Vec<T>, Stop> {
    finishing(Ending::InTime);
    let progress = Mutex::new(ProgressLine::new("slides", numbers.len()));
    let goes_on = || {
        if let Ok(mut progress) = progress.lock() {
            progress.one_more();
        }
        signals::check().is_ok()
    };
    let slides = threads.install(|| sweep.slides.some_while(numbers, goes_on, keep))?;
    slides.ok_or_else(|| Stop::Interrupted(signals::code()))
}

/// Prints how many samples are missing.
pub(super) fn without_path(missing: usize, of: usize) {
    if missing > 0 {
        let of = counted(of, "sample");
        note(format_args!("{missing} of {of} are zero: no event, no velocity, or too little of the path"));
    }
}
