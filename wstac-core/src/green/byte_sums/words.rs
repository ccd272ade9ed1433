//! Sums four bytes per word, in instructions that every core has.
//!
//! The words themselves are added up, and every second byte of them in two lanes of 16 bits. The rest of the total is
//! the other bytes, in lanes too.
#![allow(unsafe_code)]

use super::{Strip, of_run};

/// A mask of every second byte of a word.
const LANES: u32 = 0x00FF_00FF;
/// The number of words whose bytes' sums fit a lane: 257 of them just do.
const MOST_WORDS: usize = 256;
/// The number of words that are written out, for fewer iterations of the loop.
const GROUP: usize = 4;
/// The width of a row in bytes that has no more words.
pub(super) const MOST_WIDTH: usize = 4 * MOST_WORDS;

#[inline(never)]
pub(super) fn of_strip(Strip(block): Strip<'_, MOST_WIDTH>) -> u32 {
    let mut row = block.bytes().as_ptr();
    let head = row.align_offset(4);
    let words = (block.width() - head) / 4;
    let tail = (block.width() - head) % 4;
    let (mut sum, mut total, mut odd, mut room) = (0, 0_u32, 0_u32, MOST_WORDS);
    for _ in 0..block.rows() {
        // SAFETY: so many rows are there; each has so many bytes, then words that are aligned, then bytes.
        let (before, inner, behind) = unsafe {
            #[expect(clippy::cast_ptr_alignment, reason = "it is behind the head")]
            let first = row.add(head).cast::<u32>();
            (
                core::slice::from_raw_parts(row, head),
                core::slice::from_raw_parts(first, words),
                core::slice::from_raw_parts(first.add(words).cast::<u8>(), tail),
            )
        };
        if room < words {
            sum += bytes_of(total, odd);
            (total, odd, room) = (0, 0, MOST_WORDS);
        }
        room -= words;
        sum += of_run(before) + of_run(behind);
        (total, odd) = add(inner, total, odd);
        row = row.wrapping_add(block.bytes_per_row());
    }
    sum + bytes_of(total, odd)
}

/// Adds words to a total and to the lanes of their odd bytes.
#[inline(always)]
fn add(words: &[u32], total: u32, odd: u32) -> (u32, u32) {
    let (groups, left) = words.as_chunks::<GROUP>();
    left.iter().fold(add_groups(groups, total, odd), |(total, odd), &word| add_word(word, total, odd))
}

#[inline(always)]
fn add_word(word: u32, total: u32, odd: u32) -> (u32, u32) {
    (total.wrapping_add(word), odd + ((word >> 8) & LANES))
}

#[cfg(not(all(target_arch = "arm", not(thumb2))))]
#[inline(always)]
fn add_groups(groups: &[[u32; GROUP]], total: u32, odd: u32) -> (u32, u32) {
    groups
        .iter()
        .fold((total, odd), |sums, group| group.iter().fold(sums, |(total, odd), &word| add_word(word, total, odd)))
}

/// Adds groups of words on a Cortex-M0. It takes 22 instructions per group instead of the 35 that a compiler finds.
#[cfg(all(target_arch = "arm", not(thumb2)))]
#[inline(always)]
fn add_groups(groups: &[[u32; GROUP]], mut total: u32, mut odd: u32) -> (u32, u32) {
    let range = groups.as_ptr_range();
    if !groups.is_empty() {
        // SAFETY: the code reads the groups, of which there is at least one.
        unsafe {
            core::arch::asm!(
                "2:",
                ".rept {group}",
                "ldm {at}!, {{r1}}",
                "adds {total}, {total}, r1",
                "lsrs r1, r1, #8",
                "ands r1, {lanes}",
                "adds {odd}, {odd}, r1",
                ".endr",
                "cmp {at}, {end}",
                "bne 2b",
                group = const GROUP,
                at = inout(reg) range.start => _,
                end = in(reg) range.end,
                lanes = in(reg) LANES,
                total = inout(reg) total,
                odd = inout(reg) odd,
                out("r1") _,
                options(readonly, nostack),
            );
        }
    }
    (total, odd)
}

/// Returns the sum of the bytes of words from their total and lanes. No carry of the total is missed: without the odd
/// bytes it is below 2^32.
fn bytes_of(total: u32, odd: u32) -> u32 {
    let even = total.wrapping_sub(odd << 8);
    (even & 0xFFFF) + (even >> 16) + (odd & 0xFFFF) + (odd >> 16)
}
