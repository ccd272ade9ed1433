//! Writes a calibration as the text of a configuration file, with the origin of each number.

use std::fmt::Write;

use wstac_core::params::{COLUMNS, DEFAULT_FLOOR_LEVELS, DEFAULT_MARGIN, VALID_THRESHOLD};

use super::{Calibration, named};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;

impl Calibration {
    /// Returns the configuration file; `source` describes in one line what was seen.
    pub fn to_toml(&self, source: &str) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = self.write(&mut text, source);
        text
    }

    /// Returns a configuration with this calibration in it, and its text as a file.
    ///
    /// The text is [`to_toml`](Self::to_toml)'s if `config` has defaults besides. Otherwise it has all keys of
    /// `config`.
    ///
    /// # Errors
    /// The configuration cannot be written as TOML, or not be read again.
    pub fn applied_to(&self, config: &Config, source: &str) -> Result<(Config, String), Error> {
        let full = |config: &Config| {
            config.to_toml().map_err(|error| Error::with_cause(ErrorKind::Config, "configuration", error))
        };
        let text = self.to_toml(source);
        let measured = Config::parse(&text)?;
        let config = config.calibrated(&measured);
        let whole = full(&config)?;
        if whole == full(&measured)? {
            return Ok((config, text));
        }
        let source = one_line(source);
        let text = format!("# A configuration with the calibration of {source}\n{whole}");
        // A configuration that cannot be read again is not used.
        Config::parse(&text)?;
        Ok((config, text))
    }

    fn write(&self, text: &mut String, source: &str) -> std::fmt::Result {
        let (noise, frame) = (&self.noise, self.layout.frame());
        let source = one_line(source);
        writeln!(text, "# Written by wstac calibrate, of {source}")?;
        let [right, down] = self.pitch;
        writeln!(
            text,
            "# Whiskers: {right:.1} pixels apart across, {down:.1} down; the picture is turned by {:.1} degrees;",
            self.rotation_degrees
        )?;
        writeln!(text, "# their bases are {:.2} pixels off a smooth lattice (root mean square).", self.off)?;
        if let Some(dead) = self.dead {
            writeln!(
                text,
                "# The whisker in {} gave no light: its taxel is where the others say that it is.",
                named(dead)
            )?;
        }
        if self.saturated > 0 {
            writeln!(
                text,
                "# {} reached full scale: use a shorter exposure or a lower gain.",
                counted(self.saturated, "whisker")
            )?;
        }
        let [width, height] = self.layout.taxel();
        writeln!(text, "[layout]\nframe = [{}, {}] # of frames of this size alone", frame.width(), frame.height())?;
        writeln!(text, "taxel = [{width}, {height}]\ncorners = [")?;
        for row in self.layout.corners().chunks(COLUMNS) {
            let corners: Vec<String> = row.iter().map(|[x, y]| format!("[{x}, {y}]")).collect();
            writeln!(text, "    {},", corners.join(", "))?;
        }
        writeln!(text, "]\n")?;
        writeln!(
            text,
            "# Untouched, the brightest row or column has {:.2} gray levels as a mean; the noisiest",
            noise.dark_levels
        )?;
        writeln!(
            text,
            "# differs by {:.4} levels from frame to frame (standard deviation): the noise floor.",
            noise.levels
        )?;
        writeln!(text, "\n[features]")?;
        writeln!(
            text,
            "# Six deviations of the noise would be {:.3}; the default is {DEFAULT_FLOOR_LEVELS}.",
            6.0 * noise.levels
        )?;
        writeln!(text, "floor_levels = {:.1}\n", noise.floor_levels)?;
        writeln!(text, "[trigger]")?;
        writeln!(
            text,
            "# The noise of a feature is {:.4} per frame; six deviations of a window of five frames",
            noise.feature
        )?;
        writeln!(text, "# would be {:.3}; the default is {DEFAULT_MARGIN}.", 6.0 * noise.feature / 5.0_f64.sqrt())?;
        writeln!(text, "margin = {:.2}\n", noise.margin)?;
        if let Some(readout) = &self.readout {
            writeln!(text, "[sensor]\n# The camera's readout, {readout}.")?;
            writeln!(text, "readout_ms = {:.1}\n", readout.ms + 0.0)?;
        }
        writeln!(text, "[speed]")?;
        writeln!(
            text,
            "# Six deviations of a row or column would be {:.4}; the default is {VALID_THRESHOLD}.",
            6.0 * noise.sum
        )?;
        if noise.above_baseline {
            writeln!(
                text,
                "# Untouched there are {:.4} already, more than half of the default: it is measured above",
                noise.dark_sum
            )?;
            writeln!(text, "# the baseline, and less by what one gray level in five taxels is.")?;
        } else {
            writeln!(text, "# Untouched there are {:.4}, less than half of the default.", noise.dark_sum)?;
        }
        let on = if noise.above_baseline { "above_baseline" } else { "absolute" };
        writeln!(text, "threshold = {:.4}\nthreshold_on = \"{on}\"", noise.threshold)?;
        if self.is_dim() {
            writeln!(text, "# No row or column was brighter than {:.4}: too dim for speeds.", self.brightest)?;
        }
        Ok(())
    }
}

/// Returns a text without line breaks, for a comment.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
