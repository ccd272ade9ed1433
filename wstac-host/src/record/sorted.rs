//! Puts messages in the order in which this program writes them, if another tool wrote the recording anew in another
//! one: grouped by topic, sorted by time, backwards, or with every message twice.
//!
//! Messages of a sensor have running numbers, and a moment's checksum has the count of frames and the bytes of the
//! moment. So the places and lengths of all messages are enough, and no frame is kept in memory.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use mcap::records::MessageHeader;

use super::bytes::HEAD;
use super::file::Topic;
use super::limits::{MOST_PACKED, MOST_ROOM, MOST_SORTED};
use super::sums::{Sum, Tally};
use super::walk::{Crc, Packed, Span, Walk, message_of};
use crate::error::Error;

/// Most checksums that are compared of those that look alike, and most of a frame's moments: a bound of the work.
const MOST_ALIKE: usize = 8;
const MOST_OF_FRAME: usize = 1 << 10;
/// How often all compressed chunks may be unpacked again on average: a bound of the work, too.
const MOST_UNPACKED: u64 = 32;

/// Whether messages of this program stand in the order in which it writes them, as far as they were seen.
#[derive(Debug, Default)]
pub(super) struct OrderCheck {
    /// Frames since the last checksum, the time of the last of them, and the number of that checksum.
    frames: u32,
    time: u64,
    sum: u32,
    /// Time and number of each sensor's last frame.
    last: BTreeMap<u8, (u64, u32)>,
    /// Checksums behind the frames that they count, and others.
    fits: u64,
    misfits: u64,
    /// Frames or faults behind later ones.
    backward: u64,
}

impl OrderCheck {
    /// Takes a message of this program. Returns false for a frame or a checksum that does not stand where it was
    /// written: each frame has a checksum behind it.
    pub(super) fn add(&mut self, sensor: u8, topic: Topic, message: &MessageHeader) -> bool {
        let (number, time) = (message.sequence, message.log_time);
        if topic == Topic::Sums {
            let counted = number.wrapping_sub(self.sum);
            // A moment has the time of its frame.
            let is_fitting = (1..=counted).contains(&self.frames) && counted < 1 << 31 && self.time == time;
            let is_misfit = !is_fitting && (counted, self.frames) != (0, 0);
            (self.fits, self.misfits) = (self.fits + u64::from(is_fitting), self.misfits + u64::from(is_misfit));
            (self.sum, self.frames) = (number, 0);
            return !is_misfit;
        }
        if !topic.is_frame() && topic != Topic::FaultsJson {
            return true;
        }
        let last = self.last.get(&sensor);
        let is_backward = last
            .is_some_and(|(last, of_last)| time < *last || (topic.is_frame() && (time, number) <= (*last, *of_last)));
        self.backward += u64::from(is_backward);
        if topic.is_frame() {
            (self.frames, self.time) = (self.frames.saturating_add(1), time);
            self.last.insert(sensor, (time, number));
        }
        !topic.is_frame() || (!is_backward && self.frames == 1)
    }

    /// Returns whether the order is another one. Damage is no order: the most checksums decide.
    pub(super) fn is_other(&self, has_sums: bool) -> bool {
        if has_sums { self.misfits > self.fits } else { self.backward > 0 }
    }
}

/// A message of the file.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// When it was logged; for messages of this program, the time of its moment.
    time: u64,
    /// Its place in the file, or in its unpacked chunk.
    at: u64,
    length: u32,
    /// Its sequence number.
    number: u32,
    /// The number of its chunk among `Index::chunks`.
    chunk: u32,
    /// The checksum of what follows the number of its channel.
    sum: u32,
    channel: u16,
    own: Option<(u8, Topic)>,
}

impl Entry {
    fn is_frame(&self) -> bool {
        self.own.is_some_and(|(_, topic)| topic.is_frame())
    }

    /// Returns the bytes of its record.
    fn bytes(&self) -> u64 {
        self.span().end() - self.at
    }

    fn span(&self) -> Span {
        Span { op: mcap::records::op::MESSAGE, at: self.at, length: self.length.into() }
    }
}

/// The places of a file's messages.
#[derive(Debug, Default)]
pub(super) struct Index {
    entries: Vec<Entry>,
    /// The chunks: where they are if they are compressed, and the verdicts of their checksums.
    chunks: Vec<(Option<Packed>, Crc)>,
    /// The bytes of all compressed chunks.
    unpacked: u64,
}

impl Index {
    /// Adds the message that a walk found last.
    ///
    /// # Errors
    /// The file cannot be read, or has too many messages.
    pub(super) fn add(&mut self, walk: &mut Walk, span: Span) -> Result<(), Error> {
        if self.entries.len() == MOST_SORTED {
            let message = format!("has another order than it was recorded in, and more than {MOST_SORTED} messages");
            return Err(walk.refused(message));
        }
        let chunk = (walk.packed(), walk.crc);
        if self.chunks.last() != Some(&chunk) {
            self.chunks.push(chunk);
            self.unpacked = self.unpacked.saturating_add(chunk.0.map_or(0, |packed| packed.unpacked));
        }
        if let Some(header) = walk.header_of(span)? {
            let MessageHeader { channel_id: channel, sequence: number, log_time: time, .. } = header;
            let (chunk, length) = (self.chunks.len() as u32 - 1, u32::try_from(span.length).unwrap_or(u32::MAX));
            let sum = walk.hash(span.at + HEAD + 2, span.end())?;
            self.entries.push(Entry { time, at: span.at, length, number, chunk, sum, channel, own: None });
        }
        Ok(())
    }

    /// Puts the messages in order. `own` returns the sensor and the topic of a channel of this program.
    ///
    /// # Errors
    /// The file cannot be read, or its checksums are too far out of order.
    pub(super) fn sort(
        self,
        walk: &mut Walk,
        sensors: usize,
        own: impl Fn(u16) -> Option<(u8, Topic)>,
    ) -> Result<Sorted, Error> {
        let Self { mut entries, chunks, unpacked } = self;
        let channels = entries.iter().map(|of| of.channel).collect::<BTreeSet<_>>().len();
        for entry in &mut entries {
            entry.own = own(entry.channel);
        }
        leave_out_copies(&mut entries, &chunks);
        let mut sorted = Sorted::new(chunks, unpacked, channels);
        entries.sort_by_key(|of| (of.own, of.number, of.time, of.length, of.chunk, of.at));
        let (own, mut others): (Vec<_>, Vec<_>) = entries.into_iter().partition(|of| of.own.is_some());
        others.sort_by_key(|of| of.time);
        let (sums, mut own): (Vec<_>, Vec<_>) =
            own.into_iter().partition(|of| of.own.is_some_and(|(_, topic)| topic == Topic::Sums));
        put_in_time(&mut own);
        sorted.has_sums = !sums.is_empty();
        if sums.is_empty() {
            own.sort_by_key(|of| of.time);
        }
        let mut of_sensors: Vec<VecDeque<Entry>> = vec![VecDeque::new(); sensors];
        let mut others = VecDeque::from(others);
        for entry in own.drain(..) {
            let sensor = entry.own.map_or(0, |(sensor, _)| usize::from(sensor));
            match of_sensors.get_mut(sensor).filter(|_| !sums.is_empty()) {
                Some(queue) => queue.push_back(entry),
                None => sorted.push(&mut others, [entry]),
            }
        }
        let mut last = Tally::new(sensors);
        for same in sums.chunk_by(|one, other| one.number == other.number) {
            let mut group = Vec::new();
            for entry in same.iter().take(MOST_OF_FRAME) {
                // A damaged checksum vouches for nothing.
                group.extend(sorted.sum(walk, entry)?.map(|sum| (sum, *entry)));
            }
            group.sort_by_key(|(sum, _)| sum.tally.all.all());
            while let Some((first, _)) = group.first() {
                let fewest = first.tally.all.all();
                let mut of_fewest =
                    group.iter().take(MOST_ALIKE).take_while(|(sum, _)| sum.tally.all.all() == fewest).enumerate();
                let found = of_fewest.find_map(|(at, (sum, entry))| {
                    moment_of(sum, entry.time, &last, &of_sensors).map(|moment| (at, moment))
                });
                let (sum, entry) = group.remove(found.map_or(0, |(at, _)| at));
                let tally = sum.tally;
                for (sensor, queue) in of_sensors.iter_mut().enumerate() {
                    let count = match found {
                        Some((_, (of_sensor, count))) if of_sensor == sensor => count,
                        Some(_) => 0,
                        // Parts of the moment are missing.
                        None => until(queue, entry.time, frames_of(&tally, sensor) - frames_of(&last, sensor)),
                    };
                    sorted.push(&mut others, queue.drain(..count));
                }
                sorted.order.push_back(entry);
                last = tally;
            }
        }
        for queue in of_sensors {
            sorted.push(&mut others, queue);
        }
        sorted.order.extend(others);
        Ok(sorted)
    }
}

/// Leaves out messages of this program that are there already. A copy in a chunk that is not damaged stays.
fn leave_out_copies(entries: &mut Vec<Entry>, chunks: &[(Option<Packed>, Crc)]) {
    let key = |of: &Entry| (of.own, of.number, of.time, of.length, of.sum);
    let is_bad = |of: &Entry| chunks.get(of.chunk as usize).is_some_and(|(_, crc)| *crc == Crc::Bad);
    entries.sort_by_key(|of| (key(of), is_bad(of)));
    entries.dedup_by(|copy, first| copy.own.is_some() && key(copy) == key(first));
}

fn frames_of(tally: &Tally, sensor: usize) -> i128 {
    tally.of(sensor as u8).frames.into()
}

/// Returns the sensor whose first messages are the moment of a checksum with this time, and their count; `None` if
/// there is none. A sensor whose frames the checksum counts comes first.
fn moment_of(sum: &Sum, time: u64, last: &Tally, of_sensors: &[VecDeque<Entry>]) -> Option<(usize, usize)> {
    let tally = &sum.tally;
    let mut sensors: Vec<usize> = (0..of_sensors.len()).collect();
    sensors.sort_by_key(|&sensor| tally.of(sensor as u8) == last.of(sensor as u8));
    let count = |queue: &VecDeque<Entry>| {
        let mut bytes = 0;
        let count = queue.iter().take(MOST_OF_FRAME).take_while(|entry| {
            // A frame of a later moment may have as many bytes.
            let is_part = bytes < sum.bytes && (entry.time <= time || !entry.is_frame());
            bytes += if is_part { entry.bytes() } else { 0 };
            is_part
        });
        let count = count.count();
        (bytes == sum.bytes).then_some(count)
    };
    sensors.into_iter().find_map(|sensor| Some((sensor, count(of_sensors.get(sensor)?)?)))
}

/// Returns how many messages of a sensor have this time at most, and no more frames than these.
fn until(queue: &VecDeque<Entry>, time: u64, mut frames: i128) -> usize {
    let is_part = |entry: &&Entry| {
        frames -= i128::from(entry.is_frame());
        entry.time <= time && frames >= 0
    };
    queue.iter().take_while(is_part).count()
}

/// Gives messages the time of their moment, and sorts each sensor's by it: events are about earlier frames.
fn put_in_time(own: &mut [Entry]) {
    let topic = |of: &Entry| of.own.map_or(Topic::Sums, |(_, topic)| topic);
    let sensor = |of: &Entry| of.own.map_or(0, |(sensor, _)| sensor);
    // Messages besides frames have running numbers. Lost frames that a recovery entered have none.
    let is_numbered = |of: &Entry| !of.is_frame() && of.number > 0;
    own.sort_by_key(|of| (sensor(of), !is_numbered(of), of.number, of.time));
    for of_sensor in own.chunk_by_mut(|one, other| one.own.map(|(of, _)| of) == other.own.map(|(of, _)| of)) {
        let (mut time, mut first) = (0, None);
        for entry in of_sensor.iter_mut().take_while(|of| is_numbered(of)) {
            time = time.max(entry.time);
            entry.time = time;
            let is_of_frame = matches!(topic(entry), Topic::Features | Topic::Taxels);
            first = first.or(is_of_frame.then_some(entry.number));
        }
        // Wall-clock times stand before their frame, and everything that came before the first frame stands before
        // that.
        let rank = |of: &Entry| match topic(of) {
            _ if is_numbered(of) && first.is_some_and(|first| of.number < first) => 0,
            Topic::Clock => 0,
            _ if of.is_frame() => 1,
            _ if is_numbered(of) => 2,
            _ => 3,
        };
        of_sensor.sort_by_key(|of| (of.time, rank(of), of.number));
    }
}

/// The messages of a file in their order.
#[derive(Debug)]
pub(super) struct Sorted {
    order: VecDeque<Entry>,
    /// Whether there are checksums among them.
    pub(super) has_sums: bool,
    chunks: Vec<(Option<Packed>, Crc)>,
    /// The chunk that is read, and others that were unpacked.
    shown: Option<u32>,
    unpacked: VecDeque<(u32, Vec<u8>)>,
    /// Most bytes of unpacked chunks that are kept, and the bytes that may still be unpacked.
    room: u64,
    allowed: u64,
}

impl Sorted {
    fn new(chunks: Vec<(Option<Packed>, Crc)>, unpacked: u64, channels: usize) -> Self {
        let largest = chunks.iter().filter_map(|(packed, _)| *packed).map(|packed| packed.unpacked).max().unwrap_or(0);
        // Each topic of a file that is grouped by topic is read in a chunk of its own.
        let room = largest.saturating_mul(channels as u64 + 1).clamp(MOST_PACKED, MOST_ROOM);
        let (order, unpacked, allowed) = (VecDeque::new(), VecDeque::new(), unpacked.saturating_mul(MOST_UNPACKED));
        Self { order, has_sums: false, chunks, shown: None, unpacked, room, allowed }
    }

    /// Returns the next message, which the walk reads from now on; `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or is too far out of order.
    pub(super) fn next(&mut self, walk: &mut Walk) -> Result<Option<Span>, Error> {
        let Some(entry) = self.order.pop_front() else { return Ok(None) };
        self.show(walk, &entry)?;
        Ok(Some(entry.span()))
    }

    /// Adds messages, and those of other programs that are not later.
    fn push(&mut self, others: &mut VecDeque<Entry>, own: impl IntoIterator<Item = Entry>) {
        for entry in own {
            while let Some(other) = others.pop_front_if(|other| other.time <= entry.time) {
                self.order.push_back(other);
            }
            self.order.push_back(entry);
        }
    }

    /// Reads a checksum; `None` if it is damaged.
    fn sum(&mut self, walk: &mut Walk, entry: &Entry) -> Result<Option<Sum>, Error> {
        self.show(walk, entry)?;
        let mut body = Vec::new();
        walk.body(entry.span(), &mut body)?;
        Ok(message_of(&body).and_then(|(_, data)| Sum::parse(data)))
    }

    /// Lets the walk read the chunk of a message.
    fn show(&mut self, walk: &mut Walk, entry: &Entry) -> Result<(), Error> {
        if self.shown == Some(entry.chunk) {
            return Ok(());
        }
        let (packed, crc) = self.chunks.get(entry.chunk as usize).copied().unwrap_or((None, Crc::Unknown));
        let there = self.unpacked.iter().position(|(number, _)| *number == entry.chunk);
        let there = there.and_then(|at| self.unpacked.remove(at)).map(|(_, bytes)| bytes);
        let chunk = match (there, packed) {
            (None, Some(packed)) => {
                self.allowed = self.allowed.checked_sub(packed.unpacked).ok_or_else(|| {
                    let message = format!(
                        "has messages too far out of order (its chunks are unpacked more than {MOST_UNPACKED} times); \
                         help: mcap sort OLD -o NEW"
                    );
                    walk.refused(message)
                })?;
                Some(walk.unpack_again(packed)?)
            }
            (there, _) => there,
        };
        let before = walk.show(chunk, crc);
        self.unpacked.extend(self.shown.replace(entry.chunk).zip(before));
        while self.unpacked.iter().map(|(_, bytes)| bytes.len() as u64).sum::<u64>() > self.room {
            self.unpacked.pop_front();
        }
        Ok(())
    }
}

#[cfg(feature = "compression")]
#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use mcap::records::op;
    use mcap::{Channel, Message, WriteOptions};

    use super::super::walk::{Mode, WalkStep};
    use super::*;

    /// Writes three compressed chunks, each of its own topic, whose messages have these times and so many bytes, and
    /// finds them again.
    fn indexed(times: [&[u64]; 3], bytes: usize) -> (Walk, Index) {
        let file = std::env::temp_dir().join(format!("wstac-sorted-{}-{}.mcap", std::process::id(), times[0].len()));
        let options = WriteOptions::new().compression(Some(mcap::Compression::Lz4)).chunk_size(None);
        let mut writer = options.create(std::fs::File::create(&file).unwrap()).unwrap();
        for (id, of_chunk) in (1..).zip(times) {
            let (topic, message_encoding) = (format!("/{id}"), "x".to_owned());
            let channel = Arc::new(Channel { id, topic, schema: None, message_encoding, metadata: BTreeMap::new() });
            for &time in of_chunk {
                let (channel, data) = (channel.clone(), vec![0; bytes].into());
                writer.write(&Message { channel, sequence: 0, log_time: time, publish_time: time, data }).unwrap();
            }
            writer.flush().unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let (mut walk, mut index) = (Walk::open(&file, Mode::Salvage).unwrap(), Index::default());
        std::fs::remove_file(&file).unwrap();
        loop {
            match walk.next().unwrap() {
                WalkStep::Record(span) if span.op == op::MESSAGE => index.add(&mut walk, span).unwrap(),
                WalkStep::End { .. } => return (walk, index),
                _ => {}
            }
        }
    }

    /// Returns how many messages come in order, the bytes that are unpacked for them, and why no more come.
    fn read(times: [&[u64]; 3], bytes: usize, room: Option<u64>) -> (usize, u64, u64, Option<String>) {
        let (mut walk, index) = indexed(times, bytes);
        let all = index.unpacked;
        let mut sorted = index.sort(&mut walk, 1, |_| None).unwrap();
        sorted.room = room.unwrap_or(sorted.room);
        let (most, mut found) = (sorted.allowed, 0);
        loop {
            match sorted.next(&mut walk) {
                Ok(Some(span)) => {
                    assert_eq!(walk.header_of(span).unwrap().unwrap().log_time, found as u64);
                    found += 1;
                }
                Ok(None) => return (found, most - sorted.allowed, all, None),
                Err(error) => return (found, most - sorted.allowed, all, Some(error.to_string())),
            }
        }
    }

    #[test]
    fn chunks_are_unpacked_so_often_and_no_more() {
        let all: Vec<u64> = (0..300).collect();
        let apart = [0, 1, 2].map(|chunk| all.iter().copied().skip(chunk).step_by(3).collect::<Vec<_>>());
        let apart = [&apart[0][..], &apart[1], &apart[2]];
        // All chunks are kept, or they stand one behind the other: each is unpacked once.
        let (found, unpacked, bytes, why) = read(apart, 1000, None);
        assert!((found, unpacked, &why) == (300, bytes, &None), "{found} {unpacked} {bytes} {why:?}");
        assert!(bytes > 300_000, "{found} {unpacked} {bytes} {why:?}");
        let in_turn = [&all[..100], &all[100..200], &all[200..]];
        assert_eq!(read(in_turn, 1000, Some(0)), (300, bytes, bytes, None));
        // Of chunks that are not kept, each message needs another one.
        let (found, unpacked, bytes, why) = read(apart, 1000, Some(0));
        assert_eq!((found, unpacked), (3 * MOST_UNPACKED as usize, bytes * MOST_UNPACKED));
        assert!(why.is_some_and(|why| why.contains("too far out of order")));
    }

    #[test]
    fn topics_in_large_chunks_are_each_unpacked_once() {
        let all: Vec<u64> = (0..60).collect();
        let apart = [0, 1, 2].map(|chunk| all.iter().copied().skip(chunk).step_by(3).collect::<Vec<_>>());
        let (found, unpacked, bytes, why) = read([&apart[0], &apart[1], &apart[2]], 2 << 20, None);
        assert_eq!((found, unpacked, why), (60, bytes, None));
        // The two chunks that are not read have more than the least room.
        assert!(bytes / 3 * 2 > MOST_PACKED, "{bytes}");
    }

    #[test]
    fn the_copy_in_a_sound_chunk_stays() {
        let own = Some((0, Topic::Features));
        let of = |chunk| Entry { time: 1, at: 0, length: 9, number: 1, chunk, sum: 7, channel: 1, own };
        let chunks = [Crc::Bad, Crc::Good, Crc::Good].map(|crc| (None, crc));
        let mut entries = vec![of(0), of(1), of(2)];
        leave_out_copies(&mut entries, &chunks);
        assert_eq!(entries.iter().map(|entry| entry.chunk).collect::<Vec<_>>(), [1]);
    }
}
