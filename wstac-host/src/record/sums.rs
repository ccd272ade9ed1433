//! Checksums of a recording's parts, so that every frame and every record of metadata can be checked alone.
//!
//! The messages of one moment (a frame and everything that followed from it) stand one behind the other, and a message
//! of the channel [`SUMS`] ends them. It has the checksum of their bytes, and the place of the moment in the stream. So
//! a frame is known to be sound even if its chunk was never finished or is damaged elsewhere. If moments are gone, the
//! next one says how many frames are missing. In a recording of several sensors it says so of each of them.
//!
//! A recording has every record of its description twice, each time with a record of their checksums.

use std::collections::BTreeMap;

use crc32fast::Hasher;
use mcap::records::{MessageHeader, op};
use mcap::write::Metadata;
use serde::Deserialize;

use super::file::Topic;
use super::recorder::lost_frames;

/// Topic of the checksums.
pub(super) const SUMS: &str = "/sums/json";
/// Name of the record with checksums of the description.
pub(super) const DESCRIPTION_SUMS: &str = "wstac.sums";
/// Name of the record at the end of a recording.
pub(super) const END: &str = "wstac.end";
/// The key of each sensor's counts in the record at the end of a recording.
const SENSORS: &str = "sensors";
/// The start of every checksum's message.
pub(super) const START: &[u8] = br#"{"kind":"sum","#;
/// The end of every checksum's message, behind the digits.
const TAIL: &[u8] = br#""}"#;
/// Digits of a checksum.
const DIGITS: usize = 8;
/// Bytes of a checksum's message that the checksum does not cover.
pub(super) const UNCOVERED: u64 = (DIGITS + TAIL.len()) as u64;

/// The content of a recording so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub(super) struct Counts {
    /// Frames.
    pub(super) frames: u64,
    /// Frames that were reported lost.
    pub(super) lost: u64,
    /// Frames of both kinds from the first frame on: those that have a place in time.
    pub(super) place: u64,
}

impl Counts {
    pub(super) fn add_frame(&mut self) {
        self.frames = self.frames.saturating_add(1);
        self.place = self.place.saturating_add(1);
    }

    pub(super) fn add_lost(&mut self, lost: u64) {
        self.lost = self.lost.saturating_add(lost);
        if self.frames > 0 {
            self.place = self.place.saturating_add(lost);
        }
    }

    /// Returns all frames, found and lost.
    pub(super) fn all(self) -> u64 {
        self.frames.saturating_add(self.lost)
    }

    fn array(self) -> [u64; 3] {
        [self.frames, self.lost, self.place]
    }
}

/// The content of a recording so far: that of all sensors together, and that of each of several.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
pub(super) struct Tally {
    /// The sum of all sensors.
    #[serde(flatten)]
    pub(super) all: Counts,
    /// Each of several sensors. It is empty if there is one, or if a recording of before does not say it.
    #[serde(default, rename = "sensors")]
    pub(super) each: Vec<Counts>,
}

impl Tally {
    pub(super) fn new(sensors: usize) -> Self {
        let each = if sensors > 1 { vec![Counts::default(); sensors] } else { Vec::new() };
        Self { all: Counts::default(), each }
    }

    /// Counts the frames of a message.
    pub(super) fn add(&mut self, sensor: u8, topic: Topic, data: &[u8]) {
        match topic {
            topic if topic.is_frame() => self.add_frame(sensor),
            Topic::FaultsJson => self.add_lost(sensor, lost_frames(data)),
            _ => {}
        }
    }

    pub(super) fn add_frame(&mut self, sensor: u8) {
        self.all.add_frame();
        self.each.get_mut(usize::from(sensor)).into_iter().for_each(Counts::add_frame);
    }

    pub(super) fn add_lost(&mut self, sensor: u8, lost: u64) {
        self.all.add_lost(lost);
        self.each.get_mut(usize::from(sensor)).into_iter().for_each(|each| each.add_lost(lost));
    }

    /// Returns the content of one sensor, or of all if they are not told apart.
    pub(super) fn of(&self, sensor: u8) -> Counts {
        self.each.get(usize::from(sensor)).copied().unwrap_or(self.all)
    }

    /// Returns the tally of a recording of so many sensors; `None` if it does not tell them apart.
    pub(super) fn told_apart(&self, sensors: usize) -> Option<Self> {
        match sensors {
            0 | 1 => Some(Self { all: self.all, each: Vec::new() }),
            _ => Some(self.clone()).filter(|tally| tally.each.len() == sensors),
        }
    }

    /// Returns whether another tally has the same counts, as far as both have them.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        self.all == other.all && (self.each.is_empty() || other.each.is_empty() || self.each == other.each)
    }

    /// Returns the counts of each sensor as JSON; `None` if they are not told apart.
    fn each_as_json(&self) -> Option<String> {
        let each: Vec<_> = self.each.iter().map(|counts| counts.array()).collect();
        serde_json::to_string(&each).ok().filter(|_| !each.is_empty())
    }
}

/// The checksum of a moment.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub(super) struct Sum {
    /// The counts of the recording so far.
    #[serde(flatten)]
    pub(super) tally: Tally,
    /// Bytes of the moment's records before this message.
    pub(super) bytes: u64,
    /// The checksum of those bytes, and of this message up to the checksum itself.
    crc32: String,
}

impl Sum {
    /// Reads a checksum's message; `None` if it is none.
    pub(super) fn parse(data: &[u8]) -> Option<Self> {
        data.strip_prefix(START)?;
        serde_json::from_slice(data).ok()
    }

    /// Returns the place of the moment and its checksum, which no other moment has.
    pub(super) fn key(&self) -> (u64, Option<u32>) {
        (self.tally.all.all(), self.crc())
    }

    /// Returns the checksum; `None` if it is no number.
    pub(super) fn crc(&self) -> Option<u32> {
        u32::from_str_radix(&self.crc32, 16).ok()
    }
}

/// The checksum of a moment that is being written.
#[derive(Debug, Default)]
pub(super) struct MomentSum {
    hasher: Hasher,
    bytes: u64,
}

impl MomentSum {
    /// Adds a message's record.
    pub(super) fn add(&mut self, header: &MessageHeader, data: &[u8]) {
        self.bytes += self.add_start(header, data.len() as u64);
        self.hasher.update(data);
        self.bytes += data.len() as u64;
    }

    /// Adds the bytes of a record before its data, and returns their number.
    fn add_start(&mut self, header: &MessageHeader, data: u64) -> u64 {
        let MessageHeader { channel_id, sequence, log_time, publish_time } = header;
        self.hasher.update(&[op::MESSAGE]);
        self.hasher.update(&(22 + data).to_le_bytes());
        self.hasher.update(&channel_id.to_le_bytes());
        self.hasher.update(&sequence.to_le_bytes());
        self.hasher.update(&log_time.to_le_bytes());
        self.hasher.update(&publish_time.to_le_bytes());
        31
    }

    /// Returns the message that ends the moment. `header` is its own.
    pub(super) fn end(mut self, header: &MessageHeader, tally: &Tally) -> Vec<u8> {
        let (Counts { frames, lost, place }, bytes) = (tally.all, self.bytes);
        let each = tally.each_as_json().map_or_else(String::new, |each| format!(r#","sensors":{each}"#));
        let start = format!(r#"{{"kind":"sum","frames":{frames},"lost":{lost},"place":{place}{each},"bytes":{bytes}"#);
        let mut data = [start.as_bytes(), br#","crc32":""#].concat();
        self.add_start(header, data.len() as u64 + UNCOVERED);
        self.hasher.update(&data);
        data.extend(format!("{:08x}", self.hasher.finalize()).bytes());
        data.extend(TAIL);
        data
    }

    /// Returns whether a checksum is that of the messages so far. `header` and `data` are its own message.
    pub(super) fn agrees(mut self, header: &MessageHeader, data: &[u8], sum: &Sum) -> bool {
        let covered = data.len().saturating_sub(UNCOVERED as usize);
        let bytes = self.bytes;
        self.add_start(header, data.len() as u64);
        self.hasher.update(data.get(..covered).unwrap_or_default());
        bytes == sum.bytes && sum.crc() == Some(self.hasher.finalize())
    }
}

/// Returns the checksum of a record of metadata.
fn of_metadata(metadata: &Metadata) -> String {
    let mut hasher = Hasher::new();
    let texts = metadata.metadata.iter().flat_map(|(name, value)| [name, value]);
    for text in [&metadata.name].into_iter().chain(texts) {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    format!("{:08x}", hasher.finalize())
}

/// Returns the record with the checksums of a description.
pub(super) fn of_description(description: &[Metadata]) -> Metadata {
    let sums = description.iter().map(|metadata| (metadata.name.clone(), of_metadata(metadata)));
    Metadata { name: DESCRIPTION_SUMS.into(), metadata: sums.collect() }
}

/// Returns one record of each name: one whose checksum is right, or the first if there is no checksum of that name.
///
/// The second number is that of the names without a sound record.
pub(crate) fn sound_metadata(all: &[Metadata]) -> (Vec<Metadata>, usize) {
    let sums: Vec<&BTreeMap<String, String>> =
        all.iter().filter(|metadata| metadata.name == DESCRIPTION_SUMS).map(|metadata| &metadata.metadata).collect();
    let of_name = |name: &str| sums.iter().filter_map(|sums| sums.get(name)).collect::<Vec<_>>();
    let (mut found, mut missing): (Vec<Metadata>, usize) = (Vec::new(), 0);
    for metadata in all.iter().filter(|metadata| metadata.name != DESCRIPTION_SUMS) {
        let expected = of_name(&metadata.name);
        let is_sound = if sums.is_empty() { true } else { expected.contains(&&of_metadata(metadata)) };
        if is_sound && !found.iter().any(|known| known.name == metadata.name) {
            found.push(metadata.clone());
        }
    }
    let mut names: Vec<&str> = sums.iter().flat_map(|sums| sums.keys()).map(String::as_str).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        // A damaged name of a checksum is no name of a record. Every name stands in both records of checksums.
        let everywhere = sums.iter().all(|sums| sums.contains_key(name));
        missing += usize::from(everywhere && !found.iter().any(|known| known.name == name));
    }
    (found, missing)
}

pub(super) fn end_record(tally: &Tally) -> Metadata {
    let Counts { frames, lost, place } = tally.all;
    let counts = [("frames", frames), ("lost", lost), ("place", place)];
    let counts = counts.map(|(name, count)| (name.to_owned(), count.to_string()));
    let mut end = Metadata { name: END.into(), metadata: counts.into() };
    end.metadata.extend(tally.each_as_json().map(|each| (SENSORS.to_owned(), each)));
    let sum = of_metadata(&end);
    end.metadata.insert("crc32".into(), sum);
    end
}

/// The statements of a recording's description about its checksums.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Stated {
    /// The counts of the record at the end; `None` if it is damaged or missing.
    pub(super) end: Option<Tally>,
    /// Whether several recordings end in the file.
    pub(super) has_other_end: bool,
    /// Whether there is a record at the end, damaged or not.
    pub(super) is_ended: bool,
    pub(super) has_sums: bool,
}

impl Stated {
    pub(super) fn of(all: &[Metadata]) -> Self {
        let ends: Vec<_> = all.iter().filter(|metadata| metadata.name == END).map(read_end).collect();
        let end = ends.iter().flatten().next().cloned();
        Self {
            has_other_end: ends.iter().flatten().any(|other| Some(other) != end.as_ref()),
            end,
            is_ended: !ends.is_empty(),
            has_sums: all.iter().any(|metadata| metadata.name == DESCRIPTION_SUMS),
        }
    }
}

/// Returns what the record at the end of a recording states; `None` if it is damaged.
fn read_end(end: &Metadata) -> Option<Tally> {
    let mut end = end.clone();
    let sum = end.metadata.remove("crc32")?;
    let count = |name: &str| end.metadata.get(name)?.parse().ok();
    let all = Counts { frames: count("frames")?, lost: count("lost")?, place: count("place")? };
    let each = end.metadata.get(SENSORS).map(|each| serde_json::from_str(each));
    let each = each.transpose().ok()?.unwrap_or_default();
    (end.name == END && of_metadata(&end) == sum).then_some(Tally { all, each })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(name: &str, value: &str) -> Metadata {
        Metadata { name: name.into(), metadata: [("key".to_owned(), value.to_owned())].into() }
    }

    #[test]
    fn a_description_survives_damage_of_either_copy() {
        let description = [record("wstac.stream", "one"), record("wstac.labels", "two")];
        let sums = of_description(&description);
        let copy = [&description[..], std::slice::from_ref(&sums)].concat();
        let both = [&copy[..], &copy].concat();
        assert_eq!(sound_metadata(&both), (description.to_vec(), 0));
        for at in 0..both.len() {
            for damage in 0..3 {
                let mut damaged = both.clone();
                match damage {
                    0 => damaged[at].name.push('x'),
                    1 => damaged[at].metadata.values_mut().next().unwrap().push('x'),
                    _ => drop(damaged.remove(at)),
                }
                let (mut found, missing) = sound_metadata(&damaged);
                found.sort_by_key(|metadata| metadata.name != "wstac.stream");
                assert_eq!((found, missing), (description.to_vec(), 0), "{at} {damage}");
            }
        }
        let mut twice = both.clone();
        twice[0].metadata.insert("key".into(), "x".into());
        twice[3].metadata.insert("key".into(), "y".into());
        assert_eq!(sound_metadata(&twice), (vec![description[1].clone()], 1));
        // Recordings without checksums are read as they are, the first of a name.
        let old = [record("a", "1"), record("a", "2"), record("b", "3")];
        assert_eq!(sound_metadata(&old), (vec![old[0].clone(), old[2].clone()], 0));
    }

    #[test]
    fn the_end_is_read_or_damaged() {
        let all = Counts { frames: 137, lost: 5, place: 140 };
        for each in [vec![], vec![Counts { frames: 100, ..all }, Counts { frames: 37, lost: 0, place: 37 }]] {
            let tally = Tally { all, each };
            let end = end_record(&tally);
            assert_eq!(read_end(&end), Some(tally.clone()));
            for key in end.metadata.keys().filter(|key| *key != "crc32") {
                let mut damaged = end.clone();
                damaged.metadata.insert(key.clone(), "136".into());
                assert_eq!(read_end(&damaged), None, "{key}");
            }
        }
    }

    /// A single sensor's checksums are those of before, byte for byte.
    #[test]
    fn a_checksum_has_the_counts_of_each_of_several_sensors() {
        let header = MessageHeader { channel_id: 9, sequence: 1, log_time: 2, publish_time: 3 };
        let text = |sensors: usize| {
            let mut tally = Tally::new(sensors);
            tally.add_frame(0);
            tally.add_lost((sensors - 1) as u8, 2);
            let data = MomentSum::default().end(&header, &tally);
            let sum = Sum::parse(&data).unwrap();
            assert_eq!(sum.tally, tally);
            String::from_utf8(data).unwrap()
        };
        let one = r#"{"kind":"sum","frames":1,"lost":2,"place":3,"bytes":0,"crc32":"286f31b2"}"#;
        assert_eq!(text(1), one);
        let two = r#"{"kind":"sum","frames":1,"lost":2,"place":3,"sensors":[[1,0,1],[0,2,0]],"bytes":0,"crc32":""#;
        assert!(text(2).starts_with(two), "{}", text(2));
    }
}
