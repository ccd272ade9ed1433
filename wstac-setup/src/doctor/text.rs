//! A report for a person.

use std::fmt;

use wstac_host::visible::OneLine;

use super::{LevelsReport, RateReport, Report, SignalReport};

impl fmt::Display for Report {
    /// Writes about twenty lines: the numbers, then the verdict.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", OneLine(&self.source))?;
        if let Some(camera) = &self.camera {
            writeln!(f, "\n{}", camera.device)?;
        }
        writeln!(f, "\nGray levels are of 255 (full scale here: {}).", self.levels.full_scale)?;
        rate(f, &self.rate)?;
        levels(f, &self.levels)?;
        let noise = &self.noise;
        write!(f, "noise      {:.3} of a taxel's mean ({:.3} of the noisiest)", noise.taxel, noise.worst_taxel)?;
        match noise.pixel {
            Some(pixel) => writeln!(f, ", {pixel:.2} of a pixel")?,
            None => writeln!(f)?,
        }
        signal(f, &self.signal)?;
        let drift = &self.drift;
        write!(f, "drift      {:+.3} ± {:.3} levels per minute", drift.levels_per_minute, drift.error)?;
        match drift.minutes_to(self.signal.five_taxels) {
            Some(minutes) => writeln!(f, ", a trigger's worth in {minutes:.0} minutes")?,
            None => writeln!(f, ", none that shows")?,
        }
        self.controls(f)?;
        self.compression(f)?;
        write!(f, "\n{}", if self.healthy { "Nothing to change." } else { "To change:" })?;
        self.verdict.iter().try_for_each(|finding| write!(f, "\n- {}:\n  {}", OneLine(&finding.found), finding.advice))
    }
}

fn rate(f: &mut fmt::Formatter<'_>, rate: &RateReport) -> fmt::Result {
    let lost = rate.lost.values().fold(0, |all: u64, frames| all.saturating_add(*frames));
    write!(f, "rate       {} frames in {:.1} s, {lost} lost; ", rate.frames, rate.seconds)?;
    match (rate.measured, rate.jitter_ms, rate.longest_ms) {
        (Some(fps), Some(jitter), Some(longest)) => {
            writeln!(f, "{fps:.2} per second by the driver's clock")?;
            write!(f, "           (jitter {jitter:.2} ms, longest gap {longest:.1} ms); ")?;
        }
        _ => write!(f, "no timestamps; ")?,
    }
    write!(f, "stated {:.2}", rate.stated)?;
    if let Some(asked) = rate.asked {
        write!(f, ", asked {asked:.2}")?;
    }
    writeln!(f)
}

fn levels(f: &mut fmt::Formatter<'_>, levels: &LevelsReport) -> fmt::Result {
    let (mean, darkest, brightest) = (levels.mean, levels.darkest_taxel, levels.brightest_taxel);
    write!(f, "light      {mean:.2} at rest (taxels {darkest:.2} to {brightest:.2})")?;
    if let (Some(black), Some(leak)) = (levels.black, levels.leak) {
        let which = if levels.black_is_given { "as given" } else { "the darkest 1 % of pixels" };
        // Avoids "-0.00".
        let leak = (100.0 * leak).round() / 100.0 + 0.0;
        write!(f, ",\n           black {black:.2} ({which}), leak {leak:.2}")?;
    }
    if let Some(saturated) = levels.saturated {
        write!(f, ",\n           {:.3} % saturated", 100.0 * saturated)?;
    }
    writeln!(f)
}

fn signal(f: &mut fmt::Formatter<'_>, signal: &SignalReport) -> fmt::Result {
    let SignalReport { one_taxel, one_taxel_sure, five_taxels, .. } = signal;
    writeln!(f, "signal     the trigger sees {one_taxel:.2} levels in one taxel ({one_taxel_sure:.2} for sure),")?;
    writeln!(f, "           or {five_taxels:.2} in each of a line's five; the speed law {:.2}", signal.lit)?;
    match signal.noise_margin {
        Some(margin) => writeln!(
            f,
            "           noise is {margin:.1} deviations below it: {:.2} false triggers an hour",
            signal.false_triggers_per_hour
        ),
        None => writeln!(f, "           no noise at all"),
    }
}

impl Report {
    fn controls(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.camera.is_none() {
            return Ok(());
        }
        let locked: Vec<_> = self.controls.iter().filter(|control| control.locked == Some(true)).collect();
        let names: Vec<_> = locked.iter().map(|c| format!("{} {}", c.name, c.value.unwrap_or_default())).collect();
        writeln!(
            f,
            "controls   {} locked: {}",
            locked.len(),
            if names.is_empty() { "none".into() } else { names.join(", ") }
        )
    }

    fn compression(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(mjpeg) = &self.mjpeg else { return Ok(()) };
        let side = |side: &super::mjpeg::Side| {
            let pixel = side.pixel_noise.map_or_else(|| "?".to_owned(), |pixel| format!("{pixel:.2}"));
            format!("{} {:.2} ± {:.3}, pixels ± {pixel}", side.format, side.mean, side.taxel_noise)
        };
        let step = mjpeg.dc_step.map_or_else(|| "unknown".to_owned(), |step| format!("{step:.2}"));
        writeln!(f, "mjpeg      {}; {}", side(&mjpeg.raw), side(&mjpeg.jpeg))?;
        writeln!(
            f,
            "           the worst taxel is {:.2} off, a block's mean moves in steps of {step}, {} corrupt pictures",
            mjpeg.worst_taxel_off, mjpeg.corrupt
        )
    }
}
