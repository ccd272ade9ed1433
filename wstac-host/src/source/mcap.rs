//! A recording as a source. It gives the frames, gaps and faults of the stream that was recorded, in their order.

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use serde::Deserialize;
use wstac_core::rate::FrameRate;

use super::spacing::{Positions, Spacing};
use super::{
    Fault, FaultKind, Frame, LossReason, Recorded, Source, SourceEvent, Stamp, StreamInfo, SummedFrame, replaced_rate,
};
use crate::camera::mjpeg::Decoder;
use crate::error::{Error, ErrorKind};
use crate::record::about::{self, About};
use crate::record::foxglove::{picture_of, read_taxel_sums};
use crate::record::{CLOCK, ClockLine, FAULTS, RecordingReader, Topic, check_frame_bytes, sound_metadata};

/// A line of the channel of faults.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Line {
    Lost {
        frames: u64,
        why: String,
    },
    Fault {
        fault: String,
        message: String,
    },
    #[serde(other)]
    Other,
}

/// A recording's frames.
pub struct McapSource {
    subject: String,
    reader: RecordingReader,
    about: About,
    info: StreamInfo,
    /// The frame whose part was stored.
    whole: Vec<u8>,
    decoder: Option<Decoder>,
    /// The wall-clock time when the driver's clock showed 0, and its uncertainty.
    wall: Option<(SystemTime, Duration)>,
    /// Finds gaps between the times of frames that no checksum counts.
    spacing: Spacing,
    /// The topic of the frame that `reader` has and that comes next.
    waiting: Option<Topic>,
    ended: bool,
}

impl McapSource {
    /// Opens a recording of one sensor. `fps` replaces its rate.
    ///
    /// # Errors
    /// The file cannot be read, is not whole, has several sensors, or was not recorded by this program. The error says
    /// which, and what to do.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        Self::open_sensor(path, None, fps)
    }

    /// Returns the names of the sensors of a recording; none if it is of a single one without a name.
    ///
    /// # Errors
    /// The file cannot be read, or is not whole.
    pub fn sensors(path: &Path) -> Result<Vec<String>, Error> {
        let (reader, outline) = RecordingReader::open(path)?;
        let (metadata, _) = sound_metadata(&outline.metadata);
        about::sensors(&metadata).map_err(|error| reader.damaged(error))
    }

    /// Returns the wall-clock time when the driver's clock of a recording showed 0, as it was at the first frame;
    /// `None` if the recording has no such times.
    ///
    /// # Errors
    /// The errors of [`open_sensor`](Self::open_sensor), and if what comes before the second frame is damaged.
    pub fn wall_zero(path: &Path, sensor: Option<&str>) -> Result<Option<SystemTime>, Error> {
        let mut source = Self::open_sensor(path, sensor, None)?;
        while !matches!(source.next_event()?, SourceEvent::Frame(_) | SourceEvent::Taxels(_) | SourceEvent::End) {}
        Ok(source.wall.map(|(zero, _)| zero))
    }

    /// Opens one sensor of a recording of several, or the only one. `fps` replaces its rate.
    ///
    /// # Errors
    /// The errors of [`open`](Self::open), and if there is no such sensor.
    pub fn open_sensor(path: &Path, sensor: Option<&str>, fps: Option<FrameRate>) -> Result<Self, Error> {
        let subject = path.display().to_string();
        let failed = |message: &dyn fmt::Display| Error::new(ErrorKind::Format, &subject, message);
        let (mut reader, outline) = RecordingReader::open(path)?;
        let (metadata, missing) = sound_metadata(&outline.metadata);
        if missing > 0 {
            return Err(reader.damaged("has a damaged description"));
        }
        let names = about::sensors(&metadata).map_err(|error| failed(&error))?;
        check_sensor(&subject, sensor, &names)?;
        let about = About::from_metadata(&metadata, sensor).map_err(|error| failed(&error))?;
        let expected = "is an MCAP file without the metadata of a recording, expected a file that wstac record wrote";
        let about = about.ok_or_else(|| failed(&expected))?;
        check_frame_bytes(&subject, &about.info)?;
        let mut info = about.info.clone();
        info.rate = fps.unwrap_or(info.rate);
        info.recorded = Some(Arc::new(Recorded {
            configuration: about.configuration.clone(),
            models: about.models.clone(),
            labels: about.labels.clone(),
        }));
        let of_sensor = sensor.map_or_else(String::new, |sensor| format!("sensor {sensor}, "));
        let mut replaced = replaced_rate::remark(Some(about.info.rate), fps);
        if !replaced.is_empty() {
            replaced = format!("; {} frames per second{replaced}", replaced_rate::readable(info.rate));
        }
        let is_vouched = reader.has_sums() || outline.has_crcs;
        let vouched = if is_vouched { "" } else { "; nothing vouches for its frames: they have no checksum" };
        let labels: String = about.labels.iter().map(|(name, value)| [", ", name, "=", value].concat()).collect();
        let recorded = format!("recorded from {}{labels}{replaced}{vouched}", info.about);
        info.about = format!("{subject}: {of_sensor}{recorded}");
        reader.select(names.iter().position(|name| sensor == Some(name)).unwrap_or(0) as u8);
        let step = 1000.0 / about.info.rate.per_second();
        let spacing = Spacing::new(subject.clone(), Positions::Times, step);
        let (whole, waiting) = (Vec::new(), None);
        Ok(Self { subject, reader, about, info, whole, decoder: None, wall: None, spacing, waiting, ended: false })
    }

    /// Returns what the recording says of itself.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Goes on to the next message that matters; `None` is a frame, whose message stays in `reader`.
    fn advance(&mut self) -> Result<Option<SourceEvent<'static>>, Error> {
        while let Some(topic) = self.reader.next()? {
            if topic == Topic::TaxelSums && !self.info.taxels_only {
                continue;
            }
            let Some((header, data)) = self.reader.message() else {
                return Err(self.reader.damaged("has a message without a header"));
            };
            match topic {
                Topic::FaultsJson => {
                    let line = serde_json::from_slice(data);
                    match line.map_err(|error| self.reader.damaged(format_args!("{FAULTS}: {error}")))? {
                        Line::Lost { frames, why } => {
                            self.spacing.lose(frames);
                            return Ok(Some(SourceEvent::Lost { frames, reason: LossReason::from(why.as_str()) }));
                        }
                        Line::Fault { fault, message } => {
                            let fault = Fault::from_text(FaultKind::from(fault.as_str()), &message);
                            return Ok(Some(SourceEvent::Fault(fault)));
                        }
                        Line::Other => {}
                    }
                }
                Topic::Clock => {
                    let line = serde_json::from_slice(data);
                    let line: ClockLine =
                        line.map_err(|error| self.reader.damaged(format_args!("{CLOCK}: {error}")))?;
                    let time = humantime::parse_rfc3339(&line.stamp);
                    let time = time.map_err(|error| self.reader.damaged(format_args!("{CLOCK}: {error}")))?;
                    let zero = time.checked_sub(Duration::from_nanos(line.time_ns));
                    self.wall = zero.map(|zero| (zero, Duration::from_nanos(line.within_ns)));
                }
                topic => {
                    if !self.reader.has_sums() {
                        self.spacing.arrive(header.log_time as f64 / 1e6);
                    }
                    self.waiting = Some(topic);
                    return Ok(None);
                }
            }
        }
        self.spacing.finish();
        Ok(Some(SourceEvent::End))
    }

    /// Returns the frame that `reader` has.
    fn frame(&mut self, topic: Topic) -> Result<SourceEvent<'_>, Error> {
        let Some((header, data)) = self.reader.message() else {
            return Err(self.reader.damaged(NO_PICTURE));
        };
        let of_driver = self.about.driver_times;
        let timestamp = of_driver.then(|| Duration::from_nanos(header.publish_time));
        let sequence = of_driver.then_some(header.sequence);
        let stamp = self
            .wall
            .zip(timestamp)
            .and_then(|((zero, within), timestamp)| Some(Stamp { time: zero.checked_add(timestamp)?, within }));
        if topic == Topic::TaxelSums {
            let sums = read_taxel_sums(data).ok_or_else(|| self.reader.damaged("has a frame without taxel sums"))?;
            return Ok(SourceEvent::Taxels(SummedFrame { sums, timestamp, stamp, sequence }));
        }
        let data = picture_of(data, topic == Topic::Jpeg);
        let data = data.ok_or_else(|| self.reader.damaged(NO_PICTURE))?;
        if let Some(crop) = &self.info.crop {
            let bytes = self.info.frame_bytes();
            self.whole.try_reserve(bytes.saturating_sub(self.whole.len())).map_err(|_| {
                let message = format_args!("has a frame of {} MB, and there is not so much memory", bytes >> 20);
                Error::new(ErrorKind::Unsupported, &self.subject, message)
            })?;
            crop.paste(&self.info, data, &mut self.whole);
            return Ok(SourceEvent::Frame(Frame { timestamp, stamp, sequence, ..Frame::new(&self.whole) }));
        }
        if topic == Topic::Raw {
            return Ok(SourceEvent::Frame(Frame { timestamp, stamp, sequence, ..Frame::new(data) }));
        }
        let decoder = self.decoder.get_or_insert_with(|| Decoder::new(self.info.size));
        Ok(match decoder.picture(data) {
            Ok(bytes) => {
                SourceEvent::Frame(Frame { timestamp, stamp, sequence, encoded: Some(data), ..Frame::new(bytes) })
            }
            Err(why) => SourceEvent::Lost { frames: 1, reason: why.reason() },
        })
    }
}

impl Source for McapSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if let Some(event) = self.spacing.next_event() {
            return Ok(event);
        }
        if let Some(topic) = self.waiting.take() {
            return self.frame(topic);
        }
        // After an error, nothing that follows can be relied on.
        if std::mem::replace(&mut self.ended, true) {
            return Ok(SourceEvent::End);
        }
        let next = self.advance()?;
        self.ended = matches!(next, Some(SourceEvent::End));
        next.filter(|_| !self.ended).map_or_else(|| self.next_event(), Ok)
    }
}

const NO_PICTURE: &str = "has a frame that is no picture";

/// Refuses a sensor that a recording does not have.
fn check_sensor(subject: &str, sensor: Option<&str>, names: &[String]) -> Result<(), Error> {
    let refused = |message: fmt::Arguments<'_>| Err(Error::new(ErrorKind::Usage, subject, message));
    let all = names.join(", ");
    match sensor {
        None if names.is_empty() => Ok(()),
        // Each program has its own way to name one.
        None => refused(format_args!("has the sensors {all}, expected one of them")),
        Some(sensor) if names.iter().any(|name| name == sensor) => Ok(()),
        Some(sensor) if names.is_empty() => {
            refused(format_args!("has one sensor, without a name; leave the name {sensor:?} out"))
        }
        Some(sensor) => refused(format_args!("has no sensor {sensor:?}, expected one of {all}")),
    }
}
