//! `wstac model calibrate` adds to a model file how sure its answers are.

use std::path::{Path, PathBuf};

use wstac_core::model::file::Input;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::plural::counted;
use wstac_train::model::calibrate::{
    Calibrated, LabeledSamples, Projection, Settings, calibrate_with, inputs_of, sensors_in_common, without,
};

use super::super::files::{Outputs, is_same};
use super::super::output::{Stop, note};
use super::super::progress::while_working;
use super::super::values::fraction;

/// Add to a model how sure its answers are, and what it knows
///
/// Answers stay what they are. A calibrated model gives the probability of an answer ("confidence"), and says whether
/// a texture is like those of the training ("known"). Data sets are those of model eval. No sensor of HELD should have
/// been in the training: a sweep with another first_sensor has others.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The model: a file, builtin or builtin:NAME
    #[arg(value_name = "MODEL")]
    model: PathBuf,

    /// The data set (.npz) that the model was trained on
    #[arg(value_name = "TRAIN")]
    train: PathBuf,

    /// A data set (.npz) that was held out of the training; by default, the tests of TRAIN
    ///
    /// They are those of its array split.
    #[arg(value_name = "HELD")]
    held: Option<PathBuf>,

    /// Write the calibrated model to this file
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Textures that the projection tells apart: by default, those of TRAIN
    ///
    /// Many other textures make an embedding, from which wstac model learn makes models of new textures. If the data
    /// set has the array sensor, differences between sensors are taken out first.
    #[arg(long, value_name = "DATA.npz")]
    projection: Option<PathBuf>,

    /// Dimensions of the projection, 0 to 32: as many as there are textures less one by default
    ///
    /// With 0 the model does not say what is unknown.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=32))]
    dimensions: Option<u8>,

    /// Part of HELD that may be taken for unknown: 0.02 by default
    #[arg(long, value_name = "PART", value_parser = fraction())]
    rejected: Option<f64>,

    /// Overwrite OUT
    #[arg(long)]
    force: bool,
}

/// Refuses the same data set for both.
fn check_other(train: &Path, held: &Path) -> Result<(), Error> {
    if is_same(train, held) {
        let message = "is TRAIN and HELD, expected slides that were held out: name a data set with an array split once";
        return Err(Error::new(ErrorKind::Usage, held.display(), message));
    }
    Ok(())
}

/// Notes sensors that are in both data sets.
fn note_common(train: &Path, held: &Path, input: Input) -> Result<(), Error> {
    let common = sensors_in_common(train, held, input)?;
    if !common.is_empty() {
        let (train, held, sensors) = (train.display(), held.display(), counted(common.len(), "sensor"));
        note(format_args!("{held} has {sensors} of {train}: on others, answers are less sure than the model will say"));
    }
    Ok(())
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let output = &arguments.output;
    let inputs = [&arguments.model, &arguments.train];
    let outputs = Outputs::new(arguments.force).reading(inputs).reading(&arguments.held).reading(&arguments.projection);
    outputs.check([output])?;
    let found = while_working("calibrating", || calibrated(arguments))?;
    let bytes: Vec<u8> = found.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    outputs.write(output, &bytes)?;
    let quality = found.held_out;
    let known = quality.known.map_or_else(
        || "does not tell what is unknown".to_owned(),
        |known| {
            let limits = if found.has_own_limits {
                "with a limit of each class".to_owned()
            } else {
                let rejected = arguments.rejected.unwrap_or(Settings::default().rejected);
                format!("with one limit of all classes, as {rejected} of a class's right answers is less than a sample")
            };
            format!("{:.1} % of them are known in {}, {limits}", 100.0 * known, counted(found.dimensions, "dimension"))
        },
    );
    note(format_args!(
        "{}: {} bytes; {} held out: {:.1} % right, confidence off by {:.4} on average; {known}",
        output.display(),
        bytes.len(),
        counted(quality.samples, "sample"),
        100.0 * quality.accuracy,
        quality.calibration_error
    ));
    Ok(())
}

/// Reads the data sets, and calibrates the model.
fn calibrated(arguments: &Arguments) -> Result<Calibrated, Error> {
    let file = ModelFile::open(&arguments.model)?;
    let model = file.model()?;
    let held_path = arguments.held.as_ref().unwrap_or(&arguments.train);
    let [train, held] = match &arguments.held {
        None => LabeledSamples::read_split(&model, &arguments.train)?,
        Some(held) => {
            check_other(&arguments.train, held)?;
            let both = [LabeledSamples::read(&model, &arguments.train)?, LabeledSamples::read(&model, held)?];
            note_common(&arguments.train, held, model.input())?;
            both
        }
    };
    let mut settings = Settings::default();
    settings.dimensions = arguments.dimensions.map_or(settings.dimensions, usize::from);
    settings.rejected = arguments.rejected.unwrap_or(settings.rejected);
    let wrong = |about: &PathBuf| {
        let about = about.display().to_string();
        move |message: String| Error::new(ErrorKind::Data, about, message)
    };
    let textures =
        arguments.projection.as_ref().map(|path| LabeledSamples::read_for_one_sensor(&model, path)).transpose()?;
    let projection = if settings.dimensions > 0 && model.labels().len() > 1 {
        let (from, about) = textures
            .as_ref()
            .map_or((&train, &arguments.train), |all| (all, arguments.projection.as_ref().unwrap_or(&arguments.train)));
        Some(Projection::of(from, inputs_of(&model), settings.dimensions).map_err(wrong(about))?)
    } else {
        None
    };
    let plain = without(file.words()).map_err(wrong(&arguments.model))?;
    calibrate_with(&plain, projection.as_ref(), &train, &held, settings).map_err(wrong(held_path))
}
