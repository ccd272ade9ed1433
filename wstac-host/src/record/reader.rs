//! Reads a recording that was finished, and believes none that is damaged.
//!
//! Every frame's chunk has a checksum, the whole data have one, and the index says how many messages there are. Every
//! moment's checksum has its place in the stream, and the record at the end has the number of all frames. So a recording
//! that is read to its end without an error is whole, and in its order.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use mcap::records::op;

use super::file::{Sensors, Topic};
use super::recorder::lost_frames;
use super::sums::{Stated, Sum, Tally, sound_metadata};
use super::walk::{Crc, MessageBody, Mode, Outline, Span, Step, Walk, outline};
use crate::error::{Error, ErrorKind};

/// The next part of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Item {
    /// A message of this channel.
    Message(u16),
    /// A schema or a channel, by its operation code.
    Definition(u8),
    /// The end.
    End,
}

/// A recording that is read.
#[derive(Debug)]
pub(crate) struct Reader {
    subject: String,
    walk: Walk,
    /// The record that was found last, and its body once it was read.
    span: Option<Span>,
    body: Vec<u8>,
    /// Channels that were described so far.
    channels: BTreeSet<u16>,
    /// Messages of each channel so far.
    messages: BTreeMap<u16, u64>,
    /// The statements of the recording about its frames; `None` if it has no checksums.
    stated: Option<Stated>,
    /// The frames so far.
    tally: Tally,
    sensors: Sensors,
}

impl Reader {
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
        let stated = Some(Stated::of(&outline.metadata)).filter(|stated| stated.has_sums);
        if stated.as_ref().is_some_and(|stated| stated.end.is_none()) {
            return Err(damaged(&subject, "lacks the record of how many frames it had"));
        }
        if stated.as_ref().is_some_and(|stated| stated.has_other_end) {
            return Err(damaged(&subject, "has the ends of several recordings"));
        }
        Ok((Self { subject, walk, span: None, body, channels, messages, stated, tally, sensors }, outline))
    }

    /// Returns an error about a damaged part.
    pub(crate) fn damaged(&self, what: impl fmt::Display) -> Error {
        damaged(&self.subject, what)
    }

    /// Goes on to the next message or definition.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged.
    pub(crate) fn next(&mut self) -> Result<Item, Error> {
        loop {
            self.span = None;
            match self.walk.next().map_err(|error| Error::io(&self.subject, error))? {
                Step::Record(_) if self.walk.crc() == Crc::Bad => {
                    return Err(self.damaged("has a chunk whose bytes are not those that were written"));
                }
                Step::Record(span) => {
                    self.span = Some(span);
                    match span.op {
                        op::SCHEMA => return Ok(Item::Definition(span.op)),
                        op::CHANNEL => {
                            let start = self.walk.start_of(span, 2).map_err(|error| Error::io(&self.subject, error))?;
                            self.channels.extend(start.first_chunk().map(|id| u16::from_le_bytes(*id)));
                            return Ok(Item::Definition(span.op));
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
                            self.count(channel)?;
                            return Ok(Item::Message(channel));
                        }
                        _ => {}
                    }
                }
                Step::ChunkEnd => {}
                Step::Damage(unread) => return Err(self.damaged(format_args!("is damaged at byte {}", unread.at))),
                Step::End { whole: false } => return Err(self.damaged("breaks off")),
                Step::End { whole: true } => return self.check_end().map(|()| Item::End),
            }
        }
    }

    /// Counts the frames of a message, and checks its place if it is a checksum.
    fn count(&mut self, channel: u16) -> Result<(), Error> {
        if self.stated.is_none() {
            return Ok(());
        }
        match self.sensors.topic(channel) {
            Some((sensor, topic)) if topic.is_frame() => self.tally.add_frame(sensor),
            Some((sensor, Topic::FaultsJson)) => {
                self.load()?;
                let lost = self.message().map_or(0, |message| lost_frames(message.data));
                self.tally.add_lost(sensor, lost);
            }
            Some((_, Topic::Sums)) => {
                self.load()?;
                let sum = self.message().and_then(|message| Sum::parse(message.data));
                let sum = sum.ok_or_else(|| self.damaged("has a checksum that is none"))?;
                if !sum.tally().agrees(&self.tally) {
                    return Err(self.has_other_frames(&sum.tally(), " up to a checksum"));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Returns an error about frames that are not those that were recorded.
    fn has_other_frames(&self, recorded: &Tally, up_to: &str) -> Error {
        let (found, expected) = (self.tally.all.all(), recorded.all.all());
        if found == expected {
            return self.damaged(format_args!("has {found} frames{up_to}, expected others of its sensors"));
        }
        self.damaged(format_args!("has {found} frames{up_to}, expected {expected}"))
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
        let Some(recorded) = recorded else { return Ok(()) };
        for (channel, recorded) in recorded {
            let found = self.messages.get(channel).copied().unwrap_or(0);
            if found != *recorded {
                let message = format_args!("has {found} messages of channel {channel}, expected {recorded}");
                return Err(self.damaged(message));
            }
        }
        Ok(())
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

    /// Returns the body that was read last.
    pub(crate) fn body(&self) -> &[u8] {
        &self.body
    }

    /// Returns the message that was read last.
    pub(crate) fn message(&self) -> Option<MessageBody<'_>> {
        MessageBody::parse(&self.body)
    }
}

/// Returns an error about a damaged part of a recording.
pub(crate) fn damaged(subject: &str, what: impl fmt::Display) -> Error {
    Error::new(
        ErrorKind::Format,
        subject,
        format_args!("{what}; wstac recover makes a whole recording of what is not damaged"),
    )
}
