//! Whether all lines of an axis are lit alike, as by whatever crosses the whole sensor.
//!
//! Lines are compared at the same age: a texture lights the last ones later than the first ones.

use super::light::light;
use crate::features::Features;
use crate::paper::sample::Sample;
use crate::params::FEATURES;
use crate::touch::motion::edges::LINES;

/// Frames of each line that are looked at once all lines are lit; later, one more in each frame.
const FIRST: u8 = 16;
/// Frames in which a line is looked at beyond those in which an edge passes its whiskers.
const MORE: u8 = 3;
/// Least peak of a line as a fraction of the highest of its axis, and of the line as far from the middle on the other
/// side.
const LEAST: [[i32; 2]; 2] = [[1, 2], [13, 20]];

/// The peaks of ten lines in their first frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alike {
    /// The highest feature of each line.
    peaks: Features,
    /// Frames of each line that were looked at, and those that will be: of rows and of columns.
    seen: [u8; 2],
    all: [u8; 2],
    /// Whether all lines of each axis are alike, as far as they were looked at.
    pub holds: bool,
}

impl Alike {
    /// Looks at lines that were first lit `ages` − 1 frames before the newest, by the slowness of rows and columns.
    ///
    /// An edge passes a row's whiskers with the slowness of columns.
    pub(super) fn new(
        [rows, columns]: [f32; 2],
        recent: Sample<'_>,
        ages: &[u8; FEATURES],
        base: &[i32; FEATURES],
    ) -> Self {
        let all = [columns, rows].map(|slowness| ((4.0 * slowness.abs()) as u8).saturating_add(MORE));
        let mut alike = Self { peaks: [i16::MIN; FEATURES], seen: [0; 2], all, holds: false };
        alike.look(recent, ages, base, FIRST);
        alike
    }

    /// Looks at up to `most` further frames of each line.
    #[inline(never)]
    pub(super) fn look(&mut self, recent: Sample<'_>, ages: &[u8; FEATURES], base: &[i32; FEATURES], most: u8) {
        let axes = self.peaks.as_chunks_mut::<LINES>().0.iter_mut().zip(ages.as_chunks::<LINES>().0);
        let mut is_new = false;
        for ((first, (peaks, ages)), (seen, &all)) in
            [0, LINES].into_iter().zip(axes).zip(self.seen.iter_mut().zip(&self.all))
        {
            let youngest = ages.iter().fold(all, |youngest, &age| youngest.min(age));
            let end = youngest.min(seen.saturating_add(most));
            if *seen >= end {
                continue;
            }
            for (line, (peak, &age)) in (first..).zip(peaks.iter_mut().zip(ages)) {
                // The first lit frame is `age` before the end.
                let of = |seen: u8| (recent.len() + usize::from(seen)).saturating_sub(age.into());
                let features = recent.between(of(*seen), of(end)).into_iter().flatten();
                *peak = features.filter_map(|features| features.get(line)).fold(*peak, |peak, &here| here.max(peak));
            }
            (is_new, *seen) = (true, end);
        }
        if is_new {
            let mut axes = self.peaks.as_chunks::<LINES>().0.iter().zip(base.as_chunks::<LINES>().0);
            self.holds = axes.all(|(peaks, base)| are_alike(peaks, base));
        }
    }
}

fn are_alike(peaks: &[i16; LINES], base: &[i32; LINES]) -> bool {
    let mut lights = *base;
    for (light_of, &peak) in lights.iter_mut().zip(peaks) {
        *light_of = light(peak) - *light_of;
    }
    let is_enough = |a: i32, b: i32, [part, of]: [i32; 2]| of * a.min(b) > part * a.max(b);
    let (lowest, highest) = lights.iter().fold((i32::MAX, 0), |(low, high), &one| (one.min(low), one.max(high)));
    let [a, b, _, c, d] = lights;
    is_enough(lowest, highest, LEAST[0]) && is_enough(a, d, LEAST[1]) && is_enough(b, c, LEAST[1])
}
