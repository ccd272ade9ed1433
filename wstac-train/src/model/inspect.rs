//! The contents of a model file.

use std::fmt;

use serde::{Serialize, Serializer};
use wstac_core::model::Model;
use wstac_core::model::file::HEADER_HALVES;
use wstac_core::model::trees::{LEFT_LEAF, RIGHT_LEAF, SAME};

use super::eval::labels_of;

/// The kind of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ModelKind {
    /// One weighted sum per class: the largest decides.
    OneVsRest,
    /// One weighted sum per pair of classes: votes decide.
    OneVsOne,
    /// Trees whose leaves are answers.
    Forest,
    /// Trees whose leaves are added up.
    Boosted,
    /// Layers of weighted sums.
    Network,
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OneVsRest => "linear, one-vs-rest",
            Self::OneVsOne => "linear, one-vs-one",
            Self::Forest => "forest",
            Self::Boosted => "boosted trees",
            Self::Network => "network",
        })
    }
}

impl Serialize for ModelKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The content of a model file.
#[derive(Clone, Debug, Serialize)]
pub struct Inspected {
    /// The kind of model.
    pub kind: ModelKind,
    /// The number type of the weights or leaves.
    pub numbers: &'static str,
    /// Its task.
    pub task: &'static str,
    /// Labels of its classes.
    pub labels: Vec<String>,
    /// The sample that it takes: `frames`, `path` or `taxel_path`.
    pub input: &'static str,
    /// Frames of the sample that it needs; of a path, tens of its numbers.
    pub frames: u8,
    /// The speeds of the slides that it was trained on, from and to, in mm/s; `None` if it does not say so.
    pub speeds_mm_s: Option<[u16; 2]>,
    /// Whether it says how sure an answer is.
    pub calibrated: bool,
    /// Whether it says what is unknown.
    pub tells_unknown: bool,
    /// Bytes of flash or memory that it takes.
    pub bytes: usize,
    /// Number of weighted sums of a linear model; `None` for others.
    pub rows: Option<u16>,
    /// Number of weighted sums of each layer of a network, the scores last; `None` for others.
    pub layers: Option<Vec<usize>>,
    /// The trees, if there are any.
    pub trees: Option<Trees>,
    /// The text that its trainer wrote.
    pub training: String,
}

/// The contents and the work of trees.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Trees {
    /// Number of trees.
    pub count: usize,
    /// Splits of all trees.
    pub splits: usize,
    /// Splits from root to leaf, of the deepest tree.
    pub depth: usize,
    /// Largest number of splits visited for a sample.
    pub visits_worst: usize,
    /// Mean number of splits visited for a sample if all leaves of a tree are equally likely.
    pub visits_mean: f64,
}

/// Returns the contents of a model file that has been checked.
pub fn inspect(model: &Model, words: &[u32]) -> Inspected {
    let half = |at: usize| half(words, at);
    let long = |at: usize| usize::from(half(at)) | usize::from(half(at + 1)) << 16;
    let (kind, trees) = match model {
        Model::LinearSvm(_) if half(6) == 1 => (ModelKind::OneVsRest, None),
        Model::LinearSvm(_) => (ModelKind::OneVsOne, None),
        Model::Forest(_) => (ModelKind::Forest, Some(HEADER_HALVES + 4 + long(HEADER_HALVES + 2))),
        Model::Boosted(_) => (ModelKind::Boosted, Some(HEADER_HALVES + 3 + 3 * usize::from(half(HEADER_HALVES)))),
        Model::Network(_) => (ModelKind::Network, None),
    };
    // Halves of a node with one leaf.
    let single = match model {
        Model::Boosted(_) if half(7) == 3 => 4,
        Model::Boosted(_) => 3,
        _ => 2,
    };
    Inspected {
        kind,
        numbers: match half(7) {
            1 => "int8",
            2 => "int16",
            3 => "float32",
            4 => "int32",
            _ => "votes",
        },
        task: model.task().name(),
        labels: labels_of(model),
        input: model.input().name(),
        frames: model.frames(),
        speeds_mm_s: model.known_speeds().map(|speeds| [speeds.slowest(), speeds.fastest()]),
        calibrated: model.is_calibrated(),
        tells_unknown: model.tells_unknown(),
        bytes: 4 * words.len(),
        rows: matches!(model, Model::LinearSvm(_)).then(|| half(HEADER_HALVES)),
        layers: if let Model::Network(network) = model { Some(network.widths().collect()) } else { None },
        trees: trees.map(|start| count(words, start, usize::from(half(11)), single)),
        training: model.labels().training().to_string(),
    }
}

/// Returns a half of a file; beyond the end, a leaf's node.
fn half(words: &[u32], at: usize) -> u16 {
    words.get(at / 2).map_or(LEFT_LEAF | RIGHT_LEAF, |word| (word >> (16 * (at % 2))) as u16)
}

/// Flags of a forest's node whose two leaves are the same.
const TWICE: u16 = LEFT_LEAF | RIGHT_LEAF | SAME;

fn count(words: &[u32], mut at: usize, trees: usize, single: usize) -> Trees {
    let half = |at: usize| half(words, at);
    let shift = half(14) & 0xFF;
    let mut all = Trees { count: trees, ..Trees::default() };
    for _ in 0..trees {
        let start = at + 1;
        at = start + (usize::from(half(at)) << shift);
        let (mut deepest, mut leaves, mut depths) = (0, 0_usize, 0_usize);
        // The preceding check guarantees that this ends.
        let mut waiting = vec![(start, 1)];
        while let Some((node, depth)) = waiting.pop() {
            if single == 2 && half(node) & TWICE == TWICE {
                // A leaf that is not part of its parent.
                (leaves, depths, deepest) = (leaves + 1, depths + depth - 1, deepest.max(depth - 1));
                continue;
            }
            all.splits += 1;
            let (left, right) = (half(node) & LEFT_LEAF != 0, half(node) & RIGHT_LEAF != 0);
            let ends = usize::from(left) + usize::from(right);
            leaves += ends;
            depths += ends * depth;
            deepest = deepest.max(depth);
            match (left, right) {
                (true, true) => {}
                (false, false) => {
                    waiting.extend([(node + 3, depth + 1), (node + (usize::from(half(node + 2)) << shift), depth + 1)]);
                }
                _ => waiting.push((node + single, depth + 1)),
            }
        }
        all.depth = all.depth.max(deepest);
        all.visits_worst += deepest;
        all.visits_mean += depths as f64 / leaves.max(1) as f64;
    }
    all
}
