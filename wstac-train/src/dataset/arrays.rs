//! The arrays of a data set.

use std::io::{self, Seek, Write};

use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_core::rate::FrameRate;

use super::npz::{Dtype, Npz};
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
    let n = samples.len();
    let slides = || samples.iter().map(|&(number, ..)| sweep.slide(number));
    let mut npz = Npz::new(file);
    npz.array("X", Dtype::Int16, &[n, FEATURES, SAMPLE_FRAMES], |out| {
        samples.iter().try_for_each(|(_, sample, _)| {
            let bytes = sample.as_flattened().iter().flat_map(|feature| feature.to_le_bytes());
            out.write_all(&bytes.collect::<Vec<u8>>())
        })
    })?;
    let scale = 1.0 / f64::from(FEATURE_ONE);
    npz.array("scale", Dtype::Float64, &[], |out| out.write_all(&scale.to_le_bytes()))?;
    npz.strings("y_specimen", slides().map(|(slide, _)| name(&slide.specimen)))?;
    npz.strings("y_pattern", slides().map(|(slide, _)| slide.specimen.pattern.name().into()))?;
    let depths = slides().map(|(slide, _)| slide.specimen.depth_mm);
    // All specimens count, even those without samples: the same sweep gives the same types.
    if sweep.specimens().iter().all(|specimen| specimen.depth_mm.fract() == 0.0) {
        numbers_of(&mut npz, "y_depth", Dtype::Int64, depths.map(|depth| (depth as i64).to_le_bytes()))?;
    } else {
        numbers_of(&mut npz, "y_depth", Dtype::Float64, depths.map(f64::to_le_bytes))?;
    }
    numbers_of(&mut npz, "speed", Dtype::Float64, slides().map(|(slide, _)| slide.speed_mm_s.to_le_bytes()))?;
    let degrees = || slides().map(|(slide, _)| slide.direction_deg);
    if sweep.directions_deg().iter().all(|degrees| degrees.fract() == 0.0) {
        numbers_of(&mut npz, "direction", Dtype::Int64, degrees().map(|degrees| (degrees as i64).to_le_bytes()))?;
    } else {
        numbers_of(&mut npz, "direction", Dtype::Float64, degrees().map(f64::to_le_bytes))?;
    }
    numbers_of(&mut npz, "seed", Dtype::Uint64, slides().map(|(_, seed)| seed.to_le_bytes()))?;
    let facts = || samples.iter().map(|(.., facts)| facts);
    npz.array("reliable", Dtype::Bool, &[n], |out| {
        facts().try_for_each(|facts| out.write_all(&[u8::from(facts.reliable)]))
    })?;
    let durations = facts().map(|facts| facts.duration.map_or(-1, i64::from).to_le_bytes());
    numbers_of(&mut npz, "duration", Dtype::Int64, durations)?;
    npz.strings("source", slides().map(|(slide, seed)| source(&slide, seed)))?;
    fps(&mut npz, sweep.rate())?;
    npz.finish().map(drop)
}

/// Writes an array of one dimension, of numbers of 8 bytes.
pub(super) fn numbers_of(
    npz: &mut Npz<impl Write + Seek>,
    name: &str,
    dtype: Dtype,
    mut numbers: impl ExactSizeIterator<Item = [u8; 8]>,
) -> io::Result<()> {
    npz.array(name, dtype, &[numbers.len()], |out| numbers.try_for_each(|number| out.write_all(&number)))
}

/// Writes the frames per second of the camera as an array without dimension.
pub(super) fn fps(npz: &mut Npz<impl Write + Seek>, rate: FrameRate) -> io::Result<()> {
    let fps = rate.per_second();
    npz.array("fps", Dtype::Float64, &[], |out| out.write_all(&fps.to_le_bytes()))
}

/// Returns only the name of a specimen, whatever else is unusual: `Saw3`, `Saw3.5`, `Sphere`.
pub(crate) fn name(specimen: &Specimen) -> String {
    match specimen.pattern {
        Pattern::Sphere => specimen.pattern.name().into(),
        pattern => format!("{}{}", pattern.name(), specimen.depth_mm),
    }
}

/// Describes the origin of a sample for a person.
fn source(slide: &Slide, seed: u64) -> String {
    format!("scene: {}, seed {seed}", Touch::Slide(*slide))
}
