//! The map as a figure of three panels.

use std::fmt::Write;

use wstac_core::frame::Stride;

use super::candidate::{Candidate, short};
use super::parameters::{Format, STRIDES, Setting};
use super::prices::{Core, Prices};
use super::row::{Row, base};
use super::table::grouped;
use wstac_host::config::Kernel;
use wstac_plot::axes::{Axes, Scale, Span, legend};
use wstac_plot::page::{MARGIN, WIDTH, caption, place};
use wstac_plot::style::{BLUE, GRAY, GREEN, INK, LINE, RED, SIZE, THICK, THIN};
use wstac_plot::svg::{Anchor, Drawing, Look, Marker};
use wstac_plot::text::wrapped;
use wstac_train::model::inspect::ModelKind;

/// The upper edge of the first panels, and the height of panels.
const FIRST: f64 = 18.0;
const HEIGHT: f64 = 180.0;
/// Distance from a panel to its legend; the distance from a legend to the next panel or the caption follows.
const BELOW: f64 = 36.0;
const NEXT: f64 = 16.0;

fn of_format(format: Format) -> Look {
    let (marker, color, filled) = match format {
        Format::Gray => (Marker::Circle, INK, true),
        Format::Bayer8 => (Marker::Square, GRAY, true),
        Format::Rgb24 => (Marker::Diamond, BLUE, false),
        Format::Rgb565 => (Marker::Triangle, RED, true),
        Format::YuyvExact => (Marker::Square, GREEN, false),
        Format::YuyvLinear => (Marker::Circle, GREEN, false),
        Format::Mjpeg => (Marker::Plus, INK, false),
    };
    Look { marker, color, filled }
}

/// Returns a model's family, and its look.
fn family(model: &Candidate) -> (&'static str, Look) {
    let look = |marker, color, filled| Look { marker, color, filled };
    match model.about.kind {
        ModelKind::Forest => ("forest", look(Marker::Triangle, GREEN, true)),
        ModelKind::Boosted => ("boosted trees", look(Marker::Square, RED, false)),
        ModelKind::OneVsOne => ("SVM, one-vs-one", look(Marker::Circle, INK, true)),
        _ => ("SVM, one-vs-rest", look(Marker::Diamond, BLUE, false)),
    }
}

/// Draws the map as an SVG file's text, with prices on this core.
pub fn draw(rows: &[Row], models: &[Candidate], prices: &Prices, core: Core) -> String {
    let mut drawing = Drawing::new(WIDTH, "What speed costs in accuracy");
    let own: Vec<(&Row, &Candidate)> = rows
        .iter()
        .filter(|row| row.found.accuracy[0].is_some())
        .filter_map(|row| Some((row, models.iter().find(|model| Some(&model.name) == row.model.as_ref())?)))
        .filter(|(row, model)| row.setting.is_default_of(Some(model.input)))
        .collect();
    let left = front_ends(&mut drawing, rows, prices, core);
    let right = latency(&mut drawing, &own);
    let second = left.max(right) + NEXT;
    let end = accuracy(&mut drawing, &own, prices, core, second);
    let height = caption(&mut drawing, end + NEXT, &words(&own, base(rows), prices, core));
    drawing.finish(height)
}

/// Returns the caption.
fn words(own: &[(&Row, &Candidate)], base: Setting, prices: &Prices, core: Core) -> String {
    let mut text =
        "a: error of the features of lit rows and columns, compared with a float64 reference; numbers are pixel \
        strides. b: texture, mean over events; points are shifted slightly, so that they do not cover each other"
            .to_owned();
    let whole =
        own.iter().filter(|(_, model)| !is_early(model)).filter_map(|(row, _)| row.found.latency).reduce(f64::max);
    if let Some(frames) = whole {
        // Writing to a string does not fail.
        let _ = write!(text, "; speed and direction come with the whole sample, at {frames:.1} frames");
    }
    text += ". c: models that read all 70 frames, with the size of their files";
    if let Some(others) = prices.of(core, &base, None).and_then(|price| price.event()) {
        let _ = write!(
            text,
            "; speed and direction by the law {} add {} instructions per event",
            base.law.name(),
            grouped(others)
        );
    }
    text + ". b, c: GREY, stride 1; bars are 95 % intervals over 20 sensors."
}

/// A point, and its pixel stride.
type Numbered = ([f64; 2], u16);

/// The frames to the answer, and the row and model that answer.
type Early<'r> = (f64, &'r Row, &'r Candidate);

/// Draws feature error against instructions per frame, and returns where the panel ends.
///
/// It shows formats, strides and logarithms.
fn front_ends(drawing: &mut Drawing, rows: &[Row], prices: &Prices, core: Core) -> f64 {
    let base = base(rows);
    let at = |setting: &Setting| {
        let row = rows.iter().find(|row| row.setting == *setting && row.model.is_none())?;
        let price = prices.of(core, setting, None)?;
        Some([price.frame() as f64, row.found.feature[1].max(1e-6)])
    };
    let series = |format| {
        let of = |stride: Stride| Some((at(&Setting { format, stride, ..base })?, stride.get()));
        STRIDES.into_iter().filter_map(of).collect::<Vec<_>>()
    };
    let all: Vec<(Format, Vec<Numbered>)> = Format::ALL.into_iter().map(|format| (format, series(format))).collect();
    let kernels =
        [(Kernel::Libm, Marker::Cross, "GREY, libm ln"), (Kernel::Micromath, Marker::Plus, "GREY, micromath ln")];
    let others: Vec<_> = kernels
        .into_iter()
        .filter_map(|(kernel, marker, name)| {
            let setting = Setting { kernel, ..base };
            Some((at(&setting)?, Look { marker, color: INK, filled: false }, name))
        })
        .collect();
    let drawn = all.iter().flat_map(|(_, points)| points.iter().map(|(point, _)| *point));
    let points: Vec<[f64; 2]> = drawn.chain(others.iter().map(|(point, ..)| *point)).collect();
    let span = |side: usize| Span::around(Scale::Log, points.iter().map(|point| point[side]));
    let Some((x, y)) = span(0).zip(span(1)) else { return FIRST };
    let [left, width] = place(0, 2);
    let mut axes = Axes::new([left, FIRST], [width, HEIGHT], x, y);
    let x_title = format!("instructions per frame, Cortex-{}", core.name());
    axes.draw(drawing, ["a  Formats, strides, logarithms", &x_title, "feature error, root mean square (ln)"]);
    for (format, points) in &all {
        let line: Vec<_> = points.iter().map(|(point, _)| *point).collect();
        axes.line(drawing, &line, of_format(*format).color, THIN);
        for point in line {
            axes.point(drawing, point, of_format(*format));
        }
    }
    for (point, look, _) in &others {
        axes.point(drawing, *point, *look);
    }
    // Markers on top of each other share a number.
    let mut numbered: Vec<Numbered> = Vec::new();
    for (point, stride) in all.iter().flat_map(|(_, points)| points) {
        let is_there = |(other, of): &Numbered| of == stride && axes.is_same_place(*other, *point);
        if !numbered.iter().any(is_there) {
            axes.label(drawing, *point, &stride.to_string());
            numbered.push((*point, *stride));
        }
    }
    let mut looks: Vec<(Look, &str)> = all
        .iter()
        .filter(|(_, points)| !points.is_empty())
        .map(|(format, _)| (of_format(*format), format.name()))
        .collect();
    looks.extend(others.iter().map(|(_, look, name)| (*look, *name)));
    legend(drawing, [left, axes.bottom() + BELOW], width, &looks)
}

/// Draws accuracy against instructions per event, and returns where the panel ends.
///
/// It shows models that read the whole sample.
fn accuracy(drawing: &mut Drawing, own: &[(&Row, &Candidate)], prices: &Prices, core: Core, top: f64) -> f64 {
    let whole = own.iter().filter(|(_, model)| !is_early(model));
    let points: Vec<(f64, &Row, &Candidate)> = whole
        .filter_map(|(row, model)| {
            let price = prices.of(core, &row.setting, row.model.as_deref())?;
            Some((price.texture? as f64, *row, *model))
        })
        .collect();
    let x = Span::around(Scale::Log, points.iter().map(|(event, ..)| *event));
    let Some((x, y)) = x.zip(accuracies(points.iter().map(|(_, row, _)| *row))) else {
        let line = |(_, model): &(&Row, &Candidate)| {
            let text =
                format!("{} has no price on boards: ci/measure prices --keep {0} counts it.", short(&model.name));
            wrapped(&text, SIZE, WIDTH - 2.0 * MARGIN)
        };
        let mut end = top;
        for text in own.iter().flat_map(line) {
            drawing.text([MARGIN, end], SIZE, Anchor::Start, &text);
            end += LINE;
        }
        return end;
    };
    let [left, width] = place(0, 1);
    let mut axes = Axes::new([left, top], [width, HEIGHT], x, y);
    let x_title = format!("instructions of texture per event, Cortex-{}", core.name());
    axes.draw(drawing, ["c  Models, all 70 frames", &x_title, "specimen accuracy (%)"]);
    for (event, row, model) in &points {
        let Some(right) = row.found.accuracy[0] else { continue };
        let look = family(model).1;
        axes.bar(drawing, *event, [right.low, right.high], look.color);
        axes.point(drawing, [*event, right.mean], look);
    }
    for (event, row, model) in &points {
        let Some(right) = row.found.accuracy[0] else { continue };
        let label = format!("{}, {} kB", short(&model.name), model.about.bytes.div_ceil(1000));
        axes.label(drawing, [*event, right.mean], &label);
    }
    let families = families(points.iter().map(|(.., model)| *model));
    legend(drawing, [left, axes.bottom() + BELOW], width, &families)
}

/// Draws accuracy against latency, and returns where the panel ends.
///
/// It shows models of a kind that read more and more of a sample.
fn latency(drawing: &mut Drawing, own: &[(&Row, &Candidate)]) -> f64 {
    let mut series: Vec<(&str, Vec<Early>)> = Vec::new();
    for (row, model) in own {
        let Some(latency) = row.found.latency else { continue };
        let stem = stem(short(&model.name));
        match series.iter_mut().find(|(name, _)| *name == stem) {
            Some((_, points)) => points.push((latency, row, model)),
            None => series.push((stem, vec![(latency, row, model)])),
        }
    }
    series.retain(|(_, points)| points.len() > 1);
    for (_, points) in &mut series {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let all = || series.iter().flat_map(|(_, points)| points);
    let x = Span::around(Scale::Linear, all().map(|(latency, ..)| *latency));
    let Some((x, y)) = x.zip(accuracies(all().map(|(_, row, _)| *row))) else { return FIRST };
    let [left, width] = place(1, 2);
    let mut axes = Axes::new([left, FIRST], [width, HEIGHT], x, y);
    axes.draw(drawing, ["b  Early answers", "frames from first touch to answer", "specimen accuracy (%)"]);
    let mut looks = Vec::new();
    // Points that would be on top of each other are drawn side by side.
    for ((name, points), number) in series.iter().zip(0..) {
        let aside = 0.5 * (f64::from(number) - 0.5 * (series.len() as f64 - 1.0));
        let Some((_, look)) = points.first().map(|(.., model)| family(model)) else { continue };
        let answers = points.iter().filter_map(|(latency, row, _)| Some((latency + aside, row.found.accuracy[0]?)));
        let line: Vec<_> = answers.clone().map(|(latency, right)| [latency, right.mean]).collect();
        axes.line(drawing, &line, look.color, THICK);
        for (latency, right) in answers {
            axes.bar(drawing, latency, [right.low, right.high], look.color);
            axes.point(drawing, [latency, right.mean], look);
        }
        looks.push((look, *name));
    }
    legend(drawing, [left, axes.bottom() + BELOW], width, &looks)
}

/// Returns `true` if a model reads less than the whole sample.
fn is_early(model: &Candidate) -> bool {
    stem(short(&model.name)) != short(&model.name) || model.about.frames < 50
}

/// Returns a name without its frames: `forest-25` of `forest-25-40f`.
fn stem(name: &str) -> &str {
    let frames =
        |end: &str| end.strip_suffix('f').is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()));
    name.rsplit_once('-').filter(|(_, end)| frames(end)).map_or(name, |(stem, _)| stem)
}

fn accuracies<'r>(rows: impl Iterator<Item = &'r Row>) -> Option<Span> {
    let ends = rows.filter_map(|row| row.found.accuracy[0]).flat_map(|right| [right.low, right.high]);
    Span::around(Scale::Linear, ends)
}

fn families<'m>(models: impl Iterator<Item = &'m Candidate>) -> Vec<(Look, &'static str)> {
    let mut looks: Vec<(Look, &'static str)> = Vec::new();
    for (name, look) in models.map(family) {
        if !looks.iter().any(|(_, known)| *known == name) {
            looks.push((look, name));
        }
    }
    looks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map;

    #[test]
    fn every_model_that_reads_the_whole_sample_has_its_label() {
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
            assert_eq!(figure.matches(">a  Formats").count() + figure.matches(">b  Early").count(), 2);
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
