//! Trees: the layout of their nodes in the file, and the one check of them.
//!
//! A tree starts with its length: one half, in units of 2^shift halves, counted behind it. Then come its nodes in
//! preorder: a node, its left subtree, its right subtree. Leaves are in their parents:
//!
//! | node | halves |
//! | --- | --- |
//! | both children are nodes | feature, threshold, offset of the right one |
//! | one child is a leaf | feature, threshold, the leaf; in a forest, feature with the leaf in it, threshold |
//! | both are leaves | feature, threshold, the left leaf, the right leaf |
//! | both are leaves of a byte | feature, threshold, one half with the left leaf low |
//! | both are the same leaf | feature, the leaf |
//!
//! The feature's half has flags on top: [`LEFT_LEAF`] and [`RIGHT_LEAF`]. For two leaves of a forest there is also
//! [`NARROW`] or [`SAME`]. For one leaf of a forest there is a class below 16 at [`CLASS_SHIFT`]; another leaf becomes
//! a node with [`SAME`]. A number x of the sample goes left if x ≤ threshold, an int16. A child that is a node and has
//! no offset follows its parent. Offsets count from their node in units of 2^shift halves. A right child follows the
//! left subtree, with less than a unit of padding, and so does the next tree. Leaves are one half, or two (float32).
//!
//! Features of 25 taxels over time have one more bit ([`FeatureBits`]): the class begins behind it and is below 8. The
//! shift of such trees is 1 or more.

use super::file::{Header, INPUTS, Input, ModelError, half, long};

/// The left child is a leaf.
pub const LEFT_LEAF: u16 = 1 << 15;
/// The right child is a leaf.
pub const RIGHT_LEAF: u16 = 1 << 14;
/// Both leaves are bytes of one half.
pub const NARROW: u16 = 1 << 13;
/// Both leaves are the same one, which is in the threshold's place.
pub const SAME: u16 = 1 << 12;
/// The bit at which the class of a forest's single leaf starts.
pub const CLASS_SHIFT: u16 = 10;
/// The number of classes that fit there.
pub const MOST_SINGLE: u16 = 16;
/// The bits of the feature.
pub const FEATURE: u16 = (1 << CLASS_SHIFT) - 1;

/// The bits of a feature in a node, and behind them those of a forest's single leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureBits(u16);

impl FeatureBits {
    /// Returns the bits in trees of this input.
    pub const fn of(input: Input) -> Self {
        Self(if input.numbers() > 1 << CLASS_SHIFT { CLASS_SHIFT + 1 } else { CLASS_SHIFT })
    }

    /// Returns the mask of the feature.
    pub const fn feature(self) -> u16 {
        (1 << self.0) - 1
    }

    /// Returns the bit at which the class of a forest's single leaf starts.
    pub const fn class_shift(self) -> u16 {
        self.0
    }

    /// Returns the number of classes that fit there.
    pub const fn most_single(self) -> u16 {
        (MOST_SINGLE << CLASS_SHIFT) >> self.0
    }

    /// Returns the class of a forest's single leaf.
    pub(super) const fn class(self, node: u16) -> u16 {
        node >> self.0 & (self.most_single() - 1)
    }
}

/// Returns the bits in trees of this header, for samples of `N` numbers. Of 700 numbers they are known when compiled.
#[inline(always)]
pub(super) const fn bits_for<const N: usize>(header: &Header) -> FeatureBits {
    FeatureBits::of(if N > INPUTS { header.input } else { Input::Frames })
}

/// The most right children that wait while a tree is checked, which is at most its depth.
pub const MOST_PENDING: usize = 256;

/// Returns where a tree's nodes start and end, from its length on. The end may be up to a unit of padding behind the
/// last node.
pub(super) const fn bounds(words: &[u32], at: usize, end: usize, shift: u8) -> Result<(usize, usize), ModelError> {
    let length = (half(words, at) as usize) << shift;
    if at >= end || length == 0 || length > end - at - 1 {
        return Err(ModelError::Part(at as u32));
    }
    Ok((at + 1, at + 1 + length))
}

#[derive(Clone, Copy)]
pub(super) enum Leaves<'a> {
    /// One half: every value is a valid leaf.
    Integers,
    /// Two halves, float32: finite, and below 2^96, so that no sum of them can overflow.
    Floats,
    /// Classes below the number of classes; above it, places in the table at which an entry starts.
    Votes {
        classes: u16,
        /// All words. Some of their halves are the table of leaves.
        words: &'a [u32],
        /// The half at which the table starts.
        table: usize,
        /// The half at which the table ends.
        end: usize,
        /// The value of one vote.
        unit: u32,
    },
}

/// Checks all trees of a file, from the half `at` to the end of the kind's part.
pub(super) const fn check(words: &[u32], mut at: usize, header: &Header, leaves: Leaves<'_>) -> Result<(), ModelError> {
    let bits = FeatureBits::of(header.input);
    // Fast walks are of a shift of 0, and know ten bits only.
    if bits.0 != CLASS_SHIFT && header.shift == 0 {
        return Err(ModelError::Header { half: 14, found: half(words, 14) });
    }
    let mut tree = 0;
    while tree < header.trees {
        let (start, end) = attempt!(bounds(words, at, header.end, header.shift));
        attempt!(check_tree(words, start, end, header, bits, leaves));
        at = end;
        tree += 1;
    }
    if at == header.end { Ok(()) } else { Err(ModelError::Part(at as u32)) }
}

/// Checks a tree whose nodes are the halves `start..end`. Every node is reached once, every child is a node or a leaf,
/// features are below `inputs`, and leaves are as `leaves` says.
const fn check_tree(
    words: &[u32],
    start: usize,
    end: usize,
    header: &Header,
    bits: FeatureBits,
    leaves: Leaves<'_>,
) -> Result<(), ModelError> {
    let (shift, inputs, feature) = (header.shift, header.inputs(), bits.feature());
    let mut pending = [0_usize; MOST_PENDING];
    let mut count = 0;
    let mut at = start;
    loop {
        let error = Err(ModelError::Node(at as u32));
        if end - at < 2 || (half(words, at) & feature) as usize >= inputs {
            return error;
        }
        let node = half(words, at);
        let size = match (node & LEFT_LEAF != 0, node & RIGHT_LEAF != 0) {
            (false, false) => {
                let target = at + ((half(words, at + 2) as usize) << shift);
                if node & !feature != 0 || target <= at || target >= end || count >= MOST_PENDING {
                    return error;
                }
                pending[count] = target;
                count += 1;
                3
            }
            (true, true) => leaves.pair(words, at, node & !feature),
            _ => leaves.single(words, at, bits.class(node)),
        };
        if size == 0 || end - at < size {
            return error;
        }
        at += size;
        if node & LEFT_LEAF != 0 && node & RIGHT_LEAF != 0 {
            // The subtree is complete. The next node is the nearest right child that waits, or the tree's end.
            let target = if count == 0 { end } else { pending[(count - 1) % MOST_PENDING] };
            if target < at || target - at >= 1 << shift {
                return error;
            }
            if count == 0 {
                return Ok(());
            }
            count -= 1;
            at = target;
        }
    }
}

/// Returns whether a float32 is finite and below 2^96, by its high half.
pub(super) const fn is_moderate(high: u16) -> bool {
    high & 0x7F80 < (96 + 127) << 7
}

impl Leaves<'_> {
    /// Returns the number of halves of a node with two valid leaves; 0 if they are not valid.
    const fn pair(self, words: &[u32], at: usize, flags: u16) -> usize {
        let flags = flags & !(LEFT_LEAF | RIGHT_LEAF);
        let low = half(words, at + 2);
        match (self, flags) {
            (Self::Integers, 0) => 4,
            (Self::Floats, 0) if is_moderate(half(words, at + 3)) && is_moderate(half(words, at + 5)) => 6,
            (Self::Votes { .. }, 0) if self.votes(low) && self.votes(half(words, at + 3)) => 4,
            (Self::Votes { .. }, NARROW) if self.votes(low & 0xFF) && self.votes(low >> 8) => 3,
            (Self::Votes { .. }, SAME) if self.votes(half(words, at + 1)) => 2,
            _ => 0,
        }
    }

    /// Returns the number of halves of a node with one valid leaf; 0 if it is not valid.
    const fn single(self, words: &[u32], at: usize, class: u16) -> usize {
        match self {
            Self::Integers if class == 0 => 3,
            Self::Floats if class == 0 && is_moderate(half(words, at + 3)) => 4,
            Self::Votes { classes, .. } if class < classes => 2,
            _ => 0,
        }
    }

    /// Returns whether a half is a forest's leaf.
    const fn votes(self, leaf: u16) -> bool {
        match self {
            Self::Votes { classes, words, table, end, unit } => {
                leaf < classes || is_entry(words, table + (leaf - classes) as usize, end, classes, unit)
            }
            _ => false,
        }
    }
}

/// Returns whether an entry of the table of leaves starts at a place. Its classes exist, and its parts are together at
/// most one vote.
const fn is_entry(words: &[u32], at: usize, end: usize, classes: u16, unit: u32) -> bool {
    if at >= end {
        return false;
    }
    let shares = half(words, at) as usize;
    if shares == 0 || shares > classes as usize || end - at < 1 + 3 * shares {
        return false;
    }
    let mut sum = 0;
    let mut share = at + 1;
    while share < at + 1 + 3 * shares {
        if half(words, share) >= classes {
            return false;
        }
        sum += long(words, share + 1) as u64;
        share += 3;
    }
    sum <= unit as u64
}
