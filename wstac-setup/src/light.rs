//! Light above that of the first, untouched frames, and keys of `[layout]` that follow from it.

use wstac_core::green::any::Any;
use wstac_core::params::TAXELS;
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::{Frame, SourceEvent};

use crate::calibrate::UNTOUCHED;

/// Reads the light of taxels above what it was in the first 25 frames, as fractions of full scale.
#[derive(Clone, Debug)]
pub struct LightAboveDark {
    sums: TaxelSums<Any>,
    untouched: Vec<[f64; TAXELS]>,
    /// Mean of the untouched frames, and the largest and the mean standard deviation of a taxel.
    dark: [f64; TAXELS],
    noise: f64,
    mean_noise: f64,
}

impl LightAboveDark {
    /// Creates it before the first frame.
    pub fn new(geometry: FrameGeometry<Any>) -> Self {
        Self { sums: TaxelSums::new(geometry), untouched: Vec::new(), dark: [0.0; TAXELS], noise: 0.0, mean_noise: 0.0 }
    }

    #[cfg(test)]
    pub(crate) fn camera(&self) -> &FrameGeometry<Any> {
        self.sums.camera()
    }

    /// Returns the number of untouched frames so far.
    pub(crate) fn untouched(&self) -> usize {
        self.untouched.len()
    }

    /// Returns the largest standard deviation of a taxel in the untouched frames, as a fraction of full scale.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// Returns the root mean square of the taxels' standard deviations in the untouched frames, as a fraction of full
    /// scale.
    pub fn mean_noise(&self) -> f64 {
        self.mean_noise
    }

    /// Returns the mean of the untouched frames, as fractions of full scale.
    pub fn dark(&self) -> &[f64; TAXELS] {
        &self.dark
    }

    /// Returns the light of a frame behind the untouched ones.
    pub fn take(&mut self, event: &SourceEvent<'_>) -> Option<[f64; TAXELS]> {
        let sums = match event {
            SourceEvent::Frame(Frame { bytes, .. }) => self.sums.push_frame(bytes).ok()?,
            SourceEvent::Taxels(frame) => frame.sums,
            _ => return None,
        };
        let full = f64::from(self.sums.camera().pixels()) * f64::from(self.sums.camera().full_scale());
        let light = sums.map(|sum| f64::from(sum) / full);
        if self.untouched.len() < UNTOUCHED {
            self.untouched.push(light);
            if self.untouched.len() == UNTOUCHED {
                self.measure_dark();
            }
            return None;
        }
        Some(core::array::from_fn(|taxel| light[taxel] - self.dark[taxel]))
    }

    fn measure_dark(&mut self) {
        let count = self.untouched.len() as f64;
        for taxel in 0..TAXELS {
            let values = || self.untouched.iter().map(|frame| frame[taxel]);
            self.dark[taxel] = values().sum::<f64>() / count;
            let squares: f64 = values().map(|value| (value - self.dark[taxel]).powi(2)).sum();
            self.noise = self.noise.max((squares / (count - 1.0)).sqrt());
            self.mean_noise += squares / (count - 1.0) / TAXELS as f64;
        }
        self.mean_noise = self.mean_noise.sqrt();
    }
}

/// Returns the text of a configuration with these lines as a key of `[layout]`, and nothing else changed.
///
/// # Errors
/// The text cannot be changed by lines, or the configuration is refused.
pub(crate) fn with_layout_key(text: &str, key: &str, lines: &str) -> Result<String, Error> {
    use std::fmt::Write as _;
    let (mut made, mut depth, mut is_layout, mut is_written) = (String::new(), 0, false, false);
    for line in text.lines() {
        let bare = line.split('#').next().unwrap_or_default().trim();
        let is_key = is_layout && bare.split('=').next().is_some_and(|name| name.trim() == key);
        if depth > 0 || is_key {
            // The lines of the former key.
            depth += bare.matches('[').count() as i64 - bare.matches(']').count() as i64;
            continue;
        }
        let is_header = bare.starts_with('[') && bare.trim_matches('[').starts_with(char::is_alphabetic);
        is_layout = if is_header { bare == "[layout]" } else { is_layout };
        made += line;
        made.push('\n');
        if bare == "[layout]" {
            made += lines;
            is_written = true;
        }
    }
    if !is_written {
        let _ = write!(made, "\n[layout]\n{lines}");
    }
    let without = |text: &str| {
        let mut table = text.parse::<toml::Table>().ok()?;
        if let Some(layout) = table.entry("layout").or_insert_with(|| toml::Table::new().into()).as_table_mut() {
            layout.remove(key);
        }
        Some(table)
    };
    Config::parse(&made)?;
    if without(&made) != without(text) {
        let message = "cannot be changed by lines, expected a line [layout]";
        return Err(Error::new(ErrorKind::Config, "configuration", message));
    }
    Ok(made)
}
