//! `wstac dataset --shard` and `wstac dataset merge`: a data set that several processes make.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use wstac_core::model::file::Input;

use super::progress::Progress;
use super::{Ending, Source, beside, check, each_sample, finish, finishing, number, outputs, pool, random, recorded};
use crate::commands::files::Outputs;
use crate::commands::output::Stop;
use crate::commands::shards::make_shard;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::text_file::file_text;
use wstac_train::dataset::random::RandomSweep;
use wstac_train::dataset::recordings::{RecordingPart, comparable, find, parts};
use wstac_train::dataset::shard::{frames, random as random_shard, recorded as recorded_shard};
use wstac_train::dataset::sweep::Sweep;
use wstac_train::shard::{Shard, ShardKind, WholeSet};

/// Merge all shards of a data set, in any order
///
/// The set equals that of one process, byte for byte. Shards that are missing, there twice, of another set or damaged
/// are refused by name.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The files of wstac dataset --shard, all of one set
    #[arg(value_name = "SHARD", required = true)]
    shards: Vec<PathBuf>,

    /// Write the samples to this new file
    #[arg(short, long, value_name = "FILE.npz")]
    output: PathBuf,

    /// Overwrite FILE.npz
    ///
    /// It also starts anew if FILE.npz.part is of another sweep.
    #[arg(long)]
    force: bool,
}

/// Merges shards to a data set.
pub(super) fn merge_all(arguments: &Arguments) -> Result<(), Stop> {
    let Arguments { shards, output, force } = arguments;
    let outputs = Outputs::new(*force).reading(shards);
    outputs.check([output])?;
    let set = WholeSet::open(shards)?;
    match set.set().kind {
        ShardKind::Frames => {
            let sweep = frames::sweep(&set)?;
            let part = frames::merge(&set, &beside(output, ".part"), *force)?;
            finish(&outputs, output, &sweep, part, set.first().path())
        }
        ShardKind::RandomSlides => {
            let set = random_shard::read(&set)?;
            random::finish(&outputs, output, &set.sweep, set.input, &set.rows)
        }
        ShardKind::Recordings => {
            let set = recorded_shard::read(&set)?;
            comparable(&set.recordings)?.iter().for_each(super::note);
            let paths: Vec<_> = set.paths.iter().map(|path| path.as_deref()).collect();
            recorded::finish(&outputs, output, &set.recordings, set.input, &paths, set.test)
        }
        ShardKind::Trade => {
            let message = "is a shard of wstac trade, expected shards of wstac dataset: use wstac trade --merge";
            Err(Error::new(ErrorKind::Config, set.first().path().display(), message).into())
        }
    }
}

/// Makes one shard of a data set.
pub(super) fn run(arguments: &super::Arguments, numbers: [u32; 2]) -> Result<(), Stop> {
    match arguments.source()? {
        Source::Sweep(file) => of_sweep(arguments, numbers, file),
        Source::Random(file) => of_random(arguments, numbers, file),
        Source::Recordings => of_recordings(arguments, numbers),
    }
}

/// Makes a shard of a sweep over time.
fn of_sweep(arguments: &super::Arguments, numbers: [u32; 2], file: &Path) -> Result<(), Stop> {
    let config = arguments.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    let text = file_text(file)?;
    let sweep = Sweep::parse(&file.display().to_string(), &text)?;
    check(&sweep.script(0), &config).map_err(|error| Error::new(ErrorKind::Config, file.display(), error))?;
    let shard = Shard::new(numbers, frames::set(&sweep, text, &config))?;
    make_shard(&shard, arguments.output(), &outputs(arguments), arguments.force, |slides| {
        finishing(Ending::InTime);
        let signal = number();
        let mut contents = Vec::with_capacity(slides.len());
        let mut progress = Progress::new("slides", 0, slides.len() as u32);
        pool(arguments.threads)?.install(|| {
            each_sample(
                slides,
                |number| sweep.script(number),
                &config,
                |number, outcome| {
                    contents.push((number, frames::content(number, &outcome)));
                    progress.say(contents.len() as u32);
                    match signal.load(Ordering::Relaxed) {
                        0 => Ok(()),
                        signal => Err(Stop::Interrupted(signal as u8)),
                    }
                },
            )
        })?;
        contents.sort_unstable_by_key(|(number, _)| *number);
        Ok(contents)
    })
}

/// Makes a shard of random slides; without a file, of the defaults.
fn of_random(arguments: &super::Arguments, numbers: [u32; 2], file: Option<&Path>) -> Result<(), Stop> {
    let input: Input = arguments.sample().into();
    let text = file.map_or_else(|| Ok(String::new()), file_text)?;
    let subject = file.map_or_else(|| "sweep".to_owned(), |file| file.display().to_string());
    let sweep = RandomSweep::parse(&subject, &text)?;
    let shard = Shard::new(numbers, random_shard::set(&sweep, &text, input)?)?;
    make_shard(&shard, arguments.output(), &outputs(arguments), arguments.force, |slides| {
        let keep = |slide| Ok(random_shard::content(&slide, input));
        let contents = random::simulated(&sweep, slides, &pool(arguments.threads)?, keep)?;
        Ok(slides.iter().copied().zip(contents).collect())
    })
}

/// Makes a shard of recordings.
fn of_recordings(arguments: &super::Arguments, numbers: [u32; 2]) -> Result<(), Stop> {
    let input: Input = arguments.sample().into();
    let text = arguments.config.as_deref().map(file_text).transpose()?;
    let config = arguments.config.as_deref().map(Config::read).transpose()?;
    let parts = parts(find(&arguments.sources)?);
    let set = recorded_shard::set(&parts, text.as_deref(), input, arguments.test)?;
    let shard = Shard::new(numbers, set)?;
    make_shard(&shard, arguments.output(), &outputs(arguments), arguments.force, |items| {
        let own: Vec<RecordingPart> = items.iter().filter_map(|item| parts.get(*item as usize)).cloned().collect();
        // Doubts are said when all recordings are there.
        let (recordings, _) = recorded::read_parts(&own, config.as_ref(), input, &pool(arguments.threads)?)?;
        let contents = recordings.iter().map(|recording| recorded_shard::content(recording, input));
        let contents = contents.collect::<Result<Vec<_>, Error>>()?;
        Ok(items.iter().copied().zip(contents).collect())
    })
}
