//! Draws the facts about the stream, in a panel or in one line.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;

use super::colors::{CALM, Colors, LIT, WARNING};
use super::put;
use crate::view::state::State;

/// Draws the panel, one fact per row.
pub(super) fn draw(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let calm = colors.one(CALM);
    let if_any = |count: u64| if count > 0 { colors.one(WARNING) } else { calm };
    let mut lines = vec![
        doing(state, colors),
        (state.rate.clone(), calm),
        (format!("frame   {}", state.frame), calm),
        (format!("dropped {}", state.dropped), if_any(state.dropped)),
        (format!("events  {}", state.events), calm),
    ];
    lines.extend(motion(state).map(|motion| (motion, colors.one(LIT))));
    if let Some(latency) = state.lag.latency {
        lines.push((format!("latency {} ms", latency.as_millis()), calm));
        lines.push((format!("behind  {}, most {}", state.lag.frames, state.lag.most), if_any(state.lag.frames.into())));
        lines.push((format!("skipped {}", state.lag.skipped), if_any(state.lag.skipped)));
    }
    for ((text, color), row) in lines.iter().zip(area.rows()) {
        put(buffer, row, text, *color);
    }
}

/// Draws the most important facts in one line.
pub(super) fn line(state: &State, colors: Colors, area: Rect, buffer: &mut Buffer) {
    let (doing, color) = doing(state, colors);
    let motion = motion(state).map_or(String::new(), |motion| format!("  {motion}"));
    let text = format!("{doing}{motion}  frame {}  {}  {} dropped", state.frame, state.rate, state.dropped);
    put(buffer, area, &text, color);
}

/// Returns speed and direction, if something slides.
fn motion(state: &State) -> Option<String> {
    let motion = state.motion?;
    let eighth = (motion.degrees / 45.0).round() as usize % 8;
    let arrow = ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'][eighth];
    Some(format!("{:.0} mm/s {arrow} {:.0}°", motion.mm_s, motion.degrees.round() % 360.0))
}

fn doing(state: &State, colors: Colors) -> (String, Color) {
    match &state.doing {
        _ if state.paused => ("PAUSED".to_owned(), colors.one(WARNING)),
        (about, text) => (text.clone(), colors.about(*about)),
    }
}
