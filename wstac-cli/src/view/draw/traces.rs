//! Draws the ten features over the last seconds, each with its threshold, one dot per frame.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;
use wstac_core::params::{FEATURES, ROWS};

use super::colors::{CALM, Colors, FAINT, LIT, WARNING};
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
        let shown = state.traces.iter().take(count).flatten().flatten();
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
        buffer.set_stringn(x, middle, name, 2, colors.one(FAINT));
        let above = trace(state, feature, range, colors, place, buffer);
        if value == VALUE {
            let newest = state.traces.front().copied().flatten().map(|features| features[feature]);
            let text = newest.map_or("    –".to_owned(), |newest| format!("{newest:5.2}"));
            let color = if above { colors.one(LIT) } else { colors.one(CALM) };
            buffer.set_stringn(x + LABEL + width + 1, middle, &text, usize::from(VALUE), color);
        }
    }
    let Range { low, high } = range;
    let (rows, columns) = (Rect { width: half - 1, height: 1, ..area }, Rect { x: area.x + half, width: half, ..area });
    super::put(buffer, rows, &format!("rows, ln of light: {low:.1} to {high:.1}"), colors.one(FAINT));
    super::put(buffer, columns, "columns; - - threshold", colors.one(FAINT));
}

/// Draws a trace and its threshold, and returns whether the newest frame is above the threshold.
fn trace(state: &State, feature: usize, range: Range, colors: Colors, place: Rect, buffer: &mut Buffer) -> bool {
    let threshold = state.thresholds.map(|thresholds| thresholds[feature]);
    let (columns, dots) = (2 * place.width, 4 * place.height);
    let is_above = |value: f32| threshold.is_some_and(|threshold| value > threshold);
    let mut set = |column: u16, dot: u16, color: Color| {
        let cell = &mut buffer[(place.x + column / 2, place.y + dot / 4)];
        let before = cell.symbol().chars().next().map_or(0, u32::from).saturating_sub(BLANK);
        let bits = before | DOTS[usize::from(column % 2)][usize::from(dot % 4)];
        cell.set_char(char::from_u32(BLANK + bits).unwrap_or(' ')).set_fg(color);
    };
    if let Some(threshold) = threshold {
        let dot = range.dot(threshold, dots);
        (0..columns).filter(|column| column % 4 < 2).for_each(|column| set(column, dot, colors.one(WARNING)));
    }
    let mut right: Option<u16> = None;
    for (features, column) in state.traces.iter().zip((0..columns).rev()) {
        let value = features.map(|features| features[feature]);
        let dot = value.map(|value| range.dot(value, dots));
        if let (Some(value), Some(dot)) = (value, dot) {
            // Connects the dot with its neighbor, so that the line has no gaps.
            let (from, to) = match right {
                Some(right) if right > dot + 1 => (dot, right - 1),
                Some(right) if right + 1 < dot => (right + 1, dot),
                _ => (dot, dot),
            };
            let color = if is_above(value) { colors.one(LIT) } else { colors.one(CALM) };
            (from..=to).for_each(|dot| set(column, dot, color));
        }
        right = dot;
    }
    state.traces.front().copied().flatten().is_some_and(|features| is_above(features[feature]))
}
