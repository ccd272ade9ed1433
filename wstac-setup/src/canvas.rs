//! A picture to draw on; parts of a drawing outside of it are left out.

/// Red, green and blue.
pub(crate) type Color = [u8; 3];

/// Dots in a glyph's width; its height follows.
const WIDTH: usize = 5;
const HEIGHT: usize = 7;
/// Pixels of a glyph's dot.
const DOT: usize = 2;
/// Pixels of a line's width.
const PEN: i64 = 2;
/// Pixels of a dash and of the gap after it.
const DASH: usize = 8;
/// Color under text and lines, so that the picture's own light does not hide them.
const SHADE: Color = [0, 0, 0];

pub(crate) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

impl Canvas {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0; 3]; width * height] }
    }

    pub(crate) fn fill(&mut self, [left, top]: [usize; 2], [width, height]: [usize; 2], color: Color) {
        let right = (left + width).min(self.width);
        for y in top..(top + height).min(self.height) {
            if let Some(pixels) = self.pixels.get_mut(y * self.width + left..y * self.width + right) {
                pixels.fill(color);
            }
        }
    }

    /// Draws a square of `side` pixels around a point.
    fn dot(&mut self, [x, y]: [f64; 2], side: i64, color: Color) {
        let [left, top] = [x, y].map(|at| at.round() as i64 - (side - 1) / 2);
        for y in top..top + side {
            for x in left..left + side {
                let place = usize::try_from(x).ok().zip(usize::try_from(y).ok());
                let inside = place.filter(|&(x, y)| x < self.width && y < self.height);
                if let Some(pixel) = inside.and_then(|(x, y)| self.pixels.get_mut(y * self.width + x)) {
                    *pixel = color;
                }
            }
        }
    }

    /// Draws points with a shade around them.
    fn strokes(&mut self, points: &[[f64; 2]], color: Color) {
        for (side, color) in [(PEN + 2, SHADE), (PEN, color)] {
            for &point in points {
                self.dot(point, side, color);
            }
        }
    }

    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], color: Color) {
        for point in along(from, to) {
            self.dot(point, PEN, color);
        }
    }

    /// Draws a rectangle's outline, inside the rectangle.
    pub(crate) fn outline(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], color: Color, dashed: bool) {
        let (right, bottom) = (x + width - 2.0, y + height - 2.0);
        let corners = [[x, y], [right, y], [right, bottom], [x, bottom], [x, y]];
        let mut points: Vec<[f64; 2]> = corners.windows(2).flat_map(|pair| along(pair[0], pair[1])).collect();
        if dashed {
            points = points.chunks(DASH).step_by(2).flatten().copied().collect();
        }
        self.strokes(&points, color);
    }

    pub(crate) fn ring(&mut self, [x, y]: [f64; 2], radius: f64, color: Color) {
        let count = (radius * 7.0).clamp(16.0, 20_000.0) as usize;
        let points = (0..count).map(|k| {
            let (sin, cos) = (core::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            [x + radius * cos, y + radius * sin]
        });
        self.strokes(&points.collect::<Vec<_>>(), color);
    }

    pub(crate) fn cross(&mut self, [x, y]: [f64; 2], reach: f64, color: Color) {
        let mut points = along([x - reach, y], [x + reach, y]);
        points.extend(along([x, y - reach], [x, y + reach]));
        self.strokes(&points, color);
    }

    /// Draws digits and commas from this point to the right and down.
    pub(crate) fn text(&mut self, [x, y]: [f64; 2], text: &str, color: Color) {
        for (side, color) in [(DOT as i64 + 2, SHADE), (DOT as i64, color)] {
            for (k, character) in text.chars().enumerate() {
                for (row, bits) in glyph(character).into_iter().enumerate() {
                    for column in (0..WIDTH).filter(|column| bits >> (WIDTH - 1 - column) & 1 == 1) {
                        let at = [k * (WIDTH + 1) + column, row].map(|at| (at * DOT) as f64);
                        self.dot([x + at[0], y + at[1]], side, color);
                    }
                }
            }
        }
    }

    pub(crate) fn to_png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (width, height) = (self.width as u32, self.height as u32);
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        // Writing to memory does not fail: the header describes the data that follows.
        if let Ok(mut writer) = encoder.write_header() {
            let _ = writer.write_image_data(self.pixels.as_flattened());
        }
        bytes
    }
}

/// Returns points on a line, a pixel apart.
fn along(from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let count = (to[0] - from[0]).hypot(to[1] - from[1]).ceil().clamp(1.0, 20_000.0);
    let point = |k: usize| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * k as f64 / count);
    (0..=count as usize).map(point).collect()
}

/// Returns the dots of a digit or a comma, row by row, with the leftmost dot in the highest bit.
///
/// Other characters have no dots.
fn glyph(character: char) -> [u8; HEIGHT] {
    match character {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b11110, 0b00001, 0b00001, 0b01110, 0b00001, 0b00001, 0b11110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        ',' => [0, 0, 0, 0, 0b00100, 0b00100, 0b01000],
        _ => [0; HEIGHT],
    }
}
