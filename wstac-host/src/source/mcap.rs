//! A recording as a source. It gives the frames, gaps and faults of the stream that was recorded, in their order.

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use mcap::records::Record;
use serde::Deserialize;
use wstac_core::rate::FrameRate;

use super::{
    Fault, FaultKind, Frame, LossReason, Recorded, Source, SourceEvent, Stamp, StreamInfo, SummedFrame, replaced_rate,
};
use crate::camera::mjpeg::Decoder;
use crate::error::{Error, ErrorKind};
use crate::record::about::{self, About};
use crate::record::foxglove::{Images, Schema, read_taxel_sums};
use crate::record::parse::parse_record;
use crate::record::{
    CAMERA, CLOCK, ClockLine, FAULTS, Item, Reader, TAXEL_SUMS, check_frame_bytes, damaged, sound_metadata,
};

/// The content of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    Raw,
    Jpeg,
    Sums,
    Faults,
    Clock,
}

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
    reader: Reader,
    about: About,
    info: StreamInfo,
    /// The start of the topics of its sensor: `/` and the sensor's name, if there are several.
    prefix: String,
    /// The channels that matter, by their numbers, and the numbers of the schemas of compressed pictures.
    channels: Vec<(u16, Content)>,
    jpeg_schemas: Vec<u16>,
    images: Images,
    /// The frame whose part was stored.
    whole: Vec<u8>,
    decoder: Option<Decoder>,
    /// The wall-clock time when the driver's clock showed 0, and its uncertainty.
    wall: Option<(SystemTime, Duration)>,
    ended: bool,
}

/// The next thing to hand out.
enum Next {
    Frame(Content),
    Lost(u64, LossReason),
    Fault(Fault),
    End,
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
        let (reader, outline) = Reader::open(path)?;
        let (metadata, _) = sound_metadata(&outline.metadata);
        about::sensors(&metadata).map_err(|error| reader.damaged(error))
    }

    /// Returns the wall-clock time when the driver's clock of a recording showed 0, as it was at the first frame; `None` if
    /// the recording has no such times.
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
        let (reader, outline) = Reader::open(path)?;
        let (metadata, missing) = sound_metadata(&outline.metadata);
        if missing > 0 {
            return Err(reader.damaged("has a damaged description"));
        }
        let names = about::sensors(&metadata).map_err(|error| failed(&error))?;
        check_sensor(&subject, sensor, &names)?;
        let about = About::from_metadata(&metadata, sensor).map_err(|error| failed(&error))?;
        let expected = "is an MCAP file without the metadata of a recording, expected one that wstac record wrote";
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
            let rate = info.rate;
            replaced = format!("; {}:{} frames per second{replaced}", rate.numerator(), rate.denominator());
        }
        let recorded = format!("recorded from {}{}{replaced}", info.about, labels(&about));
        info.about = format!("{subject}: {of_sensor}{recorded}");
        Ok(Self {
            reader,
            about,
            info,
            prefix: sensor.map_or_else(String::new, |sensor| format!("/{sensor}")),
            channels: Vec::new(),
            jpeg_schemas: Vec::new(),
            images: Images::default(),
            whole: Vec::new(),
            decoder: None,
            wall: None,
            ended: false,
            subject,
        })
    }

    /// Returns what the recording says of itself.
    pub fn about(&self) -> &About {
        &self.about
    }

    fn damaged(&self, what: impl fmt::Display) -> Error {
        damaged(&self.subject, what)
    }

    /// Goes on to the next message that matters. A frame's message stays in `reader`.
    fn advance(&mut self) -> Result<Next, Error> {
        loop {
            let channel = match self.reader.next()? {
                Item::Message(channel) => channel,
                Item::Definition(op) => {
                    self.enter(op)?;
                    continue;
                }
                Item::End => return Ok(Next::End),
            };
            let content = self.channels.iter().find(|(known, _)| *known == channel);
            let Some((_, content)) = content.copied() else { continue };
            self.reader.load()?;
            let Some(message) = self.reader.message() else {
                return Err(self.damaged("has a message without a header"));
            };
            match content {
                Content::Faults => {
                    let line = serde_json::from_slice(message.data);
                    match line.map_err(|error| self.damaged(format_args!("{FAULTS}: {error}")))? {
                        Line::Lost { frames, why } => return Ok(Next::Lost(frames, LossReason::from(why.as_str()))),
                        Line::Fault { fault, message } => {
                            return Ok(Next::Fault(Fault::from_text(FaultKind::from(fault.as_str()), &message)));
                        }
                        Line::Other => {}
                    }
                }
                Content::Clock => {
                    let line = serde_json::from_slice(message.data);
                    let line: ClockLine = line.map_err(|error| self.damaged(format_args!("{CLOCK}: {error}")))?;
                    let time = humantime::parse_rfc3339(&line.stamp);
                    let time = time.map_err(|error| self.damaged(format_args!("{CLOCK}: {error}")))?;
                    let zero = time.checked_sub(Duration::from_nanos(line.time_ns));
                    self.wall = zero.map(|zero| (zero, Duration::from_nanos(line.within_ns)));
                }
                content => return Ok(Next::Frame(content)),
            }
        }
    }

    /// Notes a channel if it matters.
    fn enter(&mut self, op: u8) -> Result<(), Error> {
        self.reader.load()?;
        match parse_record(op, self.reader.body()) {
            Ok(Record::Schema { header, .. }) if header.name == Schema::CompressedImage.name() => {
                if !self.jpeg_schemas.contains(&header.id) {
                    self.jpeg_schemas.push(header.id);
                }
            }
            Ok(Record::Channel(channel)) => {
                let is_jpeg = self.jpeg_schemas.contains(&channel.schema_id);
                let content = match channel.topic.strip_prefix(&self.prefix).unwrap_or_default() {
                    CAMERA if is_jpeg => Content::Jpeg,
                    CAMERA => Content::Raw,
                    TAXEL_SUMS if self.info.taxels_only => Content::Sums,
                    FAULTS => Content::Faults,
                    CLOCK => Content::Clock,
                    _ => return Ok(()),
                };
                if !self.channels.iter().any(|(known, _)| *known == channel.id) {
                    self.channels.push((channel.id, content));
                }
            }
            Ok(_) => {}
            Err(error) => return Err(self.damaged(error)),
        }
        Ok(())
    }

    /// Returns the frame that `reader` has.
    fn frame(&mut self, content: Content) -> Result<SourceEvent<'_>, Error> {
        let Some(message) = self.reader.message() else {
            return Err(self.damaged(NO_PICTURE));
        };
        let of_driver = self.about.driver_times;
        let timestamp = of_driver.then(|| Duration::from_nanos(message.times[1]));
        let sequence = of_driver.then_some(message.sequence);
        let stamp = self
            .wall
            .zip(timestamp)
            .and_then(|((zero, within), timestamp)| Some(Stamp { time: zero.checked_add(timestamp)?, within }));
        if content == Content::Sums {
            let sums = read_taxel_sums(message.data).ok_or_else(|| self.damaged("has a frame without taxel sums"))?;
            return Ok(SourceEvent::Taxels(SummedFrame { sums, timestamp, stamp, sequence }));
        }
        let no_memory = |bytes: usize| {
            let message = format_args!("has a frame of {} MB, and there is not so much memory", bytes >> 20);
            Error::new(ErrorKind::Unsupported, &self.subject, message)
        };
        let bytes = message.data.len();
        if !self.images.make_room(bytes, content == Content::Jpeg) {
            return Err(no_memory(bytes));
        }
        if self.info.crop.is_some() {
            let bytes = self.info.frame_bytes();
            self.whole.try_reserve(bytes.saturating_sub(self.whole.len())).map_err(|_| no_memory(bytes))?;
        }
        let data = self.images.read(message.data, content == Content::Jpeg);
        let data = data.map_err(|_| damaged(&self.subject, NO_PICTURE))?;
        if let Some(crop) = &self.info.crop {
            crop.paste(&self.info, data, &mut self.whole);
            return Ok(SourceEvent::Frame(Frame { timestamp, stamp, sequence, ..Frame::new(&self.whole) }));
        }
        if content == Content::Raw {
            return Ok(SourceEvent::Frame(Frame { timestamp, stamp, sequence, ..Frame::new(data) }));
        }
        let decoder = self.decoder.get_or_insert_with(|| Decoder::new(self.info.size));
        Ok(match decoder.decode(data) {
            Ok(bytes) => {
                SourceEvent::Frame(Frame { timestamp, stamp, sequence, encoded: Some(data), ..Frame::new(bytes) })
            }
            Err(_) => SourceEvent::Lost { frames: 1, reason: LossReason::CorruptJpeg },
        })
    }
}

impl Source for McapSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.ended {
            return Ok(SourceEvent::End);
        }
        // After an error, nothing that follows can be relied on.
        self.ended = true;
        let next = self.advance()?;
        self.ended = matches!(next, Next::End);
        match next {
            Next::Frame(content) => self.frame(content),
            Next::Lost(frames, reason) => Ok(SourceEvent::Lost { frames, reason }),
            Next::Fault(fault) => Ok(SourceEvent::Fault(fault)),
            Next::End => Ok(SourceEvent::End),
        }
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
            refused(format_args!("has one sensor without a name, expected no name of a sensor (found {sensor:?})"))
        }
        Some(sensor) => refused(format_args!("has no sensor {sensor:?}, expected one of {all}")),
    }
}

/// Returns the labels for a person.
fn labels(about: &About) -> String {
    let each = about.labels.iter().map(|(name, value)| [", ", name, "=", value].concat());
    each.collect::<Vec<_>>().concat()
}
