//! A rectangle of a drawing and the data that it spans: ticks, points, error bars, labels that do not overlap.

use wstac_plot::svg::{Anchor, Drawing, INK, Look, RADIUS, width_of};

/// How numbers become places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scale {
    Linear,
    Log,
}

/// One direction of axes: the data from one end to the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    scale: Scale,
    from: f64,
    to: f64,
}

impl Span {
    /// Wide enough for these numbers, and a little more; nothing of nothing.
    pub(super) fn of(scale: Scale, numbers: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let transformed = |number: f64| if scale == Scale::Log { number.log10() } else { number };
        let least = numbers.clone().map(transformed).fold(f64::INFINITY, f64::min);
        let most = numbers.map(transformed).fold(f64::NEG_INFINITY, f64::max);
        let room = (0.07 * (most - least)).max(if scale == Scale::Log { 0.08 } else { 1.0 });
        let ends = [least - room, most + room];
        let [from, to] = if scale == Scale::Log { ends.map(|end| 10_f64.powf(end)) } else { ends };
        (least.is_finite() && most.is_finite()).then_some(Self { scale, from, to })
    }

    /// Place of a number, 0 to 1.
    fn share(&self, number: f64) -> f64 {
        match self.scale {
            Scale::Linear => (number - self.from) / (self.to - self.from),
            Scale::Log => (number / self.from).log10() / (self.to / self.from).log10(),
        }
    }

    /// Ticks, and whether each has a number beside it.
    fn ticks(&self) -> Vec<(f64, bool)> {
        if self.scale == Scale::Linear {
            let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
            let step = steps.into_iter().find(|step| (self.to - self.from) / step <= 7.0).unwrap_or(100.0);
            let first = (self.from / step).ceil() as i64;
            let last = (self.to / step).floor() as i64;
            return (first..=last).map(|tick| (tick as f64 * step, true)).collect();
        }
        let (first, last) = (self.from.log10().floor() as i32, self.to.log10().ceil() as i32);
        // Where there are few powers of ten, others have numbers, too.
        let decades = (self.to / self.from).log10();
        let named: &[i32] = match decades {
            decades if decades < 0.8 => &[1, 2, 3, 4, 5, 6, 8],
            decades if decades < 2.1 => &[1, 2, 5],
            _ => &[1],
        };
        let decade = |exponent: i32| (1..10).map(move |digit| (exponent, digit));
        let tick = |(exponent, digit): (i32, i32)| (f64::from(digit) * 10_f64.powi(exponent), named.contains(&digit));
        let ticks = (first..last).flat_map(decade).map(tick);
        ticks.filter(|(tick, _)| (self.from..=self.to).contains(tick)).collect()
    }
}

/// A number beside a tick: 2 k, 10 M, 0.001.
fn short(number: f64) -> String {
    let (scaled, unit) = match number {
        number if number >= 1e6 => (number / 1e6, " M"),
        number if number >= 1e4 => (number / 1e3, " k"),
        number => (number, ""),
    };
    // Ticks are round numbers; those below 1 come from powers of ten.
    if scaled >= 1.0 { format!("{scaled:.0}{unit}") } else { format!("{}", (scaled * 1e9).round() / 1e9) }
}

/// Squares that keep labels off a piece of a line.
const LINE_STEPS: u32 = 50;

/// A panel.
pub(super) struct Axes<'d> {
    drawing: &'d mut Drawing,
    left: f64,
    top: f64,
    size: [f64; 2],
    x: Span,
    y: Span,
    /// Rectangles that no label may cover: left, top, right, bottom.
    taken: Vec<[f64; 4]>,
}

impl<'d> Axes<'d> {
    /// A frame with ticks and titles.
    pub(super) fn new(
        drawing: &'d mut Drawing,
        [left, top]: [f64; 2],
        size: [f64; 2],
        [x, y]: [Span; 2],
        [title, x_title, y_title]: [&str; 3],
    ) -> Self {
        let axes = Self { drawing, left, top, size, x, y, taken: Vec::new() };
        let [width, height] = size;
        let (right, bottom) = (left + width, top + height);
        let frame = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
        axes.drawing.line(&frame, INK, 0.8);
        for (tick, is_named) in x.ticks() {
            let at = left + x.share(tick) * width;
            let length = if is_named { 5.0 } else { 2.5 };
            axes.drawing.line(&[[at, bottom], [at, bottom + length]], INK, 0.8);
            if is_named {
                axes.drawing.text([at, bottom + 17.0], 10.5, Anchor::Middle, &short(tick));
            }
        }
        for (tick, is_named) in y.ticks() {
            let at = bottom - y.share(tick) * height;
            let length = if is_named { 5.0 } else { 2.5 };
            axes.drawing.line(&[[left - length, at], [left, at]], INK, 0.8);
            if is_named {
                axes.drawing.text([left - 8.0, at + 3.7], 10.5, Anchor::End, &short(tick));
            }
        }
        axes.drawing.text([left, top - 10.0], 12.5, Anchor::Start, title);
        axes.drawing.text([left + width / 2.0, bottom + 36.0], 11.5, Anchor::Middle, x_title);
        axes.drawing.upwards([left - 46.0, top + height / 2.0], 11.5, y_title);
        axes
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [width, height] = self.size;
        [self.left + self.x.share(x) * width, self.top + (1.0 - self.y.share(y)) * height]
    }

    /// Whether markers of two points cover each other.
    pub(super) fn is_same_place(&self, a: [f64; 2], b: [f64; 2]) -> bool {
        let ([ax, ay], [bx, by]) = (self.at(a), self.at(b));
        (ax - bx).abs() < RADIUS && (ay - by).abs() < RADIUS
    }

    /// A line through points of the data.
    pub(super) fn line(&mut self, points: &[[f64; 2]], color: &str) {
        let points: Vec<_> = points.iter().map(|point| self.at(*point)).collect();
        self.drawing.line(&points, color, 0.9);
        // No label on it: squares along each piece.
        for piece in points.windows(2) {
            let [[ax, ay], [bx, by]] = [piece[0], piece[1]];
            for step in 0..=LINE_STEPS {
                let share = f64::from(step) / f64::from(LINE_STEPS);
                let [x, y] = [ax + share * (bx - ax), ay + share * (by - ay)];
                self.taken.push([x - 1.5, y - 1.5, x + 1.5, y + 1.5]);
            }
        }
    }

    /// A bar from one y to another, with caps.
    pub(super) fn bar(&mut self, x: f64, [low, high]: [f64; 2], color: &str) {
        let ([x, bottom], [_, top]) = (self.at([x, low]), self.at([x, high]));
        self.drawing.line(&[[x, bottom], [x, top]], color, 0.9);
        for y in [bottom, top] {
            self.drawing.line(&[[x - 2.5, y], [x + 2.5, y]], color, 0.9);
        }
        self.taken.push([x - 2.5, top, x + 2.5, bottom]);
    }

    /// A point of the data.
    pub(super) fn point(&mut self, point: [f64; 2], look: Look) {
        let at @ [x, y] = self.at(point);
        self.drawing.marker(at, look);
        let r = 1.3 * RADIUS;
        self.taken.push([x - r, y - r, x + r, y + r]);
    }

    /// A label beside a point, once all points are there: where it covers nothing, with a thin line to it from afar.
    pub(super) fn label(&mut self, point: [f64; 2], text: &str) {
        const SIZE: f64 = 9.5;
        let [x, y] = self.at(point);
        let width = width_of(text, SIZE);
        let places = (0..20).flat_map(|step| {
            let far = 7.0 * f64::from(step);
            [[6.0, 3.3 + far], [6.0, 3.3 - far], [-6.0 - width, 3.3 + far], [-6.0 - width, 3.3 - far]]
                .into_iter()
                .chain([[-width / 2.0, -8.0 - far], [-width / 2.0, 15.0 + far]])
        });
        let [panel_width, panel_height] = self.size;
        let panel = [self.left + 2.0, self.top + 2.0, self.left + panel_width - 2.0, self.top + panel_height - 2.0];
        let found = places.map(|[dx, dy]| [x + dx, y + dy]).find(|[left, base]| {
            let own = [*left, base - 0.75 * SIZE, left + width, base + 0.2 * SIZE];
            let inside = own[0] >= panel[0] && own[1] >= panel[1] && own[2] <= panel[2] && own[3] <= panel[3];
            let free =
                |other: &[f64; 4]| own[2] < other[0] || own[0] > other[2] || own[3] < other[1] || own[1] > other[3];
            inside && self.taken.iter().all(free)
        });
        if let Some([left, base]) = found {
            let height = base - 0.3 * SIZE;
            if (height - y).abs() > 16.0 {
                self.drawing.line(&[[x, y], [x.clamp(left - 1.0, left + width + 1.0), height]], INK, 0.4);
            }
            self.drawing.text([left, base], SIZE, Anchor::Start, text);
            self.taken.push([left, base - 0.75 * SIZE, left + width, base + 0.2 * SIZE]);
        }
    }

    /// What the markers mean, below the panel, in columns; lines of text after them.
    pub(super) fn legend(&mut self, looks: &[(Look, &str)], columns: u32, notes: &[&str]) {
        let [width, height] = self.size;
        let top = self.top + height + 58.0;
        let column = width / f64::from(columns);
        let mut lines = 0;
        for ((look, name), place) in looks.iter().zip(0..) {
            let (row, at) = (place / columns, place % columns);
            let [x, y] = [self.left + f64::from(at) * column + 4.0, top + 16.0 * f64::from(row)];
            self.drawing.marker([x, y - 3.5], *look);
            self.drawing.text([x + 9.0, y], 10.0, Anchor::Start, name);
            lines = row + 1;
        }
        for (note, line) in notes.iter().zip(lines..) {
            self.drawing.text([self.left, top + 16.0 * f64::from(line)], 10.0, Anchor::Start, note);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers() {
        let span = Span::of(Scale::Log, [900.0, 1.2e6].into_iter()).unwrap();
        let named: Vec<String> =
            span.ticks().into_iter().filter(|(_, named)| *named).map(|(tick, _)| short(tick)).collect();
        assert_eq!(named, ["1000", "10 k", "100 k", "1 M"]);
        let span = Span::of(Scale::Log, [2e-4, 3e-3].into_iter()).unwrap();
        let named: Vec<String> =
            span.ticks().into_iter().filter(|(_, named)| *named).map(|(tick, _)| short(tick)).collect();
        assert_eq!(named, ["0.0002", "0.0005", "0.001", "0.002"]);
        let span = Span::of(Scale::Linear, [31.0, 59.0].into_iter()).unwrap();
        assert_eq!(span.ticks().first(), Some(&(30.0, true)));
        assert!(Span::of(Scale::Log, std::iter::empty()).is_none());
    }
}
