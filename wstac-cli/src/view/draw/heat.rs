//! Draws the 25 taxels as a map of brightness with percentages of full scale.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use wstac_core::params::{COLUMNS, ROWS};

use super::colors::{CALM, Colors};
use crate::view::state::State;

/// Returns the columns and rows of a taxel's cell in a map with this many rows: two characters are about as wide as one
/// is high, and a number needs five.
fn cell(rows: u16) -> [u16; 2] {
    let height = (rows / ROWS as u16).max(1);
    [(2 * height).max(5), height]
}

pub(super) fn columns(rows: u16) -> u16 {
    cell(rows)[0] * COLUMNS as u16
}

/// Draws the map at the top left corner of `area`.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let Some(taxels) = state.taxels else { return super::put(buffer, area, state.missing, colors.one(CALM)) };
    let [width, height] = cell(area.height.min(area.width / 2));
    for (light, at) in taxels.iter().zip(0_u16..) {
        let (x, y) = (area.x + at % COLUMNS as u16 * width, area.y + at / COLUMNS as u16 * height);
        let shade = (light / state.peak).sqrt();
        let style = match colors {
            Colors(false) if shade > 0.5 => Style::new().add_modifier(Modifier::REVERSED),
            Colors(false) => Style::new(),
            // A text color that is readable on the cell.
            _ => Style::new().bg(colors.light(shade)).fg(if shade > 0.6 { Color::Black } else { colors.one(CALM) }),
        };
        let cell = Rect { x, y, width, height }.intersection(area);
        buffer.set_style(cell, style);
        let percent = 100.0 * light;
        let number = if percent < 9.95 { format!("{percent:.1}") } else { format!("{percent:.0}") };
        let [left, down] = [(width - number.len() as u16) / 2, (height - 1) / 2];
        let place = Rect { x: x + left, y: y + down, width: width - left, height: 1 }.intersection(area);
        super::put(buffer, place, &number, style);
    }
}
