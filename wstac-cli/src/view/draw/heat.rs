//! Draws the 25 taxels as a map of brightness with percentages of full scale.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use wstac_core::params::{COLUMNS, ROWS};

use super::colors::Colors;
use crate::view::state::State;

/// Columns and rows of the smallest map, which has two taxels in a character, one above the other.
pub(super) const SMALLEST: (u16, u16) = (2 * COLUMNS as u16, ROWS.div_ceil(2) as u16);

/// Draws the smallest map, without numbers, at the top left corner of `area`.
pub(super) fn smallest(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let Some(taxels) = state.taxels else {
        return super::put(
            buffer,
            Rect { width: area.width.min(SMALLEST.0), height: 1, ..area },
            missing(state),
            colors.calm(),
        );
    };
    let shade = |row: usize, column: usize| Some((taxels.get(row * COLUMNS + column)? / state.peak).sqrt());
    for at in (Rect { width: SMALLEST.0, height: SMALLEST.1, ..area }).intersection(area).positions() {
        let (row, column) = (2 * usize::from(at.y - area.y), usize::from(at.x - area.x) / 2);
        let [upper, lower] = [shade(row, column), shade(row + 1, column)];
        let color = |shade: Option<f32>| shade.map_or(Color::Reset, |shade| colors.light(shade));
        let is_lit = |shade: Option<f32>| shade.is_some_and(|shade| shade > 0.5);
        if colors == Colors::None {
            let text = match (is_lit(upper), is_lit(lower)) {
                (true, true) => '█',
                (true, false) => '▀',
                (false, true) => '▄',
                (false, false) => '·',
            };
            buffer[at].set_char(text);
        } else {
            buffer[at].set_char('▀').set_fg(color(upper)).set_bg(color(lower));
        }
    }
}

/// Returns why there are no taxels.
fn missing(state: &State) -> &'static str {
    match state {
        _ if state.is_board => "a board: no taxels",
        _ if state.frame == 0 => "no frame yet",
        _ => "frame lost",
    }
}

/// Columns of a taxel's cell: two characters are about as wide as one is high, and a number needs five.
const fn cell_width(rows: u16) -> u16 {
    if rows < 3 { 5 } else { 2 * rows }
}

/// Returns the rows of a taxel's cell in a map with this many rows.
const fn cell_height(rows: u16) -> u16 {
    let height = rows / ROWS as u16;
    if height == 0 { 1 } else { height }
}

/// Returns the columns that the map takes in this many rows.
pub(super) const fn columns(rows: u16) -> u16 {
    cell_width(cell_height(rows)) * COLUMNS as u16
}

/// Draws the map at the top left corner of `area`.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let height = cell_height(area.height);
    let width = cell_width(height).min(area.width / COLUMNS as u16);
    let Some(taxels) = state.taxels.filter(|_| width > 0) else {
        buffer.set_stringn(area.x, area.y, missing(state), usize::from(area.width), colors.calm());
        return;
    };
    let lines = taxels.as_chunks::<COLUMNS>().0;
    for (line, y) in lines.iter().zip((area.y..area.bottom()).step_by(usize::from(height))) {
        for (light, x) in line.iter().zip((area.x..area.right()).step_by(usize::from(width))) {
            let shade = (light / state.peak).sqrt();
            let cell = Rect { x, y, width, height }.intersection(area);
            let dark = Color::Black;
            let style = match colors {
                Colors::None if shade > 0.5 => Style::new().add_modifier(Modifier::REVERSED),
                Colors::None => Style::new(),
                // A text color that is readable on the cell.
                _ => Style::new().bg(colors.light(shade)).fg(if shade > 0.6 { dark } else { colors.calm() }),
            };
            for at in cell.positions() {
                buffer[at].set_char(' ').set_style(style);
            }
            let percent = 100.0 * light;
            let number = if percent < 9.95 { format!("{percent:.1}") } else { format!("{percent:.0}") };
            let length = number.len() as u16;
            if length < width {
                buffer.set_stringn(x + (width - length) / 2, y + (height - 1) / 2, &number, usize::from(width), style);
            }
        }
    }
}
