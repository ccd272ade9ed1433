//! `wstac trade --budget` and `--verify`: a configuration by what may be spent, and whether its claim holds.

use std::path::Path;

use super::{Arguments, prices, print, read};
use crate::cli::output::Stop;
use crate::error::Error;
use crate::trade::budget::{Budget, best};
use crate::trade::candidate::Candidate;
use crate::trade::chosen::{self, CLAIM, commands};
use crate::trade::{map, table};

pub(super) fn choose(arguments: &Arguments, budget: &Budget) -> Result<(), Stop> {
    let rows = read(arguments.map.as_deref().unwrap_or(Path::new("kept")))?;
    let (models, prices) = (Candidate::all_built_in()?, prices(arguments)?);
    let row = best(&rows, budget, arguments.by, &prices, arguments.core);
    let row = row.map_err(|nothing| Error::new("--budget", nothing))?;
    let own = models.iter().find(|model| Some(&model.name) == row.model.as_ref()).cloned();
    // Of an earlier sweep's map: a file.
    let own = match (&row.model, own) {
        (Some(name), None) => Some(Candidate::named(Path::new(name))?),
        (_, own) => own,
    };
    let mut text = table::all(row, own.as_slice(), &prices);
    if let Some(folder) = &arguments.output {
        chosen::write(folder, row, own.as_ref(), &prices)?;
        text.push_str("\nA board, in wstac-fw, and a host:\n");
        text.push_str(&commands(row, folder));
    }
    print(&text)
}

pub(super) fn verify(folder: &Path) -> Result<(), Stop> {
    let [found, claim] = chosen::rerun(folder)?;
    let (found, claim) = (map::found(&found), map::found(&claim));
    print(&format!("claimed {claim}\nfound   {found}\n"))?;
    if found == claim {
        return Ok(());
    }
    let message = format!("claims {claim}, found {found}, expected the same");
    Err(Error::new(folder.join(CLAIM).display(), message).into())
}
