//! `wstac scene strain` prints the strain along one whisker.

use std::ffi::OsString;
use std::io::Write;

use super::super::output::{Stop, Visible, stdout};
use super::named;
use wstac_host::source::open::OpenOptions;
use wstac_scene::along::strain_along;
use wstac_scene::source::script;

/// Print the strain of the middle whisker during the first slide
///
/// The table has the strain of the whisker's surface at even distances from its base (0 mm) to its tip, at even
/// moments of the pass. Figure 2c of the publication is a sphere of 0.5 mm at 0.1 m/s: set specimen = "Sphere", speed
/// = 100, and overlap_mm = 0.4 under [whisker].
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Saw3@150, or FILE.toml
    scene: OsString,

    /// Number of rows: moments of the pass
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    moments: u16,

    /// Number of columns: parts of the whisker
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    parts: u16,

    /// Print comma-separated values
    #[arg(long)]
    csv: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let script = script(named(&arguments.scene), &OpenOptions::default())?;
    let (moments, parts) = (usize::from(arguments.moments), usize::from(arguments.parts));
    let mut out = stdout();
    let row = |out: &mut Visible<std::io::StdoutLock<'_>>, cells: Vec<String>| {
        if arguments.csv {
            return writeln!(out, "{}", cells.join(","));
        }
        for cell in cells {
            write!(out, "{cell:>11}")?;
        }
        writeln!(out)
    };
    let places = (0..=parts).map(|part| script.whisker.length_mm * part as f64 / parts as f64);
    let heads = ["time_ms", "overlap_mm", "aside_mm"].map(str::to_owned);
    row(&mut out, heads.into_iter().chain(places.map(|place| format!("{place:.2}_mm"))).collect())?;
    for moment in strain_along(&script, moments, parts) {
        let time_ms = moment.time_s * 1e3;
        let first =
            [format!("{time_ms:.2}"), format!("{:.3}", moment.overlap_mm), format!("{:.3}", moment.deflection_mm)];
        // Rounding may leave a strain of −0.
        let strains = moment.strain.iter().map(|strain| format!("{:.4}", strain.max(0.0)));
        row(&mut out, first.into_iter().chain(strains).collect())?;
    }
    if !arguments.csv {
        // The peak is searched over more moments than the table has rows.
        const MOMENTS: usize = 2000;
        let mut peak = (0.0, 0.0, 0.0);
        for moment in strain_along(&script, MOMENTS, parts) {
            for (part, &strain) in moment.strain.iter().enumerate() {
                if strain > peak.0 {
                    peak = (strain, moment.time_s * 1e3, script.whisker.length_mm * part as f64 / parts as f64);
                }
            }
        }
        let (strain, time_ms, place) = peak;
        let base = if place > 0.0 { "" } else { ", the base" };
        writeln!(out, "peak strain {strain:.4} at {place:.2} mm{base}, after {time_ms:.2} ms")?;
    }
    Ok(())
}
