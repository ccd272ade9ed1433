//! Sums four bytes per instruction: USADA8 adds the distances of four bytes from zero.
//!
//! Words are loaded where they lie: aligned, or at both ends of a run unaligned. That needs memory that allows it, as
//! RAM does unless `CCR.UNALIGN_TRP` is set.
#![allow(unsafe_code)]

use super::Strip;

/// The number of words of a group, which one instruction loads.
const GROUP: usize = 4;
/// The number of groups that are written out.
const MOST_GROUPS: usize = 8;
/// The width of a row in bytes that has no more words.
pub(super) const MOST_WIDTH: usize = 4 * GROUP * MOST_GROUPS;

/// Values that the loop reads from memory once per row, for lack of registers.
#[repr(C)]
struct Ends {
    /// A mask of those of a run's first four bytes that are in front of its first aligned word.
    head: u32,
    /// A mask of those of a run's last four bytes that are behind its last aligned word.
    tail: u32,
    /// Words beyond whole groups.
    left: u32,
}

/// Returns the sum of a strip. A row of 50 bytes takes 29 instructions.
#[inline(never)]
pub(super) fn of_strip(Strip(block): Strip<'_, MOST_WIDTH>) -> u32 {
    let (first, width) = (block.bytes().as_ptr(), block.width());
    let head = first.align_offset(4);
    let words = (width - head) / 4;
    let tail = (width - head) % 4;
    let (groups, left) = (words / GROUP, words % GROUP);
    let ends = Ends {
        head: (1 << (8 * head)) - 1,
        tail: !(u32::MAX.checked_shr(8 * tail as u32).unwrap_or(0)),
        left: left as u32,
    };
    let mut sum = 0_u32;
    // SAFETY: so many rows are there. The code reads the first four bytes of each, the last four, and the aligned
    // words.
    unsafe {
        core::arch::asm!(
            "push {{r6}}",
            // The place among the groups where a row comes in: five instructions of four bytes each.
            "adr r6, 4f",
            "sub r6, r6, r3",
            "orr r6, r6, #1",
            "2:",
            "ldr r2, [r0, r9]",
            "ldr r3, [r0, r10]",
            "ldrd r4, r5, [r1]",
            "and r2, r2, r4",
            "and r3, r3, r5",
            "usada8 r8, r2, r12, r8",
            "usada8 r8, r3, r12, r8",
            "bx r6",
            ".balign 4",
            "3:",
            ".rept {most}",
            "ldm.w r0!, {{r2, r3, r4, r5}}",
            "usada8 r8, r2, r12, r8",
            "usada8 r8, r3, r12, r8",
            "usada8 r8, r4, r12, r8",
            "usada8 r8, r5, r12, r8",
            ".endr",
            "4:",
            "ldr r2, [r1, #8]",
            "cbz r2, 6f",
            "5:",
            "ldr r3, [r0], #4",
            "usada8 r8, r3, r12, r8",
            "subs r2, #1",
            "bne 5b",
            "6:",
            "add r0, r11",
            "subs lr, #1",
            "bne 2b",
            "pop {{r6}}",
            most = const MOST_GROUPS,
            inout("r0") first.add(head) => _,
            in("r1") &raw const ends,
            out("r2") _,
            inout("r3") 20 * groups => _,
            out("r4") _,
            out("r5") _,
            inout("r8") sum,
            in("r9") head.wrapping_neg(),
            in("r10") (4 * words + tail).wrapping_sub(4),
            in("r11") block.bytes_per_row().wrapping_sub(4 * words),
            in("r12") 0,
            inout("lr") block.rows() => _,
            options(readonly),
        );
    }
    sum
}
