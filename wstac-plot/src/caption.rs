//! The event's numbers, and an explanation of the figure, in words.

use std::fmt::Write;

use wstac_core::paper::speed::ThresholdOn;
use wstac_host::output::Output;
use wstac_host::text::text_of;

use super::event::Found;

/// Returns the caption: the event's line of `wstac run`, and what the panels show.
pub(super) fn caption(found: &Found) -> String {
    let record = &found.record;
    let start = record.frame as f64 * found.frame_s;
    let line = text_of(&Output::Event(Box::new(record.clone())));
    let answers = line.split_once(": ").map_or(&*line, |(_, answers)| answers);
    let frame = record.frame;
    let mut text = format!("Event {} of {}; first frame {frame} ({start:.2} s): {answers}.", found.number, found.about);
    // Writing to a string does not fail.
    let _ = match found.saturated() {
        0 => Ok(()),
        1 => write!(text, " One taxel reached full scale: its light is cut off."),
        count => write!(text, " {count} taxels reached full scale: their light is cut off."),
    };
    text += " a, b: light of the five taxels of each row or column; numbers stand at its centroid. Dashed: thresholds of the \
             trigger. Gray: the window that fired.";
    if found.lit.is_some() {
        text += " Dotted: first and last lit frame.";
    }
    if found.is_of_durations {
        let on = if found.lit_threshold.1 == ThresholdOn::AboveBaseline { " above the baseline" } else { "" };
        let _ = write!(text, " Lit: above {} of full scale{on}.", found.lit_threshold.0);
    }
    text + super::along::caption(found)
}
