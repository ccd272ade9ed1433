//! The arrays of a data set.

use std::io::{self, Seek, Write};

use wstac_core::model::file::Input;

use super::npz::{Npz, SCALE};
use super::sweep::Sweep;
use super::{Facts, Outcome, Sample};
use wstac_scene::specimen::{Pattern, Specimen};
use wstac_scene::{Slide, Touch};

/// Writes the samples among the outcomes of slides of these numbers with their labels, in the order of the outcomes.
///
/// Every array has an element for each sample, except `scale` and `fps`, which have no dimension.
///
/// # Errors
/// The file cannot be written.
pub fn write(file: impl Write + Seek, sweep: &Sweep, outcomes: &[(u32, Outcome)]) -> io::Result<()> {
    let samples: Vec<(u32, &Sample, Facts)> = outcomes
        .iter()
        .filter_map(|(number, outcome)| match outcome {
            Outcome::Sample(sample, facts) => Some((*number, &**sample, *facts)),
            Outcome::NoEvent | Outcome::Incomplete => None,
        })
        .collect();
    let slides = || samples.iter().map(|&(number, ..)| sweep.slide(number));
    let mut npz = Npz::new(file);
    npz.samples("X", samples.iter().map(|(_, sample, _)| sample.as_flattened()))?;
    npz.number("scale", SCALE)?;
    npz.strings("y_specimen", slides().map(|(slide, _)| name(&slide.specimen)))?;
    npz.strings("y_pattern", slides().map(|(slide, _)| slide.specimen.pattern.name().into()))?;
    // All specimens count, even those without samples: the same sweep gives the same types.
    let are_whole = sweep.specimens().iter().all(|specimen| specimen.depth_mm.fract() == 0.0);
    npz.whole_numbers("y_depth", are_whole, slides().map(|(slide, _)| slide.specimen.depth_mm))?;
    npz.numbers("speed", slides().map(|(slide, _)| slide.speed_mm_s))?;
    let are_whole = sweep.directions_deg().iter().all(|degrees| degrees.fract() == 0.0);
    npz.whole_numbers("direction", are_whole, slides().map(|(slide, _)| slide.direction_deg))?;
    npz.numbers("seed", slides().map(|(_, seed)| seed))?;
    npz.numbers("reliable", samples.iter().map(|(.., facts)| facts.reliable))?;
    npz.numbers("duration", samples.iter().map(|(.., facts)| facts.duration.map_or(-1, i64::from)))?;
    npz.strings("source", slides().map(|(slide, seed)| source(&slide, seed)))?;
    npz.number("fps", sweep.rate().per_second())?;
    npz.finish().map(drop)
}

/// Returns the name of the array that holds the samples for a model.
pub fn array_of(input: Input) -> &'static str {
    match input {
        Input::Path => "X_path",
        Input::TaxelPath => "X_taxel_path",
        Input::Taxels => "X_taxels",
        _ => "X",
    }
}

/// Returns only the name of a specimen, whatever else is unusual: `Saw3`, `Saw3.5`, `Sphere`, `Rod`.
pub fn name(specimen: &Specimen) -> String {
    if let Some(name) = specimen.round_name() {
        return name.into();
    }
    match specimen.pattern {
        Pattern::Sphere => specimen.pattern.name().into(),
        pattern => format!("{}{}", pattern.name(), specimen.depth_mm),
    }
}

/// Describes the origin of a sample for a person.
fn source(slide: &Slide, seed: u64) -> String {
    format!("scene: {}, seed {seed}", Touch::Slide(*slide))
}
