//! The shapes of records: what stands at a place of a file, if it can be believed.

use mcap::records::op;

use super::{HEAD, MESSAGE_HEADER, Span, Walk};
use crate::error::Error;
use crate::record::compression::Compression;
use crate::record::limits::{MOST_DEFINITIONS, MOST_MESSAGE};
use crate::record::parse::fits;
use crate::record::summary::{self, DATA_END};

/// Bytes of a chunk's header whose compression has an empty name.
pub(super) const CHUNK_HEADER: u64 = 40;
/// Most bytes of the name of a compression, and of the size behind it.
const LONGEST_NAME: usize = 4;

/// The first operation code that MCAP gives no meaning.
pub(super) const UNKNOWN: u8 = 0x10;

#[derive(Clone, Copy, Debug)]
pub(super) struct ChunkHead {
    /// The place of its records, or of what they were compressed to.
    pub(super) content: u64,
    /// Bytes there; `None` if the chunk was never finished.
    pub(super) stored: Option<u64>,
    pub(super) compression: Compression,
}

/// The surroundings of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Around {
    /// The file itself.
    File,
    /// A chunk that was never finished.
    Open,
    /// A chunk whose records end here.
    Until(u64),
}

impl Around {
    /// Returns the end of the chunk, if it is known.
    pub(super) fn end(self) -> Option<u64> {
        match self {
            Self::Until(end) => Some(end),
            Self::File | Self::Open => None,
        }
    }
}

impl Walk {
    /// Returns whether a record starts here that is longer than the file.
    pub(super) fn is_cut_off(&mut self, at: u64) -> Result<bool, Error> {
        let left = self.file.length().saturating_sub(at);
        if left < HEAD {
            return Ok(true);
        }
        let Some((op, length)) = self.file.head(at)? else { return Ok(true) };
        let most = if op == op::MESSAGE { MOST_MESSAGE } else { MOST_DEFINITIONS };
        let ends = summary::ends_with_magic(&mut self.file)?;
        Ok(op > 0 && op < op::DATA_END && length > left - HEAD && length <= most && !ends)
    }

    /// Returns the record at a place if it has the shape of its kind.
    pub(super) fn shape(&mut self, at: u64) -> Result<Option<Span>, Error> {
        self.shape_in(at, self.around)
    }

    /// Returns the record at a place if it has the shape of its kind. `chunk` is what it stands in.
    pub(super) fn shape_in(&mut self, at: u64, chunk: Around) -> Result<Option<Span>, Error> {
        let limit = chunk.end().unwrap_or(self.end);
        if matches!(chunk, Around::File) && self.indexed(at).is_some() {
            // The index knows better than a damaged code.
            return Ok(self.chunk_head(at)?.map(|_| Span { op: op::CHUNK, at, length: CHUNK_HEADER - HEAD }));
        }
        let Some((op, length)) = self.file.head(at)? else { return Ok(None) };
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
            // A reader of whole files reports a message that is too long itself.
            op::MESSAGE => length >= MESSAGE_HEADER && (length <= MOST_MESSAGE || !self.goes_on()),
            op::SCHEMA | op::CHANNEL => self.fits(op, at, length)?,
            op::METADATA => !inside && self.fits(op, at, length)?,
            op::HEADER => at == mcap::MAGIC.len() as u64 && self.fits(op, at, length)?,
            op::MESSAGE_INDEX => {
                let count = self.file.peek(at + HEAD + 2, 4)?.first_chunk().map(|count| u32::from_le_bytes(*count));
                !inside && length >= 6 && count.is_some_and(|count| u64::from(count) == length - 6)
            }
            op::ATTACHMENT => !inside && !self.own,
            // Records of later versions of MCAP, and private ones.
            UNKNOWN.. => !self.goes_on() || (!self.own && op >= 0x80),
            _ => false,
        };
        Ok(has_shape.then_some(Span { op, at, length }))
    }

    fn fits(&self, op: u8, at: u64, length: u64) -> Result<bool, Error> {
        if length > MOST_DEFINITIONS {
            return Ok(false);
        }
        let mut body = Vec::new();
        self.file.read(at + HEAD, length as usize, &mut body)?;
        Ok(fits(op, &body))
    }

    /// Returns whether the index or the footer follows the record at the end of the data.
    pub(super) fn is_end(&mut self, at: u64) -> Result<bool, Error> {
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
    pub(super) fn chunk_head(&mut self, at: u64) -> Result<Option<ChunkHead>, Error> {
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
        // An index that says more than the file has is none.
        let of_index = indexed.and_then(|indexed| at.checked_add(indexed)).filter(|end| *end <= self.end);
        if let Some(stored) = of_index.and_then(|end| end.checked_sub(content)) {
            return Ok(head(Some(stored)));
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
}
