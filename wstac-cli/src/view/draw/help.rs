//! Draws the help screen: what the keys do and what is shown.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::colors::Colors;

/// The help text. A small terminal shows only its beginning, so the keys come first.
const HELP: &str = "\
q       quit (also Ctrl-C)
z       re-zero: gather a new baseline; do not touch the sensor
r       start or end a recording in a new file; it starts with a baseline:
        do not touch the sensor
space   pause the screen; a camera is still read
← →     go back or forth by 1 s in a file or scene; ↓ ↑ by 10 s
, .     pause, and go back or forth by one frame; 0: to the first frame
Tab     show one of several sensors alone, then the next; 1 to 9: that one
?       show or hide this help

Picture  the camera's green light, scaled to the brightest taxel of the last
         frames; taxels are outlined
Map      each taxel's light in percent of full scale
Traces   five rows (r) and five columns (c), natural logarithms of their
         light, one dot per frame; the trigger fires if the mean of a window
         is above the dashes
Events   first frame, speed (* extrapolated, ≤ cut off), direction and its
         confidence, lit frames, texture if there is a model";

/// Draws as many lines of the help text as fit.
pub(super) fn draw(colors: Colors, area: Rect, buffer: &mut Buffer) {
    for (line, row) in HELP.lines().zip(area.rows()) {
        buffer.set_stringn(row.x, row.y, line, usize::from(row.width), colors.calm());
    }
}
