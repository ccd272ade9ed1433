//! What is in a model file.

use serde::Serialize;
use wstac_core::model::Model;
use wstac_core::model::file::{HEADER_WORDS, Task};
use wstac_core::model::trees::{LEFT_LEAF, RIGHT_LEAF};

/// What a model file holds.
#[derive(Clone, Debug, Serialize)]
pub struct Inspected {
    /// How it decides.
    pub kind: &'static str,
    /// What weights or leaves are.
    pub numbers: &'static str,
    /// What it tells apart.
    pub task: &'static str,
    /// Labels of its classes.
    pub labels: Vec<String>,
    /// Frames of the sample that it needs.
    pub frames: u8,
    /// Bytes of flash or memory that it takes.
    pub bytes: usize,
    /// Weighted sums; none in trees.
    pub rows: Option<u16>,
    /// Trees, where there are any.
    pub trees: Option<Trees>,
    /// What its trainer wrote.
    pub training: String,
}

/// What trees hold, and how much work they are.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Trees {
    /// Trees.
    pub count: usize,
    /// Splits of all trees.
    pub splits: usize,
    /// Splits from root to leaf, of the deepest tree.
    pub depth: usize,
    /// Splits visited for a sample, at most.
    pub visits_worst: usize,
    /// Splits visited for a sample where each leaf of a tree is as likely as any other.
    pub visits_mean: f64,
}

/// A task's name.
pub fn task_name(task: Task) -> &'static str {
    match task {
        Task::Other => "other",
        Task::Specimen => "specimen",
        Task::Pattern => "pattern",
        Task::Depth => "depth",
    }
}

/// What is in a model file that has been checked.
pub fn inspect(model: &Model, words: &[u16]) -> Inspected {
    let word = |at: usize| words.get(at).copied().unwrap_or(0);
    let long = |at: usize| usize::from(word(at)) | usize::from(word(at + 1)) << 16;
    let (kind, trees) = match model {
        Model::Linear(_) if word(6) == 1 => ("linear, one against the rest", None),
        Model::Linear(_) => ("linear, one against one", None),
        Model::Forest(_) => ("forest", Some(HEADER_WORDS + 4 + long(HEADER_WORDS + 2))),
        Model::Boosted(_) => ("boosted trees", Some(HEADER_WORDS + 3 + 3 * usize::from(word(HEADER_WORDS)))),
    };
    let leaf_words = if matches!(model, Model::Boosted(_)) && word(7) == 3 { 2 } else { 1 };
    Inspected {
        kind,
        numbers: match word(7) {
            1 => "int8",
            2 => "int16",
            3 => "float32",
            _ => "votes",
        },
        task: task_name(model.task()),
        labels: (0..model.labels().len())
            .filter_map(|class| model.labels().get(class))
            .map(|label| label.to_string())
            .collect(),
        frames: model.frames(),
        bytes: 2 * words.len(),
        rows: trees.is_none().then(|| word(HEADER_WORDS)),
        trees: trees.map(|start| count(words, start, usize::from(word(11)), leaf_words)),
        training: model.labels().training().map_or_else(String::new, |text| text.to_string()),
    }
}

fn count(words: &[u16], mut at: usize, trees: usize, leaf_words: usize) -> Trees {
    let word = |at: usize| words.get(at).copied().unwrap_or(LEFT_LEAF | RIGHT_LEAF);
    let shift = word(14);
    let mut all = Trees { count: trees, ..Trees::default() };
    for _ in 0..trees {
        let (start, length) = match word(at) {
            0 => (at + 3, usize::from(word(at + 1)) | usize::from(word(at + 2)) << 16),
            length => (at + 1, usize::from(length)),
        };
        at = start + length;
        let (mut deepest, mut leaves, mut depths) = (0, 0_usize, 0_usize);
        // The check before has seen that this ends.
        let mut waiting = vec![(start, 1)];
        while let Some((node, depth)) = waiting.pop() {
            all.splits += 1;
            let (left, right) = (word(node) & LEFT_LEAF != 0, word(node) & RIGHT_LEAF != 0);
            let ends = usize::from(left) + usize::from(right);
            leaves += ends;
            depths += ends * depth;
            deepest = deepest.max(depth);
            match (left, right) {
                (true, true) => {}
                (false, false) => {
                    waiting.extend([(node + 3, depth + 1), (node + (usize::from(word(node + 2)) << shift), depth + 1)]);
                }
                _ => waiting.push((node + 2 + leaf_words, depth + 1)),
            }
        }
        all.depth = all.depth.max(deepest);
        all.visits_worst += deepest;
        all.visits_mean += depths as f64 / leaves.max(1) as f64;
    }
    all
}
