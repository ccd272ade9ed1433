//! The page: four panels and a caption, 170 mm wide.

use wstac_core::params::ROWS;
use wstac_host::plural::counted;

use super::event::Found;
use super::{along, arrival, features};
use crate::axes::{Axes, Side, Span};
use crate::page::{MARGIN, WIDTH, caption};
use crate::style::{INK, SIZE, THIN, TITLE};
use crate::svg::{Anchor, Drawing};
use crate::text::width_of;

/// Left edge of panels a and b.
const LEFT: f64 = 38.0;
const SIZE_OF_FEATURES: [f64; 2] = [246.0, 112.0];
const FIRST: f64 = 29.0;
const SECOND: f64 = FIRST + SIZE_OF_FEATURES[1] + 32.0;
/// Left edge of panels c and d.
const ASIDE: f64 = 346.0;
const ALONG: [f64; 2] = [ASIDE + 25.0, WIDTH - MARGIN - ASIDE - 25.0];
/// Top of the caption.
const CAPTION: f64 = SECOND + SIZE_OF_FEATURES[1] + 42.0;

/// Draws an event as an SVG file's text.
pub fn draw(found: &Found) -> String {
    let title = format!("Event {} of {}", found.number, found.about);
    let mut drawing = Drawing::new(WIDTH, &title);
    let rows = features::draw(&mut drawing, found, [LEFT, FIRST], SIZE_OF_FEATURES, 0);
    drawing.text([LEFT, FIRST - 18.0], TITLE, Anchor::Start, "a  Rows");
    let columns = features::draw(&mut drawing, found, [LEFT, SECOND], SIZE_OF_FEATURES, ROWS);
    columns.title(&mut drawing, "b  Columns");
    times(&mut drawing, found, &rows, &columns);
    arrival::draw(&mut drawing, found, [ASIDE, FIRST]);
    along::draw(&mut drawing, found, [ALONG[0], SECOND], [ALONG[1], SIZE_OF_FEATURES[1]]);
    let height = caption(&mut drawing, CAPTION, &super::caption::caption(found));
    drawing.finish(height)
}

/// Draws frames above, seconds below, and the duration in between.
fn times(drawing: &mut Drawing, found: &Found, rows: &Axes, columns: &Axes) {
    rows.ticks(drawing, Side::Above, &rows.x);
    drawing.text([rows.right(), rows.top - 16.0], SIZE, Anchor::End, "frame of the sample");
    columns.ticks(drawing, Side::Below, &Span::linear(columns.x.ends().map(|frame| frame * found.frame_s)));
    columns.x_title(drawing, "time in the sample (s)");
    let Some(lit) = found.lit else { return };
    let y = rows.bottom() + 10.0;
    let [from, to] = [lit.first, lit.last].map(|frame| rows.across(f64::from(frame)));
    drawing.line(&[[from, y], [to, y]], INK, THIN);
    for end in [from, to] {
        drawing.line(&[[end, y - 3.0], [end, y + 3.0]], INK, THIN);
    }
    // The frames of a touch are all known, and those of a law of durations only in the sample.
    let open = if lit.is_cut_off() && found.record.touch_frame.is_none() { "at least " } else { "" };
    // From the first frame to the last is one step less than there are frames.
    let frames = counted(lit.frames() + 1, "frame");
    let text = format!("lit {open}{frames}, {:.2} s", f64::from(lit.frames()) * found.frame_s);
    let width = width_of(&text, SIZE);
    let middle = f64::midpoint(from, to).max(columns.left + 62.0 + width / 2.0).min(columns.right() - width / 2.0);
    drawing.text([middle, y + 11.0], SIZE, Anchor::Middle, &text);
}
