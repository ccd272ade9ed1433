//! Draws the state of a sensor on a terminal, one file per panel.

mod colors;
mod facts;
mod heat;
mod picture;
mod traces;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Widget, Wrap};

pub(super) use self::colors::Colors;
use self::colors::{CALM, FAINT};
use super::state::State;

/// The smallest size that has room for all panels.
const ROOMY: (u16, u16) = (60, 20);
/// The smallest number of rows for traces: a title, and one row for each.
const TRACES: u16 = 6;
/// The number of columns that the facts need beside the map.
const FACTS: u16 = 17;

/// Draws the whole screen: a title, the panels, and the keys.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    if area.is_empty() {
        return;
    }
    let [title, body, keys] = bands(area, [Constraint::Length(1), Constraint::Fill(1), Constraint::Length(1)]);
    put(buffer, title, &format!("wstac view  {}", state.about), colors.one(FAINT));
    let pause = if state.paused { "resume" } else { "pause" };
    put(buffer, keys, &format!("q quit  z re-zero  space {pause}"), colors.one(FAINT));
    if area.width < ROOMY.0 || area.height < ROOMY.1 {
        return narrow(state, colors, body, buffer);
    }
    let traces_height = 1 + 5 * ((body.height - 4) / 12).clamp(1, 4);
    let events_height = (body.height / 6).max(3);
    let [top, traces, events] =
        bands(body, [Constraint::Fill(1), Constraint::Length(traces_height), Constraint::Length(events_height)]);
    let map_width = heat::columns((top.height - 1).min(top.width / 4));
    let most = top.width.saturating_sub(map_width + FACTS + 4);
    let picture_width = picture::columns(state, top.height - 1).min(most);
    let columns = [Constraint::Length(picture_width), Constraint::Length(map_width), Constraint::Fill(1)];
    let [picture, map, facts] = Layout::horizontal(columns).spacing(2).areas(top);
    let white = format!("picture, white: {:.0} %", 100.0 * state.peak);
    picture::draw(state, colors, titled(picture, &white, colors, buffer), buffer);
    heat::draw(state, colors, titled(map, "taxels, % of full scale", colors, buffer), buffer);
    facts::draw(state, colors, facts, buffer);
    traces::draw(state, colors, traces, buffer);
    list(state, colors, events, buffer);
}

/// Draws the facts in one line, then traces if there is room, and events.
fn narrow(state: &State, colors: Colors, body: Rect, buffer: &mut Buffer) {
    let height = if body.height > TRACES { (1 + 5 * ((body.height - 2) / 6)).max(TRACES) } else { 0 };
    let [line, traces, events] = bands(body, [Constraint::Length(1), Constraint::Length(height), Constraint::Fill(1)]);
    facts::line(state, colors, line, buffer);
    traces::draw(state, colors, traces, buffer);
    list(state, colors, events, buffer);
}

fn bands(area: Rect, heights: [Constraint; 3]) -> [Rect; 3] {
    Layout::vertical(heights).areas(area)
}

/// Draws the title of a panel, and returns the area below it.
fn titled(area: Rect, title: &str, colors: Colors, buffer: &mut Buffer) -> Rect {
    put(buffer, area, title, colors.one(FAINT));
    Rect { y: area.y + 1, height: area.height - 1, ..area }
}

/// Writes a text in the first row of an area. One that is too long ends in an ellipsis.
fn put(buffer: &mut Buffer, area: Rect, text: &str, style: impl Into<Style>) {
    let (width, style) = (usize::from(area.width), style.into());
    if area.is_empty() || Span::raw(text).width() <= width {
        buffer.set_stringn(area.x, area.y, text, if area.is_empty() { 0 } else { width }, style);
        return;
    }
    let (x, _) = buffer.set_stringn(area.x, area.y, text, width - 1, style);
    buffer.set_stringn(x, area.y, "…", 1, style);
}

/// Draws the last events, the newest first.
fn list(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    if state.entries.is_empty() {
        put(buffer, area, "no event yet", colors.one(CALM));
    }
    let entries = state.entries.iter().take(usize::from(area.height));
    let lines: Vec<_> = entries.map(|(about, text)| Line::styled(text.as_str(), colors.about(*about))).collect();
    Paragraph::new(lines).wrap(Wrap { trim: false }).render(area, buffer);
}

#[cfg(test)]
mod tests;
