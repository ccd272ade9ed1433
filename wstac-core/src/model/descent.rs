//! The walk from a tree's root to a leaf, fast: what [`super::walk`] does, without its checks.
//!
//! The gain, in instructions of a Cortex-M4 (`ci/m4 FILE SAMPLES`): 100 trees of 12,110 splits take 6,002 instead of 25,341, 1000
//! boosted ones of 6,220 take 26,535 instead of 128,426 (int16 leaves) or 30,988 instead of 136,429 (float32). Both ways are
//! tested to answer alike.
#![allow(unsafe_code)]

#[cfg(not(thumb2))]
mod portable;
#[cfg(thumb2)]
mod thumb2;

use super::file::{INPUTS, MOST_CLASSES};
#[cfg(not(thumb2))]
use portable::{add_leaves, count_classes, leaf};
#[cfg(thumb2)]
use thumb2::{add_leaves, count_classes, leaf};

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
