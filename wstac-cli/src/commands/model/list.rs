//! `wstac model list` lists the models that come with the program.

use std::io::Write;
use std::iter::once;
use std::path::Path;

use super::super::output::Stop;
use wstac_core::model::file::Input;
use wstac_host::model_file::{BEST, BEST_OF_ALL, BUILT_IN, ModelFile};
use wstac_tradeoff::map;
use wstac_tradeoff::parameters::Setting;
use wstac_tradeoff::prices::{Core, Prices};
use wstac_tradeoff::table::grouped;

/// List the models that come with wstac: input, accuracy, size and cost
///
/// The input is a sample over time or along the path of the slide, of ten sums, or 25 taxels along the path. Accuracy
/// is that of specimens, on 800 simulated slides of sensors that no model has seen. M0 and M4F are instructions of the
/// model for one event on these cores. wstac trade --help has more.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {}

pub(super) fn run() -> Result<(), Stop> {
    let (rows, prices) = (map::kept()?, Prices::kept()?);
    let mut out = super::super::output::stdout();
    writeln!(out, "{:28}input      accuracy, %   bytes       M0      M4F", "model")?;
    for name in once(BEST.to_owned()).chain(ModelFile::names().map(|name| format!("{BUILT_IN}{name}"))) {
        let file = ModelFile::open(Path::new(&name))?;
        let (setting, input) = match file.model()?.input() {
            Input::Frames => (Setting::PUBLISHED, "over time"),
            Input::Path => (Setting::DEFAULT, "path"),
            _ => (Setting::DEFAULT, "25 taxels"),
        };
        let is_it = |of: Option<&str>| of == Some(file.about());
        let row = rows.iter().find(|row| row.setting == setting && is_it(row.model.as_deref()));
        let accuracy = row.and_then(|row| row.found.accuracy[0]).map(|found| format!("{:.1}", found.mean));
        let known = |found: Option<String>| found.unwrap_or_else(|| "–".to_owned());
        let [m0, m4f] = [Core::M0, Core::M4F].map(|core| {
            let price = prices.of(core, &setting, Some(file.about()));
            known(price.and_then(|price| price.texture).map(grouped))
        });
        let (bytes, accuracy) = (4 * file.words().len(), known(accuracy));
        writeln!(out, "{name:28}{input:9} {accuracy:>12} {bytes:>7} {m0:>8} {m4f:>8}")?;
    }
    Ok(writeln!(out, "{BEST} is {BUILT_IN}{BEST_OF_ALL}")?)
}
