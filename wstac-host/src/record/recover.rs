//! Recovers every sound moment of a recording that was cut off or is damaged.
//!
//! A moment is sound if its checksum or that of its chunk is right. Frames of other moments are entered as lost where
//! they were, so that those behind keep their place: checksums have the places of all frames. Recordings of before have
//! none; there the times of frames give the places, and the index their count. The checksum of a chunk says
//! nothing of messages outside of it.
//!
//! Other tools may have written the recording anew, with other numbers of channels. The checksums are checked with the
//! numbers that this program gave them. If its messages stand in another order, they are put in order first.
//!
//! Each of several sensors has places of its own. Recordings of several that do not tell them apart are recovered up to
//! the first damage: nothing says whose frames are missing there.
//!
//! The places also say which moments are there already, so that none is copied twice, and none behind a later one.
//!
//! A recovery is a success only if all frames are accounted for, and if the new file was read like any recording.
//!
//! The choice of messages, and of their new form, is this project's policy. No MCAP library has it.

mod copied;
mod moments;
mod order;
mod settle;

use std::collections::BTreeMap;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use mcap::records::{Channel, MessageHeader, Record, op};
use mcap::write::Metadata;
use mcap::{McapError, Schema};
use wstac_core::rate::FrameRate;

pub use self::order::recover;

use self::copied::Copied;
use self::order::Order;
use super::about::{About, CONFIGURATION, TOML, is_description};
use super::channels::Channels;
use super::compression::Compression;
use super::file::{Message, RecordingFile, Sensors, Topic, write_error};
use super::foxglove::{picture_of, read_taxel_sums};
use super::limits::{MOST_DEFINITIONS, MOST_MESSAGE, MOST_PENDING, check_memory};
use super::parse::parse_record;
use super::recorder::{fault_line, lost_frames, lost_line};
use super::reserved::give_back_of_killed;
use super::sorted::{OrderCheck, Sorted};
use super::sums::{self, Stated, Tally};
use super::walk::{Crc, MESSAGE_HEADER, Mode, Span, Unread, Walk, WalkStep, message_of, outline};
use crate::config::Config;
use crate::error::{Error, ErrorKind};
use crate::plural::counted;
use crate::source::mcap::McapSource;
use crate::source::spacing::{Positions, Spacing};
use crate::source::{Source, SourceEvent};

/// The result of a recovery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Recovered {
    /// Frames.
    pub frames: u64,
    /// Events that were found when it was recorded.
    pub events: u64,
    /// Frames that are damaged or missing and entered as lost.
    pub damaged: u64,
    /// Frames that were left out because they are there already, or because later ones stand before them.
    pub repeated: u64,
    /// Frames that nothing vouches for, because the file has no checksum of them. In a file of another program they are
    /// all its messages.
    pub unchecked: u64,
    /// Whether the file was finished properly.
    pub whole: bool,
    /// Bytes of the new file.
    pub bytes: u64,
    /// The bytes that could not be read.
    pub unread: Option<Unread>,
    /// Attachments and records of unknown kinds, which were left out.
    pub left_out: u64,
    /// Messages of channels that only a damaged part describes. They may have a wrong name.
    pub doubtful: u64,
    /// Why the new file may lack frames, or cannot be read as a recording; `None` if all frames are accounted for.
    pub problem: Option<String>,
}

struct Waiting {
    span: Span,
    header: MessageHeader,
    /// The sensor and topic of the message if it is one of this program.
    own: Option<(u8, Topic)>,
    /// The verdict of the checksum of the chunk that the message stands in.
    crc: Crc,
    /// Whether the message stands in a chunk that was never finished, at the end of a file that was not.
    is_unfinished: bool,
    body: Vec<u8>,
}

impl Waiting {
    fn is_frame(&self) -> bool {
        self.own.is_some_and(|(_, topic)| topic.is_frame())
    }

    fn data(&self) -> &[u8] {
        self.body.get(MESSAGE_HEADER as usize..).unwrap_or_default()
    }

    /// Returns the lost frames that it reports.
    fn lost(&self) -> u64 {
        if matches!(self.own, Some((_, Topic::FaultsJson))) { lost_frames(self.data()) } else { 0 }
    }
}

/// A file that is being recovered.
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
struct Recovery<'a> {
    walk: Walk,
    order: OrderCheck,
    /// The messages in their order, if the file has another one.
    sorted: Option<Sorted>,
    out: RecordingFile,
    old: &'a Path,
    path: &'a Path,
    /// The recording's description of itself; `None` if it is none of this program.
    about: Option<About>,
    /// The rates of several sensors.
    rates: Vec<Option<FrameRate>>,
    has_sums: bool,
    /// Whether the chunks have checksums.
    has_crcs: bool,
    own: Channels,
    /// The schemas by their numbers, each with whether it stands in undamaged bytes.
    schemas: BTreeMap<u16, (Schema<'static>, bool)>,
    channels: BTreeMap<u16, (Channel, bool)>,
    /// Bytes of all schemas and channels.
    definitions: u64,
    /// Numbers of other programs' channels in the new file, by those in the old one.
    numbers: BTreeMap<u16, u16>,
    /// Messages that wait for their checksum, and their bytes.
    pending: Vec<Waiting>,
    held: u64,
    /// Time of the last message.
    time: u64,
    /// The sensor and the time of the first message of this program that waits.
    moment: Option<(u8, u64)>,
    /// Frames that a recording of before must have lost here, at least, since its last sound frame.
    suspects: u64,
    is_suspect: bool,
    /// Whether a chunk's checksum was wrong.
    has_bad_chunk: bool,
    copied: Copied,
    /// Frames of sound moments that were not copied, and are no copies.
    others: u64,
    /// The counts of each sensor at the last of the recording's checksums that is right.
    known: Option<Tally>,
    /// Frames of each sensor that are entered as lost.
    entered: BTreeMap<u8, u64>,
    /// Whether frames are missing, and nothing says of which sensor. Nothing behind them is copied.
    is_over: bool,
    /// The frames of each sensor that no checksum counts.
    spacings: BTreeMap<u8, Spacing>,
    found: Recovered,
}

/// Returns whether all configurations can be read. If checksums are damaged as well, nothing else tells damage from
/// text.
fn has_configurations(description: &[Metadata]) -> bool {
    let all = description.iter().filter(|metadata| metadata.name.starts_with(CONFIGURATION));
    all.filter_map(|metadata| metadata.metadata.get(TOML)).all(|text| Config::parse_recorded(text).is_ok())
}

/// Recovers a file. Returns false as well if its messages stand in another order than they were recorded in.
fn attempt(old: &Path, new: &File, path: &Path, order: Order) -> Result<(Recovered, bool), Error> {
    let mut survey = Walk::open(old, Mode::Survey)?;
    survey.set_own(&Sensors::default());
    let all = outline(&mut survey)?.metadata;
    let stated = Stated::of(&all);
    let compression = survey.compression.unwrap_or_default();
    compression.check(&old.display())?;
    let (sound, missing) = sums::sound_metadata(&all);
    let sensors = Sensors::of(&sound);
    let about = About::from_metadata(&sound, sensors.first());
    // Each sensor has a rate of its own.
    let about_of = |name: &String| About::from_metadata(&sound, Some(name)).ok().flatten();
    let rates = sensors.names().iter().map(|name| Some(about_of(name)?.info.rate)).collect();
    let description: Vec<Metadata> = sound.into_iter().filter(|metadata| is_description(&metadata.name)).collect();
    let mut walk = Walk::open(old, Mode::Salvage)?;
    if !walk.has_magic && description.is_empty() && walk.summary.is_none() {
        return Err(Error::new(ErrorKind::Format, old.display(), walk.other_start()?));
    }
    let problem = match &about {
        _ if missing > 0 || !has_configurations(&description) => Some("has a damaged description".to_owned()),
        Ok(Some(_)) => None,
        Ok(None) => Some("has no description of a recording".to_owned()),
        Err(error) => Some(error.clone()),
    };
    let problem = problem.or(stated.has_other_end.then(|| "has the ends of several recordings".to_owned()));
    // All recordings of several sensors have checksums, unless another tool left them out.
    let is_with = survey.summary.is_none() || has_sum(old)?;
    let [with_crc, without_crc] = survey.crcs;
    let has_sums = (stated.has_sums || sensors.first().is_some()) && is_with;
    if has_sums || !description.is_empty() {
        walk.set_own(&sensors);
    }
    if let Ok(Some(about)) = &about
        && !about.info.taxels_only
    {
        let frames = if compression == Compression::None { 3 } else { 6 };
        check_memory(&old.display(), about.info.frame_bytes(), frames)?;
    }
    // Without a description, the checksums still belong to a recording of this program.
    // The new file may have another name until it is whole.
    let same = new.try_clone().map_err(|error| Error::io(path.display(), error))?;
    let written = RecordingFile::new(same, &description, compression).map_err(|error| not_written(path, error))?;
    let mut recovery = Recovery {
        walk,
        order: OrderCheck::default(),
        sorted: None,
        out: written,
        old,
        path,
        about: about.ok().flatten(),
        rates,
        has_sums,
        has_crcs: with_crc > without_crc,
        own: Channels::new(sensors),
        schemas: BTreeMap::new(),
        channels: BTreeMap::new(),
        definitions: 0,
        numbers: BTreeMap::new(),
        pending: Vec::new(),
        held: 0,
        time: 0,
        moment: None,
        suspects: 0,
        is_suspect: false,
        has_bad_chunk: false,
        copied: Copied::default(),
        others: 0,
        known: None,
        entered: BTreeMap::new(),
        is_over: false,
        spacings: BTreeMap::new(),
        found: Recovered { problem, ..Recovered::default() },
    };
    // The index comes first, because chunks have each channel only once.
    let definitions = recovery.walk.summary.as_ref().map(|summary| summary.definitions.clone()).unwrap_or_default();
    for (op, body) in definitions {
        recovery.define(op, &body, true);
    }
    if order == Order::Sorted {
        recovery.sort()?;
    }
    if !recovery.go(&stated)? && order == Order::Doubted {
        return Ok((recovery.found, false));
    }
    Ok((recovery.finish(new)?, true))
}

/// Returns whether a file has a message that is a checksum, whatever its channel is.
fn has_sum(old: &Path) -> Result<bool, Error> {
    let mut walk = Walk::open(old, Mode::Salvage)?;
    loop {
        let span = match walk.next()? {
            WalkStep::Record(span) if span.op == op::MESSAGE => span,
            WalkStep::End { .. } => return Ok(false),
            _ => continue,
        };
        if walk.start_of(span, MESSAGE_HEADER as usize + sums::START.len())?.ends_with(sums::START) {
            return Ok(true);
        }
    }
}

fn not_written(path: &Path, error: McapError) -> Error {
    write_error(path, error, ": it was not written, and the recording is as it was")
}

/// Returns whether a new entry replaces the one there is. The first entry stays, unless it stands in damaged bytes.
fn is_better<T>(there: Option<&(T, bool)>, sound: bool) -> bool {
    there.is_none_or(|(_, was)| sound && !was)
}

impl Recovery<'_> {
    /// Notes why the number of lost frames is not certain. The first reason stays.
    fn doubt(&mut self, why: impl Into<String>) {
        self.found.problem.get_or_insert_with(|| why.into());
    }

    /// Takes a record that is no message.
    fn record(&mut self, span: Span) -> Result<(), Error> {
        match span.op {
            op::SCHEMA | op::CHANNEL => {
                let mut body = Vec::new();
                self.walk.body(span, &mut body)?;
                self.define(span.op, &body, self.walk.crc != Crc::Bad);
                Ok(())
            }
            op::METADATA => self.copy_metadata(span),
            _ => Ok(()),
        }
    }

    /// Goes on in the old file, or in its messages in order.
    fn step(&mut self) -> Result<WalkStep, Error> {
        let Some(sorted) = &mut self.sorted else { return self.walk.next() };
        let next = sorted.next(&mut self.walk)?;
        Ok(next.map_or(WalkStep::End { whole: self.found.whole }, WalkStep::Record))
    }

    /// Goes through the old file. Returns false if its messages stand in another order than they are recorded in.
    fn go(&mut self, stated: &Stated) -> Result<bool, Error> {
        loop {
            match self.step()? {
                WalkStep::Record(span) if span.op == op::MESSAGE => self.message(span)?,
                WalkStep::Record(span) => self.record(span)?,
                WalkStep::ChunkEnd => self.end_chunk()?,
                WalkStep::Damage(unread) => {
                    // Messages before it stand in the same moment, perhaps.
                    self.is_suspect |= unread.damaged;
                    if !self.has_sums {
                        self.flush()?;
                    }
                }
                WalkStep::End { whole } => {
                    // A moment without its checksum is the incomplete end of a recording that was cut off.
                    let is_cut =
                        self.has_sums && !self.is_suspect && self.pending.iter().all(|of| of.crc == Crc::Unknown);
                    self.pending.retain(|_| !is_cut);
                    self.flush()?;
                    if self.sorted.is_none() && self.order.is_other(self.has_sums) {
                        return Ok(false);
                    }
                    self.found.whole = whole || self.walk.is_finished()?;
                    self.found.unread = self.walk.unread;
                    self.found.left_out += self.walk.others;
                    break;
                }
            }
        }
        self.settle(stated)?;
        // Frames are missing, and nothing is damaged, or frames stand behind later ones: perhaps messages were moved.
        let is_damaged = self.has_bad_chunk || self.found.unread.is_some() || !self.found.whole;
        let is_moved = self.found.damaged > 0 && (!is_damaged || self.others > 0) && !(self.is_over && self.others > 0);
        Ok(self.sorted.is_some() || !is_moved)
    }

    /// Notes a schema or a channel.
    fn define(&mut self, op: u8, body: &[u8], sound: bool) {
        self.definitions = self.definitions.saturating_add(body.len() as u64);
        if self.definitions > 4 * MOST_DEFINITIONS {
            self.doubt(format!("has more than {} MB of schemas and channels", MOST_DEFINITIONS >> 18));
            return;
        }
        // The numbers of channels are known without their records.
        let is_believed = sound || !self.has_sums;
        // A record that cannot be read is damaged, and everything that needs it is left out.
        match parse_record(op, body) {
            Ok(Record::Schema { header, data }) => {
                let data = data.into_owned().into();
                let schema = Schema { id: header.id, name: header.name, encoding: header.encoding, data };
                if is_better(self.schemas.get(&schema.id), sound) {
                    let of_schema = |(of, _): &&(Channel, bool)| is_believed && of.schema_id == schema.id;
                    for (channel, _) in self.channels.values().filter(of_schema) {
                        self.own.add(channel.id, &channel.topic, &schema.name);
                    }
                    // Channels of the old schema are written again.
                    self.numbers.retain(|id, _| self.channels.get(id).is_none_or(|(of, _)| of.schema_id != schema.id));
                    self.schemas.insert(schema.id, (schema, sound));
                }
            }
            Ok(Record::Channel(channel)) if is_better(self.channels.get(&channel.id), sound) => {
                self.numbers.remove(&channel.id);
                let schema = self.schemas.get(&channel.schema_id).map_or("", |(schema, _)| &schema.name);
                if is_believed {
                    self.own.add(channel.id, &channel.topic, schema);
                }
                if let Some(ambiguity) = self.own.ambiguity() {
                    self.doubt(ambiguity);
                }
                self.channels.insert(channel.id, (channel, sound));
            }
            _ => {}
        }
    }

    /// Copies other programs' metadata.
    fn copy_metadata(&mut self, span: Span) -> Result<(), Error> {
        let mut body = Vec::new();
        self.walk.body(span, &mut body)?;
        let Ok(Record::Metadata(metadata)) = parse_record(op::METADATA, &body) else { return Ok(()) };
        if is_description(&metadata.name) || metadata.name.starts_with("wstac.") {
            return Ok(());
        }
        self.flush()?;
        self.out.write_metadata(&metadata).map_err(|error| not_written(self.path, error))
    }

    /// Returns the sensor and the topic of a channel of this program.
    fn own(&self, channel: u16) -> Option<(u8, Topic)> {
        // This program's numbers are fixed, so a damaged record of a channel loses nothing.
        let is_fixed = self.has_sums && !self.own.is_renumbered;
        self.own.of(channel).or_else(|| self.own.sensors.topic(channel).filter(|_| is_fixed))
    }

    /// Ends a chunk.
    fn end_chunk(&mut self) -> Result<(), Error> {
        if !self.has_sums || self.walk.crc == Crc::Bad {
            return self.flush();
        }
        // What waits stands before all of the next chunk.
        self.pending.iter_mut().for_each(|message| message.span.at = 0);
        Ok(())
    }

    /// Reads a message; `None` if its record is too short.
    fn read(&self, span: Span) -> Result<Option<Waiting>, Error> {
        let mut body = Vec::new();
        self.walk.body(span, &mut body)?;
        let (crc, is_unfinished) = (self.walk.crc, self.walk.in_unfinished());
        let header = message_of(&body).map(|(header, _)| header);
        Ok(header.map(|header| Waiting { span, header, own: self.own(header.channel_id), crc, is_unfinished, body }))
    }

    fn message(&mut self, span: Span) -> Result<(), Error> {
        let Some(message) = self.read(span)? else { return Ok(()) };
        let own = message.own;
        let of_moment = own.map(|(sensor, topic)| {
            self.order.add(sensor, topic, &message.header);
            (sensor, message.header.log_time)
        });
        self.has_bad_chunk |= message.crc == Crc::Bad;
        let is_sum = own.is_some_and(|(_, topic)| topic == Topic::Sums);
        if is_sum || (self.has_sums && message.data().starts_with(sums::START)) {
            return self.sum(&message);
        }
        // Without checksums, a moment is a frame and what is behind it of its sensor and time: the next frame may be
        // gone. Lines of events have earlier times.
        let is_line = matches!(own, Some((_, Topic::Events | Topic::EventsJson | Topic::Faults | Topic::FaultsJson)));
        let joins = |((sensor, time), (of, at))| of == sensor && (at == time || (is_line && at < time));
        let joins = self.moment.zip(of_moment).is_none_or(joins);
        let starts = !self.has_sums && own.is_none_or(|(_, topic)| topic.is_frame() || !joins);
        if starts || self.pending.len() == MOST_PENDING || self.held + span.length > 2 * MOST_MESSAGE {
            self.flush()?;
        }
        self.held += span.length;
        self.moment = self.moment.or(of_moment);
        self.pending.push(message);
        Ok(())
    }

    /// Returns whether a message is copied that has no checksum of its own.
    fn is_sound(&self, message: &Waiting) -> bool {
        match message.crc {
            Crc::Bad => false,
            // Messages that have no place in the stream.
            Crc::Good if self.has_sums => !message.is_frame() && !matches!(message.own, Some((_, Topic::FaultsJson))),
            Crc::Good => true,
            // The last chunk of a recording that was killed has no checksum yet. The new file would end at a frame that
            // is read as no picture.
            Crc::Unknown if self.has_sums || (self.has_crcs && !message.is_unfinished) => false,
            Crc::Unknown => match message.own {
                Some((_, Topic::TaxelSums)) => read_taxel_sums(message.data()).is_some(),
                Some((_, topic)) if topic.is_frame() => picture_of(message.data(), topic == Topic::Jpeg).is_some(),
                _ => true,
            },
        }
    }

    /// Copies the messages that wait, if they are sound.
    fn flush(&mut self) -> Result<(), Error> {
        (self.held, self.moment) = (0, None);
        let pending = std::mem::take(&mut self.pending);
        if pending.is_empty() || self.is_over {
            return Ok(());
        }
        let (sound, others): (Vec<_>, Vec<_>) = pending.into_iter().partition(|message| self.is_sound(message));
        self.leave(&others);
        if sound.is_empty() {
            return Ok(());
        }
        let is_other = |of: &Waiting| of.own.is_none() && self.about.is_none();
        let unchecked = sound.iter().filter(|of| of.crc == Crc::Unknown && (of.is_frame() || is_other(of)));
        self.found.unchecked += unchecked.count() as u64;
        if self.has_sums || self.about.is_none() {
            return self.copy(&sound);
        }
        self.copy_by_times(&sound)
    }

    /// Leaves messages out that no checksum vouches for.
    fn leave(&mut self, messages: &[Waiting]) {
        self.is_suspect |= !messages.is_empty();
        let frames = messages.iter().filter(|message| message.is_frame()).count() as u64;
        self.suspects = self.suspects.saturating_add(frames);
        let mut foreign = messages.iter().filter(|of| of.own.is_none() && of.crc == Crc::Unknown);
        if let Some((channel, _)) = foreign.find_map(|of| self.channels.get(&of.header.channel_id)) {
            self.doubt(format!("has messages of {}, which no checksum vouches for", channel.topic));
        }
    }

    /// Copies a moment that no checksum counts. The times of frames say how many are missing before it, and whether
    /// they come evenly.
    fn copy_by_times(&mut self, moment: &[Waiting]) -> Result<(), Error> {
        let Some(About { driver_times, info, .. }) = &self.about else { return self.copy(moment) };
        let (driver_times, of_first) = (*driver_times, info.rate);
        let mut gaps = Vec::new();
        for of in moment {
            let Some((sensor, topic)) = of.own else { continue };
            if !topic.is_frame() {
                self.spacings.entry(sensor).and_modify(|spacing| spacing.lose(of.lost()));
                continue;
            }
            let rate = self.rates.get(usize::from(sensor)).copied().flatten().unwrap_or(of_first);
            let step = 1000.0 / rate.per_second();
            let is_after_damage = self.is_suspect && !self.spacings.contains_key(&sensor);
            let new = || Spacing::new(self.path.display().to_string(), Positions::Times, step);
            let spacing = self.spacings.entry(sensor).or_insert_with(new);
            if is_after_damage && driver_times {
                self.found.problem.get_or_insert_with(|| "has a damaged start, whose frames nothing counts".to_owned());
                gaps.push((sensor, self.suspects));
            } else if is_after_damage {
                // The first frame has the time 0.
                spacing.arrive(-step);
            }
            spacing.arrive(of.header.log_time as f64 / 1e6);
            (self.is_suspect, self.suspects) = (false, 0);
            for event in std::iter::from_fn(|| spacing.next_event()).collect::<Vec<_>>() {
                match event {
                    SourceEvent::Lost { frames, .. } => gaps.push((sensor, frames)),
                    SourceEvent::Fault(fault) => self.enter(sensor, fault_line(&fault))?,
                    _ => {}
                }
            }
        }
        self.copy_after_gaps(moment, &gaps)
    }

    fn copy(&mut self, moment: &[Waiting]) -> Result<(), Error> {
        let (is_own, path) = (self.about.is_some(), self.path);
        let failed = |error| not_written(path, error);
        let mut targets = Vec::with_capacity(moment.len());
        // All channels come before the first message.
        for message in moment {
            let own = message.own.filter(|_| is_own);
            targets.push(match own {
                Some((sensor, topic)) => Some((own, self.out.add_own(sensor, topic).map_err(failed)?)),
                None => self.foreign(message.header.channel_id)?.map(|number| (None, number)),
            });
        }
        for (message, target) in moment.iter().zip(targets) {
            let Some((own, channel_id)) = target else { continue };
            let header = MessageHeader { channel_id, ..message.header };
            if message.is_frame() {
                (self.time, self.found.frames) = (header.log_time, self.found.frames + 1);
            }
            let data = message.data();
            let is_event = matches!(message.own, Some((_, Topic::EventsJson)));
            self.found.events += u64::from(is_event && data.starts_with(br#"{"kind":"event""#));
            self.out.write_message(own, &header, data).map_err(failed)?;
        }
        self.out.end_moment().map_err(failed)
    }

    /// Returns the number of another program's channel in the new file; `None` if nothing describes it.
    fn foreign(&mut self, old: u16) -> Result<Option<u16>, Error> {
        let Some((channel, known)) = self.channels.get(&old) else {
            self.doubt(format!("has messages of channel {old}, which nothing describes"));
            return Ok(None);
        };
        let schema = self.schemas.get(&channel.schema_id);
        self.found.doubtful += u64::from(!known || schema.is_some_and(|(_, known)| !known));
        if let Some(&number) = self.numbers.get(&old) {
            return Ok(Some(number));
        }
        let number = self.out.add_foreign(channel, schema.map(|(schema, _)| schema));
        let number = number.map_err(|error| not_written(self.path, error))?;
        self.numbers.insert(old, number);
        Ok(Some(number))
    }

    /// Enters frames of a sensor that are missing as lost, before a message.
    fn enter_lost(&mut self, sensor: u8, frames: u64, before: Option<&Waiting>) -> Result<(), Error> {
        if frames == 0 || self.about.is_none() {
            return Ok(());
        }
        if self.out.tally.all.all() == 0
            && let Some(message) = before
        {
            self.time = message.header.log_time;
        }
        self.found.damaged = self.found.damaged.saturating_add(frames);
        self.entered.entry(sensor).and_modify(|all| *all = all.saturating_add(frames)).or_insert(frames);
        self.enter(sensor, lost_line(frames, "damaged in the recording"))
    }

    /// Enters a line of JSON about a sensor's source.
    fn enter(&mut self, sensor: u8, data: Vec<u8>) -> Result<(), Error> {
        let line = Message { sensor, topic: Topic::FaultsJson, time: self.time, taken: self.time, sequence: 0, data };
        self.out.write(&[line]).map_err(|error| not_written(self.path, error))
    }

    fn finish(mut self, new: &File) -> Result<Recovered, Error> {
        self.found.bytes = self.out.finish().map_err(|error| not_written(self.path, error))?;
        let mut found = self.found;
        // Frames that were moved are entered as lost where they were, unless two are of one place.
        if self.others > if self.is_over { 0 } else { found.damaged } {
            let others = counted(self.others, "frame");
            found.problem.get_or_insert_with(|| format!("has {others} of another recording, which were not copied"));
        }
        if found.frames == 0 {
            let what = match (found.damaged, found.unread) {
                (0, Some(unread)) => format!("{} that are no complete record", counted(unread.bytes, "byte")),
                (0, None) => format!("the topics {}", self.own.names()),
                (damaged, _) => {
                    format!("{} that no checksum vouches for or that are missing", counted(damaged, "frame"))
                }
            };
            found.problem.get_or_insert_with(|| format!("has no frame that can be recovered (found {what})"));
        }
        if found.problem.is_none() && self.about.is_some() {
            // Whatever a damaged recording says, the new one must be readable.
            let new = PathBuf::from(format!("/proc/self/fd/{}", new.as_raw_fd()));
            let new = if new.exists() { &new } else { self.path };
            let names: Vec<_> = self.own.sensors.names().iter().map(|name| Some(name.as_str())).collect();
            let names = if names.is_empty() { &[None][..] } else { &names };
            found.problem = names
                .iter()
                .find_map(|name| read_all(new, *name).err())
                .map(|error| format!("cannot be read again: {}", error.message()));
        }
        give_back_of_killed(self.old);
        Ok(found)
    }
}

fn read_all(path: &Path, sensor: Option<&str>) -> Result<(), Error> {
    let mut source = McapSource::open_sensor(path, sensor, None)?;
    // A law that was removed is no damage: `--config` gives the recording another.
    let config = Config::parse_recorded(&source.about().configuration)?;
    crate::session::Processor::new(source.info(), &config, crate::output::OutputOptions::default())?;
    while !matches!(source.next_event()?, SourceEvent::End) {}
    Ok(())
}
