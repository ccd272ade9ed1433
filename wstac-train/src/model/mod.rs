//! Texture models: from their trainers' files to the core's model file, with inspection and evaluation.
//!
//! [`import`] reads a trainer's file as a [`trained`] model and makes a model file of it ([`write`](mod@write)).
//! [`import_inline`] makes Rust ([`inline`]). [`mod@inspect`] reports the contents of a model file, [`eval`]
//! evaluates it, [`mod@calibrate`] adds how sure its answers are, and
//! [`mod@learn`] makes a model of a few slides of new textures.

pub mod calibrate;
mod check;
pub mod eval;
mod exact;
pub mod inline;
pub mod inspect;
mod integers;
pub mod learn;
pub(crate) mod npz;
mod onnx;
pub mod trained;
mod ubjson;
pub mod write;
mod xgboost;

use std::path::{Path, PathBuf};

use wstac_core::model::Model;
use wstac_core::model::file::{Input, Task};
use wstac_core::model::speeds::KnownSpeeds;

use check::CheckSet;
use inline::Source;
use trained::{Kind, Origin, Trained, input_for};
use write::{Options, Weights, Written, write};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::file_bytes;
use wstac_host::texture::pattern_and_depth;

/// Returns the mean of so many inputs over time: of the features of 1000 simulated slides at 100 to 200 mm/s it is
/// -2.58, of the taxels of 300 it is -4.42.
fn usual_mean(inputs: usize) -> f64 {
    if input_for(inputs) == Input::Taxels { -4.4 } else { -2.5 }
}

/// The details that a user may add to a model's file.
#[derive(Clone, Debug, Default)]
pub struct Import {
    /// Names of classes, for files without names.
    pub labels: Option<Vec<String>>,
    /// The model's task, if its labels do not show it.
    pub task: Option<Task>,
    /// The sample that the model takes; `None` for that over time with its number of inputs.
    pub input: Option<Input>,
    /// The speeds of the slides that the model was trained on, if they are known.
    pub speeds: Option<KnownSpeeds>,
    /// A note about the training, in addition to the file's name and its trainer's.
    pub note: Option<String>,
    /// Options for the conversion of real numbers to integers.
    pub options: Options,
    /// Only for [`import`]: a data set on which at most 0.5 % of answers may change. If it has labels of the model,
    /// more answers must be right than by chance.
    pub check: Option<PathBuf>,
    /// Only for [`import_bytes`]: samples instead of `check`, in the order of data sets.
    pub samples: Option<Vec<Vec<i16>>>,
}

/// Reads a trained model from its trainer's file and writes it as a model file.
///
/// # Errors
/// The file cannot be used; the message names the part.
pub fn import(path: &Path, wanted: &Import) -> Result<(Trained, Written), Error> {
    let bytes = file_bytes(path)?;
    let refused = |why| Error::new(ErrorKind::Format, path.display(), why);
    let (model, origin) = trained(bytes, wanted).map_err(refused)?;
    let set = wanted.check.as_deref().map(|set| CheckSet::read(set, &model)).transpose()?;
    made(&name(path), model, &origin, wanted, set.as_ref()).map_err(refused)
}

/// Reads a trained model from the bytes of its trainer's file and writes it as a model file; `name` is that file's
/// name.
///
/// # Errors
/// The bytes cannot be used; the message names the part, without the file's name.
pub fn import_bytes(name: &str, bytes: Vec<u8>, wanted: &Import) -> Result<(Trained, Written), String> {
    let (model, origin) = trained(bytes, wanted)?;
    let set = wanted.samples.clone().and_then(CheckSet::of);
    made(name, model, &origin, wanted, set.as_ref())
}

fn made(
    name: &str,
    mut model: Trained,
    origin: &Origin,
    wanted: &Import,
    set: Option<&CheckSet>,
) -> Result<(Trained, Written), String> {
    check::check_varies(&model)?;
    set.map_or(Ok(()), |set| set.check_float32(&model, &origin.spreads))?;
    let warning = set.map_or_else(|| check::float32_warning(&model, &origin.spreads), |_| String::new());
    if let Kind::Linear(linear) = &mut model.kind {
        linear.drop_shared();
    }
    let inputs = model.inputs;
    let given = set.map(|set| set.mean(inputs)).or(model.mean);
    model.mean = given
        .or_else(|| (matches!(model.input, Input::Frames | Input::Taxels)).then(|| vec![usual_mean(inputs); inputs]));
    let mut facts = serde_json::json!({ "file": name, "trainer": origin.tool });
    if let Some(note) = &wanted.note {
        facts["note"] = note.as_str().into();
    }
    if model.labels.iter().any(|label| label.eq_ignore_ascii_case("unknown")) {
        let why = "a class named unknown looks like a texture that no model knows: --labels gives another name";
        model.remarks.push(format!("warning: {why}"));
    }
    if let Kind::Network(network) = &mut model.kind {
        let set = set.ok_or("is a network, whose values have the range of samples, expected --check SET.npz with a set of wstac dataset")?;
        network.tops = Some(set.tops(network, inputs));
    }
    let written = |weights| {
        let mut written = write(&model, &facts.to_string(), Options { weights, ..wanted.options })?;
        if let Some(set) = set {
            let read = Model::from_words(&written.words).map_err(|error| error.to_string())?;
            let said = written.exactness.replace(write::linear::COUNTED_BY_CHECK, "");
            written.exactness = format!("{said}; {}", set.compare(&model, &read)?);
        }
        written.exactness += &warning;
        Ok(written)
    };
    // Weights that change too many answers are wider, unless the user chose.
    let can_be_wider = wanted.options.weights.is_none() && matches!(model.kind, Kind::Linear(_) | Kind::Network(_));
    let written = written(wanted.options.weights)
        .or_else(|why: String| if can_be_wider { written(Some(Weights::Int32)) } else { Err(why) })?;
    Ok((model, written))
}

/// Reads a trained model from its trainer's file and returns Rust code that answers as the model does.
///
/// # Errors
/// The file cannot be used; the message names the part.
pub fn import_inline(path: &Path, wanted: &Import) -> Result<(Trained, Source), Error> {
    let made = trained(file_bytes(path)?, wanted).and_then(|(model, origin)| {
        let mut source = inline::source(&model, &name(path), &origin.tool, wanted.options)?;
        source.exactness += &integers::hints(&model);
        Ok((model, source))
    });
    made.map_err(|why| Error::new(ErrorKind::Format, path.display(), why))
}

/// Returns a trained model, and how its file came about.
fn trained(bytes: Vec<u8>, wanted: &Import) -> Result<(Trained, Origin), String> {
    let (mut model, origin) = read(&bytes, wanted.labels.clone())?;
    drop(bytes);
    model.task = wanted.task.unwrap_or(model.task);
    model.input = wanted.input.unwrap_or(input_for(model.inputs));
    if (model.input == Input::Taxels) != (input_for(model.inputs) == Input::Taxels) {
        let (inputs, taxels) = (model.inputs, Input::Taxels.numbers());
        return Err(format!(
            "{inputs} inputs, expected {taxels} with --input taxels, and at most 700 with another input"
        ));
    }
    model.speeds = wanted.speeds;
    let is_numbered = model.labels.iter().all(|name| name.parse::<i64>().is_ok());
    if wanted.labels.is_none() && model.task == Task::Other && is_numbered {
        let count = model.labels.len();
        model.remarks.push(format!("the classes are numbers: --labels A,B,… gives these {count} names, in this order"));
    }
    check_labels(&model)?;
    Ok((model, origin))
}

/// Rejects labels that are empty, occur twice, or do not fit the task.
pub(crate) fn check_labels(model: &Trained) -> Result<(), String> {
    for (number, label) in model.labels.iter().enumerate() {
        if label.trim() != label || label.is_empty() {
            return Err(format!("label {label:?} of class {number}, expected a name without blanks around it"));
        }
        if model.labels[..number].contains(label) {
            return Err(format!("label {label:?} occurs twice, expected a name of its own for each class"));
        }
        let (wrong, is_good) = match model.task {
            Task::Specimen => (
                "is no specimen, expected a name such as Saw3, or --task other",
                label == "Sphere" || pattern_and_depth(label).1.is_some(),
            ),
            Task::Depth => ("is no depth, expected a number of mm", label.parse::<f64>().is_ok_and(f64::is_finite)),
            _ => ("", true),
        };
        if !is_good {
            return Err(format!("label {label:?} of class {number} {wrong}"));
        }
    }
    Ok(())
}

/// Rejects labels that [`check_labels`] rejects, or that are not one line of text that can be shown.
pub(crate) fn check_names(model: &Trained) -> Result<(), String> {
    if let Some(label) = model.labels.iter().find(|label| wstac_host::visible::line(label) != label.as_str()) {
        return Err(format!("label {label:?} has a control character, expected a name in one line"));
    }
    check_labels(model)
}

/// Returns the name of a file, without its folder.
fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Recognizes files of trainers that are not read, and returns what they are, and how to write one that is.
fn foreign(start: &[u8]) -> Option<(&'static str, &'static str)> {
    const ONNX: &str =
        "skl2onnx.to_onnx(model, X[:1].astype(\"float32\")), or model.save_model(\"my.json\") for XGBoost";
    const LIGHTGBM: &str = "onnxmltools.convert_lightgbm(model, initial_types=[(\"X\", FloatTensorType([None, 700]))])";
    const CATBOOST: &str = "model.save_model(\"my.onnx\", format=\"onnx\")";
    const XGBOOST: &str = "model.save_model(\"my.json\")";
    let has = |text: &[u8]| start.windows(text.len()).take(4096).any(|part| part == text);
    // Behind fixed parameters, where ONNX has no such name.
    let is_old = start.get(136..256).is_some_and(|names| names.windows(6).any(|part| part == b"gbtree"));
    Some(match start {
        // The first bytes of Python's pickles from protocol 2 on, and of those of joblib.
        [0x80, 2..=5, ..] => ("a pickle, which only Python can read", ONNX),
        [b'{', ..] if has(b"\"num_tree_per_iteration\"") => ("JSON of LightGBM", LIGHTGBM),
        [b'{', ..] if has(b"\"features_info\"") => ("JSON of CatBoost", CATBOOST),
        [b'{', ..] => return None,
        [b'[', ..] => ("a list in JSON, as XGBoost's dump_model writes for people", XGBOOST),
        _ if start.starts_with(b"booster[") => ("text, as XGBoost's dump_model writes for people", XGBOOST),
        _ if start.starts_with(b"tree\nversion=") => ("text of LightGBM", LIGHTGBM),
        _ if start.starts_with(b"CBM1") => ("a binary file of CatBoost", CATBOOST),
        _ if start.starts_with(b"binf") || is_old => {
            ("an old binary file of XGBoost", "the XGBoost that wrote it: model.save_model(\"my.json\")")
        }
        _ => return None,
    })
}

/// Reads a model, and returns it with its origin; the contents determine the kind of file.
fn read(bytes: &[u8], labels: Option<Vec<String>>) -> Result<(Trained, Origin), String> {
    // Editors on Windows put this mark of UTF-8 before text.
    let start = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes).trim_ascii_start();
    if let Some((found, help)) = foreign(start) {
        return Err(format!("is {found}, expected ONNX, or JSON or UBJSON of XGBoost; help: write it with {help}"));
    }
    match start {
        [] => Err("is empty, expected a model".into()),
        [b'W', b'S', b'M', _, ..] => Err("is a model file already, expected a model of XGBoost or ONNX".into()),
        // A UBJSON object starts with the length of a key, a JSON object with a quotation mark.
        [b'{', b'i' | b'U' | b'I' | b'l' | b'L' | b'#' | b'$' | b'N', ..] => {
            let file = ubjson::from_slice(start).map_err(|error| format!("UBJSON: {error}"))?;
            xgboost::read(file, labels)
        }
        [b'{', ..] => xgboost::read(xgboost::from_json(start)?, labels),
        _ => onnx::read(bytes, labels),
    }
}
