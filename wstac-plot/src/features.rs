//! Panels a and b: five features over the sample's frames, thresholds, and the time at which each row or column is lit.

use wstac_core::paper::speed::ThresholdOn;
use wstac_core::params::{ROWS, SAMPLE_FRAMES};
use wstac_host::output::FEATURE_NAMES;

use super::event::Found;
use crate::axes::{Axes, Side, Span, extent, spread};
use crate::style::{GRAY, ORDERED, PALE, SIZE, THICK, THIN};
use crate::svg::{Anchor, Drawing};

/// Height of the strip above the lines that holds their names.
const STRIP: f64 = 21.0;
/// Smallest distance between two names.
const APART: f64 = 12.0;

/// Returns the range of all ten features and thresholds, so that both panels have the same scale.
pub(super) fn range(found: &Found) -> [f64; 2] {
    let lit = libm::log(found.lit_threshold.0);
    let [low, high] = extent(found.features.iter().flatten().chain(&found.thresholds).copied().chain([lit]));
    let room = 0.06 * (high - low).max(1.0);
    [low - room, high + room]
}

/// Draws the rows (from feature 0) or the columns (from feature 5), and returns the panel for further drawing.
pub(super) fn draw(
    drawing: &mut Drawing,
    found: &Found,
    [left, top]: [f64; 2],
    [width, height]: [f64; 2],
    first: usize,
) -> Axes {
    let [low, high] = range(found);
    // The strip is part of the scale.
    let above = (high - low) * STRIP / (height - STRIP);
    let last = (SAMPLE_FRAMES - 1) as f64;
    let spans = [[-0.5, last + 0.5], [low, high + above]].map(Span::linear);
    let panel = Axes::new([left, top], [width, height], spans[0], spans[1]);
    let [from, frames] = found.window.map(f64::from);
    let (window_left, window_right) = (panel.across(from - 0.5), panel.across(from + frames - 0.5));
    drawing.rectangle([window_left, top], [window_right - window_left, height], PALE);
    if let Some(lit) = found.lit {
        for frame in [lit.first, lit.last] {
            let x = panel.across(f64::from(frame));
            drawing.dashed(&[[x, top], [x, panel.bottom()]], GRAY, THIN, [1.0, 1.6]);
        }
    }
    thresholds(drawing, found, &panel, first);
    let own = first..first + ROWS;
    for (feature, color) in own.clone().zip(ORDERED) {
        let line: Vec<[f64; 2]> = (0_u8..)
            .zip(&found.features[feature])
            .map(|(frame, value)| [panel.across(f64::from(frame)), panel.up(*value)])
            .collect();
        drawing.line(&line, color, THICK);
    }
    names(drawing, found, &panel, first);
    panel.frame(drawing);
    panel.ticks(drawing, Side::Left, &panel.y);
    panel.y_title(drawing, "ln of light, fraction of full scale");
    panel
}

/// Draws the trigger's and the speed's thresholds, named on the right.
fn thresholds(drawing: &mut Drawing, found: &Found, panel: &Axes, first: usize) {
    let own = first..first + ROWS;
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / ROWS as f64;
    let (threshold, on) = found.lit_threshold;
    let lit_at = |feature: usize| match on {
        ThresholdOn::Absolute => libm::log(threshold),
        ThresholdOn::AboveBaseline => libm::log(threshold + libm::exp(found.baseline[feature])),
    };
    for (feature, color) in own.clone().zip(ORDERED) {
        let across = |y: f64| [[panel.left, y], [panel.right(), y]];
        drawing.dashed(&across(panel.up(found.thresholds[feature])), color, THIN, [3.0, 2.0]);
        match on {
            // All have the same line.
            ThresholdOn::Absolute if feature > first => {}
            ThresholdOn::Absolute => drawing.line(&across(panel.up(lit_at(feature))), GRAY, THIN),
            ThresholdOn::AboveBaseline => drawing.line(&across(panel.up(lit_at(feature))), color, THIN / 2.0),
        }
    }
    let trigger = panel.up(mean(&mut own.clone().map(|feature| found.thresholds[feature])));
    let lit = panel.up(mean(&mut own.map(lit_at)));
    let wanted = [trigger, lit];
    let places = spread(&wanted, 1.1 * SIZE, [panel.top + SIZE, panel.bottom()]);
    for ((name, wanted), place) in ["trigger", "lit"].into_iter().zip(wanted).zip(places) {
        drawing.line(&[[panel.right(), wanted], [panel.right() + 5.0, place]], GRAY, THIN);
        drawing.text([panel.right() + 7.0, place + 0.35 * SIZE], SIZE, Anchor::Start, name);
    }
}

/// Draws the names of rows or columns above their lines, at the centroids of their light.
fn names(drawing: &mut Drawing, found: &Found, panel: &Axes, first: usize) {
    let own = (first..first + ROWS).zip(0_u8..);
    let centroids: Vec<(u8, f64)> = own.filter_map(|(feature, line)| Some((line, centroid(found, feature)?))).collect();
    let wanted: Vec<f64> = centroids.iter().map(|(_, centroid)| panel.across(*centroid)).collect();
    let [earliest, last] = extent(wanted.iter().copied());
    // If all are at the same time, noise would decide their order.
    let in_order = (0_u8..).map(|line| earliest + 1e-3 * f64::from(line));
    let wishes = if last - earliest < 2.0 { in_order.take(wanted.len()).collect() } else { wanted.clone() };
    let places = spread(&wishes, APART, [panel.left + 6.0, panel.right() - 6.0]);
    let (strip, words) = (panel.top + STRIP, panel.top + SIZE + 1.0);
    for (((line, _), x), place) in centroids.iter().zip(&wanted).zip(places) {
        let color = ORDERED[usize::from(*line)];
        drawing.line(&[[place, words + 2.0], [*x, strip - 5.0]], color, THIN);
        drawing.polygon(&[[x - 2.4, strip - 5.0], [x + 2.4, strip - 5.0], [*x, strip]], color);
        drawing.text([place, words], SIZE, Anchor::Middle, FEATURE_NAMES[first + usize::from(*line)]);
    }
}

/// Returns the time at which a row or column is lit, in frames of the sample.
///
/// It is the centroid of its light above its baseline, as for the direction.
pub(super) fn centroid(found: &Found, feature: usize) -> Option<f64> {
    let base = libm::exp(found.baseline[feature]);
    let (mut light, mut moment) = (0.0, 0.0);
    for (frame, value) in (0_u8..).zip(&found.features[feature]) {
        let above = (libm::exp(*value) - base).max(0.0);
        light += above;
        moment += f64::from(frame) * above;
    }
    (light > 0.0).then(|| moment / light)
}
