//! Whiskers: cantilevers on a dome, bent by their overlap with the specimen.

use libm::{asin, cos, sin, sqrt};
use serde::Deserialize;
use wstac_core::params::{COLUMNS, ROWS, TAXELS};

use super::beam::{Beam, BendTable};
use super::keys::{key_table, within};

key_table! {
    /// The `[whisker]` table of a scene.
    #[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct WhiskerConfig {
        /// The law by which they bend.
        pub beam: Beam = Beam::default();
        /// Length in mm (paper: 5).
        pub length_mm: f64 = 5.0, in 0.1..=100.0;
        /// Diameter in mm (paper: 1).
        pub diameter_mm: f64 = 1.0, in 0.01..=100.0;
        /// Distance between the bases of neighbors in mm (4, a guess).
        pub pitch_mm: f64 = 4.0, in 0.1..=100.0;
        /// Opening angle of the dome's cap that carries the whiskers, corner to corner, in degrees; 0 for a plane.
        ///
        /// The paper has 30; that it is measured this way is a guess.
        pub dome_degrees: f64 = 30.0, in 0.0..=170.0;
        /// Overlap of a specimen's crests with the middle whisker, in mm (3, a guess).
        pub overlap_mm: f64 = 3.0;
        /// Time in which a released whisker springs back to 1/e of its bend, in ms; 0 if it is immediate.
        ///
        /// 2 is a guess: a silicone cantilever of this size swings at about 180 Hz and is damped within a period.
        pub relaxation_ms: f64 = 2.0;
        /// The whiskers that are present.
        pub present: Present = Present::All;
    }
}

/// The whiskers that are present.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Present {
    /// All 25 whiskers.
    #[default]
    All,
    /// Only the middle whisker: the paper's figure 2c.
    Middle,
}

impl WhiskerConfig {
    /// Checks every key.
    ///
    /// # Errors
    /// A value is out of range; the message names the key, the value found and the values expected.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.check_ranges()?;
        within("overlap_mm", self.overlap_mm, 0.0, 0.95 * self.length_mm)?;
        if self.relaxation_ms != 0.0 {
            // A slide has as many pieces as relaxation times fit into it.
            within("relaxation_ms", self.relaxation_ms, 0.001, 1000.0).map_err(|message| format!("{message}, or 0"))?;
        }
        Ok(())
    }

    /// Returns the distance between the first and last whiskers, in mm.
    pub fn span_mm(&self) -> f64 {
        match self.present {
            Present::All => self.pitch_mm * (COLUMNS - 1) as f64,
            Present::Middle => 0.0,
        }
    }

    /// Returns the whiskers by taxel, row by row, top to bottom; `None` for a taxel without a whisker.
    pub fn whiskers(&self) -> [Option<Whisker>; TAXELS] {
        // The cap's rim goes through the corner whiskers: its radius follows from pitch and angle.
        let half = self.dome_degrees / 2.0 * core::f64::consts::PI / 180.0;
        let corner = self.pitch_mm * (COLUMNS / 2) as f64 * core::f64::consts::SQRT_2;
        core::array::from_fn(|taxel| {
            if self.present == Present::Middle && taxel != TAXELS / 2 {
                return None;
            }
            let x = self.pitch_mm * ((taxel % COLUMNS) as f64 - (COLUMNS / 2) as f64);
            let y = self.pitch_mm * ((ROWS / 2) as f64 - (taxel / COLUMNS) as f64);
            let radius = corner / sin(half);
            let lowered = if half > 0.0 { radius * (1.0 - cos(asin(sqrt(x * x + y * y) / radius))) } else { 0.0 };
            Some(Whisker { x, y, lowered })
        })
    }
}

/// The position of a whisker, in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Whisker {
    /// Distance to the right of the middle.
    pub x: f64,
    /// Distance above the middle in the camera's picture.
    pub y: f64,
    /// Distance of the tip below the middle whisker's, because of the dome.
    pub lowered: f64,
}

impl Whisker {
    /// Returns the position along a direction, given by the components of its unit vector, in mm from the middle.
    pub fn along(&self, right: f64, up: f64) -> f64 {
        self.x * right + self.y * up
    }
}

/// The bend of a whisker.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bent {
    /// Strain of the base's surface, d/2 off the axis.
    pub strain: f64,
    /// Load at the tip, P L² / EI.
    pub load: f64,
}

/// Computes strain and load from the overlap of a whisker's tip.
///
/// The tip moves sideways until the whisker's projection is shorter by the overlap.
#[derive(Clone, Debug)]
pub(crate) struct Bending {
    length_mm: f64,
    /// Strain of a curvature of 1 / L.
    strain: f64,
    /// The table of the elastica, or `None` for the linear beam, which needs none.
    table: Option<&'static BendTable>,
}

impl Bending {
    pub(crate) fn new(config: &WhiskerConfig) -> Self {
        Self {
            length_mm: config.length_mm,
            strain: config.diameter_mm / 2.0 / config.length_mm,
            table: (config.beam == Beam::Elastica).then(BendTable::get),
        }
    }

    /// Returns the bend at a root of the overlap, √mm ≥ 0.
    #[inline]
    pub(crate) fn at_root(&self, root: f64) -> Bent {
        let root = root / sqrt(self.length_mm);
        let [curvature, load] = match self.table {
            Some(table) => table.at(root),
            None => [sqrt(15.0) * root.min(const { MOST_ROOT }); 2],
        };
        Bent { strain: self.strain * curvature, load }
    }

    /// Returns d ln strain / d ln overlap at an overlap in mm.
    pub(crate) fn steepness(&self, overlap_mm: f64) -> f64 {
        let root = sqrt(overlap_mm.max(0.0) / self.length_mm);
        match self.table {
            Some(table) => 0.5 * table.steepness(root),
            None if root < MOST_ROOT => 0.5,
            None => 0.0,
        }
    }
}

/// The root of the linear beam's [`Beam::most_shortening`].
const MOST_ROOT: f64 = 0.774_596_669_241_483_4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_are_lowest_and_the_middle_is_not_lowered() {
        let whiskers = WhiskerConfig::default().whiskers().map(Option::unwrap);
        assert_eq!(whiskers[12], Whisker::default());
        assert_eq!((whiskers[0].x, whiskers[0].y), (-8.0, 8.0));
        for corner in [0, 4, 20, 24] {
            // (1 − cos 15°) / sin 15° = tan 7.5° of the half diagonal.
            assert!((whiskers[corner].lowered - 8.0 * core::f64::consts::SQRT_2 * 0.131_652_5).abs() < 1e-6);
        }
        let plane = WhiskerConfig { dome_degrees: 0.0, ..WhiskerConfig::default() };
        assert!(plane.whiskers().iter().all(|whisker| whisker.unwrap().lowered.abs() < 1e-12));
        let one = WhiskerConfig { present: Present::Middle, ..plane };
        assert_eq!(one.whiskers().iter().flatten().count(), 1);
        assert!(one.whiskers()[12].is_some() && one.span_mm() < 1e-12);
    }

    fn strain(beam: Beam, overlap: f64) -> f64 {
        Bending::new(&WhiskerConfig { beam, ..WhiskerConfig::default() }).at_root(sqrt(overlap)).strain
    }

    #[test]
    fn the_linear_beams_strain_grows_with_the_root_of_the_overlap() {
        assert!((MOST_ROOT * MOST_ROOT - Beam::Linear.most_shortening()).abs() < 1e-15);
        let linear = |overlap| strain(Beam::Linear, overlap);
        assert!(linear(0.0).abs() < 1e-15);
        assert!((linear(2.0) / linear(0.5) - 2.0).abs() < 1e-12);
        assert!((linear(0.6 * 5.0) - 0.3).abs() < 1e-12);
        assert!((linear(4.0) - linear(3.0)).abs() < 1e-15);
    }

    #[test]
    fn the_elastica_strains_more_than_the_linear_beam_and_as_much_where_it_bends_little() {
        assert!((strain(Beam::Elastica, 0.001) / strain(Beam::Linear, 0.001) - 1.0).abs() < 1e-3);
        // If the projection is 60 % shorter, the elastica takes more load than the small slopes of the linear beam
        // give.
        let ratio = strain(Beam::Elastica, 3.0) / strain(Beam::Linear, 3.0);
        assert!(ratio > 1.3 && ratio < 2.0, "{ratio}");
        assert!(strain(Beam::Elastica, 1e9).is_finite());
    }
}
