//! Pin identification: a press on all whiskers, or a slide over them, yields the layout of the taxels.
//!
//! [`Watch`] takes the frames: the first 25 are untouched, then light above them is added up. [`Watch::calibrate`]
//! finds the `spots` in it, then a `lattice` of 5 × 5 bases, then a `layout`. The untouched frames with that layout
//! give the `noise`. Each of these steps fails if its result is not certain.
//!
//! The light becomes a `picture` in any case, and the rest a configuration's `file`.

mod cells;
mod file;
mod fit;
mod lattice;
mod layout;
mod noise;
mod picture;
mod plane;
mod readout;
mod spots;
mod text;
mod watch;

use wstac_core::layout::Layout;
use wstac_core::params::{COLUMNS, TAXELS};

use wstac_host::source::RowOrder;

use crate::doctor::still;

use self::cells::Cells;
use self::lattice::{Lattice, lattice};
pub use self::noise::Noise;
pub use self::readout::PressedReadout;
use self::spots::{Spot, spots};
pub use self::text::DIM;
use self::watch::Seen;
pub use self::watch::{UNTOUCHED, Watch};

/// Smallest number of frames with a touch: a whisker needs them to flash and fade.
const LEAST_FRAMES: u32 = 5;
/// Fraction of saturated cells in a spot from which its whisker counts as saturated.
const SATURATED: f64 = 0.5;
/// Largest number of whiskers that may be saturated.
const MOST_SATURATED: usize = TAXELS / 4;
/// Largest ratio of a spot's area to the usual area.
const LARGEST: f64 = 2.0;
/// Largest ratio of a spot's length to its width.
const LONGEST: f64 = 1.8;

/// The places of the whiskers, and the settings that the sensor's noise requires.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The places of the taxels.
    pub layout: Layout,
    /// The whiskers' bases in pixels of the frame, row by row; whole numbers are the middle of a pixel.
    pub centers: [[f64; 2]; TAXELS],
    /// The taxel whose whisker gave no light, if there is one: its base follows from the others.
    pub dead: Option<usize>,
    /// Root mean square distance of the bases from a smooth lattice, in pixels.
    pub off: f64,
    /// Median distances of neighbors in pixels, to the right and down.
    pub pitch: [f64; 2],
    /// Rotation of the picture in degrees, counterclockwise.
    pub rotation_degrees: f64,
    /// Number of whiskers whose brightness the camera could not measure: they reached full scale.
    pub saturated: usize,
    /// Light of the brightest row or column above the untouched picture.
    ///
    /// Each cell counts with its brightest frame, so no frame had more light. It is a fraction of full scale summed
    /// over five taxels.
    pub brightest: f64,
    /// The noise of the untouched sensor, and the settings that follow from it.
    pub noise: Noise,
    /// The readout of the camera; `None` if no press and its release told it.
    pub readout: Option<PressedReadout>,
}

impl Calibration {
    /// Returns `true` if no row or column ever reached the speed law's threshold.
    pub fn is_dim(&self) -> bool {
        let dark = if self.noise.above_baseline { 0.0 } else { self.noise.dark_sum };
        self.brightest + dark < self.noise.threshold
    }
}

/// The reason why there is no calibration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// A message with the values found and expected.
    pub message: String,
    /// Indices of the spots that seemed to be whiskers.
    lattice: Vec<usize>,
}

impl Refusal {
    fn new(message: impl std::fmt::Display) -> Self {
        Self { message: message.to_string(), lattice: Vec::new() }
    }
}

/// The result of a calibration, with the light that was seen.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The calibration, or the reason why there is none.
    pub result: Result<Calibration, Refusal>,
    seen: Seen,
    spots: Vec<Spot>,
    cells: Cells,
}

/// A spot of light, in pixels of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSpot {
    /// Its center; whole numbers are the middle of a pixel.
    pub center: [f64; 2],
    /// The radius of a circle of its area.
    pub radius: f64,
    /// Whether it seemed to be a whisker.
    pub is_whisker: bool,
}

impl LightSpot {
    fn new(spot: &Spot, cells: &Cells, is_whisker: bool) -> Self {
        let radius = (spot.area as f64 / core::f64::consts::PI).sqrt() * f64::from(cells.side);
        Self { center: cells.pixel(spot.center), radius, is_whisker }
    }
}

impl Outcome {
    /// Returns the spots of light that were seen.
    pub fn spots(&self) -> Vec<LightSpot> {
        let spot = |(number, spot): (usize, &Spot)| {
            let LightSpot { center: [x, y], radius, .. } = LightSpot::new(spot, &self.cells, false);
            let is_whisker = match &self.result {
                Ok(found) => found.centers.iter().any(|center| (center[0] - x).hypot(center[1] - y) < radius),
                Err(refusal) => refusal.lattice.contains(&number),
            };
            LightSpot { center: [x, y], radius, is_whisker }
        };
        self.spots.iter().enumerate().map(spot).collect()
    }
}

impl Watch {
    /// Returns the number of spots of light that stand out so far, for a person who waits.
    pub fn found(&self) -> usize {
        spots(&self.seen()).len()
    }

    /// Returns the spots of light that stand out so far. Which of them are whiskers is not known yet.
    pub fn spots(&self) -> Vec<LightSpot> {
        spots(&self.seen()).iter().map(|spot| LightSpot::new(spot, &self.cells, false)).collect()
    }

    /// Evaluates all frames so far.
    pub fn calibrate(&self) -> Outcome {
        let seen = self.seen();
        let spots = spots(&seen);
        let result = self.calibrated(&seen, &spots);
        Outcome { result, seen, spots, cells: self.cells }
    }

    fn calibrated(&self, seen: &Seen, spots: &[Spot]) -> Result<Calibration, Refusal> {
        self.enough(spots).map_err(Refusal::new)?;
        let lattice = lattice(spots, seen.light.size)?;
        self.measured(seen, spots, &lattice).map_err(|message| {
            let lattice = lattice.spots.iter().copied().flatten().collect();
            Refusal { message, lattice }
        })
    }

    /// Checks that there were enough frames, and any light.
    fn enough(&self, spots: &[Spot]) -> Result<(), String> {
        if !self.is_ready() || self.frames() < LEAST_FRAMES {
            let found = self.untouched.len() + self.frames() as usize;
            return Err(format!("found {found} frames, expected {UNTOUCHED} untouched ones and a touch after them"));
        }
        if let Some(change) = self.disturbed() {
            let percent = 100.0 * change;
            return Err(format!(
                "the first {UNTOUCHED} frames were not untouched: a part of the picture changed by {percent:.1} % of full scale; \
                 help: keep the light the same and wait longer before the first touch, or cut the start of a video off \
                 (ffmpeg -ss SECONDS -i clip.mp4 later.mp4)"
            ));
        }
        if spots.is_empty() {
            return Err(format!(
                "nothing glowed after the first {UNTOUCHED} frames, expected 25 whiskers: press on all of them"
            ));
        }
        Ok(())
    }

    /// Derives a calibration from a lattice, or refuses if it is not certain.
    fn measured(&self, seen: &Seen, spots: &[Spot], lattice: &Lattice) -> Result<Calibration, String> {
        let saturated = clear(spots, lattice)?;
        let centers = lattice.centers.map(|center| self.cells.pixel(center));
        let side = f64::from(self.cells.side);
        let pitch = lattice.pitch.map(|pitch| pitch * side);
        let layout = layout::layout(&self.info, &centers, pitch)?;
        let noise = Noise::measured(&self.info, layout, &self.untouched)?;
        // Of a picture that its source turns, rows are not the sensor's.
        let is_upright = self.info.row_order == RowOrder::Down;
        let (height, rate) = (self.info.size.height(), self.info.rate.per_second());
        let readout = is_upright.then(|| readout::readout(&self.taxels(&layout), &centers, height, rate)).flatten();
        Ok(Calibration {
            layout,
            centers,
            dead: lattice.spots.iter().position(Option::is_none),
            off: lattice.off * side,
            pitch,
            rotation_degrees: lattice.rotation_degrees,
            saturated,
            brightest: self.brightest(seen, &layout),
            noise,
            readout,
        })
    }

    /// Returns the light of the brightest row or column through a layout.
    fn brightest(&self, seen: &Seen, layout: &Layout) -> f64 {
        let side = self.cells.side;
        let [width, height] = layout.taxel();
        let mean = |[left, top]: [u16; 2]| {
            let cells = (top / side..(top + height) / side)
                .flat_map(|y| (left / side..(left + width) / side).map(move |x| (x, y)));
            let lights = cells.filter_map(|(x, y)| {
                let (x, y) = (usize::from(x), usize::from(y));
                Some(f64::from(seen.most.at(x, y)? - seen.dark.at(x, y)?))
            });
            still::mean(lights)
        };
        still::lines(&layout.corners().map(mean)).into_iter().fold(0.0, f64::max)
    }
}

/// Checks that each whisker's light is one round spot within the picture, and counts those that reached full scale.
fn clear(spots: &[Spot], lattice: &Lattice) -> Result<usize, String> {
    let whiskers =
        || lattice.spots.iter().enumerate().filter_map(|(taxel, &spot)| Some((named(taxel), spots.get(spot?)?)));
    let mut areas: Vec<usize> = whiskers().map(|(_, spot)| spot.area).collect();
    areas.sort_unstable();
    let usual = areas.get(areas.len() / 2).copied().unwrap_or(0) as f64;
    for (name, spot) in whiskers() {
        if spot.cut {
            return Err(format!(
                "the picture's edge cuts the light of the whisker in {name}, expected all of it inside"
            ));
        }
        let (times, stretch) = (spot.area as f64 / usual, spot.stretch);
        if times > LARGEST {
            return Err(format!(
                "the light in {name} is {times:.1} times as large as usual, expected at most {LARGEST}: it may be of two"
            ));
        }
        if stretch > LONGEST {
            return Err(format!(
                "the light in {name} is {stretch:.1} times as long as wide, expected at most {LONGEST}: it may be of two"
            ));
        }
    }
    let saturated = whiskers().filter(|(_, spot)| spot.saturated > SATURATED).count();
    if saturated > MOST_SATURATED {
        return Err(format!(
            "{saturated} whiskers reach full scale, expected at most {MOST_SATURATED}: shorten the exposure or lower the gain"
        ));
    }
    Ok(saturated)
}

/// Returns the name of a taxel in messages.
pub(crate) fn named(taxel: usize) -> String {
    format!("row {}, column {}", taxel / COLUMNS + 1, taxel % COLUMNS + 1)
}

#[cfg(test)]
mod tests;
