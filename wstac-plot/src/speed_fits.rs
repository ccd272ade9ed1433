//! Fits of the speed law: durations with the law through them, and residuals.

use crate::axes::{Axes, Scale, Span};
use crate::page::{WIDTH, caption, place};
use crate::style::{BLUE, LINE, RED, SIZE, THICK, TITLE};
use crate::svg::{Anchor, Drawing, Look, Marker};
use crate::text::wrapped;

/// The upper edge of the durations; the height of a panel and the distance between two panels follow.
const FIRST: f64 = 32.0;
const HEIGHT: f64 = 128.0;
const BETWEEN: f64 = 28.0;
/// The pieces of a law's curve.
const PIECES: u32 = 240;

/// A fitted law in plain numbers.
#[derive(Clone, Debug)]
pub struct SpeedFit<'f, Law> {
    /// The law's name.
    pub name: &'f str,
    /// The law's formula, and the quality of its fit.
    pub formula: String,
    /// The law itself.
    pub law: Law,
}

/// Laws that were fitted to the same slides.
///
/// A law returns the number of lit frames of a slide with this speed in mm/s.
#[derive(Clone, Debug)]
pub struct SpeedFits<'f, Law> {
    /// The speed of each slide in mm/s, and its lit frames at 30 per second.
    pub slides: &'f [[f64; 2]],
    /// The laws.
    pub fits: &'f [SpeedFit<'f, Law>],
}

impl<Law: Fn(f64) -> f64> SpeedFits<'_, Law> {
    /// Draws the fits as an SVG file's text: a column for each law, with the residuals below the durations. The residuals
    /// of a single law are on the right.
    pub fn draw(&self) -> String {
        let Self { slides, fits } = self;
        let mut drawing = Drawing::new(WIDTH, "Speed laws fitted to slides");
        let around = |numbers: &mut dyn Iterator<Item = f64>| {
            Span::around(Scale::Linear, numbers).unwrap_or(Span::linear([0.0, 1.0]))
        };
        let (x, frames) =
            (around(&mut slides.iter().map(|slide| slide[0])), around(&mut slides.iter().map(|slide| slide[1])));
        let residual = |fit: &SpeedFit<'_, Law>, [mm_s, frames]: [f64; 2]| frames - (fit.law)(mm_s);
        let all = fits.iter().flat_map(|fit| slides.iter().map(move |slide| residual(fit, *slide)));
        // The same range for all laws, so that they can be compared; it always contains 0.
        let residuals = around(&mut all.chain([0.0]));
        let look = Look { marker: Marker::Circle, color: BLUE, filled: false };
        let is_alone = fits.len() == 1;
        let mut bottom = FIRST;
        for (fit, number) in fits.iter().zip(0..) {
            let [left, width] = place(number, fits.len().max(2) as u32);
            let mut above = Axes::new([left, FIRST], [width, HEIGHT], x, frames);
            let letter = char::from(b'a' + number as u8);
            let x_title = "speed (mm/s)";
            above.draw(&mut drawing, ["", if is_alone { x_title } else { "" }, "frames lit, at 30 per second"]);
            drawing.text(
                [left, FIRST - 15.0],
                TITLE,
                Anchor::Start,
                &format!("{letter}  Law \u{201c}{}\u{201d}", fit.name),
            );
            for (text, line) in wrapped(&fit.formula, SIZE, width).iter().zip(0_u8..) {
                drawing.text([left, FIRST - 4.5 + LINE * f64::from(line)], SIZE, Anchor::Start, text);
            }
            let [slowest, fastest] = x.ends();
            let speeds = (0..=PIECES).map(|piece| slowest + (fastest - slowest) * f64::from(piece) / f64::from(PIECES));
            let curve: Vec<_> = speeds.filter(|mm_s| *mm_s > 0.0).map(|mm_s| [mm_s, (fit.law)(mm_s)]).collect();
            above.line(&mut drawing, &curve, RED, THICK);
            let beside = if is_alone { [place(1, 2)[0], FIRST] } else { [left, FIRST + HEIGHT + BETWEEN] };
            let mut below = Axes::new(beside, [width, HEIGHT], x, residuals);
            below.draw(&mut drawing, ["Residuals", x_title, "residual (frames)"]);
            bottom = below.bottom();
            below.line(&mut drawing, &[[slowest, 0.0], [fastest, 0.0]], RED, THICK);
            for slide in *slides {
                above.point(&mut drawing, *slide, look);
                below.point(&mut drawing, [slide[0], residual(fit, *slide)], look);
            }
        }
        let text = format!(
            "Circles: {} of known speed. Lines: {} fitted to their durations by least squares.",
            if slides.len() == 1 { "1 slide".to_owned() } else { format!("{} slides", slides.len()) },
            if fits.len() == 1 { "the law" } else { "the laws" },
        );
        let height = caption(&mut drawing, bottom + 42.0, &text);
        drawing.finish(height)
    }
}
