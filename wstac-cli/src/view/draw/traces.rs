//! Draws the ten features over the last seconds, each with its threshold, one dot per frame.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use wstac_core::params::{FEATURES, ROWS};

use super::colors::Colors;
use crate::view::state::State;
use wstac_host::output::FEATURE_NAMES;

/// Dots of a Braille character: two columns of four, each with the bit that sets it.
const DOTS: [[u32; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
/// The Braille character without dots.
const BLANK: u32 = 0x2800;
/// Columns to the left of a trace, and to its right.
const LABEL: u16 = 3;
const VALUE: u16 = 7;
/// Smallest height of the common scale, in units of a natural logarithm.
const LEAST_SPAN: f32 = 1.5;

/// The range of the scale that all traces share.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    low: f32,
    high: f32,
}

impl Range {
    /// Returns the scale of everything that is shown in `count` frames.
    fn of(state: &State, count: usize) -> Self {
        let shown = state.traces.iter().rev().take(count).flatten().flatten();
        let thresholds = state.thresholds.iter().flatten();
        let bounds = shown.chain(thresholds).fold(None, |bounds: Option<(f32, f32)>, value| {
            let (low, high) = bounds.unwrap_or((*value, *value));
            Some((low.min(*value), high.max(*value)))
        });
        let (low, high) = bounds.unwrap_or((0.0, 0.0));
        Self { low, high: high.max(low + LEAST_SPAN) }
    }

    /// Returns the dot row of a value, counted from the top of `dots` rows.
    fn dot(self, value: f32, dots: u16) -> u16 {
        let share = ((self.high - value) / (self.high - self.low)).clamp(0.0, 1.0);
        (share * f32::from(dots.saturating_sub(1))).round() as u16
    }
}

/// Draws the rows on the left and the columns on the right, below a title, as high as five of them fit.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let half = area.width / 2;
    let height = area.height.saturating_sub(1) / ROWS as u16;
    if height == 0 || half <= LABEL + 1 {
        return;
    }
    // Narrow traces have no room for the value.
    let value = if half > LABEL + VALUE + 6 { VALUE } else { 1 };
    let width = half - LABEL - value;
    let range = Range::of(state, 2 * usize::from(width));
    for feature in 0..FEATURES {
        let (column, line) = (feature / ROWS, feature % ROWS);
        let x = area.x + column as u16 * half;
        let y = area.y + 1 + line as u16 * height;
        let place = Rect { x: x + LABEL, y, width, height };
        let middle = y + (height - 1) / 2;
        let name = FEATURE_NAMES[feature];
        buffer.set_stringn(x, middle, name, 2, colors.faint());
        let above = trace(state, feature, range, colors, place, buffer);
        if value == VALUE {
            let newest = state.traces.back().copied().flatten().map(|features| features[feature]);
            let text = newest.map_or("    –".to_owned(), |newest| format!("{newest:5.2}"));
            let color = if above { colors.lit() } else { colors.calm() };
            buffer.set_stringn(x + LABEL + width + 1, middle, &text, usize::from(VALUE), color);
        }
    }
    let Range { low, high } = range;
    let title = if half >= 34 {
        format!("rows, ln of light: {low:.1} to {high:.1}")
    } else {
        format!("rows {low:.1}…{high:.1}")
    };
    super::put(buffer, Rect { width: half - 1, height: 1, ..area }, &title, colors.faint());
    let seconds = if half >= 34 { "columns; - - threshold" } else { "columns" };
    buffer.set_stringn(area.x + half, area.y, seconds, usize::from(half), colors.faint());
}

/// Draws a trace and its threshold, and returns whether the newest frame is above the threshold.
fn trace(state: &State, feature: usize, range: Range, colors: Colors, place: Rect, buffer: &mut Buffer) -> bool {
    let threshold = state.thresholds.map(|thresholds| thresholds[feature]);
    let (columns, dots) = (2 * usize::from(place.width), 4 * place.height);
    let is_above = |value: f32| threshold.is_some_and(|threshold| value > threshold);
    // The bits of the dots, whether any belongs to the trace, and whether it is above the threshold there.
    let mut cells = vec![(0_u32, false, false); usize::from(place.width) * usize::from(place.height)];
    let mut set = |column: usize, dot: u16, of_trace: Option<bool>| {
        let (x, y) = (column / 2, usize::from(dot / 4));
        let cell = &mut cells[y * usize::from(place.width) + x];
        cell.0 |= DOTS[column % 2][usize::from(dot % 4)];
        if let Some(above) = of_trace {
            cell.1 = true;
            cell.2 |= above;
        }
    };
    if let Some(threshold) = threshold {
        let dot = range.dot(threshold, dots);
        (0..columns).filter(|column| column % 4 < 2).for_each(|column| set(column, dot, None));
    }
    let shown = state.traces.iter().rev().take(columns);
    let mut right: Option<u16> = None;
    for (value, column) in shown.zip((0..columns).rev()) {
        let Some(value) = value.map(|features| features[feature]) else {
            right = None;
            continue;
        };
        let dot = range.dot(value, dots);
        // Connects the dot with its neighbor, so that the line has no gaps.
        let (from, to) = match right {
            Some(right) if right > dot + 1 => (dot, right - 1),
            Some(right) if right + 1 < dot => (right + 1, dot),
            _ => (dot, dot),
        };
        (from..=to).for_each(|dot| set(column, dot, Some(is_above(value))));
        right = Some(dot);
    }
    for (at, (bits, of_trace, above)) in (0_u16..).zip(&cells) {
        let cell = &mut buffer[(place.x + at % place.width, place.y + at / place.width)];
        let color = match (of_trace, above) {
            (true, true) => colors.lit(),
            (true, false) => colors.calm(),
            (false, _) => colors.warning(),
        };
        let dots = char::from_u32(BLANK + bits).filter(|_| *bits > 0);
        cell.set_char(dots.unwrap_or(' ')).set_fg(color);
    }
    state.traces.back().copied().flatten().is_some_and(|features| is_above(features[feature]))
}
