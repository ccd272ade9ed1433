//! `wstac dataset` makes a data set of recordings.

use std::ops::Range;
use std::path::PathBuf;

use rayon::prelude::*;
use wstac_core::model::file::Input;

use super::random::without_path;
use super::{Arguments, Ending, finishing, note, outputs, pool, signals, tell_facts, units, write_all};
use crate::commands::output::Stop;
use crate::commands::progress::ProgressLine;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_train::dataset::recorded_arrays;
use wstac_train::dataset::recordings::{
    Recording, RecordingPart, comparable, find, for_tests, parts, read, read_labels, read_paths,
};

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let config = arguments.config.as_deref().map(Config::read).transpose()?;
    let (outputs, output) = (outputs(arguments), &arguments.output);
    let input = arguments.sample();
    let parts = parts(find(&arguments.sources)?);
    let units = units::chosen(arguments.units.as_ref(), parts.len(), "recordings")?;
    let recordings = read_units(&parts, &units, config.as_ref(), input, &pool(arguments.threads)?)?;
    let samples = tell(&recordings[units.start as usize..units.end as usize], input);
    if samples == 0 && arguments.units.is_none() {
        let message = "none of the recordings has an event, expected at least 1";
        return Err(Error::new(ErrorKind::Data, output.display(), message).into());
    }
    let paths: Vec<_> = recordings.iter().flat_map(|recording| recording.path_samples(input)).collect();
    let tests = for_tests(&recordings, arguments.test);
    write_all(&outputs, output, |file| recorded_arrays::write(file, &recordings, &tests, input, &paths))?;
    let for_tests = (0..).zip(&tests).filter(|(number, test)| **test && units.contains(number)).count();
    let (samples, count) = (counted(samples, "sample"), counted(units.len(), "recording"));
    note(format_args!("{}: {samples} of {count}, {for_tests} of them for tests", output.display()));
    Ok(())
}

/// Prints what is unusual about the samples of recordings, and returns their number.
fn tell(recordings: &[Recording], input: Input) -> usize {
    for recording in recordings.iter().filter(|recording| recording.samples.is_empty()) {
        note(format_args!("{}: no event, so no sample", recording.name));
    }
    let incomplete: u64 = recordings.iter().map(|recording| recording.incomplete).sum();
    if incomplete > 0 {
        note(format_args!("left out: {}", counted(incomplete, "incomplete event")));
    }
    let facts = recordings.iter().flat_map(|recording| &recording.samples).map(|(.., facts)| *facts);
    let facts: Vec<_> = facts.collect();
    tell_facts(&facts);
    if input != Input::Frames {
        let paths = recordings.iter().flat_map(|recording| recording.path_samples(input));
        without_path(paths.filter(Option::is_none).count(), facts.len());
    }
    facts.len()
}

/// Reads recordings, with their samples of this input, and prints what is doubtful about them.
pub(in crate::commands) fn read_all(
    sources: &[PathBuf],
    config: Option<&Config>,
    input: Input,
    threads: &rayon::ThreadPool,
) -> Result<Vec<Recording>, Stop> {
    let parts = parts(find(sources)?);
    read_units(&parts, &units::chosen(None, parts.len(), "recordings")?, config, input, threads)
}

/// Reads recordings as [`read_all`] does, but the samples of these units only.
fn read_units(
    parts: &[RecordingPart],
    units: &Range<u32>,
    config: Option<&Config>,
    input: Input,
    threads: &rayon::ThreadPool,
) -> Result<Vec<Recording>, Stop> {
    finishing(Ending::InTime);
    let progress = std::sync::Mutex::new(ProgressLine::new("recordings", units.len()));
    let results = threads.install(|| {
        let each = parts.par_iter().enumerate().with_max_len(1).map(|(number, part)| {
            if signals::check().is_err() {
                return Ok(None);
            }
            if !units.contains(&(number as u32)) {
                return read_labels(part, config).map(Some);
            }
            let of_paths = input != Input::Frames;
            let recording = if of_paths { read_paths(part, config)? } else { read(part, config)? };
            if let Ok(mut progress) = progress.lock() {
                progress.one_more();
            }
            Ok(Some(recording))
        });
        each.collect::<Vec<Result<Option<Recording>, Error>>>()
    });
    drop(progress);
    let (recordings, mut bad): (Vec<_>, Vec<_>) = results.into_iter().partition(Result::is_ok);
    // All that cannot be used are named in one run.
    if let Some(Err(last)) = bad.pop() {
        bad.iter().filter_map(|result| result.as_ref().err()).for_each(note);
        return Err(last.into());
    }
    let recordings = recordings.into_iter().flatten().collect::<Option<Vec<Recording>>>();
    let Some(recordings) = recordings else { return Err(Stop::Interrupted(signals::code())) };
    comparable(&recordings)?.iter().for_each(note);
    Ok(recordings)
}
