//! `wstac model inspect` describes a model file.

use std::io::Write;
use std::path::PathBuf;

use super::super::output::{Stop, print_json, stdout};
use wstac_core::params::TAXELS;
use wstac_core::touch::path_sample::FACTS;
use wstac_host::model_file::ModelFile;
use wstac_host::visible::OneLine;
use wstac_train::model::inspect::inspect;

/// Print the kind, classes, size and cost of a model
///
/// Costs are those of one classification.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The model: a file, builtin or builtin:NAME
    #[arg(value_name = "FILE.wsm")]
    model: PathBuf,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let file = ModelFile::open(&arguments.model)?;
    let model = file.model()?;
    let found = inspect(&model, file.words());
    if arguments.json {
        return print_json(&found);
    }
    let mut out = stdout();
    writeln!(out, "kind      {}, {}", found.kind, found.numbers)?;
    writeln!(out, "task      {}", found.task)?;
    writeln!(out, "classes   {}: {}", found.labels.len(), OneLine(found.labels.join(", ")))?;
    match model.input().steps() {
        None if found.input == "taxels" => {
            writeln!(out, "frames    {} of taxels", 10 * usize::from(found.frames) / TAXELS)?;
        }
        None => writeln!(out, "frames    {} of a sample", found.frames)?,
        Some((step_mm, numbers)) => {
            let steps = (10 * usize::from(found.frames)).saturating_sub(FACTS).div_ceil(numbers);
            writeln!(out, "steps     {steps} of {step_mm} mm, of a {}", found.input)?;
        }
    }
    if let Some([slowest, fastest]) = found.speeds_mm_s {
        writeln!(out, "speeds    {slowest} to {fastest} mm/s: it knows no slide at another speed")?;
    }
    writeln!(out, "size      {} bytes of flash", found.bytes)?;
    if let Some(rows) = found.rows {
        writeln!(out, "sums      {rows} of {} products", 10 * u32::from(found.frames))?;
    }
    if let Some(layers) = found.layers {
        let sums: Vec<String> = layers.iter().map(usize::to_string).collect();
        writeln!(out, "layers    {} sums of {} inputs", sums.join(", "), 10 * u32::from(found.frames))?;
    }
    if let Some(trees) = found.trees {
        writeln!(out, "trees     {}, {} splits, depth {}", trees.count, trees.splits, trees.depth)?;
        let (mean, worst) = (trees.visits_mean, trees.visits_worst);
        writeln!(
            out,
            "visits    {mean:.0} splits per sample if all leaves of a tree are equally likely, at most {worst}"
        )?;
    }
    if found.calibrated {
        let unknown = if found.tells_unknown { ", and whether a texture is known" } else { "" };
        writeln!(out, "tells     how sure an answer is{unknown}")?;
    }
    Ok(writeln!(out, "training  {}", OneLine(&found.training))?)
}
