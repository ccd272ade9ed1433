//! Draws the line that explains the keys.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::{View, columns_of, put};
use crate::view::state::State;

/// Draws the longest text that fits.
pub(super) fn draw(view: &View<'_>, row: Rect, buffer: &mut Buffer) {
    let texts = match view.states {
        [only] => of_one(only),
        _ => of_several(view),
    };
    let fits = |text: &&String| columns_of(text) <= usize::from(row.width);
    let text = texts.iter().find(fits).or(texts.last());
    put(buffer, row, text.map_or("", String::as_str), Style::new().fg(view.colors.faint()));
}

fn pause(state: &State) -> &'static str {
    if state.paused { "space resume" } else { "space pause" }
}

fn of_one(state: &State) -> Vec<String> {
    let pause = pause(state);
    if state.is_board {
        return vec![format!("q quit  {pause}  ? help"), "q quit ? help".to_owned()];
    }
    let record = if state.rec.is_some() { "r end recording" } else { "r record" };
    let seek = if state.live { "" } else { "  ←→ seek  ,. step" };
    let full = |seek| format!("q quit  z re-zero  {record}  {pause}{seek}  ? help");
    vec![full(seek), full(""), "q quit z zero ? help".to_owned()]
}

/// Of several sensors, the number of one or Tab shows it alone.
fn of_several(view: &View<'_>) -> Vec<String> {
    let alone = if view.chosen == 0 { "Tab one" } else { "Tab next" };
    let pause = pause(view.states[0]);
    let seek = if view.states.iter().all(|state| state.live) { "" } else { "  ←→ seek  ,. step" };
    vec![
        format!("q quit  {alone}  z re-zero  {pause}{seek}  ? help"),
        format!("q quit  {alone}  {pause}{seek}  ? help"),
        format!("q quit  {alone}  {pause}  ? help"),
        format!("q quit  {alone}  ? help"),
        "q Tab ?".to_owned(),
    ]
}
