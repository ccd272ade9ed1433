//! Counts with their nouns, as messages write them.

use std::fmt::Display;

/// Returns a count with its noun, which ends in "s" unless the count is 1.
///
/// ```
/// use wstac_host::plural::counted;
///
/// assert_eq!(counted(1, "frame"), "1 frame");
/// assert_eq!(counted(0, "frame"), "0 frames");
/// ```
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    let plural = if count == N::from(1) { "" } else { "s" };
    format!("{count} {noun}{plural}")
}
