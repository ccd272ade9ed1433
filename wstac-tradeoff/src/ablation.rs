//! The ablation: the effect of each parameter alone, with all others at the default setting.

use std::fmt::Write;

use super::candidate::short;
use super::parameters::{Setting, kernel_name};
use super::prices::{Core, Prices};
use super::row::{Row, base};
use super::table::{accuracy, grouped, known};

const HEAD: &str = "\
| ablation | specimen accuracy, % (95 % interval) | speed error, % | instructions per frame | instructions per event | flash, bytes | frames to the answer |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
";

/// The models with which all others are compared, if the map has them: with arrival times, and with the published law.
const MODELS: [&str; 2] = ["builtin:path-svm", "builtin:svm"];

/// Returns a Markdown table of every value of every parameter, the others at the default.
pub fn one_at_a_time(rows: &[Row], prices: &Prices, core: Core) -> String {
    let base = base(rows);
    let of_base = |row: &&Row| row.setting == base;
    let models = || rows.iter().filter(of_base).filter_map(|row| row.model.as_deref());
    let model = MODELS.into_iter().find(|name| models().any(|own| own == *name)).or_else(|| models().next());
    let whole = model.map_or("no model", short);
    let mut text =
        format!("One parameter at a time, from {}, {whole}, counted on a Cortex-{}:\n\n{HEAD}", base, core.name());
    let mut line = |ablation: &str, row: &Row| {
        let price = prices.of(core, &row.setting, row.model.as_deref());
        let speed = row.found.speed.map_or_else(|| "–".to_owned(), |[mean, _]| format!("{mean:.2}"));
        let latency = row.found.latency.map_or_else(|| "–".to_owned(), |frames| format!("{frames:.1}"));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {ablation} | {} | {speed} | {} | {} | {} | {latency} |",
            accuracy(row.found.accuracy[0]),
            price.map_or_else(|| "–".to_owned(), |price| grouped(price.frame())),
            known(price.and_then(|price| price.event())),
            known(price.and_then(|price| price.flash)),
        );
    };
    for setting in base.one_at_a_time() {
        let Some(row) = rows.iter().find(|row| row.setting == setting && row.model.as_deref() == model) else {
            continue;
        };
        let ablation = match setting {
            setting if setting == base => "none".to_owned(),
            Setting { format, .. } if format != base.format => format.name().to_owned(),
            Setting { stride, .. } if stride != base.stride => format!("stride {}", stride.get()),
            Setting { law, .. } if law != base.law => format!("law {}", law.name()),
            Setting { kernel, .. } => format!("{} ln", kernel_name(kernel)),
        };
        line(&ablation, row);
    }
    for row in rows.iter().filter(of_base).filter(|row| row.model.as_deref() != model) {
        line(row.model.as_deref().map_or("no model", short), row);
    }
    // Models over time go with another law than those of the path.
    for row in rows.iter().filter(|row| base == Setting::DEFAULT && row.setting == Setting::PUBLISHED) {
        let model = row.model.as_deref().map_or("no model", short);
        line(&format!("law {}, {model}", row.setting.law.name()), row);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map;

    #[test]
    fn every_value_of_every_parameter_has_a_line() {
        let (rows, prices) = (map::kept().unwrap(), Prices::kept().unwrap());
        let table = one_at_a_time(&rows, &prices, Core::M4F);
        let of = |setting| rows.iter().filter(|row| row.setting == setting).count();
        let (own, published) = (of(Setting::DEFAULT), of(Setting::PUBLISHED));
        // With arrival times, edges are a law that the model goes with, and models over time follow.
        let lines = if own > 0 { 1 + (own - 1) + published } else { published - 1 };
        assert_eq!(table.lines().filter(|line| line.starts_with("| ")).count(), 2 + 1 + 6 + 3 + 2 + lines);
        for ablation in ["| none |", "| RGB565 |", "| stride 5 |", "| libm ln |", "svm-int8 |", "| no model | – |"] {
            assert!(table.contains(ablation), "{ablation}: {table}");
        }
    }
}
