//! `wstac trade --budget` chooses a configuration for a budget, and `--verify` checks its claim.

use std::fmt::Write;
use std::path::Path;

use super::{Arguments, base, check_new_all, outputs, prices, print, read};
use crate::commands::output::Stop;
use crate::commands::wrong_arguments;
use wstac_host::error::{Error, ErrorKind};
use wstac_tradeoff::budget::{Budget, best};
use wstac_tradeoff::candidate::Candidate;
use wstac_tradeoff::chosen::{self, CLAIM, Chosen, FILES};
use wstac_tradeoff::{map, table};

const BIAS: &str = "\
A best of many is partly the best by chance: expect a little less (--verify runs other sensors, too). MJPEG, judged by a quarter of the
slides, is chosen only where it is asked for or nothing else fits.
";

pub(super) fn choose(arguments: &Arguments, budget: &Budget) -> Result<(), Stop> {
    let rows = read(arguments.map.as_deref().unwrap_or(Path::new("kept")))?;
    if let Err(error) = budget.check_model(&rows) {
        // Reported like any other term that cannot be used.
        wrong_arguments(clap::error::ErrorKind::ValueValidation, format_args!("--budget: {error}")).exit();
    }
    let prices = prices(arguments)?;
    let choice = best(&rows, budget, arguments.by, &prices, arguments.core);
    let choice = choice.map_err(|nothing| Error::new(ErrorKind::Data, "--budget", nothing))?;
    let row = choice.best;
    let model = row.model.as_ref().map(|name| Candidate::named(Path::new(name))).transpose()?;
    let cores = budget.cores(arguments.core);
    let mut text = table::all(row, model.as_slice(), &prices);
    let limited: Vec<_> = cores.iter().map(|core| core.name()).collect();
    // Writing to a string does not fail.
    let _ = writeln!(text, "limits      hold for {}; any other core is for comparison", limited.join(", "));
    if let Some(nearly) = choice.nearly {
        text.push_str(&table::nearly(nearly, &prices, &cores));
    }
    text.push_str(BIAS);
    if let Some(folder) = &arguments.output {
        check_new_all(arguments, &FILES)?;
        // The model of the choice is read, too.
        let own = outputs(arguments).reading(row.model.as_ref());
        own.check(FILES.iter().map(|name| folder.join(name)).filter(|path| path.exists()))?;
        let (name, base) = base(arguments)?;
        let config = chosen::config(&row.setting, &base).map_err(|error| Error::new(ErrorKind::Config, name, error))?;
        let commands = chosen::write(folder, row, model.as_ref(), &prices, &cores, &config)?;
        let _ = write!(text, "\nIn {} (build.txt):\n{commands}", folder.display());
    }
    print(&text)
}

pub(super) fn verify(folder: &Path) -> Result<(), Stop> {
    let chosen = Chosen::read(folder)?;
    let again = chosen.again()?;
    let (found, claim) = (map::found(&again), map::found(&chosen.claim));
    print(&format!("        {}\nclaimed {claim}\nfound   {found}\n", map::found_header()))?;
    if found != claim {
        let message = format!("claims {}; help: choose again with this wstac", map::differences(&chosen.claim, &again));
        return Err(Error::new(ErrorKind::Data, folder.join(CLAIM).display(), message).into());
    }
    let fresh = chosen.fresh()?;
    let right = |accuracy: [Option<wstac_tradeoff::statistics::Interval>; 3]| {
        let specimen = accuracy[0].map(|of| format!("{:.1} % right ({:.1} … {:.1})", of.mean, of.low, of.high));
        specimen.unwrap_or_else(|| "no specimens answered".to_owned())
    };
    let (old, new) = (right(chosen.claim.found.accuracy), right(fresh.found.accuracy));
    let (slides, wrong) = (fresh.found.slides, fresh.found.direction_errors);
    print(&format!(
        "on {slides} slides of sensors that it was not chosen by: {new}, {wrong} directions wrong; claimed: {old}\n"
    ))
}
