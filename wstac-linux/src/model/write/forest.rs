//! Forests: votes as integers, leaves that are not of one class in a table.

use std::collections::HashMap;

use super::super::integers::{Part, integers};
use super::super::trained::{Node, Tree};
use super::layout::{LeafSize, lay_out};
use super::{Body, push_long};

type Leaf = Vec<(u16, f64)>;

/// Denominators of leaves that are looked for: those of leaves with up to so many training samples.
const MOST_SAMPLES: u32 = 1024;
/// How far a float32 share that was divided by the number of trees may be from what it was.
const NEAR: f64 = 1e-6;

/// A forest in integers.
pub(in crate::model) struct Votes {
    /// Its trees. A leaf below the number of classes is all one class's; another one, less that number, is the place of its
    /// entry in the table.
    pub(in crate::model) trees: Vec<Vec<Part>>,
    /// What a vote of 1 counts; times the trees it is below 2^32.
    pub(in crate::model) unit: u32,
    /// Entries: how many classes have a share, then for each the class and its share (the low half, the high half).
    pub(in crate::model) table: Vec<u16>,
    /// How far votes are those of the trained model, in words.
    pub(in crate::model) exactness: String,
}

/// A forest's thresholds and votes as integers.
pub(in crate::model) fn votes(trees: &[Tree<Leaf>], classes: usize, inputs: usize) -> Result<Votes, String> {
    let count = u16::try_from(trees.len()).ok().filter(|&count| count > 0);
    let count = count.ok_or_else(|| format!("{} trees, expected 1 to 65535", trees.len()))?;
    let most = u32::MAX / u32::from(count);
    let whole = denominator(trees, most);
    // Coarser votes have fewer different leaves, so they are tried where the table gets too long.
    let finest = most.ilog2().min(24);
    let units = whole.into_iter().chain((4..=finest).rev().map(|bits| 1 << bits));
    for unit in units {
        let mut table = Table { classes: classes as u16, unit, words: Vec::new(), entries: HashMap::new(), off: 0.0 };
        let mut parts = Vec::with_capacity(trees.len());
        let mut bound = 0.0;
        for (number, tree) in trees.iter().enumerate() {
            table.off = 0.0;
            parts.push(integers(tree, inputs, |leaf| table.leaf(leaf)).map_err(|why| format!("tree {number}: {why}"))?);
            bound += table.off;
        }
        if table.words.len() > usize::from(u16::MAX) - classes {
            continue;
        }
        let exactness = if whole == Some(unit) {
            "thresholds and votes are exact".into()
        } else {
            format!(
                "thresholds are exact; votes are in units of 1/{unit}: a class's sum is off by {bound:.2e} of {count} at most"
            )
        };
        return Ok(Votes { trees: parts, unit, table: table.words, exactness });
    }
    Err("its leaves differ too much, expected at most 65535 halves of different leaves".into())
}

pub(super) fn body(trees: &[Tree<Leaf>], classes: usize, inputs: usize) -> Result<Body, String> {
    let votes = votes(trees, classes, inputs)?;
    let (tree_halves, shift) = lay_out(&votes.trees, LeafSize::Votes { classes: classes as u16 })?;
    let mut halves = Vec::new();
    push_long(&mut halves, votes.unit);
    push_long(&mut halves, super::length(votes.table.len())?);
    halves.extend(votes.table);
    halves.extend(tree_halves);
    Ok(Body {
        kind: 3,
        number: 0,
        trees: trees.len() as u16,
        shift,
        halves,
        exactness: votes.exactness,
        score_bound: 0.0,
    })
}

/// The least number of which all shares are whole parts, where it is `most` at most.
fn denominator(trees: &[Tree<Leaf>], most: u32) -> Option<u32> {
    let mut all = 1_u32;
    for tree in trees {
        for node in &tree.nodes {
            let Node::Leaf(leaf) = node else { continue };
            let is_whole = |&(_, share): &(u16, f64), of: u32| {
                let scaled = share * f64::from(of);
                (scaled - scaled.round()).abs() <= NEAR * f64::from(of).min(64.0)
            };
            if leaf.iter().all(|share| is_whole(share, all) && all <= MOST_SAMPLES) {
                continue;
            }
            let of = (1..=MOST_SAMPLES).find(|&of| leaf.iter().all(|share| is_whole(share, of)))?;
            all = all.checked_mul(of / greatest_common(all, of)).filter(|&all| all <= most)?;
        }
    }
    Some(all)
}

fn greatest_common(mut a: u32, mut b: u32) -> u32 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The table of leaves that are not all one class's.
struct Table {
    classes: u16,
    unit: u32,
    words: Vec<u16>,
    entries: HashMap<Vec<(u16, u32)>, u32>,
    /// The most that a share was off since it was set to 0.
    off: f64,
}

impl Table {
    /// A leaf's word: its class, or its place in the table.
    fn leaf(&mut self, leaf: &Leaf) -> Result<u32, String> {
        let sum: f64 = leaf.iter().map(|&(_, share)| share).sum();
        let fits = |&(class, share): &(u16, f64)| class < self.classes && (0.0..=1.0 + NEAR).contains(&share);
        if !leaf.iter().all(fits) || (sum - 1.0).abs() > 1e-3 {
            return Err(format!("weights {leaf:?} of classes, expected parts of 1 and classes below {}", self.classes));
        }
        let unit = f64::from(self.unit);
        let mut shares: Vec<(u16, u32)> =
            leaf.iter().map(|&(class, share)| (class, (share * unit).round() as u32)).collect();
        shares.sort_unstable();
        // Rounding may give more than there is to give away: that is taken back where it was most.
        while shares.iter().map(|&(_, share)| u64::from(share)).sum::<u64>() > u64::from(self.unit) {
            let exact = |class| leaf.iter().find(|share| share.0 == class).map_or(0.0, |share| share.1 * unit);
            let excess = |&(class, share): &(u16, u32)| f64::from(share) - exact(class);
            let Some(most) = shares.iter_mut().max_by(|a, b| excess(a).total_cmp(&excess(b))) else { break };
            most.1 = most.1.saturating_sub(1);
        }
        for (class, share) in leaf {
            let given = shares.iter().find(|given| given.0 == *class).map_or(0, |given| given.1);
            self.off = self.off.max((f64::from(given) / unit - share).abs());
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
        let place = self.words.len() as u32;
        let word = *self.entries.entry(shares.clone()).or_insert(place + u32::from(self.classes));
        // Too many are found out in the end; their places do not matter then.
        if word == place + u32::from(self.classes) && u16::try_from(place).is_ok() {
            self.words.push(shares.len() as u16);
            for (class, share) in shares {
                self.words.push(class);
                push_long(&mut self.words, share);
            }
        }
        Ok(word)
    }
}
