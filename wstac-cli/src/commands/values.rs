//! Parsers of the values of arguments: numbers, and words that stand for something.

use std::fmt::Display;
use std::ops::RangeBounds;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use wstac_core::model::file::{Input, Task};

/// Returns a parser of whole numbers that refuses those below `least`.
pub(super) fn at_least<T>(least: T) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Copy,
{
    move |text: &str| {
        let number = text.parse().ok().filter(|number| *number >= least);
        number.ok_or_else(|| format!("expected a whole number, {least} or more"))
    }
}

/// Returns a parser of numbers in a range, which `expected` describes.
pub(super) fn within(
    range: impl RangeBounds<f64> + Clone,
    expected: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text: &str| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("expected {expected}"))
    }
}

/// Returns a parser of a part of something, from 0 to below 1.
pub(super) fn fraction() -> impl Fn(&str) -> Result<f64, String> + Clone {
    within(0.0..1.0, "at least 0 and below 1, such as 0.02")
}

/// Returns a parser of words, each with its value.
pub(super) fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    words: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let value = move |word: String| words.iter().find(|(known, _)| *known == word).map(|(_, value)| *value);
    PossibleValuesParser::new(words.map(|(word, _)| word)).try_map(move |word| value(word).ok_or("is not known"))
}

/// Returns a parser of the sample that a model takes.
pub(super) fn sample() -> impl TypedValueParser<Value = Input> {
    one_of([Input::Frames, Input::Path, Input::TaxelPath, Input::Taxels].map(|input| match input {
        // Options have hyphens between words.
        Input::TaxelPath => ("taxel-path", input),
        _ => (input.name(), input),
    }))
}

/// Returns a parser of the task of a model.
pub(super) fn task() -> impl TypedValueParser<Value = Task> {
    one_of([Task::Specimen, Task::Pattern, Task::Depth, Task::Other].map(|task| (task.name(), task)))
}
