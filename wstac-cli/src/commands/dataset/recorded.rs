//! `wstac dataset` makes a data set of recordings.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use wstac_core::model::file::Input;

use super::progress::Progress;
use super::random::without_path;
use super::{Arguments, Ending, finishing, note, number, outputs, pool, write_all};
use crate::commands::output::Stop;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_train::dataset::recorded_arrays;
use wstac_train::dataset::recordings::{Recording, comparable, find, for_tests, read, read_paths, sensors};

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let config = arguments.config.as_deref().map(Config::read).transpose()?;
    if let Some(sweep) = arguments.sources.iter().find(|source| source.extension().is_some_and(|end| end == "toml")) {
        return Err(Error::new(
            ErrorKind::Usage,
            sweep.display(),
            "is a sweep among other sources, expected a single sweep, or recordings",
        )
        .into());
    }
    let outputs = outputs(arguments);
    outputs.check([arguments.output()])?;
    let input = arguments.sample().into();
    let threads = pool(arguments.threads)?;
    let recordings = read_all(&arguments.sources, config.as_ref(), input, &threads)?;
    for recording in recordings.iter().filter(|recording| recording.samples.is_empty()) {
        note(format_args!("{}: no event, so no sample", recording.name));
    }
    let incomplete: u64 = recordings.iter().map(|recording| recording.incomplete).sum();
    if incomplete > 0 {
        note(format_args!("left out: {}", counted(incomplete, "incomplete event")));
    }
    let samples = recordings.iter().map(|recording| recording.samples.len()).sum::<usize>();
    if samples == 0 {
        let message = "none of the recordings has an event, expected at least 1";
        return Err(Error::new(ErrorKind::Data, arguments.output().display(), message).into());
    }
    let facts = || recordings.iter().flat_map(|recording| &recording.samples).map(|(.., facts)| facts);
    let unreliable = facts().filter(|facts| !facts.reliable).count();
    if unreliable > 0 {
        note(format_args!("{unreliable} of {}: not reliable (array reliable)", counted(samples, "sample")));
    }
    let cut_off = facts().filter(|facts| facts.duration.is_none()).count();
    if cut_off > 0 {
        let samples = counted(samples, "sample");
        note(format_args!(
            "{cut_off} of {samples}: without a duration: the slide is cut off or never lit (array duration)"
        ));
    }
    if input != Input::Frames {
        let paths = recordings.iter().flat_map(|recording| &recording.paths);
        without_path(paths.filter(|path| path.sample(input).is_none()).count(), samples);
    }
    let tests = for_tests(&recordings, arguments.test);
    write_all(&outputs, arguments.output(), |file| recorded_arrays::write(file, &recordings, &tests, input))?;
    let for_tests = tests.iter().filter(|test| **test).count();
    let (samples, count) = (counted(samples, "sample"), counted(recordings.len(), "recording"));
    note(format_args!("{}: {samples} of {count}, {for_tests} of them for tests", arguments.output().display()));
    Ok(())
}

/// Reads recordings, with their samples of this input, and prints what is doubtful about them.
pub(in crate::commands) fn read_all(
    sources: &[PathBuf],
    config: Option<&Config>,
    input: Input,
    threads: &rayon::ThreadPool,
) -> Result<Vec<Recording>, Stop> {
    let files = sensors(find(sources)?)?;
    finishing(Ending::InTime);
    let signal = number();
    let progress = std::sync::Mutex::new((Progress::new("recordings", 0, files.len() as u32), 0));
    let results = threads.install(|| {
        let each = files.par_iter().with_max_len(1).map(|file| {
            if signal.load(Ordering::Relaxed) != 0 {
                return Ok(None);
            }
            let (file, sensor) = (&file.0, file.1.as_deref());
            let of_paths = input != Input::Frames;
            let recording = if of_paths { read_paths(file, sensor, config)? } else { read(file, sensor, config)? };
            if let Ok(mut progress) = progress.lock() {
                progress.1 += 1;
                let done = progress.1;
                progress.0.say(done);
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
    let Some(recordings) = recordings else { return Err(Stop::Interrupted(signal.load(Ordering::Relaxed) as u8)) };
    for doubt in comparable(&recordings)? {
        note(doubt);
    }
    Ok(recordings)
}
