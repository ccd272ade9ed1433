//! `wstac dataset --shard` and `wstac dataset merge`: a data set that several processes make.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use super::progress::Progress;
use super::{Ending, Sample, beside, check, each_sample, finish, finishing, note, number, outputs, pool, write_all};
use crate::commands::files::Outputs;
use crate::commands::output::Stop;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::text_file::file_text;
use wstac_train::dataset::shard::{Shard, ShardFile, merge};
use wstac_train::dataset::sweep::Sweep;

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
    let files = shards.iter().map(|path| ShardFile::open(path)).collect::<Result<Vec<_>, Error>>()?;
    let (Some(first), Some(file)) = (shards.first(), files.first()) else { return Ok(()) };
    let sweep = file.sweep()?;
    let part = merge(&files, &beside(output, ".part"), *force)?;
    finish(&outputs, output, &sweep, part, first)
}

/// Makes one shard of the data set of a sweep.
pub(super) fn run(arguments: &super::Arguments) -> Result<(), Stop> {
    let (Some(numbers), [sweep_file], Sample::Frames) = (arguments.shard, &arguments.sources[..], arguments.sample())
    else {
        let message = "is only for a sweep over time, expected one sweep's file (.toml) and no other --input";
        return Err(Error::new(ErrorKind::Usage, "--shard", message).into());
    };
    let config = arguments.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    let text = file_text(sweep_file)?;
    let sweep = Sweep::parse(&sweep_file.display().to_string(), &text)?;
    check(&sweep.script(0), &config).map_err(|error| Error::new(ErrorKind::Config, sweep_file.display(), error))?;
    let [shard, of] = numbers;
    if of > sweep.count() {
        let message = format_args!("is {shard}/{of}, expected at most {} shards, one per slide", sweep.count());
        return Err(Error::new(ErrorKind::Usage, "--shard", message).into());
    }
    let (shard, output) = (Shard::new(numbers, &sweep, text, &config), arguments.output());
    // A worker that was taken for dead may have made it meanwhile.
    if !arguments.force && is_there(&shard, arguments) {
        note(format_args!("{}: shard {}/{} is already there", output.display(), shard.number, shard.of));
        return Ok(());
    }
    let outputs = outputs(arguments);
    outputs.check([output])?;
    finishing(Ending::InTime);
    let signal = number();
    let slides: Vec<u32> = shard.slides().collect();
    let count = slides.len() as u32;
    let mut outcomes = Vec::with_capacity(slides.len());
    let mut progress = Progress::new("slides", 0, count);
    pool(arguments.threads)?.install(|| {
        each_sample(
            &slides,
            |number| sweep.script(number),
            &config,
            |number, outcome| {
                outcomes.push((number, outcome));
                progress.say(outcomes.len() as u32);
                match signal.load(Ordering::Relaxed) {
                    0 => Ok(()),
                    signal => Err(Stop::Interrupted(signal as u8)),
                }
            },
        )
    })?;
    drop(progress);
    outcomes.sort_unstable_by_key(|(number, _)| *number);
    match write_all(&outputs, output, |file| shard.write(file, &outcomes)) {
        Err(error) if error.is_already_exists() && is_there(&shard, arguments) => {}
        written => written?,
    }
    let (path, count) = (output.display(), counted(slides.len(), "slide"));
    note(format_args!("{path}: shard {}/{}, {count}", shard.number, shard.of));
    Ok(())
}

/// Returns whether the output is this very shard, and whole.
fn is_there(shard: &Shard, arguments: &super::Arguments) -> bool {
    let there = ShardFile::open(arguments.output());
    there.is_ok_and(|there| there.shard == *shard && there.check().is_ok())
}

/// Reads the number of a shard and the number of all shards.
pub(super) fn numbers(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('/').and_then(|(shard, of)| Some([shard.parse().ok()?, of.parse().ok()?]));
    let good = parsed.filter(|[shard, of]: &[u32; 2]| (1..=*of).contains(shard));
    good.ok_or_else(|| format!("{text:?} is no shard, expected K/N: 1/8 to 8/8 for eight"))
}
