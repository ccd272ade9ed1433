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
        let (noise, frame, source) = (&self.noise, self.layout.frame(), one_line(source));
        let ([right, down], turned, off) = (self.pitch, self.rotation_degrees, self.off);
        writeln!(
            text,
            "# Written by wstac calibrate, of {source}\n\
             # Whiskers: {right:.1} pixels apart across, {down:.1} down; the picture is turned by {turned:.1} degrees;\n\
             # their bases are {off:.2} pixels off a smooth lattice (root mean square)."
        )?;
        if let Some(name) = self.dead.map(named) {
            writeln!(text, "# The whisker in {name} gave no light: its taxel is where the others say that it is.")?;
        }
        if self.saturated > 0 {
            let whiskers = counted(self.saturated, "whisker");
            writeln!(text, "# {whiskers} reached full scale: use a shorter exposure or a lower gain.")?;
        }
        let [width, height] = self.layout.taxel();
        writeln!(text, "[layout]\nframe = [{}, {}] # of frames of this size alone", frame.width(), frame.height())?;
        writeln!(text, "taxel = [{width}, {height}]\ncorners = [")?;
        for row in self.layout.corners().chunks(COLUMNS) {
            let corners: Vec<String> = row.iter().map(|[x, y]| format!("[{x}, {y}]")).collect();
            writeln!(text, "    {},", corners.join(", "))?;
        }
        let (of_levels, of_feature) = (6.0 * noise.levels, 6.0 * noise.feature / 5.0_f64.sqrt());
        writeln!(
            text,
            "]\n\n\
             # Untouched, the brightest row or column has {:.2} gray levels as a mean; the noisiest\n\
             # differs by {:.4} levels from frame to frame (standard deviation): the noise floor.\n\n\
             [features]\n\
             # Six deviations of the noise would be {of_levels:.3}; the default is {DEFAULT_FLOOR_LEVELS}.\n\
             floor_levels = {:.1}\n\n\
             [trigger]\n\
             # The noise of a feature is {:.4} per frame; six deviations of a window of five frames\n\
             # would be {of_feature:.3}; the default is {DEFAULT_MARGIN}.\n\
             margin = {:.2}\n",
            noise.dark_levels, noise.levels, noise.floor_levels, noise.feature, noise.margin
        )?;
        if let Some(readout) = &self.readout {
            writeln!(text, "[sensor]\n# The camera's readout, {readout}.\nreadout_ms = {:.1}\n", readout.ms + 0.0)?;
        }
        let of_sum = 6.0 * noise.sum;
        writeln!(
            text,
            "[speed]\n# Six deviations of a row or column would be {of_sum:.4}; the default is {VALID_THRESHOLD}."
        )?;
        let (dark, threshold) = (noise.dark_sum, noise.threshold);
        let (note, on) = if noise.above_baseline {
            let why = "more than half of the default: it is measured above\n\
                       # the baseline, and less by what one gray level in five taxels is";
            (format!("{dark:.4} already, {why}"), "above_baseline")
        } else {
            (format!("{dark:.4}, less than half of the default"), "absolute")
        };
        writeln!(text, "# Untouched there are {note}.\nthreshold = {threshold:.4}\nthreshold_on = \"{on}\"")?;
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
