//! The walk from a tree's root to a leaf, fast: what [`super::walk`] does, without its checks.
//!
//! The gain, in instructions of a Cortex-M4 (`ci/m4 FILE SAMPLES`): 100 trees of 12,110 splits take 6,002 instead of 25,341, 1000
//! boosted ones of 6,220 take 26,535 instead of 128,426 (int16 leaves) or 30,988 instead of 136,429 (float32). Both ways are
//! tested to answer alike.
#![allow(unsafe_code)]

use super::file::{INPUTS, MOST_CLASSES};
#[cfg(not(thumb2))]
use super::trees::FEATURE;
#[cfg(not(thumb2))]
use super::trees::MOST_SINGLE;
use super::trees::{CLASS_SHIFT, LEFT_LEAF, NARROW, RIGHT_LEAF, SAME};

/// Whether halves lie in words as the file counts them.
pub(super) const IS_POSSIBLE: bool = cfg!(target_endian = "little");

/// Adds what `trees` trees of a forest say; where the tree behind them starts. A leaf that is no class goes to `shared`.
///
/// # Safety
/// At half `at` of the words so many trees start that [`super::trees::check`] has found good as a forest's of so many classes,
/// with a shift of 0; and [`IS_POSSIBLE`].
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(super) unsafe fn vote(
    words: &[u32],
    at: usize,
    trees: u32,
    sample: &[i16; INPUTS],
    counts: &mut [u32; MOST_CLASSES],
    classes: u8,
    unit: u32,
    shared: impl Fn(&mut [u32; MOST_CLASSES], u16),
) -> usize {
    let start = words.as_ptr().cast::<u16>();
    // SAFETY: a tree is its length and as many halves; a leaf below the classes is below their most.
    unsafe {
        let (mut next, mut left) = (start.add(at), trees);
        while left > 0 {
            let (end, rest, leaf) = count_classes(next, left, sample, counts, classes.into(), unit);
            (next, left) = (end, rest);
            if left > 0 {
                shared(counts, leaf);
                left -= 1;
            }
        }
        next.offset_from_unsigned(start)
    }
}

/// Adds the int16 leaves that a sample ends in, of `trees` boosted trees, to a sum; and where the trees behind them start.
///
/// # Safety
/// At half `at` of the words so many trees start that [`super::trees::check`] has found good with such leaves, with a shift of 0;
/// their sum fits; and [`IS_POSSIBLE`].
#[inline(always)]
pub(super) unsafe fn sum(words: &[u32], at: usize, trees: u16, sum: i32, sample: &[i16; INPUTS]) -> (i32, usize) {
    let start = words.as_ptr().cast::<u16>();
    // SAFETY: what is asked of the caller.
    unsafe {
        let (sum, next) = add_leaves(sum, start.add(at), trees, sample);
        (sum, next.offset_from_unsigned(start))
    }
}

/// Adds float32 leaves, in the order of the trees; otherwise as above.
///
/// # Safety
/// As above, with such leaves.
#[inline(always)]
pub(super) unsafe fn sum_floats(
    words: &[u32],
    at: usize,
    trees: u16,
    mut sum: f32,
    sample: &[i16; INPUTS],
) -> (f32, usize) {
    let start = words.as_ptr().cast::<u16>();
    // SAFETY: a tree is its length and as many halves; its leaf is two of them.
    unsafe {
        let mut next = start.add(at);
        for _ in 0..trees {
            let root = next.add(1);
            next = root.add(usize::from(next.read()));
            let leaf = leaf::<2>(root, sample);
            sum += f32::from_bits(u32::from(leaf.read()) | u32::from(leaf.add(1).read()) << 16);
        }
        (sum, next.offset_from_unsigned(start))
    }
}

/// Counts the classes that trees say, up to one whose leaf is none; where the trees behind start, how many are left with
/// that one, and its leaf.
///
/// # Safety
/// As for [`vote`]; `trees` is not 0.
#[cfg(not(thumb2))]
#[inline(always)]
unsafe fn count_classes(
    mut next: *const u16,
    mut trees: u32,
    sample: &[i16; INPUTS],
    counts: &mut [u32; MOST_CLASSES],
    classes: u32,
    unit: u32,
) -> (*const u16, u32, u16) {
    loop {
        // SAFETY: a tree is its length and as many halves; a leaf below the classes is below their most.
        unsafe {
            let root = next.add(1);
            next = root.add(usize::from(next.read()));
            let leaf = votes(root, sample);
            if u32::from(leaf) >= classes {
                return (next, trees, leaf);
            }
            let count = counts.get_unchecked_mut(usize::from(leaf));
            // Trees times unit fit 32 bits, checked once.
            *count = count.wrapping_add(unit);
            trees -= 1;
            if trees == 0 {
                return (next, 0, leaf);
            }
        }
    }
}

/// The leaf of a forest's tree: a class, or behind classes a place in the table of leaves.
///
/// # Safety
/// As above, of one tree.
#[cfg(not(thumb2))]
#[inline(always)]
unsafe fn votes(mut node: *const u16, sample: &[i16; INPUTS]) -> u16 {
    loop {
        // SAFETY: a checked node has two halves at least, and three where it has no leaf; its feature is below 700; what is
        // read behind it was found to be there; and children are nodes of the same tree, ever further back.
        unsafe {
            let head = node.read();
            let left = goes_left(node, sample);
            node = match (head & LEFT_LEAF != 0, head & RIGHT_LEAF != 0) {
                (false, false) if left => node.add(3),
                (false, false) => node.add(usize::from(node.add(2).read())),
                (true, true) if head & NARROW != 0 => return node.add(2).read() >> (8 * u32::from(!left)) & 0xFF,
                (true, true) if head & SAME != 0 => return node.add(1).read(),
                (true, true) => return node.add(2 + usize::from(!left)).read(),
                (left_leaf, _) if left_leaf == left => return head >> CLASS_SHIFT & (MOST_SINGLE - 1),
                _ => node.add(2),
            };
        }
    }
}

/// The leaf of a boosted tree, of `LEAF` halves.
///
/// # Safety
/// `node` is the root of a tree that [`super::trees::check`] has found good with such leaves, with a shift of 0.
#[cfg(not(thumb2))]
#[inline(always)]
unsafe fn leaf<const LEAF: usize>(mut node: *const u16, sample: &[i16; INPUTS]) -> *const u16 {
    loop {
        // SAFETY: as above; a leaf is in the node that has it.
        unsafe {
            let head = node.read();
            if goes_left(node, sample) {
                if head & LEFT_LEAF != 0 {
                    return node.add(2);
                }
                node = node.add(if head & RIGHT_LEAF != 0 { 2 + LEAF } else { 3 });
            } else if head & RIGHT_LEAF != 0 {
                return node.add(if head & LEFT_LEAF != 0 { 2 + LEAF } else { 2 });
            } else {
                node = node.add(if head & LEFT_LEAF != 0 { 2 + LEAF } else { usize::from(node.add(2).read()) });
            }
        }
    }
}

/// Adds the int16 leaves that a sample ends in, of `trees` trees, to a sum; and where the trees behind them start.
///
/// # Safety
/// At `next` so many trees start that [`super::trees::check`] has found good with such leaves, with a shift of 0; their sum fits.
#[cfg(not(thumb2))]
#[inline(always)]
unsafe fn add_leaves(mut sum: i32, mut next: *const u16, trees: u16, sample: &[i16; INPUTS]) -> (i32, *const u16) {
    for _ in 0..trees {
        // SAFETY: a tree is its length and as many halves; its leaf is one of them.
        unsafe {
            let root = next.add(1);
            next = root.add(usize::from(next.read()));
            sum = sum.wrapping_add(i32::from(leaf::<1>(root, sample).read() as i16));
        }
    }
    (sum, next)
}

/// Whether a sample goes left at a node.
///
/// # Safety
/// The node has been checked.
#[cfg(not(thumb2))]
#[inline(always)]
unsafe fn goes_left(node: *const u16, sample: &[i16; INPUTS]) -> bool {
    // SAFETY: features are below 700, and a node has a threshold.
    unsafe { *sample.get_unchecked(usize::from(node.read() & FEATURE)) <= node.add(1).read() as i16 }
}

/// As above. A node's feature and threshold are one load; seven instructions go from a node to its left child, nine to its
/// right one, ten past a leaf; ten of a tree are not of its nodes.
///
/// # Safety
/// As above.
#[cfg(thumb2)]
#[inline(always)]
unsafe fn count_classes(
    mut next: *const u16,
    mut trees: u32,
    sample: &[i16; INPUTS],
    counts: &mut [u32; MOST_CLASSES],
    classes: u32,
    unit: u32,
) -> (*const u16, u32, u16) {
    let leaf: u32;
    // SAFETY: it reads what the plain walk reads, all of which has been checked, and writes the counts of classes alone.
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
            // To the left child, the next node: it is behind three halves.
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
            // A node with a leaf, or two.
            "30:",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "bgt 31f",
            // Carry: the left child is a leaf; minus: the right one is.
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
            // Leaves that are no bytes: the same one, or two halves.
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

/// As above; the whole loop over trees, of which seven instructions a tree are not of its nodes.
///
/// # Safety
/// As above.
#[cfg(thumb2)]
#[inline(always)]
unsafe fn add_leaves(mut sum: i32, mut next: *const u16, trees: u16, sample: &[i16; INPUTS]) -> (i32, *const u16) {
    if trees == 0 {
        return (sum, next);
    }
    // SAFETY: it reads what the plain walk reads, all of which has been checked, and writes registers alone.
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
            // Left, where carry says that there is a leaf; any other node is behind three halves.
            "52:",
            "lsls {value}, {head}, #17",
            "bcs 57f",
            "ldr {head}, [{node}, #6]!",
            "ubfx {value}, {head}, #0, #10",
            "ldrsh {value}, [{sample}, {value}, lsl #1]",
            "cmp {value}, {head}, asr #16",
            "ble 52b",
            // Right, where minus says that there is a leaf; any other node is by its offset, or behind the left leaf.
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

/// As above, for leaves of two halves.
///
/// # Safety
/// As above.
#[cfg(thumb2)]
#[inline(always)]
unsafe fn leaf<const LEAF: usize>(node: *const u16, sample: &[i16; INPUTS]) -> *const u16 {
    const { assert!(LEAF == 2, "integers are summed up above") };
    let leaf;
    // SAFETY: as above.
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
            // One leaf, two halves, before the other child.
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
