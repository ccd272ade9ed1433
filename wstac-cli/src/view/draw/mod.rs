//! Draws the states of sensors on a terminal, one file per panel.

mod colors;
mod facts;
mod heat;
mod help;
mod keys;
mod picture;
mod tiles;
mod traces;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Span;

pub(super) use self::colors::Colors;
use super::state::{About, Rec, State, time_of_day};

/// The smallest size that has room for all panels.
const ROOMY: (u16, u16) = (60, 20);
/// The smallest number of rows for traces: a title, and one row for each.
const TRACES: u16 = 6;
/// The number of columns that the facts need beside the map.
const FACTS: u16 = 17;

/// What the screen shows.
pub(super) struct View<'a> {
    /// One sensor, or several.
    pub(super) states: &'a [&'a State],
    /// The number of the sensor that is shown alone, from 1 on; 0 for all of several.
    pub(super) chosen: usize,
    pub(super) with_help: bool,
    pub(super) colors: Colors,
}

impl View<'_> {
    /// Returns the state of the sensor that is shown alone.
    fn alone(&self) -> Option<&State> {
        match self.states {
            [only] => Some(only),
            several => several.get(self.chosen.checked_sub(1)?).copied(),
        }
    }
}

/// Draws the whole screen.
pub(super) fn draw(view: &View<'_>, area: Rect, buffer: &mut Buffer) {
    let View { states, chosen, with_help, colors } = *view;
    if area.is_empty() {
        return;
    }
    let alone = view.alone();
    let mut body = Rect { y: area.y + 1, height: area.height - 1, ..area };
    if body.height >= 2 {
        body.height -= 1;
        keys::draw(view, Rect { y: body.bottom(), height: 1, ..area }, buffer);
    }
    let places = if alone.is_none() { tiles::places(states.len(), body) } else { Vec::new() };
    let (title, color) = match alone {
        Some(State { rec: Some(Rec { name, frames, waiting }), .. }) => {
            (format!("● REC {name}, {frames} frames, {waiting} behind"), colors.warning())
        }
        Some(State { name: Some(name), about, .. }) if states.len() > 1 => {
            (format!("wstac view  {name} ({chosen} of {})  {about}", states.len()), colors.faint())
        }
        Some(State { about, .. }) => (format!("wstac view  {about}"), colors.faint()),
        None => match states.len() - places.len() {
            0 => (format!("wstac view  {} sensors", states.len()), colors.faint()),
            hidden => (format!("wstac view  {} sensors, {hidden} not shown", states.len()), colors.warning()),
        },
    };
    put(buffer, Rect { height: 1, ..area }, &title, color);
    if with_help {
        return help::draw(colors, body, buffer);
    }
    match alone {
        Some(state) if area.width >= ROOMY.0 && area.height >= ROOMY.1 => roomy(state, colors, body, buffer),
        Some(state) => narrow(state, colors, body, buffer),
        None => states.iter().zip(places).for_each(|(state, place)| tiles::draw(state, colors, place, buffer)),
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
    picture::draw(state, colors, titled_picture(state, colors, picture, buffer), buffer);
    heat::draw(state, colors, titled_map(colors, map, buffer), buffer);
    facts::draw(state, colors, facts, buffer);
    traces::draw(state, colors, traces, buffer);
    list(state, colors, events, buffer);
}

/// Draws the title of the picture, and returns the area below it.
fn titled_picture(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) -> Rect {
    titled(area, &format!("picture, white: {:.0} %", 100.0 * state.peak), colors, buffer)
}

/// Draws the title of the map, and returns the area below it.
fn titled_map(colors: Colors, area: Rect, buffer: &mut Buffer) -> Rect {
    titled(area, "taxels, % of full scale", colors, buffer)
}

fn titled(area: Rect, title: &str, colors: Colors, buffer: &mut Buffer) -> Rect {
    buffer.set_stringn(area.x, area.y, title, usize::from(area.width), colors.faint());
    Rect { y: area.y + 1, height: area.height - 1, ..area }
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
        // In little room, the numbers of frames need no column of their own.
        let text = if area.width < ROOMY.0 { entry.text.trim_start() } else { &entry.text };
        put(buffer, row, text, color);
        // The time of day is at the right, if it has room.
        let time = entry.stamp.map(time_of_day).unwrap_or_default();
        let [taken, width] = [columns_of(text) + 2, time.len()].map(|columns| columns as u16);
        if width > 0 && taken + width <= row.width {
            put(buffer, Rect { x: row.right() - width, width, ..row }, &time, colors.faint());
        }
    }
}

#[cfg(test)]
mod tests;
