//! `wstac model eval` applies a model to a data set.

use std::io::Write;
use std::path::PathBuf;

use super::super::dataset::pool;
use super::super::dataset::recorded::read_all;
use super::super::files::ends;
use super::super::output::{Stop, note};
use super::super::signals::{Ending, finishing};
use wstac_host::model_file::ModelFile;
use wstac_host::plural::counted;
use wstac_host::texture::confidence_of;
use wstac_host::visible::OneLine;
use wstac_train::model::eval::{Answers, Truth, answers, answers_of_recordings, why_without_truth};

/// Measure a model's accuracy and confusions on data or recordings
///
/// The data set is an .npz file with X, int16 of shape (n, 10, 70) or (n, 700), as wstac dataset writes it. A model of
/// another input takes X_path, X_taxel_path or X_taxels instead. Accuracy and confusions need the true labels: the
/// array y, or y_specimen, y_pattern or y_depth by the model's task. For a model of other names it is y, or a
/// y_specimen that has some of these names. If a data set has only patterns or depths, those of the answered specimen
/// are compared.
///
/// Recordings need the label specimen, as for wstac train. Every event is a sample.
///
/// A sample has no answer if it is all zeros (such as a slide without a velocity), or if the model says that it is
/// unknown. It counts as wrong, as in wstac train.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The model: a file, builtin or builtin:NAME
    #[arg(value_name = "FILE.wsm")]
    model: PathBuf,

    /// Data set (.npz), recording (.mcap) or folder of recordings
    #[arg(value_name = "DATA")]
    data: PathBuf,

    /// Print one JSON object instead of text
    ///
    /// Its keys are n, right, accuracy and accuracy_of_answered (null without true labels), answered (the number of
    /// samples with an answer) and predictions (one label per sample, also without an answer); for a model that tells
    /// them also confidence and known, one for each sample.
    #[arg(long)]
    json: bool,
}

/// The column of samples without an answer.
const NONE: &str = "none";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let file = ModelFile::open(&arguments.model)?;
    let model = file.model()?;
    let data = &arguments.data;
    let is_recorded = data.is_dir() || ends(data, "mcap");
    let answers = if is_recorded {
        let recordings = read_all(std::slice::from_ref(data), None, model.input(), &pool(None)?)?;
        finishing(Ending::AtOnce);
        answers_of_recordings(&model, &recordings)?
    } else {
        answers(&model, data)?
    };
    let n = answers.predictions.len();
    let (right, answered) = (answers.right(), answers.answered());
    let accuracy = right.filter(|_| n > 0).map(|right| right as f64 / n as f64);
    if let Some(truth) = &answers.truth {
        let (labels, samples) = truth.of_no_class();
        if samples > 0 {
            let (model, data) = (arguments.model.display(), arguments.data.display());
            let (known, from, labels) = (some(&answers.labels), &truth.from, some(&labels));
            note(format_args!(
                "{model} names {known}; {from} of {data} also has {labels}: {samples} of {n} samples cannot be right"
            ));
        }
    }
    let mut out = std::io::BufWriter::new(super::super::output::stdout());
    if arguments.json {
        let label = |class: &u8| answers.labels.get(usize::from(*class)).map_or("", String::as_str);
        let predictions: Vec<&str> = answers.predictions.iter().map(label).collect();
        let of_answered = right.filter(|_| answered > 0).map(|right| right as f64 / answered as f64);
        let mut json = serde_json::json!({
            "n": n,
            "right": right,
            "accuracy": accuracy,
            "answered": answered,
            "accuracy_of_answered": of_answered,
            "predictions": predictions,
        });
        if let Some(confidences) = &answers.confidences {
            json["confidence"] = confidences.iter().map(|&units| confidence_of(units)).collect();
        }
        if let Some(known) = &answers.known {
            json["known"] = known.as_slice().into();
        }
        writeln!(out, "{json}")?;
        return Ok(out.flush()?);
    }
    let samples = counted(n, "sample");
    if let (Some(truth), Some(accuracy), Some(right)) = (&answers.truth, accuracy, right) {
        writeln!(out, "{:.2} % right: {right} of {samples}, by {}", 100.0 * accuracy, OneLine(&truth.from))?;
        if (1..n).contains(&answered) {
            let share = 100.0 * right as f64 / answered as f64;
            writeln!(out, "{share:.2} % right of those with an answer: {right} of {answered}")?;
        }
        if let Some(known) = &answers.known {
            let known = known.iter().filter(|known| **known).count();
            writeln!(out, "{:.2} % known: {known} of {n}", 100.0 * known as f64 / n as f64)?;
        }
        confusions(&mut out, &answers, truth)?;
    } else {
        writeln!(out, "{samples}, without truth: {}", why_without_truth(&model, data)?)?;
        let given = |class: usize| {
            let of_class = answers.predictions.iter().enumerate().filter(|(_, answer)| usize::from(**answer) == class);
            of_class.filter(|(row, _)| answers.is_answered(*row)).count()
        };
        for (class, label) in answers.labels.iter().enumerate() {
            writeln!(out, "{:>12} {:6}", OneLine(label), given(class))?;
        }
        if answered < n {
            writeln!(out, "{NONE:>12} {:6}", n - answered)?;
        }
    }
    Ok(out.flush()?)
}

/// Returns the first labels, joined.
fn some(labels: &[impl AsRef<str>]) -> String {
    const MOST: usize = 12;
    let first: Vec<&str> = labels.iter().take(MOST).map(AsRef::as_ref).collect();
    first.join(", ") + if labels.len() > MOST { ", …" } else { "" }
}

/// Prints how often each label got each answer.
fn confusions(out: &mut impl Write, answers: &Answers, truth: &Truth) -> Result<(), Stop> {
    writeln!(out, "\n{:>12}  answers", "truth")?;
    write!(out, "{:12}", "")?;
    answers.labels.iter().try_for_each(|label| write!(out, " {:>6}", OneLine(label)))?;
    let has_none = answers.answered() < answers.predictions.len();
    if has_none {
        write!(out, " {NONE:>6}")?;
    }
    writeln!(out)?;
    let classes = answers.labels.len();
    let columns = classes + usize::from(has_none);
    let mut counts = vec![0_u32; truth.labels.len() * columns];
    for (row, (answer, number)) in answers.predictions.iter().zip(&truth.numbers).enumerate() {
        let column = if answers.is_answered(row) { usize::from(*answer) } else { classes };
        if let Some(count) = counts.get_mut(usize::from(*number) * columns + column) {
            *count += 1;
        }
    }
    for (label, counts) in truth.labels.iter().zip(counts.chunks(columns.max(1))) {
        if counts.iter().any(|&count| count > 0) {
            write!(out, "{:>12}", OneLine(label))?;
            counts.iter().try_for_each(|count| write!(out, " {count:6}"))?;
            writeln!(out)?;
        }
    }
    Ok(())
}
