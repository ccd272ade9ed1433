//! A picture as SVG text: lines, markers, words. Numbers have one decimal, so the same data give the same bytes.

use std::fmt::Write;

/// Dark enough on white paper, and the only color of axes and words.
pub const INK: &str = "#222222";

/// How a point looks: shapes differ, so that no color is needed to tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Plus,
}

/// A marker's shape, its color, and whether it is filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    pub marker: Marker,
    pub color: &'static str,
    pub filled: bool,
}

/// Where a text is relative to its point.
#[derive(Clone, Copy, Debug)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// An SVG picture, to which elements are added one by one.
#[derive(Clone, Debug)]
pub struct Drawing {
    size: [f64; 2],
    /// Width on paper in mm; nothing for a picture on a screen.
    paper_mm: Option<f64>,
    text: String,
}

/// Half of a marker's width.
pub const RADIUS: f64 = 3.6;

impl Drawing {
    /// A white sheet of this width and height, with a title for those who hear it.
    pub fn new(size: [f64; 2], title: &str) -> Self {
        let mut drawing = Self { size, paper_mm: None, text: String::new() };
        let [width, height] = size;
        drawing.add(format_args!("<title>{}</title>", escaped(title)));
        drawing.add(format_args!("<rect width='{width}' height='{height}' fill='#ffffff'/>"));
        drawing
    }

    /// The same for paper: as many millimetres wide.
    pub fn on_paper(self, width_mm: f64) -> Self {
        Self { paper_mm: Some(width_mm), ..self }
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{element}");
    }

    /// A line through points.
    pub fn line(&mut self, points: &[[f64; 2]], color: &str, width: f64) {
        let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let path = path.join(" ");
        self.add(format_args!("<polyline points='{path}' fill='none' stroke='{color}' stroke-width='{width}'/>"));
    }

    /// A line of dashes through points; `dashes` are lengths of ink and gap.
    pub fn dashed(&mut self, points: &[[f64; 2]], color: &str, width: f64, dashes: [f64; 2]) {
        let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let path = path.join(" ");
        let [ink, gap] = dashes;
        let style = format_args!("stroke='{color}' stroke-width='{width}' stroke-dasharray='{ink} {gap}'").to_string();
        self.add(format_args!("<polyline points='{path}' fill='none' {style}/>"));
    }

    /// A rectangle without an outline, from its top left corner.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        self.add(format_args!("<rect x='{x:.1}' y='{y:.1}' width='{width:.1}' height='{height:.1}' fill='{fill}'/>"));
    }

    /// A polygon without an outline.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: &str) {
        let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        self.add(format_args!("<polygon points='{}' fill='{fill}'/>", path.join(" ")));
    }

    /// A marker.
    pub fn marker(&mut self, [x, y]: [f64; 2], look: Look) {
        let r = RADIUS;
        let Look { marker, color, filled } = look;
        let fill = if filled { color } else { "#ffffff" };
        let style = format!("fill='{fill}' stroke='{color}' stroke-width='1.3'");
        let closed = |points: &[[f64; 2]]| {
            let path: Vec<String> = points.iter().map(|[dx, dy]| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
            format!("<polygon points='{}' {style}/>", path.join(" "))
        };
        let element = match marker {
            Marker::Circle => format!("<circle cx='{x:.1}' cy='{y:.1}' r='{r}' {style}/>"),
            Marker::Square => closed(&[[-r, -r], [r, -r], [r, r], [-r, r]]),
            Marker::Triangle => closed(&[[0.0, -1.2 * r], [1.2 * r, r], [-1.2 * r, r]]),
            Marker::Diamond => closed(&[[0.0, -1.4 * r], [1.4 * r, 0.0], [0.0, 1.4 * r], [-1.4 * r, 0.0]]),
            Marker::Cross | Marker::Plus => {
                let (dx, dy) = if marker == Marker::Cross { (r, r) } else { (1.3 * r, 0.0) };
                let strokes = [[[-dx, -dy], [dx, dy]], [[-dy, dx], [dy, -dx]]];
                for [[ax, ay], [bx, by]] in strokes {
                    self.line(&[[x + ax, y + ay], [x + bx, y + by]], color, 1.8);
                }
                return;
            }
        };
        self.add(format_args!("{element}"));
    }

    /// A line of text.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, text: &str) {
        self.turned([x, y], size, anchor, "", INK, text);
    }

    /// A line of text in another color.
    pub fn colored(&mut self, at: [f64; 2], size: f64, anchor: Anchor, color: &str, text: &str) {
        self.turned(at, size, anchor, "", color, text);
    }

    /// A line of text upwards.
    pub fn upwards(&mut self, [x, y]: [f64; 2], size: f64, text: &str) {
        self.turned([x, y], size, Anchor::Middle, &format!(" transform='rotate(-90 {x:.1} {y:.1})'"), INK, text);
    }

    fn turned(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, turn: &str, color: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let font = "font-family='Helvetica, Arial, sans-serif'";
        let text = escaped(text);
        self.add(format_args!(
            "<text x='{x:.1}' y='{y:.1}' text-anchor='{anchor}'{turn} {font} font-size='{size}' fill='{color}'>{text}</text>"
        ));
    }

    /// The file's text.
    pub fn finish(self) -> String {
        let [width, height] = self.size;
        let outer = match self.paper_mm {
            Some(mm) => format!("width='{mm}mm' height='{:.2}mm'", mm * height / width),
            None => format!("width='{width}' height='{height}'"),
        };
        let head = "<svg xmlns='http://www.w3.org/2000/svg'";
        format!("{head} {outer} viewBox='0 0 {width} {height}' role='img'>\n{}</svg>\n", self.text)
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// About how wide a text is.
pub fn width_of(text: &str, size: f64) -> f64 {
    0.54 * size * text.chars().count() as f64
}
