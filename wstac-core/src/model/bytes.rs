//! A file's bytes as its words, without a copy: the one cast that takes unsafe code.
#![allow(unsafe_code)]

use super::file::ModelError;

/// The words that bytes are, on a little-endian machine and aligned to four.
///
/// # Errors
/// [`ModelError::Alignment`] where they are not, or where bytes are left over.
pub(super) fn words(bytes: &[u8]) -> Result<&[u32], ModelError> {
    // SAFETY: every four bytes are a u32, and the parts that are not aligned are given separately.
    let (before, words, rest) = unsafe { bytes.align_to::<u32>() };
    if cfg!(target_endian = "big") || !before.is_empty() {
        return Err(ModelError::Alignment);
    }
    if rest.is_empty() { Ok(words) } else { Err(ModelError::Alignment) }
}
