//! The ablation: the effect of each parameter alone, with all others at the default setting.

use std::fmt::Write;

use super::candidate::short;
use super::parameters::{Setting, kernel_name};
use super::prices::{Core, Prices};
use super::row::Row;
use super::table::{accuracy, grouped, known};

const HEAD: &str = "\
| ablation | specimen accuracy, % (95 % interval) | speed error, % | instructions per frame | instructions per event | flash, bytes | frames to the answer |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
";

/// The model with which all others are compared, if the map has it.
const MODEL: &str = "builtin:svm";

/// Returns a Markdown table of every value of every parameter, the others at the default.
pub fn one_at_a_time(rows: &[Row], prices: &Prices, core: Core) -> String {
    let of_default = |row: &&Row| row.setting == Setting::DEFAULT;
    let models = || rows.iter().filter(of_default).filter_map(|row| row.model.as_deref());
    let model = models().find(|name| *name == MODEL).or_else(|| models().next());
    let whole = model.map_or("no model", short);
    let mut text = format!(
        "One parameter at a time, from {}, {whole}, counted on a Cortex-{}:\n\n{HEAD}",
        Setting::DEFAULT,
        core.name()
    );
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
    for setting in Setting::one_at_a_time() {
        let Some(row) = rows.iter().find(|row| row.setting == setting && row.model.as_deref() == model) else {
            continue;
        };
        let default = Setting::DEFAULT;
        let ablation = match setting {
            setting if setting == default => "none".to_owned(),
            Setting { format, .. } if format != default.format => format.name().to_owned(),
            Setting { stride, .. } if stride != default.stride => format!("stride {}", stride.get()),
            Setting { kernel, .. } => format!("{} ln", kernel_name(kernel)),
        };
        line(&ablation, row);
    }
    for row in rows.iter().filter(of_default).filter(|row| row.model.as_deref() != model) {
        line(row.model.as_deref().map_or("no model", short), row);
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
        let models = rows.iter().filter(|row| row.setting == Setting::DEFAULT).count();
        assert_eq!(table.lines().filter(|line| line.starts_with("| ")).count(), 2 + 1 + 6 + 3 + 2 + (models - 1));
        for ablation in ["| none |", "| RGB565 |", "| stride 5 |", "| libm ln |", "| svm-int8 |", "| no model | – |"]
        {
            assert!(table.contains(ablation), "{ablation}: {table}");
        }
    }
}
