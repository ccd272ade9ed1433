//! A shard of a data set: the finished slides of one of several processes, on one or many machines.
//!
//! The file starts with 8 bytes of magic, the length of a header, the header in JSON, and a CRC of all these. Then
//! follow the records of a [`part`](super::part), in the order of their slides. So a shard that is made again has the
//! same bytes. Slide `s` of a set of `n` shards is in shard `s mod n + 1`: slow and fast slides are spread evenly.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::files::open_seekable;

use super::part::{Part, RECORD, fingerprint, number_of, record};
use super::sweep::Sweep;
use super::{DATA_VERSION, Outcome};

const MAGIC: [u8; 8] = *b"wstacsh1";
/// Most bytes of a header: that of a sweep's file, every byte escaped, and a little.
const MOST_HEADER: u32 = 7 << 20;

/// The place of a shard in its data set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u32,
    /// Number of all shards.
    pub of: u32,
    /// Number of slides of the whole set.
    slides: u32,
    /// The [`fingerprint`] of sweep, configuration and program.
    digest: String,
    /// Versions of the program and of its data.
    version: String,
    /// The text of the sweep's file.
    sweep: String,
}

impl Shard {
    /// Describes shard `number` of `of` of a sweep, whose file has this text.
    pub fn new([number, of]: [u32; 2], sweep: &Sweep, text: String, config: &Config) -> Self {
        let digest = format!("{:016x}", fingerprint(sweep, config));
        Self { number, of, slides: sweep.count(), digest, version: version(), sweep: text }
    }

    /// Returns the numbers of its slides, in order.
    pub fn slides(&self) -> impl Iterator<Item = u32> + use<> {
        (self.number - 1..self.slides).step_by(self.of as usize)
    }

    /// Writes the shard.
    ///
    /// # Errors
    /// The file cannot be written, or the outcomes are not those of its slides, in order.
    pub fn write(&self, out: &mut impl Write, outcomes: &[(u32, Outcome)]) -> io::Result<()> {
        if !self.slides().eq(outcomes.iter().map(|(number, _)| *number)) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "has slides of another shard"));
        }
        let text = serde_json::to_vec(self)?;
        let mut header = Vec::from(MAGIC);
        header.extend((text.len() as u32).to_le_bytes());
        header.extend(text);
        header.extend(crc32fast::hash(&header).to_le_bytes());
        out.write_all(&header)?;
        outcomes.iter().try_for_each(|(number, outcome)| out.write_all(&record(*number, outcome)))
    }

    /// Returns how it is called in messages.
    fn name(&self) -> String {
        format!("shard {}/{} of {} slides, digest {}", self.number, self.of, self.slides, self.digest)
    }
}

/// A whole shard's file. It is open only while it is read: a set may have more shards than a process may have files.
#[derive(Debug)]
pub struct ShardFile {
    /// What it is.
    pub shard: Shard,
    path: PathBuf,
    /// Position of the first record.
    start: u64,
}

impl ShardFile {
    /// Opens a shard and reads its header.
    ///
    /// # Errors
    /// The file cannot be read, is no shard, is damaged, or is of another version of this program.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let failed = |error: io::Error| Error::io(path.display(), error);
        let wrong = |message: String| Error::new(ErrorKind::Format, path.display(), message);
        let file = open_seekable(path).map_err(failed)?;
        let mut header = Vec::new();
        (&file).take(12).read_to_end(&mut header).map_err(failed)?;
        let length = header.strip_prefix(&MAGIC).and_then(|length| Some(u32::from_le_bytes(length.try_into().ok()?)));
        let Some(length) = length.filter(|length| *length <= MOST_HEADER) else {
            return Err(wrong("is no shard, expected a file of wstac dataset --shard".into()));
        };
        (&file).take(u64::from(length) + 4).read_to_end(&mut header).map_err(failed)?;
        let (content, found) = header.split_last_chunk().unwrap_or((&[], &[0; 4]));
        if header.len() != 16 + length as usize || crc32fast::hash(content) != u32::from_le_bytes(*found) {
            return Err(wrong("has a damaged header, expected a whole shard: make it again".into()));
        }
        let shard = serde_json::from_slice(&content[12..]);
        let shard: Shard = shard.map_err(|error| wrong(format!("has a header that is no shard's: {error}")))?;
        if shard.version != version() {
            return Err(wrong(format!("is of wstac {}, expected one of wstac {}", shard.version, version())));
        }
        if !(1..=shard.of).contains(&shard.number) || shard.of > shard.slides {
            return Err(wrong(format!("is {}, expected 1 to as many shards as slides", shard.name())));
        }
        let bytes = file.metadata().map_err(failed)?.len();
        let start = header.len() as u64;
        let expected = start + shard.slides().count() as u64 * RECORD as u64;
        if bytes != expected {
            return Err(wrong(format!("has {bytes} bytes, expected {expected}: make it again ({})", shard.name())));
        }
        Ok(Self { shard, path: path.into(), start })
    }

    /// Calls `take` with every record, after it was checked.
    ///
    /// # Errors
    /// The file cannot be read, a record is damaged or of another slide, or `take` fails.
    pub fn each(&self, mut take: impl FnMut(&[u8; RECORD]) -> Result<(), Error>) -> Result<(), Error> {
        let failed = |error: io::Error| Error::io(self.path.display(), error);
        let mut records = BufReader::new(open_seekable(&self.path).map_err(failed)?);
        records.seek(SeekFrom::Start(self.start)).map_err(failed)?;
        let mut found = [0; RECORD];
        for number in self.shard.slides() {
            records.read_exact(&mut found).map_err(failed)?;
            if number_of(&found) != Some(number) {
                let message = format_args!("has a damaged record, expected that of slide {number}: make it again");
                return Err(Error::new(ErrorKind::Format, self.path.display(), message));
            }
            take(&found)?;
        }
        Ok(())
    }

    /// Checks every record.
    ///
    /// # Errors
    /// [`each`](Self::each) would fail.
    pub fn check(&self) -> Result<(), Error> {
        self.each(|_| Ok(()))
    }

    /// Returns the sweep of the whole set.
    ///
    /// # Errors
    /// The header's sweep is not valid, or has another number of slides.
    pub fn sweep(&self) -> Result<Sweep, Error> {
        let sweep = Sweep::parse(&self.path.display().to_string(), &self.shard.sweep)?;
        if sweep.count() != self.shard.slides {
            let message = format_args!("has a sweep of {} slides, expected {}", sweep.count(), self.shard.slides);
            return Err(Error::new(ErrorKind::Format, self.path.display(), message));
        }
        Ok(sweep)
    }
}

/// Merges all shards of a set into an unfinished data set, which is then complete. Their order does not matter.
///
/// All of them are checked before `path` is touched. [`Part::open`] says what `anew` does.
///
/// # Errors
/// A shard is missing, there twice, of another set or damaged, or the part cannot be written.
pub fn merge(files: &[ShardFile], path: &Path, anew: bool) -> Result<Part, Error> {
    let Some(first) = files.first() else {
        return Err(Error::new(ErrorKind::Usage, "merge", "has no shard, expected all of a set"));
    };
    let (of, slides, digest) = (first.shard.of, first.shard.slides, first.shard.digest.clone());
    let mut paths: BTreeMap<u32, &Path> = BTreeMap::new();
    for file in files {
        let wrong = |message: String| Error::new(ErrorKind::Config, file.path.display(), message);
        let ShardFile { shard, .. } = file;
        if (shard.of, shard.slides, &shard.digest) != (of, slides, &digest) {
            let (found, other, expected) = (shard.name(), first.path.display(), first.shard.name());
            return Err(wrong(format!("is {found}, expected one of the set of {other}: {expected}")));
        }
        if let Some(other) = paths.insert(shard.number, &file.path) {
            return Err(wrong(format!(
                "is shard {}/{of}, as is {}, expected each once",
                shard.number,
                other.display()
            )));
        }
    }
    let missing = u64::from(of) - paths.len() as u64;
    if missing > 0 {
        let some = (1..=of).filter(|number| !paths.contains_key(number)).take(20);
        let some = some.map(|number| format!("{number}/{of}")).collect::<Vec<_>>().join(", ");
        let more = if missing > 20 { ", …" } else { "" };
        let message =
            format_args!("of the set {digest}, {missing} of {of} shards are missing, expected all: {some}{more}");
        return Err(Error::new(ErrorKind::Config, "merge", message));
    }
    let digest = u64::from_str_radix(&digest, 16)
        .map_err(|error| Error::with_cause(ErrorKind::Format, first.path.display(), error))?;
    files.iter().try_for_each(ShardFile::check)?;
    let mut part = Part::open(path, digest, slides, anew)?;
    files.iter().try_for_each(|file| file.each(|record| part.append_record(record)))?;
    Ok(part)
}

/// Returns the versions of the program and of its data.
fn version() -> String {
    format!("{}, data {DATA_VERSION}", env!("CARGO_PKG_VERSION"))
}
