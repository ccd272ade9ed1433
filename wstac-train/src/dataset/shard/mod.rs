//! Shards of data sets: what a process stores of its slides or recordings, and the whole set of all of them.
//!
//! [`frames`] has those of a sweep over time, [`random`] those of random slides, and [`recorded`] those of recordings.
//! [`crate::shard`] has the file.

pub mod frames;
pub mod random;
pub mod recorded;

use wstac_core::model::file::INPUTS;

/// Returns the bytes of numbers, little-endian.
fn bytes_of(numbers: &[i16]) -> impl Iterator<Item = u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes())
}

/// Takes the numbers of a sample off the start of bytes; `None` if there are fewer.
fn numbers_of(bytes: &mut &[u8]) -> Option<Box<[i16; INPUTS]>> {
    let (numbers, rest) = bytes.split_at_checked(2 * INPUTS)?;
    *bytes = rest;
    let mut found = Box::new([0; INPUTS]);
    for (number, pair) in found.iter_mut().zip(numbers.as_chunks::<2>().0) {
        *number = i16::from_le_bytes(*pair);
    }
    Some(found)
}
