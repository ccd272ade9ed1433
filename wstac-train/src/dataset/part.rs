//! The finished part of a data set: a file to which every slide is appended as soon as it is ready.
//!
//! The file starts with 8 bytes of magic and a fingerprint of 8 bytes. Then follows a record for each slide, in the
//! order in which they were ready. A record holds the slide's number, its status, its sample (zeros if there is none)
//! and a CRC of these. All numbers are little-endian.

use std::fs::{File, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use wstac_core::params::{FEATURES, SAMPLE_FRAMES};

use super::sweep::Sweep;
use super::{Facts, Outcome};
use crate::shard::digest;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::files::open_own;

const MAGIC: [u8; 8] = *b"wstacpt1";
const HEADER: usize = 16;
/// Bytes of a sample.
pub const SAMPLE_BYTES: usize = 2 * FEATURES * SAMPLE_FRAMES;
/// Bytes of a slide's record.
pub(super) const RECORD: usize = 8 + SAMPLE_BYTES + 4;

/// Returns a number that identifies a sweep, a configuration and the program's data version.
pub fn fingerprint(sweep: &Sweep, config: &Config) -> u64 {
    let Config { layout, green, features, trigger, speed, direction, .. } = config;
    let config = (layout, green, features, trigger, speed, direction);
    digest(&format!("{sweep:?} {config:?}"))
}

/// The known state of a slide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entry {
    Missing,
    /// A sample, with the position of its record.
    Sample(u64, Facts),
    NoEvent,
    Incomplete,
}

/// Numbers of slides by result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Samples.
    pub samples: u32,
    /// Samples that are not reliable.
    pub unreliable: u32,
    /// Samples whose event has no duration: it is cut off, or never lights up.
    pub without_duration: u32,
    /// Slides without an event.
    pub no_event: u32,
    /// Slides whose sample was incomplete.
    pub incomplete: u32,
}

impl Tally {
    /// Returns the number of slides that are done.
    pub fn done(self) -> u32 {
        self.samples + self.no_event + self.incomplete
    }
}

/// The locked file of an unfinished data set: two programs cannot write it at once.
#[derive(Debug)]
pub struct Part {
    file: File,
    path: PathBuf,
    entries: Vec<Entry>,
    tally: Tally,
    /// Position of the next record.
    end: u64,
}

impl Part {
    /// Opens the file, or creates a new one, for `count` slides.
    ///
    /// A last record that is incomplete or damaged is dropped, with all that follows. If the file belongs to another
    /// data set, `anew` makes it start empty. A file of another kind stays as it is.
    ///
    /// # Errors
    /// The file cannot be used, another program writes it, or it has another fingerprint.
    pub fn open(path: &Path, fingerprint: u64, count: u32, anew: bool) -> Result<Self, Error> {
        let failed = |error: io::Error| Error::io(path.display(), error);
        let file = open_own(path).map_err(failed)?;
        // On a system without locks the file is not locked.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(Error::new(
                ErrorKind::Busy,
                path.display(),
                "another wstac is writing it, expected to be the only one",
            ));
        }
        let entries = vec![Entry::Missing; count as usize];
        let mut part = Self { file, path: path.into(), entries, tally: Tally::default(), end: HEADER as u64 };
        let mut header = Vec::from(MAGIC);
        header.extend(fingerprint.to_le_bytes());
        let mut found = Vec::new();
        (&part.file).take(HEADER as u64).read_to_end(&mut found).map_err(failed)?;
        if found == header {
            part.read().map_err(failed)?;
        } else if header.starts_with(&found) || (anew && found.starts_with(&MAGIC)) {
            part.file.set_len(0).and_then(|()| part.file.write_all_at(&header, 0)).map_err(failed)?;
        } else if found.starts_with(&MAGIC) {
            let message = "is of another sweep, configuration or version of this program, expected the same, or \
                           --force to start anew";
            return Err(Error::new(ErrorKind::Config, path.display(), message));
        } else {
            let message = "is no unfinished data set, expected none of this name, or another name of the output";
            return Err(Error::new(ErrorKind::Format, path.display(), message));
        }
        Ok(part)
    }

    /// Reads the existing records, and truncates the file after the last complete one.
    fn read(&mut self) -> io::Result<()> {
        let mut reader = BufReader::new(&self.file);
        reader.seek(SeekFrom::Start(self.end))?;
        let mut record = [0; RECORD];
        let mut found = Vec::new();
        loop {
            match reader.read_exact(&mut record) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break,
                Err(error) => return Err(error),
            }
            let Some((number, status)) = parsed(&record) else { break };
            found.push((number, status));
        }
        for (number, status) in found {
            if !self.enter(number, status) {
                break;
            }
        }
        self.file.set_len(self.end)
    }

    /// Enters a record at the end, and returns `true` if it is a record of this data set.
    fn enter(&mut self, number: u32, status: u32) -> bool {
        let Some(entry) = self.entries.get_mut(number as usize).filter(|entry| **entry == Entry::Missing) else {
            return false;
        };
        let (new, count) = match (status & 0xFF, facts_of(status)) {
            (0, _) => (Entry::NoEvent, &mut self.tally.no_event),
            (SAMPLE, facts) => {
                self.tally.unreliable += u32::from(!facts.reliable);
                self.tally.without_duration += u32::from(facts.duration.is_none());
                (Entry::Sample(self.end, facts), &mut self.tally.samples)
            }
            (2, _) => (Entry::Incomplete, &mut self.tally.incomplete),
            _ => return false,
        };
        *entry = new;
        *count += 1;
        self.end += RECORD as u64;
        true
    }

    /// Returns the numbers of slides so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Returns the numbers of the missing slides, in order.
    pub fn missing(&self) -> Vec<u32> {
        self.numbers(|entry| entry == Entry::Missing)
    }

    /// Returns the numbers of the slides that are samples, in order.
    pub fn samples(&self) -> Vec<u32> {
        self.numbers(|entry| matches!(entry, Entry::Sample(..)))
    }

    fn numbers(&self, wanted: impl Fn(Entry) -> bool) -> Vec<u32> {
        (0..).zip(&self.entries).filter(|(_, entry)| wanted(**entry)).map(|(number, _)| number).collect()
    }

    /// Appends a missing slide; a slide that is already present stays unchanged.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn append(&mut self, number: u32, outcome: &Outcome) -> Result<(), Error> {
        self.append_record(&record(number, outcome))
    }

    /// Appends the record of a missing slide; damaged ones, and those of slides that are present, are not taken.
    pub(super) fn append_record(&mut self, record: &[u8; RECORD]) -> Result<(), Error> {
        let end = self.end;
        if parsed(record).is_some_and(|(number, status)| self.enter(number, status)) {
            self.file.write_all_at(record, end).map_err(|error| Error::io(self.path.display(), error))?;
        }
        Ok(())
    }

    /// Returns the bytes of a slide's sample: ten features of 70 frames, of 2 bytes each, little-endian.
    ///
    /// # Errors
    /// There is no such sample, or it cannot be read.
    pub fn sample(&self, number: u32) -> io::Result<[u8; SAMPLE_BYTES]> {
        let Some(Entry::Sample(at, _)) = self.entries.get(number as usize) else {
            return Err(io::ErrorKind::NotFound.into());
        };
        let mut sample = [0; SAMPLE_BYTES];
        self.file.read_exact_at(&mut sample, at + 8)?;
        Ok(sample)
    }

    /// Returns the facts about a slide's sample, or `None` if there is no sample.
    pub fn facts(&self, number: u32) -> Option<Facts> {
        match self.entries.get(number as usize) {
            Some(Entry::Sample(_, facts)) => Some(*facts),
            _ => None,
        }
    }

    /// Removes the file after the data set is finished.
    ///
    /// # Errors
    /// The file cannot be removed.
    pub fn remove(self) -> Result<(), Error> {
        std::fs::remove_file(&self.path).map_err(|error| Error::io(self.path.display(), error))
    }
}

/// Status of a sample, in its low byte.
const SAMPLE: u32 = 1;

/// Encodes facts in a status: 256 for reliable, and the duration, plus one, from bit 16 on.
fn stored(facts: Facts) -> u32 {
    u32::from(facts.reliable) << 8 | facts.duration.map_or(0, |frames| u32::from(frames) + 1) << 16
}

fn facts_of(status: u32) -> Facts {
    let duration = (status >> 16).checked_sub(1).and_then(|frames| u8::try_from(frames).ok());
    Facts { reliable: status >> 8 & 1 == 1, duration }
}

/// Returns the record of a slide.
pub(super) fn record(number: u32, outcome: &Outcome) -> [u8; RECORD] {
    let status = match outcome {
        Outcome::NoEvent => 0,
        Outcome::Sample(_, facts) => SAMPLE | stored(*facts),
        Outcome::Incomplete => 2,
    };
    let mut content = Vec::with_capacity(RECORD);
    content.extend(number.to_le_bytes().into_iter().chain(status.to_le_bytes()));
    if let Outcome::Sample(sample, _) = outcome {
        content.extend(sample.as_flattened().iter().flat_map(|feature| feature.to_le_bytes()));
    }
    content.resize(RECORD - 4, 0);
    content.extend(crc32fast::hash(&content).to_le_bytes());
    let mut record = [0; RECORD];
    record.copy_from_slice(&content);
    record
}

/// Returns the number and status of a record, or `None` if it is damaged.
fn parsed(record: &[u8; RECORD]) -> Option<(u32, u32)> {
    let (content, crc) = record.split_last_chunk()?;
    let (number, rest) = content.split_first_chunk()?;
    let (status, _) = rest.split_first_chunk()?;
    let whole = crc32fast::hash(content) == u32::from_le_bytes(*crc);
    whole.then_some((u32::from_le_bytes(*number), u32::from_le_bytes(*status)))
}
