//! How trees lie in the file: preorder, leaves in their parents, offsets only where both children are nodes.

use wstac_core::model::trees::{LEFT_LEAF, NARROW, RIGHT_LEAF};

use super::super::integers::Part;
use super::push_long;

/// What leaves are in the file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum LeafSize {
    /// A word, or a byte where both leaves of a node fit one.
    WordOrByte,
    /// A word.
    Word,
    /// Two words.
    TwoWords,
}

/// Right children that may wait while a tree is checked: what the core has room for.
const MOST_PENDING: usize = 256;

/// All trees, with the smallest shift of offsets that is enough, and that shift.
pub(super) fn lay_out(trees: &[Vec<Part>], leaves: LeafSize) -> Result<(Vec<u16>, u8), String> {
    'shifts: for shift in 0..=8 {
        let mut words = Vec::new();
        for (number, tree) in trees.iter().enumerate() {
            match nodes(tree, leaves, shift) {
                Ok(nodes) => {
                    if let Ok(length) = u16::try_from(nodes.len()) {
                        words.push(length);
                    } else {
                        words.push(0);
                        push_long(&mut words, super::length(nodes.len())?);
                    }
                    words.extend(nodes);
                }
                Err(Unfit::Offset) => continue 'shifts,
                Err(Unfit::Depth) => {
                    return Err(format!(
                        "tree {number} is too deep, expected {MOST_PENDING} open right children at most"
                    ));
                }
            }
        }
        return Ok((words, shift));
    }
    Err("a tree is too large, expected left subtrees below 32 MiB".into())
}

enum Unfit {
    /// An offset needs a larger shift.
    Offset,
    Depth,
}

/// A tree's nodes; the root is the first part. A tree of one leaf becomes a split with that leaf on both sides.
fn nodes(tree: &[Part], leaves: LeafSize, shift: u8) -> Result<Vec<u16>, Unfit> {
    let mut words = Vec::new();
    if let [Part::Leaf(leaf)] = *tree {
        split(&mut words, 0, 0, [Some(leaf), Some(leaf)], leaves);
    }
    // Nodes to come, and the place of the parent that wants their offset.
    let mut waiting = vec![(0, None)];
    let leaf = |number: u32| match tree.get(number as usize) {
        Some(&Part::Leaf(leaf)) => Some(leaf),
        _ => None,
    };
    while let Some((number, parent)) = waiting.pop() {
        let Some(&Part::Split { input, threshold, left, right }) = tree.get(number as usize) else { continue };
        if let Some(parent) = parent {
            let from_parent: usize = (words.len() - parent as usize).next_multiple_of(1 << shift);
            words.resize(parent as usize + from_parent, 0);
            words[parent as usize + 2] = u16::try_from(from_parent >> shift).map_err(|_| Unfit::Offset)?;
        }
        let place = words.len() as u32;
        let both = [leaf(left), leaf(right)];
        split(&mut words, input, threshold, both, leaves);
        match both {
            [None, None] => waiting.extend([(right, Some(place)), (left, None)]),
            [Some(_), None] => waiting.push((right, None)),
            [None, Some(_)] => waiting.push((left, None)),
            [Some(_), Some(_)] => {}
        }
        if waiting.len() > MOST_PENDING {
            return Err(Unfit::Depth);
        }
    }
    Ok(words)
}

/// One node.
fn split(words: &mut Vec<u16>, input: u16, threshold: i16, both: [Option<u32>; 2], size: LeafSize) {
    let [left, right] = both;
    let mut flags = if left.is_some() { LEFT_LEAF } else { 0 } | if right.is_some() { RIGHT_LEAF } else { 0 };
    if let (LeafSize::WordOrByte, [Some(left @ ..0x100), Some(right @ ..0x100)]) = (size, both) {
        flags |= NARROW;
        words.extend([input | flags, threshold as u16, left as u16 | (right as u16) << 8]);
        return;
    }
    words.extend([input | flags, threshold as u16]);
    for leaf in both.into_iter().flatten() {
        match size {
            LeafSize::TwoWords => push_long(words, leaf),
            LeafSize::Word | LeafSize::WordOrByte => words.push(leaf as u16),
        }
    }
    if both == [None, None] {
        // The offset of the right child, once it is known.
        words.push(0);
    }
}
