//! Panel d: when the light reaches each taxel, over the taxel's place along the motion.

use wstac_core::params::COLUMNS;
use wstac_core::rate::FrameRate;

use super::arrival::arrivals;
use super::event::Found;
use crate::axes::{Axes, Span, extent, number};
use crate::style::{INK, ORDERED, SIZE, THICK};
use crate::svg::{Anchor, Drawing, Look, Marker};

/// Whiskers from the middle to the corner, along a diagonal, in pitches.
const REACH: f64 = 3.0;

/// Largest fraction by which the way of the centroids may differ from the event's speed.
const MOST_OFF: f64 = 0.3;

/// Why the panel has no points.
enum Empty {
    NoSpeed,
    NoDirection,
    /// The centroids do not move as speed and direction say, such as those of light that was there before the motion.
    OtherLight,
}

/// Returns the speed, the place along the motion and the centroid of each taxel, and frames per mm.
fn points(found: &Found) -> Result<(f64, Vec<[f64; 2]>, f64), Empty> {
    let speed = found.record.speed.map_err(|_| Empty::NoSpeed)?;
    let degrees = found.record.direction.degrees.map_err(|_| Empty::NoDirection)?;
    let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
    // Columns count to the right, rows downwards.
    let place = |taxel: usize| {
        let [x, y] = [(taxel % COLUMNS) as f64 - 2.0, 2.0 - (taxel / COLUMNS) as f64];
        found.pitch_mm * (x * cosine + y * sine)
    };
    let arrivals = arrivals(found).into_iter().enumerate();
    let points: Vec<_> = arrivals.filter_map(|(taxel, arrival)| Some([place(taxel), arrival?])).collect();
    let per_mm = FrameRate::NOMINAL.per_second() / found.nominal_frames / f64::from(speed.mm_s);
    let [mm, frame] = middle(&points);
    let sum =
        |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|point| of(point[0] - mm, point[1] - frame)).sum::<f64>();
    let (across, both) = (sum(&|mm, _| mm * mm), sum(&|mm, frame| mm * frame));
    let is_followed = (both - per_mm * across).abs() <= MOST_OFF * per_mm * across;
    if is_followed { Ok((f64::from(speed.mm_s), points, per_mm)) } else { Err(Empty::OtherLight) }
}

fn middle(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len().max(1) as f64;
    points.iter().fold([0.0; 2], |sum, point| [sum[0] + point[0] / count, sum[1] + point[1] / count])
}

/// Returns what the caption says of the panel.
pub(super) fn caption(found: &Found) -> &'static str {
    match points(found) {
        Ok(_) => " d: centroids of panel c along the motion, and the line of the event's speed.",
        Err(Empty::NoSpeed) => " d: empty, because the event has no speed.",
        Err(Empty::NoDirection) => " d: empty, because the event has no direction.",
        Err(Empty::OtherLight) => {
            " d: empty, because the centroids of panel c do not follow the motion; light was there before it, or after."
        }
    }
}

/// Draws a point per taxel, and the straight line of the event's speed.
pub(super) fn draw(drawing: &mut Drawing, found: &Found, [left, top]: [f64; 2], size: [f64; 2]) {
    let titles = ["d  Arrival along the motion", "place along the motion (mm)", "frame of the sample"];
    let [first, last] = extent(arrivals(found).into_iter().flatten());
    let reach = REACH * found.pitch_mm;
    let frames = if first <= last { [first - 1.0, last + 1.0] } else { [0.0, 1.0] };
    let panel = Axes::new([left, top], size, Span::linear([-reach, reach]), Span::linear(frames));
    let (mm_s, points, per_mm) = match points(found) {
        Ok(points) => points,
        Err(empty) => {
            let why = match empty {
                Empty::NoSpeed => found.record.contact.map_or("no speed", |contact| contact.as_str()),
                Empty::NoDirection => "no direction",
                Empty::OtherLight => "light is not of the motion",
            };
            drawing.text([panel.right() - 4.0, top + SIZE + 3.0], SIZE, Anchor::End, why);
            panel.draw(drawing, titles);
            return;
        }
    };
    // The line of the speed through the middle of the points.
    let middle = middle(&points);
    let frame = |mm: f64| middle[1] + per_mm * (mm - middle[0]);
    // Where the line leaves the panel.
    let ends = frames.map(|frame| (middle[0] + (frame - middle[1]) / per_mm).clamp(-reach, reach));
    drawing.line(&ends.map(|mm| panel.at([mm, frame(mm).clamp(frames[0], frames[1])])), INK, THICK);
    for point in points {
        drawing.marker(panel.at(point), Look { marker: Marker::Circle, color: ORDERED[2], filled: true });
    }
    let text = format!("{} mm/s", number(mm_s, if mm_s < 10.0 { 0.1 } else { 1.0 }));
    drawing.text([left + 4.0, top + SIZE + 3.0], SIZE, Anchor::Start, &text);
    panel.draw(drawing, titles);
}
