//! An MCAP file record by record, whole or not.
//!
//! The walk believes no length that it cannot check. A record must have the shape of its kind. If it has not, the walk
//! goes on at the next place that has: a chunk of the index, a checksum, or several records in a row. The bytes between
//! are reported. A chunk's records are read where they stand in the file, so that a chunk takes no memory, and one that
//! was never finished is read as far as it goes.
//!
//! The walk is our own, because it is this project's policy which parts of a damaged or unfinished recording are kept.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use crc32fast::Hasher;
use mcap::records::op;
use mcap::write::Metadata;

use super::bytes::FileBytes;
use super::compression::Compression;
use super::file::FIXED_CHANNELS;
use super::limits::{MOST_DEFINITIONS, MOST_MESSAGE, MOST_METADATA, MOST_PACKED};
use super::parse::{fits, parse_record};
use super::summary::{self, DATA_END, HEAD, Summary};
use super::sums;
use crate::error::Error;

/// Bytes of a chunk's header whose compression has an empty name.
const CHUNK_HEADER: u64 = 40;
/// Bytes of a message before its data.
const MESSAGE_HEADER: u64 = 22;
/// Most bytes of the name of a compression, and of the size behind it.
const LONGEST_NAME: usize = 4;
/// Bytes that are searched at a time for the next record.
const PIECE: usize = 1 << 15;

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A record outside of chunks or in one.
    Record(Span),
    /// A chunk ended. What was read of it may not be in memory any longer.
    ChunkEnd,
    /// Bytes that are no records.
    Damage(Unread),
    /// The end: the data's proper end, or the place where the file breaks off.
    End { whole: bool },
}

/// The place of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    /// Its operation code.
    pub(super) op: u8,
    /// The place of the operation code.
    pub(super) at: u64,
    /// Bytes of its body.
    pub(super) length: u64,
}

impl Span {
    /// Returns the place behind the record.
    pub(super) fn end(self) -> u64 {
        self.at + HEAD + self.length
    }
}

/// What a chunk's checksum says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crc {
    /// The bytes are those that were written.
    Good,
    /// They are not.
    Bad,
    /// There is no checksum, or no chunk.
    Unknown,
}

impl Crc {
    fn of(stated: u32, found: u32) -> Self {
        match stated {
            0 => Self::Unknown,
            stated if stated == found => Self::Good,
            _ => Self::Bad,
        }
    }
}

/// What the header of a chunk says.
#[derive(Clone, Copy, Debug)]
struct ChunkHead {
    /// The place of its records, or of what they were compressed to.
    content: u64,
    /// Bytes there; `None` if the chunk was never finished.
    stored: Option<u64>,
    compression: Compression,
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
        let (header, data) = body.split_at_checked(MESSAGE_HEADER as usize)?;
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
    /// Whether they are damaged. Otherwise they are a record that was not completely written.
    pub damaged: bool,
}

/// A chunk that is being read.
#[derive(Debug)]
struct Chunk {
    /// The place behind its records; `None` if it was never finished.
    end: Option<u64>,
}

/// What a record stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Around {
    /// The file itself.
    File,
    /// A chunk that was never finished.
    Open,
    /// A chunk whose records end here.
    Until(u64),
}

impl Around {
    /// Returns the end of the chunk, if it is known.
    fn end(self) -> Option<u64> {
        match self {
            Self::Until(end) => Some(end),
            Self::File | Self::Open => None,
        }
    }
}

/// The way of a walk through damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Damage ends the walk.
    Strict,
    /// Damage ends the walk, and chunks are left out.
    Outline,
    /// The walk goes on behind damage, and sound chunks are left out.
    Survey,
    /// The walk goes on behind damage.
    Salvage,
}

/// A file that is being read.
#[derive(Debug)]
pub(super) struct Walk {
    file: FileBytes,
    mode: Mode,
    /// The place of the next record, and the end of all records.
    at: u64,
    end: u64,
    chunk: Option<Chunk>,
    /// The verdict on the chunk that is being read, or that just ended.
    crc: Crc,
    /// The end of the bytes that a chunk's checksum was made of.
    hashed: u64,
    /// Where to go on in the file behind a chunk that was unpacked, the end there, and the place of the chunk.
    outer: Option<(u64, u64, u64)>,
    /// The compression of the first chunk.
    compression: Option<Compression>,
    /// The checksum of the data so far, and its end.
    total: (Hasher, u64),
    /// Numbers of channels.
    channels: BTreeSet<u16>,
    /// Whether `wstac record` wrote the file. It writes no private records and no attachments.
    own: bool,
    summary: Option<Summary>,
    has_magic: bool,
    unread: Option<Unread>,
    /// Memory for records whose shape is checked.
    scratch: Vec<u8>,
    /// Memory for bytes that are searched.
    piece: Vec<u8>,
}

impl Walk {
    /// Opens a file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn open(path: &Path, mode: Mode) -> Result<Self, Error> {
        let mut file = FileBytes::open(path)?;
        let failed = |error: io::Error| Error::io(path.display(), error);
        let has_magic = file.peek(0, mcap::MAGIC.len()).map_err(failed)? == mcap::MAGIC;
        let summary = summary::read(&mut file).map_err(failed)?;
        let mut walk = Self {
            end: summary.as_ref().map_or(file.length(), |summary| summary.data_end),
            file,
            mode,
            at: mcap::MAGIC.len() as u64,
            chunk: None,
            crc: Crc::Unknown,
            hashed: 0,
            outer: None,
            compression: None,
            total: (Hasher::new(), 0),
            channels: BTreeSet::new(),
            own: false,
            summary,
            has_magic,
            unread: None,
            scratch: Vec::new(),
            piece: Vec::new(),
        };
        if let Some(summary) = &walk.summary {
            let ids = summary.definitions.iter().filter(|(op, _)| *op == op::CHANNEL);
            walk.channels.extend(ids.filter_map(|(_, body)| body.first_chunk().map(|id| u16::from_le_bytes(*id))));
        }
        Ok(walk)
    }

    /// Notes that `wstac record` wrote the file.
    pub(super) fn set_own(&mut self) {
        self.own = true;
        self.channels.extend(FIXED_CHANNELS);
    }

    /// Returns whether the file starts as an MCAP file does.
    pub(super) fn has_magic(&self) -> bool {
        self.has_magic
    }

    /// Returns the first bytes of the file.
    pub(super) fn first_bytes(&mut self) -> io::Result<String> {
        Ok(self.file.peek(0, mcap::MAGIC.len())?.escape_ascii().to_string())
    }

    /// Returns the index at the file's end; `None` if it is damaged or missing.
    pub(super) fn summary(&self) -> Option<&Summary> {
        self.summary.as_ref()
    }

    /// Returns the compression of the first chunk; `None` if there is no chunk so far.
    pub(super) fn compression(&self) -> Option<Compression> {
        self.compression
    }

    /// Returns all bytes that could not be read so far.
    pub(super) fn unread(&self) -> Option<Unread> {
        self.unread
    }

    /// Returns the checksum's verdict on the chunk that the last record stands in, or that just ended.
    pub(super) fn crc(&self) -> Crc {
        self.crc
    }

    /// Returns whether the last record stands in a chunk.
    pub(super) fn in_chunk(&self) -> bool {
        self.chunk.is_some()
    }

    /// Reads a record's body.
    ///
    /// # Errors
    /// The file cannot be read, or the record is larger than any that is read.
    pub(super) fn body(&self, span: Span, into: &mut Vec<u8>) -> io::Result<()> {
        if span.length > MOST_MESSAGE {
            let (found, most) = (span.length >> 20, MOST_MESSAGE >> 20);
            let message = format!("has a record of {found} MB at byte {}, expected at most {most} MB", span.at);
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        self.file.read(span.at + HEAD, span.length as usize, into)
    }

    /// Returns the first bytes of a record's body: at most 64 KiB of them.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn start_of(&mut self, span: Span, count: usize) -> io::Result<&[u8]> {
        self.file.peek(span.at + HEAD, count.min(usize::try_from(span.length).unwrap_or(usize::MAX)))
    }

    /// Returns the checksum of bytes of the file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn hash(&self, from: u64, to: u64) -> io::Result<u32> {
        Ok(self.file.hash(from, to)?.finalize())
    }

    /// Returns the message records between two places, or `None` if there is anything else.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn messages(&mut self, from: u64, to: u64, most: usize) -> io::Result<Option<Vec<Span>>> {
        let (mut at, mut found) = (from, Vec::new());
        while at < to {
            let Some((op, length)) = self.head(at)? else { return Ok(None) };
            let span = Span { op, at, length };
            let fits = op == op::MESSAGE && length >= MESSAGE_HEADER && length <= to - at && span.end() <= to;
            if !fits || found.len() == most {
                return Ok(None);
            }
            found.push(span);
            at = span.end();
        }
        Ok(Some(found))
    }

    /// Returns whether the checksum of the whole data is right, at the proper end; `None` if there is none.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn check_total(&mut self) -> io::Result<Option<bool>> {
        let (hasher, at) = &mut self.total;
        if *at > self.at {
            return Ok(None);
        }
        hasher.combine(&self.file.hash(*at, self.at)?);
        *at = self.at;
        let found = hasher.clone().finalize();
        let stated = self.file.peek(self.at + HEAD, 4)?.first_chunk().map_or(0, |crc| u32::from_le_bytes(*crc));
        Ok((stated != 0).then_some(stated == found))
    }

    /// Returns the next step.
    ///
    /// # Errors
    /// The file cannot be read, or a chunk is compressed in a way that this build does not read.
    pub(super) fn next(&mut self) -> io::Result<Step> {
        if self.chunk.is_none() {
            self.crc = Crc::Unknown;
            if let Some((at, end, _)) = self.outer.take() {
                self.file.set_unpacked(None);
                (self.at, self.end) = (at, end);
            }
        }
        loop {
            if self.chunk.as_ref().is_some_and(|chunk| chunk.end.is_some_and(|end| self.at >= end)) {
                self.chunk = None;
                return Ok(Step::ChunkEnd);
            }
            let start = self.at;
            if start == 8 && !self.has_magic && !self.goes_on() {
                return Ok(Step::End { whole: false });
            }
            let Some(span) = self.shape(start)? else {
                if let Some(step) = self.leave(start)? {
                    return Ok(step);
                }
                continue;
            };
            match span.op {
                op::CHUNK => {
                    if self.chunk.is_some() {
                        // It was never finished, or it is a damaged one whose end is not known.
                        self.chunk = None;
                        return Ok(Step::ChunkEnd);
                    }
                    self.enter(span)?;
                }
                op::DATA_END => {
                    if self.chunk.is_some() {
                        self.chunk = None;
                        return Ok(Step::ChunkEnd);
                    }
                    return Ok(Step::End { whole: summary::has_proper_end(&mut self.file)? });
                }
                _ => {
                    self.at = span.end();
                    if span.op == op::CHANNEL {
                        let id = self.file.peek(span.at + HEAD, 2)?.first_chunk().map(|id| u16::from_le_bytes(*id));
                        self.channels.extend(id);
                    }
                    return Ok(Step::Record(span));
                }
            }
        }
    }

    /// Leaves bytes that are no record. It returns `None` if the walk goes on behind them without a word.
    fn leave(&mut self, start: u64) -> io::Result<Option<Step>> {
        if start >= self.end && self.summary.is_some() && !self.in_chunk() {
            // The record at the end of the data is damaged, and nothing else.
            return Ok(Some(Step::End { whole: false }));
        }
        if start >= self.end || self.is_empty_from(start)? {
            let is_open = self.chunk.take().is_some();
            return Ok(Some(if is_open { Step::ChunkEnd } else { Step::End { whole: false } }));
        }
        let next = if self.goes_on() { self.resync(start + 1)? } else { self.end };
        // A file that was cut off ends with a part of a record.
        let cut = next == self.end && self.summary.is_none() && self.is_cut_off(start)?;
        let place = self.outer.map_or(start, |(_, _, chunk)| chunk);
        let damage = Unread { at: place, bytes: next - start, damaged: !cut };
        let all = self.unread.get_or_insert(Unread { at: place, bytes: 0, damaged: false });
        all.bytes = all.bytes.saturating_add(damage.bytes);
        all.damaged |= damage.damaged;
        self.at = next;
        Ok(Some(Step::Damage(damage)))
    }

    /// Returns whether a record starts here that is longer than the file.
    fn is_cut_off(&mut self, at: u64) -> io::Result<bool> {
        let left = self.file.length() - at;
        if left < HEAD {
            return Ok(true);
        }
        let Some((op, length)) = self.head(at)? else { return Ok(true) };
        let most = if op == op::MESSAGE { MOST_MESSAGE } else { MOST_DEFINITIONS };
        let ends = summary::ends_with_magic(&mut self.file)?;
        Ok(op > 0 && op < op::DATA_END && length > left - HEAD && length <= most && !ends)
    }

    /// Returns a record's operation code and length; `None` at the end.
    fn head(&mut self, at: u64) -> io::Result<Option<(u8, u64)>> {
        let head = self.file.peek(at, HEAD as usize)?;
        let Some((op, length)) = head.split_first() else { return Ok(None) };
        Ok(length.first_chunk().map(|length| (*op, u64::from_le_bytes(*length))))
    }

    /// Returns what the next record stands in.
    fn around(&self) -> Around {
        self.chunk.as_ref().map_or(Around::File, |chunk| chunk.end.map_or(Around::Open, Around::Until))
    }

    /// Returns the record at a place if it has the shape of its kind.
    fn shape(&mut self, at: u64) -> io::Result<Option<Span>> {
        self.shape_in(at, self.around())
    }

    /// Returns the record at a place if it has the shape of its kind. `chunk` is what it stands in.
    fn shape_in(&mut self, at: u64, chunk: Around) -> io::Result<Option<Span>> {
        let limit = chunk.end().unwrap_or(self.end);
        if matches!(chunk, Around::File) && self.indexed(at).is_some() {
            // The index knows better than a damaged code.
            return Ok(self.chunk_head(at)?.map(|_| Span { op: op::CHUNK, at, length: CHUNK_HEADER - HEAD }));
        }
        let Some((op, length)) = self.head(at)? else { return Ok(None) };
        let is_end = op == op::DATA_END && length == 4 && chunk.end().is_none();
        if is_end {
            let known = self.summary.is_none() || at == self.end;
            let fits = known && at + DATA_END <= self.file.length() && self.is_end(at)?;
            return Ok(fits.then_some(Span { op, at, length }));
        }
        if op == op::CHUNK && chunk.end().is_none() {
            return Ok(self.chunk_head(at)?.map(|_| Span { op, at, length: CHUNK_HEADER - HEAD }));
        }
        let Some(left) = limit.checked_sub(at + HEAD) else { return Ok(None) };
        if length > left {
            return Ok(None);
        }
        let inside = chunk.end().is_some();
        let has_shape = match op {
            op::MESSAGE => length >= MESSAGE_HEADER && length <= self.most_of_message(),
            op::SCHEMA | op::CHANNEL => self.fits(op, at, length)?,
            op::METADATA => !inside && self.fits(op, at, length)?,
            op::HEADER => at == mcap::MAGIC.len() as u64 && self.fits(op, at, length)?,
            op::MESSAGE_INDEX => {
                let count = self.file.peek(at + HEAD + 2, 4)?.first_chunk().map(|count| u32::from_le_bytes(*count));
                !inside && length >= 6 && count.is_some_and(|count| u64::from(count) == length - 6)
            }
            op::ATTACHMENT => !inside && !self.own,
            0x80.. => !self.own,
            _ => false,
        };
        Ok(has_shape.then_some(Span { op, at, length }))
    }

    /// Returns whether the walk goes on behind damage.
    fn goes_on(&self) -> bool {
        matches!(self.mode, Mode::Survey | Mode::Salvage)
    }

    /// Returns the most bytes of a message that is walked over. A reader of whole files reports a longer one itself.
    fn most_of_message(&self) -> u64 {
        if self.goes_on() { MOST_MESSAGE } else { u64::MAX }
    }

    fn fits(&mut self, op: u8, at: u64, length: u64) -> io::Result<bool> {
        if length > MOST_DEFINITIONS {
            return Ok(false);
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        let read = self.file.read(at + HEAD, length as usize, &mut scratch);
        let fits = read.is_ok() && fits(op, &scratch);
        self.scratch = scratch;
        read.map(|()| fits)
    }

    /// Returns whether the index or the footer follows the record at the end of the data.
    fn is_end(&mut self, at: u64) -> io::Result<bool> {
        let next = self.file.peek(at + DATA_END, 1)?.first().copied();
        Ok(next.is_none_or(|op| matches!(op, op::FOOTER..=op::CHANNEL | op::CHUNK_INDEX..=op::SUMMARY_OFFSET)))
    }

    /// Returns the length of the chunk at a place, as the index has it.
    fn indexed(&self, at: u64) -> Option<u64> {
        let chunks = &self.summary.as_ref().filter(|_| self.outer.is_none())?.chunks;
        let number = chunks.binary_search_by_key(&at, |(place, _)| *place).ok()?;
        chunks.get(number).map(|(_, length)| *length)
    }

    /// Returns what the header of a chunk says; `None` if there is none at this place.
    ///
    /// A chunk's header has its length three times, so one of them may be damaged.
    fn chunk_head(&mut self, at: u64) -> io::Result<Option<ChunkHead>> {
        let indexed = self.indexed(at);
        let left = self.end.saturating_sub(at + HEAD + CHUNK_HEADER);
        let is_open = self.summary.is_none();
        let header = self.file.peek(at, (HEAD + CHUNK_HEADER) as usize + LONGEST_NAME)?;
        let number = |from: usize| header.get(from..).and_then(<[u8]>::first_chunk).map(|n| u64::from_le_bytes(*n));
        let (Some(length), Some(size), Some(stored)) = (number(1), number(25), number(41)) else { return Ok(None) };
        let name = header.get(37..41).and_then(<[u8]>::first_chunk).map_or(0, |n| u32::from_le_bytes(*n));
        let compression = Compression::NAMES
            .into_iter()
            .find(|(_, name)| header.get(41..).is_some_and(|rest| rest.starts_with(name.as_bytes())));
        // The bytes of a compression's name cannot be the size of a chunk that is not compressed.
        let (compression, extra) = compression.map_or((Compression::None, 0), |(found, name)| (found, name.len()));
        let stored = if extra > 0 { number(41 + extra).unwrap_or(0) } else { stored };
        let content = at + HEAD + CHUNK_HEADER + extra as u64;
        let head = |stored| Some(ChunkHead { content, stored, compression });
        let of_length = length.wrapping_sub(CHUNK_HEADER + extra as u64);
        if let Some(indexed) = indexed {
            let of_index = (at + indexed).checked_sub(content);
            return Ok(of_index.and_then(|stored| head(Some(stored))));
        }
        if [length, size, stored].iter().filter(|size| **size == u64::MAX).count() >= 2 {
            return Ok(head(None));
        }
        let size = if extra > 0 { stored } else { size };
        let agreed = if of_length == size || of_length == stored {
            of_length
        } else if size == stored {
            size
        } else {
            return Ok(None);
        };
        // Without all three of them, the name must be right.
        let all_agree = of_length == size && size == stored;
        if name as usize != extra && !all_agree {
            return Ok(None);
        }
        Ok(if agreed <= left { head(Some(agreed)) } else { is_open.then(|| head(None)).flatten() })
    }

    /// Starts to read a chunk's records.
    fn enter(&mut self, span: Span) -> io::Result<()> {
        let Some(ChunkHead { content, stored, compression }) = self.chunk_head(span.at)? else { return Ok(()) };
        self.compression.get_or_insert(compression);
        self.at = content;
        let end = stored.map(|stored| (content + stored).min(self.end));
        if let Some(end) = end
            && (self.mode == Mode::Outline || (self.mode == Mode::Survey && self.follows(end)?))
        {
            self.at = end;
            return Ok(());
        }
        let crc = self.file.peek(span.at + HEAD + 24, 4)?.first_chunk().map_or(0, |crc| u32::from_le_bytes(*crc));
        if compression != Compression::None {
            return self.unpack(span.at, content, end, compression, crc);
        }
        self.crc = match end {
            // Bytes are summed once: a chunk in a damaged one is not summed again.
            Some(_) if content < self.hashed => Crc::Bad,
            Some(end) => {
                let found = self.file.hash(content, end)?;
                self.add_to_total(content, end, &found)?;
                self.hashed = end;
                Crc::of(crc, found.finalize())
            }
            None => Crc::Unknown,
        };
        self.chunk = Some(Chunk { end });
        Ok(())
    }

    /// Unpacks a chunk, and reads that in place of the file.
    fn unpack(
        &mut self,
        at: u64,
        content: u64,
        end: Option<u64>,
        compression: Compression,
        crc: u32,
    ) -> io::Result<()> {
        let behind = end.unwrap_or(self.end);
        let packed_bytes = behind - content;
        if packed_bytes > MOST_PACKED && end.is_some() {
            let (found, most) = (packed_bytes >> 20, MOST_PACKED >> 20);
            let message = format!("has a compressed chunk of {found} MB at byte {at}, expected at most {most} MB");
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        let mut packed = Vec::new();
        self.file.read(content, packed_bytes.min(MOST_PACKED) as usize, &mut packed)?;
        if self.mode == Mode::Strict {
            let found = self.file.hash(content, behind)?;
            self.add_to_total(content, behind, &found)?;
        }
        let (unpacked, is_all) = compression.unpack(&packed, MOST_PACKED as usize)?;
        drop(packed);
        self.crc = match end {
            Some(_) if is_all => Crc::of(crc, crc32fast::hash(&unpacked)),
            Some(_) => Crc::Bad,
            None => Crc::Unknown,
        };
        if !is_all {
            let all = self.unread.get_or_insert(Unread { at, bytes: 0, damaged: false });
            all.damaged |= end.is_some();
        }
        self.outer = Some((behind, self.end, at));
        (self.at, self.end) = (0, unpacked.len() as u64);
        self.chunk = Some(Chunk { end: Some(self.end) });
        self.file.set_unpacked(Some(unpacked));
        Ok(())
    }

    /// Adds a chunk's checksum to that of all data, with the bytes before the chunk.
    fn add_to_total(&mut self, content: u64, end: u64, of_chunk: &Hasher) -> io::Result<()> {
        if self.mode == Mode::Strict {
            let (total, at) = &mut self.total;
            total.combine(&self.file.hash(*at, content)?);
            total.combine(of_chunk);
            *at = end;
        }
        Ok(())
    }

    /// Returns whether a record follows that may stand behind a chunk.
    fn follows(&mut self, end: u64) -> io::Result<bool> {
        let span = self.shape_in(end, Around::File)?;
        Ok(span.is_some_and(|span| matches!(span.op, op::CHUNK | op::MESSAGE_INDEX | op::METADATA | op::DATA_END)))
    }

    /// Returns whether only zeros follow, which are reserved room.
    fn is_empty_from(&mut self, mut at: u64) -> io::Result<bool> {
        let end = self.end;
        loop {
            at = self.file.next_data(at);
            if at >= end {
                return Ok(true);
            }
            let wanted = (end - at).min(PIECE as u64) as usize;
            let bytes = self.file.peek(at, wanted)?;
            if bytes.is_empty() || bytes.iter().any(|&byte| byte != 0) {
                return Ok(bytes.is_empty());
            }
            at += bytes.len() as u64;
        }
    }

    /// Returns the next place at which records start again.
    fn resync(&mut self, from: u64) -> io::Result<u64> {
        let chunk = self.around();
        let end = chunk.end().unwrap_or(self.end);
        let summary = self.summary.as_ref().filter(|_| self.outer.is_none());
        let chunks = summary.map_or(&[][..], |summary| &summary.chunks);
        let next = chunks.iter().map(|(place, _)| *place).find(|&place| place >= from && place < self.end);
        let end = next.map_or(end, |next| next.min(end)).max(from);
        let mut piece = std::mem::take(&mut self.piece);
        let mut at = from;
        let found = loop {
            // A head starts with a byte that is not 0.
            at = self.file.next_data(at).max(at);
            if at >= end {
                break end;
            }
            piece.clear();
            let wanted = ((end - at).min(PIECE as u64) + HEAD) as usize;
            piece.extend_from_slice(self.file.peek(at, wanted)?);
            // Codes of records that may stand here, and lengths below 4 GiB.
            let is_head = |head: &[u8]| {
                matches!(
                    head,
                    [op::HEADER | op::SCHEMA..=op::MESSAGE_INDEX | op::METADATA | op::DATA_END, _, _, _, _, 0, 0, 0, 0]
                        | [op::CHUNK, _, _, _, _, 0xFF, 0xFF, 0xFF, 0xFF]
                )
            };
            if piece.iter().all(|&byte| byte == 0) {
                at += piece.len() as u64;
                continue;
            }
            let mut found = None;
            for (offset, _) in piece.windows(HEAD as usize).enumerate().filter(|(_, head)| is_head(head)) {
                let place = at + offset as u64;
                if place < end && self.is_anchor(place, chunk)? {
                    found = Some(place);
                    break;
                }
            }
            if let Some(found) = found {
                break found;
            }
            if piece.len() <= HEAD as usize {
                break end;
            }
            at += (piece.len() as u64 - HEAD).max(1).min(end - at);
        };
        self.piece = piece;
        Ok(found)
    }

    /// Returns whether records certainly start at a place: a checksum, or three records one behind the other.
    fn is_anchor(&mut self, at: u64, chunk: Around) -> io::Result<bool> {
        let end = chunk.end().unwrap_or(self.end);
        let (mut at, mut chunk) = (at, chunk);
        for _ in 0..3 {
            let Some(span) = self.shape_in(at, chunk)? else {
                return Ok(false);
            };
            match span.op {
                op::CHUNK => {
                    // Its header has the length three times.
                    let Some(head) = self.chunk_head(at)? else { return Ok(false) };
                    if head.compression != Compression::None {
                        return Ok(true);
                    }
                    (at, chunk) =
                        (head.content, head.stored.map_or(Around::Open, |stored| Around::Until(head.content + stored)));
                    continue;
                }
                op::DATA_END => return Ok(true),
                op::MESSAGE => {
                    let start = self.file.peek(at + HEAD, MESSAGE_HEADER as usize + sums::START.len())?;
                    let channel = start.first_chunk().map(|id| u16::from_le_bytes(*id));
                    if start.ends_with(sums::START) {
                        return Ok(true);
                    }
                    if !channel.is_some_and(|id| self.channels.contains(&id)) {
                        return Ok(false);
                    }
                }
                _ => {}
            }
            at = span.end();
            if at >= end || self.is_empty_start(at)? {
                return Ok(true);
            }
        }
        Ok(true)
    }

    /// Returns whether the file has no more bytes here than zeros, as far as a look goes.
    fn is_empty_start(&mut self, at: u64) -> io::Result<bool> {
        Ok(self.file.peek(at, 1 << 16)?.iter().all(|&byte| byte == 0))
    }
}

/// The description of a file, without its messages.
pub(crate) struct Outline {
    /// Its records of metadata, in their order.
    pub(crate) metadata: Vec<Metadata>,
    /// Whether it was finished.
    pub(crate) whole: bool,
    /// Bytes that are no records, if there are any.
    pub(crate) unread: Option<Unread>,
}

/// Reads the description of a file.
///
/// # Errors
/// The file cannot be read, or has too many records of metadata.
pub(super) fn outline(walk: &mut Walk) -> io::Result<Outline> {
    let (mut metadata, mut bytes, mut body) = (Vec::new(), 0, Vec::new());
    loop {
        match walk.next()? {
            Step::Record(span) if span.op == op::METADATA => {
                bytes += span.length;
                if bytes > MOST_DEFINITIONS || metadata.len() == MOST_METADATA {
                    let message = format!("has more than {} MB of metadata", MOST_DEFINITIONS >> 20);
                    return Err(io::Error::new(io::ErrorKind::InvalidData, message));
                }
                walk.body(span, &mut body)?;
                if let Ok(mcap::records::Record::Metadata(record)) = parse_record(op::METADATA, &body) {
                    metadata.push(record);
                }
            }
            Step::End { whole } => return Ok(Outline { metadata, whole, unread: walk.unread() }),
            _ => {}
        }
    }
}
