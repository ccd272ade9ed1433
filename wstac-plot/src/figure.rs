//! The page: four panels and a caption, 170 mm wide.

use wstac_core::params::{ROWS, SAMPLE_FRAMES};

use super::caption::caption;
use super::event::Found;
use super::panel::{Panel, SIZE, THIN, TITLE, number};
use super::{arrival, features, law};
use crate::svg::{Anchor, Drawing, INK, width_of};

/// Width on paper, that of two columns of a journal, and the page in points.
const WIDTH_MM: f64 = 170.0;
const PAGE: f64 = 482.0;
/// Panels a and b.
const LEFT: f64 = 38.0;
const SIZE_OF_FEATURES: [f64; 2] = [246.0, 112.0];
const FIRST: f64 = 29.0;
const SECOND: f64 = FIRST + SIZE_OF_FEATURES[1] + 32.0;
/// Panels c and d.
const ASIDE: f64 = 346.0;
const LAW: [f64; 2] = [ASIDE + 25.0, PAGE - 4.0 - ASIDE - 25.0];
/// The caption.
const CAPTION: f64 = SECOND + SIZE_OF_FEATURES[1] + 42.0;
const LINE: f64 = 10.0;

/// The figure as an SVG file's text.
pub fn draw(found: &Found) -> String {
    let caption = wrapped(&caption(found), PAGE - 8.0);
    let height = CAPTION + LINE * caption.len() as f64;
    let title = format!("Event {} of {}", found.number, found.about);
    let mut drawing = Drawing::new([PAGE, height], &title).on_paper(WIDTH_MM);
    let rows = features::draw(&mut drawing, found, [LEFT, FIRST], SIZE_OF_FEATURES, 0, "");
    drawing.text([LEFT, FIRST - 18.0], TITLE, Anchor::Start, "a  Rows");
    let columns = features::draw(&mut drawing, found, [LEFT, SECOND], SIZE_OF_FEATURES, ROWS, "b  Columns");
    times(&mut drawing, found, &rows, &columns);
    arrival::draw(&mut drawing, found, [ASIDE, FIRST]);
    law::draw(&mut drawing, found, [LAW[0], SECOND], [LAW[1], SIZE_OF_FEATURES[1]]);
    for (text, line) in caption.iter().zip(0_u8..) {
        drawing.text([4.0, CAPTION + LINE * f64::from(line)], SIZE, Anchor::Start, text);
    }
    drawing.finish()
}

/// Frames above, seconds below, the duration in between.
fn times(drawing: &mut Drawing, found: &Found, rows: &Panel, columns: &Panel) {
    let frames = (0..SAMPLE_FRAMES as u32).step_by(10);
    let ticks: Vec<_> = frames.map(|frame| (f64::from(frame), frame.to_string())).collect();
    rows.ticks_above(drawing, &ticks);
    drawing.text([rows.right(), rows.top - 16.0], SIZE, Anchor::End, "frame of the sample");
    let length = found.frame_s * SAMPLE_FRAMES as f64;
    let step = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 60.0, 600.0].into_iter().find(|step| length / step <= 6.0);
    let step = step.unwrap_or(3600.0);
    let count = (length / step).floor() as u32;
    let digits = usize::from(step < 1.0);
    let ticks = (0..=count).map(|tick| f64::from(tick) * step).filter(|s| *s / found.frame_s < SAMPLE_FRAMES as f64);
    let ticks: Vec<_> = ticks.map(|s| (s / found.frame_s, number(s, digits))).collect();
    columns.ticks_below(drawing, &ticks);
    let middle = columns.left + columns.size[0] / 2.0;
    drawing.text([middle, columns.bottom() + 22.0], SIZE, Anchor::Middle, "time in the sample (s)");
    for panel in [rows, columns] {
        drawing.upwards([panel.left - 22.0, panel.top + panel.size[1] / 2.0], SIZE, "ln of light, share of full scale");
    }
    let Some(lit) = found.lit else { return };
    let y = rows.bottom() + 10.0;
    let [from, to] = [lit.first, lit.last].map(|frame| rows.across(f64::from(frame)));
    drawing.line(&[[from, y], [to, y]], INK, THIN);
    for end in [from, to] {
        drawing.line(&[[end, y - 3.0], [end, y + 3.0]], INK, THIN);
    }
    let open = if lit.is_cut_off() { "at least " } else { "" };
    let text = format!("lit {open}{} frames, {:.2} s", lit.frames(), f64::from(lit.frames()) * found.frame_s);
    let width = width_of(&text, SIZE);
    let middle = f64::midpoint(from, to).max(columns.left + 62.0 + width / 2.0).min(columns.right() - width / 2.0);
    drawing.text([middle, y + 11.0], SIZE, Anchor::Middle, &text);
}

/// Lines of about this width, broken at spaces.
fn wrapped(text: &str, width: f64) -> Vec<String> {
    // Running text is narrower than single words may be.
    let most = (width / (0.49 * SIZE)) as usize;
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
