//! The descent in the instructions of a Cortex-M3, M4 and M7.
//!
//! Words are loaded where they lie, aligned to two bytes. That needs memory that allows it, as flash and RAM do unless
//! `CCR.UNALIGN_TRP` is set.

use super::super::file::{INPUTS, MOST_CLASSES};
use super::super::trees::{CLASS_SHIFT, LEFT_LEAF, NARROW, RIGHT_LEAF, SAME};

/// Counts the classes that trees vote for, up to a tree whose leaf is not a class, for [`super::vote`]. Returns where
/// the trees behind start, how many trees are left, that one included, and its leaf.
///
/// A node's feature and threshold are one load. Seven instructions go from a node to its left child, nine to its right
/// child, ten past a leaf. Ten instructions of a tree are not of its nodes.
///
/// # Safety
/// The conditions are those of [`super::vote`], and `trees` is not 0.
#[inline(always)]
pub(super) unsafe fn count_classes(
    mut next: *const u16,
    mut trees: u32,
    sample: &[i16; INPUTS],
    counts: &mut [u32; MOST_CLASSES],
    classes: u32,
    unit: u32,
) -> (*const u16, u32, u16) {
    let leaf: u32;
    // SAFETY: the code reads what the plain walk reads, all of which has been checked, and writes only the counts of
    // classes.
    unsafe {
        core::arch::asm!(
            // The next tree: its length, its root.
            "19:",
            "mov {node}, {next}",
            "ldrh {value}, [{node}]",
            "ldr {head}, [{node}, #2]!",
            "add {next}, {node}, {value}, lsl #1",
            "tst {head}, #{leaves}",
            "beq 21f",
            "b 30f",
            // To the left child, which is the next node, behind three halves.
            "20:",
            "ldr {head}, [{node}, #6]!",
            "tst {head}, #{leaves}",
            "bne 30f",
            "21:",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "ble 20b",
            // To the right child, by its offset.
            "22:",
            "ldrh {value}, [{node}, #4]",
            "add {node}, {node}, {value}, lsl #1",
            "ldr {head}, [{node}]",
            "tst {head}, #{leaves}",
            "bne 30f",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "ble 20b",
            "b 22b",
            // A node with one leaf, or two.
            "30:",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "bgt 31f",
            // Carry means that the left child is a leaf; minus, that the right child is.
            "lsls {value}, {head}, #17",
            "bcs 33f",
            "ldr {head}, [{node}, #4]!",
            "tst {head}, #{leaves}",
            "bne 30b",
            "b 21b",
            "31:",
            "lsls {value}, {head}, #17",
            "bmi 34f",
            "ldr {head}, [{node}, #4]!",
            "tst {head}, #{leaves}",
            "bne 30b",
            "b 21b",
            "33:",
            "bpl 35f",
            "tst {head}, #{narrow}",
            "beq 36f",
            "ldrb {value}, [{node}, #4]",
            "b 40f",
            "34:",
            "bcc 35f",
            "tst {head}, #{narrow}",
            "beq 37f",
            "ldrb {value}, [{node}, #5]",
            "b 40f",
            "35:",
            "ubfx {value}, {head}, #{class}, #4",
            "b 41f",
            // Leaves that are not bytes: one leaf for both, or two halves.
            "36:",
            "tst {head}, #{same}",
            "ite ne",
            "ldrhne {value}, [{node}, #2]",
            "ldrheq {value}, [{node}, #4]",
            "b 40f",
            "37:",
            "tst {head}, #{same}",
            "ite ne",
            "ldrhne {value}, [{node}, #2]",
            "ldrheq {value}, [{node}, #6]",
            "40:",
            "cmp {value}, {classes}",
            "bhs 42f",
            "41:",
            "ldr {head}, [{counts}, {value}, lsl #2]",
            "add {head}, {unit}",
            "str {head}, [{counts}, {value}, lsl #2]",
            "subs {trees}, #1",
            "bne 19b",
            "42:",
            node = out(reg) _,
            next = inout(reg) next,
            trees = inout(reg) trees,
            sample = in(reg) sample.as_ptr(),
            counts = in(reg) counts.as_mut_ptr(),
            classes = in(reg) classes,
            unit = in(reg) unit,
            head = out(reg) _,
            value = out(reg) leaf,
            leaves = const LEFT_LEAF | RIGHT_LEAF,
            narrow = const NARROW,
            same = const SAME,
            class = const CLASS_SHIFT,
            options(nostack),
        );
    }
    (next, trees, leaf as u16)
}

/// Adds to a sum the int16 leaves that a sample ends in, of `trees` trees. Returns the sum and where the trees behind
/// them start.
///
/// It is the whole loop, of which seven instructions per tree are not of its nodes.
///
/// # Safety
/// At `next`, so many trees start that [`super::super::trees::check`] has accepted with int16 leaves, with a shift of
/// 0. Their sum fits 32 bits.
#[inline(always)]
pub(super) unsafe fn add_leaves(
    mut sum: i32,
    mut next: *const u16,
    trees: u16,
    sample: &[i16; INPUTS],
) -> (i32, *const u16) {
    if trees == 0 {
        return (sum, next);
    }
    // SAFETY: the code reads what the plain walk reads, all of which has been checked, and writes only registers.
    unsafe {
        core::arch::asm!(
            // The next tree: its length, its root.
            "50:",
            "mov {node}, {next}",
            "ldrh {value}, [{node}]",
            "ldr {head}, [{node}, #2]!",
            "add {next}, {node}, {value}, lsl #1",
            "51:",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "bgt 54f",
            // Left: carry says that there is a leaf; any other node is behind three halves.
            "52:",
            "lsls {value}, {head}, #17",
            "bcs 57f",
            "ldr {head}, [{node}, #6]!",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "ble 52b",
            // Right: minus says that there is a leaf; any other node is at its offset, or behind the left leaf.
            "54:",
            "lsls {value}, {head}, #17",
            "bmi 58f",
            "bcs 55f",
            "ldrh {value}, [{node}, #4]",
            "add {node}, {node}, {value}, lsl #1",
            "ldr {head}, [{node}]",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "bgt 54b",
            "b 52b",
            "55:",
            "ldr {head}, [{node}, #6]!",
            "b 51b",
            "57:",
            "ldrsh {value}, [{node}, #4]",
            "adds {sum}, {value}",
            "subs {trees}, #1",
            "bne 50b",
            "b 60f",
            "58:",
            "bcs 59f",
            "ldrsh {value}, [{node}, #4]",
            "adds {sum}, {value}",
            "subs {trees}, #1",
            "bne 50b",
            "b 60f",
            "59:",
            "ldrsh {value}, [{node}, #6]",
            "adds {sum}, {value}",
            "subs {trees}, #1",
            "bne 50b",
            "60:",
            node = out(reg) _,
            next = inout(reg) next,
            sum = inout(reg) sum,
            trees = inout(reg) u32::from(trees) => _,
            sample = in(reg) sample.as_ptr(),
            head = out(reg) _,
            value = out(reg) _,
            options(nostack, readonly),
        );
    }
    (sum, next)
}

/// Returns the leaf of a boosted tree, of two halves.
///
/// # Safety
/// `node` is the root of a tree that [`super::super::trees::check`] has accepted with such leaves, with a shift of 0.
#[inline(always)]
pub(super) unsafe fn leaf<const LEAF: usize>(node: *const u16, sample: &[i16; INPUTS]) -> *const u16 {
    const { assert!(LEAF == 2, "integers are summed up above") };
    let leaf;
    // SAFETY: the code reads what the plain walk reads, all of which has been checked, and writes only registers.
    unsafe {
        core::arch::asm!(
            "ldr {head}, [{node}]",
            "71:",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "bgt 74f",
            "72:",
            "lsls {value}, {head}, #17",
            "bcs 77f",
            "bmi 75f",
            "ldr {head}, [{node}, #6]!",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "ble 72b",
            "74:",
            "lsls {value}, {head}, #17",
            "bmi 78f",
            "bcs 75f",
            "ldrh {value}, [{node}, #4]",
            "add {node}, {node}, {value}, lsl #1",
            "ldr {head}, [{node}]",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "bgt 74b",
            "b 72b",
            // One leaf of two halves, before the other child.
            "75:",
            "ldr {head}, [{node}, #8]!",
            "b 71b",
            "78:",
            "it cs",
            "addcs {node}, #4",
            "77:",
            "adds {node}, #4",
            node = inout(reg) node => leaf,
            sample = in(reg) sample.as_ptr(),
            head = out(reg) _,
            value = out(reg) _,
            options(nostack, readonly),
        );
    }
    leaf
}
