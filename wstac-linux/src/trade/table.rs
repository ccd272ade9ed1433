//! Rows for a person: a line each of a table, or all numbers of one.

use std::fmt::Write;

use super::candidate::{Candidate, NONE, short};
use super::pareto;
use super::prices::{Core, Price, Prices};
use super::row::Row;
use super::statistics::Interval;

/// What the table's columns are.
const HEAD: &str = "\
| format | stride | ln | model | specimen, % (95 %) | pattern, % | depth, % | speed error, % | directions wrong or none | feature error, root mean square, lit | frames to the answer | instructions a frame | an event | flash, bytes | RAM |
| --- | ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";

/// The settings that no other one beats, as a Markdown table.
pub fn pareto(rows: &[Row], prices: &Prices, core: Core) -> String {
    let mut text = format!("Of a Cortex-{}, the fastest first:\n\n{HEAD}", core.name());
    for (row, price) in pareto::unbeaten(rows, prices, core) {
        line(&mut text, row, &price);
    }
    text
}

fn line(text: &mut String, row: &Row, price: &Price) {
    let [specimen, pattern, depth] = row.found.accuracy;
    let mean = |of: Option<Interval>| of.map_or_else(|| "–".to_owned(), |of| format!("{:.1}", of.mean));
    let whole =
        specimen.map_or_else(|| "–".to_owned(), |of| format!("{:.1} ({:.1} … {:.1})", of.mean, of.low, of.high));
    let speed = row.found.speed.map_or_else(|| "–".to_owned(), |[mean, _]| format!("{mean:.1}"));
    let latency = row.found.latency.map_or_else(|| "–".to_owned(), |frames| format!("{frames:.1}"));
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "| {} | {} | {} | {} | {whole} | {} | {} | {speed} | {} of {} | {:.4} | {latency} | {} | {} | {} | {} |",
        row.setting.format.name(),
        row.setting.stride.get(),
        super::knobs::kernel_name(row.setting.kernel),
        short(row.model.as_deref().unwrap_or(NONE)),
        mean(pattern),
        mean(depth),
        row.found.direction_errors,
        row.found.slides,
        row.found.feature[1],
        grouped(price.frame()),
        grouped(price.event()),
        grouped(price.flash),
        grouped(price.ram),
    );
}

/// A number with a comma before every three digits.
pub fn grouped(number: i64) -> String {
    let digits = number.unsigned_abs().to_string();
    let mut text = if number < 0 { "-".to_owned() } else { String::new() };
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// All numbers of a configuration, a line each.
pub fn all(row: &Row, models: &[Candidate], prices: &Prices) -> String {
    let found = &row.found;
    let mut text = format!("setting     {}\n", row.setting);
    let model = models.iter().find(|model| Some(&model.name) == row.model.as_ref());
    let _ = match model {
        Some(model) => {
            let about = &model.about;
            let trees = about.trees.as_ref();
            let trees =
                trees.map_or_else(String::new, |trees| format!(", {} trees up to {} deep", trees.count, trees.depth));
            let (kind, bytes, frames) = (about.kind, grouped(about.bytes as i64), about.frames);
            writeln!(
                text,
                "model       {}: {kind}, {}{trees}, {bytes} bytes, {frames} frames",
                short(&model.name),
                about.numbers
            )
        }
        None => writeln!(text, "model       none"),
    };
    let _ = writeln!(
        text,
        "judged by   {} slides, {} of them with an event; the others are wrong",
        found.slides, found.events
    );
    for (task, right) in ["specimen", "pattern", "depth"].into_iter().zip(found.accuracy) {
        let Some(Interval { mean, low, high }) = right else { continue };
        let _ = writeln!(text, "{task:11} {mean:.2} % right, 95 % interval {low:.2} … {high:.2}");
    }
    if let Some([mean, most]) = found.speed {
        let without = (found.speedless, found.speed_slides);
        let _ = writeln!(
            text,
            "speed       off by {mean:.2} % on average, 95 % of them by at most {most:.2} % ({} of {} without one), 100 to 200 mm/s",
            without.0, without.1
        );
    }
    let _ = writeln!(text, "direction   {} of {} wrong or none", found.direction_errors, found.slides);
    let [max_lit, rms_lit, max, rms] = found.feature;
    let _ = writeln!(
        text,
        "features    off by {rms_lit:.5} (root mean square), at most {max_lit:.4}, where lit; all: {rms:.5}, {max:.4} (natural logarithms)"
    );
    if let Some(latency) = found.latency {
        let _ = writeln!(text, "latency     {latency:.1} frames from the first touch to the answer");
    }
    for core in Core::ALL {
        let price = prices.of(core, &row.setting, row.model.as_deref());
        let _ = match price {
            Some(price) => writeln!(
                text,
                "{:11} {} instructions a frame, {} an event; {} bytes of flash, {} of RAM",
                core.name(),
                grouped(price.frame()),
                grouped(price.event()),
                grouped(price.flash),
                grouped(price.ram)
            ),
            None => writeln!(text, "{:11} –", core.name()),
        };
    }
    if let Some(host) = row.host {
        let (frame, event) = (grouped(host.frame_ns as i64), grouped(host.event_ns as i64));
        let _ = writeln!(text, "host        {frame} ns a frame, {event} an event, on the machine that made the map");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::map;

    #[test]
    fn numbers_are_grouped_by_three() {
        assert_eq!(
            [0, 7, 999, 1000, 1_234_567, -45_000].map(grouped),
            ["0", "7", "999", "1,000", "1,234,567", "-45,000"]
        );
    }

    #[test]
    fn a_table_has_as_many_cells_as_columns() {
        let line = "GREY,1,fixed,builtin:svm,800,800,80.00,78.00,82.00,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,9000,3000";
        let rows = map::read("m", &format!("{}{line}\n", map::write(&[]))).unwrap();
        let table = pareto(&rows, &Prices::kept().unwrap(), Core::M4F);
        let cells: Vec<usize> = table.lines().skip(2).map(|line| line.matches('|').count()).collect();
        assert_eq!(cells, [16, 16, 16], "{table}");
        assert!(all(&rows[0], &[], &Prices::kept().unwrap()).contains("80.00 % right, 95 % interval 78.00 … 82.00"));
    }
}
