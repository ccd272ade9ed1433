//! Four bytes a word, in any core's instructions: the odd ones of them in two lanes of 16 bits, and the words themselves.
#![allow(unsafe_code)]

use super::of_row;

/// Every second byte of a word.
const LANES: u32 = 0x00FF_00FF;
/// Words whose bytes' sums fit a lane: 257 of them just do.
const MOST_WORDS: usize = 256;

/// As [`super::plain`].
#[inline(always)]
pub(in super::super) fn sum(bytes: &[u8], bytes_per_row: usize, width: usize) -> u32 {
    bytes.chunks(bytes_per_row.max(1)).map(|row| of_run(row.get(..width).unwrap_or(row))).sum()
}

#[inline(always)]
fn of_run(bytes: &[u8]) -> u32 {
    // SAFETY: four bytes of any kind are a word.
    let (head, words, tail) = unsafe { bytes.align_to::<u32>() };
    let mut sum = of_row(head) + of_row(tail);
    for words in words.chunks(MOST_WORDS) {
        let (mut total, mut odd) = (0_u32, 0_u32);
        for &word in words {
            total = total.wrapping_add(word);
            odd += (word >> 8) & LANES;
        }
        // What is left without the odd bytes are the even ones, in lanes too: no carry of the total is missed.
        let even = total.wrapping_sub(odd << 8);
        sum += (even & 0xFFFF) + (even >> 16) + (odd & 0xFFFF) + (odd >> 16);
    }
    sum
}
