//! The layout of trees in the file: preorder, leaves in their parents, offsets only if both children are nodes.

use wstac_core::model::file::Input;
use wstac_core::model::file::MOST_SHIFT;
use wstac_core::model::trees::{FeatureBits, LEFT_LEAF, MOST_PENDING, NARROW, RIGHT_LEAF, SAME};

use super::super::integers::Part;
use super::push_long;

/// The size of leaves in the file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum LeafSize {
    /// A forest's leaves, with this many classes: in their parents if they fit, otherwise a half, or a byte.
    Votes { classes: u16 },
    /// One half.
    Half,
    /// Two halves.
    TwoHalves,
}

/// Returns all trees and the smallest sufficient shift of lengths and offsets.
pub(super) fn lay_out(trees: &[Vec<Part>], leaves: LeafSize, input: Input) -> Result<(Vec<u16>, u8), String> {
    let bits = FeatureBits::of(input);
    // Fast walks, which a shift of 0 allows, know ten bits of a feature.
    let least = u8::from(bits != FeatureBits::of(Input::Frames));
    'shifts: for shift in least..=MOST_SHIFT as u8 {
        let mut halves = Vec::new();
        for (number, tree) in trees.iter().enumerate() {
            let mut nodes = match nodes(tree, leaves, shift, bits) {
                Ok(nodes) => nodes,
                Err(Unfit::Offset) => continue 'shifts,
                Err(Unfit::Depth) => {
                    return Err(format!(
                        "tree {number} is too deep, expected {MOST_PENDING} open right children at most"
                    ));
                }
            };
            nodes.resize(nodes.len().next_multiple_of(1 << shift), 0);
            let Ok(length) = u16::try_from(nodes.len() >> shift) else { continue 'shifts };
            halves.push(length);
            halves.extend(nodes);
        }
        return Ok((halves, shift));
    }
    Err("a tree is too large, expected less than 32 MiB".into())
}

enum Unfit {
    /// An offset needs a larger shift.
    Offset,
    Depth,
}

/// Returns a tree's nodes; the root is the first part.
fn nodes(tree: &[Part], leaves: LeafSize, shift: u8, bits: FeatureBits) -> Result<Vec<u16>, Unfit> {
    let mut halves = Vec::new();
    // Nodes to come, and the position of the parent that needs their offset.
    let mut waiting = vec![(0, None)];
    while let Some((number, parent)) = waiting.pop() {
        let Some(part) = tree.get(number as usize) else { continue };
        if let Some(parent) = parent {
            let from_parent: usize = (halves.len() - parent as usize).next_multiple_of(1 << shift);
            halves.resize(parent as usize + from_parent, 0);
            halves[parent as usize + 2] = u16::try_from(from_parent >> shift).map_err(|_| Unfit::Offset)?;
        }
        let place = halves.len() as u32;
        let (input, threshold, left, right) = match *part {
            // A leaf that is not stored in its parent: a tree of its own, or one that does not fit there.
            Part::Leaf(leaf) => {
                push_same(&mut halves, leaf, leaves, bits);
                continue;
            }
            Part::Split { input, threshold, left, right } => (input, threshold, left, right),
        };
        let leaf = |number: u32| match tree.get(number as usize) {
            Some(&Part::Leaf(leaf)) => Some(leaf),
            _ => None,
        };
        let mut both = [leaf(left), leaf(right)];
        if let (LeafSize::Votes { classes }, [Some(leaf), None] | [None, Some(leaf)]) = (leaves, both)
            && leaf >= u32::from(classes.min(bits.most_single()))
        {
            both = [None; 2];
        }
        split(&mut halves, input, threshold, both, leaves, bits);
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
    Ok(halves)
}

/// Appends a node that ends in a leaf for every sample.
fn push_same(halves: &mut Vec<u16>, leaf: u32, size: LeafSize, bits: FeatureBits) {
    match size {
        LeafSize::Votes { .. } => halves.extend([LEFT_LEAF | RIGHT_LEAF | SAME, leaf as u16]),
        LeafSize::Half | LeafSize::TwoHalves => split(halves, 0, 0, [Some(leaf), Some(leaf)], size, bits),
    }
}

/// Appends one node.
fn split(halves: &mut Vec<u16>, input: u16, threshold: i16, both: [Option<u32>; 2], size: LeafSize, bits: FeatureBits) {
    let [left, right] = both;
    let mut node = input;
    node |= if left.is_some() { LEFT_LEAF } else { 0 } | if right.is_some() { RIGHT_LEAF } else { 0 };
    let leaves = both.into_iter().flatten();
    match (size, both) {
        // The offset of the right child, once it is known.
        (_, [None, None]) => halves.extend([node, threshold as u16, 0]),
        (LeafSize::Votes { .. }, [Some(left @ ..0x100), Some(right @ ..0x100)]) => {
            halves.extend([node | NARROW, threshold as u16, left as u16 | (right as u16) << 8]);
        }
        (LeafSize::Votes { .. }, [Some(leaf), None] | [None, Some(leaf)]) => {
            halves.extend([node | (leaf as u16) << bits.class_shift(), threshold as u16]);
        }
        _ => {
            halves.extend([node, threshold as u16]);
            for leaf in leaves {
                match size {
                    LeafSize::TwoHalves => push_long(halves, leaf),
                    LeafSize::Half | LeafSize::Votes { .. } => halves.push(leaf as u16),
                }
            }
        }
    }
}
