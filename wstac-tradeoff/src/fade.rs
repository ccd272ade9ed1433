//! The decay of answers as light fades, for each parameter alone.

use std::fmt::Write;

use super::candidate::{Candidate, NONE, short};
use super::map;
use super::parameters::{Format, Setting};
use super::row::{Row, rows};
use super::slides::{TradeSlide, reference};
use super::sweep::{self, Plan};
use wstac_core::model::file::Input;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_scene::Scene;

/// Default levels of peak light, in gray levels of 255.
pub const LEVELS: [f64; 9] = [200.0, 100.0, 50.0, 20.0, 10.0, 5.0, 3.0, 2.0, 1.0];

/// The results at one level of light.
#[derive(Clone, Debug)]
pub struct Faded {
    /// Mean of the brightest taxel in the brightest frame of the reference slide, above black, in gray levels of 255.
    pub level: f64,
    /// The default setting with each model, then each other setting with the first model.
    pub rows: Vec<Row>,
}

/// Returns the unchanged peak light of the reference slide, in gray levels of 255.
///
/// # Errors
/// This does not fail.
pub fn peak() -> Result<f64, Error> {
    let mut scene = Scene::new(&reference(1.0, Format::Gray)?)?;
    let mut peak = 0.0_f64;
    while let Some((light, _)) = scene.next_light() {
        peak = light.iter().copied().fold(peak, f64::max);
    }
    Ok(255.0 * peak)
}

/// Sweeps one level of light.
///
/// # Errors
/// [`sweep::run`] fails.
pub fn fade(level: f64, config: &Config, models: &[Candidate], slides: &[TradeSlide]) -> Result<Faded, Error> {
    let first = models.first();
    let base =
        if first.is_none_or(|model| model.input == Input::Frames) { Setting::PUBLISHED } else { Setting::DEFAULT };
    // Models over time and models of the path go with different laws.
    let mut settings = base.one_at_a_time();
    for other in [Setting::DEFAULT, Setting::PUBLISHED] {
        if !settings.contains(&other) {
            settings.push(other);
        }
    }
    let plan = Plan { config, settings: &settings, models, slides, light: level / peak()? };
    let mut rows = rows(&plan, &sweep::run(&plan)?);
    rows.retain(|row| {
        let model = models.iter().find(|model| Some(&model.name) == row.model.as_ref());
        let is_first = model.map(|model| &model.name) == first.map(|model| &model.name);
        model.is_some_and(|model| is_first || row.setting.is_default_of(Some(model.input)))
    });
    Ok(Faded { level, rows })
}

/// Formats rows of all levels as comma-separated values.
pub fn csv(all: &[Faded]) -> String {
    let header = map::write(&[]);
    let mut text = format!("level,{header}");
    for faded in all {
        for row in &faded.rows {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{},{},,", faded.level, map::found(row));
        }
    }
    text
}

/// The text of a row in a table.
type Cell = fn(&Row) -> String;

/// Formats the results as tables: a line for each setting, a column for each level.
pub fn tables(all: &[Faded]) -> String {
    let mut text = String::new();
    let tables: [(&str, Cell); 4] = [
        ("Slides with an event, %", |row| {
            format!("{:.0}", 100.0 * row.found.events as f64 / row.found.slides.max(1) as f64)
        }),
        ("Specimen accuracy, % (a slide without an event is wrong)", |row| {
            row.found.accuracy[0].map_or_else(|| "–".to_owned(), |right| format!("{:.0}", right.mean))
        }),
        ("Speed error, mean, % (in brackets: slides without a speed, %), 100 to 200 mm/s", |row| {
            let missing = 100.0 * row.found.speedless as f64 / row.found.speed_slides.max(1) as f64;
            let mean = row.found.speed.map_or_else(|| "–".to_owned(), |[mean, _]| format!("{mean:.1}"));
            format!("{mean} ({missing:.0})")
        }),
        ("Directions wrong or missing, %", |row| {
            format!("{:.0}", 100.0 * row.found.direction_errors as f64 / row.found.slides.max(1) as f64)
        }),
    ];
    for (title, cell) in tables {
        let levels: Vec<String> = all.iter().map(|faded| faded.level.to_string()).collect();
        let _ = writeln!(text, "\n{title}:\n\n| peak light, gray levels | {} |", levels.join(" | "));
        let _ = writeln!(text, "| --- |{}", " ---: |".repeat(all.len()));
        let names = all.first().map_or(&[][..], |faded| &faded.rows);
        for (number, row) in names.iter().enumerate() {
            let cells: Vec<String> = all.iter().filter_map(|faded| faded.rows.get(number)).map(cell).collect();
            let _ = writeln!(
                text,
                "| {}, {} | {} |",
                row.setting,
                short(row.model.as_deref().unwrap_or(NONE)),
                cells.join(" | ")
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_slide_reaches_a_good_part_of_full_scale() {
        let peak = peak().unwrap();
        assert!((20.0..200.0).contains(&peak), "{peak}");
    }
}
