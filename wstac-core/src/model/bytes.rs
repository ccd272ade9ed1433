//! A file's bytes as its words, without a copy. This one cast takes unsafe code.
#![allow(unsafe_code)]

use super::file::ModelError;

/// Returns bytes as words, if the machine is little-endian and the bytes are aligned to four.
///
/// # Errors
/// Returns [`ModelError::Alignment`] if they are not, or if bytes are left over.
pub(super) fn words(bytes: &[u8]) -> Result<&[u32], ModelError> {
    // SAFETY: every four bytes are a u32, and unaligned parts are returned separately.
    let (before, words, rest) = unsafe { bytes.align_to::<u32>() };
    if cfg!(target_endian = "big") || !before.is_empty() {
        return Err(ModelError::Alignment);
    }
    if rest.is_empty() { Ok(words) } else { Err(ModelError::Alignment) }
}
