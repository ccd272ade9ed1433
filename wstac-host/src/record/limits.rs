//! Limits of what is kept in memory, whatever a file claims.

/// Most bytes of a message: of a frame with what stands beside it in its message.
pub(crate) const MOST_MESSAGE: u64 = 64 << 20;
/// Most bytes of a compressed chunk, before and after it is unpacked.
pub(crate) const MOST_PACKED: u64 = 72 << 20;
/// Most bytes of all schemas and channels of a file, of all its metadata, and of one of them.
pub(crate) const MOST_DEFINITIONS: u64 = 4 << 20;
/// Most chunks whose places are kept.
pub(crate) const MOST_CHUNKS: usize = 1 << 20;
/// Most records of metadata that are copied.
pub(crate) const MOST_METADATA: usize = 1 << 12;
/// Most messages that wait for their checksum.
pub(crate) const MOST_PENDING: usize = 1 << 12;
