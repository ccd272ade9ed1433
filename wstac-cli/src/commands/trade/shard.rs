//! `wstac trade --shard` and `--merge`: a sweep that several processes run.

use std::path::Path;

use super::{Arguments, base, models, of_each, outputs, timed};
use crate::commands::output::{Stop, note};
use crate::commands::shards::make_shard;
use crate::commands::signals::{Ending, finishing};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_tradeoff::candidate::Candidate;
use wstac_tradeoff::parameters::Setting;
use wstac_tradeoff::row::{Row, rows};
use wstac_tradeoff::shard::{SweepPlan, content, outcomes, slides_of};
use wstac_tradeoff::slides::slides;
use wstac_tradeoff::sweep::{self, Plan};
use wstac_train::shard::{Shard, WholeSet};

/// Makes one shard of the sweep.
pub(super) fn make(arguments: &Arguments, numbers: [u32; 2], config: &Config) -> Result<(), Stop> {
    // The option needs an output.
    let output = arguments.output.as_deref().unwrap_or(Path::new(""));
    let models = models(&arguments.models)?;
    let names = models.iter().map(|model| model.name.clone()).collect();
    let plan = SweepPlan { of_each: of_each(arguments), models: names, config: base(arguments)?.1 };
    let shard = Shard::new(numbers, plan.set(&models)?)?;
    make_shard(&shard, output, &outputs(arguments), arguments.force, |items| {
        finishing(Ending::AtOnce);
        let (slides, settings) = (slides_of(plan.of_each, items), Setting::all());
        note(format_args!("{} of {} slides, {} settings", slides.len(), shard.set.items, settings.len()));
        let plan = Plan { config, settings: &settings, models: &models, slides: &slides, light: 1.0 };
        let found = sweep::run(&plan)?;
        finishing(Ending::Whole);
        Ok(items.iter().copied().zip(found.iter().map(|slide| content(slide))).collect())
    })
}

/// A merged sweep.
pub(super) struct Merged {
    /// The results.
    pub(super) rows: Vec<Row>,
    /// The models of the sweep.
    pub(super) models: Vec<Candidate>,
    /// The text of its configuration.
    pub(super) base: String,
}

/// Merges all shards of a sweep, and then measures the time of every setting.
pub(super) fn merged(arguments: &Arguments) -> Result<Merged, Error> {
    let set = WholeSet::open(&arguments.merge)?;
    let plan = SweepPlan::of(&set)?;
    let subject = set.first().path().display().to_string();
    let config = Config::parse(&plan.config).map_err(|error| error.about(&subject))?;
    let models = plan.models.iter().map(|name| Candidate::named(Path::new(name))).collect::<Result<Vec<_>, _>>()?;
    plan.check(&set, &models)?;
    let (settings, slides) = (Setting::all(), slides(plan.of_each));
    let found = outcomes(&set, &settings, models.len())?;
    let of = Plan { config: &config, settings: &settings, models: &models, slides: &slides, light: 1.0 };
    let mut rows = rows(&of, &found);
    timed(arguments, &mut rows, &models, &config)?;
    Ok(Merged { rows, models, base: plan.config })
}
