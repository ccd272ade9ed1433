//! A trained model as its trainer saved it: every reader produces it and the writer takes it.
//!
//! Inputs are in the order of data sets: input n k + t is feature k of frame t, of n frames. Features are the natural
//! logarithms that a trainer sees, so an integer x of a sample is x / 2048. Of 25 taxels over time, input 70 i + t is
//! taxel i of frame t.

use wstac_core::model::file::{Input, TAXEL_INPUTS, Task};
use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, TAXELS};

/// Largest number of nodes in all trees together: they take far more memory here than in a file.
pub const MOST_NODES: usize = 1 << 24;

/// A model of any kind, with its classes.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The names of its classes.
    pub labels: Vec<String>,
    /// Its task.
    pub task: Task,
    /// The sample that it takes.
    pub input: Input,
    /// Number of inputs in its training: ten for each frame, or 1,750 of taxels.
    pub inputs: usize,
    /// The speeds of the slides that it was trained on; `None` if they are not known.
    pub speeds: Option<KnownSpeeds>,
    /// Its kind of decision.
    pub kind: Kind,
    /// Notes for the user that are not in its file.
    pub remarks: Vec<String>,
    /// The mean of each input; rounded weights of a linear model are exact for it. `None` adds no correction.
    pub mean: Option<Vec<f64>>,
}

/// A model's kind of decision.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Weighted sums.
    Linear(Linear),
    /// Trees that vote with class weights.
    Forest(Vec<Tree<Vec<(u16, f64)>>>),
    /// Trees that add up to scores.
    Boosted(Boosted),
    /// Layers of weighted sums.
    Network(Network),
}

/// Weighted sums: a row for each class, a row for each pair of classes, or a single row for two classes.
#[derive(Clone, Debug)]
pub struct Linear {
    /// `true` if rows belong to pairs of classes: 0 and 1, 0 and 2 … 1 and 2 …; above 0 the first class wins.
    pub pairs: bool,
    /// Rows.
    pub rows: Vec<Row>,
}

impl Linear {
    /// Subtracts from the rows of classes what all of them share, which decides nothing.
    ///
    /// The largest weight is smaller then, and with it the unit of all.
    pub(super) fn drop_shared(&mut self) {
        if self.pairs || self.rows.len() < 2 {
            return;
        }
        let length = self.rows.iter().map(|row| row.weights.len()).min().unwrap_or(0);
        let middle = |of: &dyn Fn(&Row) -> f64| {
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            let (least, most) = self.rows.iter().map(of).fold(ends, |ends, x| (ends.0.min(x), ends.1.max(x)));
            f64::midpoint(least, most)
        };
        let weights: Vec<f64> = (0..length).map(|input| middle(&|row| row.weights[input])).collect();
        let bias = middle(&|row| row.bias);
        for row in &mut self.rows {
            row.weights.iter_mut().zip(&weights).for_each(|(weight, shared)| *weight -= shared);
            row.bias -= bias;
        }
    }
}

/// Layers of weighted sums; what is below 0 in a hidden one is 0 (ReLU).
#[derive(Clone, Debug)]
pub struct Network {
    /// Hidden layers, and at last the scores: one for each class, or a single one for two classes.
    pub layers: Vec<Vec<Row>>,
    /// Largest value of each sum of the hidden layers, from a data set; `None` takes all usual features into account.
    pub tops: Option<Vec<Vec<f64>>>,
}

/// How a trainer's file came about.
#[derive(Debug)]
pub(super) struct Origin {
    /// The tool that trained the model.
    pub(super) tool: String,
    /// How far float32 numbers, of which the sums of pairs are computed, move each of them for usual features: standard
    /// deviations. It is empty if they are not known.
    pub(super) spreads: Vec<f64>,
}

impl Network {
    /// Returns the sums of each layer for a sample in the order of data sets.
    pub(super) fn sums(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let mut values = x.to_vec();
        let layer = |layer: &Vec<Row>| {
            let sums: Vec<f64> = layer.iter().map(|row| row.sum(&values)).collect();
            values = sums.iter().map(|sum| sum.max(0.0)).collect();
            sums
        };
        self.layers.iter().map(layer).collect()
    }
}

/// A weighted sum.
#[derive(Clone, Debug)]
pub struct Row {
    /// A weight for each input.
    pub weights: Vec<f64>,
    /// The start value of the sum.
    pub bias: f64,
}

impl Row {
    /// Returns the sum of these inputs.
    pub(super) fn sum(&self, x: &[f64]) -> f64 {
        self.bias + self.weights.iter().zip(x).map(|(weight, x)| weight * x).sum::<f64>()
    }

    /// Returns the least and the largest sum of inputs in these ranges.
    pub(super) fn ends(&self, ranges: &[[f64; 2]]) -> (f64, f64) {
        ends(self.bias, self.weights.iter().copied().zip(ranges.iter().copied()))
    }
}

/// Returns the least and the largest sum of a bias and of weights times numbers, each in its range.
pub(super) fn ends(bias: f64, terms: impl Iterator<Item = (f64, [f64; 2])>) -> (f64, f64) {
    terms.fold((bias, bias), |(least, most), (weight, range)| {
        let ends = range.map(|end| weight * end);
        (least + ends[0].min(ends[1]), most + ends[0].max(ends[1]))
    })
}

/// Trees that add up to scores.
#[derive(Clone, Debug)]
pub struct Boosted {
    /// One score for each class, or a single one for two classes.
    pub scores: Vec<Score>,
    /// Bound of a single score: above it the second class is the answer.
    pub bound: f32,
}

/// The parts that add up to one score.
#[derive(Clone, Debug)]
pub struct Score {
    /// Its start value.
    pub start: f32,
    /// Its trees, in the order in which they are added.
    pub trees: Vec<Tree<f32>>,
}

/// A tree; its first node is the root.
#[derive(Clone, Debug)]
pub struct Tree<L> {
    /// Nodes in any order.
    pub nodes: Vec<Node<L>>,
}

impl<L> Tree<L> {
    /// Iterates over the leaves.
    pub fn leaves(&self) -> impl Iterator<Item = &L> {
        self.nodes.iter().filter_map(|node| if let Node::Leaf(leaf) = node { Some(leaf) } else { None })
    }
}

/// A node of a tree.
#[derive(Clone, Debug)]
pub enum Node<L> {
    /// A split, which goes left if the input is at most the threshold.
    Split {
        /// Number of the input.
        input: usize,
        /// The threshold.
        threshold: f64,
        /// `true` if the input must be below the threshold to go left.
        strict: bool,
        /// Number of the left child.
        left: usize,
        /// Number of the right child.
        right: usize,
    },
    /// A leaf with its value.
    Leaf(L),
}

/// Returns the number of frames for a number of inputs: of taxels, the tens of inputs, as in a model file.
///
/// # Errors
/// There are not ten inputs for each of 1 to 70 frames, nor 1,750.
pub fn frames(inputs: usize) -> Result<usize, String> {
    if inputs == 0 || !inputs.is_multiple_of(FEATURES) || inputs > FEATURES * SAMPLE_FRAMES && inputs != TAXEL_INPUTS {
        return Err(format!(
            "{inputs} inputs, expected 700, or ten for each of the first frames, or 1750: of X, X_path or X_taxel_path, or \
             X_taxels, which wstac dataset writes with --input frames, path, taxel-path or taxels"
        ));
    }
    Ok(inputs / FEATURES)
}

/// Returns the input that a number of inputs is for, if it is that of taxels or of ten features.
pub(crate) const fn input_for(inputs: usize) -> Input {
    if inputs == TAXEL_INPUTS { Input::Taxels } else { Input::Frames }
}

/// Returns the position of a data set's input in a model file, which is ordered frame by frame. More than 70 frames are
/// the tens of inputs of taxels.
pub fn file_order(input: usize, frames: usize) -> usize {
    if frames > SAMPLE_FRAMES {
        return TAXELS * (input % SAMPLE_FRAMES) + input / SAMPLE_FRAMES;
    }
    FEATURES * (input % frames) + input / frames
}

/// Returns a sample in the order of a model file, with zeros behind it; it is in that of a data set: feature after
/// feature, of 70 frames each.
pub fn in_file_order(sample: &[i16]) -> [i16; TAXEL_INPUTS] {
    let mut ordered = [0; TAXEL_INPUTS];
    for (input, &number) in sample.iter().enumerate() {
        if let Some(place) = ordered.get_mut(file_order(input, frames_in(sample))) {
            *place = number;
        }
    }
    ordered
}

/// Returns a sample in the order of a model file, as long as it is in that of a data set.
pub fn vec_in_file_order(sample: &[i16]) -> Vec<i16> {
    in_file_order(sample)[..sample.len()].to_vec()
}

/// Returns a sample in the order of a data set; it is in that of a model file: frame after frame.
pub fn in_set_order(sample: &[i16]) -> Vec<i16> {
    (0..sample.len()).map(|input| sample[file_order(input, frames_in(sample))]).collect()
}

/// Returns the frames of a whole sample, for [`file_order`].
fn frames_in(sample: &[i16]) -> usize {
    sample.len() / FEATURES
}

/// Returns a sample in the order of a model file with zeros behind it, as models take it.
pub fn padded(sample: &[i16]) -> [i16; TAXEL_INPUTS] {
    let mut padded = [0; TAXEL_INPUTS];
    padded.iter_mut().zip(sample).for_each(|(place, number)| *place = *number);
    padded
}

/// Returns the most likely task for classes of these names.
pub fn guess_task(labels: &[String]) -> Task {
    let is_pattern = |label: &str| matches!(label, "Fla" | "Sin" | "Saw" | "Tri" | "Sphere");
    let is_depth = |label: &str| label.parse::<f64>().is_ok_and(|depth| (0.0..=10.0).contains(&depth));
    // Numbers alone may be any label.
    let is_usual_depth = |label: &str| label.parse::<f64>().is_ok_and(|depth| [0.0, 2.0, 3.0, 4.0].contains(&depth));
    let specimen = |label: &String| match label.split_at_checked(3) {
        Some((pattern, depth)) => label == "Sphere" || is_pattern(pattern) && is_depth(depth),
        None => false,
    };
    let numbered = labels.iter().enumerate().all(|(number, label)| *label == number.to_string());
    if labels.iter().all(specimen) {
        Task::Specimen
    } else if labels.iter().all(|label| is_pattern(label)) {
        Task::Pattern
    } else if !numbered && labels.iter().all(|label| is_usual_depth(label)) {
        Task::Depth
    } else {
        Task::Other
    }
}
