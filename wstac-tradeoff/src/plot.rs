//! The map as a picture of three panels.

mod axes;

use wstac_core::frame::Stride;

use self::axes::{Axes, Scale, Span};
use super::candidate::{Candidate, short};
use super::knobs::{Format, STRIDES, Setting};
use super::prices::{Core, Prices};
use super::row::Row;
use super::table::grouped;
use wstac_host::config::Kernel;
use wstac_plot::svg::{Anchor, Drawing, Look, Marker};

const BLACK: &str = "#000000";
const BLUE: &str = "#0072b2";
const RED: &str = "#d55e00";
const GREEN: &str = "#2a9d72";
const GREY: &str = "#777777";

/// Size of a panel in pixels, and where the first one is.
const PANEL: [f64; 2] = [300.0, 260.0];
const FIRST: [f64; 2] = [66.0, 34.0];
/// From panel to panel.
const APART: f64 = 392.0;

/// How formats look.
fn of_format(format: Format) -> Look {
    let (marker, color, filled) = match format {
        Format::Gray => (Marker::Circle, BLACK, true),
        Format::Bayer8 => (Marker::Square, GREY, true),
        Format::Rgb24 => (Marker::Diamond, BLUE, false),
        Format::Rgb565 => (Marker::Triangle, RED, true),
        Format::YuyvExact => (Marker::Square, GREEN, false),
        Format::YuyvLinear => (Marker::Circle, GREEN, false),
        Format::Mjpeg => (Marker::Plus, BLACK, false),
    };
    Look { marker, color, filled }
}

/// A model's family, and how it looks.
fn family(model: &Candidate) -> (&'static str, Look) {
    let look = |marker, color, filled| Look { marker, color, filled };
    match model.about.kind {
        "forest" => ("forest", look(Marker::Triangle, GREEN, true)),
        "boosted trees" => ("boosted trees", look(Marker::Square, RED, false)),
        "linear, one against one" => ("SVM, one against one", look(Marker::Circle, BLACK, true)),
        _ => ("SVM, one against the rest", look(Marker::Diamond, BLUE, false)),
    }
}

/// The picture, with prices on this core.
pub fn draw(rows: &[Row], models: &[Candidate], prices: &Prices, core: Core) -> String {
    let size = [FIRST[0] + 2.0 * APART + PANEL[0] + 20.0, FIRST[1] + PANEL[1] + 146.0];
    let mut drawing = Drawing::new(size, "What speed costs in accuracy");
    front_ends(&mut drawing, rows, prices, core);
    let own: Vec<(&Row, &Candidate)> = rows
        .iter()
        .filter(|row| row.setting == Setting::DEFAULT && row.found.accuracy[0].is_some())
        .filter_map(|row| Some((row, models.iter().find(|model| Some(&model.name) == row.model.as_ref())?)))
        .collect();
    accuracy(&mut drawing, &own, prices, core);
    latency(&mut drawing, &own);
    drawing.finish()
}

fn place(panel: u32) -> [f64; 2] {
    [FIRST[0] + APART * f64::from(panel), FIRST[1]]
}

/// A point, and its pixel stride.
type Numbered = ([f64; 2], u16);

/// Frames to the answer, and what answers.
type Early<'r> = (f64, &'r Row, &'r Candidate);

/// Feature error against instructions a frame: formats, strides and logarithms.
fn front_ends(drawing: &mut Drawing, rows: &[Row], prices: &Prices, core: Core) {
    let at = |setting: &Setting| {
        let row = rows.iter().find(|row| row.setting == *setting && row.model.is_none())?;
        let price = prices.of(core, setting, None)?;
        Some([price.frame() as f64, row.found.feature[1].max(1e-6)])
    };
    let series = |format| {
        let of = |stride: Stride| Some((at(&Setting { format, stride, kernel: Kernel::Fixed })?, stride.get()));
        STRIDES.into_iter().filter_map(of).collect::<Vec<_>>()
    };
    let all: Vec<(Format, Vec<Numbered>)> = Format::ALL.into_iter().map(|format| (format, series(format))).collect();
    let kernels =
        [(Kernel::Libm, Marker::Cross, "GREY, libm ln"), (Kernel::Micromath, Marker::Plus, "GREY, micromath ln")];
    let others: Vec<_> = kernels
        .into_iter()
        .filter_map(|(kernel, marker, name)| {
            let setting = Setting { format: Format::Gray, stride: Stride::One, kernel };
            Some((at(&setting)?, Look { marker, color: BLACK, filled: false }, name))
        })
        .collect();
    let drawn = all.iter().flat_map(|(_, points)| points.iter().map(|(point, _)| *point));
    let points: Vec<[f64; 2]> = drawn.chain(others.iter().map(|(point, ..)| *point)).collect();
    let spans =
        Span::of(Scale::Log, points.iter().map(|[x, _]| *x)).zip(Span::of(Scale::Log, points.iter().map(|[_, y]| *y)));
    let Some((x, y)) = spans else { return };
    let x_title = format!("instructions a frame, Cortex-{}", core.name());
    let titles = ["a  Formats, strides, logarithms", &x_title, "feature error, root mean square (ln)"];
    let mut axes = Axes::new(drawing, place(0), PANEL, [x, y], titles);
    for (format, points) in &all {
        let line: Vec<_> = points.iter().map(|(point, _)| *point).collect();
        axes.line(&line, of_format(*format).color);
        for point in line {
            axes.point(point, of_format(*format));
        }
    }
    for (point, look, _) in &others {
        axes.point(*point, *look);
    }
    // Markers on top of each other share a number.
    let mut numbered: Vec<Numbered> = Vec::new();
    for (point, stride) in all.iter().flat_map(|(_, points)| points) {
        let is_there = |(other, of): &Numbered| of == stride && axes.is_same_place(*other, *point);
        if !numbered.iter().any(is_there) {
            axes.label(*point, &stride.to_string());
            numbered.push((*point, *stride));
        }
    }
    let mut looks: Vec<(Look, &str)> = all
        .iter()
        .filter(|(_, points)| !points.is_empty())
        .map(|(format, _)| (of_format(*format), format.name()))
        .collect();
    looks.extend(others.iter().map(|(_, look, name)| (*look, *name)));
    axes.legend(&looks, 3, &["Of lit rows and columns, beside float64.", "Numbers: pixel stride."]);
}

/// Accuracy against instructions an event: models that read the whole sample.
fn accuracy(drawing: &mut Drawing, own: &[(&Row, &Candidate)], prices: &Prices, core: Core) {
    let whole = own.iter().filter(|(_, model)| !is_early(model));
    let points: Vec<(f64, &Row, &Candidate)> = whole
        .filter_map(|(row, model)| {
            let price = prices.of(core, &row.setting, row.model.as_deref())?;
            Some((price.texture? as f64, *row, *model))
        })
        .collect();
    let x = Span::of(Scale::Log, points.iter().map(|(event, ..)| *event));
    let Some((x, y)) = x.zip(accuracies(points.iter().map(|(_, row, _)| *row))) else {
        let [left, mut top] = place(1);
        for (_, model) in own {
            let line = format!("{} has no price on boards: ci/prices --keep {0} counts it.", short(&model.name));
            drawing.text([left, top + 20.0], 10.0, Anchor::Start, &line);
            top += 16.0;
        }
        return;
    };
    let x_title = format!("instructions of texture, an event, Cortex-{}", core.name());
    let titles = ["b  Models, all 70 frames", &x_title, "specimens right (%)"];
    let mut axes = Axes::new(drawing, place(1), PANEL, [x, y], titles);
    for (event, row, model) in &points {
        let Some(right) = row.found.accuracy[0] else { continue };
        let look = family(model).1;
        axes.bar(*event, [right.low, right.high], look.color);
        axes.point([*event, right.mean], look);
    }
    for (event, row, model) in &points {
        let Some(right) = row.found.accuracy[0] else { continue };
        axes.label([*event, right.mean], &format!("{}, {} kB", short(&model.name), model.about.bytes.div_ceil(1000)));
    }
    let families = families(points.iter().map(|(.., model)| *model));
    let others = prices.of(core, &Setting::DEFAULT, None).and_then(|price| price.event()).unwrap_or(0);
    let others = format!("Speed and direction add {} to each event.", grouped(others));
    axes.legend(&families, 2, &["Bars: 95 % of 20 sensors. GREY, stride 1; bytes are the model's.", &others]);
}

/// Accuracy against latency: models of a kind that read more and more of a sample.
fn latency(drawing: &mut Drawing, own: &[(&Row, &Candidate)]) {
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
    let x = Span::of(Scale::Linear, all().map(|(latency, ..)| *latency));
    let Some((x, y)) = x.zip(accuracies(all().map(|(_, row, _)| *row))) else { return };
    let titles = ["c  Early answers", "frames from first touch to answer", "specimens right (%)"];
    let mut axes = Axes::new(drawing, place(2), PANEL, [x, y], titles);
    let mean = |row: &Row| row.found.accuracy[0].map_or(0.0, |right| right.mean);
    let mut looks = Vec::new();
    // Beside each other where they would be on top of each other.
    for ((name, points), number) in series.iter().zip(0..) {
        let aside = 0.35 * (f64::from(number) - 0.5 * (series.len() as f64 - 1.0));
        let Some((_, look)) = points.first().map(|(.., model)| family(model)) else { continue };
        let line: Vec<_> = points.iter().map(|(latency, row, _)| [latency + aside, mean(row)]).collect();
        axes.line(&line, look.color);
        for (latency, row, _) in points {
            let Some(right) = row.found.accuracy[0] else { continue };
            axes.bar(latency + aside, [right.low, right.high], look.color);
            axes.point([latency + aside, right.mean], look);
        }
        looks.push((look, *name));
    }
    for ((_, points), number) in series.iter().zip(0..) {
        let aside = 0.35 * (f64::from(number) - 0.5 * (series.len() as f64 - 1.0));
        for (latency, row, model) in points.iter().filter(|(.., model)| !is_early(model)) {
            axes.label([latency + aside, mean(row)], short(&model.name));
        }
    }
    let whole = all().filter(|(.., model)| !is_early(model)).map(|(latency, ..)| *latency).reduce(f64::max);
    let whole = whole
        .map_or_else(String::new, |frames| format!("Speed and direction come with the whole sample, at {frames:.1}."));
    axes.legend(&looks, 3, &["Texture, mean over events; points are moved aside a little.", &whole]);
}

/// Whether a model reads less than the whole sample.
fn is_early(model: &Candidate) -> bool {
    stem(short(&model.name)) != short(&model.name) || model.about.frames < 50
}

/// A name without its frames: `forest-25` of `forest-25-40f`.
fn stem(name: &str) -> &str {
    let frames =
        |end: &str| end.strip_suffix('f').is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()));
    name.rsplit_once('-').filter(|(_, end)| frames(end)).map_or(name, |(stem, _)| stem)
}

fn accuracies<'r>(rows: impl Iterator<Item = &'r Row> + Clone) -> Option<Span> {
    Span::of(Scale::Linear, rows.filter_map(|row| row.found.accuracy[0]).flat_map(|right| [right.low, right.high]))
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
