//! A recording's file while it is written. It is an MCAP file whose messages go to the disk as soon as they are
//! complete.
//!
//! Messages are stored uncompressed, in chunks of about 1 s or 4 MiB. The written part of an unfinished chunk can be
//! read message by message. So a program that is killed loses nothing that it has written ([`super::recover`]).

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use std::rc::Rc;

use mcap::records::{Channel, MessageHeader};
use mcap::write::Metadata;
use mcap::{McapError, Schema, WriteOptions, Writer};

use super::foxglove;
use super::reserved::Reserved;
use crate::error::{Error, ErrorKind};

/// Bytes after which a chunk ends.
const CHUNK_BYTES: u64 = 4 << 20;
/// Nanoseconds after which a chunk ends.
const CHUNK_TIME: u64 = 1_000_000_000;
/// Most bytes of the end of every file; then a chunk's share of it, and a message's bytes besides its data.
const END_BYTES: u64 = 256 << 10;
const CHUNK_SHARE: u64 = 512;
const MESSAGE_SHARE: u64 = 64;

/// A channel of a recording: its topic and its schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Topic {
    /// Frames as they are summed.
    Raw,
    /// Frames as the camera sent them: JPEG.
    Jpeg,
    /// The 25 taxels.
    Taxels,
    /// The ten features.
    Features,
    /// Events, for a person and as JSON.
    Events,
    EventsJson,
    /// Lost frames and what happened to the source, for a person and as JSON.
    Faults,
    FaultsJson,
}

impl Topic {
    fn name_and_schema(self) -> (&'static str, foxglove::Schema) {
        use foxglove::Schema;
        match self {
            Self::Raw => (super::CAMERA, Schema::RawImage),
            Self::Jpeg => (super::CAMERA, Schema::CompressedImage),
            Self::Taxels => ("/taxels", Schema::RawImage),
            Self::Features => ("/features", Schema::Float64MultiArray),
            Self::Events => ("/events", Schema::Log),
            Self::EventsJson => (super::EVENTS, Schema::Record),
            Self::Faults => ("/faults", Schema::Log),
            Self::FaultsJson => (super::FAULTS, Schema::Record),
        }
    }
}

/// A message to be written.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) topic: Topic,
    /// The time on the recording's time line, in nanoseconds. It is never less than that of the message before.
    pub(super) time: u64,
    /// The driver's own time stamp of the frame, in nanoseconds.
    pub(super) taken: u64,
    /// The driver's own counter, or a number of the recording's.
    pub(super) sequence: u32,
    pub(super) data: Vec<u8>,
}

/// The buffered file, shared with the writer that formats it, so that it can be flushed without ending a chunk.
#[derive(Clone, Debug)]
struct Shared(Rc<RefCell<BufWriter<Reserved>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.borrow_mut().flush()
    }
}

impl Seek for Shared {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.0.borrow_mut().seek(position)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.0.borrow_mut().stream_position()
    }
}

/// An MCAP file that is being written.
pub(super) struct RecordingFile {
    writer: Writer<Shared>,
    shared: Shared,
    channels: BTreeMap<Topic, u16>,
    chunk_start: Option<u64>,
    /// Bytes and messages of the chunk that is open, and the number of chunks so far.
    chunk: (u64, u64),
    chunks: u64,
}

impl RecordingFile {
    /// Starts a recording in a file that is empty.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn new(file: File, metadata: &[Metadata]) -> Result<Self, McapError> {
        let shared = Shared(Rc::new(RefCell::new(BufWriter::new(Reserved::new(file)))));
        let library = concat!("wstac ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).chunk_size(None).library(library);
        let writer = options.create(shared.clone())?;
        let mut file = Self { writer, shared, channels: BTreeMap::new(), chunk_start: None, chunk: (0, 0), chunks: 0 };
        for metadata in metadata {
            file.writer.write_metadata(metadata)?;
        }
        file.flush()?;
        Ok(file)
    }

    /// Returns whether there is room for these messages, and to finish the file after them.
    ///
    /// # Errors
    /// The file cannot be used.
    pub(super) fn has_room(&mut self, messages: &[Message]) -> io::Result<bool> {
        let bytes: u64 = messages.iter().map(|message| message.data.len() as u64 + MESSAGE_SHARE).sum();
        self.make_room(bytes)
    }

    fn make_room(&mut self, bytes: u64) -> io::Result<bool> {
        let end = END_BYTES + CHUNK_SHARE * (self.chunks + 1) + MESSAGE_SHARE * self.chunk.1;
        let mut file = self.shared.0.borrow_mut();
        let waiting = file.buffer().len() as u64;
        file.get_mut().make_room(bytes + end + waiting)
    }

    /// Writes a message.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&mut self, message: &Message) -> Result<(), McapError> {
        let channel = self.channel(message.topic)?;
        let (sequence, log_time, publish_time) = (message.sequence, message.time, message.taken);
        self.write_header(&MessageHeader { channel_id: channel, sequence, log_time, publish_time }, &message.data)
    }

    fn write_header(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), McapError> {
        let start = *self.chunk_start.get_or_insert(header.log_time);
        if self.chunk.1 > 0 && (self.chunk.0 >= CHUNK_BYTES || header.log_time.saturating_sub(start) >= CHUNK_TIME) {
            self.writer.flush()?;
            (self.chunk_start, self.chunk) = (Some(header.log_time), (0, 0));
            self.chunks += 1;
        }
        self.chunk.0 += data.len() as u64;
        self.chunk.1 += 1;
        self.writer.write_to_known_channel(header, data)
    }

    /// Writes a message of a channel that [`add_channel`](Self::add_channel) gave.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn write_copy(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), McapError> {
        self.write_header(header, data)
    }

    /// Adds a channel like another file's, with its schema if it has one, and returns its number here.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn add_channel(&mut self, channel: &Channel, schema: Option<&Schema<'_>>) -> Result<u16, McapError> {
        let schema = match schema {
            Some(schema) => self.writer.add_schema(&schema.name, &schema.encoding, &schema.data)?,
            None => 0,
        };
        self.writer.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata)
    }

    /// Writes a record of metadata.
    ///
    /// # Errors
    /// The errors of [`write`](Self::write).
    pub(super) fn write_metadata(&mut self, metadata: &Metadata) -> Result<(), McapError> {
        (self.chunk_start, self.chunk) = (None, (0, 0));
        self.writer.write_metadata(metadata)
    }

    fn channel(&mut self, topic: Topic) -> Result<u16, McapError> {
        if let Some(&channel) = self.channels.get(&topic) {
            return Ok(channel);
        }
        let (name, schema) = topic.name_and_schema();
        let (schema_encoding, encoding) = schema.encodings();
        let id = self.writer.add_schema(schema.name(), schema_encoding, schema.data())?;
        let channel = self.writer.add_channel(id, name, encoding, &BTreeMap::new())?;
        self.channels.insert(topic, channel);
        Ok(channel)
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
    pub(super) fn finish(mut self) -> Result<u64, McapError> {
        self.writer.finish()?;
        drop(self.writer);
        self.shared.flush()?;
        let Some(shared) = Rc::into_inner(self.shared.0) else { return Ok(0) };
        let file = shared.into_inner().into_inner().map_err(io::IntoInnerError::into_error)?;
        let bytes = file.bytes();
        file.close()?;
        Ok(bytes)
    }
}

/// Describes an error of writing. The content of the file is not lost.
pub(super) fn in_words(path: &Path, error: McapError) -> Error {
    let path = path.display();
    let hint = format_args!("wstac recover {path} -o NEW.mcap brings back what is in it");
    match error {
        McapError::Io(error) => {
            Error::new(error.kind().into(), &path, format_args!("{error}; {hint}")).caused_by(error)
        }
        error => Error::new(ErrorKind::Io, &path, format_args!("{error}; {hint}")).caused_by(error),
    }
}
