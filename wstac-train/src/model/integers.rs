//! Conversion of trees of real numbers to trees of integers: thresholds in units of 1/2048, without redundant splits.

use std::fmt::Write;

use super::trained::{Kind, Node, Trained, Tree, file_order};

/// A part of a tree with inputs in the order of the file and int16 thresholds; leaves are words.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// A split that goes left if the input is at most the threshold.
    Split { input: u16, threshold: i16, left: u32, right: u32 },
    /// A leaf of up to two words.
    Leaf(u32),
}

/// The integers for which a split goes left: up to a threshold, always or never.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Left {
    UpTo(i16),
    Always,
    Never,
}

/// Returns the integers x for which x / 2048 is at most, or below, a threshold; it may be infinite.
///
/// This is exact, because a float64 times 2048 is.
pub(super) fn left(threshold: f64, strict: bool) -> Left {
    let scaled = threshold * 2048.0;
    let most = if strict { scaled.ceil() - 1.0 } else { scaled.floor() };
    if most >= f64::from(i16::MAX) {
        Left::Always
    } else if most < f64::from(i16::MIN) {
        Left::Never
    } else {
        Left::UpTo(most as i16)
    }
}

/// Returns the hints for a model: its remarks, and a warning if no integer is on both sides of most of its splits.
pub(super) fn hints(model: &Trained) -> String {
    let mut hints = String::new();
    for remark in &model.remarks {
        let _ = write!(hints, "; {remark}");
    }
    let (beyond, all) = beyond(model);
    if all == 0 && matches!(model.kind, Kind::Forest(_) | Kind::Boosted(_)) && model.labels.len() > 1 {
        hints += "; warning: no tree has a split, so that all answers are the same";
    }
    if 2 * beyond > all {
        let _ = write!(
            hints,
            "; warning: {beyond} of {all} thresholds are beyond all features: was it trained on X times its scale?"
        );
    }
    hints
}

/// Returns how many thresholds of trees have no integer on both sides, and how many there are.
pub(super) fn beyond(model: &Trained) -> (usize, usize) {
    match &model.kind {
        Kind::Linear(_) | Kind::Network(_) => (0, 0),
        Kind::Forest(trees) => count_beyond(trees),
        Kind::Boosted(boosted) => count_beyond(boosted.scores.iter().flat_map(|score| &score.trees)),
    }
}

/// Counts the splits that have no integer on both sides, and all splits.
fn count_beyond<'t, L: 't>(trees: impl IntoIterator<Item = &'t Tree<L>>) -> (usize, usize) {
    let (mut beyond, mut all) = (0, 0);
    for node in trees.into_iter().flat_map(|tree| &tree.nodes) {
        if let Node::Split { threshold, strict, .. } = node {
            all += 1;
            beyond += usize::from(!matches!(left(*threshold, *strict), Left::UpTo(_)));
        }
    }
    (beyond, all)
}

/// Checks a tree and converts its thresholds to integers; the root comes first.
///
/// It checks that every node is reached at most once, and that children, inputs and numbers are possible. An error
/// names the node.
pub(super) fn integers<L>(
    tree: &Tree<L>,
    inputs: usize,
    mut leaf_word: impl FnMut(&L) -> Result<u32, String>,
) -> Result<Vec<Part>, String> {
    if tree.nodes.is_empty() {
        return Err("has no node".into());
    }
    check(tree, inputs)?;
    let frames = inputs / wstac_core::params::FEATURES;
    let mut parts: Vec<Part> = Vec::new();
    // Waiting nodes, and where their number goes: the position of a split, and whether it is its right child.
    let mut waiting = vec![(0, None)];
    while let Some((mut node, parent)) = waiting.pop() {
        let part = loop {
            match &tree.nodes[node] {
                Node::Leaf(leaf) => break Part::Leaf(leaf_word(leaf).map_err(|why| format!("node {node}: {why}"))?),
                Node::Split { input, threshold, strict, left: to_left, right } => match left(*threshold, *strict) {
                    // The check guarantees that there is no cycle.
                    Left::Always => node = *to_left,
                    Left::Never => node = *right,
                    Left::UpTo(threshold) => {
                        let place = parts.len();
                        waiting.push((*right, Some((place, true))));
                        waiting.push((*to_left, Some((place, false))));
                        let input = file_order(*input, frames) as u16;
                        break Part::Split { input, threshold, left: 0, right: 0 };
                    }
                },
            }
        };
        let number = parts.len() as u32;
        if let Some((place, is_right)) = parent
            && let Some(Part::Split { left, right, .. }) = parts.get_mut(place)
        {
            *(if is_right { right } else { left }) = number;
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check<L>(tree: &Tree<L>, inputs: usize) -> Result<(), String> {
    let mut reached = vec![false; tree.nodes.len()];
    let mut waiting = vec![0];
    while let Some(node) = waiting.pop() {
        let Some(reached) = reached.get_mut(node) else {
            return Err(format!("node {node} is a child, expected one of {} nodes", tree.nodes.len()));
        };
        if std::mem::replace(reached, true) {
            return Err(format!("node {node} is reached twice, expected one parent for each node"));
        }
        if let Node::Split { input, threshold, left, right, .. } = &tree.nodes[node] {
            if *input >= inputs {
                return Err(format!("node {node}: input {input}, expected an input below {inputs}"));
            }
            if threshold.is_nan() {
                return Err(format!("node {node}: threshold {threshold}, expected a number"));
            }
            waiting.extend([*right, *left]);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_at_extremes() {
        for (threshold, strict, expected) in [
            (0.0, false, Left::UpTo(0)),
            (-0.0, true, Left::UpTo(-1)),
            (0.5 / 2048.0, false, Left::UpTo(0)),
            (0.5 / 2048.0, true, Left::UpTo(0)),
            (-0.5 / 2048.0, false, Left::UpTo(-1)),
            (-0.5 / 2048.0, true, Left::UpTo(-1)),
            (-16.0, false, Left::UpTo(i16::MIN)),
            (-16.0, true, Left::Never),
            (-16.000_001, false, Left::Never),
            (-15.999_999_9, true, Left::UpTo(i16::MIN)),
            (32_767.0 / 2048.0, false, Left::Always),
            (32_767.0 / 2048.0, true, Left::UpTo(32_766)),
            (32_766.0 / 2048.0, false, Left::UpTo(32_766)),
            (f64::MAX, false, Left::Always),
            (f64::MIN, true, Left::Never),
            (f64::INFINITY, true, Left::Always),
            (f64::NEG_INFINITY, false, Left::Never),
            (f64::MIN_POSITIVE, true, Left::UpTo(0)),
            (-f64::MIN_POSITIVE, false, Left::UpTo(-1)),
        ] {
            assert_eq!(left(threshold, strict), expected, "{threshold} {strict}");
        }
    }

    #[test]
    fn every_integer_goes_where_real_numbers_say() {
        let mut threshold = -17.0_f64;
        while threshold < 17.0 {
            for strict in [false, true] {
                let found = left(threshold, strict);
                for x in i16::MIN..=i16::MAX {
                    let real = f64::from(x) / 2048.0;
                    let expected = if strict { real < threshold } else { real <= threshold };
                    let goes = match found {
                        Left::UpTo(most) => x <= most,
                        Left::Always => true,
                        Left::Never => false,
                    };
                    assert_eq!(goes, expected, "{x} {threshold} {strict}");
                }
            }
            threshold += 1.125 + 1.0 / 4096.0;
        }
    }

    fn split(input: usize, threshold: f64, left: usize, right: usize) -> Node<u32> {
        Node::Split { input, threshold, strict: false, left, right }
    }

    #[test]
    fn impossible_trees_are_refused_by_node() {
        let leaf = || Node::Leaf(0);
        for (nodes, says) in [
            (vec![], "no node"),
            (vec![split(0, 0.0, 0, 1), leaf()], "node 0 is reached twice"),
            (vec![split(0, 0.0, 1, 1), leaf()], "node 1 is reached twice"),
            (vec![split(0, 0.0, 1, 2), leaf()], "node 2 is a child"),
            (vec![split(700, 0.0, 1, 2), leaf(), leaf()], "node 0: input 700"),
            (vec![split(0, f64::NAN, 1, 2), leaf(), leaf()], "node 0: threshold NaN"),
            (vec![split(0, 0.0, 1, 2), leaf(), split(9, f64::NAN, 3, 4), leaf(), leaf()], "node 2: threshold NaN"),
        ] {
            let error = integers(&Tree { nodes }, 700, |leaf| Ok(*leaf)).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
