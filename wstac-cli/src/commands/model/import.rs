//! `wstac model import` makes a model file of a trained model.

use std::ffi::OsStr;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind as ArgumentErrorKind;
use wstac_core::model::file::{Input, Task};
use wstac_core::model::speeds::{FASTEST, KnownSpeeds};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_host::error::{Error, ErrorKind};
use wstac_train::dataset::path::frames_of;

use super::super::files::{Outputs, check_ending};
use super::super::output::{Stop, note};
use super::super::values::{one_of, sample, task};
use super::super::wrong_arguments;
use wstac_train::model::trained::Kind;
use wstac_train::model::write::{Leaves, Options, Weights};
use wstac_train::model::{Import, import, import_inline};

/// Make a model file of a trained model
///
/// The type of the input is found from its content, not from its name. The models that can be imported are listed in
/// wstac model --help. The same input gives the same bytes.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The trained model: XGBoost JSON or UBJSON, or ONNX
    #[arg(value_name = "FILE")]
    file: PathBuf,

    /// Write the model to this file
    ///
    /// It is a model file, or Rust code if its name ends in .rs.
    #[arg(short, long, value_name = "OUT.wsm")]
    output: PathBuf,

    /// Output to write; by default, the ending of its name decides
    ///
    /// A table is a model file, which is smallest. Inline is Rust code, which takes fewer instructions and more bytes.
    /// Only trees can be inline.
    #[arg(long, value_parser = one_of([("table", Backend::Table), ("inline", Backend::Inline)]))]
    backend: Option<Backend>,

    /// Names of the classes in their order, as A,B,C
    ///
    /// They are for files without names (XGBoost). By default such classes are numbered.
    #[arg(long, value_name = "A,B,…", value_delimiter = ',')]
    labels: Option<Vec<String>>,

    /// Kind of the classes; by default, their names decide
    #[arg(long, value_parser = task())]
    task: Option<Task>,

    /// The sample it was trained on: frames by default
    ///
    /// path and taxel-path are light along the path of a touch, of ten sums and of 25 taxels: the arrays X_path and
    /// X_taxel_path of a data set. A model with as many inputs as those of path (390) or taxel-path (280) needs this
    /// option. A model of 1750 inputs is one of taxels: X_taxels.
    #[arg(long, value_parser = sample())]
    input: Option<Input>,

    /// Speeds of the training in mm/s, from and to
    ///
    /// They are those of the slowest and of the fastest slide. A slide at another speed has no texture then: far from
    /// the speeds of its training, a model is wrong more often than it seems. Only model files can say so.
    #[arg(long, value_name = "FROM,TO", value_parser = speeds)]
    speeds: Option<KnownSpeeds>,

    /// Weights of a linear model or a network: int16 by default
    ///
    /// int8 is half as large and less exact. int32 is twice as large and takes twice the time; by default it is chosen
    /// if rounding to int16 may change answers. Boards before version 0.4 do not read it.
    #[arg(long, value_parser = one_of(WEIGHTS))]
    weights: Option<Weights>,

    /// Leaves of boosted trees: auto by default
    ///
    /// float32 is exact, and int16 is smaller. auto is int16 if that is proven to be exact, otherwise float32.
    #[arg(long, value_parser = one_of(LEAVES))]
    leaves: Option<Leaves>,

    /// Count the answers that rounding changes, and those that are right
    ///
    /// The data set is one of wstac dataset, best not that of the training. It is an error if more than 0.5 % change,
    /// or if no more are right than by chance. Its mean also makes the rounding of weights better. Only for model
    /// files.
    #[arg(long, value_name = "SET.npz")]
    check: Option<PathBuf>,

    /// A note about the training, which inspect prints
    ///
    /// Only model files can have one.
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,

    /// Overwrite OUT.wsm
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Backend {
    Table,
    Inline,
}

const WEIGHTS: [(&str, Weights); 3] = [("int16", Weights::Int16), ("int8", Weights::Int8), ("int32", Weights::Int32)];
const LEAVES: [(&str, Leaves); 3] = [("auto", Leaves::Auto), ("int16", Leaves::Int16), ("float32", Leaves::Float32)];

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let output = &arguments.output;
    let backend = backend(arguments.backend, output).unwrap_or_else(|contradiction| contradiction.exit());
    let outputs = Outputs::new(arguments.force).reading(arguments.check.iter().chain([&arguments.file]));
    // Who names the backend may name the file as they like.
    if arguments.backend.is_none() {
        check_ending(output, &["wsm", "rs"])?;
    }
    outputs.check([output])?;
    let wanted = Import {
        labels: arguments.labels.clone(),
        task: arguments.task,
        input: arguments.input,
        speeds: arguments.speeds,
        note: arguments.note.clone(),
        options: Options { weights: arguments.weights, leaves: arguments.leaves.unwrap_or_default() },
        check: arguments.check.clone(),
        samples: None,
    };
    let (model, bytes, exactness) = if backend == Backend::Inline {
        let (model, source) = import_inline(&arguments.file, &wanted)?;
        (model, source.text.into_bytes(), source.exactness)
    } else {
        let (model, written) = import(&arguments.file, &wanted)?;
        (model, written.bytes(), written.exactness)
    };
    check_options(arguments, &model.kind, backend).unwrap_or_else(|idle| idle.exit());
    let assumed = match arguments.input {
        None => Some(assumed(&arguments.file, model.inputs)?),
        Some(_) => Some(shorter(model.input, model.inputs)),
    };
    outputs.write(output, &bytes)?;
    let (path, classes, task) = (output.display(), model.labels.len(), model.task.name());
    let what = if backend == Backend::Inline { "bytes of Rust" } else { "bytes" };
    let classes = if classes == 1 { "1 class".to_owned() } else { format!("{classes} classes") };
    note(format_args!("{path}: {} {what}, {classes}, task {task}; {}", bytes.len(), exactness));
    if let Some(assumed) = assumed.flatten() {
        note(assumed);
    }
    Ok(())
}

/// Returns a note if a model takes fewer numbers of a path than are usual.
fn shorter(input: Input, inputs: usize) -> Option<String> {
    let usual = FEATURES * usize::from(frames_of(input));
    (input.steps().is_some() && inputs != usual).then(|| {
        let (found, usual) = (inputs / FEATURES, usual / FEATURES);
        format!("{inputs} inputs: taken as X_{}[:, :, :{found}] in one row; {usual} places are usual", input.name())
    })
}

/// Returns what the number of inputs is taken for without --input; `None` for a whole sample over time.
///
/// # Errors
/// A model along the path has as many inputs.
fn assumed(file: &Path, inputs: usize) -> Result<Option<String>, Error> {
    let frames = inputs / FEATURES;
    let along = [(Input::Path, "path", "X_path"), (Input::TaxelPath, "taxel-path", "X_taxel_path")];
    if let Some((_, option, array)) = along.into_iter().find(|(input, ..)| usize::from(frames_of(*input)) == frames) {
        let message = format_args!(
            "has {inputs} inputs: those of {array}, or of the first {frames} frames over time, expected --input {option} \
             or --input frames"
        );
        return Err(Error::new(ErrorKind::Usage, file.display(), message));
    }
    Ok((frames < SAMPLE_FRAMES).then(|| {
        format!(
            "{inputs} inputs: taken as the first {frames} frames over time; help: give --input path or taxel-path if it was \
             trained on X_path or X_taxel_path"
        )
    }))
}

/// Returns the kind of output, by the option or by the name of the output. They must not contradict each other.
fn backend(asked: Option<Backend>, output: &Path) -> Result<Backend, clap::Error> {
    let named = match output.extension().and_then(OsStr::to_str) {
        Some("rs") => Some((Backend::Inline, "Rust", "inline")),
        Some("wsm") => Some((Backend::Table, "a model file", "table")),
        _ => None,
    };
    match (asked, named) {
        (Some(asked), Some((named, what, name))) if asked != named => Err(conflict(format_args!(
            "{}: is named as {what} is, expected --backend {name} or another name",
            output.display()
        ))),
        (Some(backend), _) | (None, Some((backend, ..))) => Ok(backend),
        (None, None) => Ok(Backend::Table),
    }
}

/// Refuses options that have no meaning for this model.
fn check_options(arguments: &Arguments, kind: &Kind, backend: Backend) -> Result<(), clap::Error> {
    let model = match kind {
        Kind::Linear(_) => "a linear model",
        Kind::Forest(_) => "a forest",
        Kind::Boosted(_) => "boosted trees",
        Kind::Network(_) => "a network",
    };
    let (is_linear, is_boosted) = (matches!(kind, Kind::Linear(_)), matches!(kind, Kind::Boosted(_)));
    let refused = |option, of| {
        let file = arguments.file.display();
        Err(conflict(format_args!("{option} is for {of}, and {file} holds {model}; leave it out")))
    };
    if arguments.weights.is_some() && !is_linear && !matches!(kind, Kind::Network(_)) {
        return refused("--weights", "linear models and networks");
    }
    if arguments.leaves.is_some() && !is_boosted {
        return refused("--leaves", "boosted trees");
    }
    if arguments.note.is_some() && backend == Backend::Inline {
        return Err(conflict("--note is for model files, and Rust has no place for it; leave it out"));
    }
    if arguments.speeds.is_some() && backend == Backend::Inline {
        return Err(conflict("--speeds is for model files, and Rust has no place for it; leave it out"));
    }
    if arguments.check.is_some() && backend == Backend::Inline {
        return Err(conflict("--check is for model files, which hold the same trees; check one of them"));
    }
    Ok(())
}

fn speeds(text: &str) -> Result<KnownSpeeds, String> {
    let both = text.split_once(',').and_then(|(from, to)| Some((from.trim().parse().ok()?, to.trim().parse().ok()?)));
    let found = both.and_then(|(from, to)| KnownSpeeds::new(from, to));
    found.ok_or_else(|| format!("expected two integers up to {FASTEST}, the slower first, as in 50,300"))
}

fn conflict(message: impl Display) -> clap::Error {
    wrong_arguments(ArgumentErrorKind::ArgumentConflict, message)
}
