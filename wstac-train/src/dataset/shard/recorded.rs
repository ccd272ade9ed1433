//! Shards of recordings: their descriptions, events and samples. A merge needs no recording.

use std::fmt::Write;

use serde::{Deserialize, Serialize};
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::record::about::About;

use super::{bytes_of, numbers_of};
use crate::dataset::recordings::{Recording, RecordingPart};
use crate::dataset::{Facts, Sample};
use crate::shard::{ShardKind, ShardSet, WholeSet, digest};

/// What the merge needs.
#[derive(Serialize, Deserialize)]
struct Plan {
    input: String,
    /// Fraction of the recordings that is for tests. JSON would not keep every digit of a number.
    test: String,
    /// The configuration's file that replaces those of the recordings.
    config: Option<String>,
    recordings: Vec<RecordingPart>,
}

/// The inputs by their names.
const ALL_INPUTS: [Input; 3] = [Input::Frames, Input::Path, Input::TaxelPath];

/// Describes the set of these recordings, as [`parts`](crate::dataset::recordings::parts) found them.
///
/// `config` is the text of a configuration's file for all of them, and `test` the fraction that is for tests. The set
/// depends on the names and sizes of the files.
///
/// # Errors
/// A file is not there, or its name is not UTF-8.
pub fn set(parts: &[RecordingPart], config: Option<&str>, input: Input, test: f64) -> Result<ShardSet, Error> {
    let mut about = format!("{} {test} {config:?}", input.name());
    for RecordingPart { file, sensor } in parts {
        let bytes = file.metadata().map_err(|error| Error::io(file.display(), error))?.len();
        let name = file.to_str().ok_or_else(|| {
            Error::new(
                ErrorKind::Usage,
                file.display(),
                "has a name that is not UTF-8, expected one that a shard can hold",
            )
        })?;
        // Writing to a string does not fail.
        let _ = write!(about, " {name:?} {bytes} {sensor:?}");
    }
    let items =
        u32::try_from(parts.len()).map_err(|error| Error::with_cause(ErrorKind::Config, "recordings", error))?;
    let plan = Plan {
        input: input.name().into(),
        test: test.to_string(),
        config: config.map(str::to_owned),
        recordings: parts.to_vec(),
    };
    let plan =
        serde_json::to_string(&plan).map_err(|error| Error::with_cause(ErrorKind::Config, "recordings", error))?;
    Ok(ShardSet { kind: ShardKind::Recordings, items, digest: format!("{:016x}", digest(&about)), plan })
}

/// What is stored of a recording before its samples.
#[derive(Serialize, Deserialize)]
struct Head {
    /// Its description, as JSON.
    about: String,
    incomplete: u64,
    events: Vec<RecordedEvent>,
}

/// What is stored of an event; samples follow the head.
#[derive(Serialize, Deserialize)]
struct RecordedEvent {
    frame: u64,
    reliable: bool,
    duration: Option<u8>,
    /// Whether a sample along the path follows that over time.
    path: bool,
}

/// Returns what a shard stores of a recording: the length of a head, the head as JSON, and the samples.
///
/// # Errors
/// This does not fail: every recording can be written as JSON.
pub fn content(recording: &Recording, input: Input) -> Result<Vec<u8>, Error> {
    let wrong = |error| Error::with_cause(ErrorKind::Format, &recording.name, error);
    let paths = recording.path_samples(input);
    let events = recording.samples.iter().zip(&paths).map(|((frame, _, facts), path)| RecordedEvent {
        frame: *frame,
        reliable: facts.reliable,
        duration: facts.duration,
        path: path.is_some(),
    });
    let about = recording.about().to_json().map_err(wrong)?;
    let head = Head { about, incomplete: recording.incomplete, events: events.collect() };
    let head = serde_json::to_vec(&head).map_err(wrong)?;
    let mut content = Vec::from((head.len() as u32).to_le_bytes());
    content.extend(head);
    for ((_, sample, _), path) in recording.samples.iter().zip(paths) {
        content.extend(bytes_of(sample.as_flattened()));
        content.extend(path.into_iter().flat_map(|path| bytes_of(path)));
    }
    Ok(content)
}

/// The recordings of a set.
#[derive(Debug)]
pub struct RecordedSet {
    /// What the samples are of.
    pub input: Input,
    /// Fraction of the recordings that is for tests.
    pub test: f64,
    /// All recordings, in order, without their [`paths`](Recording::paths).
    pub recordings: Vec<Recording>,
    /// The samples along the paths of all their events; `None` for an event without one.
    pub paths: Vec<Option<Box<[i16; INPUTS]>>>,
}

/// Reads all recordings of a set.
///
/// # Errors
/// A shard cannot be used.
pub fn read(set: &WholeSet) -> Result<RecordedSet, Error> {
    let first = set.first();
    let plan: Plan = serde_json::from_str(&set.set().plan).map_err(|error| first.wrong_plan(&error))?;
    let input = ALL_INPUTS.into_iter().find(|input| input.name() == plan.input);
    let input = input.ok_or_else(|| first.wrong_plan(&format_args!("input is {:?}", plan.input)))?;
    if plan.recordings.len() != set.set().items as usize {
        let (found, expected) = (plan.recordings.len(), set.set().items);
        return Err(first.wrong_plan(&format_args!("has {found} recordings, expected {expected}")));
    }
    let config = plan.config.as_deref().map(Config::parse).transpose()?;
    let each = set.items(|number, content| {
        let part = plan.recordings.get(number as usize)?;
        recording(part, content, config.as_ref())
    })?;
    let (recordings, paths): (Vec<_>, Vec<_>) = each.into_iter().unzip();
    let test = plan.test.parse().map_err(|error| first.wrong_plan(&error))?;
    Ok(RecordedSet { input, test, recordings, paths: paths.into_iter().flatten().collect() })
}

/// Samples along the path, one for each event.
type Paths = Vec<Option<Box<[i16; INPUTS]>>>;

/// Reads a recording and the samples along the paths of its events.
fn recording(part: &RecordingPart, content: &[u8], config: Option<&Config>) -> Option<(Recording, Paths)> {
    let (length, rest) = content.split_first_chunk()?;
    let (head, mut rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let head: Head = serde_json::from_slice(head).ok()?;
    let about = About::from_json(&head.about).ok()?;
    let mut recording = Recording::labeled(part, &about, config.cloned()).ok()?;
    recording.incomplete = head.incomplete;
    let mut paths = Vec::with_capacity(head.events.len());
    for RecordedEvent { frame, reliable, duration, path } in head.events {
        let mut sample: Box<Sample> = Box::new([[0; SAMPLE_FRAMES]; FEATURES]);
        sample.as_flattened_mut().copy_from_slice(&numbers_of(&mut rest)?[..]);
        recording.samples.push((frame, sample, Facts { reliable, duration }));
        paths.push(if path { Some(numbers_of(&mut rest)?) } else { None });
    }
    rest.is_empty().then_some((recording, paths))
}
