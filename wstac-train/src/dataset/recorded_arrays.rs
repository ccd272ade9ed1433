//! The arrays of a data set of recordings.

use std::io::{self, Seek, Write};

use wstac_core::model::file::Input;

use super::arrays::array_of;
use super::npz::{Npz, SCALE};
use super::recordings::Recording;
use crate::model::trained::in_set_order;

/// Writes all samples with their recordings' labels; for each recording, `tests` holds whether it is for tests.
///
/// The samples are those of one input. Other than ten features they are `paths`, one for each event, and zeros if it
/// has none.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    file: impl Write + Seek,
    recordings: &[Recording],
    tests: &[bool],
    input: Input,
    paths: &[Option<&[i16]>],
) -> io::Result<()> {
    let all: Vec<_> = recordings
        .iter()
        .zip(tests)
        .flat_map(|(recording, &test)| recording.samples.iter().map(move |sample| (recording, test, sample)))
        .collect();
    let mut npz = Npz::new(file);
    if input == Input::Frames {
        npz.samples(array_of(input), all.iter().map(|(_, _, (_, sample, _))| sample.as_flattened()))?;
    } else {
        let zeros = vec![0; input.numbers()];
        npz.samples(array_of(input), paths.iter().map(|path| in_set_order(path.unwrap_or(&zeros))))?;
    }
    npz.number("scale", SCALE)?;
    npz.strings("y_specimen", all.iter().map(|(recording, ..)| recording.specimen.clone()))?;
    npz.strings("y_pattern", all.iter().map(|(recording, ..)| recording.pattern.clone()))?;
    let are_whole = recordings.iter().all(|recording| recording.depth_mm.is_some_and(|depth| depth.fract() == 0.0));
    npz.whole_numbers("y_depth", are_whole, all.iter().map(|(recording, ..)| recording.depth_mm.unwrap_or(f64::NAN)))?;
    npz.numbers("speed", all.iter().map(|(recording, ..)| recording.speed_mm_s.unwrap_or(f64::NAN)))?;
    npz.numbers("direction", all.iter().map(|(recording, ..)| recording.direction.map_or(-1, i64::from)))?;
    npz.numbers("reliable", all.iter().map(|(_, _, (_, _, facts))| facts.reliable))?;
    npz.numbers("duration", all.iter().map(|(_, _, (_, _, facts))| facts.duration.map_or(-1, i64::from)))?;
    npz.strings("recording", all.iter().map(|(recording, ..)| recording.name.clone()))?;
    if recordings.iter().all(|recording| recording.sensor.is_some()) {
        npz.strings("sensor", all.iter().map(|(recording, ..)| recording.sensor.clone().unwrap_or_default()))?;
    }
    npz.strings("split", all.iter().map(|(_, test, _)| if *test { "test" } else { "train" }.into()))?;
    npz.strings("source", all.iter().map(|(recording, _, (frame, ..))| format!("{}, frame {frame}", recording.name)))?;
    // The frames of the other recordings are as long to the percent (`comparable`).
    if let Some(first) = recordings.first() {
        npz.number("fps", first.rate().per_second())?;
    }
    npz.finish().map(drop)
}
