//! Several sensors in one recording, each with its own topics.

use std::fs::File;
use std::path::Path;
use std::time::Duration;

use super::about::{About, MOST_SENSORS, of_sensors};
use super::compression::Compression;
use super::recorder::{Recorder, description, stored_bytes};
use super::turns::turns;
use super::writer::{self, Order, Writing, Written, discard};
use crate::error::{Error, ErrorKind};
use crate::session::Processor;

/// How long a camera that gives no frames holds up the others.
const PATIENCE: Duration = Duration::from_secs(1);

/// A sensor of a recording of several.
#[derive(Clone, Copy)]
pub struct RecordedSensor<'a> {
    /// Its name, which starts its topics.
    pub name: &'a str,
    /// The description of its recording.
    pub about: &'a About,
    /// What reads its stream.
    pub processor: &'a Processor,
}

/// A recording of several sensors.
///
/// Frames are in the order of their times, whatever sensor they are of.
///
/// Sensors of files and scenes take turns ([`Recorder::wait_for_turn`]). Then the same sources make the same recording, and
/// one that ends for all of them ([`Recorder::end_all`]) ends at the same place. Cameras do not wait for each other: one that
/// gives no frames holds up the file for at most a second, and then its own come later.
pub struct SharedRecording {
    writing: Writing,
}

impl SharedRecording {
    /// The most sensors of a recording.
    pub const MOST_SENSORS: usize = MOST_SENSORS;

    /// Starts a recording in a file that is empty. Returns the recorder of each sensor, which may be used by a thread of
    /// its own.
    ///
    /// A file whose recording cannot be started is removed.
    ///
    /// # Errors
    /// The recording cannot be started, there are too many sensors, or their times are not of one clock.
    pub fn start(
        file: File,
        path: &Path,
        sensors: &[RecordedSensor<'_>],
        compression: Compression,
    ) -> Result<(Self, Vec<Recorder>), Error> {
        let same = file.try_clone().map_err(|error| Error::io(path.display(), error))?;
        Self::begin(file, path, sensors, compression).inspect_err(|_| discard(&same, path))
    }

    fn begin(
        file: File,
        path: &Path,
        sensors: &[RecordedSensor<'_>],
        compression: Compression,
    ) -> Result<(Self, Vec<Recorder>), Error> {
        compression.check(&path.display())?;
        check(path, sensors)?;
        let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name).collect();
        let names = of_sensors(&names).map_err(|error| Error::with_cause(ErrorKind::Config, path.display(), error))?;
        let mut metadata = vec![names];
        for RecordedSensor { name, about, processor } in sensors {
            metadata.extend(description(path, about, processor, Some(name))?);
        }
        let frame_bytes: Vec<usize> = sensors.iter().map(|sensor| stored_bytes(&sensor.about.info)).collect();
        // A file or a scene is waited for, so that the same sources make the same recording.
        let is_any_live = sensors.iter().any(|sensor| sensor.about.info.is_live());
        let order = if is_any_live { Order::Time(PATIENCE) } else { Order::Given };
        let (outboxes, writing) = writer::start(file, path, metadata, (&frame_bytes, order), compression)?;
        let mut turns = if is_any_live { Vec::new() } else { turns(sensors.len()) }.into_iter();
        let recorders = sensors.iter().zip(outboxes).zip(0_u8..);
        let recorders =
            recorders.map(|((sensor, outbox), at)| Recorder::of_sensor(at, sensor.about, (outbox, turns.next()), None));
        let recorders = recorders.collect();
        Ok((Self { writing }, recorders))
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
    Ok(())
}
