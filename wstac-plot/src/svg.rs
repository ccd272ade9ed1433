//! A picture as SVG text: lines, markers, words. Numbers have one decimal, so that the same data give the same bytes.
//!
//! The project has its own layer and axes ([`crate::axes`]), instead of the crate plotters with its SVG backend.
//! plotters would replace frames, ticks and polylines, which are 150 lines here. It has no page in millimeters, no
//! labels that avoid each other, no hollow markers and no captions that break by the font's own widths. Its text widths
//! without a font library are estimates. So most of this crate would stay, and seven crates would come along.

use std::fmt::Write;

use crate::style::{INK, RADIUS};
use crate::text::{FAMILIES, width_of};

/// The shape of a point. Shapes differ, so that no color is needed to tell points apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A circle.
    Circle,
    /// A square.
    Square,
    /// A triangle that points up.
    Triangle,
    /// A square that stands on a corner.
    Diamond,
}

/// The shape of a marker, its color, and whether it is filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// The shape.
    pub marker: Marker,
    /// The color of the outline, and of the inside if it is filled.
    pub color: &'static str,
    /// `true` if the inside has the outline's color; it is white otherwise.
    pub filled: bool,
}

/// The part of a text that stands at its place.
#[derive(Clone, Copy, Debug)]
pub enum Anchor {
    /// The text starts there.
    Start,
    /// The middle of the text is there.
    Middle,
    /// The text ends there.
    End,
}

/// An SVG picture, to which elements are added one by one. Places and sizes are in points on paper, from the top left.
#[derive(Clone, Debug)]
pub struct Drawing {
    width: f64,
    title: String,
    text: String,
}

impl Drawing {
    /// Creates a white sheet of this width in points. Screen readers read the title aloud.
    pub fn new(width: f64, title: &str) -> Self {
        Self { width, title: escaped(title), text: String::new() }
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{element}");
    }

    /// Draws a line through points.
    pub fn line(&mut self, points: &[[f64; 2]], color: &str, width: f64) {
        let path = path(points);
        self.add(format_args!("<polyline points='{path}' fill='none' stroke='{color}' stroke-width='{width}'/>"));
    }

    /// Draws a dashed line through points; `dashes` are the lengths of ink and gap.
    pub fn dashed(&mut self, points: &[[f64; 2]], color: &str, width: f64, [ink, gap]: [f64; 2]) {
        let path = path(points);
        let style = format!("stroke='{color}' stroke-width='{width}' stroke-dasharray='{ink} {gap}'");
        self.add(format_args!("<polyline points='{path}' fill='none' {style}/>"));
    }

    /// Draws a rectangle without an outline, from its top left corner.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        self.add(format_args!("<rect x='{x:.1}' y='{y:.1}' width='{width:.1}' height='{height:.1}' fill='{fill}'/>"));
    }

    /// Draws a polygon without an outline.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: &str) {
        self.add(format_args!("<polygon points='{}' fill='{fill}'/>", path(points)));
    }

    /// Draws a marker around a place.
    pub fn marker(&mut self, [x, y]: [f64; 2], look: Look) {
        let r = RADIUS;
        let Look { marker, color, filled } = look;
        let fill = if filled { color } else { "#ffffff" };
        let style = format!("fill='{fill}' stroke='{color}' stroke-width='0.9'");
        let closed = |points: &[[f64; 2]]| {
            let points: Vec<_> = points.iter().map(|[dx, dy]| [x + dx, y + dy]).collect();
            format!("<polygon points='{}' {style}/>", path(&points))
        };
        let element = match marker {
            Marker::Circle => format!("<circle cx='{x:.1}' cy='{y:.1}' r='{r}' {style}/>"),
            Marker::Square => closed(&[[-r, -r], [r, -r], [r, r], [-r, r]]),
            Marker::Triangle => closed(&[[0.0, -1.2 * r], [1.2 * r, r], [-1.2 * r, r]]),
            Marker::Diamond => closed(&[[0.0, -1.4 * r], [1.4 * r, 0.0], [0.0, 1.4 * r], [-1.4 * r, 0.0]]),
        };
        self.add(format_args!("{element}"));
    }

    /// Writes a line of text.
    pub fn text(&mut self, at: [f64; 2], size: f64, anchor: Anchor, text: &str) {
        self.colored(at, size, anchor, INK, text);
    }

    /// Writes a line of text in another color.
    pub fn colored(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, color: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (wide, text) = (wide(text, size), escaped(text));
        let at = format!("x='{x:.1}' y='{y:.1}'{wide}");
        self.add(format_args!("<text {at} text-anchor='{anchor}' font-size='{size}' fill='{color}'>{text}</text>"));
    }

    /// Writes a line of text that reads upward; its middle is at this place.
    pub fn upward(&mut self, [x, y]: [f64; 2], size: f64, text: &str) {
        let (wide, text) = (wide(text, size), escaped(text));
        let at = format!("x='{x:.1}' y='{y:.1}'{wide} transform='rotate(-90 {x:.1} {y:.1})'");
        self.add(format_args!("<text {at} text-anchor='middle' font-size='{size}' fill='{INK}'>{text}</text>"));
    }

    /// Returns the file's text. The sheet is this high, in points.
    pub fn finish(self, height: f64) -> String {
        let (Self { width, title, text }, millimeters) = (self, |points: f64| points / 72.0 * 25.4);
        let size = format!("width='{:.2}mm' height='{:.2}mm'", millimeters(width), millimeters(height));
        let place = format!("viewBox='0 0 {width:.2} {height:.2}' role='img' font-family='{FAMILIES}'");
        let sheet = format!("<rect width='{width:.2}' height='{height:.2}' fill='#ffffff'/>");
        let head = format!("<svg xmlns='http://www.w3.org/2000/svg' {size} {place}>");
        format!("{head}\n<title>{title}</title>\n{sheet}\n{text}</svg>\n")
    }
}

fn path(points: &[[f64; 2]]) -> String {
    let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    points.join(" ")
}

/// Returns the attributes that give a line of several words its width in a viewer without the font, too.
///
/// Other fonts are up to a fifth wider, so that lines would end outside of the sheet. A single word has room.
fn wide(text: &str, size: f64) -> String {
    if !text.contains(' ') {
        return String::new();
    }
    format!(" textLength='{:.1}' lengthAdjust='spacingAndGlyphs'", width_of(text, size))
}

/// Escapes text for XML, and drops control characters, which XML does not permit.
fn escaped(text: &str) -> String {
    // XML has no control characters, nor these two, not even as references.
    let text = text.replace(|c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'), "\u{fffd}");
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
