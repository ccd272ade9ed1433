//! The moments whose checksums are right, and the frames of each sensor that are missing before them.

use std::collections::BTreeMap;

use mcap::records::MessageHeader;

use super::{Recovery, Waiting};
use crate::error::Error;
use crate::record::bytes::HEAD;
use crate::record::file::Topic;
use crate::record::limits::{MOST_MESSAGE, MOST_PENDING};
use crate::record::sums::{Counts, MomentSum, Sum, UNCOVERED};
use crate::record::walk::Crc;

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
    pub(super) fn sum(&mut self, message: &Waiting) -> Result<(), Error> {
        let Some(sum) = Sum::parse(message.data()).filter(|sum| sum.bytes <= 2 * MOST_MESSAGE) else {
            return self.flush();
        };
        let span = message.span;
        let from = span.at.saturating_sub(sum.bytes);
        let covered = span.end().saturating_sub(UNCOVERED);
        let is_in_place = self.sorted.is_none() && sum.bytes <= span.at;
        if is_in_place && sum.crc() == Some(self.walk.hash(from, covered)?) {
            let spans = self.walk.messages(from, span.at, MOST_PENDING)?;
            let mut moment = Vec::new();
            for &span in spans.iter().flatten() {
                let there = self.pending.iter().rposition(|of| of.span == span).map(|at| self.pending.remove(at));
                let Some(of) = (if there.is_some() { there } else { self.read(span)? }) else { continue };
                // The numbers are those that this program gave: the checksum has them.
                moment.push(Waiting { own: self.own.sensors.topic(of.header.channel_id), ..of });
            }
            // Messages before the moment have lost their own checksum.
            self.pending.retain(|pending| pending.span.at < from);
            self.flush()?;
            return if spans.is_some() { self.sound_moment(&moment, &sum) } else { Ok(()) };
        }
        let is_good = self.walk.crc == Crc::Good;
        if let Some(start) = self.summed_from(message, &sum) {
            let moment = self.pending.split_off(start);
            self.flush()?;
            // Other programs' messages between those of the moment are none of it.
            let (moment, others): (Vec<_>, _) =
                moment.into_iter().partition(|of| of.own.is_some() || of.crc == Crc::Good);
            self.leave(&others);
            return self.sound_moment(&moment, &sum);
        }
        if is_good && self.fits(message.header.log_time, &sum) {
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
    fn summed_from(&self, message: &Waiting, sum: &Sum) -> Option<usize> {
        let mut bytes = 0_u64;
        let start =
            self.pending.iter().enumerate().rev().filter(|(_, of)| of.own.is_some()).find_map(|(number, of)| {
                bytes += HEAD + of.span.length;
                (bytes >= sum.bytes).then_some(number)
            });
        let start = start.filter(|_| bytes == sum.bytes)?;
        let mut moment = MomentSum::default();
        for of in self.pending.iter().skip(start) {
            if let Some((sensor, topic)) = of.own {
                moment.add(&MessageHeader { channel_id: topic.number(sensor), ..of.header }, of.data());
            }
        }
        let header = MessageHeader { channel_id: Topic::Sums.number(0), ..message.header };
        moment.agrees(&header, message.data(), sum).then_some(start)
    }

    /// Returns whether the waiting messages are a moment by the checksums of their chunks, by their times and by the
    /// counts of a checksum that stands in such a chunk.
    fn fits(&self, time: u64, sum: &Sum) -> bool {
        let last = self.pending.iter().filter(|of| of.own.is_some()).map(|of| of.header.log_time).max();
        // A moment has one frame at most, which has its time.
        let mut frames = self.pending.iter().filter(|of| of.is_frame());
        let is_of_time =
            last == Some(time) && frames.next().is_none_or(|of| of.header.log_time == time) && frames.next().is_none();
        let is_good = self.pending.iter().all(|of| of.crc == Crc::Good);
        let Some(known) = sum.tally.told_apart(self.own.sensors.count()) else { return false };
        let there = &self.out.tally;
        is_good
            && is_of_time
            && frames_of(&self.pending).iter().all(|(&sensor, of_moment)| {
                let (known, there) = (known.of(sensor), there.of(sensor));
                there.frames.saturating_add(of_moment.frames) <= known.frames
                    && there.all().saturating_add(of_moment.all()) <= known.all()
            })
    }

    /// Copies a moment whose checksum is right, and enters the frames that are missing before it.
    ///
    /// If a recording of several sensors counts the frames of all together, nobody knows of which sensor missing ones
    /// are. Then everything behind them is left out.
    fn sound_moment(&mut self, moment: &[Waiting], sum: &Sum) -> Result<(), Error> {
        let own = frames_of(moment);
        (self.is_suspect, self.suspects) = (false, 0);
        self.spacings.clear();
        let known = sum.tally.told_apart(self.own.sensors.count());
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

/// Returns the frames of a moment, found and lost, of each sensor that it is of.
fn frames_of(moment: &[Waiting]) -> BTreeMap<u8, Counts> {
    let mut found = BTreeMap::<u8, Counts>::new();
    for of in moment {
        if let Some((sensor, _)) = of.own {
            let counts = found.entry(sensor).or_default();
            counts.frames += u64::from(of.is_frame());
            counts.lost = counts.lost.saturating_add(of.lost());
        }
    }
    if found.is_empty() {
        found.insert(0, Counts::default());
    }
    found
}
