//! Panel d: the speed law, and the event's place on it.

use wstac_core::paper::speed::Law;
use wstac_core::params::SAMPLE_FRAMES;

use wstac_host::json::rounded;

use super::event::Found;
use crate::axes::{Axes, Span, number};
use crate::style::{GRAY, INK, ORDERED, SIZE, THICK, THIN};
use crate::svg::{Anchor, Drawing, Look, Marker};
use crate::text::width_of;

/// Speeds that are drawn, in mm/s, unless the event is beyond them.
const SPEEDS: [f64; 2] = [50.0, 400.0];
/// Number of points on the curve.
const STEPS: u32 = 80;

/// Returns the duration of a slide of this speed, in frames at 30 per second.
fn frames(law: Law, mm_s: f64) -> f64 {
    f64::from(law.intercept) - f64::from(law.slope) * mm_s.log10()
}

/// Returns the event's duration at 30 frames per second and its speed, and whether it is only a bound.
fn point(found: &Found) -> Option<(f64, f64, bool)> {
    let duration = f64::from(found.record.lit_span?.frames()) * found.nominal_frames;
    let bound = found.record.speed_at_most.map(|speed| (duration, rounded(speed.mm_s), true));
    found.record.speed.ok().map(|speed| (duration, rounded(speed.mm_s), false)).or(bound)
}

/// Draws the curve, thick in the range of its fit, and the event on it.
pub(super) fn draw(drawing: &mut Drawing, found: &Found, law: Law, [left, top]: [f64; 2], size: [f64; 2]) {
    let point = point(found);
    let [slowest, fastest] = SPEEDS;
    let shown = point.map_or(SPEEDS, |(_, mm_s, _)| [slowest.min(mm_s / 1.5), fastest.max(mm_s * 1.5)]);
    let longest = point.map_or(0.0, |(duration, ..)| 1.1 * duration).max(SAMPLE_FRAMES as f64);
    let panel = Axes::new([left, top], size, Span::log(shown), Span::linear([0.0, longest]));
    let mut curve = |range: [f64; 2], width: f64| {
        let [low, high] = range.map(f64::log10);
        let steps = (0..=STEPS).map(|step| low + (high - low) * f64::from(step) / f64::from(STEPS));
        let inside = steps.map(|log| 10_f64.powf(log)).filter(|mm_s| panel.y.contains(frames(law, *mm_s)));
        let points: Vec<_> = inside.map(|mm_s| panel.at([mm_s, frames(law, mm_s)])).collect();
        drawing.line(&points, INK, width);
    };
    curve(shown, THIN);
    curve(found.fitted.map(f64::from), 2.0 * THICK);
    match point {
        Some((duration, mm_s, is_bound)) => {
            let [x, y] = panel.at([mm_s, duration]);
            drawing.dashed(&[[left, y], [x, y], [x, panel.bottom()]], GRAY, THIN, [2.0, 1.6]);
            drawing.marker([x, y], Look { marker: Marker::Circle, color: ORDERED[2], filled: !is_bound });
            let text = format!(
                "{}{} mm/s",
                if is_bound { "\u{2264} " } else { "" },
                number(mm_s, if mm_s < 10.0 { 0.1 } else { 1.0 })
            );
            // Above the falling curve, on the side that has room.
            let width = width_of(&text, SIZE);
            let [at, anchor] =
                if x + 6.0 + width < panel.right() { [x + 6.0, 0.0] } else { [panel.right() - 3.0, 1.0] };
            let anchor = if anchor > 0.0 { Anchor::End } else { Anchor::Start };
            drawing.text([at, (y - 6.0).max(top + SIZE + 1.0)], SIZE, anchor, &text);
        }
        None => drawing.text([panel.right() - 4.0, top + SIZE + 3.0], SIZE, Anchor::End, "no speed"),
    }
    panel.draw(drawing, ["d  Speed law", "speed (mm/s)", "frames lit, at 30 per second"]);
}
