//! Boosted trees as XGBoost saves them, in JSON or UBJSON.

use serde::Deserialize;
use wstac_core::model::file::{Input, MOST_CLASSES};

use super::trained::{Boosted, Kind, MOST_NODES, Node, Origin, Score, Trained, Tree, guess_task};

/// Reads the file from JSON text.
///
/// # Errors
/// The text cannot be read; the message names the fault and the key before it.
pub(super) fn from_json(text: &[u8]) -> Result<XgboostFile, String> {
    serde_json::from_slice(text).map_err(|error| {
        let line = text.split(|&byte| byte == b'\n').nth(error.line().saturating_sub(1)).unwrap_or_default();
        let before = &line[..error.column().min(line.len())];
        // The last `"key":` before it: it is the only clue to tokens that are not numbers (NaN, Infinity).
        let key = before.windows(2).rposition(|two| two == b"\":").and_then(|end| {
            let start = before[..end].iter().rposition(|&byte| byte == b'"')?;
            std::str::from_utf8(&before[start + 1..end]).ok().filter(|key| key.len() < 100)
        });
        key.map_or_else(|| format!("JSON: {error}"), |key| format!("JSON: {error}, in {key}"))
    })
}

/// The parts of a file that are read; all others are skipped.
#[derive(Deserialize)]
pub(super) struct XgboostFile {
    learner: Learner,
    #[serde(default)]
    version: Vec<u32>,
}

#[derive(Deserialize)]
struct Learner {
    #[serde(default)]
    attributes: Attributes,
    gradient_booster: Booster,
    #[serde(rename = "learner_model_param")]
    parameters: Parameters,
    objective: Objective,
}

#[derive(Default, Deserialize)]
struct Attributes {
    best_iteration: Option<String>,
}

#[derive(Deserialize)]
struct Parameters {
    base_score: String,
    num_class: String,
    num_feature: String,
    #[serde(default = "one")]
    num_target: String,
}

fn one() -> String {
    "1".into()
}

#[derive(Deserialize)]
struct Objective {
    name: String,
}

#[derive(Deserialize)]
struct Booster {
    name: String,
    model: Option<Model>,
}

#[derive(Deserialize)]
struct Model {
    /// Boosters of unknown kinds do not have it.
    gbtree_model_param: Option<TreesParameters>,
    #[serde(default)]
    tree_info: Vec<u32>,
    #[serde(default)]
    trees: Vec<XgbTree>,
}

#[derive(Deserialize)]
struct TreesParameters {
    #[serde(default = "one")]
    num_parallel_tree: String,
}

#[derive(Deserialize)]
struct XgbTree {
    left_children: Vec<i32>,
    right_children: Vec<i32>,
    split_indices: Vec<u32>,
    split_conditions: Vec<f32>,
    #[serde(default)]
    split_type: Vec<u8>,
    #[serde(default)]
    default_left: Vec<Flag>,
    tree_param: TreeParameters,
}

/// A truth value, which versions write as a number or as a word.
#[derive(Deserialize)]
#[serde(untagged)]
enum Flag {
    Number(u8),
    Word(bool),
}

#[derive(Deserialize)]
struct TreeParameters {
    #[serde(default = "one")]
    size_leaf_vector: String,
}

const OBJECTIVES: &str = "multi:softprob, multi:softmax or binary:logistic";

/// Reads the model in a file, with the labels given or with the numbers of its classes.
pub(super) fn read(file: XgboostFile, labels: Option<Vec<String>>) -> Result<(Trained, Origin), String> {
    let version: Vec<String> = file.version.iter().map(u32::to_string).collect();
    let Learner { attributes, gradient_booster, parameters, objective } = file.learner;
    if gradient_booster.name != "gbtree" {
        return Err(format!("gradient_booster.name is \"{}\", expected \"gbtree\"", gradient_booster.name));
    }
    let model = gradient_booster.model.ok_or("gradient_booster.model is missing")?;
    let trees = model.gbtree_model_param.ok_or("gradient_booster.model.gbtree_model_param is missing")?;
    let classes = number(&parameters.num_class, "num_class")?;
    let binary = objective.name == "binary:logistic";
    let (classes, scores) = match objective.name.as_str() {
        "multi:softprob" | "multi:softmax" => (classes, classes),
        "binary:logistic" => (2, 1),
        other => return Err(format!("objective.name is \"{other}\", expected {OBJECTIVES}")),
    };
    if !(1..=MOST_CLASSES).contains(&classes) {
        return Err(format!("num_class is {classes}, expected 1 to {MOST_CLASSES}"));
    }
    if parameters.num_target != "1" {
        return Err(format!("num_target is {}, expected 1", parameters.num_target));
    }
    let inputs = number(&parameters.num_feature, "num_feature")?;
    let mut starts = starts(&parameters.base_score, scores)?;
    let mut bound = 0.0;
    if binary {
        for start in &mut starts {
            if !(*start > 0.0 && *start < 1.0) {
                return Err(format!("base_score is {start}, expected a probability above 0 and below 1"));
            }
            let score = score_of(*start);
            if !score.is_finite() {
                return Err(format!("base_score is {start}, expected a probability that is not almost 0 or 1"));
            }
            *start = score;
        }
        // The smallest scores above 0 are still a probability of 0.5 in float32, which is not above 0.5.
        bound = 1.5 / 16_777_216.0;
    }
    if model.tree_info.len() != model.trees.len() {
        let counts = (model.tree_info.len(), model.trees.len());
        return Err(format!("tree_info has {} numbers for {} trees, expected one for each", counts.0, counts.1));
    }
    let nodes: usize = model.trees.iter().map(|tree| tree.left_children.len()).sum();
    if nodes > MOST_NODES {
        return Err(format!("trees have {nodes} nodes, expected at most {MOST_NODES}"));
    }
    let mut remarks = Vec::new();
    if objective.name == "multi:softprob" {
        // Probabilities are float32: XGBoost treats scores as equal that are closer than its rounding.
        remarks.push("the highest score wins, also where XGBoost rounds two probabilities to the same: scores that differ by less than 2.4e-7".into());
    }
    let has_side = |side| model.trees.iter().flat_map(sides).any(|left| left == side);
    if has_side(true) && has_side(false) {
        let why = "its training had missing values: with missing=0, answers for features of 0 differ";
        remarks.push(format!("warning: {why}; help: train it with missing=numpy.nan"));
    }
    let mut used = model.trees.len();
    if let Some(best) = &attributes.best_iteration {
        // Training stopped early: later trees are in the file, but predictions leave them out.
        let parallel = number(&trees.num_parallel_tree, "num_parallel_tree")?;
        let best = number(best, "attributes.best_iteration")?;
        used = used.min(best.saturating_add(1).saturating_mul(parallel).saturating_mul(scores));
        if used < model.trees.len() {
            let all = model.trees.len();
            remarks.push(format!(
                "{used} of {all} trees are used, as XGBClassifier does: attributes.best_iteration is {best}"
            ));
        }
    }
    let mut all: Vec<Score> = starts.into_iter().map(|start| Score { start, trees: Vec::new() }).collect();
    for (number, (tree, score)) in model.trees.into_iter().zip(model.tree_info).take(used).enumerate() {
        let Some(score) = all.get_mut(score as usize) else {
            return Err(format!("tree_info[{number}] is {score}, expected a score below {scores}"));
        };
        score.trees.push(self::tree(tree).map_err(|why| format!("trees[{number}].{why}"))?);
    }
    let labels = labels.unwrap_or_else(|| {
        remarks.push("the file has no names of classes, so they are numbers: --labels names them".into());
        (0..classes).map(|class| class.to_string()).collect()
    });
    if labels.len() != classes {
        return Err(format!("has {classes} classes, and --labels names {}", labels.len()));
    }
    let task = guess_task(&labels);
    let kind = Kind::Boosted(Boosted { scores: all, bound });
    Ok((
        Trained { labels, task, input: Input::Frames, inputs, speeds: None, kind, remarks, mean: None },
        Origin { tool: format!("XGBoost {}", version.join(".")), spreads: Vec::new() },
    ))
}

/// Iterates over the splits of a tree: whether they send missing values to the left.
///
/// All of a model do, or none (by its `tree_method`), unless values were missing in its training.
fn sides(tree: &XgbTree) -> impl Iterator<Item = bool> {
    let splits = tree.default_left.iter().zip(&tree.left_children).filter(|(_, left)| **left >= 0);
    splits.map(|(flag, _)| !matches!(flag, Flag::Number(0) | Flag::Word(false)))
}

/// Returns the score of a probability: XGBoost's start, in float32 with the system's own logarithm.
///
/// Other libraries' logarithms round differently.
fn score_of(probability: f32) -> f32 {
    -(1.0 / probability - 1.0).ln()
}

fn number(text: &str, what: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("{what} is \"{text}\", expected a number"))
}

/// Returns the start values of scores: one number, or since 3.1 a list.
fn starts(text: &str, scores: usize) -> Result<Vec<f32>, String> {
    let list = text.trim().trim_start_matches('[').trim_end_matches(']');
    let starts: Result<Vec<f32>, _> = list.split(',').map(|start| start.trim().parse::<f32>()).collect();
    match starts {
        Ok(starts) if starts.len() == scores && starts.iter().all(|start| start.is_finite()) => Ok(starts),
        Ok(starts) if starts.len() == 1 && starts[0].is_finite() => Ok(vec![starts[0]; scores]),
        _ => Err(format!("base_score is \"{text}\", expected a number, or a list of {scores}")),
    }
}

fn tree(tree: XgbTree) -> Result<Tree<f32>, String> {
    if tree.tree_param.size_leaf_vector.parse::<u32>().is_ok_and(|size| size > 1) {
        let size = tree.tree_param.size_leaf_vector;
        return Err(format!("tree_param.size_leaf_vector is {size}, expected 0 or 1: trees of one score each"));
    }
    let count = tree.left_children.len();
    let lengths = [
        ("right_children", tree.right_children.len()),
        ("split_indices", tree.split_indices.len()),
        ("split_conditions", tree.split_conditions.len()),
    ];
    for (name, length) in lengths {
        if length != count {
            return Err(format!("{name} has {length} numbers, expected {count} as left_children"));
        }
    }
    if let Some(node) = tree.split_type.iter().position(|&kind| kind != 0) {
        return Err(format!("split_type[{node}] is categorical, expected numerical splits"));
    }
    let mut nodes = Vec::with_capacity(count);
    for node in 0..count {
        let (left, right) = (tree.left_children[node], tree.right_children[node]);
        let value = tree.split_conditions[node];
        if !value.is_finite() {
            return Err(format!("split_conditions[{node}] is {value}, expected a finite number"));
        }
        nodes.push(match (usize::try_from(left), usize::try_from(right)) {
            (Err(_), Err(_)) => Node::Leaf(value),
            (Ok(left), Ok(right)) => {
                let input = tree.split_indices[node] as usize;
                Node::Split { input, threshold: f64::from(value), strict: true, left, right }
            }
            _ => return Err(format!("left_children[{node}] is {left} and right_children[{node}] {right}, expected two children or two −1")),
        });
    }
    Ok(Tree { nodes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_are_those_of_xgboost_to_the_bit() {
        // XGBoost 3.2.0 gives this as output_margin without trees.
        assert_eq!(score_of(0.26).to_bits(), 3_213_222_477);
        assert_eq!(score_of(0.5).to_bits(), (-0.0_f32).to_bits());
    }
}
