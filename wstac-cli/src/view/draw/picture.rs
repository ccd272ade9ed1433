//! Draws the camera's picture, two pixels per character.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::colors::{CALM, Colors};
use crate::view::state::State;

pub(super) fn columns(state: &State, rows: u16) -> u16 {
    let [width, height] =
        state.layout.map_or([4, 3], |layout| [layout.frame().width(), layout.frame().height()].map(u32::from));
    (u32::from(rows) * 2 * width).div_ceil(height).min(u32::from(u16::MAX)) as u16
}

/// Draws the picture as large as fits into `area`, at its top left corner.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let Some(picture) = state.picture.as_ref().filter(|_| !area.is_empty()) else {
        return super::put(buffer, area, state.missing, colors.one(CALM));
    };
    let rows = (1..=area.height).rev().find(|rows| columns(state, *rows) <= area.width).unwrap_or(1);
    let columns = columns(state, rows).clamp(1, area.width);
    let [width, height] = [usize::from(columns), 2 * usize::from(rows)];
    let light = picture.scaled([width, height]);
    let dark = light.iter().copied().fold(state.peak, f32::min);
    // Brightness follows the eye: half the light looks nearly as bright.
    let shade = |at: usize| ((light[at] - dark) / (state.peak - dark).max(f32::EPSILON)).sqrt();
    for at in (Rect { width: columns, height: rows, ..area }).positions() {
        let upper = 2 * usize::from(at.y - area.y) * width + usize::from(at.x - area.x);
        let [upper, lower] = [shade(upper), shade(upper + width)];
        let cell = &mut buffer[at];
        if colors == Colors(false) {
            cell.set_char(Colors::character(f32::midpoint(upper, lower)));
        } else {
            cell.set_char('▀').set_fg(colors.light(upper)).set_bg(colors.light(lower));
        }
    }
}
