//! What `--shard` is for every command: one of several processes makes its items, and leaves a whole file or none.

use std::path::Path;

use super::files::Outputs;
use super::output::{Stop, note};
use wstac_host::error::Error;
use wstac_host::plural::counted;
use wstac_train::shard::{Shard, ShardFile};

/// Makes a shard with `make`, which returns the content of each of these items, in order.
///
/// A shard that is already there, and whole, stays: a worker that was taken for dead may have made it meanwhile.
pub(super) fn make_shard(
    shard: &Shard,
    output: &Path,
    outputs: &Outputs,
    force: bool,
    make: impl FnOnce(&[u32]) -> Result<Vec<(u32, Vec<u8>)>, Stop>,
) -> Result<(), Stop> {
    let (path, name) = (output.display(), format!("shard {}/{}", shard.number, shard.of));
    if !force && is_there(shard, output) {
        note(format_args!("{path}: {name} is already there"));
        return Ok(());
    }
    outputs.check([output])?;
    let items: Vec<u32> = shard.items().collect();
    let contents = make(&items)?;
    match write(shard, output, outputs, &contents) {
        Err(error) if error.is_already_exists() && is_there(shard, output) => {}
        written => written?,
    }
    note(format_args!("{path}: {name}, {}", counted(items.len(), "item")));
    Ok(())
}

fn write(shard: &Shard, output: &Path, outputs: &Outputs, contents: &[(u32, Vec<u8>)]) -> Result<(), Error> {
    let mut new = outputs.create(output)?;
    shard.write(&mut new.file, contents).map_err(|error| Error::io(output.display(), error))?;
    new.commit()
}

/// Returns whether the output is this very shard, and whole.
fn is_there(shard: &Shard, output: &Path) -> bool {
    ShardFile::open(output).is_ok_and(|there| there.shard.is(shard) && there.check().is_ok())
}

/// Reads the number of a shard and the number of all shards.
pub(super) fn numbers(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('/').and_then(|(shard, of)| Some([shard.parse().ok()?, of.parse().ok()?]));
    let good = parsed.filter(|[shard, of]: &[u32; 2]| (1..=*of).contains(shard));
    good.ok_or_else(|| format!("{text:?} is no shard, expected K/N: 1/8 to 8/8 for eight"))
}
