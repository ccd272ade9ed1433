//! An MCAP file record by record, whole or not.
//!
//! The walk believes no length that it cannot check. A record must have the shape of its kind (`shape`). If it has not,
//! the walk goes on at the next place that has (`resync`): a chunk of the index, a checksum, or several records in a
//! row. The bytes between are reported. A chunk's records are read where they stand in the file, so that a chunk takes
//! no memory, and one that was never finished is read as far as it goes.
//!
//! The walk is our own, because it is this project's policy which parts of a damaged or unfinished recording are kept.

mod resync;
mod shape;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use crc32fast::Hasher;
use mcap::records::{MessageHeader, Record, op};
use mcap::write::Metadata;

use self::shape::{Around, ChunkHead, UNKNOWN};
use super::bytes::{FileBytes, HEAD};
use super::compression::Compression;
use super::file::Sensors;
use super::limits::{MOST_DEFINITIONS, MOST_MESSAGE, MOST_METADATA, MOST_PACKED};
use super::parse::parse_record;
use super::summary::{self, Summary};
use crate::error::Error;

/// Bytes of a message before its data.
pub(super) const MESSAGE_HEADER: u64 = 22;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WalkStep {
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
    /// The operation code of the record.
    pub(super) op: u8,
    /// The place of the operation code.
    pub(super) at: u64,
    /// Bytes of the record's body.
    pub(super) length: u64,
}

impl Span {
    /// Returns the place behind the record.
    pub(super) fn end(self) -> u64 {
        self.at + HEAD + self.length
    }
}

/// The verdict of a chunk's checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crc {
    /// The bytes are those that were written.
    Good,
    /// The bytes are not those that were written.
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

/// Reads a message's header and its data from a record's body; `None` if that is too short.
///
/// [`mcap::parse_record`] does the same, and slows down reading.
pub(super) fn message_of(body: &[u8]) -> Option<(MessageHeader, &[u8])> {
    let (channel, rest) = body.split_first_chunk()?;
    let (sequence, rest) = rest.split_first_chunk()?;
    let (logged, rest) = rest.split_first_chunk()?;
    let (published, data) = rest.split_first_chunk()?;
    let (channel_id, sequence) = (u16::from_le_bytes(*channel), u32::from_le_bytes(*sequence));
    let (log_time, publish_time) = (u64::from_le_bytes(*logged), u64::from_le_bytes(*published));
    Some((MessageHeader { channel_id, sequence, log_time, publish_time }, data))
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

/// A compressed chunk, so that it can be unpacked again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packed {
    /// The bytes of the file from here on that were compressed.
    content: u64,
    /// The place behind them.
    behind: u64,
    compression: Compression,
    /// The bytes that they are unpacked to.
    pub(super) unpacked: u64,
}

/// The place of a chunk that was unpacked.
#[derive(Clone, Copy, Debug)]
struct Outer {
    /// The place of the chunk in the file.
    at: u64,
    packed: Packed,
    /// The end of the file's records.
    end: u64,
    /// The bytes of the chunk if not all of them could be unpacked.
    unread: Option<Unread>,
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
    around: Around,
    /// The checksum's verdict on the chunk that the last record stands in, or that just ended.
    pub(super) crc: Crc,
    /// The end of the bytes that a chunk's checksum was made of.
    hashed: u64,
    /// The place of the chunk that was unpacked; `None` if the file itself is read.
    outer: Option<Outer>,
    /// The end of the bytes that were taken for a compressed chunk and were none.
    tried: u64,
    /// The compression of the first chunk; `None` if there is no chunk so far.
    pub(super) compression: Option<Compression>,
    /// Chunks that were finished with a checksum, and without one, so far.
    pub(super) crcs: [u64; 2],
    /// The checksum of the data so far, and its end.
    total: (Hasher, u64),
    /// Numbers of channels.
    channels: BTreeSet<u16>,
    /// Whether `wstac record` wrote the file. It writes no private records and no attachments.
    own: bool,
    /// The index at the file's end; `None` if it is damaged or missing.
    pub(super) summary: Option<Summary>,
    /// Whether the file starts as an MCAP file does.
    pub(super) has_magic: bool,
    /// All bytes that could not be read so far.
    pub(super) unread: Option<Unread>,
    /// Attachments and records of unknown kinds so far.
    pub(super) others: u64,
}

impl Walk {
    /// Opens a file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn open(path: &Path, mode: Mode) -> Result<Self, Error> {
        Self::of(FileBytes::open(path)?, mode)
    }

    fn of(mut file: FileBytes, mode: Mode) -> Result<Self, Error> {
        let has_magic = file.peek(0, mcap::MAGIC.len())? == mcap::MAGIC;
        let summary = summary::read(&mut file)?;
        let mut walk = Self {
            end: summary.as_ref().map_or(file.length(), |summary| summary.data_end),
            file,
            mode,
            at: mcap::MAGIC.len() as u64,
            around: Around::File,
            crc: Crc::Unknown,
            hashed: 0,
            outer: None,
            tried: 0,
            compression: None,
            crcs: [0; 2],
            total: (Hasher::new(), 0),
            channels: BTreeSet::new(),
            own: false,
            summary,
            has_magic,
            unread: None,
            others: 0,
        };
        if let Some(summary) = &walk.summary {
            let ids = summary.definitions.iter().filter(|(op, _)| *op == op::CHANNEL);
            walk.channels.extend(ids.filter_map(|(_, body)| body.first_chunk().map(|id| u16::from_le_bytes(*id))));
        }
        Ok(walk)
    }

    /// Notes that `wstac record` wrote the file, with these sensors.
    pub(super) fn set_own(&mut self, sensors: &Sensors) {
        self.own = true;
        self.channels.extend(sensors.channels());
    }

    /// Returns why a file with other first bytes is refused.
    pub(super) fn other_start(&mut self) -> Result<String, Error> {
        let found = self.file.peek(0, mcap::MAGIC.len())?.escape_ascii();
        Ok(format!("starts with \"{found}\", expected an MCAP file, which starts with \"\\x89MCAP0\""))
    }

    /// Returns the error about a file that no reader takes.
    pub(super) fn refused(&self, message: String) -> Error {
        self.file.refused(message)
    }

    /// Returns whether the file was finished: it ends as it should, or has its index.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn is_finished(&mut self) -> Result<bool, Error> {
        Ok(self.summary.is_some() || (self.outer.is_none() && summary::has_proper_end(&mut self.file)?))
    }

    /// Returns whether the last record stands in a chunk that was never finished, in a file without an end.
    pub(super) fn in_unfinished(&self) -> bool {
        let is_open = self.around == Around::Open || self.outer.is_some();
        is_open && self.summary.is_none()
    }

    /// Returns whether the last record stands in a chunk.
    pub(super) fn in_chunk(&self) -> bool {
        self.around != Around::File
    }

    /// Goes back to the start, to walk through the file once more.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn rewind(&mut self) -> Result<(), Error> {
        self.file.set_unpacked(None);
        *self = Self::of(self.file.clone(), self.mode)?;
        Ok(())
    }

    /// Returns the compressed chunk that the last record stands in.
    pub(super) fn packed(&self) -> Option<Packed> {
        self.outer.map(|outer| outer.packed)
    }

    /// Reads places of this unpacked chunk from now on, or of the file, in bytes with this verdict. Returns the chunk
    /// that was read before.
    pub(super) fn show(&mut self, chunk: Option<Vec<u8>>, crc: Crc) -> Option<Vec<u8>> {
        self.crc = crc;
        self.file.set_unpacked(chunk)
    }

    /// Unpacks a chunk.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn unpack_again(&mut self, packed: Packed) -> Result<Vec<u8>, Error> {
        let now = self.file.set_unpacked(None);
        let unpacked = self.unpacked(packed.content..packed.behind, packed.compression, 0);
        drop(self.file.set_unpacked(now));
        unpacked.map(|(bytes, ..)| bytes)
    }

    /// Reads a record's body.
    ///
    /// # Errors
    /// The file cannot be read, or the record is larger than any that is read.
    pub(super) fn body(&self, span: Span, into: &mut Vec<u8>) -> Result<(), Error> {
        if span.length > MOST_MESSAGE {
            let (found, most) = (span.length >> 20, MOST_MESSAGE >> 20);
            let message = format!("has a record of {found} MB at byte {}, expected at most {most} MB", span.at);
            return Err(self.refused(message));
        }
        self.file.read(span.at + HEAD, span.length as usize, into)
    }

    /// Returns the first bytes of a record's body: at most 64 KiB of them.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn start_of(&mut self, span: Span, count: usize) -> Result<&[u8], Error> {
        self.file.peek(span.at + HEAD, count.min(usize::try_from(span.length).unwrap_or(usize::MAX)))
    }

    /// Returns the header of a message; `None` if its record is too short.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn header_of(&mut self, span: Span) -> Result<Option<MessageHeader>, Error> {
        Ok(message_of(self.start_of(span, MESSAGE_HEADER as usize)?).map(|(header, _)| header))
    }

    /// Returns the checksum of bytes of the file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn hash(&self, from: u64, to: u64) -> Result<u32, Error> {
        Ok(self.file.hash(from, to)?.finalize())
    }

    /// Returns the message records between two places, or `None` if there is anything else.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn messages(&mut self, from: u64, to: u64, most: usize) -> Result<Option<Vec<Span>>, Error> {
        let (mut at, mut found) = (from, Vec::new());
        while at < to {
            let Some((op, length)) = self.file.head(at)? else { return Ok(None) };
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
    pub(super) fn check_total(&mut self) -> Result<Option<bool>, Error> {
        let (hasher, at) = &mut self.total;
        if *at > self.at {
            return Ok(None);
        }
        let stated = self.file.peek(self.at + HEAD, 4)?.first_chunk().map_or(0, |crc| u32::from_le_bytes(*crc));
        if stated == 0 {
            return Ok(None);
        }
        hasher.combine(&self.file.hash(*at, self.at)?);
        *at = self.at;
        Ok(Some(stated == hasher.clone().finalize()))
    }

    /// Returns the next step.
    ///
    /// # Errors
    /// The file cannot be read, or a chunk is compressed in a way that this build does not read.
    pub(super) fn next(&mut self) -> Result<WalkStep, Error> {
        if !self.in_chunk() {
            self.crc = Crc::Unknown;
            if let Some(outer) = self.outer.take() {
                self.file.set_unpacked(None);
                (self.at, self.end) = (outer.packed.behind, outer.end);
                if let Some(unread) = outer.unread {
                    return Ok(WalkStep::Damage(self.note_unread(unread)));
                }
            }
        }
        loop {
            if self.around.end().is_some_and(|end| self.at >= end) {
                self.around = Around::File;
                return Ok(WalkStep::ChunkEnd);
            }
            let start = self.at;
            if start == 8 && !self.has_magic && !self.goes_on() {
                return Ok(WalkStep::End { whole: false });
            }
            let Some(span) = self.shape(start)? else {
                if let Some(step) = self.leave(start)? {
                    return Ok(step);
                }
                continue;
            };
            match span.op {
                op::CHUNK | op::DATA_END if self.in_chunk() => {
                    // The chunk was never finished, or it is a damaged one whose end is not known.
                    self.around = Around::File;
                    return Ok(WalkStep::ChunkEnd);
                }
                op::CHUNK => self.enter(span)?,
                op::DATA_END => return Ok(WalkStep::End { whole: summary::has_proper_end(&mut self.file)? }),
                _ => {
                    self.at = span.end();
                    self.others += u64::from(span.op == op::ATTACHMENT || span.op >= UNKNOWN);
                    if span.op == op::CHANNEL {
                        let id = self.start_of(span, 2)?.first_chunk().map_or(0, |id| u16::from_le_bytes(*id));
                        self.channels.insert(id);
                    }
                    return Ok(WalkStep::Record(span));
                }
            }
        }
    }

    /// Leaves bytes that are no record. It returns `None` if the walk goes on behind them without a word.
    fn leave(&mut self, start: u64) -> Result<Option<WalkStep>, Error> {
        if start >= self.end && self.summary.is_some() && !self.in_chunk() {
            // The record at the end of the data is damaged, and nothing else.
            return Ok(Some(WalkStep::End { whole: false }));
        }
        if start >= self.end || self.is_empty_from(start)? {
            let is_open = self.in_chunk();
            self.around = Around::File;
            return Ok(Some(if is_open { WalkStep::ChunkEnd } else { WalkStep::End { whole: false } }));
        }
        let next = if self.goes_on() { self.resync(start + 1)? } else { self.end };
        self.at = next;
        let (mut behind, mut others) = (start, 0);
        while behind < next
            && let Some((op, length)) = self.file.head(behind)?
            && (op >= UNKNOWN || (op == op::ATTACHMENT && !self.in_chunk()))
        {
            (behind, others) = (behind.saturating_add(length).saturating_add(HEAD), others + 1);
        }
        if behind == next && next < self.end {
            self.others += others;
            return Ok(None);
        }
        if let Some(outer) = &mut self.outer {
            // The bytes of a compressed chunk are those in the file. The end of what was unpacked is not known to be
            // damaged if the chunk was never finished.
            let whole = Unread { at: outer.at, bytes: outer.packed.behind.saturating_sub(outer.at), damaged: true };
            let unread = *outer.unread.get_or_insert(whole);
            return Ok(Some(WalkStep::Damage(unread)));
        }
        // A file that was cut off ends with a part of a record.
        let cut = next == self.end && self.summary.is_none() && self.is_cut_off(start)?;
        Ok(Some(WalkStep::Damage(self.note_unread(Unread { at: start, bytes: next - start, damaged: !cut }))))
    }

    /// Adds to the bytes that could not be read, and returns what was added.
    fn note_unread(&mut self, unread: Unread) -> Unread {
        let all = self.unread.get_or_insert(Unread { bytes: 0, ..unread });
        all.bytes = all.bytes.saturating_add(unread.bytes);
        all.damaged |= unread.damaged;
        unread
    }

    /// Returns whether the walk goes on behind damage.
    fn goes_on(&self) -> bool {
        matches!(self.mode, Mode::Survey | Mode::Salvage)
    }

    /// Starts to read a chunk's records.
    fn enter(&mut self, span: Span) -> Result<(), Error> {
        let Some(head) = self.chunk_head(span.at)? else { return Ok(()) };
        let ChunkHead { content, stored, compression } = head;
        self.compression.get_or_insert(compression);
        self.at = content;
        let end = stored.map(|stored| content.saturating_add(stored).min(self.end));
        let crc = self.file.peek(span.at + HEAD + 24, 4)?.first_chunk().map_or(0, |crc| u32::from_le_bytes(*crc));
        let [with, without] = &mut self.crcs;
        *(if crc == 0 { without } else { with }) += u64::from(end.is_some());
        if let Some(end) = end
            && (self.mode == Mode::Outline || (self.mode == Mode::Survey && self.follows(end)?))
        {
            self.at = end;
            return Ok(());
        }
        if compression != Compression::None {
            return self.unpack(span.at, head, end, crc);
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
        self.around = end.map_or(Around::Open, Around::Until);
        Ok(())
    }

    /// Unpacks a chunk, and reads that in place of the file.
    ///
    /// If it is damaged, its length may be, too. Then it ends at the next record that certainly is one.
    fn unpack(&mut self, at: u64, head: ChunkHead, end: Option<u64>, crc: u32) -> Result<(), Error> {
        let ChunkHead { content, compression, .. } = head;
        let mut behind = end.unwrap_or(self.end).max(content);
        let packed_bytes = behind - content;
        if packed_bytes > MOST_PACKED && end.is_some() && !self.goes_on() {
            let (found, most) = (packed_bytes >> 20, MOST_PACKED >> 20);
            let message = format!("has a compressed chunk of {found} MB at byte {at}, expected at most {most} MB");
            return Err(self.refused(message));
        }
        // Bytes are unpacked once: a chunk in a damaged one ends before the next one.
        let is_known = end.is_some() && packed_bytes <= MOST_PACKED && content >= self.tried;
        let is_known = is_known || !self.goes_on();
        let mut unpacked = if is_known { Some(self.unpacked(content..behind, compression, crc)?) } else { None };
        if !matches!(unpacked, Some((_, Crc::Good | Crc::Unknown, true))) && self.goes_on() {
            self.tried = self.tried.max(behind);
            let next = self.resync_behind(content, behind)?;
            if next < behind || unpacked.is_none() {
                behind = next;
                drop(unpacked.take());
                unpacked = Some(self.unpacked(content..behind, compression, crc)?);
            }
        }
        if self.mode == Mode::Strict {
            let found = self.file.hash(content, behind)?;
            self.add_to_total(content, behind, &found)?;
        }
        let Some((bytes, crc, is_all)) = unpacked else { return Ok(()) };
        // A chunk that the end of the file cuts off was never finished.
        let is_open = end.is_none() && behind >= self.end && self.summary.is_none();
        let is_cut = is_open && !summary::ends_with_magic(&mut self.file)?;
        self.crc = if end.is_none() && crc == Crc::Bad { Crc::Unknown } else { crc };
        let is_whole = is_all && crc != Crc::Bad;
        let unread = (!is_whole).then_some(Unread { at, bytes: behind - at, damaged: !is_cut });
        let packed = Packed { content, behind, compression, unpacked: bytes.len() as u64 };
        self.outer = Some(Outer { at, packed, end: self.end, unread });
        (self.at, self.end) = (0, packed.unpacked);
        self.around = Around::Until(self.end);
        self.file.set_unpacked(Some(bytes));
        Ok(())
    }

    /// Returns what a chunk's bytes are unpacked to, the verdict of its checksum, and whether that is all.
    fn unpacked(&self, of: Range<u64>, compression: Compression, crc: u32) -> Result<(Vec<u8>, Crc, bool), Error> {
        let mut packed = Vec::new();
        self.file.read(of.start, (of.end - of.start).min(MOST_PACKED) as usize, &mut packed)?;
        let unpacked = compression.unpack(&packed, MOST_PACKED as usize);
        let (unpacked, is_all) = unpacked.map_err(|error| self.file.failed(error))?;
        let found = Crc::of(crc, crc32fast::hash(&unpacked));
        Ok((unpacked, if is_all { found } else { Crc::Bad }, is_all))
    }

    /// Adds a chunk's checksum to that of all data, with the bytes before the chunk.
    fn add_to_total(&mut self, content: u64, end: u64, of_chunk: &Hasher) -> Result<(), Error> {
        if self.mode == Mode::Strict {
            let (total, at) = &mut self.total;
            total.combine(&self.file.hash(*at, content)?);
            total.combine(of_chunk);
            *at = end;
        }
        Ok(())
    }
}

/// The description of a file, without its messages.
pub(crate) struct Outline {
    /// The file's records of metadata, in their order.
    pub(crate) metadata: Vec<Metadata>,
    /// Whether it was finished.
    pub(crate) whole: bool,
    /// Bytes that are no records, if there are any.
    pub(crate) unread: Option<Unread>,
    /// Whether all messages stand in chunks that have checksums.
    pub(crate) has_crcs: bool,
}

/// Reads the description of a file.
///
/// # Errors
/// The file cannot be read, or has too many records of metadata.
pub(super) fn outline(walk: &mut Walk) -> Result<Outline, Error> {
    let (mut metadata, mut bytes, mut body) = (Vec::new(), 0_u64, Vec::new());
    let mut is_outside = false;
    loop {
        match walk.next()? {
            WalkStep::Record(span) if span.op == op::METADATA => {
                bytes = bytes.saturating_add(span.length);
                if bytes > MOST_DEFINITIONS || metadata.len() == MOST_METADATA {
                    return Err(walk.refused(format!("has more than {} MB of metadata", MOST_DEFINITIONS >> 20)));
                }
                walk.body(span, &mut body)?;
                if let Ok(Record::Metadata(record)) = parse_record(op::METADATA, &body) {
                    metadata.push(record);
                }
            }
            WalkStep::Record(span) if span.op == op::MESSAGE => is_outside |= !walk.in_chunk(),
            WalkStep::End { whole } => {
                let has_crcs = !is_outside && walk.crcs[1] == 0;
                return Ok(Outline { metadata, whole, unread: walk.unread, has_crcs });
            }
            _ => {}
        }
    }
}
