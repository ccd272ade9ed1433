//! `--units A..B`: some of the numbered units of a set. Parts of a set, put together in order, are the whole set.

use std::ops::Range;

use super::output::note;
use wstac_host::error::{Error, ErrorKind};

/// Parses a half-open range of numbers.
pub(super) fn range(text: &str) -> Result<Range<u32>, String> {
    let range = text.split_once("..").and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
    let range = range.filter(|range: &Range<u32>| !range.is_empty());
    range.ok_or_else(|| format!("found {text:?}, expected A..B with A below B: 0..100 for the first hundred units"))
}

/// Returns the units to make, by default all, and prints how many units of this kind the whole set has.
pub(super) fn chosen(units: Option<&Range<u32>>, count: usize, kind: &str) -> Result<Range<u32>, Error> {
    let count = u32::try_from(count).map_err(|error| Error::with_cause(ErrorKind::Config, kind, error))?;
    let Some(units) = units else { return Ok(0..count) };
    let Range { start, end } = *units;
    if end > count {
        let message =
            format_args!("is outside of the set (found {start}..{end}, expected at most 0..{count}: {count} {kind})");
        return Err(Error::new(ErrorKind::Usage, "--units", message));
    }
    note(format_args!("units {start}..{end} of {count} {kind}"));
    Ok(start..end)
}
