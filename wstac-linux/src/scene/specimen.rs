//! The ten specimens: blocks with a textured top (paper, table 2).

use std::fmt;
use std::str::FromStr;

use libm::{fabs, fmod, sin};

/// Length of a block along its slide, in mm: with the whiskers' span of 16 mm and the afterglow it gives the paper's
/// speed law (SPEC §8, calibration), and it holds a whole number of every period.
pub const LENGTH_MM: f64 = 96.0;
/// Length of the bevel at either end, in mm (a guess).
pub const BEVEL_LENGTH_MM: f64 = 1.0;
/// How far the bevel goes down, in mm: below every tip.
pub const BEVEL_DEPTH_MM: f64 = 3.0;

/// Shape of a block's top.
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
}

impl Pattern {
    /// The paper's name: Fla, Sin, Saw or Tri.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "Fla",
            Self::Sinc => "Sin",
            Self::Saw => "Saw",
            Self::Tri => "Tri",
        }
    }
}

/// One of the ten specimens; written `Fla0`, `Sin2`, `Saw3`, `Tri4` …
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Specimen {
    pattern: Pattern,
    depth_mm: u8,
}

impl Specimen {
    /// All ten, in the paper's order.
    pub const ALL: [Self; 10] = {
        const fn of(pattern: Pattern, depth_mm: u8) -> Specimen {
            Specimen { pattern, depth_mm }
        }
        [
            of(Pattern::Flat, 0),
            of(Pattern::Sinc, 2),
            of(Pattern::Sinc, 3),
            of(Pattern::Sinc, 4),
            of(Pattern::Saw, 2),
            of(Pattern::Saw, 3),
            of(Pattern::Saw, 4),
            of(Pattern::Tri, 2),
            of(Pattern::Tri, 3),
            of(Pattern::Tri, 4),
        ]
    };

    /// Shape of its top.
    pub fn pattern(self) -> Pattern {
        self.pattern
    }

    /// From crest to valley, in mm: 0, 2, 3 or 4. The period is twice that (paper).
    pub fn depth_mm(self) -> u8 {
        self.depth_mm
    }

    /// How far below the crests the surface is, in mm, `at` mm behind the block's leading end; infinitely far beyond
    /// its ends.
    pub fn drop_mm(self, at: f64) -> f64 {
        let inside = at.min(LENGTH_MM - at);
        if inside.is_nan() || inside < 0.0 {
            return f64::INFINITY;
        }
        let bevel = (1.0 - inside / BEVEL_LENGTH_MM) * BEVEL_DEPTH_MM;
        bevel.max(self.texture_mm(at))
    }

    /// The texture below its crests, endless. Blocks begin and end on a crest where the pattern has two sides;
    /// a sawtooth begins in its valley and ends on its crest.
    fn texture_mm(self, at: f64) -> f64 {
        let depth = f64::from(self.depth_mm);
        // 0 to below 1 within a period; only reached with a depth above 0.
        let phase = || fmod(at, 2.0 * depth) / (2.0 * depth);
        match self.pattern {
            Pattern::Flat => 0.0,
            Pattern::Sinc => {
                // The period is four of sinc's half widths: zeros at a quarter, a half and three quarters of it.
                let from_crest = fabs(phase() - libm::round(phase()));
                let x = 4.0 * core::f64::consts::PI * from_crest;
                let sinc = if x == 0.0 { 1.0 } else { sin(x) / x };
                depth * (1.0 - fabs(sinc))
            }
            Pattern::Saw => depth * (1.0 - phase()),
            Pattern::Tri => depth * (1.0 - fabs(1.0 - 2.0 * phase())),
        }
    }
}

impl fmt::Display for Specimen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.pattern.name(), self.depth_mm)
    }
}

impl FromStr for Specimen {
    type Err = String;

    /// The specimen of this name; says what was found and what was expected otherwise.
    fn from_str(name: &str) -> Result<Self, String> {
        let named = |specimen: &&Self| specimen.to_string() == name;
        let unknown = || format!("specimen is {name:?}, expected Fla0, or Sin, Saw or Tri followed by 2, 3 or 4");
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
        for wrong in ["", "Fla", "Fla2", "Saw5", "saw3", "Tri33"] {
            let message = wrong.parse::<Specimen>().unwrap_err();
            assert!(message.contains(&format!("{wrong:?}")), "{message}");
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "exact by construction")]
    fn textures_go_from_crest_to_valley_within_a_period() {
        for specimen in &Specimen::ALL[1..] {
            let depth = f64::from(specimen.depth_mm());
            let drops = || (0..=2000).map(|k| specimen.texture_mm(f64::from(k) * 1e-3 * 2.0 * depth));
            let highest = drops().fold(f64::INFINITY, f64::min);
            let lowest = drops().fold(0.0, f64::max);
            assert!(highest < 0.01 && lowest > depth - 0.01 && lowest <= depth, "{specimen}");
            assert_eq!(fmod(LENGTH_MM, 2.0 * depth), 0.0, "{specimen}");
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "exact by construction")]
    fn nothing_is_beyond_the_ends() {
        for at in [-1e-9, LENGTH_MM + 1e-9, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(Specimen::ALL[0].drop_mm(at), f64::INFINITY);
        }
        assert_eq!(Specimen::ALL[0].drop_mm(0.0), BEVEL_DEPTH_MM);
        assert_eq!(Specimen::ALL[0].drop_mm(LENGTH_MM / 2.0), 0.0);
    }
}
