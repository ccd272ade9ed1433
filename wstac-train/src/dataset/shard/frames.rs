//! Shards of a sweep over time: the records of an unfinished data set.

use std::path::Path;

use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};

use crate::dataset::Outcome;
use crate::dataset::part::{Part, fingerprint, record};
use crate::dataset::sweep::Sweep;
use crate::shard::{ShardKind, ShardSet, WholeSet};

/// Describes the set of a sweep, whose file has this text.
pub fn set(sweep: &Sweep, text: String, config: &Config) -> ShardSet {
    let digest = format!("{:016x}", fingerprint(sweep, config));
    ShardSet { kind: ShardKind::Frames, items: sweep.count(), digest, plan: text }
}

/// Returns what a shard stores of a slide.
pub fn content(number: u32, outcome: &Outcome) -> Vec<u8> {
    record(number, outcome).into()
}

/// Returns the sweep of a set.
///
/// # Errors
/// Its plan is no such sweep.
pub fn sweep(set: &WholeSet) -> Result<Sweep, Error> {
    let (file, items) = (set.first(), set.set().items);
    let sweep = Sweep::parse(&file.path().display().to_string(), &set.set().plan)?;
    if sweep.count() != items {
        return Err(file.wrong_plan(&format_args!("has a sweep of {} slides, expected {items}", sweep.count())));
    }
    Ok(sweep)
}

/// Merges a set into an unfinished data set, which is then complete. [`Part::open`] says what `anew` does.
///
/// # Errors
/// A shard or the part cannot be used.
pub fn merge(set: &WholeSet, path: &Path, anew: bool) -> Result<Part, Error> {
    let digest = u64::from_str_radix(&set.set().digest, 16)
        .map_err(|error| Error::with_cause(ErrorKind::Format, set.first().path().display(), error))?;
    let mut part = Part::open(path, digest, set.set().items, anew)?;
    for file in set.files() {
        file.each(|number, content| {
            let record = content.try_into().map_err(|_| file.damaged(number))?;
            part.append_record(record)
        })?;
    }
    Ok(part)
}
