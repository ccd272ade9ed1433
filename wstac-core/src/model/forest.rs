//! Random forests: every tree votes with its leaf's shares of the classes, and the class with most wins.
//!
//! From word 16 on: what a vote of 1 counts, U (two words), words of the table of leaves (two words), the table, then the trees of
//! [`super::trees`]. A leaf below the number of classes is all one class's. Another one, less that number, is the place in the
//! table where its entry starts: how many classes have a share, then for each the class and its share of U (two
//! words). Trees · U is below 2^32.

use super::file::{HEADER_WORDS, Header, INPUTS, Labels, MOST_CLASSES, ModelError, long, part, word};
use super::trees::{self, Leaves};

/// A forest that has been checked.
#[derive(Clone, Copy, Debug)]
pub struct Forest<'a> {
    words: &'a [u16],
    pub(super) labels: Labels<'a>,
    pub(super) header: Header,
    unit: u32,
    /// Words at which the table of leaves and the trees start.
    table: usize,
    trees: usize,
}

/// The kind's number in the file.
pub(super) const KIND: u16 = 3;

/// Whether what starts at a place of the table of leaves is an entry: classes that there are, with shares that are the
/// unit together at most.
pub(super) const fn is_entry(table: &[u16], place: u16, classes: u16, unit: u32) -> bool {
    let at = place as usize;
    if at >= table.len() {
        return false;
    }
    let shares = word(table, at) as usize;
    if shares == 0 || shares > classes as usize || table.len() - at < 1 + 3 * shares {
        return false;
    }
    let mut sum = 0;
    let mut share = 0;
    while share < shares {
        let entry = at + 1 + 3 * share;
        if word(table, entry) >= classes {
            return false;
        }
        sum += long(table, entry + 1) as u64;
        share += 1;
    }
    sum <= unit as u64
}

impl<'a> Forest<'a> {
    /// A forest from its file's words, all of which are checked.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub const fn from_words(words: &'a [u16]) -> Result<Self, ModelError> {
        let header = match Header::read(words) {
            Ok(header) => header,
            Err(error) => return Err(error),
        };
        if header.kind != KIND {
            return Err(ModelError::Kind);
        }
        if header.number != 0 {
            return Err(ModelError::Header(7));
        }
        let table = HEADER_WORDS + 4;
        if header.trees == 0 {
            return Err(ModelError::Header(11));
        }
        if header.labels < table {
            return Err(ModelError::Part(table as u32));
        }
        let unit = long(words, HEADER_WORDS);
        if unit == 0 || (unit as u64 * header.trees as u64) >> 32 != 0 {
            return Err(ModelError::Overflow);
        }
        let length = long(words, HEADER_WORDS + 2) as usize;
        if length > header.labels - table {
            return Err(ModelError::Part(table as u32));
        }
        let trees = table + length;
        let entries = part(words, table, trees);
        let leaves = Leaves::Indices { classes: header.classes as u16, table: entries, unit };
        let mut at = trees;
        let mut tree = 0;
        while tree < header.trees {
            let (start, end) = match trees::bounds(words, at, header.labels) {
                Ok(bounds) => bounds,
                Err(error) => return Err(error),
            };
            if let Err(error) = trees::check(words, start, end, header.shift, header.inputs(), 1, leaves) {
                return Err(error);
            }
            at = end;
            tree += 1;
        }
        if at != header.labels {
            return Err(ModelError::Part(at as u32));
        }
        Ok(Self { words, labels: Labels::new(words, &header), header, unit, table, trees })
    }

    /// The class of a sample; the lowest of those with most votes.
    pub fn classify(&self, sample: &[i16; INPUTS]) -> u8 {
        let mut votes = [0; MOST_CLASSES];
        let mut at = self.trees;
        let mut left = self.header.trees;
        while left > 0 {
            // Before the second half nobody can have won. Then who leads by more than all votes that are left has.
            let some = if left > self.header.trees / 2 { left - self.header.trees / 2 } else { left.min(CHECK_EVERY) };
            at = self.vote(&mut votes, at, some, sample);
            left -= some;
            if lead(&votes) > self.unit.saturating_mul(u32::from(left)) {
                break;
            }
        }
        best(&votes)
    }

    /// Adds what the next `trees` trees say; where the tree behind them starts.
    fn vote(&self, votes: &mut [u32; MOST_CLASSES], mut at: usize, trees: u16, sample: &[i16; INPUTS]) -> usize {
        let classes = u16::from(self.header.classes);
        for _ in 0..trees {
            let Ok((start, end)) = trees::bounds(self.words, at, self.header.labels) else { break };
            at = end;
            let leaf = trees::walk::<1>(self.words, start, self.header.shift, sample).of(self.words);
            if leaf < classes {
                add(votes, leaf, self.unit);
                continue;
            }
            let entry = self.words.get(self.table + usize::from(leaf - classes)..).unwrap_or_default();
            let shares = entry.first().copied().unwrap_or(0);
            for share in entry.get(1..).unwrap_or_default().chunks_exact(3).take(usize::from(shares)) {
                if let &[class, low, high] = share {
                    add(votes, class, u32::from(low) | u32::from(high) << 16);
                }
            }
        }
        at
    }
}

/// Trees between two looks at who leads.
const CHECK_EVERY: u16 = 8;

fn add(votes: &mut [u32; MOST_CLASSES], class: u16, share: u32) {
    if let Some(votes) = votes.get_mut(usize::from(class)) {
        // Trees times unit fit 32 bits, checked once.
        *votes = votes.wrapping_add(share);
    }
}

/// The lowest of the classes with most votes.
fn best(votes: &[u32; MOST_CLASSES]) -> u8 {
    let (mut best, mut most) = (0, 0);
    for (class, &votes) in (0..).zip(votes) {
        if votes > most {
            (best, most) = (class, votes);
        }
    }
    best
}

/// By how much the first is ahead of the second.
fn lead(votes: &[u32; MOST_CLASSES]) -> u32 {
    let (mut first, mut second) = (0, 0);
    for &votes in votes {
        if votes > first {
            (first, second) = (votes, first);
        } else if votes > second {
            second = votes;
        }
    }
    first - second
}
