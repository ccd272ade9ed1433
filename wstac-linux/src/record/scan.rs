//! An MCAP file record by record, whole or not.
//!
//! Chunks must not be compressed. One that was never finished is read as far as it goes: what its header should say of
//! it is not there, but its records are.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{Record, op};
use mcap::write::Metadata;

use crate::error::Error;

/// Bytes of an operation code and a length.
const HEAD: u64 = 9;
/// Bytes of a chunk's header whose compression has an empty name.
const CHUNK_HEADER: usize = 40;
/// Bytes of a message before its data.
const MESSAGE_HEADER: usize = 22;

/// What a step came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A record of this operation code; [`Scan::body`] has it. Where it is not `sound`, it stands in a chunk that is not
    /// as it was written.
    Record { op: u8, sound: bool },
    /// No more: the data's proper end, or where the file breaks off.
    End { whole: bool },
}

/// A message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MessageBody<'a> {
    pub(crate) channel: u16,
    pub(crate) sequence: u32,
    /// Nanoseconds: when it was logged and when it was published.
    pub(crate) times: [u64; 2],
    pub(crate) data: &'a [u8],
}

impl<'a> MessageBody<'a> {
    /// A message of a record's body; nothing where that is too short.
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let (header, data) = body.split_at_checked(MESSAGE_HEADER)?;
        let (channel, rest) = header.split_first_chunk()?;
        let (sequence, rest) = rest.split_first_chunk()?;
        let (logged, rest) = rest.split_first_chunk()?;
        let published = rest.first_chunk()?;
        Some(Self {
            channel: u16::from_le_bytes(*channel),
            sequence: u32::from_le_bytes(*sequence),
            times: [u64::from_le_bytes(*logged), u64::from_le_bytes(*published)],
            data,
        })
    }
}

/// A file that is being read.
pub(crate) struct Scan {
    file: BufReader<File>,
    /// Where the file is read next, and where it ends.
    at: u64,
    length: u64,
    /// The record that was read last, where it stands outside a chunk.
    record: Vec<u8>,
    /// The chunk that is being read, and where in it the next record starts.
    chunk: Vec<u8>,
    chunk_at: usize,
    chunk_sound: bool,
    /// Where the last record's body is in the chunk; nothing where it is `record`.
    in_chunk: Option<(usize, usize)>,
    /// Whether bodies of chunks and of other large records are left out.
    outline: bool,
}

impl Scan {
    /// Opens a file.
    ///
    /// # Errors
    /// Where it cannot be read, or is no MCAP file.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let failed = |error: io::Error| Error::new(path.display(), error);
        let file = File::open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if !metadata.is_file() {
            return Err(Error::new(path.display(), "is a folder, a device or a pipe, expected an MCAP file"));
        }
        let mut scan = Self {
            file: BufReader::with_capacity(1 << 16, file),
            at: 0,
            length: metadata.len(),
            record: Vec::new(),
            chunk: Vec::new(),
            chunk_at: 0,
            chunk_sound: true,
            in_chunk: None,
            outline: false,
        };
        let mut magic = Vec::new();
        (&mut scan.file).take(mcap::MAGIC.len() as u64).read_to_end(&mut magic).map_err(failed)?;
        if magic != mcap::MAGIC {
            let found = magic.escape_ascii();
            return Err(Error::new(
                path.display(),
                format_args!("starts with \"{found}\", expected an MCAP file, which starts with \"\\x89MCAP0\""),
            ));
        }
        scan.at = magic.len() as u64;
        Ok(scan)
    }

    /// The body of the record that was read last.
    pub(crate) fn body(&self) -> &[u8] {
        match self.in_chunk {
            Some((start, end)) => self.chunk.get(start..end).unwrap_or_default(),
            None => &self.record,
        }
    }

    /// The next record; those of a chunk come one by one, the chunk itself does not.
    ///
    /// # Errors
    /// Where the file cannot be read, or a chunk is compressed.
    pub(crate) fn next(&mut self) -> io::Result<Step> {
        loop {
            if let Some(op) = self.next_in_chunk() {
                return Ok(Step::Record { op, sound: self.chunk_sound });
            }
            let Some((op, length)) = self.head()? else { return Ok(Step::End { whole: false }) };
            let left = self.length - self.at;
            match op {
                op::CHUNK => self.start_chunk(length, left)?,
                // Nothing has this code: what follows is no record.
                0 => return Ok(Step::End { whole: false }),
                _ if length > left => return Ok(Step::End { whole: false }),
                op::DATA_END => return Ok(Step::End { whole: self.has_proper_end()? }),
                op::MESSAGE | op::SCHEMA | op::CHANNEL | op::METADATA if !(self.outline && op == op::MESSAGE) => {
                    self.at += length;
                    self.in_chunk = None;
                    read_exactly(&mut self.file, &mut self.record, length)?;
                    return Ok(Step::Record { op, sound: true });
                }
                _ => self.skip(length)?,
            }
        }
    }

    /// A record's operation code and length; nothing at the end.
    fn head(&mut self) -> io::Result<Option<(u8, u64)>> {
        if self.length - self.at < HEAD {
            return Ok(None);
        }
        let mut head = [0; HEAD as usize];
        self.file.read_exact(&mut head)?;
        self.at += HEAD;
        let [op, length @ ..] = head;
        Ok(Some((op, u64::from_le_bytes(length))))
    }

    fn skip(&mut self, bytes: u64) -> io::Result<()> {
        self.at += bytes;
        // Small ones stay in the buffer.
        self.file.seek_relative(bytes as i64)
    }

    /// Reads a chunk of this length, or, where there are not as many bytes left, goes on with the records in it as if
    /// they stood in the file itself: so they do.
    fn start_chunk(&mut self, length: u64, left: u64) -> io::Result<()> {
        if left < CHUNK_HEADER as u64 {
            return self.skip(left);
        }
        let mut header = [0; CHUNK_HEADER];
        self.file.read_exact(&mut header)?;
        self.at += CHUNK_HEADER as u64;
        let number = |at: usize| {
            header.get(at..at + 4).map_or(0, |word| word.iter().rev().fold(0, |n, &b| n << 8 | u32::from(b)))
        };
        let (crc, name) = (number(24), number(28));
        if name != 0 {
            return Err(io::Error::new(
                io::ErrorKind::Unsupported,
                "has a compressed chunk, expected none to be compressed: mcap decompress makes it so",
            ));
        }
        if length > left {
            return Ok(());
        }
        let bytes = length.saturating_sub(CHUNK_HEADER as u64);
        if self.outline {
            return self.skip(bytes);
        }
        self.at += bytes;
        read_exactly(&mut self.file, &mut self.chunk, bytes)?;
        self.chunk_at = 0;
        self.chunk_sound = crc == 0 || crc32fast::hash(&self.chunk) == crc;
        Ok(())
    }

    /// The next record of the chunk.
    fn next_in_chunk(&mut self) -> Option<u8> {
        let rest = self.chunk.get(self.chunk_at..)?;
        let (&op, rest) = rest.split_first()?;
        let (length, rest) = rest.split_first_chunk()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok().filter(|&length| length <= rest.len())?;
        let start = self.chunk_at + HEAD as usize;
        self.in_chunk = Some((start, start + length));
        self.chunk_at = start + length;
        Some(op)
    }

    /// Whether the file ends as it should: with a footer and the magic bytes once more.
    fn has_proper_end(&mut self) -> io::Result<bool> {
        let end = 20 + HEAD + mcap::MAGIC.len() as u64;
        if self.length < self.at + end {
            return Ok(false);
        }
        self.file.seek(SeekFrom::Start(self.length - end))?;
        self.at = self.length;
        let mut tail = Vec::new();
        (&mut self.file).take(end).read_to_end(&mut tail)?;
        Ok(tail.first() == Some(&op::FOOTER) && tail.ends_with(mcap::MAGIC))
    }
}

/// What a file is about, without its messages.
pub(crate) struct Outline {
    /// Its records of metadata, in their order.
    pub(crate) metadata: Vec<Metadata>,
    /// Whether it was finished.
    pub(crate) whole: bool,
}

/// Reads what a file is about.
///
/// # Errors
/// As [`Scan::open`]; where a chunk is compressed.
pub(crate) fn outline(path: &Path) -> Result<Outline, Error> {
    let mut scan = Scan { outline: true, ..Scan::open(path)? };
    let mut metadata = Vec::new();
    loop {
        match scan.next().map_err(|error| Error::new(path.display(), error))? {
            Step::Record { op: op::METADATA, .. } => {
                if let Ok(Record::Metadata(record)) = mcap::parse_record(op::METADATA, scan.body()) {
                    metadata.push(record);
                }
            }
            Step::Record { .. } => {}
            Step::End { whole } => return Ok(Outline { metadata, whole }),
        }
    }
}

/// Reads as many bytes, with memory that grows as they come.
fn read_exactly(file: &mut impl Read, into: &mut Vec<u8>, bytes: u64) -> io::Result<()> {
    into.clear();
    into.try_reserve_exact(bytes as usize).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    if file.take(bytes).read_to_end(into)? as u64 == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}
