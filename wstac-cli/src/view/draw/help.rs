//! What keys do and what is shown, in words.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::colors::Colors;

/// Short lines first what matters most: a small terminal shows the beginning.
const HELP: &str = "\
q       quit (Ctrl-C, too)
z       re-zero: gather a new baseline; nothing may touch
r       record into a new file; once more: end the recording. It starts with
        a baseline: nothing may touch
space   pause; a camera is read on, the screen stands still
?       this, and back

Picture  the camera's green light, as bright as the brightest taxel of late;
         taxels are outlined
Map      each taxel's light in percent of full scale
Traces   five rows (r) and five columns (c), natural logarithms of their
         light, a dot a frame; a line of dashes is where the trigger fires,
         if a window's mean is above it
Events   first frame, speed (* extrapolated, ≤ cut off), direction and its
         confidence, frames lit, texture if there is a model";

/// Draws as much of it as fits.
pub(super) fn draw(colors: Colors, area: Rect, buffer: &mut Buffer) {
    for (line, row) in HELP.lines().zip(area.rows()) {
        buffer.set_stringn(row.x, row.y, line, usize::from(row.width), colors.calm());
    }
}
