//! The plain walk from a tree's root to a leaf. Every access is checked.

use super::file::half;
use super::trees::{FeatureBits, LEFT_LEAF, NARROW, RIGHT_LEAF, SAME};

fn goes_left<const N: usize>(words: &[u32], at: usize, bits: FeatureBits, sample: &[i16; N]) -> bool {
    let value = sample.get(usize::from(half(words, at) & bits.feature())).copied().unwrap_or(0);
    value <= half(words, at + 1) as i16
}

/// Returns the place of the right child of a node without leaves.
fn right_child(words: &[u32], at: usize, shift: u8) -> usize {
    at + (usize::from(half(words, at + 2)) << shift)
}

/// Returns the leaf of a forest's tree: a class, or behind the classes a place in the table of leaves.
pub(super) fn votes<const N: usize>(
    words: &[u32],
    mut at: usize,
    shift: u8,
    bits: FeatureBits,
    sample: &[i16; N],
) -> u16 {
    loop {
        let (node, left) = (half(words, at), goes_left(words, at, bits, sample));
        at = match (node & LEFT_LEAF != 0, node & RIGHT_LEAF != 0) {
            (false, false) if left => at + 3,
            (false, false) => right_child(words, at, shift),
            (true, true) => return pair(words, at, left),
            (left_leaf, _) if left_leaf == left => return bits.class(node),
            _ => at + 2,
        };
    }
}

/// Returns the left or the right one of a forest's two leaves.
pub(super) fn pair(words: &[u32], at: usize, left: bool) -> u16 {
    let node = half(words, at);
    if node & NARROW != 0 {
        let both = half(words, at + 2);
        return if left { both & 0xFF } else { both >> 8 };
    }
    half(words, if node & SAME != 0 { at + 1 } else { at + 2 + usize::from(!left) })
}

/// Returns the place of the leaf of a boosted tree, of so many halves.
pub(super) fn leaf<const LEAF: usize, const N: usize>(
    words: &[u32],
    mut at: usize,
    shift: u8,
    bits: FeatureBits,
    sample: &[i16; N],
) -> usize {
    loop {
        let (node, left) = (half(words, at), goes_left(words, at, bits, sample));
        at = match (node & LEFT_LEAF != 0, node & RIGHT_LEAF != 0) {
            (false, false) if left => at + 3,
            (false, false) => right_child(words, at, shift),
            (true, true) if !left => return at + 2 + LEAF,
            (left_leaf, right_leaf) if left_leaf == left || right_leaf != left => return at + 2,
            _ => at + 2 + LEAF,
        };
    }
}
