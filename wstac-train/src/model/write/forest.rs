//! Forests: votes as integers, with leaves of several classes in a table.

use std::collections::HashMap;

use super::super::integers::{Part, integers};
use super::super::trained::{Tree, input_for};
use super::layout::{LeafSize, lay_out};
use super::{Body, push_long};

type Leaf = Vec<(u16, f64)>;

/// Largest denominator of leaves that is tried: that of a leaf with this many training samples.
const MOST_SAMPLES: u32 = 1024;
/// Largest deviation from a whole number, in float64, of a fraction times its number of samples.
///
/// The number of samples is up to `MOST_SAMPLES`.
const WHOLE: f64 = 1e-12;
/// Largest change of a fraction by float32, in which ONNX stores it; readers restore plain fractions.
const FLOAT32: f64 = 1.5e-7;
/// Largest number of halves in the table: leaves and classes number them together in 16 bits.
const MOST_HALVES: usize = 65_535;

/// A forest in integers.
pub(in crate::model) struct Votes {
    /// Its trees.
    ///
    /// A leaf below the number of classes belongs to that one class. Any other leaf, minus that number, is the position
    /// of its entry in the table.
    pub(in crate::model) trees: Vec<Vec<Part>>,
    /// The value of a vote of 1; times the number of trees it is below 2^32.
    pub(in crate::model) unit: u32,
    /// Entries: the number of classes with a fraction, then for each the class and its fraction (low half, high half).
    pub(in crate::model) table: Vec<u16>,
    /// Agreement of votes with those of the trained model, in words.
    pub(in crate::model) exactness: String,
}

/// Converts a forest's thresholds and votes to integers.
pub(in crate::model) fn votes(trees: &[Tree<Leaf>], classes: usize, inputs: usize) -> Result<Votes, String> {
    let count = u16::try_from(trees.len()).ok().filter(|&count| count > 0);
    let count = count.ok_or_else(|| format!("{} trees, expected 1 to 65535", trees.len()))?;
    let most = u32::MAX / u32::from(count);
    let whole = denominator(trees, most);
    // Coarser votes have fewer different leaves, so they are tried if the table becomes too long.
    let finest = most.ilog2().min(24);
    let mut least = usize::MAX;
    let units = whole.into_iter().chain([divisible(most)]).chain((4..=finest).rev().map(|bits| 1 << bits));
    for unit in units {
        let mut table =
            Table { classes: classes as u16, unit, words: Vec::new(), halves: 0, entries: HashMap::new(), off: 0.0 };
        let mut parts = Vec::with_capacity(trees.len());
        let mut bound = 0.0;
        for (number, tree) in trees.iter().enumerate() {
            table.off = 0.0;
            parts.push(integers(tree, inputs, |leaf| table.leaf(leaf)).map_err(|why| format!("tree {number}: {why}"))?);
            bound += table.off;
        }
        if table.halves > MOST_HALVES - classes {
            least = least.min(table.halves);
            continue;
        }
        let exactness = if whole == Some(unit) {
            "thresholds and votes are exact".into()
        } else {
            // Printed digits are rounded up.
            format!(
                "thresholds are exact; votes are in units of 1/{unit}: a class's sum is off by {:.2e} of {count} at most",
                1.01 * bound
            )
        };
        return Ok(Votes { trees: parts, unit, table: table.words, exactness });
    }
    Err(format!(
        "leaves that are not of one class take {least} halves in the coarsest units, expected at most {}; train with a larger \
         min_samples_leaf, a smaller max_depth or fewer trees, or until leaves are pure",
        MOST_HALVES - classes
    ))
}

pub(super) fn body(trees: &[Tree<Leaf>], classes: usize, inputs: usize) -> Result<Body, String> {
    let votes = votes(trees, classes, inputs)?;
    let (tree_halves, shift) = lay_out(&votes.trees, LeafSize::Votes { classes: classes as u16 }, input_for(inputs))?;
    let mut halves = Vec::new();
    push_long(&mut halves, votes.unit);
    push_long(&mut halves, super::length(votes.table.len())?);
    halves.extend(votes.table);
    halves.extend(tree_halves);
    let (count, exactness) = (trees.len() as u16, votes.exactness);
    Ok(Body { kind: 3, trees: count, shift, halves, exactness, ..Body::default() })
}

/// Returns the smallest common denominator of all fractions, or `None` if it is above `most`.
fn denominator(trees: &[Tree<Leaf>], most: u32) -> Option<u32> {
    let mut all = 1_u32;
    for leaf in trees.iter().flat_map(Tree::leaves) {
        let is_whole = |&(_, share): &(u16, f64), of: u32| {
            let scaled = share * f64::from(of);
            (scaled - scaled.round()).abs() <= WHOLE
        };
        if leaf.iter().all(|share| all <= MOST_SAMPLES && is_whole(share, all)) {
            continue;
        }
        let of = (1..=MOST_SAMPLES).find(|&of| leaf.iter().all(|share| is_whole(share, of)))?;
        all = all.checked_mul(of / greatest_common(all, of)).filter(|&all| all <= most)?;
    }
    Some(all)
}

/// Returns a number, at most `most` and above half of it, that all numbers from 1 to as many as possible divide.
///
/// The fractions of leaves with that many samples are then whole numbers of it, and equal votes stay equal.
fn divisible(most: u32) -> u32 {
    let mut all = 1_u32;
    for number in 2.. {
        match all.checked_mul(number / greatest_common(all, number)) {
            Some(next) if next <= most => all = next,
            _ => break,
        }
    }
    all * (most / all)
}

fn greatest_common(mut a: u32, mut b: u32) -> u32 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// Returns a leaf's fractions in whole units; their sum is at most the unit.
fn shares(leaf: &Leaf, unit: u32) -> Vec<(u16, u32)> {
    let sum: f64 = leaf.iter().map(|&(_, share)| share).sum();
    let exact = |share: f64| share / sum.max(1.0) * f64::from(unit);
    // The excess of each fraction, and its value.
    let mut all: Vec<(f64, u16, u32)> = leaf
        .iter()
        .map(|&(class, share)| {
            let exact = exact(share);
            (exact.round() - exact, class, exact.round() as u32)
        })
        .collect();
    let given: u64 = all.iter().map(|share| u64::from(share.2)).sum();
    // Rounding adds at most half a unit to each fraction that it increases. So there are twice as many of these as
    // units to take back.
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for share in all.iter_mut().take(given.saturating_sub(unit.into()) as usize) {
        share.2 = share.2.saturating_sub(1);
    }
    let mut shares: Vec<(u16, u32)> = all.into_iter().map(|(_, class, share)| (class, share)).collect();
    shares.sort_unstable();
    shares
}

/// The table of leaves that do not belong to a single class.
struct Table {
    classes: u16,
    unit: u32,
    words: Vec<u16>,
    /// Number of halves that it needs, even if that is above the limit.
    halves: usize,
    entries: HashMap<Vec<(u16, u32)>, u32>,
    /// Largest error of a fraction since the value was set to 0.
    off: f64,
}

impl Table {
    /// Returns a leaf's word: its class, or its position in the table.
    fn leaf(&mut self, leaf: &Leaf) -> Result<u32, String> {
        let sum: f64 = leaf.iter().map(|&(_, share)| share).sum();
        let fits = |&(class, share): &(u16, f64)| class < self.classes && (0.0..=1.001).contains(&share);
        if !leaf.iter().all(fits) || (sum - 1.0).abs() > 1e-3 {
            return Err(format!("weights {leaf:?} of classes, expected parts of 1 and classes below {}", self.classes));
        }
        let mut shares = shares(leaf, self.unit);
        for (class, share) in leaf {
            let given = shares.iter().find(|given| given.0 == *class).map_or(0, |given| given.1);
            let stored = if leaf.len() > 1 { FLOAT32 } else { 0.0 };
            self.off = self.off.max((f64::from(given) / f64::from(self.unit) - share).abs() + stored);
        }
        shares.retain(|&(_, share)| share > 0);
        if let [(class, share)] = shares[..]
            && share == self.unit
        {
            return Ok(u32::from(class));
        }
        if shares.is_empty() {
            return Err(format!("weights {leaf:?} of classes are too small"));
        }
        if let Some(&word) = self.entries.get(&shares) {
            return Ok(word);
        }
        // Positions that do not fit are detected at the end.
        let word = self.words.len() as u32 + u32::from(self.classes);
        self.halves += 1 + 3 * shares.len();
        if self.halves <= MOST_HALVES {
            self.words.push(shares.len() as u16);
            for &(class, share) in &shares {
                self.words.push(class);
                push_long(&mut self.words, share);
            }
        }
        self.entries.insert(shares, word);
        Ok(word)
    }
}
