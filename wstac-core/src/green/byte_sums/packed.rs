//! Sums four bytes per instruction: USADA8 adds the distances of four bytes from zero.
//!
//! Words are loaded where they lie: aligned, or at both ends of a run unaligned. That needs memory that allows it, as
//! RAM does unless `CCR.UNALIGN_TRP` is set.
#![allow(unsafe_code)]

use core::ops::Range;

use super::{SideBySide, Strip};
use crate::params::COLUMNS;

/// The number of words of a group, which one instruction loads.
const GROUP: usize = 4;
/// The number of groups that are written out.
const MOST_GROUPS: usize = 8;
/// The width of a row in bytes that has no more words.
pub(super) const MOST_WIDTH: usize = 4 * GROUP * MOST_GROUPS;

/// The input of the kernel: blocks of bytes, one for each corner.
#[repr(C)]
struct Work {
    corners: *const [u16; 2],
    /// The first row's byte in column 0.
    first: *const u8,
    /// The distance of a corner's sum from the corner behind it.
    to_sum: usize,
    end: *const [u16; 2],
    rows: usize,
    width: usize,
    bytes_per_row: usize,
}

#[inline(never)]
pub(super) fn of_strip(Strip(block): Strip<'_, MOST_WIDTH>) -> u32 {
    let mut sum = [0];
    let bytes = (block.bytes(), block.width(), block.rows(), block.bytes_per_row());
    // SAFETY: a strip has so many rows of so many bytes, and its width is in the range.
    unsafe { start(&[[0; 2]], bytes, &mut sum) };
    let [sum] = sum;
    sum
}

#[inline(always)]
pub(super) fn add_to(SideBySide { band, corners, width }: SideBySide<'_>, sums: &mut [u32; COLUMNS]) {
    // SAFETY: every block lies in the band, which has so many rows, and their width is in the range.
    unsafe { start(corners, (band.bytes(), width, band.rows(), band.bytes_per_row()), sums) };
}

/// Adds `rows` rows of `width` bytes to a sum for each corner, from the corner's column on.
///
/// # Safety
/// All these bytes are there. There is at least one row. The width is [`Strip::LEAST`] to [`MOST_WIDTH`]. With more
/// rows than one, `bytes_per_row` is a multiple of 4.
#[inline(always)]
unsafe fn start<const N: usize>(
    corners: &[[u16; 2]; N],
    (bytes, width, rows, bytes_per_row): (&[u8], usize, usize, usize),
    sums: &mut [u32; N],
) {
    let Range { start, end } = corners.as_ptr_range();
    let to_sum = (sums.as_mut_ptr() as usize).wrapping_sub(start as usize).wrapping_sub(size_of::<[u16; 2]>());
    let work = Work { corners: start, first: bytes.as_ptr(), to_sum, end, rows, width, bytes_per_row };
    // SAFETY: it reads the first four bytes of each run, the last four, and the aligned words in it. It writes the
    // sums, which have the size and the number of the corners.
    unsafe { add(&raw const work) };
}

/// Adds blocks to their sums. A row of 50 bytes takes 24 instructions, or 27 if it begins one byte behind a word. What
/// depends on the place of a run's first byte among the bytes of its word is computed once for neighbors that share it.
///
/// # Safety
/// As [`start`] says. The sums are behind the corners, or in front of them, at the distance that the work says.
#[unsafe(naked)]
unsafe extern "C" fn add(work: *const Work) {
    core::arch::naked_asm!(
        "push.w {{r4, r5, r6, r7, r8, r9, r10, r11, lr}}",
        "ldm.w r0, {{r2, r3, r4, r5, r6, r7, r8}}",
        // Two places for addresses; then the work.
        "push.w {{r0, r1, r2, r3, r4, r5, r6, r7, r8}}",
        "mov r0, r3",
        "mov.w r12, #0",
        // No place among the bytes of a word is known yet.
        "ldrh r9, [r2]",
        "add r9, r3",
        "add r9, r9, #1",
        "2:",
        "ldrh r3, [r2], #4",
        "str r2, [sp, #8]",
        "add r0, r3",
        // The first aligned byte, if the place is that of the run before.
        "sub r0, r9",
        "tst r0, #3",
        "bne 30f",
        "3:",
        "ldr r4, [sp, #16]",
        "ldr.w lr, [sp, #24]",
        "ldr r8, [r2, r4]",
        // A row: bytes of both ends, those of them that did not fit, words beyond whole groups, groups.
        "4:",
        "ldr r2, [r0, r9]",
        "ldr r3, [r0, r10]",
        "sel r2, r2, r3",
        "bic r2, r2, r1",
        "usada8 r8, r2, r12, r8",
        "bx r6",
        ".balign 4",
        "7:",
        "ldrb.w r2, [r0, r7]",
        "usada8 r8, r2, r12, r8",
        "ldr.w pc, [sp, #4]",
        "ldrh.w r2, [r0, r7]",
        "usada8 r8, r2, r12, r8",
        "ldr.w pc, [sp, #4]",
        "5:",
        "ldr.w r2, [r0], #4",
        "usada8 r8, r2, r12, r8",
        "ldr.w pc, [sp]",
        "nop.w",
        "nop.w",
        "ldrd r2, r3, [r0], #8",
        "usada8 r8, r2, r12, r8",
        "usada8 r8, r3, r12, r8",
        "ldr.w pc, [sp]",
        "nop.w",
        "ldm.w r0!, {{r2, r3, r4}}",
        "usada8 r8, r2, r12, r8",
        "usada8 r8, r3, r12, r8",
        "usada8 r8, r4, r12, r8",
        "ldr.w pc, [sp]",
        ".rept {most}",
        "ldm.w r0!, {{r2, r3, r4, r5}}",
        "usada8 r8, r2, r12, r8",
        "usada8 r8, r3, r12, r8",
        "usada8 r8, r4, r12, r8",
        "usada8 r8, r5, r12, r8",
        ".endr",
        "6:",
        "add r0, r11",
        "subs lr, #1",
        "bne 4b",
        // The sum, and the next run.
        "ldrd r2, r0, [sp, #8]",
        "ldrd r4, r3, [sp, #16]",
        "str r8, [r2, r4]",
        "cmp r2, r3",
        "bne 2b",
        "add sp, #36",
        "pop.w {{r4, r5, r6, r7, r8, r9, r10, r11, pc}}",
        // The bytes in front of the first aligned word, the words, the bytes behind.
        "30:",
        "add r0, r9",
        "rsb r9, r0, #0",
        "and r9, r9, #3",
        "add r0, r9",
        "ldrd r3, r11, [sp, #28]",
        "sub r3, r9",
        "lsr r4, r3, #2",
        "and r3, r3, #3",
        "lsl r7, r4, #2",
        "sub r11, r7",
        "add r10, r7, r3",
        "sub r10, r10, #4",
        // Of the first four bytes those in front are selected, and else of the last four. The mask is of those that are
        // neither in front nor behind.
        "mov r5, #1",
        "lsl r5, r5, r9",
        "sub r5, r5, #1",
        "lsl r5, r5, #16",
        "msr APSR_g, r5",
        "mvn r8, #0",
        "lsl r5, r9, #3",
        "lsl r1, r8, r5",
        "lsl r5, r3, #3",
        "lsr r5, r8, r5",
        "and r1, r1, r5",
        "add r2, r9, r3",
        "rsb r9, r9, #0",
        // The places where a row comes in: five instructions of four bytes each for a group, and for a rest of words.
        "lsr r5, r4, #2",
        "add r5, r5, r5, lsl #2",
        "adr r6, 6b",
        "sub r6, r6, r5, lsl #2",
        "orr r6, r6, #1",
        "and r4, r4, #3",
        "cbz r4, 31f",
        "str r6, [sp]",
        "add r4, r4, r4, lsl #2",
        "adr r6, 5b",
        "sub r6, #20 - 1",
        "add r6, r6, r4, lsl #2",
        // Three instructions for a byte or two of those behind, if both ends have more than four.
        "31:",
        "subs r2, r2, #5",
        "blt 32f",
        "str r6, [sp, #4]",
        "add r2, r2, r2, lsl #1",
        "adr r6, 7b",
        "add r6, r6, r2, lsl #2",
        "orr r6, r6, #1",
        "32:",
        "ldr r2, [sp, #8]",
        "b 3b",
        most = const MOST_GROUPS,
    );
}
