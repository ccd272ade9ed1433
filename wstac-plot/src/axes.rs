//! A panel: a rectangle of the page, the numbers that it spans, ticks, points, and labels that do not overlap.

use crate::style::{INK, LINE, RADIUS, SIZE, THIN, TITLE};
use crate::svg::{Anchor, Drawing, Look};
use crate::text::width_of;

/// The length of a tick with a number, and of a tick without.
const TICK: [f64; 2] = [3.0, 1.5];
/// Smallest room between the numbers of two ticks: across, and from line to line.
const APART: [f64; 2] = [5.0, 1.5 * SIZE];
/// Largest number of ticks with numbers on a side.
const MOST_TICKS: usize = 8;
/// The room around a label.
const CLEAR: f64 = 1.0;

/// The numbers from one end of an axis to the other.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// `true` if equal ratios are equal distances, `false` if equal differences are.
    is_log: bool,
    from: f64,
    to: f64,
}

/// A side of a panel that has ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The lower side.
    Below,
    /// The upper side.
    Above,
    /// The left side.
    Left,
}

impl Span {
    /// Creates a linear span; `to` is above `from`.
    pub fn linear([from, to]: [f64; 2]) -> Self {
        Self { is_log: false, from, to }
    }

    /// Creates a logarithmic span; `to` is above `from`, and `from` is above 0.
    pub fn log([from, to]: [f64; 2]) -> Self {
        Self { is_log: true, from, to }
    }

    /// Returns a linear span that holds these numbers and a little more, or `None` if there is no number.
    pub fn around(numbers: impl Iterator<Item = f64>) -> Option<Self> {
        let [least, most] = extent(numbers);
        // Numbers that are all the same also have a span.
        let room = (0.06 * (most - least)).max(1e-3);
        (least.is_finite() && most.is_finite()).then(|| Self::linear([least - room, most + room]))
    }

    /// Returns a logarithmic span that holds these numbers and a little more, or `None` if there is no number.
    pub fn log_around(numbers: impl Iterator<Item = f64>) -> Option<Self> {
        let exponents = Self::around(numbers.map(f64::log10))?;
        Some(Self::log(exponents.ends().map(|end| 10_f64.powf(end))))
    }

    /// Returns the two ends.
    pub fn ends(&self) -> [f64; 2] {
        [self.from, self.to]
    }

    /// Returns `true` if a number is between the ends.
    pub fn contains(&self, number: f64) -> bool {
        (self.from..=self.to).contains(&number)
    }

    /// Returns the place of a number: 0 at the first end, 1 at the last.
    pub fn fraction(&self, number: f64) -> f64 {
        if self.is_log {
            return (number / self.from).log10() / (self.to / self.from).log10();
        }
        (number - self.from) / (self.to - self.from)
    }

    /// Returns round numbers and their texts, as many as have room on a side of this length.
    ///
    /// A logarithmic span also has numbers in between, with an empty text.
    pub fn ticks(&self, length: f64, side: Side) -> Vec<(f64, String)> {
        // Within half a decade, multiples of powers of ten are too few.
        let is_log = self.is_log && self.to / self.from > 3.0;
        let mut candidates = if is_log { self.decades() } else { self.steps() }.into_iter();
        let found = candidates.find(|ticks| self.have_room(ticks, length, side)).unwrap_or_default();
        if !is_log {
            return found;
        }
        let digits: &[u8] = if (self.to / self.from).log10() < 4.0 { &[1, 2, 3, 4, 5, 6, 7, 8, 9] } else { &[1] };
        let minor = self.multiples(digits, 1).into_iter().map(|(tick, _)| (tick, String::new()));
        let is_other = |(tick, _): &(f64, String)| found.iter().all(|(other, _)| other.total_cmp(tick).is_ne());
        minor.filter(is_other).chain(found.iter().cloned()).collect()
    }

    /// Returns ticks at equal steps, the densest first.
    fn steps(&self) -> Vec<Vec<(f64, String)>> {
        let power = (self.to - self.from).log10().floor() as i32;
        let steps = (power - 1..=power + 1).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10_f64.powi(power)));
        let ticks = |step: f64| {
            let (first, last) = ((self.from / step).ceil() as i64, (self.to / step).floor() as i64);
            (first..=last).map(|tick| tick as f64 * step).map(|tick| (tick, number(tick, step))).collect()
        };
        steps.map(ticks).collect()
    }

    /// Returns ticks at multiples of powers of ten, the densest first.
    fn decades(&self) -> Vec<Vec<(f64, String)>> {
        let within = [&[1, 2, 3, 4, 5, 6, 8][..], &[1, 2, 5]].map(|digits| self.multiples(digits, 1));
        let powers = (1..20).map(|apart| self.multiples(&[1], apart));
        within.into_iter().chain(powers).collect()
    }

    /// Returns these multiples of every power of ten, or of every second one, and so on.
    fn multiples(&self, digits: &[u8], apart: usize) -> Vec<(f64, String)> {
        let decades = (self.from.log10().floor() as i32..=self.to.log10().ceil() as i32).filter(|decade| {
            // The decades are the same whatever the ends are.
            decade.rem_euclid(apart as i32) == 0
        });
        let of_decade = |decade: i32| digits.iter().map(move |digit| (f64::from(*digit), 10_f64.powi(decade)));
        let ticks = decades.flat_map(of_decade).map(|(digit, power)| (digit * power, number(digit * power, power)));
        ticks.filter(|(tick, _)| self.contains(*tick)).collect()
    }

    /// Returns `true` if the numbers of ticks do not touch on a side of this length.
    fn have_room(&self, ticks: &[(f64, String)], length: f64, side: Side) -> bool {
        let place = |tick: f64| length * self.fraction(tick);
        let is_free = |pair: &[(f64, String)]| {
            let [(a, a_text), (b, b_text)] = pair else { return true };
            let needed = match side {
                Side::Left => APART[1],
                _ => f64::midpoint(width_of(a_text, SIZE), width_of(b_text, SIZE)) + APART[0],
            };
            place(*b) - place(*a) >= needed
        };
        ticks.len() <= MOST_TICKS && ticks.windows(2).all(is_free)
    }
}

/// Writes a number that is a multiple of `step`, with a true minus sign, and thousands and millions as `k` and `M`.
pub fn number(value: f64, step: f64) -> String {
    let (scale, unit) = match value.abs() {
        size if size >= 1e6 => (1e6, " M"),
        size if size >= 1e4 => (1e3, " k"),
        _ => (1.0, ""),
    };
    // A little less, so that the logarithm of 0.1 is not rounded up.
    let digits = (-(step / scale).log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
    // Avoids minus zero.
    format!("{:.digits$}{unit}", value / scale + 0.0).replace('-', "\u{2212}")
}

/// A panel: its place on the page, and the numbers that its sides span.
#[derive(Clone, Debug)]
pub struct Axes {
    /// The left edge.
    pub left: f64,
    /// The upper edge.
    pub top: f64,
    /// Width and height.
    pub size: [f64; 2],
    /// The numbers from left to right.
    pub x: Span,
    /// The numbers from bottom to top.
    pub y: Span,
    /// Rectangles that no label may cover: left, top, right, bottom.
    taken: Vec<[f64; 4]>,
}

impl Axes {
    /// Creates a panel of this size with its top left corner at a place of the page, without drawing it.
    pub fn new([left, top]: [f64; 2], size: [f64; 2], x: Span, y: Span) -> Self {
        Self { left, top, size, x, y, taken: Vec::new() }
    }

    /// Draws the frame, the ticks below and on the left, and the titles.
    ///
    /// The titles are the panel's, that of the numbers across, and that of the numbers upward. The first two may be
    /// empty.
    pub fn draw(&self, drawing: &mut Drawing, [title, x_title, y_title]: [&str; 3]) {
        self.frame(drawing);
        self.ticks(drawing, Side::Below, &self.x);
        self.ticks(drawing, Side::Left, &self.y);
        if !title.is_empty() {
            self.title(drawing, title);
        }
        if !x_title.is_empty() {
            self.x_title(drawing, x_title);
        }
        self.y_title(drawing, y_title);
    }

    /// Returns the right edge.
    pub fn right(&self) -> f64 {
        self.left + self.size[0]
    }

    /// Returns the lower edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.size[1]
    }

    /// Returns the place of a number across the page.
    pub fn across(&self, x: f64) -> f64 {
        self.left + self.x.fraction(x) * self.size[0]
    }

    /// Returns the place of a number down the page.
    pub fn up(&self, y: f64) -> f64 {
        self.bottom() - self.y.fraction(y) * self.size[1]
    }

    /// Returns the place of a point of the data.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.across(x), self.up(y)]
    }

    /// Draws the outline.
    pub fn frame(&self, drawing: &mut Drawing) {
        let (left, top, right, bottom) = (self.left, self.top, self.right(), self.bottom());
        drawing.line(&[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], INK, THIN);
    }

    /// Draws ticks of a span that runs along a side, which may be another one than the panel's own.
    pub fn ticks(&self, drawing: &mut Drawing, side: Side, span: &Span) {
        let [width, height] = self.size;
        let length = if side == Side::Left { height } else { width };
        for (tick, text) in span.ticks(length, side) {
            let (along, out) = (length * span.fraction(tick), TICK[usize::from(text.is_empty())]);
            let (from, to, place, anchor) = match side {
                Side::Below => {
                    let (x, y) = (self.left + along, self.bottom());
                    ([x, y], [x, y + out], [x, y + LINE + 0.5], Anchor::Middle)
                }
                Side::Above => {
                    let (x, y) = (self.left + along, self.top);
                    ([x, y], [x, y - out], [x, y - 5.0], Anchor::Middle)
                }
                Side::Left => {
                    let (x, y) = (self.left, self.bottom() - along);
                    ([x, y], [x - out, y], [x - 5.0, y + 0.35 * SIZE], Anchor::End)
                }
            };
            drawing.line(&[from, to], INK, THIN);
            if !text.is_empty() {
                drawing.text(place, SIZE, anchor, &text);
            }
        }
    }

    /// Writes the panel's title above it.
    pub fn title(&self, drawing: &mut Drawing, text: &str) {
        drawing.text([self.left, self.top - 5.0], TITLE, Anchor::Start, text);
    }

    /// Writes the title of the numbers below.
    pub fn x_title(&self, drawing: &mut Drawing, text: &str) {
        let middle = self.left + self.size[0] / 2.0;
        drawing.text([middle, self.bottom() + 22.0], SIZE, Anchor::Middle, text);
    }

    /// Writes the title of the numbers on the left, next to the widest of them.
    pub fn y_title(&self, drawing: &mut Drawing, text: &str) {
        let widths = self.y.ticks(self.size[1], Side::Left).into_iter().map(|(_, text)| width_of(&text, SIZE));
        let place = [self.left - 9.5 - widths.fold(0.0, f64::max), self.top + self.size[1] / 2.0];
        drawing.upward(place, SIZE, text);
    }

    /// Draws a vertical bar with caps, from one number to another.
    pub fn bar(&mut self, drawing: &mut Drawing, x: f64, [low, high]: [f64; 2], color: &str) {
        const CAP: f64 = 2.0;
        let ([x, bottom], [_, top]) = (self.at([x, low]), self.at([x, high]));
        drawing.line(&[[x, bottom], [x, top]], color, THIN);
        for y in [bottom, top] {
            drawing.line(&[[x - CAP, y], [x + CAP, y]], color, THIN);
        }
        self.take([x, f64::midpoint(bottom, top)], [CAP, (bottom - top) / 2.0]);
    }

    /// Draws a point of the data.
    pub fn point(&mut self, drawing: &mut Drawing, point: [f64; 2], look: Look) {
        let at = self.at(point);
        drawing.marker(at, look);
        self.take(at, [1.4 * RADIUS; 2]);
    }

    /// Keeps labels off the rectangle around a place.
    fn take(&mut self, [x, y]: [f64; 2], [half_width, half_height]: [f64; 2]) {
        self.taken.push([x - half_width, y - half_height, x + half_width, y + half_height]);
    }

    /// Writes a label next to a point so that it covers nothing, and returns `true` if the panel has room for it.
    ///
    /// A thin line leads to a label that is far away. Call this after all points are drawn.
    pub fn label(&mut self, drawing: &mut Drawing, point: [f64; 2], text: &str) -> bool {
        let [x, y] = self.at(point);
        let (width, beside) = (width_of(text, SIZE), 1.4 * RADIUS + 1.5);
        let around = |[left, base]: [f64; 2]| {
            [left - CLEAR, base - 0.75 * SIZE - CLEAR, left + width + CLEAR, base + 0.22 * SIZE + CLEAR]
        };
        let places = (0..60).flat_map(|step| {
            let far = 3.0 * f64::from(step);
            let middle = 0.35 * SIZE;
            [[beside, middle + far], [beside, middle - far], [-beside - width, middle + far]].into_iter().chain([
                [-beside - width, middle - far],
                [-width / 2.0, -beside - far],
                [-width / 2.0, beside + 0.75 * SIZE + far],
            ])
        });
        let covers = |a: &[f64; 4], b: &[f64; 4]| a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
        let found = places.map(|[dx, dy]| [x + dx, y + dy]).find(|place| {
            let own = around(*place);
            let is_inside = own[0] > self.left && own[1] > self.top && own[2] < self.right() && own[3] < self.bottom();
            is_inside && !self.taken.iter().any(|other| covers(&own, other))
        });
        let Some([left, base]) = found else { return false };
        let middle = base - 0.3 * SIZE;
        if (middle - y).abs() > 1.6 * SIZE {
            let end = if middle < y { base + 0.22 * SIZE } else { base - 0.75 * SIZE };
            drawing.line(&[[x, y], [x.clamp(left, left + width), end]], INK, THIN / 2.0);
        }
        drawing.text([left, base], SIZE, Anchor::Start, text);
        self.taken.push(around([left, base]));
        true
    }
}

/// Returns the least and the largest number; infinite ends if there is none.
pub(crate) fn extent(numbers: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    numbers.into_iter().fold(none, |[least, most], number| [least.min(number), most.max(number)])
}

/// Returns places near `wanted`, in the same order, at least `apart` from each other, and within bounds if these have
/// room.
pub(crate) fn spread(wanted: &[f64], apart: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    let mut places = wanted.to_vec();
    // Places that are too near to each other are pushed apart around their middle until they fit.
    for _ in 0..200 {
        let mut moved = false;
        for pair in order.windows(2) {
            let missing = apart - (places[pair[1]] - places[pair[0]]);
            if missing > 1e-3 {
                places[pair[0]] -= missing / 2.0;
                places[pair[1]] += missing / 2.0;
                moved = true;
            }
        }
        let [least, most] = extent(places.iter().copied());
        let shift = (low - least).max(0.0) + (high - most).min(0.0);
        for place in &mut places {
            *place += shift;
        }
        if !moved {
            break;
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(span: Span, length: f64, side: Side) -> Vec<String> {
        span.ticks(length, side).into_iter().map(|(_, text)| text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn ticks_are_round_numbers_as_many_as_have_room() {
        let linear = |ends| named(Span::linear(ends), 100.0, Side::Left);
        assert_eq!(linear([94.0, 206.0]), ["100", "120", "140", "160", "180", "200"]);
        assert_eq!(linear([-1.3, 1.1]), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(linear([21.0, 39.0]), ["25", "30", "35"]);
        assert_eq!(linear([-0.02, 0.03]), ["−0.02", "−0.01", "0.00", "0.01", "0.02", "0.03"]);
        assert_eq!(linear([0.0, 24_000.0]), ["0", "5000", "10 k", "15 k", "20 k"]);
        let log = |ends, length| named(Span::log(ends), length, Side::Below);
        assert_eq!(log([900.0, 1.2e6], 200.0), ["1000", "10 k", "100 k", "1 M"]);
        assert_eq!(log([2e-4, 3e-3], 200.0), ["0.0002", "0.0005", "0.001", "0.002"]);
        assert_eq!(log([50.0, 400.0], 107.0), ["50", "100", "200"]);
        assert_eq!(log([60_000.0, 90_000.0], 200.0), ["60 k", "65 k", "70 k", "75 k", "80 k", "85 k", "90 k"]);
        // Nine decades in little room: every second one.
        assert_eq!(log([1e-3, 1e6], 100.0), ["0.01", "1", "100", "10 k", "1 M"]);
        for length in [30.0, 60.0, 107.0, 250.0] {
            for to in [2.0, 7.0, 90.0, 1e4, 1e9] {
                let span = Span::log([1.1, to]);
                let ticks: Vec<_> =
                    span.ticks(length, Side::Below).into_iter().filter(|(_, text)| !text.is_empty()).collect();
                assert!(span.have_room(&ticks, length, Side::Below), "{length} {to}: {ticks:?}");
            }
        }
    }

    #[test]
    fn a_span_has_room_around_its_numbers() {
        assert!(Span::around(std::iter::empty()).is_none() && Span::log_around(std::iter::empty()).is_none());
        let around = |is_log: bool, numbers: &[f64]| {
            let numbers = numbers.iter().copied();
            if is_log { Span::log_around(numbers) } else { Span::around(numbers) }
        };
        for is_log in [false, true] {
            let span = around(is_log, &[3.0, 8.0, 5.0]).unwrap();
            assert!(span.fraction(3.0) > 0.01 && span.fraction(8.0) < 0.99 && span.contains(5.0), "{span:?}");
            let [from, to] = around(is_log, &[3.0]).unwrap().ends();
            assert!(from < 3.0 && 3.0 < to);
        }
    }

    #[test]
    fn labels_cover_neither_points_nor_each_other() {
        let mut drawing = Drawing::new(200.0, "");
        let mut axes = Axes::new([20.0, 20.0], [160.0, 90.0], Span::linear([0.0, 1.0]), Span::linear([0.0, 1.0]));
        let look = Look { marker: crate::svg::Marker::Circle, color: INK, filled: true };
        let points: Vec<[f64; 2]> =
            (0..7).map(|n| [0.4 + 0.03 * f64::from(n), 0.5 + 0.01 * f64::from(n % 2)]).collect();
        for point in &points {
            axes.point(&mut drawing, *point, look);
        }
        let markers = axes.taken.len();
        assert!(points.iter().all(|point| axes.label(&mut drawing, *point, "boosted-10")));
        for (number, a) in axes.taken.iter().enumerate().skip(markers) {
            assert!(a[0] > 20.0 && a[1] > 20.0 && a[2] < 180.0 && a[3] < 110.0, "{a:?}");
            for b in &axes.taken[..number] {
                assert!(a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1], "{a:?} {b:?}");
            }
        }
        // Without room there is no label.
        assert!(!axes.label(&mut drawing, points[0], &"wide ".repeat(30)));
    }

    #[test]
    fn what_is_too_near_is_spread() {
        assert_eq!(spread(&[10.0, 30.0], 5.0, [0.0, 100.0]), [10.0, 30.0]);
        let places = spread(&[50.0, 50.0, 50.1, 49.9, 50.0], 8.0, [0.0, 100.0]);
        let mut sorted = places.clone();
        sorted.sort_by(f64::total_cmp);
        assert!(sorted.windows(2).all(|pair| pair[1] - pair[0] > 7.9), "{sorted:?}");
        assert!(places[3] < places[0] && places[2] > places[0], "{places:?}");
        let places = spread(&[99.0, 99.5], 8.0, [0.0, 100.0]);
        assert!(places[1] <= 100.0 && places[1] - places[0] > 7.9, "{places:?}");
    }
}
