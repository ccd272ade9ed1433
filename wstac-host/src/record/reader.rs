//! Reads a recording that was finished, and believes none that is damaged.
//!
//! Every frame's chunk has a checksum, the whole data have one, and the index says how many messages there are. Every
//! moment's checksum has its place in the stream, and the record at the end has the number of all frames. So a recording
//! that is read to its end without an error is whole, and in its order.
//!
//! Other tools may have written it anew. Channels are found by their topics and schemas, whatever their numbers are. The
//! checksum of a moment is checked if that of a chunk is missing.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use mcap::records::op;

use super::channels::Channels;
use super::file::{Sensors, Topic};
use super::sums::{MomentSum, Stated, Sum, Tally, sound_metadata};
use super::walk::{Crc, MessageBody, Mode, Outline, Span, Walk, WalkStep, outline};
use crate::error::{Error, ErrorKind};
use crate::plural::counted;

#[derive(Debug)]
pub(crate) struct RecordingReader {
    subject: String,
    walk: Walk,
    /// The record that was found last, and its body once it was read.
    span: Option<Span>,
    body: Vec<u8>,
    /// Channels that were described so far, and those of this program. The index may name those before they are described.
    channels: BTreeSet<u16>,
    own: Channels,
    /// Messages of each channel so far.
    messages: BTreeMap<u16, u64>,
    /// The statements of the recording about its frames; `None` if it has no checksums.
    stated: Option<Stated>,
    /// The frames so far.
    tally: Tally,
    /// The messages of the moment that is read if a part of it stands in no chunk with a checksum.
    moment: Option<MomentSum>,
}

impl RecordingReader {
    /// Opens a recording, and returns its description, too.
    ///
    /// # Errors
    /// The file cannot be read, is no MCAP file, is damaged, or was not finished. The error says which, and what to do.
    pub(crate) fn open(path: &Path) -> Result<(Self, Outline), Error> {
        let subject = path.display().to_string();
        let failed = |error| Error::io(&subject, error);
        let mut walk = Walk::open(path, Mode::Outline)?;
        let recover = format!("wstac recover {subject} -o NEW.mcap makes a whole recording of what is in it");
        if !walk.has_magic() {
            let found = walk.first_bytes().map_err(failed)?;
            let hint = if walk.summary().is_some() { format!("; {recover}") } else { String::new() };
            let message = format!("starts with \"{found}\", expected an MCAP file, which starts with \"\\x89MCAP0\"");
            return Err(Error::new(ErrorKind::Format, &subject, format_args!("{message}{hint}")));
        }
        let outline = outline(&mut walk).map_err(failed)?;
        if let Some(unread) = outline.unread.filter(|unread| unread.damaged) {
            let message = format_args!("is damaged at byte {}: {recover}", unread.at);
            return Err(Error::new(ErrorKind::Format, &subject, message));
        }
        if !outline.whole {
            return Err(Error::new(ErrorKind::Format, &subject, format_args!("was not finished: {recover}")));
        }
        let walk = Walk::open(path, Mode::Strict)?;
        let (body, channels, messages) = Default::default();
        let sensors = Sensors::of(&sound_metadata(&outline.metadata).0);
        let tally = Tally::new(sensors.count());
        let own = Channels::new(sensors);
        let stated = Some(Stated::of(&outline.metadata)).filter(|stated| stated.has_sums);
        if stated.as_ref().is_some_and(|stated| stated.end.is_none()) {
            return Err(damaged(&subject, "lacks the record of how many frames it had"));
        }
        if stated.as_ref().is_some_and(|stated| stated.has_other_end) {
            return Err(damaged(&subject, "has the ends of several recordings"));
        }
        let definitions = walk.summary().map(|summary| summary.definitions.clone()).unwrap_or_default();
        let mut reader = Self { subject, walk, span: None, body, channels, own, messages, stated, tally, moment: None };
        for (op, body) in definitions {
            reader.define(op, &body)?;
        }
        Ok((reader, outline))
    }

    /// Returns whether every frame has a checksum of its own.
    pub(crate) fn has_sums(&self) -> bool {
        self.stated.is_some()
    }

    /// Notes a schema or a channel.
    fn define(&mut self, op: u8, body: &[u8]) -> Result<(), Error> {
        let known = self.own.prefix().map(str::to_owned);
        self.own.define(op, body).map_err(|error| damaged(&self.subject, error))?;
        let has_changed = self.tally.all.all() > 0 && known.as_deref() != self.own.prefix();
        let changed = has_changed.then(|| format!("has the topics of two recordings (found {})", self.own.names()));
        match changed.or_else(|| self.own.ambiguity()) {
            Some(message) => Err(Error::new(ErrorKind::Format, &self.subject, message)),
            None => Ok(()),
        }
    }

    pub(crate) fn damaged(&self, what: impl fmt::Display) -> Error {
        damaged(&self.subject, what)
    }

    /// Goes on to the next message of this program. Returns its sensor and topic; `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged.
    pub(crate) fn next(&mut self) -> Result<Option<(u8, Topic)>, Error> {
        loop {
            self.span = None;
            match self.walk.next().map_err(|error| Error::io(&self.subject, error))? {
                WalkStep::Record(_) if self.walk.crc() == Crc::Bad => {
                    return Err(self.damaged("has a chunk whose bytes are not those that were written"));
                }
                WalkStep::Record(span) => {
                    self.span = Some(span);
                    match span.op {
                        op::SCHEMA | op::CHANNEL => {
                            self.load()?;
                            let body = std::mem::take(&mut self.body);
                            if span.op == op::CHANNEL {
                                self.channels.extend(body.first_chunk().map(|id| u16::from_le_bytes(*id)));
                            }
                            self.define(span.op, &body)?;
                            self.body = body;
                        }
                        op::MESSAGE => {
                            let start = self.walk.start_of(span, 2).map_err(|error| Error::io(&self.subject, error))?;
                            let channel = start.first_chunk().map_or(0, |id| u16::from_le_bytes(*id));
                            if !self.channels.contains(&channel) {
                                let what = format_args!("has a message of channel {channel}, which nothing describes");
                                return Err(self.damaged(what));
                            }
                            let count = self.messages.entry(channel).or_default();
                            *count = count.saturating_add(1);
                            let Some((sensor, topic)) = self.own.of(channel) else { continue };
                            self.count(sensor, topic)?;
                            return Ok(Some((sensor, topic)));
                        }
                        _ => {}
                    }
                }
                WalkStep::ChunkEnd => {}
                WalkStep::Damage(unread) => return Err(self.damaged(format_args!("is damaged at byte {}", unread.at))),
                WalkStep::End { whole: false } => return Err(self.damaged("breaks off")),
                WalkStep::End { whole: true } => return self.check_end().map(|()| None),
            }
        }
    }

    /// Counts the frames of a message, and checks its place if it is a checksum.
    fn count(&mut self, sensor: u8, topic: Topic) -> Result<(), Error> {
        self.sum_up(sensor, topic)?;
        if matches!(topic, Topic::FaultsJson | Topic::Sums) {
            self.load()?;
        }
        let data = MessageBody::parse(&self.body).map_or(&[][..], |message| message.data);
        self.tally.add(sensor, topic, data);
        if topic == Topic::Sums && self.stated.is_some() {
            let sum = Sum::parse(data).ok_or_else(|| self.damaged("has a checksum that is none"))?;
            if !sum.tally().agrees(&self.tally) {
                return Err(self.has_other_frames(&sum.tally(), " up to a checksum"));
            }
        }
        Ok(())
    }

    /// Checks the bytes of a moment whose chunk has no checksum, by its own.
    fn sum_up(&mut self, sensor: u8, topic: Topic) -> Result<(), Error> {
        if self.stated.is_none() || (self.walk.crc() == Crc::Good && self.moment.is_none()) {
            return Ok(());
        }
        self.load()?;
        let moment = self.moment.take().unwrap_or_default();
        let Some(message) = self.message() else { return Ok(()) };
        let header = message.header(topic.number(sensor));
        if topic == Topic::Sums {
            let sum = Sum::parse(message.data);
            if sum.is_some_and(|sum| moment.agrees(&header, message.data, &sum)) {
                return Ok(());
            }
            let what = "has messages in no chunk with a checksum, and their own checksum is not right: they are damaged, or \
                        another tool changed them or their order";
            return Err(self.damaged(what));
        }
        let mut moment = moment;
        moment.add(&header, message.data);
        self.moment = Some(moment);
        Ok(())
    }

    /// Returns an error about frames that are not those that were recorded.
    fn has_other_frames(&self, recorded: &Tally, up_to: &str) -> Error {
        if !self.own.has_frames_and_sums().0 {
            return self.has_none();
        }
        let (all, expected) = (self.tally.all.all(), recorded.all.all());
        let found = counted(all, "frame");
        if all == expected {
            return self.damaged(format_args!("has {found}{up_to}, expected others of its sensors"));
        }
        self.damaged(format_args!("has {found}{up_to}, expected {expected}"))
    }

    /// Returns the error about a recording without a frame.
    fn has_none(&self) -> Error {
        let lost = self.tally.all.lost;
        let message = if self.own.has_frames_and_sums().0 {
            format!("has no frame (found {})", counted(lost, "lost frame"))
        } else {
            let expected = [super::CAMERA, super::TAXEL_SUMS].join(" or ");
            format!("has no frame (found the topics {}, expected {expected})", self.own.names())
        };
        Error::new(ErrorKind::Format, &self.subject, message)
    }

    /// Checks that everything is there that was written.
    fn check_end(&mut self) -> Result<(), Error> {
        if self.walk.check_total().map_err(|error| Error::io(&self.subject, error))? == Some(false) {
            return Err(self.damaged("has other bytes than those that were written"));
        }
        if let Some(end) = self.stated.as_ref().and_then(|stated| stated.end.as_ref())
            && !end.agrees(&self.tally)
        {
            return Err(self.has_other_frames(end, ""));
        }
        let recorded = self.walk.summary().and_then(|summary| summary.messages.as_ref());
        for (channel, recorded) in recorded.into_iter().flatten() {
            let found = self.messages.get(channel).copied().unwrap_or(0);
            if found != *recorded {
                let message = format_args!("has {found} messages of channel {channel}, expected {recorded}");
                return Err(self.damaged(message));
            }
        }
        if self.moment.is_some() {
            return Err(self.damaged("has messages at its end that no checksum vouches for"));
        }
        if self.tally.all.frames == 0 { Err(self.has_none()) } else { Ok(()) }
    }

    /// Reads the body of the record that was found last.
    ///
    /// # Errors
    /// The file cannot be read, or the record is too large.
    pub(crate) fn load(&mut self) -> Result<(), Error> {
        self.body.clear();
        let Some(span) = self.span else { return Ok(()) };
        self.walk.body(span, &mut self.body).map_err(|error| Error::io(&self.subject, error))
    }

    /// Returns the message that was read last.
    pub(crate) fn message(&self) -> Option<MessageBody<'_>> {
        MessageBody::parse(&self.body)
    }
}

pub(crate) fn damaged(subject: &str, what: impl fmt::Display) -> Error {
    Error::new(
        ErrorKind::Format,
        subject,
        format_args!("{what}; wstac recover makes a whole recording of what is not damaged"),
    )
}
