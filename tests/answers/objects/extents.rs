//! Tables of where and how wide a touch is, of how many objects, and of its acceleration.

use std::fmt::Write as _;

use wstac_core::touch::wave::Measured;
use wstac_host::statistics::percentile;
use wstac_scene::Slide;
use wstac_scene::specimen::Body;

use super::scenes::{HALF_MM, Kind, lit_width_mm};
use super::{Answered, WITHIN};
use crate::{bold, share};

/// Most errors of a place and of a width in mm, as medians, and least contacts that are right, in percent.
const MOST_MM: [f64; 2] = [0.4, 0.7];
const LEAST_RIGHT: f64 = 99.0;

/// Kinds in the table of places, and in that of accelerations.
const PLACED: [Kind; 6] = [Kind::Rod, Kind::Ball, Kind::Coin, Kind::Block, Kind::Corner, Kind::Fingers];
const ACCELERATED: [Kind; 3] = [Kind::Wide, Kind::Oblique, Kind::Even];

pub(super) const HEADS: [&str; 2] = [PLACES, ACCELERATIONS];
const PLACES: &str = "\
| touch | place, % of reliable | error, mm: median/p95 | within 1/2 sd, % | width, % of reliable | error, mm: median/p95 | \
within 1/2 sd, % | contacts right, % |
| --- | --- | --- | --- | --- | --- | --- | --- |";
const ACCELERATIONS: &str = "\
| touch | acceleration, % of reliable | error, % of the speed over the sensor: median/p95 | within 1/2 sd, % |
| --- | --- | --- | --- |";

/// Measured values beside what is true.
#[derive(Default)]
struct Errors {
    sizes: Vec<f64>,
    within: [usize; 2],
}

impl Errors {
    /// Adds a value. `unit` is that of the errors.
    fn add(&mut self, found: Measured, truth: f64, unit: f64) {
        let off = (f64::from(found.value) - truth).abs();
        self.sizes.push(off / unit);
        for (within, most) in self.within.iter_mut().zip([1.0, 2.0]) {
            *within += usize::from(off <= most * f64::from(found.sd));
        }
    }

    /// Returns the cells of how many of `count` touches have the value, its errors, and those within deviations. What
    /// misses its goal is bold.
    fn cells(&self, count: usize, most: Option<f64>) -> String {
        let known = self.sizes.len();
        if known == 0 {
            return "– | – | –".into();
        }
        let [median, high] = [0.5, 0.95].map(|fraction| percentile(self.sizes.clone(), fraction).unwrap_or(0.0));
        let outside = |at: usize| {
            let percent = 100.0 * self.within[at] as f64 / known as f64;
            !(WITHIN[at][0]..=WITHIN[at][1]).contains(&percent)
        };
        format!(
            "{} | {}{} | {}",
            share(known, count),
            bold(most.is_some_and(|most| median > most), format!("{median:.2}/{high:.2}")),
            most.map_or_else(String::new, |most| format!(" ≤{most}")),
            bold(outside(0) || outside(1), self.within.map(|within| share(within, known)).join("/")),
        )
    }
}

/// The slides of touches whose velocity is reliable.
fn reliable(answered: &[Answered]) -> impl Iterator<Item = (&Answered, Slide)> {
    let slide = |one: &Answered| one.drawn.script.touches[0].slide().copied();
    answered.iter().filter(|one| one.answer.is_some()).filter_map(move |one| Some((one, slide(one)?)))
}

/// Writes the rows of touches of a kind in the tables that have it.
pub(super) fn rows([places, accelerations]: &mut [String; 2], touch: &str, kind: Kind, answered: &[Answered]) {
    if PLACED.contains(&kind) {
        place_row(places, touch, answered);
    }
    if ACCELERATED.contains(&kind) {
        acceleration_row(accelerations, touch, answered);
    }
}

fn place_row(page: &mut String, touch: &str, answered: &[Answered]) {
    let [mut places, mut widths] = [(); 2].map(|()| Errors::default());
    let [mut count, mut right] = [0; 2];
    for (one, slide) in reliable(answered) {
        count += 1;
        let objects = one.drawn.script.touches.len();
        let Some(extent) = one.extent else { continue };
        right += usize::from(usize::from(extent.contacts) == objects);
        let truth = lit_width_mm(&slide);
        // A corner has a place for each of its edges, and what is wider than the sensor has none.
        if objects == 1 && truth < 3.0 * HALF_MM && !matches!(slide.specimen.body, Body::Corner { .. }) {
            if let Some(place) = extent.place_mm {
                places.add(place, slide.offset_mm, 1.0);
            }
            if let Some(width) = extent.width_mm {
                widths.add(width, truth, 1.0);
            }
        }
    }
    let is_missed = (right as f64) < LEAST_RIGHT / 100.0 * count as f64;
    let contacts = bold(is_missed, share(right, count));
    let _ = writeln!(
        page,
        "| {touch} | {} | {} | {contacts} ≥{LEAST_RIGHT} |",
        places.cells(count, Some(MOST_MM[0])),
        widths.cells(count, Some(MOST_MM[1])),
    );
}

fn acceleration_row(page: &mut String, touch: &str, answered: &[Answered]) {
    let (mut errors, mut count) = (Errors::default(), 0);
    for (one, slide) in reliable(answered) {
        count += 1;
        let Some(found) = one.acceleration else { continue };
        let [at_first, at_middle] = [0.0, HALF_MM].map(|place| slide.speed_at(place) * slide.speed_at(place));
        // The change of the speed's square is twice acceleration times path.
        errors.add(found, (at_middle - at_first) / (2.0 * HALF_MM), at_middle / (2.0 * HALF_MM) / 100.0);
    }
    let _ = writeln!(page, "| {touch} | {} |", errors.cells(count, None));
}
