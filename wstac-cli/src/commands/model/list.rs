//! `wstac model list` lists the models that come with the program.

use std::io::Write;
use std::path::Path;

use super::super::output::Stop;
use wstac_core::model::file::Input;
use wstac_host::model_file::{BEST, BEST_OF_ALL, BUILT_IN, ModelFile};
use wstac_tradeoff::map;
use wstac_tradeoff::parameters::Setting;
use wstac_tradeoff::prices::{Core, Prices};
use wstac_tradeoff::table::grouped;

/// List the usual models that come with wstac, with accuracy and cost
///
/// The input is a sample over time or along the path of the slide, of ten sums, or 25 taxels along the path. Accuracy
/// is that of specimens, on 800 simulated slides of sensors that no model has seen. M0 and M4F are instructions of the
/// model for one event on these cores. wstac trade --help has more.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Also list those that only wstac trade weighs
    #[arg(long)]
    all: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let (rows, prices) = (map::kept()?, Prices::kept()?);
    let mut out = super::super::output::stdout();
    writeln!(out, "{:28}input      accuracy, %   bytes       M0      M4F", "model")?;
    let names: Vec<String> =
        if arguments.all { ModelFile::full_names().collect() } else { ModelFile::usual_names().collect() };
    for name in names {
        let file = ModelFile::open(Path::new(&name))?;
        let (setting, input) = match file.model()?.input() {
            Input::Frames => (Setting::PUBLISHED, "over time"),
            Input::Path => (Setting::DEFAULT, "path"),
            _ => (Setting::DEFAULT, "25 taxels"),
        };
        let about = Some(file.about());
        let row = rows.iter().find(|row| row.setting == setting && row.model.as_deref() == about);
        let accuracy = row.and_then(|row| row.found.accuracy[0]).map_or("–".into(), |of| format!("{:.1}", of.mean));
        let cost = |core| prices.of(core, &setting, about).and_then(|price| price.texture).map_or("–".into(), grouped);
        let (bytes, m0, m4f) = (4 * file.words().len(), cost(Core::M0), cost(Core::M4F));
        writeln!(out, "{name:28}{input:9} {accuracy:>12} {bytes:>7} {m0:>8} {m4f:>8}")?;
    }
    Ok(writeln!(out, "{BEST} is {BUILT_IN}{BEST_OF_ALL}")?)
}
