//! The search for the next record behind damage.

use mcap::records::op;

use super::shape::Around;
use super::{HEAD, MESSAGE_HEADER, Walk};
use crate::error::Error;
use crate::record::compression::Compression;
use crate::record::sums;

/// Bytes that are searched at a time for the next record.
const PIECE: usize = 1 << 15;

impl Walk {
    /// Returns whether a record follows that may stand behind a chunk.
    pub(super) fn follows(&mut self, end: u64) -> Result<bool, Error> {
        let span = self.shape_in(end, Around::File)?;
        Ok(span.is_some_and(|span| matches!(span.op, op::CHUNK | op::MESSAGE_INDEX | op::METADATA | op::DATA_END)))
    }

    /// Returns whether only zeros follow, which are reserved room.
    pub(super) fn is_empty_from(&mut self, mut at: u64) -> Result<bool, Error> {
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
    pub(super) fn resync(&mut self, from: u64) -> Result<u64, Error> {
        let chunk = self.around;
        let end = chunk.end().unwrap_or(self.end);
        let summary = self.summary.as_ref().filter(|_| self.outer.is_none());
        let chunks = summary.map_or(&[][..], |summary| &summary.chunks);
        let next = chunks.iter().map(|(place, _)| *place).find(|&place| place >= from && place < self.end);
        let end = next.map_or(end, |next| next.min(end)).max(from);
        // Codes of records that may stand here.
        let is_code = |op| matches!(op, op::HEADER | op::SCHEMA..=op::MESSAGE_INDEX | op::METADATA | op::DATA_END);
        self.search(from, end, chunk, is_code)
    }

    /// Returns the next place at which records certainly start again that stand behind a compressed chunk.
    pub(super) fn resync_behind(&mut self, from: u64, end: u64) -> Result<u64, Error> {
        // A compressed chunk may hold messages that were not changed by the compression.
        let is_code = |op| matches!(op, op::CHUNK | op::MESSAGE_INDEX | op::METADATA);
        self.search(from, end, Around::File, is_code)
    }

    /// Returns the next place with one of these codes at which records start.
    fn search(&mut self, from: u64, end: u64, chunk: Around, is_code: impl Fn(u8) -> bool) -> Result<u64, Error> {
        let mut at = from;
        loop {
            // A head starts with a byte that is not 0.
            at = self.file.next_data(at).max(at);
            if at >= end {
                return Ok(end);
            }
            let wanted = ((end - at).min(PIECE as u64) + HEAD) as usize;
            let piece = self.file.peek(at, wanted)?.to_vec();
            if piece.iter().all(|&byte| byte == 0) {
                at += piece.len() as u64;
                continue;
            }
            // Lengths are below 4 GiB.
            let is_head = |head: &[u8]| match head {
                [op, _, _, _, _, 0, 0, 0, 0] => is_code(*op),
                [op::CHUNK, _, _, _, _, 0xFF, 0xFF, 0xFF, 0xFF] => true,
                _ => false,
            };
            for (offset, _) in piece.windows(HEAD as usize).enumerate().filter(|(_, head)| is_head(head)) {
                let place = at + offset as u64;
                if place < end && self.is_anchor(place, chunk)? {
                    return Ok(place);
                }
            }
            if piece.len() <= HEAD as usize {
                return Ok(end);
            }
            at += (piece.len() as u64 - HEAD).max(1).min(end - at);
        }
    }

    /// Returns whether records certainly start at a place: a checksum, or three records one behind the other.
    fn is_anchor(&mut self, at: u64, chunk: Around) -> Result<bool, Error> {
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
            if at >= end || self.file.peek(at, 1 << 16)?.iter().all(|&byte| byte == 0) {
                return Ok(true);
            }
        }
        Ok(true)
    }
}
