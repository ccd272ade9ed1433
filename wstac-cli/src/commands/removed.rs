//! The commands and options that `wstac` does not have, or no longer, and what to use instead.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// A command line that was removed, up to the command or option that is gone, and what to use instead.
///
/// The table "From 0.3" of CHANGELOG.md has the same rows, which a test asks `wstac` for.
const REMOVED: &[(&str, &str)] = &[
    (
        "wstac fit-speed",
        "wstac.fit_speed(data) in Python fits the published speed law, with a figure and a [speed] table",
    ),
    ("wstac view --fast", "wstac run FILE reads as fast as possible"),
    ("wstac view --record", "wstac record writes recordings, as does wstac serve --record-to FOLDER while you watch"),
    ("wstac view --loop", "wstac serve --loop FILE plays a file or a scene again and again on a page"),
    ("wstac dataset --shard", DATASET),
    ("wstac dataset merge", DATASET),
    ("wstac trade --shard", TRADE),
    ("wstac trade --merge", TRADE),
    ("wstac trade --fade", FADE),
    ("wstac trade --light", FADE),
    ("wstac trade --times", TIMES),
    ("wstac trade --no-times", TIMES),
];
const DATASET: &str = "wstac dataset --units A..B makes a part, and wstac train and numpy.concatenate take all parts \
    (docs/MANY.md)";
const FADE: &str = "scenes with another flash_ms in [light] are brighter or darker (wstac scene --help)";
const TIMES: &str = "the map has no times of machines, and ci/bench measures them";
const TRADE: &str =
    "wstac trade --units A..B runs a part, and the rows of map.csv of all parts are the map (docs/MANY.md)";

/// An option of other programs, and what to use instead.
const OTHERS: &[(&str, &str)] = &[
    ("wstac serve --port", "--listen takes a port, as in --listen 8080"),
    ("wstac serve --host", "--listen takes an address and a port, as in --listen 0.0.0.0:8025"),
    ("wstac run --csv", "-o FILE.csv writes a table"),
    ("wstac -q", QUIET),
    ("wstac --quiet", QUIET),
];
const QUIET: &str = "wstac run has -q; 2>/dev/null hides the notes of other commands, and their errors";

/// Returns what to use instead of a removed command or option, if that is what clap does not know.
///
/// `given` are the arguments of the command line after the program's name.
pub(super) fn answer(unknown: &clap::Error, given: &[String]) -> Option<clap::Error> {
    let Some(ContextValue::String(name)) =
        [ContextKind::InvalidSubcommand, ContextKind::InvalidValue, ContextKind::InvalidArg]
            .into_iter()
            .find_map(|kind| unknown.get(kind))
    else {
        return None;
    };
    let is_asked = |line: &str| {
        let words: Vec<_> = line.split(' ').skip(1).collect();
        words.split_last().is_some_and(|(last, before)| {
            last == name && given.len() > before.len() && given.iter().zip(before).all(|(given, word)| given == word)
        })
    };
    let of = |all: &'static [(&str, &str)]| all.iter().find(|(line, _)| is_asked(line));
    let removed = of(REMOVED).map(|(line, instead)| words(line, instead));
    let message = removed.or_else(|| of(OTHERS).map(|(_, instead)| format!("{name}: no such option; help: {instead}")));
    Some(super::wrong_arguments(ErrorKind::UnknownArgument, message?))
}

/// Returns what to use instead of something that was removed.
pub(crate) fn words(what: &str, instead: &str) -> String {
    format!("{what}: was removed; help: {instead}")
}
