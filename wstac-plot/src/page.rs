//! The page: its width and the caption below them.

use crate::style::{LINE, SIZE};
use crate::svg::{Anchor, Drawing};
use crate::text::wrapped;

/// The width of every figure in points: 170 mm, that of two columns of a journal.
pub const WIDTH: f64 = 170.0 / 25.4 * 72.0;
/// The distance from the page's edge to words.
pub const MARGIN: f64 = 4.0;

/// Writes a caption across the page, broken by the width of its words, and returns the height of a page that ends with
/// it.
///
/// Its first line stands at `top`.
pub fn caption(drawing: &mut Drawing, top: f64, text: &str) -> f64 {
    let mut height = top;
    for line in wrapped(text, SIZE, WIDTH - 2.0 * MARGIN) {
        drawing.text([MARGIN, height], SIZE, Anchor::Start, &line);
        height += LINE;
    }
    height - LINE + MARGIN
}
