//! A rectangle on the page and the numbers that it spans.

use crate::svg::{Anchor, Drawing, INK};

/// Size of words, in points on paper: journals ask for 7 at least.
pub(super) const SIZE: f64 = 7.5;
/// Size of a panel's title.
pub(super) const TITLE: f64 = 9.0;
/// Thin and thick lines.
pub(super) const THIN: f64 = 0.6;
pub(super) const THICK: f64 = 1.1;
/// For what stands behind.
pub(super) const PALE: &str = "#e9e9e9";
/// For thresholds and guides.
pub(super) const GREY: &str = "#6b6b6b";

/// Five colors in the order of rows or columns. From plasma by S. van der Walt and N. Smith (CC0): even steps of brightness, the
/// same in print without colors and to the color-blind; without its bright end, which is lost on white.
pub(super) const LINES: [&str; 5] = ["#0d0887", "#6a00a8", "#b12a90", "#e16462", "#f2a043"];

/// Where a panel is, and from where to where its numbers go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) size: [f64; 2],
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
}

impl Panel {
    pub(super) fn right(&self) -> f64 {
        self.left + self.size[0]
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.size[1]
    }

    /// Place of a number across.
    pub(super) fn across(&self, x: f64) -> f64 {
        self.left + (x - self.x[0]) / (self.x[1] - self.x[0]) * self.size[0]
    }

    /// Place of a number upwards.
    pub(super) fn up(&self, y: f64) -> f64 {
        self.bottom() - (y - self.y[0]) / (self.y[1] - self.y[0]) * self.size[1]
    }

    /// The outline.
    pub(super) fn frame(&self, drawing: &mut Drawing) {
        let (right, bottom) = (self.right(), self.bottom());
        let corners = [[self.left, self.top], [right, self.top], [right, bottom], [self.left, bottom]];
        drawing.line(&[corners[0], corners[1], corners[2], corners[3], corners[0]], INK, THIN);
    }

    /// Ticks below, each with its words, if it has any.
    pub(super) fn ticks_below(&self, drawing: &mut Drawing, ticks: &[(f64, String)]) {
        for (x, text) in ticks {
            let (at, bottom) = (self.across(*x), self.bottom());
            let length = if text.is_empty() { 1.5 } else { 3.0 };
            drawing.line(&[[at, bottom], [at, bottom + length]], INK, THIN);
            if !text.is_empty() {
                drawing.text([at, bottom + 10.5], SIZE, Anchor::Middle, text);
            }
        }
    }

    /// Ticks above.
    pub(super) fn ticks_above(&self, drawing: &mut Drawing, ticks: &[(f64, String)]) {
        for (x, text) in ticks {
            let at = self.across(*x);
            drawing.line(&[[at, self.top], [at, self.top - 3.0]], INK, THIN);
            drawing.text([at, self.top - 5.0], SIZE, Anchor::Middle, text);
        }
    }

    /// Ticks on the left.
    pub(super) fn ticks_left(&self, drawing: &mut Drawing, ticks: &[(f64, String)]) {
        for (y, text) in ticks {
            let at = self.up(*y);
            drawing.line(&[[self.left - 3.0, at], [self.left, at]], INK, THIN);
            drawing.text([self.left - 5.0, at + 0.35 * SIZE], SIZE, Anchor::End, text);
        }
    }
}

/// A number with a true minus sign.
pub(super) fn number(value: f64, digits: usize) -> String {
    format!("{value:.digits$}").replace('-', "\u{2212}")
}

/// Places near `wanted`, in the same order, at least `apart` from each other, within `bounds` where they have room.
pub(super) fn spread(wanted: &[f64], apart: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    let mut places = wanted.to_vec();
    // Those that are too near are pushed apart around their middle, as often as it takes.
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
        let least = places.iter().copied().fold(f64::INFINITY, f64::min);
        let most = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
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
