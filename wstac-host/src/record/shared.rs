//! Several sensors in one recording, each with its own topics.

use std::fs::File;
use std::path::Path;
use std::time::{Duration, SystemTime};

use super::about::{About, MOST_SENSORS, of_sensors};
use super::compression::Compression;
use super::ordering::turns;
use super::recorder::{Recorder, check_frame_bytes, stored_bytes};
use super::writer::{self, Writing, Written, discard};
use crate::error::{Error, ErrorKind};
use crate::session::Processor;

/// The most by which somebody sets the wall clock while a machine runs. Where the monotonic clocks of two recordings
/// show more, the machine was started in between, or there were two.
const MOST_APART: Duration = Duration::from_mins(1);

/// A sensor of a recording of several.
#[derive(Clone, Copy)]
pub struct RecordedSensor<'a> {
    /// Its name, which starts its topics. It is empty for a single sensor without a name.
    pub name: &'a str,
    /// The description of its recording.
    pub about: &'a About,
    /// The processor of its stream.
    pub processor: &'a Processor,
    /// If its source is a recording with wall-clock times: the time when the driver's clock showed 0
    /// ([`McapSource::wall_zero`](crate::source::mcap::McapSource::wall_zero)). Recordings of different starts of a
    /// machine are refused by it.
    pub wall_zero: Option<SystemTime>,
}

/// A recording of several sensors.
///
/// Sensors of files and scenes take turns in the order of their times ([`Recorder::wait_for_turn`]). Then the same
/// sources make the same recording, and one that ends for all of them ([`Recorder::end_all`]) ends at the same place.
/// Cameras do not wait for each other: their frames are in the order in which they came.
pub struct SharedRecording {
    pub(super) writing: Writing,
}

impl SharedRecording {
    /// The most sensors of a recording.
    pub const MOST_SENSORS: usize = MOST_SENSORS;

    /// Starts a recording in a file that is empty. Returns the recorder of each sensor, which may be used by a thread
    /// of its own.
    ///
    /// A file whose recording cannot be started is removed.
    ///
    /// # Errors
    /// The recording cannot be started, there are too many sensors, or their times are not of one clock: some are of a
    /// driver and some are counted, some are of now and some were recorded, or their clocks started at different times.
    pub fn start(
        file: File,
        path: &Path,
        sensors: &[RecordedSensor<'_>],
        compression: Compression,
    ) -> Result<(Self, Vec<Recorder>), Error> {
        let same = file.try_clone().map_err(|error| Error::io(path.display(), error))?;
        let begin = || -> Result<_, Error> {
            compression.check(&path.display())?;
            check(path, sensors)?;
            let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name).collect();
            let is_alone = names == [""];
            let failed = |error: serde_json::Error| Error::with_cause(ErrorKind::Config, path.display(), error);
            let mut metadata = Vec::new();
            if !is_alone {
                metadata.push(of_sensors(&names).map_err(failed)?);
            }
            for RecordedSensor { name, about, processor, .. } in sensors {
                check_frame_bytes(&path.display(), &about.info)?;
                let name = Some(*name).filter(|_| !is_alone);
                metadata.extend(about.to_metadata(processor.geometry().layout(), name).map_err(failed)?);
            }
            let frame_bytes: Vec<usize> = sensors.iter().map(|sensor| stored_bytes(&sensor.about.info)).collect();
            let (outbox, writing) = writer::start(file, path, metadata, &frame_bytes, compression)?;
            let is_any_live = sensors.iter().any(|sensor| sensor.about.info.is_live());
            let mut turns = if is_any_live || is_alone { Vec::new() } else { turns(sensors.len()) }.into_iter();
            let recorder = |(sensor, at): (&RecordedSensor<'_>, u8)| {
                Recorder::of_sensor(at, sensor.about, outbox.clone(), turns.next())
            };
            let recorders = sensors.iter().zip(0..).map(recorder).collect();
            Ok((Self { writing }, recorders))
        };
        begin().inspect_err(|_| discard(&same, path))
    }

    /// Ends the file, after all recorders have been finished.
    ///
    /// # Errors
    /// The file could not be written, or not all of it.
    pub fn finish(self) -> Result<Written, Error> {
        self.writing.finish()
    }
}

/// Refuses sensors that cannot share a recording.
fn check(path: &Path, sensors: &[RecordedSensor<'_>]) -> Result<(), Error> {
    let refused = |message: std::fmt::Arguments<'_>| Err(Error::new(ErrorKind::Usage, path.display(), message));
    if !(1..=MOST_SENSORS).contains(&sensors.len()) {
        return refused(format_args!("has {} sensors, expected 1 to {MOST_SENSORS} in a recording", sensors.len()));
    }
    let with = sensors.iter().find(|sensor| sensor.about.driver_times);
    let without = sensors.iter().find(|sensor| !sensor.about.driver_times);
    if let (Some(with), Some(without)) = (with, without) {
        return refused(format_args!(
            "{} has the times of a driver, and frames of {} are counted from 0, expected sources with one clock",
            with.name, without.name
        ));
    }
    let live = sensors.iter().find(|sensor| sensor.about.info.is_live());
    let recorded = sensors.iter().find(|sensor| sensor.about.info.recorded.is_some());
    if let (Some(live), Some(recorded), Some(_)) = (live, recorded, with) {
        return refused(format_args!(
            "{} is read now, and {} was recorded, expected cameras together, or recordings together",
            live.name, recorded.name
        ));
    }
    let mut zeros = sensors.iter().filter_map(|sensor| Some((sensor.name, sensor.wall_zero?)));
    let Some((first, zero)) = zeros.next() else { return Ok(()) };
    let apart = |other: SystemTime| other.duration_since(zero).unwrap_or_else(|before| before.duration());
    match zeros.map(|(name, other)| (name, apart(other))).find(|(_, apart)| *apart > MOST_APART) {
        Some((name, apart)) => refused(format_args!(
            "the clocks of {first} and {name} started {} s apart, expected recordings of one machine that was not started \
             again in between",
            apart.as_secs()
        )),
        None => Ok(()),
    }
}
