//! Draws several sensors, next to each other or below each other, each in a tile of its own.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};

use super::colors::Colors;
use super::{TRACES, facts, heat, list, picture, put, roomy, titled_map, titled_picture, traces};
use crate::view::state::State;

/// The fewest rows of a tile: a line of facts, and the last event.
const LEAST_ROWS: u16 = 2;
/// The fewest columns of a tile beside another one: those of a line of facts.
const LEAST_COLUMNS: u16 = 36;
/// Columns between tiles.
const GAP: u16 = 2;
/// The fewest columns and rows in which a tile has all panels of a sensor that is alone.
const ROOMY: (u16, u16) = (58, 18);
/// Fewer columns than these, and at least these rows, have the picture above the map.
const TALL: (u16, u16) = (80, 30);
/// The rows of a map with numbers, with its title.
const MAP: u16 = 6;

/// Returns the places of as many of `count` tiles as fit, in the order of the sensors.
pub(super) fn places(count: usize, area: Rect) -> Vec<Rect> {
    let most = u16::try_from(count).unwrap_or(u16::MAX);
    let width = |columns: u16| ((area.width + GAP) / columns).saturating_sub(GAP);
    let rows = |columns: u16| most.div_ceil(columns).min((area.height / LEAST_ROWS).max(1));
    // Most tiles first. Then those that are largest compared with a tile of all panels, and next to each other.
    let merit = |columns: &u16| {
        let shown = rows(*columns).saturating_mul(*columns).min(most);
        let height = area.height / rows(*columns);
        let [wide, high] =
            [(width(*columns), ROOMY.0), (height, ROOMY.1)].map(|(is, of)| 1000 * u32::from(is) / u32::from(of));
        (shown, wide.min(high).min(1000))
    };
    let columns = (1..=most).filter(|columns| *columns == 1 || width(*columns) >= LEAST_COLUMNS);
    let columns = columns.max_by_key(merit).unwrap_or(1);
    let (rows, width) = (rows(columns), width(columns));
    let place = |number: u16| {
        let (row, column) = (number / columns, number % columns);
        let [top, bottom] =
            [row, row + 1].map(|row| (u32::from(row) * u32::from(area.height) / u32::from(rows)) as u16);
        Rect { x: area.x + column * (width + GAP), y: area.y + top, width, height: bottom - top }
    };
    (0..most.min(rows * columns)).map(place).collect()
}

/// Draws a sensor in its tile, with as many panels as fit.
pub(super) fn draw(state: &State, colors: Colors, tile: Rect, buffer: &mut Buffer) {
    if tile.is_empty() {
        return;
    }
    let head = Rect { height: 1, ..tile };
    let body = Rect { y: tile.y + 1, height: tile.height - 1, ..tile };
    if body.width >= ROOMY.0 && body.height >= ROOMY.1 {
        let name = state.name.as_deref().unwrap_or_default();
        put(buffer, head, &format!("{name}  {}", state.about), colors.faint());
        let is_tall = body.height >= TALL.1 && body.width < TALL.0 && !state.is_board;
        return if is_tall { tall(state, colors, body, buffer) } else { roomy(state, colors, body, buffer) };
    }
    facts::line(state, colors, head, buffer);
    let is_wide = body.width >= LEAST_COLUMNS && !state.is_board;
    if body.height > MAP + TRACES && is_wide {
        let [top, rest] = Layout::vertical([Constraint::Length(MAP), Constraint::Fill(1)]).areas(body);
        maps(state, colors, top, buffer);
        let [middle, events] = Layout::vertical([Constraint::Length(traces_in(rest)), Constraint::Fill(1)]).areas(rest);
        traces::draw(state, colors, middle, buffer);
        list(state, colors, events, buffer);
    } else if body.height > TRACES {
        let [top, events] = Layout::vertical([Constraint::Length(traces_in(body)), Constraint::Fill(1)]).areas(body);
        let right = if is_wide { beside_the_map(state, colors, top, buffer) } else { top };
        traces::draw(state, colors, right, buffer);
        list(state, colors, events, buffer);
    } else if body.height >= heat::SMALLEST.1 && is_wide {
        let right = beside_the_map(state, colors, body, buffer);
        let (text, has_lost) = facts::reception(state);
        let color = if has_lost { colors.warning() } else { colors.calm() };
        put(buffer, Rect { height: 1, ..right }, &text, color);
        list(state, colors, Rect { y: right.y + 1, height: right.height - 1, ..right }, buffer);
    } else {
        list(state, colors, body, buffer);
    }
}

/// Draws the picture, below it map and facts, then traces, then events.
fn tall(state: &State, colors: Colors, body: Rect, buffer: &mut Buffer) {
    let map_height = 2 * MAP - 1;
    let bands = [Constraint::Fill(1), Constraint::Length(map_height), Constraint::Length(11), Constraint::Length(3)];
    let [top, middle, lines, events] = Layout::vertical(bands).areas(body);
    picture::draw(state, colors, titled_picture(state, colors, top, buffer), buffer);
    let width = heat::columns(map_height - 1);
    let [map, facts] = Layout::horizontal([Constraint::Length(width), Constraint::Fill(1)]).spacing(GAP).areas(middle);
    heat::draw(state, colors, titled_map(colors, map, buffer), buffer);
    facts::draw(state, colors, facts, buffer);
    traces::draw(state, colors, lines, buffer);
    list(state, colors, events, buffer);
}

/// Returns the rows of the traces in an area that also has at least one event: one or more for each trace.
fn traces_in(area: Rect) -> u16 {
    1 + 5 * ((area.height - 1) / TRACES).clamp(1, 3)
}

/// Draws the smallest map at the left, and returns the area beside it.
fn beside_the_map(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) -> Rect {
    heat::smallest(state, colors, area, buffer);
    let columns = heat::SMALLEST.0 + GAP;
    Rect { x: area.x + columns, width: area.width - columns, ..area }
}

/// Draws the map with its numbers, and the picture beside it if there is room, or else rate and losses.
fn maps(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let width = heat::columns(area.height - 1);
    let [map, right] = Layout::horizontal([Constraint::Length(width), Constraint::Fill(1)]).spacing(GAP).areas(area);
    let right = Rect { y: right.y + 1, height: right.height - 1, ..right };
    heat::draw(state, colors, titled_map(colors, map, buffer), buffer);
    if right.width >= picture::columns(state, right.height) {
        picture::draw(state, colors, right, buffer);
        return;
    }
    let (text, has_lost) = facts::reception(state);
    for (part, row) in text.split("  ").flat_map(|part| part.split(", ")).zip(right.rows()) {
        let color = if has_lost && part.ends_with("dropped") { colors.warning() } else { colors.calm() };
        put(buffer, row, part, color);
    }
}
