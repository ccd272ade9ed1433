//! `wstac model learn` makes a model of new textures from a few slides of each.

use std::path::PathBuf;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::plural::counted;
use wstac_train::model::calibrate::{LabeledSamples, projection_of};
use wstac_train::model::learn::learn;

use super::super::dataset::pool;
use super::super::dataset::recorded::read_all;
use super::super::files::{Outputs, check_ending, ends};
use super::super::output::{Stop, note};
use super::super::signals::{Ending, finishing};

/// Make a model of new textures from a few slides of each
///
/// Five slides of each texture are enough with a base that was trained on many textures: builtin:embedding (ten sums)
/// or builtin:taxel-embedding (25 taxels, which tells textures apart better). The model names only the new textures,
/// on the sensor that the slides are of. From three slides of each on, it also says how sure an answer is and what is
/// unknown. Then learn prints how many slides are called unknown by a model of all textures but their own.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The calibrated model to start from: builtin:embedding, builtin:taxel-embedding or a file
    #[arg(value_name = "BASE")]
    base: PathBuf,

    /// Recordings with the label specimen, their folders, or data sets
    ///
    /// Record each slide with wstac record --label specimen=NAME, or take data sets (.npz) as model eval takes them.
    #[arg(value_name = "SLIDES", required = true)]
    slides: Vec<PathBuf>,

    /// Write the model to this file
    #[arg(short, long, value_name = "OUT.wsm")]
    output: PathBuf,

    /// A note about the slides, which inspect prints
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,

    /// Overwrite OUT.wsm
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let output = &arguments.output;
    let outputs = Outputs::new(arguments.force).reading([&arguments.base]).reading(&arguments.slides);
    check_ending(output, &["wsm"])?;
    outputs.check([output])?;
    let file = ModelFile::open(&arguments.base)?;
    let model = file.model()?;
    projection_of(file.words()).map_err(|message| Error::new(ErrorKind::Data, file.about(), message))?;
    let (sets, recorded): (Vec<&PathBuf>, Vec<&PathBuf>) = arguments.slides.iter().partition(|path| ends(path, "npz"));
    let mut slides = LabeledSamples::default();
    for path in sets {
        slides.append(LabeledSamples::read(&model, path)?);
    }
    if !recorded.is_empty() {
        let recorded: Vec<PathBuf> = recorded.into_iter().cloned().collect();
        let recordings = read_all(&recorded, None, model.input(), &pool(None)?)?;
        // Nothing is written until the model is there.
        finishing(Ending::AtOnce);
        slides.append(LabeledSamples::of_recordings(&recordings, model.input()));
    }
    let names: Vec<String> = arguments.slides.iter().map(|path| path.display().to_string()).collect();
    let mut facts = serde_json::json!({ "learned_from": names, "base": file.about(), "slides": slides.numbers.len() });
    if let Some(note) = &arguments.note {
        facts["note"] = note.as_str().into();
    }
    let learned = learn(file.words(), &slides, &facts.to_string());
    let learned = learned.map_err(|message| Error::new(ErrorKind::Data, names.join(", "), message))?;
    let bytes: Vec<u8> = learned.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    outputs.write(output, &bytes)?;
    let (least, most) = (learned.slides.iter().min(), learned.slides.iter().max());
    let (least, most) = (least.copied().unwrap_or(0), most.copied().unwrap_or(0));
    let each = if least == most { counted(least, "slide") } else { format!("{least} to {most} slides") };
    let left_out = learned.left_out.map_or_else(String::new, |right| {
        format!("; {:.0} % of the slides are named right by the others", 100.0 * right)
    });
    let doubt =
        if learned.is_calibrated { "" } else { "; too few slides to tell how sure an answer is: expected 3 each" };
    note(format_args!(
        "{}: {} bytes, {}, {each} each{left_out}{doubt}",
        output.display(),
        bytes.len(),
        counted(learned.slides.len(), "texture")
    ));
    if let Some(found) = learned.found_unknown {
        note(format_args!(
            "without its own texture, {:.0} % of the slides are called unknown; textures more alike are found less often",
            100.0 * found
        ));
    }
    Ok(())
}
