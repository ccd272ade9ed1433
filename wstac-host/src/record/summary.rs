//! The index at the end of a recording that was finished.

use std::collections::BTreeMap;

use mcap::records::{Record, op};

use super::bytes::{FileBytes, HEAD};
use super::limits::{MOST_CHUNKS, MOST_DEFINITIONS};
use crate::error::Error;

/// Bytes of the record at the end of the data.
pub(super) const DATA_END: u64 = HEAD + 4;
/// Bytes of the footer and of the magic at the end.
const END: u64 = HEAD + 20 + mcap::MAGIC.len() as u64;

/// The statements of a file's end about the rest.
#[derive(Debug, Default)]
pub(super) struct Summary {
    /// The place of the record at the end of the data.
    pub(super) data_end: u64,
    /// The places of chunks, in their order, and the bytes of each with its head.
    pub(super) chunks: Vec<(u64, u64)>,
    /// Schemas and channels: operation codes and bodies.
    pub(super) definitions: Vec<(u8, Vec<u8>)>,
    /// The number of messages of each channel, if it is known.
    pub(super) messages: Option<BTreeMap<u16, u64>>,
}

/// Returns whether a file ends as it should: with a footer and the magic bytes once more.
///
/// # Errors
/// The file cannot be read.
pub(super) fn has_proper_end(file: &mut FileBytes) -> Result<bool, Error> {
    let Some(footer) = file.length().checked_sub(END) else { return Ok(false) };
    let tail = file.peek(footer, END as usize)?;
    Ok(tail.first() == Some(&op::FOOTER) && tail.ends_with(mcap::MAGIC))
}

/// Returns whether a file ends with the magic bytes.
///
/// # Errors
/// The file cannot be read.
pub(super) fn ends_with_magic(file: &mut FileBytes) -> Result<bool, Error> {
    let magic = mcap::MAGIC.len();
    let Some(at) = file.length().checked_sub(magic as u64) else { return Ok(false) };
    Ok(file.peek(at, magic)? == mcap::MAGIC)
}

/// Reads the index; `None` if it is damaged or missing.
///
/// # Errors
/// The file cannot be read.
pub(super) fn read(file: &mut FileBytes) -> Result<Option<Summary>, Error> {
    if !has_proper_end(file)? {
        return Ok(None);
    }
    let footer = file.length() - END;
    let tail = file.peek(footer, END as usize)?.to_vec();
    let Some((start, _)) = tail.get(HEAD as usize..).and_then(<[u8]>::split_first_chunk) else { return Ok(None) };
    let start = u64::from_le_bytes(*start);
    // The checksum covers the index, and the footer up to the checksum itself.
    let (of_footer, crc) = tail.split_at(END as usize - mcap::MAGIC.len() - 4);
    let crc = crc.first_chunk().map_or(0, |crc| u32::from_le_bytes(*crc));
    if start < DATA_END + mcap::MAGIC.len() as u64 || start > footer {
        return Ok(None);
    }
    if crc != 0 {
        let mut hasher = file.hash(start, footer)?;
        hasher.update(of_footer);
        if hasher.finalize() != crc {
            return Ok(None);
        }
    }
    let mut summary = Summary { data_end: start - DATA_END, ..Summary::default() };
    let (mut at, mut bytes) = (start, 0_u64);
    let mut body = Vec::new();
    while at < footer {
        let Some((code, length)) = file.head(at)? else { return Ok(None) };
        if length > footer - at - HEAD.min(footer - at) {
            return Ok(None);
        }
        let wanted = matches!(code, op::SCHEMA | op::CHANNEL | op::STATISTICS | op::CHUNK_INDEX);
        if wanted {
            if length > MOST_DEFINITIONS {
                return Ok(None);
            }
            file.read(at + HEAD, length as usize, &mut body)?;
        }
        match code {
            op::SCHEMA | op::CHANNEL => {
                bytes = bytes.saturating_add(length);
                if bytes > MOST_DEFINITIONS {
                    return Ok(None);
                }
                summary.definitions.push((code, body.clone()));
            }
            op::STATISTICS => {
                if let Ok(Record::Statistics(statistics)) = mcap::parse_record(code, &body) {
                    summary.messages = Some(statistics.channel_message_counts);
                }
            }
            op::CHUNK_INDEX if summary.chunks.len() < MOST_CHUNKS => {
                // Two times, then the place and the length.
                let number = |at: usize| body.get(at..).and_then(<[u8]>::first_chunk).map(|n| u64::from_le_bytes(*n));
                if let (Some(place), Some(length)) = (number(16), number(24)) {
                    summary.chunks.push((place, length));
                }
            }
            _ => {}
        }
        at += HEAD + length;
    }
    summary.chunks.sort_unstable();
    Ok(Some(summary))
}
