//! Panel c: the time at which light arrives at each taxel, and the direction of the slide.

use wstac_core::params::{COLUMNS, TAXELS};

use super::event::Found;
use crate::axes::extent;
use crate::style::{GRAY, INK, PALE, SIZE, THIN, TITLE, shade};
use crate::svg::{Anchor, Drawing};

/// Side of a taxel on the page.
const SIDE: f64 = 19.0;
/// Fraction of the brightest taxel's level below which a taxel is dark.
const DARK: f64 = 0.1;
/// Fraction of a taxel's own rise from which light counts: noise over all frames would draw its centroid to the middle.
const FOOT: f64 = 0.1;

/// Returns the time at which each taxel is lit, in frames of the sample, or `None` for those that stay dark.
///
/// It is the centroid of the taxel's light.
pub(super) fn arrivals(found: &Found) -> [Option<f64>; TAXELS] {
    let lights = |taxel: usize| {
        let frames = (0_u8..).zip(&found.taxels);
        frames.filter_map(move |(frame, taxels)| Some((f64::from(frame), f64::from((*taxels)?[taxel]))))
    };
    let rise = |taxel: usize| {
        let [low, high] = extent(lights(taxel).map(|(_, light)| light));
        (low, (high - low).max(0.0))
    };
    let most = (0..TAXELS).map(|taxel| rise(taxel).1).fold(0.0, f64::max);
    let mut arrivals = [None; TAXELS];
    for (taxel, arrival) in arrivals.iter_mut().enumerate() {
        let (low, rise) = rise(taxel);
        if rise <= DARK * most || most <= 0.0 {
            continue;
        }
        let (mut sum, mut moment) = (0.0, 0.0);
        for (frame, light) in lights(taxel) {
            let above = (light - low - FOOT * rise).max(0.0);
            sum += above;
            moment += frame * above;
        }
        *arrival = (sum > 0.0).then(|| moment / sum);
    }
    arrivals
}

/// Draws the map and the arrow next to it.
pub(super) fn draw(drawing: &mut Drawing, found: &Found, [left, top]: [f64; 2]) {
    drawing.text([left, top - 18.0], TITLE, Anchor::Start, "c  Light at each taxel");
    drawing.text([left, top - 6.0], SIZE, Anchor::Start, "centroid, frames of the sample");
    let arrivals = arrivals(found);
    let [first, last] = extent(arrivals.into_iter().flatten());
    for (taxel, arrival) in arrivals.iter().enumerate() {
        let at = [left + SIDE * (taxel % COLUMNS) as f64, top + SIDE * (taxel / COLUMNS) as f64];
        let middle = [at[0] + SIDE / 2.0, at[1] + SIDE / 2.0 + 0.35 * SIZE];
        if let Some(arrival) = arrival {
            let share = if last - first < 0.5 { 0.5 } else { (arrival - first) / (last - first) };
            let (fill, ink) = shade(share);
            drawing.rectangle(at, [SIDE - 0.8, SIDE - 0.8], &fill);
            drawing.colored(middle, SIZE, Anchor::Middle, ink, &format!("{arrival:.1}"));
        } else {
            drawing.rectangle(at, [SIDE - 0.8, SIDE - 0.8], PALE);
            drawing.text(middle, SIZE, Anchor::Middle, "\u{2013}");
        }
    }
    let map = SIDE * COLUMNS as f64;
    arrow(drawing, found, [left + map + 22.0, top + map / 2.0]);
}

/// Draws the direction's arrow around this point, with its name below.
fn arrow(drawing: &mut Drawing, found: &Found, [x, y]: [f64; 2]) {
    const HALF: f64 = 16.0;
    let Ok(degrees) = found.record.direction.degrees else {
        drawing.text([x, y - 2.0], SIZE, Anchor::Middle, "direction");
        drawing.text([x, y + 8.0], SIZE, Anchor::Middle, "unclear");
        return;
    };
    let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
    // The page's y grows downwards.
    let [dx, dy] = [cosine, -sine];
    let along = |distance: f64, aside: f64| [x + dx * distance - dy * aside, y + dy * distance + dx * aside];
    drawing.line(&[along(-HALF, 0.0), along(HALF - 6.0, 0.0)], INK, 1.8);
    drawing.polygon(&[along(HALF, 0.0), along(HALF - 8.0, 4.5), along(HALF - 8.0, -4.5)], INK);
    drawing.line(&[along(-HALF, 3.0), along(-HALF, -3.0)], GRAY, THIN);
    drawing.text([x, y + HALF + 12.0], SIZE, Anchor::Middle, &format!("{}\u{b0}", degrees.round() % 360.0));
}
