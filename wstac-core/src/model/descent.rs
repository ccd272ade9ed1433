//! The fast walk from a tree's root to a leaf: that of [`super::walk`] without its checks.
//!
//! The gain, in instructions of a Cortex-M4 (`ci/boards m4 FILE SAMPLES`): 100 trees of 12,110 splits take 6,002
//! instead of 25,341. For 1000 boosted trees of 6,220 splits it depends on the leaves. With int16 they take 26,535
//! instead of 128,426; with float32, 30,988 instead of 136,429. Both ways are tested to give the same answers.
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

/// Whether halves lie in words as the file counts them, so that the fast walk is possible.
pub(super) const IS_POSSIBLE: bool = cfg!(target_endian = "little");

/// Adds the votes of `trees` trees of a forest. Returns where the tree behind them starts. A leaf that is not a class
/// goes to `shared`.
///
/// # Safety
/// At half `at` of the words, so many trees start that [`super::trees::check`] has accepted for a forest of so many
/// classes, with a shift of 0. [`IS_POSSIBLE`] is true.
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
    // SAFETY: a tree is its length and as many halves; a leaf below the number of classes is below their maximum.
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

/// Adds to a sum the int16 leaves that a sample ends in, of `trees` boosted trees. Returns the sum and where the trees
/// behind them start.
///
/// # Safety
/// At half `at` of the words, so many trees start that [`super::trees::check`] has accepted with int16 leaves, with a
/// shift of 0. Their sum fits 32 bits. [`IS_POSSIBLE`] is true.
#[inline(always)]
pub(super) unsafe fn sum(words: &[u32], at: usize, trees: u16, sum: i32, sample: &[i16; INPUTS]) -> (i32, usize) {
    let start = words.as_ptr().cast::<u16>();
    // SAFETY: the caller guarantees it.
    unsafe {
        let (sum, next) = add_leaves(sum, start.add(at), trees, sample);
        (sum, next.offset_from_unsigned(start))
    }
}

/// Adds to a sum the float32 leaves that a sample ends in, in the order of the trees. Returns the sum and where the
/// trees behind them start.
///
/// # Safety
/// At half `at` of the words, so many trees start that [`super::trees::check`] has accepted with float32 leaves, with a
/// shift of 0. [`IS_POSSIBLE`] is true.
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
