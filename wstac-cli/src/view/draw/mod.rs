//! Draws the state on a terminal, one file per panel.

mod colors;
mod facts;
mod heat;
mod help;
mod picture;
mod traces;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Span;

pub(super) use self::colors::Colors;
use super::state::{About, Rec, State};

/// The smallest size that has room for all panels.
const ROOMY: (u16, u16) = (60, 20);
/// The smallest number of rows for traces: a title, and one row for each.
const TRACES: u16 = 6;
/// The number of columns that the facts need beside the map.
const FACTS: u16 = 17;

/// Draws the whole screen.
pub(super) fn draw(state: &State, colors: Colors, with_help: bool, area: Rect, buffer: &mut Buffer) {
    if area.is_empty() {
        return;
    }
    let about = format!("wstac view  {}", state.about);
    let (title, color) = match &state.rec {
        Some(rec) => {
            let Rec { name, frames, waiting } = rec;
            (format!("● REC {name}, {frames} frames, {waiting} behind"), colors.warning())
        }
        None => (about, colors.faint()),
    };
    put(buffer, Rect { height: 1, ..area }, &title, color);
    let mut body = Rect { y: area.y + 1, height: area.height - 1, ..area };
    if body.height >= 2 {
        body.height -= 1;
        keys(state, colors, Rect { y: body.bottom(), height: 1, ..area }, buffer);
    }
    if with_help {
        help::draw(colors, body, buffer);
    } else if area.width >= ROOMY.0 && area.height >= ROOMY.1 {
        roomy(state, colors, body, buffer);
    } else {
        narrow(state, colors, body, buffer);
    }
}

/// Draws picture, map and facts on top, then traces, then events.
fn roomy(state: &State, colors: Colors, body: Rect, buffer: &mut Buffer) {
    let traces_height = 1 + 5 * ((body.height - 4) / 12).clamp(1, 4);
    let events_height = (body.height / 6).max(3);
    let bands = [Constraint::Fill(1), Constraint::Length(traces_height), Constraint::Length(events_height)];
    let [top, traces, events] = Layout::vertical(bands).areas(body);
    let inner = top.height - 1;
    let map_width = heat::columns(inner);
    let most = top.width.saturating_sub(map_width + FACTS + 4);
    let picture_width = picture::columns(state, inner).min(most);
    let columns = [Constraint::Length(picture_width), Constraint::Length(map_width), Constraint::Fill(1)];
    let [picture, map, facts] = Layout::horizontal(columns).spacing(2).areas(top);
    let titled = |area: Rect, title: &str, buffer: &mut Buffer| {
        buffer.set_stringn(area.x, area.y, title, usize::from(area.width), colors.faint());
        Rect { y: area.y + 1, height: area.height - 1, ..area }
    };
    let inside = titled(picture, &format!("picture, white: {:.0} %", 100.0 * state.peak), buffer);
    picture::draw(state, colors, inside, buffer);
    let inside = titled(map, "taxels, % of full scale", buffer);
    heat::draw(state, colors, inside, buffer);
    facts::draw(state, colors, facts, buffer);
    traces::draw(state, colors, traces, buffer);
    list(state, colors, events, buffer);
}

/// Draws the facts in one line, then the traces or as many events as fit.
fn narrow(state: &State, colors: Colors, body: Rect, buffer: &mut Buffer) {
    let Some(left) = body.height.checked_sub(1) else { return };
    facts::line(state, colors, Rect { height: 1, ..body }, buffer);
    let rest = Rect { y: body.y + 1, height: left, ..body };
    if rest.height < TRACES {
        return list(state, colors, rest, buffer);
    }
    let height = (1 + 5 * ((rest.height - 1) / 6)).max(TRACES);
    let [traces, events] = Layout::vertical([Constraint::Length(height), Constraint::Fill(1)]).areas(rest);
    traces::draw(state, colors, traces, buffer);
    list(state, colors, events, buffer);
}

/// Returns the columns that a text takes on a terminal.
fn columns_of(text: &str) -> usize {
    Span::raw(text).width()
}

/// Writes a text in a row. One that is too long ends in an ellipsis.
fn put(buffer: &mut Buffer, row: Rect, text: &str, style: impl Into<Style>) {
    let width = usize::from(row.width);
    if columns_of(text) <= width {
        buffer.set_stringn(row.x, row.y, text, width, style);
        return;
    }
    let style = style.into();
    if let Some(room) = width.checked_sub(1) {
        let (x, _) = buffer.set_stringn(row.x, row.y, text, room, style);
        buffer.set_stringn(x, row.y, "…", 1, style);
    }
}

/// Draws the last events, the newest first.
fn list(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let mut rows = area.rows();
    // Draws the heads of the columns if there is room.
    if area.height >= 3
        && area.width >= ROOMY.0
        && let Some(row) = rows.next()
    {
        let title = "  frame  speed      direction     duration";
        buffer.set_stringn(row.x, row.y, title, usize::from(row.width), colors.faint());
    }
    if state.entries.is_empty()
        && let Some(row) = rows.next()
    {
        buffer.set_stringn(row.x, row.y, "no event yet", usize::from(row.width), colors.calm());
    }
    for (entry, row) in state.entries.iter().zip(rows) {
        let color = match entry.about {
            About::Event => colors.lit(),
            About::Trouble => colors.warning(),
            About::Note => colors.calm(),
        };
        put(buffer, row, &entry.text, color);
    }
}

/// Draws the line that explains the keys.
fn keys(state: &State, colors: Colors, row: Rect, buffer: &mut Buffer) {
    let pause = if state.paused { "space resume" } else { "space pause" };
    let record = if state.rec.is_some() { "r end recording" } else { "r record" };
    let texts = if state.is_board {
        [format!("q quit  {pause}  ? help"), String::new(), "q quit ? help".to_owned()]
    } else {
        let seek = if state.live { "" } else { "  ←→ seek  ,. step" };
        let [full, short] = [seek, ""].map(|seek| format!("q quit  z re-zero  {record}  {pause}{seek}  ? help"));
        [full, short, "q quit z zero ? help".to_owned()]
    };
    // The longest that fits.
    let fits = |text: &&String| !text.is_empty() && columns_of(text) <= usize::from(row.width);
    let text = texts.iter().find(fits).unwrap_or(&texts[2]);
    put(buffer, row, text, Style::new().fg(colors.faint()));
}

#[cfg(test)]
mod tests;
