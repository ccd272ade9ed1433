//! Panel d: the speed law, and where on it the event is.

use wstac_core::params::SAMPLE_FRAMES;
use wstac_core::speed::Law;

use super::event::Found;
use super::panel::{GREY, Panel, SIZE, THIN, TITLE, number};
use crate::svg::{Anchor, Drawing, INK, Look, Marker, width_of};

/// Speeds that are drawn, in mm/s, where the event is not beyond them.
const SPEEDS: [f64; 2] = [50.0, 400.0];
/// Points of the curve.
const STEPS: u32 = 80;

/// Frames at 30 a second that a slide of this speed lasts.
fn frames(law: Law, mm_s: f64) -> f64 {
    match law {
        Law::Published { intercept, slope } => f64::from(intercept) - f64::from(slope) * mm_s.log10(),
        Law::Physical { track, afterglow } => 30.0 * f64::from(track) / mm_s + f64::from(afterglow),
    }
}

/// The event's duration at 30 frames a second and its speed, or the bound that it is.
fn point(found: &Found) -> Option<(f64, f64, bool)> {
    let duration = f64::from(found.record.duration_frames?) * found.nominal_frames;
    let bound = found.record.speed_at_most.map(|speed| (duration, speed.mm_s, true));
    found.record.speed.map(|speed| (duration, speed.mm_s, false)).or(bound)
}

/// Draws the curve, thick where it was fitted, and the event on it.
pub(super) fn draw(drawing: &mut Drawing, found: &Found, [left, top]: [f64; 2], size: [f64; 2]) {
    let point = point(found);
    let [slowest, fastest] = SPEEDS;
    let shown = point.map_or(SPEEDS, |(_, mm_s, _)| [slowest.min(mm_s / 1.5), fastest.max(mm_s * 1.5)]);
    let [from, to] = shown.map(f64::log10);
    let longest = point.map_or(0.0, |(duration, ..)| 1.1 * duration).max(SAMPLE_FRAMES as f64);
    let panel = Panel { left, top, size, x: [from, to], y: [0.0, longest] };
    let place = |mm_s: f64, frames: f64| [panel.across(mm_s.log10()), panel.up(frames)];
    let mut curve = |[low, high]: [f64; 2], width: f64| {
        let steps = (0..=STEPS).map(|step| low + (high - low) * f64::from(step) / f64::from(STEPS));
        let inside =
            steps.map(|log| 10_f64.powf(log)).filter(|mm_s| (0.0..=longest).contains(&frames(found.law, *mm_s)));
        let points: Vec<_> = inside.map(|mm_s| place(mm_s, frames(found.law, mm_s))).collect();
        drawing.line(&points, INK, width);
    };
    curve([from, to], THIN);
    curve(found.fitted.map(|mm_s| f64::from(mm_s).log10()), 2.2);
    match point {
        Some((duration, mm_s, is_bound)) => {
            let [x, y] = place(mm_s, duration);
            drawing.dashed(&[[left, y], [x, y], [x, panel.bottom()]], GREY, THIN, [2.0, 1.6]);
            drawing.marker([x, y], Look { marker: Marker::Circle, color: "#b12a90", filled: !is_bound });
            let digits = usize::from(mm_s < 10.0);
            let text = format!("{}{} mm/s", if is_bound { "\u{2264} " } else { "" }, number(mm_s, digits));
            // Above the falling curve, on the side that has room.
            let width = width_of(&text, SIZE);
            let [at, anchor] =
                if x + 6.0 + width < panel.right() { [x + 6.0, 0.0] } else { [panel.right() - 3.0, 1.0] };
            let anchor = if anchor > 0.0 { Anchor::End } else { Anchor::Start };
            drawing.text([at, (y - 6.0).max(top + SIZE + 1.0)], SIZE, anchor, &text);
        }
        None => drawing.text([panel.right() - 4.0, top + SIZE + 3.0], SIZE, Anchor::End, "no speed"),
    }
    panel.frame(drawing);
    let named = [1.0, 2.0, 5.0];
    let decades = (from.floor() as i32)..=(to.ceil() as i32);
    let ticks = decades.flat_map(|decade| named.map(|digit| digit * 10_f64.powi(decade)));
    let ticks = ticks.filter(|tick| (10_f64.powf(from)..=10_f64.powf(to)).contains(tick));
    // Of many decades only powers of ten have room.
    let wide = to - from > 1.6;
    let name = |tick: f64| match tick {
        tick if wide && tick.log10().fract().abs() > 1e-9 => String::new(),
        tick if tick < 1e4 => format!("{tick}"),
        tick => format!("{tick:e}"),
    };
    panel.ticks_below(drawing, &ticks.map(|tick| (tick.log10(), name(tick))).collect::<Vec<_>>());
    let step = if longest > 200.0 { 100.0 } else { 20.0 };
    let count = (longest / step).floor() as u32;
    let ticks = (0..=count).map(|tick| (f64::from(tick) * step, number(f64::from(tick) * step, 0)));
    panel.ticks_left(drawing, &ticks.collect::<Vec<_>>());
    drawing.text([left - 25.0, top - 5.0], TITLE, Anchor::Start, "d  Speed law");
    drawing.text([left + size[0] / 2.0, panel.bottom() + 22.0], SIZE, Anchor::Middle, "speed (mm/s)");
    drawing.upwards([left - 19.0, top + size[1] / 2.0], SIZE, "frames lit, at 30 a second");
}
