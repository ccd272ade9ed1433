//! A recording's file while it is written. It is an MCAP file whose messages go to the disk as soon as they are
//! complete.
//!
//! Messages are stored uncompressed unless the user wants it otherwise, in chunks of about 1 s or 4 MiB. The written
//! part of an unfinished chunk can be read message by message. So a program that is killed loses nothing that it has
//! written ([`super::recover`]). Every moment and the description have checksums ([`super::sums`]), and the numbers of
//! channels are fixed, so that damage of one part leaves the others readable.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use std::rc::Rc;

use mcap::records::{Channel, MessageHeader};
use mcap::write::Metadata;
use mcap::{McapError, McapResult, WriteOptions, Writer};

use super::about::{self, MOST_SENSORS};
use super::compression::Compression;
use super::foxglove::{Schema, SchemaFacts};
use super::reserved::Reserved;
use super::sums::{self, MomentSum, Tally};
use crate::error::{Error, ErrorKind};

/// Bytes after which a chunk ends.
const CHUNK_BYTES: u64 = 4 << 20;
/// Nanoseconds after which a chunk ends.
const CHUNK_TIME: u64 = 1_000_000_000;
/// Bytes before which time ends no chunk, and messages after which a chunk ends. They bound the memory of the index.
const LEAST_CHUNK_BYTES: u64 = 16 << 10;
const MOST_CHUNK_MESSAGES: u64 = 1 << 16;
/// Bytes of a checksum's message with its header, and those that it has for each of several sensors.
const SUM_BYTES: u64 = 256;
const SUM_SHARE: u64 = 64;
/// The first number of a channel that is not this program's own.
const FIRST_FOREIGN: u16 = 256;
/// Most bytes of the end of every file; then a chunk's share of it, and a message's bytes besides its data.
const END_BYTES: u64 = 32 << 10;
const CHUNK_SHARE: u64 = 512;
const MESSAGE_SHARE: u64 = 64;

/// A channel of a recording: its topic and its schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Topic {
    /// Frames as they are summed.
    Raw,
    /// Frames as the camera sent them: JPEG.
    Jpeg,
    /// The 25 taxels.
    Taxels,
    Features,
    /// Events, for a person and as JSON.
    Events,
    EventsJson,
    /// Lost frames and what happened to the source, for a person and as JSON.
    Faults,
    FaultsJson,
    /// Checksums of moments.
    Sums,
    /// The 25 taxel sums of frames whose pictures are not stored.
    TaxelSums,
    /// Wall-clock times of frames.
    Clock,
}

/// The numbers that each sensor's channels have. They stay for ever, so that damaged records of channels lose nothing.
const CHANNELS: u16 = 12;

const _: () = assert!(MOST_SENSORS * (CHANNELS as usize) < FIRST_FOREIGN as usize);

/// The sensors of a recording, and the channels that they have.
#[derive(Clone, Debug, Default)]
pub(super) struct Sensors(Vec<String>);

impl Sensors {
    pub(super) fn of(description: &[Metadata]) -> Self {
        // A record of names that cannot be read is reported by whoever reads frames.
        Self(about::sensors(description).unwrap_or_default())
    }

    pub(super) fn count(&self) -> usize {
        self.0.len().max(1)
    }

    /// Returns the names of the sensors; none if there is a single one without a name.
    pub(super) fn names(&self) -> &[String] {
        &self.0
    }

    /// Returns the name of the first sensor; `None` if there is a single one without a name.
    pub(super) fn first(&self) -> Option<&str> {
        self.0.first().map(String::as_str)
    }

    pub(super) fn places(&self) -> std::ops::Range<u8> {
        0..self.count() as u8
    }

    pub(super) fn channels(&self) -> std::ops::RangeInclusive<u16> {
        1..=CHANNELS * self.count() as u16
    }

    /// Returns the sensor and the topic whose channel has this number.
    pub(super) fn topic(&self, channel: u16) -> Option<(u8, Topic)> {
        let place = channel.checked_sub(1).filter(|_| self.channels().contains(&channel))?;
        let (topic, ..) = Topic::ALL.get(usize::from(place % CHANNELS))?;
        Some(((place / CHANNELS) as u8, *topic))
    }

    /// Returns the topic that a name and its schema end like, with its sensor and the start of the name before both.
    pub(super) fn find<'n>(&self, name: &'n str, schema: &str) -> Option<(&'n str, u8, Topic)> {
        Topic::ALL.into_iter().find_map(|(topic, own, of_own)| {
            let start = name.strip_suffix(own).filter(|_| of_own.facts().name == schema)?;
            if self.0.is_empty() || topic == Topic::Sums {
                return Some((start, 0, topic));
            }
            let (start, sensor) = start.rsplit_once('/')?;
            let place = self.0.iter().position(|known| known == sensor)?;
            Some((start, u8::try_from(place).ok()?, topic))
        })
    }

    /// Returns the name of a topic: that of one of several sensors starts with the sensor's name.
    fn name(&self, sensor: u8, topic: Topic) -> String {
        let (name, _) = topic.name_and_schema();
        match self.0.get(usize::from(sensor)) {
            // Checksums are those of the file.
            Some(sensor) if topic != Topic::Sums => format!("/{sensor}{name}"),
            _ => name.to_owned(),
        }
    }
}

impl Topic {
    /// All topics in the order of their numbers, with their names and schemas.
    const ALL: [(Self, &str, Schema); 11] = [
        (Self::Raw, super::CAMERA, Schema::RawImage),
        (Self::Jpeg, super::CAMERA, Schema::CompressedImage),
        (Self::Taxels, "/taxels", Schema::RawImage),
        (Self::Features, "/features", Schema::Float64MultiArray),
        (Self::Events, "/events", Schema::Log),
        (Self::EventsJson, super::EVENTS, Schema::Record),
        (Self::Faults, "/faults", Schema::Log),
        (Self::FaultsJson, super::FAULTS, Schema::Record),
        (Self::Sums, sums::SUMS, Schema::Record),
        (Self::TaxelSums, super::TAXEL_SUMS, Schema::UInt32MultiArray),
        (Self::Clock, super::CLOCK, Schema::Record),
    ];

    /// Returns the number of a sensor's channel in every recording that has checksums. Those are of no sensor.
    pub(super) fn number(self, sensor: u8) -> u16 {
        let sensor = if self == Self::Sums { 0 } else { u16::from(sensor) };
        self as u16 + 1 + sensor * CHANNELS
    }

    /// Returns whether its messages are frames, with or without pictures.
    pub(super) fn is_frame(self) -> bool {
        matches!(self, Self::Raw | Self::Jpeg | Self::TaxelSums)
    }

    pub(super) fn name_and_schema(self) -> (&'static str, Schema) {
        let (_, name, schema) = Self::ALL[self as usize];
        (name, schema)
    }
}

/// A message to be written.
#[derive(Debug)]
pub(super) struct Message {
    /// The place of its sensor among those of the recording.
    pub(super) sensor: u8,
    pub(super) topic: Topic,
    /// The time on the recording's time line, in nanoseconds. That of a frame is never less than that of the frame
    /// before, and that of a record is the time of the frame that it is about.
    pub(super) time: u64,
    /// The driver's own time stamp of the frame, in nanoseconds; for other messages the same as `time`.
    pub(super) taken: u64,
    /// The driver's own counter, or a number of the recording's.
    pub(super) sequence: u32,
    pub(super) data: Vec<u8>,
}

/// The buffered file, shared with the writer that formats it, so that it can be flushed without ending a chunk.
#[derive(Clone, Debug)]
struct SharedFile(Rc<RefCell<BufWriter<Reserved>>>);

impl Write for SharedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.borrow_mut().flush()
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.0.borrow_mut().seek(position)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.0.borrow_mut().stream_position()
    }
}

/// Adds a compression, which this build has.
#[cfg(feature = "compression")]
fn compressed(options: WriteOptions, compression: Compression) -> WriteOptions {
    // So the bytes are the same on every machine, whatever processors it has.
    let options = options.compression_threads(0);
    options.compression(match compression {
        Compression::None => None,
        Compression::Zstd => Some(mcap::Compression::Zstd),
        Compression::Lz4 => Some(mcap::Compression::Lz4),
    })
}

#[cfg(not(feature = "compression"))]
fn compressed(options: WriteOptions, _: Compression) -> WriteOptions {
    options
}

/// An MCAP file that is being written.
pub(super) struct RecordingFile {
    writer: Writer<SharedFile>,
    shared: SharedFile,
    sensors: Sensors,
    /// Numbers of channels that are described in the file.
    channels: BTreeSet<u16>,
    /// The number of the next channel that is not this program's own.
    next_foreign: u16,
    chunk_start: Option<u64>,
    /// Bytes and messages of the chunk that is open, and the number of chunks so far.
    chunk: (u64, u64),
    chunks: u64,
    /// Whether the chunk that is open waits in memory for its compression.
    is_packed: bool,
    /// Whether it is a recording of this program, which has checksums.
    is_own: bool,
    /// The checksum of the moment that is being written, and its last time.
    moment: MomentSum,
    moment_time: Option<u64>,
    pub(super) tally: Tally,
}

impl RecordingFile {
    /// Starts a recording in a file that is empty. Without a description it is a file of another program.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn new(file: File, description: &[Metadata], compression: Compression) -> McapResult<Self> {
        let shared = SharedFile(Rc::new(RefCell::new(BufWriter::new(Reserved::new(file)))));
        let library = concat!("wstac ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).chunk_size(None).library(library);
        let mut writer = compressed(options, compression).create(shared.clone())?;
        let is_own = !description.is_empty();
        if is_own {
            // A description that is damaged in one place is still there once.
            for _ in 0..2 {
                for metadata in description {
                    writer.write_metadata(metadata)?;
                }
                writer.write_metadata(&sums::of_description(description))?;
            }
        }
        let sensors = Sensors::of(description);
        let mut file = Self {
            writer,
            shared,
            tally: Tally::new(sensors.count()),
            sensors,
            channels: BTreeSet::new(),
            next_foreign: FIRST_FOREIGN,
            chunk_start: None,
            chunk: (0, 0),
            chunks: 0,
            is_packed: compression != Compression::None,
            is_own,
            moment: MomentSum::default(),
            moment_time: None,
        };
        file.flush()?;
        Ok(file)
    }

    /// Returns whether there is room for these messages, and to finish the file after them.
    ///
    /// # Errors
    /// The file cannot be used.
    pub(super) fn has_room(&mut self, messages: &[Message]) -> McapResult<bool> {
        if self.make_room(messages)? {
            return Ok(true);
        }
        if !self.is_packed || self.chunk.1 == 0 {
            return Ok(false);
        }
        // Nobody knows how small the chunk that is open becomes until it is compressed.
        self.end_chunk()?;
        self.flush()?;
        Ok(self.make_room(messages)?)
    }

    fn make_room(&self, messages: &[Message]) -> io::Result<bool> {
        let bytes: u64 = messages.iter().map(|message| message.data.len() as u64 + MESSAGE_SHARE).sum();
        // Channels stand before their first message.
        let mut topics: Vec<_> = messages.iter().map(|message| (message.sensor, message.topic)).collect();
        topics.push((0, Topic::Sums));
        topics.sort_unstable();
        topics.dedup();
        let new = topics.into_iter().filter(|(sensor, topic)| !self.channels.contains(&topic.number(*sensor)));
        let new: u64 = new.map(|(_, topic)| topic.name_and_schema().1.facts().data.len() as u64 + CHUNK_SHARE).sum();
        let sensors = self.sensors.count() as u64;
        let end = sensors * (END_BYTES + CHUNK_SHARE * (self.chunks + 1)) + MESSAGE_SHARE * self.chunk.1;
        let mut file = self.shared.0.borrow_mut();
        let waiting = file.buffer().len() as u64 + if self.is_packed { self.chunk.0 } else { 0 };
        file.get_mut().make_room(bytes + new + SUM_BYTES + SUM_SHARE * sensors + end + waiting)
    }

    /// Writes the messages of one moment.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&mut self, messages: &[Message]) -> McapResult<()> {
        // A moment's messages stand one behind the other, so its channels come first.
        for message in messages {
            self.add_own(message.sensor, message.topic)?;
        }
        for Message { sensor, topic, time, taken, sequence, data } in messages {
            let (sequence, log_time, publish_time) = (*sequence, *time, *taken);
            let header = MessageHeader { channel_id: topic.number(*sensor), sequence, log_time, publish_time };
            self.write_message(Some((*sensor, *topic)), &header, data)?;
        }
        self.end_moment()
    }

    /// Writes a message of the moment that is open, of this sensor and topic if it is one of this program. All its
    /// channels must be there before its first message.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn write_message(
        &mut self,
        own: Option<(u8, Topic)>,
        header: &MessageHeader,
        data: &[u8],
    ) -> McapResult<()> {
        if let Some((sensor, topic)) = own {
            self.tally.add(sensor, topic, data);
        }
        self.chunk_start.get_or_insert(header.log_time);
        // An event is about an earlier frame.
        self.moment_time = self.moment_time.max(Some(header.log_time));
        self.moment.add(header, data);
        self.append(header, data)
    }

    fn append(&mut self, header: &MessageHeader, data: &[u8]) -> McapResult<()> {
        self.chunk.0 += data.len() as u64;
        self.chunk.1 += 1;
        self.writer.write_to_known_channel(header, data)
    }

    /// Ends a moment with its checksum, and the chunk if it is long enough.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn end_moment(&mut self) -> McapResult<()> {
        let moment = std::mem::take(&mut self.moment);
        let Some(time) = self.moment_time.take() else { return Ok(()) };
        if self.is_own {
            let (sequence, log_time, publish_time) = (self.tally.all.frames as u32, time, time);
            let header = MessageHeader { channel_id: Topic::Sums.number(0), sequence, log_time, publish_time };
            let data = moment.end(&header, &self.tally);
            self.append(&header, &data)?;
        }
        let lasted = time.saturating_sub(self.chunk_start.unwrap_or(time));
        let (bytes, messages) = self.chunk;
        let is_long = bytes >= LEAST_CHUNK_BYTES && lasted >= CHUNK_TIME;
        if bytes >= CHUNK_BYTES || is_long || messages >= MOST_CHUNK_MESSAGES {
            self.end_chunk()?;
        }
        Ok(())
    }

    fn end_chunk(&mut self) -> McapResult<()> {
        (self.chunk_start, self.chunk) = (None, (0, 0));
        self.chunks += 1;
        self.writer.flush()
    }

    /// Adds a channel of this program's own.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn add_own(&mut self, sensor: u8, topic: Topic) -> McapResult<u16> {
        let number = topic.number(sensor);
        if !self.channels.contains(&number) {
            // The first checksum comes after the first moment, whose messages must not be parted.
            if topic != Topic::Sums {
                self.add_own(0, Topic::Sums)?;
            }
            let (name, (_, schema)) = (self.sensors.name(sensor, topic), topic.name_and_schema());
            let SchemaFacts { name: of_schema, encodings: [schema_encoding, encoding], data } = schema.facts();
            let id = self.writer.add_schema_with_id(schema.number(), of_schema, schema_encoding, data)?;
            self.writer.add_channel_with_id(number, id, &name, encoding, &BTreeMap::new())?;
            self.channels.insert(number);
        }
        Ok(number)
    }

    /// Adds a channel like another file's, with its schema if it has one, and returns its number here.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn add_foreign(&mut self, channel: &Channel, schema: Option<&mcap::Schema<'_>>) -> McapResult<u16> {
        if self.is_own {
            self.add_own(0, Topic::Sums)?;
        }
        let number = self.next_foreign;
        self.next_foreign = number.checked_add(1).ok_or(McapError::TooManyChannels)?;
        let schema = match schema {
            // Each channel has its schema under its own number.
            Some(mcap::Schema { name, encoding, data, .. }) => {
                self.writer.add_schema_with_id(number, name, encoding, data)?
            }
            None => 0,
        };
        let Channel { topic, message_encoding, metadata, .. } = channel;
        self.writer.add_channel_with_id(number, schema, topic, message_encoding, metadata)
    }

    /// Writes a record of metadata that is no part of the description.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn write_metadata(&mut self, metadata: &Metadata) -> McapResult<()> {
        (self.chunk_start, self.chunk) = (None, (0, 0));
        self.writer.write_metadata(metadata)
    }

    /// Hands everything that was written to the system, which keeps it even if this program is killed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.shared.flush()
    }

    /// Ends the file with its index, and returns its size in bytes.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn finish(mut self) -> McapResult<u64> {
        if self.is_own {
            self.writer.write_metadata(&sums::end_record(&self.tally))?;
        }
        self.writer.finish()?;
        drop(self.writer);
        self.shared.flush()?;
        let Some(shared) = Rc::into_inner(self.shared.0) else { return Ok(0) };
        let file = shared.into_inner().into_inner().map_err(io::IntoInnerError::into_error)?;
        let bytes = file.end;
        file.close()?;
        Ok(bytes)
    }
}

/// Describes an error of writing a file. `rest` says what that means.
pub(super) fn write_error(path: &Path, error: McapError, rest: impl Display) -> Error {
    let of = |kind, error: &dyn Display| Error::new(kind, path.display(), format_args!("{error}{rest}"));
    match error {
        McapError::Io(error) => of(error.kind().into(), &error).caused_by(error),
        error => of(ErrorKind::Io, &error).caused_by(error),
    }
}
