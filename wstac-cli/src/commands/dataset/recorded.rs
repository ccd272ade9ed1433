//! `wstac dataset` makes a data set of recordings.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use wstac_core::model::file::{INPUTS, Input};

use super::progress::Progress;
use super::random::without_path;
use super::{Arguments, Ending, finishing, note, number, outputs, pool, write_all};
use crate::commands::files::Outputs;
use crate::commands::output::Stop;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_train::dataset::recorded_arrays;
use wstac_train::dataset::recordings::{
    Recording, RecordingPart, comparable, find, for_tests, parts, read, read_paths,
};

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let config = arguments.config.as_deref().map(Config::read).transpose()?;
    let outputs = outputs(arguments);
    outputs.check([arguments.output()])?;
    let input = arguments.sample().into();
    let threads = pool(arguments.threads)?;
    let recordings = read_all(&arguments.sources, config.as_ref(), input, &threads)?;
    let paths: Vec<_> = recordings.iter().flat_map(|recording| recording.path_samples(input)).collect();
    finish(&outputs, arguments.output(), &recordings, input, &paths, arguments.test)
}

/// Writes the data set of recordings, of which this fraction is for tests. `paths` has the samples along the path of all
/// their events.
pub(super) fn finish(
    outputs: &Outputs,
    output: &Path,
    recordings: &[Recording],
    input: Input,
    paths: &[Option<&[i16; INPUTS]>],
    test: f64,
) -> Result<(), Stop> {
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
        return Err(Error::new(ErrorKind::Data, output.display(), message).into());
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
        without_path(paths.iter().filter(|path| path.is_none()).count(), samples);
    }
    let tests = for_tests(recordings, test);
    write_all(outputs, output, |file| recorded_arrays::write(file, recordings, &tests, input, paths))?;
    let for_tests = tests.iter().filter(|test| **test).count();
    let (samples, count) = (counted(samples, "sample"), counted(recordings.len(), "recording"));
    note(format_args!("{}: {samples} of {count}, {for_tests} of them for tests", output.display()));
    Ok(())
}

/// Reads recordings, with their samples of this input, and prints what is doubtful about them.
pub(in crate::commands) fn read_all(
    sources: &[PathBuf],
    config: Option<&Config>,
    input: Input,
    threads: &rayon::ThreadPool,
) -> Result<Vec<Recording>, Stop> {
    let (recordings, doubts) = read_parts(&parts(find(sources)?), config, input, threads)?;
    doubts.iter().for_each(note);
    Ok(recordings)
}

/// Reads these recordings, and returns doubts about them for a person.
pub(super) fn read_parts(
    parts: &[RecordingPart],
    config: Option<&Config>,
    input: Input,
    threads: &rayon::ThreadPool,
) -> Result<(Vec<Recording>, Vec<String>), Stop> {
    finishing(Ending::InTime);
    let signal = number();
    let progress = std::sync::Mutex::new((Progress::new("recordings", 0, parts.len() as u32), 0));
    let results = threads.install(|| {
        let each = parts.par_iter().with_max_len(1).map(|part| {
            if signal.load(Ordering::Relaxed) != 0 {
                return Ok(None);
            }
            let of_paths = input != Input::Frames;
            let recording = if of_paths { read_paths(part, config)? } else { read(part, config)? };
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
    let doubts = comparable(&recordings)?;
    Ok((recordings, doubts))
}
