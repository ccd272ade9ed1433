//! Draws the camera's picture with the outlines of its taxels, two pixels per character.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use wstac_core::layout::Layout;

use super::colors::Colors;
use crate::view::state::State;

/// Smallest side of a taxel, in pixels, that gets an outline: in a smaller one the outline would hide the light.
const LEAST_SIDE: usize = 2;

/// Returns the columns that the picture of a camera takes in this many rows.
pub(super) fn columns(state: &State, rows: u16) -> u16 {
    let (width, height) = (u32::from(state.size.width()), u32::from(state.size.height()));
    (u32::from(rows) * 2 * width).div_ceil(height).min(u32::from(u16::MAX)) as u16
}

/// Draws the picture as large as fits into `area`, at its top left corner.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let rows = (u32::from(area.width) * u32::from(state.size.height()))
        .div_ceil(2 * u32::from(state.size.width()))
        .clamp(1, u32::from(area.height.max(1))) as u16;
    let columns = columns(state, rows).clamp(1, area.width.max(1));
    let Some(picture) = state.picture.as_ref().filter(|_| !area.is_empty()) else {
        let text = match state.frame {
            _ if state.is_board => "a board: no picture",
            0 => "no frame yet",
            _ => "taxel sums only, no picture",
        };
        buffer.set_stringn(area.x, area.y, text, usize::from(area.width), colors.calm());
        return;
    };
    let [width, height] = [usize::from(columns), 2 * usize::from(rows)];
    let light = picture.scaled([width, height]);
    let outlined = outlines(&state.layout, [width, height]);
    let dark = light.iter().copied().fold(state.peak, f32::min);
    // Brightness follows the eye: half the light looks nearly as bright.
    let shade = |at: usize| ((light[at] - dark) / (state.peak - dark).max(f32::EPSILON)).sqrt();
    for y in 0..rows {
        for x in 0..columns {
            let upper = 2 * usize::from(y) * width + usize::from(x);
            let [upper, lower] = [upper, upper + width];
            let cell = &mut buffer[(area.x + x, area.y + y)];
            if colors == Colors::None {
                let mean = f32::midpoint(shade(upper), shade(lower));
                let character = Colors::character(mean);
                let is_outline = character == ' ' && (outlined[upper] || outlined[lower]);
                cell.set_char(if is_outline { '·' } else { character });
                continue;
            }
            let color = |at: usize| if outlined[at] { colors.outline() } else { colors.light(shade(at)) };
            cell.set_char('▀').set_fg(color(upper)).set_bg(color(lower));
        }
    }
}

/// Returns which pixels of a picture of this size lie around a taxel, just outside it, and in no taxel.
fn outlines(layout: &Layout, [width, height]: [usize; 2]) -> Vec<bool> {
    let mut outlined = vec![false; width * height];
    // The pixels from the first to the last along a side.
    let span = |corner: u16, side: u16, frame: u16, pixels: usize| {
        let place = |at: u16| (usize::from(at) * pixels + usize::from(frame) / 2) / usize::from(frame);
        place(corner)..place(corner + side).min(pixels)
    };
    let ([taxel_width, taxel_height], frame) = (layout.taxel(), layout.frame());
    let taxels = layout
        .corners()
        .iter()
        .map(|[x, y]| (span(*x, taxel_width, frame.width(), width), span(*y, taxel_height, frame.height(), height)));
    for (columns, rows) in taxels.clone().filter(|(x, y)| x.len() >= LEAST_SIDE && y.len() >= LEAST_SIDE) {
        for y in rows.start.saturating_sub(1)..(rows.end + 1).min(height) {
            let around = columns.start.saturating_sub(1)..(columns.end + 1).min(width);
            outlined[y * width..][around].fill(true);
        }
    }
    for (columns, rows) in taxels {
        rows.for_each(|y| outlined[y * width..][columns.clone()].fill(false));
    }
    outlined
}
