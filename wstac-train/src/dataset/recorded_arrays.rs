//! The arrays of a data set of recordings.

use std::io::{self, Seek, Write};

use wstac_core::model::file::{INPUTS, Input};
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};

use super::arrays::{fps, numbers_of};
use super::npz::{Dtype, Npz};
use super::path::by_feature;
use super::recordings::Recording;
use crate::model::eval::array_of;

/// Writes all samples with their recordings' labels; for each recording, `tests` holds whether it is for tests.
///
/// The samples are those of one input. Along a path they are `paths`, one for each event, and zeros if it has none.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    file: impl Write + Seek,
    recordings: &[Recording],
    tests: &[bool],
    input: Input,
    paths: &[Option<&[i16; INPUTS]>],
) -> io::Result<()> {
    let all: Vec<_> = recordings
        .iter()
        .zip(tests)
        .flat_map(|(recording, &test)| recording.samples.iter().map(move |sample| (recording, test, sample)))
        .collect();
    let n = all.len();
    let mut npz = Npz::new(file);
    npz.array(array_of(input), Dtype::Int16, &[n, FEATURES, SAMPLE_FRAMES], |out| {
        if input == Input::Frames {
            return all.iter().try_for_each(|(_, _, (_, sample, _))| {
                let bytes = sample.as_flattened().iter().flat_map(|feature| feature.to_le_bytes());
                out.write_all(&bytes.collect::<Vec<u8>>())
            });
        }
        paths.iter().try_for_each(|path| out.write_all(&by_feature(path.unwrap_or(&[0; INPUTS]))))
    })?;
    let scale = 1.0 / f64::from(FEATURE_ONE);
    npz.array("scale", Dtype::Float64, &[], |out| out.write_all(&scale.to_le_bytes()))?;
    npz.strings("y_specimen", all.iter().map(|(recording, ..)| recording.specimen.clone()))?;
    npz.strings("y_pattern", all.iter().map(|(recording, ..)| recording.pattern.clone()))?;
    let depths = recordings.iter().map(|recording| recording.depth_mm);
    if depths.clone().all(|depth| depth.is_some_and(|depth| depth.fract() == 0.0)) {
        let depth = |recording: &Recording| recording.depth_mm.map_or(0, |depth| depth as i64);
        numbers_of(
            &mut npz,
            "y_depth",
            Dtype::Int64,
            all.iter().map(|(recording, ..)| depth(recording).to_le_bytes()),
        )?;
    } else {
        let depth = |recording: &Recording| recording.depth_mm.unwrap_or(f64::NAN);
        numbers_of(
            &mut npz,
            "y_depth",
            Dtype::Float64,
            all.iter().map(|(recording, ..)| depth(recording).to_le_bytes()),
        )?;
    }
    let speed = |recording: &Recording| recording.speed_mm_s.unwrap_or(f64::NAN);
    numbers_of(&mut npz, "speed", Dtype::Float64, all.iter().map(|(recording, ..)| speed(recording).to_le_bytes()))?;
    let direction = |recording: &Recording| recording.direction.map_or(-1, i64::from);
    numbers_of(
        &mut npz,
        "direction",
        Dtype::Int64,
        all.iter().map(|(recording, ..)| direction(recording).to_le_bytes()),
    )?;
    npz.array("reliable", Dtype::Bool, &[n], |out| {
        all.iter().try_for_each(|(_, _, (_, _, facts))| out.write_all(&[u8::from(facts.reliable)]))
    })?;
    let durations = all.iter().map(|(_, _, (_, _, facts))| facts.duration.map_or(-1, i64::from).to_le_bytes());
    numbers_of(&mut npz, "duration", Dtype::Int64, durations)?;
    npz.strings("recording", all.iter().map(|(recording, ..)| recording.name.clone()))?;
    if recordings.iter().all(|recording| recording.sensor.is_some()) {
        npz.strings("sensor", all.iter().map(|(recording, ..)| recording.sensor.clone().unwrap_or_default()))?;
    }
    npz.strings("split", all.iter().map(|(_, test, _)| if *test { "test" } else { "train" }.into()))?;
    npz.strings("source", all.iter().map(|(recording, _, (frame, ..))| format!("{}, frame {frame}", recording.name)))?;
    // The frames of the other recordings are as long to the percent (`comparable`).
    if let Some(first) = recordings.first() {
        fps(&mut npz, first.rate())?;
    }
    npz.finish().map(drop)
}
