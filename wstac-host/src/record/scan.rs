//! An MCAP file record by record, whole or not.
//!
//! Chunks must not be compressed. A chunk that was never finished is read as far as it goes. Its header lacks length
//! and checksum, but its records are there.
//!
//! The scan is our own, because it is this project's policy which parts of a damaged or unfinished recording are kept.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{Record, op};
use mcap::write::Metadata;

use super::parse::parse_record;
use crate::error::{Error, ErrorKind};

/// Bytes of an operation code and a length.
const HEAD: u64 = 9;
/// Bytes of a chunk's header whose compression has an empty name.
const CHUNK_HEADER: usize = 40;
/// Bytes of the footer and of the magic at the end.
const END: u64 = HEAD + 20 + mcap::MAGIC.len() as u64;
/// Most bytes of an index that is read.
const LONGEST_INDEX: u64 = 256 << 20;
/// Bytes of a message before its data.
const MESSAGE_HEADER: usize = 22;

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A record of this operation code; [`Scan::body`] has it. If it is not `sound`, it stands in a damaged chunk.
    Record { op: u8, sound: bool },
    /// The end: the data's proper end, or the place where the file breaks off.
    End { whole: bool },
}

/// A message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MessageBody<'a> {
    pub(crate) channel: u16,
    pub(crate) sequence: u32,
    /// The times when it was logged and when it was published, in nanoseconds.
    pub(crate) times: [u64; 2],
    pub(crate) data: &'a [u8],
}

impl<'a> MessageBody<'a> {
    /// Reads a message from a record's body; `None` if that is too short.
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

/// Bytes that could not be read as records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unread {
    /// The place of the first of them in the file.
    pub at: u64,
    /// The number of bytes.
    pub bytes: u64,
    /// Whether a damaged length hides them. Otherwise they are a record that was not completely written.
    pub damaged: bool,
}

/// A file that is being read.
pub(crate) struct Scan {
    file: BufReader<File>,
    /// The place where the file is read next, and its end.
    at: u64,
    length: u64,
    /// The record that was read last, if it stands outside a chunk.
    record: Vec<u8>,
    /// The chunk that is being read, and the place in it where the next record starts.
    chunk: Vec<u8>,
    chunk_at: usize,
    chunk_sound: bool,
    /// The place of the last record's body in the chunk; `None` if it is in `record`.
    in_chunk: Option<(usize, usize)>,
    /// Whether bodies of chunks and of other large records are left out.
    outline: bool,
    /// Bytes of the longest record, outside chunks or in one.
    longest: u64,
    unread: Option<Unread>,
}

impl Scan {
    /// Opens a file.
    ///
    /// # Errors
    /// The file cannot be read, or is no MCAP file.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let failed = |error: io::Error| Error::io(path.display(), error);
        let file = crate::files::open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if !metadata.is_file() {
            return Err(Error::new(
                ErrorKind::Format,
                path.display(),
                "is a folder, a device or a pipe, expected an MCAP file",
            ));
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
            longest: 0,
            unread: None,
        };
        let mut magic = Vec::new();
        (&mut scan.file).take(mcap::MAGIC.len() as u64).read_to_end(&mut magic).map_err(failed)?;
        if magic != mcap::MAGIC {
            let found = magic.escape_ascii();
            return Err(Error::new(
                ErrorKind::Format,
                path.display(),
                format_args!("starts with \"{found}\", expected an MCAP file, which starts with \"\\x89MCAP0\""),
            ));
        }
        scan.at = magic.len() as u64;
        Ok(scan)
    }

    /// Returns the body of the record that was read last.
    pub(crate) fn body(&self) -> &[u8] {
        match self.in_chunk {
            Some((start, end)) => self.chunk.get(start..end).unwrap_or_default(),
            None => &self.record,
        }
    }

    /// Returns the bytes that could not be read so far.
    pub(crate) fn unread(&self) -> Option<Unread> {
        self.unread
    }

    /// Returns the next record. Those of a chunk come one by one, and the chunk itself does not come.
    ///
    /// # Errors
    /// The file cannot be read, or a chunk is compressed.
    pub(crate) fn next(&mut self) -> io::Result<Step> {
        loop {
            if let Some(op) = self.next_in_chunk() {
                return Ok(Step::Record { op, sound: self.chunk_sound });
            }
            self.leave_chunk();
            let start = self.at;
            let Some((op, length)) = self.head()? else {
                self.leave(start, self.length - start, false);
                return Ok(Step::End { whole: false });
            };
            let left = self.length - self.at;
            match op {
                op::CHUNK => self.start_chunk(length, left)?,
                // No record has this code, so no record follows.
                0 => {
                    if !self.rest_is_empty()? {
                        self.leave(start, self.length - start, true);
                    }
                    return Ok(Step::End { whole: false });
                }
                _ if length > left => {
                    // A file that was cut off lacks its end. Its last part is less than a record.
                    let damaged =
                        op > op::DATA_END || left > 2 * self.longest.max(1 << 20) || self.ends_with_magic()?;
                    self.leave(start, self.length - start, damaged);
                    return Ok(Step::End { whole: false });
                }
                op::DATA_END => return Ok(Step::End { whole: self.has_proper_end()? }),
                op::MESSAGE | op::SCHEMA | op::CHANNEL | op::METADATA if !(self.outline && op == op::MESSAGE) => {
                    self.at += length;
                    self.longest = self.longest.max(length);
                    self.in_chunk = None;
                    read_exactly(&mut self.file, &mut self.record, length)?;
                    return Ok(Step::Record { op, sound: true });
                }
                // These codes have no meaning yet. Codes from 0x80 on are free for any program.
                _ if op > op::DATA_END && op < 0x80 => {
                    self.leave(start, HEAD + length, true);
                    self.skip(length)?;
                }
                _ => self.skip(length)?,
            }
        }
    }

    /// Returns a record's operation code and length; `None` at the end.
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
        // Small steps stay within the buffer.
        self.file.seek_relative(bytes as i64)
    }

    /// Reads a chunk of this length.
    ///
    /// If fewer bytes are left, it goes on with the chunk's records as if they stood in the file itself, which they do.
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

    /// Returns the next record of the chunk.
    fn next_in_chunk(&mut self) -> Option<u8> {
        let rest = self.chunk.get(self.chunk_at..)?;
        let (&op, rest) = rest.split_first()?;
        let (length, rest) = rest.split_first_chunk()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok().filter(|&length| length <= rest.len())?;
        let start = self.chunk_at + HEAD as usize;
        self.longest = self.longest.max(length as u64);
        self.in_chunk = Some((start, start + length));
        self.chunk_at = start + length;
        Some(op)
    }

    /// Leaves the rest of the chunk, which is no record because its length is damaged.
    fn leave_chunk(&mut self) {
        let left = self.chunk.len().saturating_sub(self.chunk_at) as u64;
        if left > 0 {
            self.leave(self.at.saturating_sub(left), left, true);
        }
        self.chunk.clear();
        self.chunk_at = 0;
    }

    /// Notes bytes that cannot be read.
    fn leave(&mut self, at: u64, bytes: u64, damaged: bool) {
        let Unread { at, bytes: before, damaged: was } = self.unread.unwrap_or(Unread { at, bytes: 0, damaged: false });
        if bytes > 0 {
            self.unread = Some(Unread { at, bytes: before.saturating_add(bytes), damaged: was || damaged });
        }
    }

    /// Returns whether only zeros follow, which are reserved room.
    fn rest_is_empty(&mut self) -> io::Result<bool> {
        loop {
            let bytes = self.file.fill_buf()?;
            let (count, is_empty) = (bytes.len(), bytes.iter().all(|&byte| byte == 0));
            if count == 0 || !is_empty {
                return Ok(is_empty);
            }
            self.file.consume(count);
        }
    }

    fn ends_with_magic(&mut self) -> io::Result<bool> {
        self.file.seek(SeekFrom::Start(self.length.saturating_sub(mcap::MAGIC.len() as u64)))?;
        let mut tail = Vec::new();
        self.file.read_to_end(&mut tail)?;
        Ok(tail == mcap::MAGIC)
    }

    /// Returns whether the file ends as it should: with a footer and the magic bytes once more.
    fn has_proper_end(&mut self) -> io::Result<bool> {
        let end = END;
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

/// Returns the records of the index at a file's end, with their operation codes.
///
/// There are none if the index is damaged or missing.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn index(path: &Path) -> io::Result<Vec<(u8, Vec<u8>)>> {
    let mut file = crate::files::open(path)?;
    let length = file.metadata()?.len();
    let Some(footer) = length.checked_sub(END) else { return Ok(Vec::new()) };
    file.seek(SeekFrom::Start(footer))?;
    let mut tail = Vec::new();
    read_exactly(&mut file, &mut tail, END)?;
    let start = tail.get(HEAD as usize..).and_then(<[u8]>::first_chunk).map_or(0, |start| u64::from_le_bytes(*start));
    let bytes = footer.saturating_sub(start);
    if tail.first() != Some(&op::FOOTER) || !tail.ends_with(mcap::MAGIC) || start == 0 || bytes > LONGEST_INDEX {
        return Ok(Vec::new());
    }
    file.seek(SeekFrom::Start(start.min(footer)))?;
    let mut all = Vec::new();
    read_exactly(&mut file, &mut all, bytes)?;
    // The checksum covers the index, and the footer up to the checksum itself.
    let (of_footer, crc) = tail.split_at(END as usize - mcap::MAGIC.len() - 4);
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&all);
    hasher.update(of_footer);
    let crc = crc.first_chunk().map_or(0, |crc| u32::from_le_bytes(*crc));
    if crc != 0 && hasher.finalize() != crc {
        return Ok(Vec::new());
    }
    let mut records = Vec::new();
    let mut rest = &all[..];
    while let Some((op, after)) = rest.split_first() {
        let Some((length, after)) = after.split_first_chunk() else { break };
        let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
        let Some((body, after)) = after.split_at_checked(length) else { break };
        records.push((*op, body.to_vec()));
        rest = after;
    }
    Ok(records)
}

/// The description of a file, without its messages.
pub(crate) struct Outline {
    /// Its records of metadata, in their order.
    pub(crate) metadata: Vec<Metadata>,
    /// Whether it was finished.
    pub(crate) whole: bool,
}

/// Reads the description of a file.
///
/// # Errors
/// The errors of [`Scan::open`], or a chunk is compressed.
pub(crate) fn outline(path: &Path) -> Result<Outline, Error> {
    let mut scan = Scan { outline: true, ..Scan::open(path)? };
    let mut metadata = Vec::new();
    loop {
        match scan.next().map_err(|error| Error::io(path.display(), error))? {
            Step::Record { op: op::METADATA, .. } => {
                if let Ok(Record::Metadata(record)) = parse_record(op::METADATA, scan.body()) {
                    metadata.push(record);
                }
            }
            Step::Record { .. } => {}
            Step::End { whole } => return Ok(Outline { metadata, whole }),
        }
    }
}

/// Reads exactly this many bytes. The memory grows as they come.
fn read_exactly(file: &mut impl Read, into: &mut Vec<u8>, bytes: u64) -> io::Result<()> {
    into.clear();
    into.try_reserve_exact(bytes as usize).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    if file.take(bytes).read_to_end(into)? as u64 == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}
