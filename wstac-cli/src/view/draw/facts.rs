//! Draws the facts about the stream, in a panel or in one line.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;
use wstac_core::wire::Telemetry;
use wstac_host::monitor::telemetry;

use super::colors::Colors;
use crate::view::state::{Phase, State, arrow, time_of_day};

/// Draws the panel, one fact per row.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let mut lines = vec![doing(state, colors)];
    let calm = colors.calm();
    let if_any = |count: u64| if count > 0 { colors.warning() } else { calm };
    lines.push((rate(state), calm));
    lines.push((format!("frame   {}", state.frame), calm));
    lines.push((format!("dropped {}", state.dropped), if_any(state.dropped)));
    lines.push((format!("events  {}", state.events), calm));
    lines.extend(motion(state).map(|motion| (motion, colors.lit())));
    lines.extend(state.stamp.map(|stamp| (format!("UTC {}", time_of_day(stamp)), calm)));
    lines.extend(state.clock_within_ms.map(|within| (format!("clock   ±{within:.1} ms"), calm)));
    if let Some(telemetry) = &state.telemetry {
        lines.extend(of_board(telemetry, colors));
    }
    if state.live && !state.is_board {
        let behind = state.lag;
        let latency = behind.latency.map_or("–".to_owned(), |latency| format!("{} ms", latency.as_millis()));
        lines.push((format!("latency {latency}"), calm));
        lines.push((format!("behind  {}, most {}", behind.frames, behind.most), if_any(behind.frames.into())));
        lines.push((format!("skipped {}", behind.skipped), if_any(behind.skipped)));
    }
    for ((text, color), row) in lines.iter().zip(area.rows()) {
        buffer.set_stringn(row.x, row.y, text, usize::from(row.width), *color);
    }
    // Shows the reason in the remaining rows.
    if let Phase::Failed(why) = &state.phase {
        let mut rows = area.rows().skip(lines.len() + 1);
        for text in wrapped(why, usize::from(area.width)) {
            let Some(row) = rows.next() else { return };
            buffer.set_stringn(row.x, row.y, text, usize::from(row.width), colors.warning());
        }
    }
}

/// Returns the facts that a board reports about itself, as far as it knows them.
fn of_board(telemetry: &Telemetry, colors: Colors) -> Vec<(String, Color)> {
    let (calm, mut lines) = (colors.calm(), Vec::new());
    let if_any = |count: u32| if count > 0 { colors.warning() } else { calm };
    lines.push((format!("up for  {}", telemetry::duration(telemetry.uptime_ms)), calm));
    lines.extend(telemetry.overruns.map(|count| (format!("overrun {count}"), if_any(count))));
    lines.extend(telemetry.restarts.map(|count| (format!("restart {count}"), if_any(count))));
    lines.extend(telemetry.stack.map(|bytes| (format!("stack   {bytes} bytes"), calm)));
    lines.extend(telemetry.temperature.map(|tenths| (format!("{:.1} °C", f64::from(tenths) / 10.0), calm)));
    if telemetry.kept > 0 {
        lines.push((format!("{} not acknowledged", telemetry.kept), colors.warning()));
    }
    lines
}

/// Returns the rate and the number of lost frames in one line, and whether any was lost.
pub(super) fn reception(state: &State) -> (String, bool) {
    (format!("{}  {} dropped", rate(state), state.dropped), state.dropped > 0)
}

/// Returns speed and direction, if something slides.
fn motion(state: &State) -> Option<String> {
    let motion = state.motion?;
    let angle = f64::from(motion.degrees).round() % 360.0;
    Some(format!("{:.0} mm/s {} {angle:.0}°", motion.mm_s, arrow(motion.degrees)))
}

/// Draws the most important facts in one line, behind the name if the sensor has one.
pub(super) fn line(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let (doing, color) = doing(state, colors);
    let doing = state.name.as_ref().map_or(doing.clone(), |name| format!("{name}  {doing}"));
    if let Phase::Failed(why) = &state.phase {
        return super::put(buffer, area, &format!("{doing}  {why}"), color);
    }
    let behind = state.lag.latency.map(|latency| format!("  {} ms, {} behind", latency.as_millis(), state.lag.frames));
    let behind = behind.unwrap_or_default();
    let motion = motion(state).map_or(String::new(), |motion| format!("  {motion}"));
    let text = format!("{doing}{motion}  {}  {} dropped  frame {}{behind}", rate(state), state.dropped, state.frame);
    // In little room, the frame rate is left out first, then the lag, then the frame.
    let short = format!("{doing}{motion}  frame {}  {} dropped{behind}", state.frame, state.dropped);
    let shorter = format!("{doing}{motion}  frame {}", state.frame);
    let fits = |text: &String| super::columns_of(text) <= usize::from(area.width);
    let text = [text, short, shorter].into_iter().find(|text| fits(text)).unwrap_or_else(|| format!("{doing}{motion}"));
    super::put(buffer, area, &text, color);
}

/// Returns what the stream is doing, with its color.
fn doing(state: &State, colors: Colors) -> (String, Color) {
    let text = match &state.phase {
        Phase::Failed(_) => return ("FAILED".to_owned(), colors.warning()),
        Phase::Ended => return ("ended".to_owned(), colors.warning()),
        _ if state.paused && !state.live => return ("PAUSED".to_owned(), colors.warning()),
        Phase::Baseline(done, Some(of)) => (format!("baseline {done}/{of}"), colors.warning()),
        Phase::Baseline(done, None) => (format!("baseline {done}"), colors.warning()),
        Phase::Watching => ("watching".to_owned(), colors.calm()),
        Phase::Capturing(frames) => (format!("event {frames}/70"), colors.lit()),
    };
    // A camera continues while the picture is paused.
    if state.paused { (format!("PAUSED: {}", text.0), colors.warning()) } else { text }
}

/// Returns the frames per second, as measured or as the file states.
fn rate(state: &State) -> String {
    let of_board = || state.telemetry.and_then(|telemetry| Some(f64::from(telemetry.millihertz?) / 1000.0));
    match state.fps.or_else(of_board) {
        Some(fps) => format!("{fps:.2} fps"),
        None if state.is_board => "– fps".to_owned(),
        None => format!("{} fps, nominal", state.nominal_fps),
    }
}

/// Splits a text into lines of at most `width` characters, at spaces if there are any.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => {
                let characters: Vec<char> = word.chars().collect();
                lines.extend(characters.chunks(width.max(1)).map(|part| part.iter().collect()));
            }
        }
    }
    lines
}
