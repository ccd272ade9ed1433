//! The map as a figure: the accuracy of models against their cost.

use std::fmt::Write;

use super::candidate::{Candidate, short};
use super::prices::{Core, Prices};
use super::row::Row;
use super::table::grouped;
use wstac_core::model::file::Input;
use wstac_plot::axes::{Axes, Span};
use wstac_plot::page::{MARGIN, WIDTH, caption};
use wstac_plot::style::{BLUE, GREEN, INK, LINE, RED, SIZE};
use wstac_plot::svg::{Anchor, Drawing, Look, Marker};
use wstac_plot::text::wrapped;
use wstac_train::model::inspect::ModelKind;

/// The place of the panel on the page.
const PLACE: [f64; 2] = [MARGIN + 40.0, 18.0];
const PANEL: [f64; 2] = [WIDTH - 2.0 * MARGIN - 50.0, 180.0];
/// Distance from the panel to the caption.
const BELOW: f64 = 42.0;

fn look(kind: ModelKind) -> Look {
    let (marker, color, filled) = match kind {
        ModelKind::Forest => (Marker::Triangle, GREEN, true),
        ModelKind::Boosted => (Marker::Square, RED, false),
        ModelKind::OneVsOne => (Marker::Circle, INK, true),
        _ => (Marker::Diamond, BLUE, false),
    };
    Look { marker, color, filled }
}

/// Draws the models, each in its default setting, as an SVG file's text.
///
/// Prices are those on this core.
pub fn draw(rows: &[Row], models: &[Candidate], prices: &Prices, core: Core) -> String {
    let mut drawing = Drawing::new(WIDTH, "What speed costs in accuracy");
    let own: Vec<(&Row, &Candidate)> = rows
        .iter()
        .filter(|row| row.found.accuracy[0].is_some())
        .filter_map(|row| Some((row, models.iter().find(|model| Some(&model.name) == row.model.as_ref())?)))
        .filter(|(row, model)| row.setting.is_default_of(Some(model.input)) && !is_early(model))
        .collect();
    let end = panel(&mut drawing, &own, prices, core);
    let mut text =
        "Models that need all 70 frames, with the size of their files: triangles are forests, squares boosted \
        trees, circles one-vs-one and diamonds one-vs-rest. GREY, stride 1; bars are 95 % intervals over 20 sensors."
            .to_owned();
    let setting = own.first().map(|(row, _)| row.setting);
    let others = setting.and_then(|setting| Some((setting.law, prices.of(core, &setting, None)?.event()?)));
    if let Some((law, others)) = others {
        let (law, others) = (law.name(), grouped(others));
        // Writing to a string does not fail.
        let _ = write!(text, " Speed and direction by the law {law} add {others} instructions per event.");
    }
    let height = caption(&mut drawing, end, &text);
    drawing.finish(height)
}

/// Draws accuracy against instructions per event, and returns where the panel ends.
fn panel(drawing: &mut Drawing, own: &[(&Row, &Candidate)], prices: &Prices, core: Core) -> f64 {
    let point = |(row, model): &(&Row, &Candidate)| {
        let event = prices.of(core, &row.setting, row.model.as_deref())?.texture? as f64;
        let right = row.found.accuracy[0]?;
        let label = format!("{}, {} kB", short(&model.name), model.about.bytes.div_ceil(1000));
        Some((event, right, look(model.about.kind), label))
    };
    let points: Vec<_> = own.iter().filter_map(point).collect();
    let x = Span::log_around(points.iter().map(|(event, ..)| *event));
    let y = Span::around(points.iter().flat_map(|(_, right, ..)| [right.low, right.high]));
    let Some((x, y)) = x.zip(y) else {
        let line = |(_, model): &(&Row, &Candidate)| {
            let text =
                format!("{} has no price on boards: ci/measure prices --keep {0} counts it.", short(&model.name));
            wrapped(&text, SIZE, WIDTH - 2.0 * MARGIN)
        };
        let mut end = PLACE[1];
        for text in own.iter().flat_map(line) {
            drawing.text([MARGIN, end], SIZE, Anchor::Start, &text);
            end += LINE;
        }
        return end;
    };
    let mut axes = Axes::new(PLACE, PANEL, x, y);
    let x_title = format!("instructions of texture per event, Cortex-{}", core.name());
    axes.draw(drawing, ["", &x_title, "specimen accuracy (%)"]);
    for (event, right, look, _) in &points {
        axes.bar(drawing, *event, [right.low, right.high], look.color);
        axes.point(drawing, [*event, right.mean], *look);
    }
    for (event, right, .., label) in &points {
        axes.label(drawing, [*event, right.mean], label);
    }
    axes.bottom() + BELOW
}

/// Returns `true` if a model answers before the sample is whole.
fn is_early(model: &Candidate) -> bool {
    model.input == Input::Frames && model.about.frames < 65
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map;

    #[test]
    fn every_model_that_needs_the_whole_sample_has_its_label() {
        let (rows, prices) = (map::kept().unwrap(), Prices::kept().unwrap());
        let models = Candidate::all_built_in().unwrap();
        for core in Core::ALL {
            let figure = draw(&rows, &models, &prices, core);
            let whole: Vec<_> = models.iter().filter(|model| !is_early(model)).collect();
            assert!(whole.len() > 10);
            for model in whole {
                let label = format!(">{}, {} kB<", short(&model.name), model.about.bytes.div_ceil(1000));
                assert_eq!(figure.matches(&label).count(), 1, "{core:?}: {label}");
            }
        }
    }

    #[test]
    fn models_without_a_price_are_named_instead() {
        let (rows, models) = (map::kept().unwrap(), Candidate::all_built_in().unwrap());
        let text = r#"{"compiler": "c", "frame": "f", "cores": {}}"#;
        let figure = draw(&rows, &models, &Prices::read("p", text).unwrap(), Core::M0);
        assert!(
            figure.contains(">svm-int8 has no price on boards: ci/measure prices --keep svm-int8 counts it.<"),
            "{figure}"
        );
        assert!(!figure.contains("NaN") && !figure.contains("inf"));
    }
}
