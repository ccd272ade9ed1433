//! A matrix of confusions: how often the slides of each texture got each answer.

use crate::page::{MARGIN, WIDTH, caption};
use crate::style::{LINE, SIZE, TITLE, shade};
use crate::svg::{Anchor, Drawing};
use crate::text::width_of;

/// Largest side of a cell, and largest width of a row's name.
const LARGEST: f64 = 30.0;
const WIDEST: f64 = 120.0;
/// Top of the cells.
const TOP: f64 = 48.0;

/// A model's answers to slides whose textures are known.
#[derive(Clone, Debug)]
pub struct Confusion<'c> {
    /// Names of the textures, which are also the first answers.
    pub labels: &'c [String],
    /// For each texture, the number of slides by answer; the last number is that of slides without an answer.
    pub counts: &'c [Vec<u32>],
    /// The text below the matrix.
    pub caption: &'c str,
}

impl Confusion<'_> {
    /// Draws the matrix as an SVG file's text: a row for each texture, a column for each answer. A cell's brightness is
    /// its fraction of the row.
    pub fn draw(&self) -> String {
        let mut drawing = Drawing::new(WIDTH, "Confusions of a texture model");
        // The last column is drawn only if it says something.
        let missing = self.counts.iter().any(|row| row.last().is_some_and(|count| *count > 0));
        let columns = self.labels.len() + usize::from(missing);
        let names = self.labels.iter().map(|label| width_of(label, SIZE));
        let left = MARGIN + LINE + names.fold(0.0, f64::max).min(WIDEST) + 6.0;
        let side = ((WIDTH - MARGIN - left) / columns.max(1) as f64).min(LARGEST);
        let size = SIZE.min(side * 0.42);
        let right = left + side * columns as f64;
        let bottom = TOP + side * self.labels.len() as f64;
        drawing.text([f64::midpoint(left, right), 14.0], TITLE, Anchor::Middle, "answer");
        drawing.upward([MARGIN + SIZE, f64::midpoint(TOP, bottom)], TITLE, "texture");
        let none = "none".to_owned();
        for (column, label) in self.labels.iter().chain(missing.then_some(&none)).enumerate() {
            let x = left + side * (column as f64 + 0.5);
            if width_of(label, SIZE) <= side {
                drawing.text([x, TOP - 5.0], SIZE, Anchor::Middle, label);
            } else {
                // Names that do not fit side by side stand on three lines.
                drawing.text([x, TOP - 5.0 - LINE * (column % 3) as f64], size, Anchor::Middle, label);
            }
        }
        for (row, (label, counts)) in self.labels.iter().zip(self.counts).enumerate() {
            let top = TOP + side * row as f64;
            let all: u32 = counts.iter().sum();
            let baseline = top + side / 2.0 + size * 0.36;
            drawing.text([left - 4.0, baseline], SIZE, Anchor::End, label);
            for (column, count) in counts.iter().take(columns).enumerate() {
                let fraction = f64::from(*count) / f64::from(all.max(1));
                let x = left + side * column as f64;
                // The root shows few confusions, too.
                let (fill, color) = shade(fraction.sqrt());
                drawing.rectangle([x + 0.4, top + 0.4], [side - 0.8, side - 0.8], &fill);
                if *count > 0 {
                    drawing.colored([x + side / 2.0, baseline], size, Anchor::Middle, color, &count.to_string());
                }
            }
        }
        let height = caption(&mut drawing, bottom + 16.0, self.caption);
        drawing.finish(height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_is_in_its_cell() {
        let labels = ["Fla0", "Saw<3"].map(String::from);
        let figure = |counts: &[Vec<u32>]| Confusion { labels: &labels, counts, caption: "75 % right" }.draw();
        let whole = figure(&[vec![30, 0, 0], vec![8, 22, 0]]);
        assert_eq!(whole.matches("<rect").count(), 1 + 4, "the sheet and four cells");
        for text in [">30<", ">8<", ">22<", "Saw&lt;3", ">answer<", ">texture<", "75 % right", "#0072b2", "#f7f7f7"] {
            assert!(whole.contains(text), "{text}: {whole}");
        }
        assert!(!whole.contains(">0<") && !whole.contains(">none<"));
        let missing = figure(&[vec![30, 0, 1], vec![8, 22, 0]]);
        assert!(missing.contains(">none<") && missing.matches("<rect").count() == 7, "{missing}");
    }

    #[test]
    fn many_classes_stay_on_the_page() {
        let labels: Vec<String> = (0..64).map(|n| format!("a long texture's name {n}")).collect();
        let counts: Vec<Vec<u32>> = (0..64).map(|n| (0..65).map(|m| u32::from(n == m) * 1000).collect()).collect();
        let text = Confusion { labels: &labels, counts: &counts, caption: "" }.draw();
        let xs =
            text.lines().filter_map(|line| line.strip_prefix("<rect x='")?.split('\'').next()?.parse::<f64>().ok());
        assert!(xs.clone().count() == 64 * 64 && xs.fold(0.0, f64::max) < WIDTH);
    }
}
