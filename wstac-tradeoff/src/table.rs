//! Rows for a person: a line of a table for each, or all numbers of one.

use std::fmt::Write;

use super::candidate::{Candidate, NONE, short};
use super::pareto;
use super::prices::{Core, Price, Prices};
use super::row::Row;
use super::statistics::Interval;
use wstac_core::model::file::Input;
use wstac_core::params::{NOMINAL_FRAME_RATE, SAMPLE_FRAMES};

const HEAD: &str = "\
| format | stride | ln | law | model | specimen accuracy, % (95 % interval) | pattern accuracy, % | depth accuracy, % | speed error, % | directions wrong or missing | objects, % | feature error where lit, root mean square | frames to the answer | instructions per frame | instructions per event | flash, bytes | RAM, bytes |
| --- | ---: | --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";

/// Returns the unbeaten settings, as a Markdown table.
pub fn pareto(rows: &[Row], prices: &Prices, core: Core) -> String {
    let mut text = format!("Of a Cortex-{}, the fastest first:\n\n{HEAD}", core.name());
    for (row, price) in pareto::unbeaten(rows, prices, core) {
        line(&mut text, row, &price);
    }
    text.push_str(&unpriced(rows, prices, core));
    text
}

/// Returns a line for each model of these rows that has no price on boards.
pub fn unpriced(rows: &[Row], prices: &Prices, core: Core) -> String {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        let Some(name) = row.model.as_deref() else { continue };
        let price = prices.of(core, &row.setting, Some(name));
        if price.is_some_and(|price| price.texture.is_none()) && !names.contains(&name) {
            names.push(name);
        }
    }
    let line = |name| format!("\n{} has no price on boards: ci/measure prices --keep {0} counts it.\n", short(name));
    names.into_iter().map(line).collect()
}

/// Formats a number, or the mark for an unknown number.
fn known(number: Option<i64>) -> String {
    number.map_or_else(|| "–".to_owned(), grouped)
}

fn line(text: &mut String, row: &Row, price: &Price) {
    let [specimen, pattern, depth] = row.found.accuracy;
    let mean = |of: Option<Interval>| of.map_or_else(|| "–".to_owned(), |of| format!("{:.1}", of.mean));
    let whole =
        specimen.map_or_else(|| "–".to_owned(), |of| format!("{:.1} ({:.1} … {:.1})", of.mean, of.low, of.high));
    let speed = row.found.speed.map_or_else(|| "–".to_owned(), |[mean, _]| format!("{mean:.1}"));
    let one = |number: Option<f64>| number.map_or_else(|| "–".to_owned(), |number| format!("{number:.1}"));
    let (latency, objects) = (one(row.found.latency), one(row.found.objects));
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "| {} | {} | {whole} | {} | {} | {speed} | {} of {} | {objects} | {:.4} | {latency} | {} | {} | {} | {} |",
        row.setting.names().join(" | "),
        short(row.model.as_deref().unwrap_or(NONE)),
        mean(pattern),
        mean(depth),
        row.found.direction_errors,
        row.found.slides,
        row.found.feature[1],
        grouped(price.frame()),
        known(price.event()),
        known(price.flash),
        known(price.ram),
    );
}

/// Formats a number with a comma before every three digits.
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

/// Formats all numbers of a configuration, one on each line.
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
        "judged by   {} slides, {}",
        found.slides,
        match found.slides - found.events {
            0 => "all with an event".to_owned(),
            missing => format!("{missing} of them without an event, which is wrong"),
        }
    );
    for (task, right) in ["specimen", "pattern", "depth"].into_iter().zip(found.accuracy) {
        let Some(Interval { mean, low, high }) = right else { continue };
        let _ = writeln!(text, "{task:11} {mean:.2} % right, 95 % interval {low:.2} … {high:.2}");
    }
    if let Some([mean, most]) = found.speed {
        let without = match found.speedless {
            0 => String::new(),
            missing => format!(", {missing} of {} without one", found.speed_slides),
        };
        let _ = writeln!(
            text,
            "speed       off by {mean:.2} % on average, 95 % of them by at most {most:.2} %{without}, 100 to 200 mm/s"
        );
    }
    let _ = writeln!(text, "direction   {} of {} wrong or missing", found.direction_errors, found.slides);
    if let Some(right) = found.objects {
        let _ = writeln!(
            text,
            "objects     {right:.1} % of touches of rods, balls, coins, corners and narrow blocks reliable and right"
        );
    }
    let [max_lit, rms_lit, max, rms] = found.feature;
    let _ = writeln!(
        text,
        "features    off by {rms_lit:.5} (root mean square), {max_lit:.4} (at most) where lit; {rms:.5}, {max:.4} everywhere (natural logarithms)"
    );
    if let Some(latency) = found.latency {
        let mut line = |label: &str, frames: f64, what: &str| {
            let seconds = frames / f64::from(NOMINAL_FRAME_RATE);
            let _ = writeln!(text, "{label:11} {frames:.1} frames, {seconds:.2} s, from the first touch to {what}");
        };
        match model.filter(|model| model.input == Input::Frames) {
            Some(model) => {
                line("latency", latency, "texture");
                let unread = SAMPLE_FRAMES.saturating_sub(model.about.frames as usize);
                line("", latency + unread as f64, "speed and direction");
            }
            None => line("latency", latency, "the answer"),
        }
    }
    let stripe = row.setting.format.stripe_bytes();
    let stripe = stripe.map_or_else(String::new, |bytes| format!(" + {} for 8 rows of 400", grouped(bytes)));
    for core in Core::ALL {
        let price = prices.of(core, &row.setting, row.model.as_deref());
        let _ = match price {
            Some(price) => writeln!(
                text,
                "{:11} {} instructions per frame, {} per event; {} bytes of flash, {} of RAM{stripe}",
                core.name(),
                grouped(price.frame()),
                known(price.event()),
                known(price.flash),
                known(price.ram)
            ),
            None => writeln!(text, "{:11} –", core.name()),
        };
    }
    text.push_str(&unpriced(std::slice::from_ref(row), prices, Core::M4F));
    text
}

/// Describes a configuration that is cheaper than the selected one, in a line.
pub fn nearly(row: &Row, prices: &Prices, cores: &[Core]) -> String {
    let model = short(row.model.as_deref().unwrap_or(NONE));
    let mut text = format!("within a point of it, and cheapest: {}, model {model}", row.setting);
    if let Some(right) = row.found.accuracy[0] {
        let _ = write!(text, ", {:.2} % right", right.mean);
    }
    for core in cores {
        if let Some(price) = prices.of(*core, &row.setting, row.model.as_deref()) {
            let (frame, event) = (grouped(price.frame()), known(price.event()));
            let _ = write!(
                text,
                "; {}: {frame} per frame, {event} per event, {} of flash",
                core.name(),
                known(price.flash)
            );
        }
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map;

    #[test]
    fn numbers_are_grouped_by_three() {
        assert_eq!(
            [0, 7, 999, 1000, 1_234_567, -45_000].map(grouped),
            ["0", "7", "999", "1,000", "1,234,567", "-45,000"]
        );
    }

    #[test]
    fn a_table_has_as_many_cells_as_columns() {
        let line = "GREY,1,fixed,published,builtin:svm,800,800,80.00,78.00,82.00,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,95.0";
        let rows = map::read("m", &format!("{}{line}\n", map::write(&[]))).unwrap();
        let table = pareto(&rows, &Prices::kept().unwrap(), Core::M4F);
        let cells: Vec<usize> = table.lines().skip(2).map(|line| line.matches('|').count()).collect();
        assert_eq!(cells, [18, 18, 18], "{table}");
        assert!(all(&rows[0], &[], &Prices::kept().unwrap()).contains("80.00 % right, 95 % interval 78.00 … 82.00"));
    }
}
