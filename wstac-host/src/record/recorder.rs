//! Turns a stream's events and outputs into a recording's messages.

use std::fs::File;
use std::path::Path;
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};

use super::about::About;
use super::compression::Compression;
use super::file::{Message, Topic};
use super::foxglove::{self, Level, RawImageShape};
use super::limits::MOST_MESSAGE;
use super::ordering::Turn;
use super::picture;
use super::shared::{RecordedSensor, SharedRecording};
use super::writer::{Outbox, Writing, Written};
use crate::error::{Error, ErrorKind};
use crate::frame_clock::can_be_written;
use crate::json::{JsonLine, real};
use crate::output::Output;
use crate::plural::counted;
use crate::session::Processor;
use crate::source::{Fault, Frame, LossReason, SourceEvent, Stamp, StreamInfo};

/// Bytes of a frame's message besides its own.
const MESSAGE_ROOM: u64 = 1 << 12;
/// The place where a picture was taken, as stored beside it.
const FRAME_ID: &str = "camera";

/// Lost frames, as a line of JSON.
#[derive(Serialize)]
#[serde(tag = "kind", rename = "lost")]
struct Lost<'a> {
    frames: u64,
    why: &'a str,
}

/// The wall-clock time of a frame, as a line of JSON. Frames behind it are as much later by that clock as they are by
/// the driver's.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename = "clock")]
pub(crate) struct ClockLine {
    /// When the frame was taken, by the driver's clock.
    pub(crate) time_ns: u64,
    /// When the frame was taken, by the wall clock: RFC 3339 in UTC, with nanoseconds.
    pub(crate) stamp: String,
    /// The uncertainty of wall-clock times in nanoseconds.
    pub(crate) within_ns: u64,
}

/// Returns how many lost frames a line of JSON reports; 0 if it reports something else.
pub(super) fn lost_frames(line: &[u8]) -> u64 {
    let line: serde_json::Value = serde_json::from_slice(line).unwrap_or_default();
    line["frames"].as_u64().filter(|_| line["kind"] == "lost").unwrap_or(0)
}

/// Refuses frames that no recording has.
pub(crate) fn check_frame_bytes(subject: &dyn std::fmt::Display, info: &StreamInfo) -> Result<(), Error> {
    let frame_bytes = info.frame_bytes();
    if info.taxels_only || (frame_bytes as u64) <= MOST_MESSAGE - MESSAGE_ROOM {
        return Ok(());
    }
    let (found, most) = (frame_bytes >> 20, MOST_MESSAGE >> 20);
    let message = format_args!("has frames of {found} MB, expected less than {most} MB in a recording");
    Err(Error::new(ErrorKind::Unsupported, subject, message))
}

/// Returns lost frames as a line of JSON.
pub(super) fn lost_line(frames: u64, why: &str) -> Vec<u8> {
    // Numbers and words can always be JSON.
    serde_json::to_vec(&Lost { frames, why }).unwrap_or_default()
}

/// Returns a fault of the source as a line of JSON.
pub(super) fn fault_line(fault: &Fault) -> Vec<u8> {
    serde_json::json!({"kind": "fault", "fault": fault.kind.name(), "message": fault.to_string()}).to_string().into()
}

/// Records a stream.
pub struct Recorder {
    outbox: Outbox,
    /// The turns of this sensor, if several sensors take them.
    turn: Option<Turn>,
    /// The file, unless several sensors share it.
    writing: Option<Writing>,
    /// The place of this sensor among those of the file.
    sensor: u8,
    content: Content,
    time: TimeLine,
    /// Messages before the first frame, which get that frame's time.
    early: Vec<Message>,
    /// Messages of this moment.
    messages: Vec<Message>,
    /// The place of the frame's message among them, and that message without its taxel sums.
    summed: Option<(usize, Message)>,
    /// The number of messages besides frames.
    number: u32,
}

/// The part of each frame that is kept.
struct Content {
    /// What viewers see of it.
    shape: RawImageShape,
    /// The whole frames.
    info: StreamInfo,
    /// The bytes that were cut out of a frame.
    part: Vec<u8>,
}

impl Content {
    fn new(info: &StreamInfo) -> Self {
        Self { shape: picture::shape(&stored(info)), info: info.clone(), part: Vec::new() }
    }

    /// Returns a frame's message; taxel sums come later.
    fn message(&mut self, taken: u64, frame: &Frame<'_>) -> (Topic, Vec<u8>) {
        let Self { shape, info, part } = self;
        if info.taxels_only {
            return (Topic::TaxelSums, Vec::new());
        }
        let bytes = if let Some(crop) = info.crop {
            crop.cut(info, frame.bytes, part);
            part
        } else if let Some(jpeg) = frame.encoded {
            return (Topic::Jpeg, foxglove::jpeg_image(taken, FRAME_ID, jpeg));
        } else {
            // Bytes that a driver adds after a frame are no part of it.
            frame.bytes.get(..info.frame_bytes()).unwrap_or(frame.bytes)
        };
        (Topic::Raw, foxglove::raw_image(taken, FRAME_ID, *shape, bytes))
    }
}

/// Returns the stream of what is kept of pictures.
fn stored(info: &StreamInfo) -> StreamInfo {
    info.crop.map_or_else(|| info.clone(), |crop| crop.of_stream(info))
}

/// Returns the approximate bytes of a frame in a recording.
pub(super) fn stored_bytes(info: &StreamInfo) -> usize {
    if info.taxels_only { MESSAGE_ROOM as usize } else { stored(info).frame_bytes() }
}

/// The place of messages in time.
struct TimeLine {
    /// Frames so far, lost ones included.
    frames: u64,
    /// Nanoseconds of a second's frames: numerator and denominator of a frame's time.
    period: (u128, u128),
    driver_times: bool,
    /// Time of the last frame; `None` before the first.
    now: Option<u64>,
    /// When the last frame was taken, and the number of frames before it.
    last: Option<(u64, u64)>,
    /// The wall-clock time when the driver's clock showed 0, as the recording has it.
    wall: Option<SystemTime>,
}

impl TimeLine {
    /// Returns a frame's time on the recording's line, and the time when it was taken.
    fn frame(&mut self, timestamp: Option<Duration>) -> (u64, u64) {
        let (time, taken) = self.place(timestamp);
        self.last = Some((taken, self.frames));
        self.frames = self.frames.saturating_add(1);
        self.now = Some(time);
        (time, taken)
    }

    /// Returns what [`frame`](Self::frame) will return for the next frame.
    fn place(&self, timestamp: Option<Duration>) -> (u64, u64) {
        let span = |frames: u64| u64::try_from(u128::from(frames) * self.period.0 / self.period.1).unwrap_or(u64::MAX);
        let of_driver = timestamp.filter(|_| self.driver_times).map(|timestamp| timestamp.as_nanos() as u64);
        // If the driver gives a frame no time, the frame before and the rate do.
        let since_last = self.last.filter(|_| self.driver_times);
        let guessed = || {
            since_last
                .map_or_else(|| span(self.frames), |(taken, frame)| taken.saturating_add(span(self.frames - frame)))
        };
        let taken = of_driver.unwrap_or_else(guessed);
        // If a driver's clock goes back, messages must still keep their order.
        (self.now.map_or(taken, |now| now.max(taken)), taken)
    }

    /// Returns the line about a frame's wall-clock time, if it does not follow from the one before.
    fn clock_line(&mut self, taken: u64, stamp: Option<Stamp>) -> Option<ClockLine> {
        let Stamp { time, within } = stamp.filter(|_| self.driver_times)?;
        let zero = time.checked_sub(Duration::from_nanos(taken));
        if zero.is_none() || zero == self.wall {
            return None;
        }
        if !can_be_written(time) {
            return None;
        }
        self.wall = zero;
        let stamp = humantime::format_rfc3339_nanos(time).to_string();
        Some(ClockLine { time_ns: taken, stamp, within_ns: within.as_nanos() as u64 })
    }
}

impl Recorder {
    /// Starts a recording in a file that is empty. `processor` reads the stream.
    ///
    /// A file whose recording cannot be started is removed.
    ///
    /// # Errors
    /// The recording cannot be started.
    pub fn new(file: File, path: &Path, about: &About, processor: &Processor) -> Result<Self, Error> {
        Self::compressed(file, path, about, processor, Compression::None)
    }

    /// Starts a recording whose chunks are compressed.
    ///
    /// A file whose recording cannot be started is removed.
    ///
    /// # Errors
    /// The recording cannot be started, or this build has no such compression.
    pub fn compressed(
        file: File,
        path: &Path,
        about: &About,
        processor: &Processor,
        compression: Compression,
    ) -> Result<Self, Error> {
        let sensor = RecordedSensor { name: "", about, processor, wall_zero: None };
        let (recording, recorders) = SharedRecording::start(file, path, &[sensor], compression)?;
        let recorder = recorders.into_iter().next();
        let recorder = recorder.ok_or_else(|| Error::new(ErrorKind::Io, path.display(), "has no queue"))?;
        Ok(Self { writing: Some(recording.writing), ..recorder })
    }

    /// Creates the recorder of a sensor, whose messages go through a queue.
    pub(super) fn of_sensor(sensor: u8, about: &About, outbox: Outbox, turn: Option<Turn>) -> Self {
        let rate = about.info.rate;
        let period = (1_000_000_000 * u128::from(rate.denominator()), u128::from(rate.numerator()));
        Self {
            outbox,
            turn,
            writing: None,
            sensor,
            content: Content::new(&about.info),
            time: TimeLine { frames: 0, period, driver_times: about.driver_times, now: None, last: None, wall: None },
            early: Vec::new(),
            messages: Vec::new(),
            summed: None,
            number: 0,
        }
    }

    /// Waits until an event of the source is the next of all sensors that share the file. Returns whether it is to be
    /// recorded: it is not if the recording has ended before it ([`end_all`](Self::end_all)).
    ///
    /// Each sensor's thread calls it for each event before [`source_event`](Self::source_event), also for
    /// [`SourceEvent::End`], which is always recorded. If the file has one sensor or cameras, it does not wait.
    pub fn wait_for_turn(&mut self, event: &SourceEvent<'_>) -> bool {
        let Some(turn) = &self.turn else { return true };
        let time = match event {
            SourceEvent::Frame(frame) => self.time.place(frame.timestamp).0,
            SourceEvent::Taxels(frame) => self.time.place(frame.timestamp).0,
            _ => self.now(),
        };
        turn.wait(time, matches!(event, SourceEvent::End))
    }

    /// Ends the recording of all sensors that take turns: nothing is recorded that comes behind this sensor's turn, but
    /// for the ends of the others.
    pub fn end_all(&self) {
        self.turn.iter().for_each(Turn::end_all);
    }

    /// Takes one event of the source before the processor does.
    pub fn source_event(&mut self, event: &SourceEvent<'_>) {
        match event {
            SourceEvent::Frame(frame) => {
                let message = self.arrive(frame.timestamp, frame.stamp, frame.sequence);
                let (topic, data) = self.content.message(message.taken, frame);
                let message = Message { topic, data, ..message };
                if topic == Topic::TaxelSums {
                    self.summed = Some((self.messages.len(), message));
                } else {
                    self.messages.push(message);
                }
            }
            SourceEvent::Taxels(frame) if self.content.info.taxels_only => {
                let message = self.arrive(frame.timestamp, frame.stamp, frame.sequence);
                self.messages.push(Message { data: foxglove::taxel_sums(&frame.sums), ..message });
            }
            SourceEvent::Lost { frames, reason } => {
                self.time.frames = self.time.frames.saturating_add(*frames);
                self.lost(*frames, reason.name());
            }
            _ => {}
        }
    }

    /// Returns the message of a frame without its content: its place in time and its number.
    fn arrive(&mut self, timestamp: Option<Duration>, stamp: Option<Stamp>, sequence: Option<u32>) -> Message {
        let counted = self.time.frames as u32;
        let (time, taken) = self.time.frame(timestamp);
        for mut message in self.early.drain(..) {
            (message.time, message.taken) = (time, time);
            self.messages.push(message);
        }
        if let Some(line) = self.time.clock_line(taken, stamp) {
            // Numbers and words can always be JSON.
            self.add_at(time, Topic::Clock, serde_json::to_vec(&line).unwrap_or_default());
        }
        let sequence = sequence.filter(|_| self.time.driver_times).unwrap_or(counted);
        Message { sensor: self.sensor, topic: Topic::TaxelSums, time, taken, sequence, data: Vec::new() }
    }

    /// Takes an output that followed from it. `text` is the line for a person. The output's message has the output's
    /// time, so frames without times of a driver must be counted from the recording's first frame on.
    pub fn output(&mut self, output: &Output, text: &str) {
        match output {
            Output::Features(features) => {
                let data = foxglove::features(&features.features.map(real));
                self.add(Topic::Features, data);
            }
            Output::Fault(_) => self.line([Topic::Faults, Topic::FaultsJson], Level::Warning, text, output),
            Output::Event(_)
            | Output::ContactEnd(_)
            | Output::Slip(_)
            | Output::EarlyTexture(_)
            | Output::Interrupted(_)
            | Output::End(_) => {
                self.line([Topic::Events, Topic::EventsJson], Level::Info, text, output);
            }
            // Lost frames are recorded as events of the source. Motion follows from the frames.
            Output::Motion(_) | Output::Lost(_) | Output::BaselineDisturbed { .. } => {}
        }
    }

    /// Takes the taxels of the frame that was read, and gives everything of this moment to the disk.
    ///
    /// It returns whether the recording goes on. It does not if the disk is full, which [`finish`](Self::finish)
    /// reports.
    pub fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        if let Some((place, message)) = self.summed.take() {
            match processor.taxel_sums() {
                Some(sums) => {
                    let message = Message { data: foxglove::taxel_sums(&sums), ..message };
                    self.messages.insert(place.min(self.messages.len()), message);
                }
                // The frame was too short for its sums.
                None => self.lost(1, LossReason::Damaged.name()),
            }
        }
        if let (SourceEvent::Frame(_) | SourceEvent::Taxels(_), Some(taxels)) = (event, processor.taxels()) {
            let data = foxglove::taxels(self.now(), &taxels);
            self.add(Topic::Taxels, data);
        }
        if self.time.now.is_none() {
            self.early.append(&mut self.messages);
        }
        self.messages.is_empty() || self.outbox.give(std::mem::take(&mut self.messages))
    }

    /// Returns the number of frames that wait for the disk.
    pub fn waiting(&self) -> u64 {
        self.outbox.waiting()
    }

    /// Ends the recording and its file. If sensors share the file, it goes on, and
    /// [`SharedRecording::finish`](super::SharedRecording::finish) has the result.
    ///
    /// # Errors
    /// The file could not be written, or not all of it.
    pub fn finish(mut self) -> Result<Written, Error> {
        self.messages.append(&mut self.early);
        if !self.messages.is_empty() {
            self.outbox.give(std::mem::take(&mut self.messages));
        }
        drop(self.outbox);
        self.writing.map_or_else(|| Ok(Written::default()), Writing::finish)
    }

    fn lost(&mut self, frames: u64, why: &str) {
        let text = format!("{} lost: {why}", counted(frames, "frame"));
        self.said([Topic::Faults, Topic::FaultsJson], self.now(), Level::Warning, &text, &Lost { frames, why });
    }

    /// Returns the time of the last frame, or 0 before the first.
    fn now(&self) -> u64 {
        self.time.now.unwrap_or(0)
    }

    /// Adds a message for a person, and the same as JSON.
    fn said(&mut self, topics: [Topic; 2], time: u64, level: Level, text: &str, record: &impl Serialize) {
        self.add_at(time, topics[0], foxglove::log(time, level, text));
        // Records are numbers and words, which can always be JSON.
        self.add_at(time, topics[1], serde_json::to_vec(record).unwrap_or_default());
    }

    /// Adds an output for a person, and the same as JSON.
    fn line(&mut self, topics: [Topic; 2], level: Level, text: &str, output: &Output) {
        if let Some(line) = JsonLine::new(output) {
            // A fault has the time of the frame to come.
            let time = output.time_ns().map_or(self.now(), |time| time.min(self.now()));
            self.said(topics, time, level, text, &line);
        }
    }

    fn add(&mut self, topic: Topic, data: Vec<u8>) {
        self.add_at(self.now(), topic, data);
    }

    fn add_at(&mut self, time: u64, topic: Topic, data: Vec<u8>) {
        self.number = self.number.wrapping_add(1);
        let (sensor, sequence) = (self.sensor, self.number);
        self.messages.push(Message { sensor, topic, time, taken: time, sequence, data });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording may claim any time: each frame is as much later by the wall clock as it is by the driver's.
    #[test]
    fn a_wall_clock_time_that_cannot_be_written_is_left_out() {
        let period = (1_000_000_000, 30);
        let mut line = TimeLine { frames: 0, period, driver_times: true, now: None, last: None, wall: None };
        let of_year_9999 = humantime::parse_rfc3339("9999-12-31T23:59:59Z").unwrap();
        let stamp = |time| Some(Stamp { time, within: Duration::ZERO });
        for (after_s, is_written) in [(2, false), (1, false), (0, true)] {
            let time = of_year_9999 + Duration::from_secs(after_s);
            assert_eq!(line.clock_line(5_000_000_000, stamp(time)).is_some(), is_written, "{after_s} s");
        }
        let before = SystemTime::UNIX_EPOCH - Duration::from_secs(1);
        assert!(line.clock_line(0, stamp(before)).is_none());
        // Bytes that could not be written are not taken for written.
        let line = line.clock_line(0, stamp(SystemTime::UNIX_EPOCH)).unwrap();
        assert_eq!(line.stamp, "1970-01-01T00:00:00.000000000Z");
    }
}
