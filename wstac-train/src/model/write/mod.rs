//! Writes model files; `wstac_core::model` reads every one of them and rejects none.

pub(super) mod boosted;
pub(super) mod forest;
mod layout;
pub(super) mod linear;
mod network;
#[cfg(test)]
mod tests;

use wstac_core::model::Model;
use wstac_core::model::file::{HEADER_HALVES, MAGIC, MAGIC_2, MOST_CLASSES, crc};
use wstac_core::model::labels::LONGEST_LABEL;
use wstac_core::model::speeds::KnownSpeeds;

use super::integers;
use super::trained::{Kind, Trained, frames};

/// Units in a feature value of 1.
const ONE: f64 = wstac_core::params::FEATURE_ONE as f64;

/// Options for the conversion of real numbers to integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The type of weights of linear models and networks; `None` is int16, or int32 for a linear model whose answers
    /// rounding to int16 may change; an import that compares answers also makes it int32 for others.
    pub weights: Option<Weights>,
    /// The type of leaves in boosted trees.
    pub leaves: Leaves,
}

/// The type of weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// 8 bits.
    Int8,
    /// 16 bits.
    Int16,
    /// 31 bits: twice as large and as slow as int16.
    Int32,
}

/// The type of leaves in boosted trees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Leaves {
    /// Int16 if it is proven to give the same answers, otherwise float32.
    #[default]
    Auto,
    /// Int16, rounded if necessary.
    Int16,
    /// Float32, unchanged.
    Float32,
}

/// A model file, and the loss of accuracy in writing it.
#[derive(Clone, Debug)]
pub struct Written {
    /// The file's words.
    pub words: Vec<u32>,
    /// Agreement of decisions with those of the trained model, in words.
    pub exactness: String,
    /// Largest error of a score of a linear model, in its own units, for the features of a camera of 8 bits; 0 for
    /// other models.
    ///
    /// It sums the rounding errors of weights and bias in the worst row. Each weight's error is multiplied by the end
    /// of the feature range that makes it worse. Sums of products are exact.
    pub score_bound: f64,
}

impl Written {
    /// Returns the file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// The part of the file between header and labels, which depends on the kind.
#[derive(Default)]
struct Body {
    kind: u16,
    number: u16,
    trees: u16,
    shift: u8,
    halves: Vec<u16>,
    exactness: String,
    score_bound: f64,
}

/// Writes the model file of a trained model; `facts` is text about its training.
///
/// # Errors
/// A part of the model cannot be written; the message names it and the reason.
pub fn write(model: &Trained, facts: &str, options: Options) -> Result<Written, String> {
    let classes = classes(model)?;
    let frames = frames(model.inputs)?;
    let body = match &model.kind {
        Kind::Linear(linear) => linear::body(linear, classes, frames, options.weights, model.mean.as_deref())?,
        Kind::Network(network) => network::body(network, classes, frames, options.weights, model.mean.as_deref())?,
        Kind::Forest(trees) => forest::body(trees, classes, model.inputs)?,
        Kind::Boosted(boosted) => boosted::body(boosted, classes, model.inputs, options.leaves)?,
    };
    let mut halves = vec![0; HEADER_HALVES];
    // Software before version 0.4 refuses the second layout by its name.
    halves[..2].copy_from_slice(if body.number == 4 || body.kind == 5 { &MAGIC_2 } else { &MAGIC });
    let task = model.task.number();
    halves[6..12].copy_from_slice(&[body.kind, body.number, classes as u16, task, frames as u16, body.trees]);
    let [slowest, fastest] = model.speeds.map_or([0; 2], KnownSpeeds::in_file).map(u16::from);
    halves[9] |= fastest << 8;
    halves[14] = u16::from(body.shift) | slowest << 8;
    halves[15] = model.input.number();
    halves.extend(body.halves);
    let labels = length(halves.len())?;
    halves[12..14].copy_from_slice(&[labels as u16, (labels >> 16) as u16]);
    let mut bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
    for label in &model.labels {
        if label.len() > LONGEST_LABEL {
            return Err(format!("label {label:?} has {} bytes, expected at most {LONGEST_LABEL}", label.len()));
        }
        bytes.push(label.len() as u8);
        bytes.extend(label.as_bytes());
    }
    let count = u16::try_from(facts.len());
    let count = count.map_err(|_| format!("{} bytes of training facts, expected at most 65535", facts.len()))?;
    bytes.extend(count.to_le_bytes());
    bytes.extend(facts.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    words[2] = length(words.len())?;
    words[1] = crc(&words);
    Model::from_words(&words).map_err(|error| format!("cannot be a model file: {error}"))?;
    let exactness = body.exactness + &integers::hints(model);
    Ok(Written { words, exactness, score_bound: body.score_bound })
}

pub(super) fn classes(model: &Trained) -> Result<usize, String> {
    let classes = model.labels.len();
    if classes == 0 || classes > MOST_CLASSES {
        return Err(format!("{classes} classes, expected 1 to {MOST_CLASSES}"));
    }
    Ok(classes)
}

fn length(units: usize) -> Result<u32, String> {
    u32::try_from(units).map_err(|_| format!("{units} halves, expected a model below 8 GiB"))
}

fn push_long(halves: &mut Vec<u16>, long: u32) {
    halves.extend([long as u16, (long >> 16) as u16]);
}
