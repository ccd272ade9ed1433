//! The descent in Rust: a compiler's instructions, for any processor.

use super::super::file::{INPUTS, MOST_CLASSES};
use super::super::trees::{CLASS_SHIFT, FEATURE, LEFT_LEAF, MOST_SINGLE, NARROW, RIGHT_LEAF, SAME};

/// Counts the classes that trees say, up to one whose leaf is none; where the trees behind start, how many are left with
/// that one, and its leaf.
///
/// # Safety
/// As for [`super::vote`]; `trees` is not 0.
#[inline(always)]
pub(super) unsafe fn count_classes(
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
/// `node` is the root of a tree that [`super::super::trees::check`] has found good with such leaves, with a shift of 0.
#[inline(always)]
pub(super) unsafe fn leaf<const LEAF: usize>(mut node: *const u16, sample: &[i16; INPUTS]) -> *const u16 {
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
/// At `next` so many trees start that [`super::super::trees::check`] has found good with such leaves, with a shift of 0; their sum fits.
#[inline(always)]
pub(super) unsafe fn add_leaves(
    mut sum: i32,
    mut next: *const u16,
    trees: u16,
    sample: &[i16; INPUTS],
) -> (i32, *const u16) {
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
#[inline(always)]
unsafe fn goes_left(node: *const u16, sample: &[i16; INPUTS]) -> bool {
    // SAFETY: features are below 700, and a node has a threshold.
    unsafe { *sample.get_unchecked(usize::from(node.read() & FEATURE)) <= node.add(1).read() as i16 }
}
