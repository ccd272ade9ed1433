//! Specimens: blocks with a textured top, and a sphere (paper, table 2 and figure 2c).

use std::fmt;
use std::str::FromStr;

use wstac_host::suggest::nearest;

/// Length of a block along its slide, in mm: fitted, with the afterglow, to the paper's speed law (SPEC §8).
pub const LENGTH_MM: f64 = 104.5;
/// Slope of a block's ends, in degrees (a guess; 90 is an upright side).
pub const EDGE_DEGREES: f64 = 72.0;
/// Parts of a texture's period, or of a body, in which its shape is looked up.
const PARTS: f64 = 8.0;
/// Radius of the sphere in mm (paper).
pub const RADIUS_MM: f64 = 0.5;

/// Shape of a specimen's top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Flat.
    Flat,
    /// |sinc|: in every period a main lobe between two side lobes.
    Sinc,
    /// Sawtooth: rises slowly, falls at once.
    Saw,
    /// Triangle.
    Tri,
    /// One sphere.
    Sphere,
}

impl Pattern {
    /// Returns the paper's name: Fla, Sin, Saw or Tri; or Sphere.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "Fla",
            Self::Sinc => "Sin",
            Self::Saw => "Saw",
            Self::Tri => "Tri",
            Self::Sphere => "Sphere",
        }
    }
}

/// Outline of a specimen, as seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Body {
    /// The same cut over the whole width, and sides that are parallel to the motion.
    #[default]
    Prism,
    /// A rectangle whose four sides slope as its ends do.
    Block,
    /// A rod whose axis is at right angles to its own direction.
    Rod,
    /// A ball.
    Ball,
    /// A flat disk.
    Coin,
    /// The corner of a box.
    Corner {
        /// The angle between its two edges, in degrees.
        degrees: f64,
    },
}

impl Body {
    /// Returns its name, as a scene's file has it; `None` for [`Body::Prism`].
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Prism => None,
            Self::Block => Some("block"),
            Self::Rod => Some("rod"),
            Self::Ball => Some("ball"),
            Self::Coin => Some("coin"),
            Self::Corner { .. } => Some("corner"),
        }
    }
}

/// A specimen. One of the ten of the paper is written `Fla0`, `Sin2`, `Saw3`, `Tri4` …
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    /// Shape of its top.
    pub pattern: Pattern,
    /// Height from crest to valley, in mm; for a sphere, its radius.
    pub depth_mm: f64,
    /// Length of a period of the texture, in mm.
    pub period_mm: f64,
    /// Length of the block along its slide, in mm; the diameter of a rod, ball or coin.
    pub length_mm: f64,
    /// Slope of its ends in degrees, above 0 and at most 90.
    pub edge_degrees: f64,
    /// Its width across its motion, in mm; infinite for a block that is wider than the sensor.
    pub width_mm: f64,
    /// Its outline.
    pub body: Body,
}

impl Specimen {
    /// Creates a block with a depth in mm and the paper's period, twice the depth.
    pub const fn block(pattern: Pattern, depth_mm: f64) -> Self {
        Self {
            pattern,
            depth_mm,
            period_mm: 2.0 * depth_mm,
            length_mm: LENGTH_MM,
            edge_degrees: EDGE_DEGREES,
            width_mm: f64::INFINITY,
            body: Body::Prism,
        }
    }

    /// Creates a sphere of this radius in mm.
    pub const fn sphere(radius_mm: f64) -> Self {
        let block = Self::block(Pattern::Sphere, radius_mm);
        Self { period_mm: 0.0, length_mm: 2.0 * radius_mm, edge_degrees: 90.0, ..block }
    }

    /// Creates a ball of this diameter in mm.
    pub const fn ball(diameter_mm: f64) -> Self {
        Self { length_mm: diameter_mm, body: Body::Ball, ..Self::block(Pattern::Flat, 0.0) }
    }

    /// The ten specimens of the paper, in its order.
    pub const ALL: [Self; 10] = [
        Self::block(Pattern::Flat, 0.0),
        Self::block(Pattern::Sinc, 2.0),
        Self::block(Pattern::Sinc, 3.0),
        Self::block(Pattern::Sinc, 4.0),
        Self::block(Pattern::Saw, 2.0),
        Self::block(Pattern::Saw, 3.0),
        Self::block(Pattern::Saw, 4.0),
        Self::block(Pattern::Tri, 2.0),
        Self::block(Pattern::Tri, 3.0),
        Self::block(Pattern::Tri, 4.0),
    ];

    /// Returns the length of its finest curved shape, in mm; infinite if all shapes are straight.
    pub fn finest_mm(&self) -> f64 {
        match self.pattern {
            // A lobe.
            Pattern::Sinc => self.period_mm / 4.0,
            Pattern::Sphere => self.depth_mm,
            Pattern::Flat if self.body == Body::Rod => self.length_mm / 2.0,
            Pattern::Flat | Pattern::Saw | Pattern::Tri => f64::INFINITY,
        }
    }

    /// Returns the distance in mm at which its shape must be looked up at least.
    pub(crate) fn coarsest_mm(&self) -> f64 {
        let size = self.length_mm.min(self.width_mm);
        if self.is_textured() { size.min(self.period_mm) / PARTS } else { size / PARTS }
    }

    /// Returns the radius of its round top, which is the same over its width; `None` if it has none.
    pub(crate) fn arc_mm(&self) -> Option<f64> {
        match (self.pattern, self.body) {
            (Pattern::Sphere, _) => Some(self.depth_mm),
            (_, Body::Rod) => Some(self.length_mm / 2.0),
            _ => None,
        }
    }

    /// Returns the name of a specimen whose body is its top: Rod or Ball.
    pub fn round_name(&self) -> Option<&'static str> {
        match self.body {
            Body::Rod => Some("Rod"),
            Body::Ball => Some("Ball"),
            _ => None,
        }
    }

    /// Returns `true` if its texture repeats.
    pub fn is_textured(&self) -> bool {
        matches!(self.pattern, Pattern::Sinc | Pattern::Saw | Pattern::Tri)
    }
}

impl fmt::Display for Specimen {
    /// Writes the name, and every value that differs from the paper.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, depth) = (self.pattern.name(), self.depth_mm);
        if let Some(name) = self.round_name() {
            return write!(f, "{name} of {} mm", self.length_mm);
        }
        if self.pattern == Pattern::Sphere {
            return write!(f, "{name} of radius {depth} mm");
        }
        write!(f, "{name}{depth}")?;
        let usual = Self::block(self.pattern, depth);
        let differs = |a: f64, b: f64| a.total_cmp(&b).is_ne();
        if self.is_textured() && differs(self.period_mm, usual.period_mm) {
            write!(f, ", period {} mm", self.period_mm)?;
        }
        if differs(self.length_mm, usual.length_mm) {
            write!(f, ", length {} mm", self.length_mm)?;
        }
        if differs(self.edge_degrees, usual.edge_degrees) {
            write!(f, ", edge {}°", self.edge_degrees)?;
        }
        if self.width_mm.is_finite() {
            write!(f, ", width {} mm", self.width_mm)?;
        }
        if let Body::Corner { degrees } = self.body {
            return write!(f, ", corner of {degrees}°");
        }
        if let Some(name) = self.body.name() {
            write!(f, ", {name}")?;
        }
        Ok(())
    }
}

impl FromStr for Specimen {
    type Err = String;

    /// Returns the specimen of a name; an error names the text found and the names expected.
    fn from_str(name: &str) -> Result<Self, String> {
        if name == Pattern::Sphere.name() {
            return Ok(Self::sphere(RADIUS_MM));
        }
        let named = |specimen: &&Self| specimen.to_string() == name;
        let unknown = || {
            let names = Self::ALL.map(|specimen| specimen.to_string());
            let near = nearest(name, names.iter().map(String::as_str));
            let meant = near.map_or_else(String::new, |name| format!("; did you mean {name}?"));
            format!("specimen is {name:?}, expected Fla0, or Sin, Saw or Tri followed by 2, 3 or 4, or Sphere{meant}")
        };
        Self::ALL.iter().find(named).copied().ok_or_else(unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_both_ways() {
        for specimen in Specimen::ALL {
            assert_eq!(specimen.to_string().parse(), Ok(specimen));
        }
        assert_eq!("Sphere".parse(), Ok(Specimen::sphere(0.5)));
        for wrong in ["", "Fla", "Fla2", "Saw5", "saw3", "Tri33"] {
            let message = wrong.parse::<Specimen>().unwrap_err();
            assert!(message.contains(&format!("{wrong:?}")), "{message}");
        }
    }

    #[test]
    fn what_is_unusual_is_said() {
        let saw = Specimen { period_mm: 5.0, length_mm: 40.0, ..Specimen::block(Pattern::Saw, 3.5) };
        assert_eq!(saw.to_string(), "Saw3.5, period 5 mm, length 40 mm");
        assert_eq!(Specimen::sphere(0.5).to_string(), "Sphere of radius 0.5 mm");
    }
}
