//! Writes model files: exactly what `wstac_core::model` reads, and nothing that it refuses.

mod boosted;
mod forest;
mod layout;
mod linear;
#[cfg(test)]
mod tests;

use wstac_core::model::Model;
use wstac_core::model::file::{HEADER_WORDS, MAGIC, MOST_CLASSES, Task, crc};

use super::trained::{Kind, Trained, frames};

/// How real numbers become integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Weights of linear models are int8 instead of int16.
    pub narrow_weights: bool,
    /// What leaves of boosted trees are.
    pub leaves: Leaves,
}

/// What leaves of boosted trees are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Leaves {
    /// Int16 where that is proven to give the same answers, otherwise float32.
    #[default]
    Auto,
    /// Int16, rounded where they must be.
    Int16,
    /// Float32 as they are.
    Float32,
}

/// A model file, and what writing it cost.
#[derive(Clone, Debug)]
pub struct Written {
    /// The file's words.
    pub words: Vec<u16>,
    /// How far decisions are those of the trained model, in words.
    pub exactness: String,
    /// By how much a score of a linear model, in its own units, may be off for any sample; 0 for trees.
    pub score_bound: f64,
}

impl Written {
    /// The file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// What a kind says of itself, to be put between header and labels.
struct Body {
    kind: u16,
    number: u16,
    trees: u16,
    shift: u8,
    words: Vec<u16>,
    exactness: String,
    score_bound: f64,
}

/// The model file of a trained model; `facts` is text about its training.
///
/// # Errors
/// What of the model cannot be written, and why.
pub fn write(model: &Trained, facts: &str, options: Options) -> Result<Written, String> {
    let classes = model.labels.len();
    if classes == 0 || classes > MOST_CLASSES {
        return Err(format!("{classes} classes, expected 1 to {MOST_CLASSES}"));
    }
    let frames = frames(model.inputs)?;
    let body = match &model.kind {
        Kind::Linear(linear) => linear::body(linear, classes, frames, options.narrow_weights)?,
        Kind::Forest(trees) => forest::body(trees, classes, model.inputs)?,
        Kind::Boosted(boosted) => boosted::body(boosted, classes, model.inputs, options.leaves)?,
    };
    let mut words = vec![0; HEADER_WORDS];
    words[..2].copy_from_slice(&MAGIC);
    let task = match model.task {
        Task::Other => 0,
        Task::Specimen => 1,
        Task::Pattern => 2,
        Task::Depth => 3,
    };
    words[6..12].copy_from_slice(&[body.kind, body.number, classes as u16, task, frames as u16, body.trees]);
    words[14] = u16::from(body.shift);
    words.extend(body.words);
    let labels = length(words.len())?;
    put(&mut words, 12, labels);
    for label in &model.labels {
        let units: Vec<u16> = label.encode_utf16().collect();
        let count = u16::try_from(units.len()).map_err(|_| "a label is longer than 65 535 characters".to_owned())?;
        words.push(count);
        words.extend(units);
    }
    let units: Vec<u16> = facts.encode_utf16().collect();
    push_long(&mut words, length(units.len())?);
    words.extend(units);
    if !words.len().is_multiple_of(2) {
        words.push(0);
    }
    let all = length(words.len())?;
    put(&mut words, 4, all);
    let sum = crc(&words, 4);
    put(&mut words, 2, sum);
    Model::from_words(&words).map_err(|error| format!("cannot be a model file: {error}"))?;
    Ok(Written { words, exactness: body.exactness, score_bound: body.score_bound })
}

fn length(words: usize) -> Result<u32, String> {
    u32::try_from(words).map_err(|_| format!("{words} words, expected a model below 8 GiB"))
}

fn put(words: &mut [u16], at: usize, long: u32) {
    words[at..at + 2].copy_from_slice(&[long as u16, (long >> 16) as u16]);
}

fn push_long(words: &mut Vec<u16>, long: u32) {
    words.extend([long as u16, (long >> 16) as u16]);
}
