//! Reads a recording that was finished, and believes none that is damaged.
//!
//! Every frame's chunk has a checksum, the whole data have one, and the index says how many messages there are. Every
//! moment's checksum has its place in the stream, and the record at the end has the number of all frames. So a
//! recording that is read to its end without an error is whole, and in its order.
//!
//! Other tools may have written it anew. Channels are found by their topics and schemas, whatever their numbers are.
//! The checksum of a moment is checked if that of a chunk is missing. If moments are not those that the checksums
//! count, all messages are put in order (`sorted`), and reading goes on behind the last moment that was right.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::path::Path;

use mcap::records::{MessageHeader, op};

use super::channels::Channels;
use super::file::{Sensors, Topic};
use super::limits::MOST_MESSAGE;
use super::sorted::{Index, OrderCheck, Sorted};
use super::sums::{MomentSum, Stated, Sum, Tally, sound_metadata};
use super::walk::{Crc, Mode, Outline, Span, Walk, WalkStep, message_of, outline};
use crate::error::{Error, ErrorKind};
use crate::plural::counted;

#[derive(Debug)]
pub(crate) struct RecordingReader {
    subject: String,
    walk: Walk,
    /// The sensor whose messages are given.
    sensor: u8,
    /// The message that was given last.
    body: Vec<u8>,
    /// The messages of the moment that was read, and memory for more.
    ready: VecDeque<(Topic, Vec<u8>)>,
    spare: Vec<Vec<u8>>,
    /// The number of moments that were read, and of those that were given.
    moments: u64,
    given: u64,
    order: OrderCheck,
    /// Whether the last error is about the order of messages.
    is_disordered: bool,
    /// The messages in their order, if the file has another one.
    sorted: Option<Sorted>,
    has_ended: bool,
    /// The channels of this program. The index may name them before they are described.
    own: Channels,
    /// Messages of each channel that was described so far.
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
        let mut walk = Walk::open(path, Mode::Outline)?;
        let recover = format!("wstac recover {subject} -o NEW.mcap makes a whole recording of what is in it");
        if !walk.has_magic {
            let hint = if walk.summary.is_some() { format!("; {recover}") } else { String::new() };
            return Err(Error::new(ErrorKind::Format, &subject, walk.other_start()? + &hint));
        }
        let outline = outline(&mut walk)?;
        if let Some(unread) = outline.unread.filter(|unread| unread.damaged) {
            let message = format_args!("is damaged at byte {}: {recover}", unread.at);
            return Err(Error::new(ErrorKind::Format, &subject, message));
        }
        if !outline.whole {
            return Err(Error::new(ErrorKind::Format, &subject, format_args!("was not finished: {recover}")));
        }
        let walk = Walk::open(path, Mode::Strict)?;
        let sensors = Sensors::of(&sound_metadata(&outline.metadata).0);
        let stated = Some(Stated::of(&outline.metadata)).filter(|stated| stated.has_sums);
        if stated.as_ref().is_some_and(|stated| stated.end.is_none()) {
            return Err(damaged(&subject, "lacks the record of how many frames it had"));
        }
        if stated.as_ref().is_some_and(|stated| stated.has_other_end) {
            return Err(damaged(&subject, "has the ends of several recordings"));
        }
        let definitions = walk.summary.as_ref().map(|summary| summary.definitions.clone()).unwrap_or_default();
        let mut reader = Self {
            subject,
            walk,
            sensor: 0,
            body: Vec::new(),
            ready: VecDeque::new(),
            spare: Vec::new(),
            moments: 0,
            given: 0,
            order: OrderCheck::default(),
            is_disordered: false,
            sorted: None,
            has_ended: false,
            tally: Tally::new(sensors.count()),
            own: Channels::new(sensors),
            messages: BTreeMap::new(),
            stated,
            moment: None,
        };
        for (op, body) in definitions {
            reader.define(op, &body)?;
        }
        if reader.stated.is_none() && reader.is_in_other_order()? {
            reader.sort()?;
        }
        Ok((reader, outline))
    }

    /// Returns whether every frame has a checksum of its own, as far as it is known.
    pub(crate) fn has_sums(&self) -> bool {
        self.stated.is_some() && self.sorted.as_ref().is_none_or(|sorted| sorted.has_sums)
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

    /// Gives only messages of this sensor from now on.
    pub(crate) fn select(&mut self, sensor: u8) {
        self.sensor = sensor;
    }

    /// Goes on to the next message of the sensor: a frame, a fault or a time. Returns its topic; `None` at the end.
    ///
    /// It is given when the checksum of its moment was read.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged.
    pub(crate) fn next(&mut self) -> Result<Option<Topic>, Error> {
        loop {
            if let Some((topic, body)) = self.ready.pop_front() {
                self.spare.push(std::mem::replace(&mut self.body, body));
                return Ok(Some(topic));
            }
            match self.read_moment() {
                Ok(true) if self.moments <= self.given => self.ready.clear(),
                Ok(true) => self.given = self.moments,
                Ok(false) => return Ok(None),
                Err(_) if self.is_disordered && self.sorted.is_none() => self.sort()?,
                Err(error) => return Err(error),
            }
        }
    }

    /// Reads the messages of a moment, up to its checksum. Returns false at the end.
    fn read_moment(&mut self) -> Result<bool, Error> {
        let mut bytes = 0;
        while let Some(span) = self.next_message()? {
            let Some((sensor, topic, is_in_order)) = self.own_message(span)? else { continue };
            if self.stated.is_some() && self.sorted.is_none() && !is_in_order {
                return Err(self.disordered("has a frame or a checksum in another place than it was recorded in"));
            }
            let is_given =
                sensor == self.sensor && (topic.is_frame() || matches!(topic, Topic::FaultsJson | Topic::Clock));
            let is_unsure = self.stated.is_some() && (self.walk.crc != Crc::Good || self.moment.is_some());
            let mut body = self.spare.pop().unwrap_or_default();
            body.clear();
            if is_given || is_unsure || matches!(topic, Topic::FaultsJson | Topic::Sums) {
                self.walk.body(span, &mut body)?;
            }
            if is_unsure {
                self.sum_up(sensor, topic, &body)?;
            }
            let data = message_of(&body).map_or(&[][..], |(_, data)| data);
            self.tally.add(sensor, topic, data);
            if topic == Topic::Sums && self.stated.is_some() {
                let sum = Sum::parse(data).ok_or_else(|| self.damaged("has a checksum that is none"))?;
                if !sum.tally.agrees(&self.tally) {
                    self.is_disordered = true;
                    return Err(self.has_other_frames(&sum.tally, " up to a checksum"));
                }
                self.moments += 1;
                self.spare.push(body);
                return Ok(true);
            }
            bytes += body.len() as u64;
            if is_given {
                self.ready.push_back((topic, body));
            } else {
                self.spare.push(body);
            }
            if !self.has_sums() {
                self.moments += 1;
                return Ok(true);
            }
            if bytes > 2 * MOST_MESSAGE {
                return Err(self.disordered(format_args!("has {} MB before a checksum", bytes >> 20)));
            }
        }
        if !std::mem::replace(&mut self.has_ended, true) {
            self.check_end()?;
        }
        Ok(!self.ready.is_empty())
    }

    /// Returns an error about the order of messages.
    fn disordered(&mut self, what: impl fmt::Display) -> Error {
        self.is_disordered = true;
        self.damaged(what)
    }

    /// Puts all messages in order. Moments that were given already are not given again.
    fn sort(&mut self) -> Result<(), Error> {
        self.rewind()?;
        let mut index = Index::default();
        while let Some(span) = self.next_message()? {
            index.add(&mut self.walk, span)?;
        }
        let (own, sensors) = (&self.own, self.tally.each.len().max(1));
        self.sorted = Some(index.sort(&mut self.walk, sensors, |channel| own.of(channel))?);
        Ok(())
    }

    /// Returns whether frames of a recording without checksums are not in the order of their times.
    fn is_in_other_order(&mut self) -> Result<bool, Error> {
        while let Some(span) = self.next_message()? {
            self.own_message(span)?;
        }
        let is_other = self.order.is_other(false);
        self.rewind()?;
        Ok(is_other)
    }

    /// Returns the sensor and the topic of a message of this program, and whether it stands where it was recorded.
    fn own_message(&mut self, span: Span) -> Result<Option<(u8, Topic, bool)>, Error> {
        let header = self.walk.header_of(span)?;
        let own = header.and_then(|header| Some((self.own.of(header.channel_id)?, header)));
        Ok(own.map(|((sensor, topic), header)| (sensor, topic, self.order.add(sensor, topic, &header))))
    }

    fn rewind(&mut self) -> Result<(), Error> {
        self.walk.rewind()?;
        self.messages.clear();
        self.ready.clear();
        (self.tally, self.moment, self.moments) = (Tally::new(self.tally.each.len()), None, 0);
        self.order = OrderCheck::default();
        Ok(())
    }

    /// Returns the next message; `None` at the end of a file that is whole.
    fn next_message(&mut self) -> Result<Option<Span>, Error> {
        if let Some(sorted) = &mut self.sorted {
            return sorted.next(&mut self.walk);
        }
        loop {
            match self.walk.next()? {
                WalkStep::Record(_) if self.walk.crc == Crc::Bad => {
                    return Err(self.damaged("has a chunk whose bytes are not those that were written"));
                }
                WalkStep::Record(span) => match span.op {
                    op::SCHEMA | op::CHANNEL => {
                        let mut body = Vec::new();
                        self.walk.body(span, &mut body)?;
                        if let Some(id) = body.first_chunk().filter(|_| span.op == op::CHANNEL) {
                            self.messages.entry(u16::from_le_bytes(*id)).or_default();
                        }
                        self.define(span.op, &body)?;
                    }
                    op::MESSAGE => {
                        let channel = self.walk.header_of(span)?.map_or(0, |header| header.channel_id);
                        let Some(count) = self.messages.get_mut(&channel) else {
                            let what = format_args!("has a message of channel {channel}, which nothing describes");
                            return Err(self.damaged(what));
                        };
                        *count = count.saturating_add(1);
                        return Ok(Some(span));
                    }
                    _ => {}
                },
                WalkStep::ChunkEnd => {}
                WalkStep::Damage(unread) => return Err(self.damaged(format_args!("is damaged at byte {}", unread.at))),
                WalkStep::End { whole: false } => return Err(self.damaged("breaks off")),
                WalkStep::End { whole: true } => return self.check_total().map(|()| None),
            }
        }
    }

    /// Checks the bytes of a moment whose chunk has no checksum, by its own.
    fn sum_up(&mut self, sensor: u8, topic: Topic, body: &[u8]) -> Result<(), Error> {
        let mut moment = self.moment.take().unwrap_or_default();
        let Some((header, data)) = message_of(body) else { return Ok(()) };
        let header = MessageHeader { channel_id: topic.number(sensor), ..header };
        if topic != Topic::Sums {
            moment.add(&header, data);
            self.moment = Some(moment);
        } else if !Sum::parse(data).is_some_and(|sum| moment.agrees(&header, data, &sum)) {
            let what = "has messages in no chunk with a checksum, and their own checksum is not right: they are damaged, or \
                        another tool changed them or their order";
            return Err(self.disordered(what));
        }
        Ok(())
    }

    /// Returns an error about frames that are not those that were recorded.
    fn has_other_frames(&self, recorded: &Tally, up_to: &str) -> Error {
        if !self.own.has_frames() {
            return self.has_none();
        }
        let (all, expected) = (self.tally.all.all(), recorded.all.all());
        let found = counted(all, "frame");
        if all == expected {
            return self.damaged(format_args!("has {found}{up_to}, but not those that its sensors had"));
        }
        self.damaged(format_args!("has {found}{up_to}, expected {expected}"))
    }

    /// Returns the error about a recording without a frame.
    fn has_none(&self) -> Error {
        let lost = self.tally.all.lost;
        let message = if self.own.has_frames() {
            format!("has no frame (found {})", counted(lost, "lost frame"))
        } else {
            let expected = [super::CAMERA, super::TAXEL_SUMS].join(" or ");
            format!("has no frame (found the topics {}, expected {expected})", self.own.names())
        };
        Error::new(ErrorKind::Format, &self.subject, message)
    }

    /// Checks that all frames are there that were written.
    fn check_end(&mut self) -> Result<(), Error> {
        if let Some(end) = self.stated.as_ref().and_then(|stated| stated.end.as_ref())
            && !end.agrees(&self.tally)
        {
            return Err(self.has_other_frames(end, ""));
        }
        if self.moment.is_some() {
            return Err(self.damaged("has messages at its end that no checksum vouches for"));
        }
        if self.tally.all.frames == 0 { Err(self.has_none()) } else { Ok(()) }
    }

    /// Checks that all bytes and messages are there that were written.
    fn check_total(&mut self) -> Result<(), Error> {
        if self.walk.check_total()? == Some(false) {
            return Err(self.damaged("has other bytes than those that were written"));
        }
        let recorded = self.walk.summary.as_ref().and_then(|summary| summary.messages.as_ref());
        for (channel, recorded) in recorded.into_iter().flatten() {
            let found = self.messages.get(channel).copied().unwrap_or(0);
            if found != *recorded {
                let message = format_args!("has {found} messages of channel {channel}, expected {recorded}");
                return Err(self.damaged(message));
            }
        }
        Ok(())
    }

    /// Returns the message that was given last.
    pub(crate) fn message(&self) -> Option<(MessageHeader, &[u8])> {
        message_of(&self.body)
    }
}

fn damaged(subject: &str, what: impl fmt::Display) -> Error {
    let message = format_args!("{what}; wstac recover makes a whole recording of what is not damaged");
    Error::new(ErrorKind::Format, subject, message)
}
