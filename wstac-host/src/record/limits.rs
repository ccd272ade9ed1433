//! Limits of what is kept in memory, whatever a file claims.

use std::fmt;

use crate::error::{Error, ErrorKind};

/// Most bytes of a message: of a frame with what stands beside it in its message.
pub(crate) const MOST_MESSAGE: u64 = 64 << 20;
/// Most bytes of a compressed chunk, before and after it is unpacked.
pub(crate) const MOST_PACKED: u64 = 72 << 20;
/// Most bytes of unpacked chunks that are kept, if a file is put in order.
pub(crate) const MOST_ROOM: u64 = 512 << 20;
/// Most bytes of all schemas and channels of a file, of all its metadata, and of one of them.
pub(crate) const MOST_DEFINITIONS: u64 = 4 << 20;
/// Most chunks whose places are kept.
pub(crate) const MOST_CHUNKS: usize = 1 << 20;
/// Most records of metadata that are read.
pub(crate) const MOST_METADATA: usize = 1 << 12;
/// Most messages of a file that is put in order, of which each takes 40 bytes: a sensor's for some hours.
pub(crate) const MOST_SORTED: usize = 1 << 21;
/// Most messages that wait for their checksum.
pub(crate) const MOST_PENDING: usize = 1 << 12;

/// Returns whether there is so much memory at this time.
pub(crate) fn has_memory(bytes: usize) -> bool {
    let mut room = Vec::<u8>::new();
    // The room is asked for, although nothing is written to it.
    std::hint::black_box(&mut room).try_reserve_exact(bytes).is_ok()
}

/// Refuses frames if there is no memory for this many of them.
///
/// # Errors
/// There is not so much memory. The error says how much is needed.
pub(crate) fn check_memory(subject: &dyn fmt::Display, frame_bytes: usize, frames: usize) -> Result<(), Error> {
    let needed = frame_bytes.saturating_mul(frames);
    if has_memory(needed) {
        return Ok(());
    }
    let (found, needed) = (frame_bytes >> 20, needed >> 20);
    let message = format_args!("has frames of {found} MB, which take {needed} MB of memory here: there is less");
    Err(Error::new(ErrorKind::Unsupported, subject, message))
}
