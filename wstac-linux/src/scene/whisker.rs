//! A whisker: a cantilever on the dome, bent by what it overlaps.

use libm::{asin, cos, sin, sqrt};
use wstac_core::direction::Heading;
use wstac_core::params::{COLUMNS, ROWS, TAXELS};

use super::beam::{Beam, CurvatureTable};

/// Length in mm (paper).
pub const LENGTH_MM: f64 = 5.0;
/// Diameter in mm (paper).
pub const DIAMETER_MM: f64 = 1.0;
/// Distance between the bases of neighbours in mm (a guess: the paper does not say).
pub const PITCH_MM: f64 = 4.0;
/// Opening angle of the dome's cap that carries the whiskers, corner to corner, in degrees (paper: 30°; that it
/// is measured so is a guess).
pub const DOME_DEGREES: f64 = 30.0;

/// The overlap that a whisker is bent by at most, as a share of its length: the linear beam says nothing beyond.
const MOST_OVERLAP: f64 = 0.6;

/// Where a whisker stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Whisker {
    /// To the right of the middle, in mm.
    pub x: f64,
    /// Above the middle as the camera's picture shows it, in mm.
    pub y: f64,
    /// How much lower than the middle whisker's the tip is, because of the dome, in mm.
    pub lowered: f64,
}

impl Whisker {
    /// Position along a slide's way, in mm from the middle.
    pub fn along(&self, heading: Heading) -> f64 {
        match heading {
            Heading::Right => self.x,
            Heading::Up => self.y,
            Heading::Left => -self.x,
            Heading::Down => -self.y,
        }
    }
}

/// The 25 whiskers in the order of the taxels: row by row, top to bottom.
pub fn whiskers() -> [Whisker; TAXELS] {
    // The cap's rim goes through the corner whiskers: its radius follows from pitch and angle.
    let half = DOME_DEGREES / 2.0 * core::f64::consts::PI / 180.0;
    let corner = PITCH_MM * (COLUMNS / 2) as f64 * core::f64::consts::SQRT_2;
    let radius = corner / sin(half);
    core::array::from_fn(|k| {
        let x = PITCH_MM * ((k % COLUMNS) as f64 - (COLUMNS / 2) as f64);
        let y = PITCH_MM * ((ROWS / 2) as f64 - (k / COLUMNS) as f64);
        let lowered = radius * (1.0 - cos(asin(sqrt(x * x + y * y) / radius)));
        Whisker { x, y, lowered }
    })
}

/// Strain at a whisker's base by how far a surface overlaps its tip.
#[derive(Clone, Debug)]
pub enum BaseStrain {
    /// Of the linear beam: a formula.
    Linear,
    /// Of the elastica: a table.
    Elastica(CurvatureTable),
}

impl BaseStrain {
    /// For whiskers that bend so.
    pub fn new(beam: Beam) -> Self {
        match beam {
            Beam::Linear => Self::Linear,
            Beam::Elastica => Self::Elastica(CurvatureTable::new()),
        }
    }

    /// Strain at an overlap in mm; 0 where there is none.
    pub fn at(&self, overlap: f64) -> f64 {
        match self {
            Self::Linear => linear_strain(overlap),
            Self::Elastica(table) if overlap > 0.0 => {
                DIAMETER_MM / 2.0 / LENGTH_MM * table.curvature(overlap / LENGTH_MM)
            }
            Self::Elastica(_) => 0.0,
        }
    }
}

/// Strain at the base of a whisker whose tip a surface overlaps by `overlap` mm; 0 where it does not.
///
/// The tip gives way sideways until the projection is `overlap` shorter; the strain is that of the base's surface, d/2
/// off the axis.
fn linear_strain(overlap: f64) -> f64 {
    if overlap.is_nan() || overlap <= 0.0 {
        return 0.0;
    }
    DIAMETER_MM / 2.0 / LENGTH_MM * Beam::Linear.shortened((overlap / LENGTH_MM).min(MOST_OVERLAP)).curvature
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_are_lowest_and_the_middle_is_not_lowered() {
        let whiskers = whiskers();
        assert_eq!(whiskers[12], Whisker::default());
        assert_eq!((whiskers[0].x, whiskers[0].y), (-8.0, 8.0));
        for corner in [0, 4, 20, 24] {
            // (1 − cos 15°) / sin 15° = tan 7.5° of the half diagonal.
            assert!((whiskers[corner].lowered - 8.0 * core::f64::consts::SQRT_2 * 0.131_652_5).abs() < 1e-6);
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "exact by construction")]
    fn strain_grows_with_the_root_of_the_overlap() {
        assert_eq!(linear_strain(-1.0), 0.0);
        assert_eq!(linear_strain(f64::NAN), 0.0);
        assert!((linear_strain(2.0) / linear_strain(0.5) - 2.0).abs() < 1e-12);
        assert!((linear_strain(0.6 * 5.0) - 0.3).abs() < 1e-12);
        assert_eq!(linear_strain(4.0), linear_strain(3.0));
    }

    #[test]
    fn the_elastica_strains_more_than_the_linear_beam_and_as_much_where_it_bends_little() {
        let (linear, elastica) = (BaseStrain::new(Beam::Linear), BaseStrain::new(Beam::Elastica));
        assert!((elastica.at(0.001) / linear.at(0.001) - 1.0).abs() < 1e-3);
        // Bent far, a projection that is 60 % shorter takes more than the small slopes of the linear beam make of it.
        assert!(elastica.at(3.0) > 1.3 * linear.at(3.0) && elastica.at(3.0) < 2.0 * linear.at(3.0));
        assert!(elastica.at(-1.0).abs() < 1e-12 && elastica.at(f64::NAN).abs() < 1e-12);
        assert!(elastica.at(1e9).is_finite());
    }
}
