//! Models as Rust: a source file that an application compiles in, with a condition for every split.
//!
//! It answers as the model file does for every sample, in fewer instructions and more bytes. `tree` describes its shape
//! and `bases` its conditions. It needs only `core`, and has no `unsafe`, no computed indices, no panics and no
//! allocation.

mod bases;
mod boosted;
mod forest;
mod tree;

use std::fmt::Write;

use wstac_core::model::file::Input;

use super::integers::Part;
use super::trained::{Kind, Trained, frames};
use super::write::{Options, boosted::sums, forest::votes};

/// Generated Rust.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file's text.
    pub text: String,
    /// Agreement of decisions with those of the trained model, in words.
    pub exactness: String,
}

/// Returns Rust code that answers as a model does.
///
/// `file` and `tool` are the trained model's file name and the tool that trained it.
///
/// # Errors
/// A part of the model cannot be written; the message names it and the reason. Linear models can never be written.
pub fn source(model: &Trained, file: &str, tool: &str, options: Options) -> Result<Source, String> {
    let classes = super::write::classes(model)?;
    let frames = frames(model.inputs)?;
    if model.input == Input::Taxels {
        return Err("takes 1750 numbers, and Rust code 700: use the table (--backend table)".into());
    }
    let (body, exactness, trees) = match &model.kind {
        Kind::Linear(_) | Kind::Network(_) => {
            return Err(
                "is a linear model or a network, which Rust code would not make faster: use the table (--backend table)".into()
            );
        }
        Kind::Forest(trees) => {
            let votes = votes(trees, classes, model.inputs)?;
            (forest::body(&votes, classes), votes.exactness, votes.trees)
        }
        Kind::Boosted(boosted) => {
            let sums = sums(boosted, classes, model.inputs, options.leaves)?;
            (
                boosted::body(&sums, classes),
                sums.exactness,
                sums.scores.into_iter().flat_map(|(_, trees)| trees).collect(),
            )
        }
    };
    let splits: usize = trees.iter().map(|tree| tree::splits(tree)).sum();
    let labels: Vec<String> = model.labels.iter().map(|label| format!("{label:?}")).collect();
    let mut text = String::new();
    let _ = write!(
        text,
        "// Made by `wstac model import` from the file {file:?} of {tool:?}: do not edit.\n\
         // {classes} classes, {} trees, {splits} splits; {exactness}.\n\
         \n/// The names of the classes.\n#[rustfmt::skip]\n#[allow(dead_code)]\n\
         pub const LABELS: [&str; {classes}] = [{}];\n\
         \n/// Frames of the sample that it needs, from the first on: 1 to 70.\n#[allow(dead_code)]\n\
         pub const FRAMES: usize = {frames};\n",
        trees.len(),
        labels.join(", "),
    );
    text.push_str(&body);
    Ok(Source { text, exactness })
}

/// Returns the function that answers, with the body inside; `all` are its trees.
fn classify(bases: &bases::Bases, body: &str) -> String {
    let numbers: Vec<String> = bases.0.iter().map(ToString::to_string).collect();
    format!(
        "\n/// The class of a sample: 700 numbers, frame by frame.\n#[rustfmt::skip]\n\
         #[allow(unused, clippy::all, clippy::pedantic)]\npub fn classify(s: &[i16; 700]) -> u8 {{\n    \
         // Numbers that thresholds are compared with stay in registers only where the compiler does not know \
         them.\n    \
         let bases: &[i32; {}] = core::hint::black_box(&[{}]);\n{body}}}\n",
        numbers.len(),
        numbers.join(", "),
    )
}

/// Splits consecutive trees into groups for functions of at most a fixed number of splits.
///
/// A single tree with more splits is a group of its own.
fn chunks<'t, 'p>(trees: &'t [&'p Vec<Part>]) -> Vec<&'t [&'p Vec<Part>]> {
    // With 3000, a forest of 12290 splits took 1 % more bytes and instructions of a Cortex-M4.
    const MOST_SPLITS: usize = 1600;
    let (mut chunks, mut start, mut splits) = (Vec::new(), 0, 0);
    for (at, tree) in trees.iter().enumerate() {
        if at > start && splits + tree::splits(tree) > MOST_SPLITS {
            chunks.push(&trees[start..at]);
            (start, splits) = (at, 0);
        }
        splits += tree::splits(tree);
    }
    chunks.extend((start < trees.len()).then_some(&trees[start..]));
    chunks
}
