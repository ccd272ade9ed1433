//! Recovers every completely written message of a recording that was cut off or is damaged.
//!
//! If a chunk's bytes are not those that were written, it is unknown which message is wrong. Its frames are entered as
//! lost, with those that were lost before, so that those behind keep their place.
//!
//! The choice of messages, and of their new form, is this project's policy. No MCAP library has it.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use mcap::records::{Channel, MessageHeader, Record, op};
use mcap::write::Metadata;
use mcap::{McapError, Schema};

use super::file::{Message, RecordingFile, Topic};
use super::parse::parse_record;
use super::scan::{MessageBody, Scan, Step, Unread, index};
use super::{CAMERA, EVENTS, FAULTS};
use crate::error::{Error, ErrorKind};

/// The result of a recovery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recovered {
    /// Frames.
    pub frames: u64,
    /// Events that were found when it was recorded.
    pub events: u64,
    /// Frames that are damaged and entered as lost.
    pub damaged: u64,
    /// Whether the file was finished properly.
    pub whole: bool,
    /// Bytes of the new file.
    pub bytes: u64,
    /// The bytes that could not be read.
    pub unread: Option<Unread>,
    /// Messages of channels that only a damaged part describes. They may have a wrong name.
    pub doubtful: u64,
}

/// A file that is being recovered.
struct Recovery<'a> {
    out: RecordingFile,
    path: &'a Path,
    /// The schemas by their numbers, each with whether it stands in undamaged bytes.
    schemas: BTreeMap<u16, (Schema<'static>, bool)>,
    channels: BTreeMap<u16, (Channel, bool)>,
    /// Numbers of channels in the new file, by those in the old one.
    numbers: BTreeMap<u16, u16>,
    /// Time of the last message.
    time: u64,
    /// Damaged frames in a row that are not yet entered as lost.
    damaged: u64,
    found: Recovered,
}

/// Recovers everything that was completely written. `new` is an empty file at `path`.
///
/// # Errors
/// The old file is no MCAP file or cannot be read, or the new one cannot be written.
pub fn recover(old: &Path, new: File, path: &Path) -> Result<Recovered, Error> {
    let mut scan = Scan::open(old)?;
    let out = RecordingFile::new(new, &[]).map_err(|error| not_written(path, error))?;
    let (schemas, channels, numbers) = Default::default();
    let found = Recovered::default();
    let mut recovery = Recovery { out, path, schemas, channels, numbers, time: 0, damaged: 0, found };
    // The index comes first, because chunks have each channel only once.
    for (op, body) in index(old).map_err(|error| Error::io(old.display(), error))? {
        if [op::SCHEMA, op::CHANNEL].contains(&op) {
            recovery.record(op, &body, true).map_err(|error| not_written(path, error))?;
        }
    }
    loop {
        match scan.next().map_err(|error| Error::io(old.display(), error))? {
            Step::Record { op, sound } => {
                recovery.record(op, scan.body(), sound).map_err(|error| not_written(recovery.path, error))?;
            }
            Step::End { whole } => {
                recovery.found.whole = whole;
                recovery.found.unread = scan.unread();
                break;
            }
        }
    }
    recovery.finish()
}

/// Returns whether a new entry replaces the one there is. The first entry stays, unless it stands in damaged bytes.
fn is_better<T>(there: Option<&(T, bool)>, sound: bool) -> bool {
    there.is_none_or(|(_, was)| sound && !was)
}

/// Describes an error of writing the new file.
fn not_written(path: &Path, error: McapError) -> Error {
    let (path, hint) = (path.display(), "it was not written, and the recording is as it was");
    match error {
        McapError::Io(error) => Error::new(error.kind().into(), path, format_args!("{error}: {hint}")).caused_by(error),
        error => Error::new(ErrorKind::Io, path, format_args!("{error}: {hint}")).caused_by(error),
    }
}

impl Recovery<'_> {
    fn record(&mut self, op: u8, body: &[u8], sound: bool) -> Result<(), McapError> {
        match op {
            op::MESSAGE => return self.message(body, sound),
            op::SCHEMA | op::CHANNEL | op::METADATA => {}
            _ => return Ok(()),
        }
        // A record that cannot be read is damaged, and everything that needs it is left out.
        match parse_record(op, body) {
            Ok(Record::Schema { header, data }) => {
                let schema = Schema { id: header.id, name: header.name, encoding: header.encoding, data };
                let data = schema.data.into_owned().into();
                let schema = Schema { data, ..schema };
                if is_better(self.schemas.get(&schema.id), sound) {
                    // Channels of the old schema are written again.
                    self.numbers.retain(|id, _| self.channels.get(id).is_none_or(|(of, _)| of.schema_id != schema.id));
                    self.schemas.insert(schema.id, (schema, sound));
                }
            }
            Ok(Record::Channel(channel)) if is_better(self.channels.get(&channel.id), sound) => {
                self.numbers.remove(&channel.id);
                self.channels.insert(channel.id, (channel, sound));
            }
            Ok(Record::Metadata(metadata)) => self.metadata(&metadata)?,
            _ => {}
        }
        Ok(())
    }

    fn metadata(&mut self, metadata: &Metadata) -> Result<(), McapError> {
        self.out.write_metadata(metadata)
    }

    fn message(&mut self, body: &[u8], sound: bool) -> Result<(), McapError> {
        let Some(message) = MessageBody::parse(body) else { return Ok(()) };
        let Some((channel, known)) = self.channels.get(&message.channel) else { return Ok(()) };
        let is_frame = channel.topic == CAMERA;
        if !sound {
            let gap = if channel.topic == FAULTS { super::recorder::lost_frames(message.data) } else { 0 };
            self.damaged = self.damaged.saturating_add(u64::from(is_frame)).saturating_add(gap);
            return Ok(());
        }
        let number = if let Some(&number) = self.numbers.get(&message.channel) {
            number
        } else {
            let number =
                self.out.add_channel(channel, self.schemas.get(&channel.schema_id).map(|(schema, _)| schema))?;
            self.numbers.insert(message.channel, number);
            number
        };
        let is_certain = *known && self.schemas.get(&channel.schema_id).is_none_or(|(_, sound)| *sound);
        self.found.doubtful += u64::from(!is_certain);
        self.found.frames += u64::from(is_frame);
        self.found.events += u64::from(channel.topic == EVENTS && message.data.starts_with(br#"{"kind":"event""#));
        self.enter_damaged()?;
        let [log_time, publish_time] = message.times;
        self.time = log_time;
        let header = MessageHeader { channel_id: number, sequence: message.sequence, log_time, publish_time };
        self.out.write_copy(&header, message.data)
    }

    /// Enters frames that are damaged as lost.
    fn enter_damaged(&mut self) -> Result<(), McapError> {
        let frames = std::mem::take(&mut self.damaged);
        if frames == 0 {
            return Ok(());
        }
        self.found.damaged = self.found.damaged.saturating_add(frames);
        let data = format!(r#"{{"kind":"lost","frames":{frames},"why":"damaged in the recording"}}"#).into_bytes();
        let (time, taken) = (self.time, self.time);
        self.out.write(&Message { topic: Topic::FaultsJson, time, taken, sequence: 0, data })
    }

    fn finish(mut self) -> Result<Recovered, Error> {
        let ended = self.enter_damaged().and_then(|()| self.out.finish());
        self.found.bytes = ended.map_err(|error| not_written(self.path, error))?;
        Ok(self.found)
    }
}
/// Checks that a file can be read as a recording, whole or damaged.
///
/// # Errors
/// The file cannot be opened or does not start as an MCAP file does.
pub fn check_readable(path: &Path) -> Result<(), Error> {
    Scan::open(path).map(drop)
}
