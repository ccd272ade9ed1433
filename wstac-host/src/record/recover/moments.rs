//! The moments whose checksums are right, and the frames of each sensor that are missing before them.

use std::collections::BTreeMap;

use super::{Recovery, Waiting};
use crate::error::Error;
use crate::record::file::Topic;
use crate::record::limits::{MOST_MESSAGE, MOST_PENDING};
use crate::record::recorder::lost_frames;
use crate::record::summary::HEAD;
use crate::record::sums::{self, Counts, MomentSum, Sum, UNCOVERED};
use crate::record::walk::{Crc, MESSAGE_HEADER, MessageBody, Span};

/// Most bytes of the data of a checksum's message.
const MOST_SUM: usize = 1 << 11;
/// Bytes of a message's body that say whether it is a checksum.
pub(super) const SUM_START: usize = MESSAGE_HEADER as usize + sums::START.len();

/// Returns whether a message with this start is a checksum, whatever its channel is.
pub(super) fn looks_like_sum(start: &[u8]) -> bool {
    start.ends_with(sums::START)
}

/// The frames of a sensor that are missing before a moment.
#[derive(Clone, Copy, Debug)]
struct Missing {
    /// Lost frames that stood before the sensor's first frame.
    leading: u64,
    /// Frames behind the sensor's first one, or in place of it.
    gap: u64,
    /// Whether no frame of the sensor was found yet, and this moment has none either.
    is_early: bool,
}

impl Recovery<'_> {
    /// Takes a checksum, which ends a moment.
    pub(super) fn sum(&mut self, span: Span) -> Result<(), Error> {
        let body = self.walk.start_of(span, MOST_SUM)?.to_vec();
        let Some(message) = MessageBody::parse(&body) else { return self.flush() };
        let Some(sum) = Sum::parse(message.data).filter(|sum| sum.bytes <= 2 * MOST_MESSAGE) else {
            return self.flush();
        };
        let from = span.at.saturating_sub(sum.bytes);
        let covered = span.end().saturating_sub(UNCOVERED);
        let is_in_place = self.sorted.is_none() && sum.bytes <= span.at;
        if is_in_place && sum.crc() == Some(self.walk.hash(from, covered)?) {
            // Messages before the moment have lost their own checksum.
            let moment = self.walk.messages(from, span.at, MOST_PENDING)?;
            self.pending.retain(|pending| pending.span.at < from);
            self.flush()?;
            let Some(spans) = moment else { return Ok(()) };
            let (crc, mut moment) = (self.walk.crc, Vec::with_capacity(spans.len()));
            for span in spans {
                // The numbers are those that this program gave: the checksum has them.
                let channel = self.walk.channel_of(span)?;
                let own = self.sensors.topic(channel);
                moment.push(Waiting { span, channel, own, crc, is_unfinished: false, body: None });
            }
            return self.sound_moment(&moment, &sum);
        }
        let is_good = self.walk.crc == Crc::Good;
        if let Some(start) = self.summed_from(&message, &sum)? {
            let moment = self.pending.split_off(start);
            self.flush()?;
            // Other programs' messages between those of the moment are none of it.
            let (moment, others): (Vec<_>, _) =
                moment.into_iter().partition(|of| of.own.is_some() || of.crc == Crc::Good);
            self.leave(&others);
            return self.sound_moment(&moment, &sum);
        }
        if is_good && self.fits(&message, &sum)? {
            self.held = 0;
            let moment = std::mem::take(&mut self.pending);
            return self.sound_moment(&moment, &sum);
        }
        if is_good && self.sorted.is_none() {
            self.doubt("has other messages than those that were recorded, or has them in another order");
        }
        self.flush()
    }

    /// Returns the first of the waiting messages that a checksum is of; `None` if it is not right.
    ///
    /// The channels may have other numbers than this program gave them, and other messages may stand between.
    fn summed_from(&mut self, message: &MessageBody<'_>, sum: &Sum) -> Result<Option<usize>, Error> {
        let mut bytes = 0_u64;
        let start =
            self.pending.iter().enumerate().rev().filter(|(_, of)| of.own.is_some()).find_map(|(number, of)| {
                bytes += HEAD + of.span.length;
                (bytes >= sum.bytes).then_some(number)
            });
        let Some(start) = start.filter(|_| bytes == sum.bytes) else { return Ok(None) };
        let (pending, mut moment) = (std::mem::take(&mut self.pending), MomentSum::default());
        for of in pending.iter().skip(start) {
            let Some((sensor, topic)) = of.own else { continue };
            self.read(of)?;
            if let Some(message) = MessageBody::parse(&self.body) {
                moment.add(&message.header(topic.number(sensor)), message.data);
            }
        }
        self.pending = pending;
        let header = message.header(Topic::Sums.number(0));
        Ok(moment.agrees(&header, message.data, sum).then_some(start))
    }

    /// Returns whether the waiting messages are a moment by the checksums of their chunks, by their times and by the
    /// counts of a checksum that stands in such a chunk.
    fn fits(&mut self, message: &MessageBody<'_>, sum: &Sum) -> Result<bool, Error> {
        let pending = std::mem::take(&mut self.pending);
        let (mut time, mut frames) = (None, Vec::new());
        for of in pending.iter().filter(|of| of.own.is_some()) {
            self.read(of)?;
            let logged = MessageBody::parse(&self.body).map(|message| message.times[0]);
            time = time.max(logged);
            frames.extend(logged.filter(|_| of.is_frame()));
        }
        let found = self.frames_of(&pending)?;
        // A moment has one frame at most, which has its time.
        let is_of_time =
            time == Some(message.times[0]) && frames.len() < 2 && frames.iter().all(|of| Some(*of) == time);
        let is_good = pending.iter().all(|of| of.crc == Crc::Good);
        self.pending = pending;
        let Some(known) = sum.tally().told_apart(self.sensors.count()) else { return Ok(false) };
        let there = &self.out.tally;
        Ok(is_good
            && is_of_time
            && found.iter().all(|(&sensor, of_moment)| {
                let (known, there) = (known.of(sensor), there.of(sensor));
                there.frames.saturating_add(of_moment.frames) <= known.frames
                    && there.all().saturating_add(of_moment.all()) <= known.all()
            }))
    }

    /// Copies a moment whose checksum is right, and enters the frames that are missing before it.
    ///
    /// If a recording of several sensors counts the frames of all together, nobody knows of which sensor missing ones
    /// are. Then everything behind them is left out.
    fn sound_moment(&mut self, moment: &[Waiting], sum: &Sum) -> Result<(), Error> {
        let own = self.frames_of(moment)?;
        (self.is_suspect, self.suspects) = (false, 0);
        self.spacings.clear();
        let known = sum.tally().told_apart(self.sensors.count());
        let (place, crc) = sum.key();
        let of_moment = own.values().fold(0_u64, |all, counts| all.saturating_add(counts.all()));
        let (before, there) = (place.saturating_sub(of_moment), self.out.tally.all.all());
        let key = (place, own.values().any(|counts| counts.frames > 0));
        // Other programs' messages may be alike.
        let is_own = moment.iter().any(|of| of.own.is_some());
        let is_copy = if is_own { self.copied.is_copy(key, crc) } else { None };
        // Two frames of one place are of two recordings.
        let is_other = (key.1 && is_copy == Some(false)) || (is_copy.is_none() && self.is_over && self.others > 0);
        let is_there = !is_other && (is_copy == Some(true) || (known.is_none() && before < there));
        self.is_over |= is_other || (known.is_none() && before > there);
        if is_there || is_other {
            self.leave_out(&own, is_other);
        }
        if is_there || self.is_over {
            return Ok(());
        }
        let mut gaps = Vec::new();
        if let Some(known) = known {
            if self.known.as_ref().is_none_or(|last| last.all.all() <= known.all.all()) {
                self.known = Some(known.clone());
            }
            for (&sensor, &of_moment) in &own {
                let Some(missing) = missing_before(of_moment, known.of(sensor), self.out.tally.of(sensor)) else {
                    // It stands behind one that came later.
                    self.leave_out(&own, true);
                    return Ok(());
                };
                if missing.is_early {
                    // Frames were recorded before it, and none was found yet. The next frame's gap has these, too.
                    return Ok(());
                }
                gaps.push((sensor, missing));
            }
        }
        for &(sensor, Missing { leading, .. }) in &gaps {
            self.enter_lost(sensor, leading, moment.first())?;
        }
        self.copied.add(key, crc);
        let gaps: Vec<_> = gaps.into_iter().map(|(sensor, missing)| (sensor, missing.gap)).collect();
        self.copy_after_gaps(moment, &gaps)
    }

    /// Counts frames of a moment that is not copied, because it is there already or `is_other`.
    fn leave_out(&mut self, own: &BTreeMap<u8, Counts>, is_other: bool) {
        let frames = own.values().map(|counts| counts.frames).sum::<u64>();
        self.found.repeated = self.found.repeated.saturating_add(frames);
        self.others = self.others.saturating_add(if is_other { frames } else { 0 });
    }

    /// Returns the frames of a moment, found and lost, of each sensor that it is of.
    fn frames_of(&mut self, moment: &[Waiting]) -> Result<BTreeMap<u8, Counts>, Error> {
        let mut found = BTreeMap::<u8, Counts>::new();
        for of in moment {
            let Some((sensor, topic)) = of.own else { continue };
            let counts = found.entry(sensor).or_default();
            if topic.is_frame() {
                counts.frames += 1;
            } else if topic == Topic::FaultsJson {
                self.read(of)?;
                let message = MessageBody::parse(&self.body);
                counts.lost = counts.lost.saturating_add(message.map_or(0, |message| lost_frames(message.data)));
            }
        }
        if found.is_empty() {
            found.insert(0, Counts::default());
        }
        Ok(found)
    }

    /// Copies a moment before which frames of sensors are missing.
    ///
    /// Only what is behind the first frame has a place in time. So if the start is missing, the first frame that was
    /// found stands for it: the gap comes behind that frame, and all others keep their numbers.
    pub(super) fn copy_after_gaps(&mut self, moment: &[Waiting], gaps: &[(u8, u64)]) -> Result<(), Error> {
        let has_started = |of: &Self, sensor| of.out.tally.of(sensor).frames > 0;
        let (before, behind): (Vec<_>, Vec<_>) = gaps.iter().partition(|(sensor, _)| has_started(self, *sensor));
        for (sensor, gap) in before {
            self.enter_lost(sensor, gap, None)?;
        }
        self.copy(moment)?;
        for (sensor, gap) in behind {
            self.enter_lost(sensor, gap, None)?;
        }
        Ok(())
    }
}

/// Returns the frames of a sensor that are missing before a moment; `None` if it stands behind a later one.
///
/// `known` is what the sensor had with the moment, and `there` is what it has in the new file.
fn missing_before(of_moment: Counts, known: Counts, there: Counts) -> Option<Missing> {
    let Counts { frames, lost, .. } = of_moment;
    let all_before = known.all().saturating_sub(of_moment.all());
    if all_before < there.all() {
        return None;
    }
    let frames_before = known.frames.saturating_sub(frames).saturating_sub(there.frames);
    let is_early = there.frames == 0 && frames_before > 0 && frames == 0;
    let before = known.place.saturating_sub(frames.saturating_add(if known.frames == 0 { 0 } else { lost }));
    let gap = before.saturating_sub(there.place);
    let leading = if there.frames == 0 { all_before.saturating_sub(there.all()).saturating_sub(gap) } else { 0 };
    Some(Missing { leading, gap, is_early })
}
