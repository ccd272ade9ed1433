//! The descent in Rust, for any processor.

use super::super::file::{INPUTS, MOST_CLASSES};
use super::super::trees::{CLASS_SHIFT, FEATURE, LEFT_LEAF, MOST_SINGLE, NARROW, RIGHT_LEAF, SAME};

/// Counts the classes that trees vote for, up to a tree whose leaf is not a class. Returns where the trees behind
/// start, how many trees are left, that one included, and its leaf.
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
    loop {
        // SAFETY: a tree is its length and as many halves; a leaf below the number of classes is below their maximum.
        unsafe {
            let root = next.add(1);
            next = root.add(usize::from(next.read()));
            let leaf = votes(root, sample);
            if u32::from(leaf) >= classes {
                return (next, trees, leaf);
            }
            let count = counts.get_unchecked_mut(usize::from(leaf));
            // Trees times unit fit 32 bits, which has been checked once.
            *count = count.wrapping_add(unit);
            trees -= 1;
            if trees == 0 {
                return (next, 0, leaf);
            }
        }
    }
}

/// Returns the leaf of a forest's tree: a class, or behind the classes a place in the table of leaves.
///
/// # Safety
/// The conditions are those of [`super::vote`], for one tree.
#[inline(always)]
unsafe fn votes(mut node: *const u16, sample: &[i16; INPUTS]) -> u16 {
    loop {
        // SAFETY: a checked node has at least two halves, and three if it has no leaf. Its feature is below 700. What
        // is read behind it was found to be there. Children are nodes of the same tree, ever further back.
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

/// Returns the leaf of a boosted tree, of `LEAF` halves.
///
/// # Safety
/// `node` is the root of a tree that [`super::super::trees::check`] has accepted with such leaves, with a shift of 0.
#[inline(always)]
pub(super) unsafe fn leaf<const LEAF: usize>(mut node: *const u16, sample: &[i16; INPUTS]) -> *const u16 {
    loop {
        // SAFETY: the node has been checked as in `votes`; a leaf is in the node that has it.
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

/// Adds to a sum the int16 leaves that a sample ends in, of `trees` trees. Returns the sum and where the trees behind
/// them start.
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

/// Returns whether a sample goes left at a node.
///
/// # Safety
/// The node has been checked.
#[inline(always)]
unsafe fn goes_left(node: *const u16, sample: &[i16; INPUTS]) -> bool {
    // SAFETY: features are below 700, and a node has a threshold.
    unsafe { *sample.get_unchecked(usize::from(node.read() & FEATURE)) <= node.add(1).read() as i16 }
}
