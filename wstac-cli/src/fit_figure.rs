//! Fitted laws as a picture: durations with the law through them, and what is left.

use wstac_plot::svg::{Anchor, Drawing, INK, Look, Marker};
use wstac_train::fit::Fit;
use wstac_train::fit::data::{Labelled, Slides};

/// Where the first panel is, how large panels are, and how far apart, in pixels.
const FIRST: [f64; 2] = [64.0, 40.0];
const SIZE: [f64; 2] = [300.0, 180.0];
const APART: [f64; 2] = [380.0, 232.0];
const BLUE: &str = "#0072b2";
const RED: &str = "#d55e00";
/// Pieces of a law's curve.
const PIECES: u32 = 60;

/// A panel and the numbers that it spans.
struct Panel {
    left: f64,
    top: f64,
    x: [f64; 2],
    y: [f64; 2],
}

impl Panel {
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |number: f64, [from, to]: [f64; 2]| (number - from) / (to - from);
        [self.left + share(x, self.x) * SIZE[0], self.top + (1.0 - share(y, self.y)) * SIZE[1]]
    }

    /// Frame, ticks and titles.
    fn draw(&self, drawing: &mut Drawing, title: &str, y_title: &str) {
        let (right, bottom) = (self.left + SIZE[0], self.top + SIZE[1]);
        let corners = [[self.left, self.top], [right, self.top], [right, bottom], [self.left, bottom]];
        drawing.line(&[corners[0], corners[1], corners[2], corners[3], corners[0]], INK, 0.8);
        for (tick, name) in ticks(self.x) {
            let [x, _] = self.at([tick, self.y[0]]);
            drawing.line(&[[x, bottom], [x, bottom + 5.0]], INK, 0.8);
            drawing.text([x, bottom + 17.0], 10.5, Anchor::Middle, &name);
        }
        for (tick, name) in ticks(self.y) {
            let [_, y] = self.at([self.x[0], tick]);
            drawing.line(&[[self.left - 5.0, y], [self.left, y]], INK, 0.8);
            drawing.text([self.left - 8.0, y + 3.7], 10.5, Anchor::End, &name);
        }
        drawing.text([self.left, self.top - 8.0], 11.5, Anchor::Start, title);
        drawing.upwards([self.left - 44.0, self.top + SIZE[1] / 2.0], 11.0, y_title);
    }
}

/// Round numbers within a range, five or so, and their names.
fn ticks([from, to]: [f64; 2]) -> Vec<(f64, String)> {
    let rough = (to - from) / 5.0;
    let power = 10_f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power).into_iter().find(|step| *step >= rough).unwrap_or(power);
    let digits = usize::from(step < 1.0) * (-step.log10().floor()).max(0.0) as usize;
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    // No minus zero.
    let named = |tick: i64| (tick as f64 * step, format!("{:.digits$}", tick as f64 * step + 0.0));
    (first..=last).map(named).collect()
}

/// From least to most with some room.
fn span(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let [least, most] =
        numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], number| [least.min(number), most.max(number)]);
    let room = (0.06 * (most - least)).max(1e-3);
    [least - room, most + room]
}

/// The picture: a column for each law, the durations above, the residuals below.
pub(crate) fn draw(fits: &[Fit], slides: &Slides) -> String {
    let width = FIRST[0] + APART[0] * fits.len() as f64;
    let mut drawing = Drawing::new([width, FIRST[1] + APART[1] + SIZE[1] + 48.0], "Speed laws fitted to slides");
    let x = span(slides.used.iter().map(|slide| slide.speed_mm_s));
    let residual = |fit: &Fit, slide: &Labelled| slide.frames - fit.frames(slide.speed_mm_s);
    let all = fits.iter().flat_map(|fit| slides.used.iter().map(move |slide| residual(fit, slide)));
    // The same for all laws, so that they can be compared; 0 is always there.
    let residuals = span(all.chain([0.0]));
    let frames = span(slides.used.iter().map(|slide| slide.frames));
    let look = Look { marker: Marker::Circle, color: BLUE, filled: false };
    for (fit, column) in fits.iter().zip(0..) {
        let left = FIRST[0] + APART[0] * f64::from(column);
        let above = Panel { left, top: FIRST[1], x, y: frames };
        above.draw(&mut drawing, &title(fit), "frames lit, at 30 a second");
        let speeds = (0..=PIECES).map(|piece| x[0] + (x[1] - x[0]) * f64::from(piece) / f64::from(PIECES));
        let curve: Vec<_> = speeds
            .map(|mm_s| [mm_s, fit.frames(mm_s)])
            .filter(|[mm_s, frames]| *mm_s > 0.0 && (above.y[0]..=above.y[1]).contains(frames))
            .map(|point| above.at(point))
            .collect();
        drawing.line(&curve, RED, 1.2);
        let below = Panel { left, top: FIRST[1] + APART[1], x, y: residuals };
        below.draw(&mut drawing, "What is left", "frames from the law");
        drawing.line(&[below.at([x[0], 0.0]), below.at([x[1], 0.0])], RED, 1.2);
        for slide in &slides.used {
            drawing.marker(above.at([slide.speed_mm_s, slide.frames]), look);
            drawing.marker(below.at([slide.speed_mm_s, residual(fit, slide)]), look);
        }
        let bottom = below.top + SIZE[1] + 36.0;
        drawing.text([left + SIZE[0] / 2.0, bottom], 11.0, Anchor::Middle, "speed (mm/s)");
    }
    drawing.finish()
}

fn title(fit: &Fit) -> String {
    format!("{}, R² {:.4}", fit.words(), fit.line.r2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_train::fit::Kind;

    #[test]
    fn ticks_are_round() {
        let names = |range| ticks(range).into_iter().map(|(_, name)| name).collect::<Vec<_>>();
        assert_eq!(names([94.0, 206.0]), ["100", "150", "200"]);
        assert_eq!(names([-1.3, 1.1]), ["-1.0", "-0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(names([21.0, 39.0]), ["25", "30", "35"]);
        assert_eq!(names([-0.02, 0.03]), ["-0.02", "-0.01", "0.00", "0.01", "0.02", "0.03"]);
    }

    #[test]
    fn every_slide_is_there_twice_and_every_law_has_its_line() {
        let slide = |n: u32| {
            let speed_mm_s = f64::from(100 + 10 * n);
            Labelled { speed_mm_s, frames: 3400.0 / speed_mm_s + 5.0 + 0.3 * f64::from(n % 3) }
        };
        let slides = Slides { used: (0..11).map(slide).collect(), ..Slides::default() };
        let fits = [Kind::Paper, Kind::Physical].map(|kind| Fit::new(kind, &slides, "it").unwrap());
        let picture = draw(&fits, &slides);
        assert_eq!(picture.matches("<circle").count(), 2 * 2 * 11);
        assert_eq!(picture.matches(RED).count(), 2 * 2);
        assert!(!picture.contains("NaN") && !picture.contains("inf"), "{picture}");
    }
}
