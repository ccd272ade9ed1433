//! Trees: how their nodes lie in the file, the one check of them, and the walk from root to leaf.
//!
//! A tree is its length in words (one word, or 0 and then two words where it is longer than 65 535), counted behind it, then
//! its nodes in preorder: a node, what is left of it, what is right of it. Leaves are in their parents:
//!
//! | node | words |
//! | --- | --- |
//! | both children are nodes | feature, threshold, offset of the right one |
//! | one child is a leaf | feature, threshold, the leaf |
//! | both are leaves | feature, threshold, the left leaf, the right leaf; or both in one word, the left one low |
//!
//! The feature's word has flags on top: [`LEFT_LEAF`], [`RIGHT_LEAF`], [`NARROW`] (two leaves in one word). A number x of
//! the sample goes left where x ≤ threshold, an int16. A child that is a node and has no offset follows its parent. Offsets count
//! from their node in units of 2^shift words: a right child follows the left subtree, with less than a unit of padding.

use super::file::{INPUTS, ModelError, long, word};

/// The left child is a leaf.
pub const LEFT_LEAF: u16 = 1 << 15;
/// The right child is a leaf.
pub const RIGHT_LEAF: u16 = 1 << 14;
/// Both leaves are bytes of one word.
pub const NARROW: u16 = 1 << 13;
/// The feature's bits.
pub const FEATURE: u16 = (1 << 10) - 1;
/// Most right children that wait while a tree is checked: its depth at most.
const MOST_PENDING: usize = 256;

/// Where a tree's nodes start and end, from its length's word on.
pub(super) const fn bounds(words: &[u16], at: usize, end: usize) -> Result<(usize, usize), ModelError> {
    let none = Err(ModelError::Part(at as u32));
    if at >= end {
        return none;
    }
    let (start, length) = if word(words, at) != 0 {
        (at + 1, word(words, at) as usize)
    } else if end - at >= 3 {
        (at + 3, long(words, at + 1) as usize)
    } else {
        return none;
    };
    if length == 0 || length > end - start {
        return none;
    }
    Ok((start, start + length))
}

/// Checks a tree whose nodes are the words `start..end`: every node is reached once, every child is a node or a leaf,
/// features are below `inputs`, and leaves of `leaf_words` words are what `leaves` says.
pub(super) const fn check(
    words: &[u16],
    start: usize,
    end: usize,
    shift: u8,
    inputs: usize,
    leaf_words: usize,
    leaves: Leaves<'_>,
) -> Result<(), ModelError> {
    let mut pending = [0_usize; MOST_PENDING];
    let mut count = 0;
    let mut at = start;
    loop {
        let error = Err(ModelError::Node(at as u32));
        if end - at < 3 {
            return error;
        }
        let node = word(words, at);
        if (node & FEATURE) as usize >= inputs || node & !(LEFT_LEAF | RIGHT_LEAF | NARROW | FEATURE) != 0 {
            return error;
        }
        let (left, right) = (node & LEFT_LEAF != 0, node & RIGHT_LEAF != 0);
        let narrow = node & NARROW != 0;
        if narrow && !(left && right && leaf_words == 1) {
            return error;
        }
        let size = if !left && !right || narrow {
            3
        } else if left && right {
            2 + 2 * leaf_words
        } else {
            2 + leaf_words
        };
        if end - at < size {
            return error;
        }
        let good = match (left || right, narrow) {
            (false, _) => {
                let target = at + ((word(words, at + 2) as usize) << shift);
                if target <= at || target >= end || count >= MOST_PENDING {
                    return error;
                }
                pending[count] = target;
                count += 1;
                true
            }
            (true, true) => leaves.has(word(words, at + 2) & 0xFF) && leaves.has(word(words, at + 2) >> 8),
            (true, false) => {
                leaves.are_at(words, at + 2) && (!(left && right) || leaves.are_at(words, at + 2 + leaf_words))
            }
        };
        if !good {
            return error;
        }
        at += size;
        if left && right {
            // The subtree is whole: next is the nearest right child that waits, or the tree's end.
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

/// What leaves are.
#[derive(Clone, Copy)]
pub(super) enum Leaves<'a> {
    /// Words: every value is one.
    Integers,
    /// Two words, float32: finite, and below [`MOST_FLOAT`] so that no sum of them can overflow.
    Floats,
    /// Classes below the number, then places in the table behind it at which an entry starts.
    Indices {
        /// How many classes there are.
        classes: u16,
        /// The table of leaves.
        table: &'a [u16],
        /// What a vote of 1 counts.
        unit: u32,
    },
}

/// Exponent of the float32 that leaves stay below, 2^96, as it stands in the high word.
const MOST_FLOAT: u16 = (96 + 127) << 7;

/// Whether a float32 is finite and below 2^96, by its high word.
pub(super) const fn is_moderate(high: u16) -> bool {
    high & 0x7F80 < MOST_FLOAT
}

impl Leaves<'_> {
    /// Whether there is a leaf at a place, all of which is there.
    const fn are_at(self, words: &[u16], at: usize) -> bool {
        match self {
            Self::Floats => is_moderate(word(words, at + 1)),
            _ => self.has(word(words, at)),
        }
    }

    /// Whether a word is a leaf.
    const fn has(self, leaf: u16) -> bool {
        match self {
            Self::Integers => true,
            Self::Floats => false,
            Self::Indices { classes, table, unit } => {
                leaf < classes || super::forest::is_entry(table, leaf - classes, classes, unit)
            }
        }
    }
}

/// The leaf that a sample ends in: its place in `words`, and which byte of it where leaves are narrow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaf {
    /// The whole word.
    Word(usize),
    /// The low byte.
    Low(usize),
    /// The high byte.
    High(usize),
}

impl Leaf {
    /// Where its word is.
    pub(super) fn place(self) -> usize {
        let (Self::Word(at) | Self::Low(at) | Self::High(at)) = self;
        at
    }

    /// Its word or byte.
    pub(super) fn of(self, words: &[u16]) -> u16 {
        match self {
            Self::Word(at) => word(words, at),
            Self::Low(at) => word(words, at) & 0xFF,
            Self::High(at) => word(words, at) >> 8,
        }
    }
}

/// Walks from the root at `at` to a leaf of `LEAF_WORDS` words; the plain way, with every access checked.
pub(super) fn walk<const LEAF_WORDS: usize>(words: &[u16], mut at: usize, shift: u8, sample: &[i16; INPUTS]) -> Leaf {
    let word = |at: usize| words.get(at).copied().unwrap_or(LEFT_LEAF | RIGHT_LEAF);
    loop {
        let node = word(at);
        let threshold = word(at + 1) as i16;
        let value = sample.get(usize::from(node & FEATURE)).copied().unwrap_or(0);
        let (left, right) = (node & LEFT_LEAF != 0, node & RIGHT_LEAF != 0);
        let narrow = node & NARROW != 0;
        if value <= threshold {
            if left {
                return if narrow { Leaf::Low(at + 2) } else { Leaf::Word(at + 2) };
            }
            at += if right { 2 + LEAF_WORDS } else { 3 };
        } else {
            if right {
                return match (narrow, left) {
                    (true, _) => Leaf::High(at + 2),
                    (false, true) => Leaf::Word(at + 2 + LEAF_WORDS),
                    (false, false) => Leaf::Word(at + 2),
                };
            }
            at += if left { 2 + LEAF_WORDS } else { usize::from(word(at + 2)) << shift };
        }
    }
}
