//! `wstac trade`: what speed costs in accuracy.

use std::path::{Path, PathBuf};

use super::output::{Stop, note};
use crate::config::Config;
use crate::error::Error;
use crate::trade::candidate::Candidate;
use crate::trade::knobs::Front;
use crate::trade::prices::{Core, Prices};
use crate::trade::slides::{MOST_SLIDES, QUICK_SLIDES, SENSORS, SLIDES, slides};
use crate::trade::sweep::{self, Plan};
use crate::trade::{host, map, row};

/// Show what speed costs in accuracy
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Write trade.csv, trade.md and trade.svg to this folder
    #[arg(short, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Slides of each of the 20 sensors, 1 to 110
    #[arg(long, value_name = "N", default_value_t = SLIDES, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SLIDES)))]
    slides: u32,

    /// A quarter of the slides
    #[arg(long, conflicts_with = "slides")]
    quick: bool,

    /// Only these texture models, files or builtin:NAME, instead of all that come with wstac
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Everything that is no knob: a configuration file as for wstac run
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// The board's core that tables and plots are for
    #[arg(long, value_enum, default_value = "M4F")]
    core: Core,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let config = arguments.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    let models = models(&arguments.models)?;
    let of_each = if arguments.quick { QUICK_SLIDES } else { arguments.slides };
    let (fronts, slides) = (Front::all(), slides(of_each));
    note(format_args!(
        "{} slides of {SENSORS} sensors, {} settings, {} models",
        slides.len(),
        fronts.len(),
        models.len()
    ));
    let plan = Plan { config: &config, fronts: &fronts, models: &models, slides: &slides, light: 1.0 };
    let mut rows = row::rows(&plan, &sweep::run(&plan)?);
    host::measure(&mut rows, &models, &config)?;
    let prices = Prices::kept()?;
    if let Some(folder) = &arguments.output {
        std::fs::create_dir_all(folder).map_err(|error| Error::new(folder.display(), error))?;
        write(folder, "trade.csv", &map::write_all(&rows, &models, &prices))?;
        write(folder, "map.csv", &map::write(&rows))?;
    }
    Ok(())
}

fn models(named: &[PathBuf]) -> Result<Vec<Candidate>, Error> {
    if named.is_empty() { Candidate::all_built_in() } else { named.iter().map(|name| Candidate::named(name)).collect() }
}

fn write(folder: &Path, name: &str, text: &str) -> Result<(), Error> {
    let path = folder.join(name);
    std::fs::write(&path, text).map_err(|error| Error::new(path.display(), error))
}
