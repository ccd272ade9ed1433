//! Random forests: every tree votes with its leaf's fractions of the classes, and the class with most votes wins.
//!
//! From half 16 on a file holds:
//!
//! - the value of one vote, U (two halves)
//! - the size of the table of leaves, in halves (two halves)
//! - the table
//! - the trees of [`super::trees`].
//!
//! A leaf below the number of classes gives its whole vote to that class. Any other leaf, less that number, is the
//! place in the table where its entry starts. An entry is the number of its classes, then for each the class and its
//! part of U (two halves). Trees · U is below 2^32.

use super::ModelParts;
use super::descent;
use super::file::{self, FOREST, HEADER_HALVES, Header, MOST_CLASSES, ModelError, half, long};
use super::trees::{self, Leaves};
use super::walk;

/// A forest that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct Forest<'a> {
    words: &'a [u32],
    pub(super) parts: ModelParts<'a>,
    unit: u32,
    /// The halves at which the table of leaves and the trees start.
    table: usize,
    trees: usize,
}

impl<'a> Forest<'a> {
    /// Creates a forest from its file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = attempt!(Header::read(words));
        if header.kind != FOREST {
            return Err(ModelError::Kind { found: header.kind, expected: FOREST });
        }
        if header.number != 0 {
            return Err(ModelError::Header { half: 7, found: header.number });
        }
        let table = HEADER_HALVES + 4;
        if header.trees == 0 {
            return Err(ModelError::Header { half: 11, found: header.trees });
        }
        if header.end < table {
            return Err(ModelError::Part(table as u32));
        }
        let unit = long(words, HEADER_HALVES);
        if unit == 0 || (unit as u64 * header.trees as u64) >> 32 != 0 {
            return Err(ModelError::Overflow);
        }
        let length = long(words, HEADER_HALVES + 2) as usize;
        if length > header.end - table {
            return Err(ModelError::Part(table as u32));
        }
        let trees = table + length;
        let leaves = Leaves::Votes { classes: header.classes as u16, words, table, end: trees, unit };
        attempt!(trees::check(words, trees, &header, leaves));
        let parts = attempt!(ModelParts::new(words, header));
        Ok(Self { words, parts, unit, table, trees })
    }

    /// Returns the class of a sample, either by the fast kernel or by plain code. With `all`, every tree votes, and
    /// each class's votes are passed to `give`.
    #[inline(always)]
    pub(super) fn decide<const FAST: bool, const N: usize>(
        &self,
        sample: &[i16; N],
        all: bool,
        mut give: impl FnMut(u8, i64),
    ) -> u8 {
        if FAST && !(descent::IS_POSSIBLE && self.parts.header.shift == 0) {
            return self.decide::<false, N>(sample, all, give);
        }
        let mut votes = [0; MOST_CLASSES];
        let classes = usize::from(self.parts.header.classes);
        let (mut at, mut left, mut lead) = (self.trees, u32::from(self.parts.header.trees), 0);
        loop {
            // After so many trees, the leading class may be ahead by more than all votes that are left.
            let missing = left.wrapping_mul(self.unit).wrapping_sub(lead);
            let enough = missing.checked_div(self.unit.wrapping_mul(2)).unwrap_or(0);
            let some = if all { left } else { left.min(enough.saturating_add(1).max(CHECK_EVERY)) };
            at = if FAST {
                // SAFETY: this forest has been checked, its shift is 0, and so many trees are left.
                #[allow(unsafe_code)]
                unsafe {
                    descent::vote(
                        self.words,
                        at,
                        some,
                        file::start(sample),
                        &mut votes,
                        self.parts.header.classes,
                        self.unit,
                        |votes, leaf| {
                            self.share_out(votes, leaf);
                        },
                    )
                }
            } else {
                self.vote(&mut votes, at, some, sample)
            };
            left -= some;
            let votes = votes.get(..classes).unwrap_or_default();
            let (best, first, second) = standing(votes);
            lead = first.wrapping_sub(second);
            if all {
                (0..).zip(votes).for_each(|(class, &votes)| give(class, votes.into()));
                return best;
            }
            if left == 0 || lead > left.wrapping_mul(self.unit) {
                return best;
            }
        }
    }

    /// Adds the votes of the next `trees` trees by plain code. Returns where the tree behind them starts.
    fn vote<const N: usize>(
        &self,
        votes: &mut [u32; MOST_CLASSES],
        mut at: usize,
        trees: u32,
        sample: &[i16; N],
    ) -> usize {
        let classes = u16::from(self.parts.header.classes);
        for _ in 0..trees {
            let Ok((start, end)) = trees::bounds(self.words, at, self.parts.header.end, self.parts.header.shift) else {
                break;
            };
            at = end;
            let leaf = walk::votes(
                self.words,
                start,
                self.parts.header.shift,
                trees::bits_for::<N>(&self.parts.header),
                sample,
            );
            if leaf < classes {
                add(votes, leaf, self.unit);
            } else {
                self.share_out(votes, leaf);
            }
        }
        at
    }

    /// Adds the votes of the table entry that a leaf names.
    fn share_out(&self, votes: &mut [u32; MOST_CLASSES], leaf: u16) {
        let entry = self.table + usize::from(leaf.wrapping_sub(u16::from(self.parts.header.classes)));
        let shares = usize::from(half(self.words, entry));
        for share in (entry + 1..).step_by(3).take(shares) {
            add(votes, half(self.words, share), long(self.words, share + 1));
        }
    }
}

/// The fewest trees between two checks of which class leads.
const CHECK_EVERY: u32 = 4;

fn add(votes: &mut [u32; MOST_CLASSES], class: u16, share: u32) {
    if let Some(votes) = votes.get_mut(usize::from(class)) {
        // Trees times unit fit 32 bits, which has been checked once.
        *votes = votes.wrapping_add(share);
    }
}

/// Returns the lowest of the classes with most votes, its votes, and the most votes of any other class.
#[inline(never)]
fn standing(votes: &[u32]) -> (u8, u32, u32) {
    let (mut best, mut first, mut second) = (0, 0, 0);
    for (class, &votes) in (0..).zip(votes) {
        if votes > first {
            (best, first, second) = (class, votes, first);
        } else if votes > second {
            second = votes;
        }
    }
    (best, first, second)
}
