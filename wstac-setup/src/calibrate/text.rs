//! A calibration for a person.

use std::fmt;

use wstac_host::json::with_deviation;

use super::{Calibration, PressedReadout};

/// The advice about a calibration whose light is too weak ([`Calibration::is_dim`]).
pub const DIM: &str = "no row or column reached [speed] threshold, so law = \"published\" would give no speeds: use a \
                       longer exposure or press harder";

impl fmt::Display for PressedReadout {
    /// Writes `20.1 ± 0.3 ms by 2 presses and their releases`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let releases = if self.presses == 1 { "its release" } else { "their releases" };
        let presses = if self.presses == 1 { "1 press".to_owned() } else { format!("{} presses", self.presses) };
        // Avoids "-0.0".
        let ms = (10.0 * self.ms).round() / 10.0 + 0.0;
        write!(f, "{} ms by {presses} and {releases}", with_deviation(ms, self.sd_ms as f32))
    }
}

impl fmt::Display for Calibration {
    /// Writes three or four lines: the whiskers, their lattice, those at full scale, the taxels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [right, down] = self.pitch;
        let [width, height] = self.layout.taxel();
        match self.dead {
            Some(taxel) => writeln!(
                f,
                "24 whiskers found; the one in {} gave no light, and its place follows from the others",
                super::named(taxel)
            )?,
            None => writeln!(f, "25 whiskers found")?,
        }
        // Avoids "-0.0".
        let turned = (10.0 * self.rotation_degrees).round() / 10.0 + 0.0;
        writeln!(
            f,
            "{right:.1} pixels apart across, {down:.1} down, turned by {turned:.1} degrees, {:.2} pixels off a smooth lattice",
            self.off
        )?;
        if self.saturated > 0 {
            writeln!(f, "{} of them reached full scale: use a shorter exposure or a lower gain", self.saturated)?;
        }
        let noise = &self.noise;
        write!(f, "taxels of {width} x {height} pixels; untouched {:.2} gray levels, noise ", noise.dark_levels)?;
        // A compressed video may repeat its untouched frames.
        if noise.levels < 0.0001 { write!(f, "below 0.0001") } else { write!(f, "{:.4}", noise.levels) }?;
        self.readout.map_or(Ok(()), |readout| write!(f, "\nthe readout is {readout}"))
    }
}
