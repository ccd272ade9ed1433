//! A shard: the results of one of several processes, on one or many machines, that make one set together.
//!
//! A set has items, which are numbered: slides or recordings. Item `i` of a set of `n` shards is in shard `i mod n + 1`:
//! slow and fast ones are spread evenly. The file starts with 8 bytes of magic, the length of a header, the header in
//! JSON, and a CRC of all these. Then follow the records, in the order of their items: number, length, content, and a CRC
//! of these. All numbers are little-endian. So a shard that is made again has the same bytes.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::files::open_seekable;

use crate::dataset::DATA_VERSION;

const MAGIC: [u8; 8] = *b"wstacsh1";
/// Most bytes of a header: that of a sweep's file, every byte escaped, and a little.
const MOST_HEADER: u32 = 7 << 20;
/// Most bytes of a record's content: a recording of 90,000 events.
const MOST_CONTENT: u32 = 256 << 20;

/// What a set is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShardKind {
    /// The samples over time of a sweep's slides.
    Frames,
    /// The samples of random slides.
    RandomSlides,
    /// The samples of recordings.
    Recordings,
    /// The slides of a study of accuracy against cost.
    Trade,
}

impl ShardKind {
    /// Returns the command that makes such shards.
    pub fn command(self) -> &'static str {
        match self {
            Self::Trade => "wstac trade",
            _ => "wstac dataset",
        }
    }
}

/// The set that a shard is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardSet {
    /// What it is made of.
    pub kind: ShardKind,
    /// Number of its items.
    pub items: u32,
    /// A number for everything that its content depends on, in hexadecimal digits.
    pub digest: String,
    /// What the merge needs: a sweep's file, or JSON.
    pub plan: String,
}

/// The place of a shard in its set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u32,
    /// Number of all shards.
    pub of: u32,
    /// Versions of the program and of its data.
    version: String,
    /// Bytes of its records.
    bytes: u64,
    /// Its set.
    #[serde(flatten)]
    pub set: ShardSet,
}

/// Returns a number for a text, as a [`ShardSet`] has it: FNV-1a of the text and of the versions of program and data.
pub fn digest(text: &str) -> u64 {
    let version = (DATA_VERSION, env!("CARGO_PKG_VERSION"));
    let text = format!("{version:?} {text}");
    text.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

impl Shard {
    /// Describes shard `number` of `of` of a set.
    ///
    /// # Errors
    /// The set has fewer items than shards.
    pub fn new([number, of]: [u32; 2], set: ShardSet) -> Result<Self, Error> {
        if of > set.items {
            let message = format_args!("is {number}/{of}, expected at most {} shards, one per item", set.items);
            return Err(Error::new(ErrorKind::Usage, "--shard", message));
        }
        Ok(Self { number, of, version: version(), bytes: 0, set })
    }

    /// Returns the numbers of its items, in order.
    pub fn items(&self) -> impl Iterator<Item = u32> + use<> {
        (self.number.saturating_sub(1)..self.set.items).step_by(self.of.max(1) as usize)
    }

    /// Returns whether this is the same shard of the same set.
    pub fn is(&self, other: &Self) -> bool {
        *self == Self { bytes: self.bytes, ..other.clone() }
    }

    /// Writes the shard with the content of each of its items.
    ///
    /// # Errors
    /// The file cannot be written, the contents are not those of its items, in order, or one of them or the plan is too
    /// large.
    pub fn write(&self, out: &mut impl Write, contents: &[(u32, Vec<u8>)]) -> io::Result<()> {
        let wrong = |message| io::Error::new(io::ErrorKind::InvalidInput, message);
        if !self.items().eq(contents.iter().map(|(number, _)| *number)) {
            return Err(wrong("has items of another shard"));
        }
        if contents.iter().any(|(_, content)| content.len() > MOST_CONTENT as usize) {
            return Err(wrong("has an item of more than 256 MiB"));
        }
        let bytes = contents.iter().map(|(_, content)| 12 + content.len() as u64).sum();
        let text = serde_json::to_vec(&Self { bytes, ..self.clone() })?;
        if text.len() > MOST_HEADER as usize {
            return Err(wrong("has a plan of more than 7 MiB: too many recordings"));
        }
        let mut header = Vec::from(MAGIC);
        header.extend((text.len() as u32).to_le_bytes());
        header.extend(text);
        header.extend(crc32fast::hash(&header).to_le_bytes());
        out.write_all(&header)?;
        for (number, content) in contents {
            let head = [number.to_le_bytes(), (content.len() as u32).to_le_bytes()].concat();
            out.write_all(&head)?;
            out.write_all(content)?;
            out.write_all(&crc(&head, content).to_le_bytes())?;
        }
        Ok(())
    }

    /// Returns how it is called in messages.
    fn name(&self) -> String {
        format!("shard {}/{} of {} items, digest {}", self.number, self.of, self.set.items, self.set.digest)
    }
}

/// Returns the CRC of a record.
fn crc(head: &[u8], content: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(head);
    crc.update(content);
    crc.finalize()
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
            return Err(wrong("is no shard, expected a file that was made with --shard".into()));
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
        if !(1..=shard.of).contains(&shard.number) || shard.of > shard.set.items {
            return Err(wrong(format!("is {}, expected 1 to as many shards as items", shard.name())));
        }
        let bytes = file.metadata().map_err(failed)?.len();
        let start = header.len() as u64;
        let expected = start.saturating_add(shard.bytes);
        if bytes != expected {
            return Err(wrong(format!("has {bytes} bytes, expected {expected}: make it again ({})", shard.name())));
        }
        Ok(Self { shard, path: path.into(), start })
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Calls `take` with the number and content of every item, after they were checked.
    ///
    /// # Errors
    /// The file cannot be read, a record is damaged or of another item, or `take` fails.
    pub fn each(&self, mut take: impl FnMut(u32, &[u8]) -> Result<(), Error>) -> Result<(), Error> {
        let failed = |error: io::Error| Error::io(self.path.display(), error);
        let mut records = BufReader::new(open_seekable(&self.path).map_err(failed)?);
        records.seek(SeekFrom::Start(self.start)).map_err(failed)?;
        let (mut head, mut content, mut found) = ([0; 8], Vec::new(), [0; 4]);
        let mut left = self.shard.bytes;
        for number in self.shard.items() {
            let damaged = || self.damaged(number);
            left = left.checked_sub(12).ok_or_else(damaged)?;
            records.read_exact(&mut head).map_err(failed)?;
            let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
            left = left.checked_sub(u64::from(length)).filter(|_| length <= MOST_CONTENT).ok_or_else(damaged)?;
            content.resize(length as usize, 0);
            records.read_exact(&mut content).map_err(failed)?;
            records.read_exact(&mut found).map_err(failed)?;
            if !head.starts_with(&number.to_le_bytes()) || crc(&head, &content) != u32::from_le_bytes(found) {
                return Err(damaged());
            }
            take(number, &content)?;
        }
        Ok(())
    }

    /// Checks every record.
    ///
    /// # Errors
    /// [`each`](Self::each) would fail.
    pub fn check(&self) -> Result<(), Error> {
        self.each(|_, _| Ok(()))
    }

    /// Returns the error about an item whose record cannot be used.
    pub fn damaged(&self, number: u32) -> Error {
        let message = format_args!("has a damaged record, expected that of item {number}: make it again");
        Error::new(ErrorKind::Format, self.path.display(), message)
    }

    /// Returns the error about a plan that cannot be used.
    pub fn wrong_plan(&self, why: &impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Format, self.path.display(), format_args!("has a plan that cannot be used: {why}"))
    }
}

/// All shards of one set, in any order.
#[derive(Debug)]
pub struct WholeSet {
    first: ShardFile,
    others: Vec<ShardFile>,
}

impl WholeSet {
    /// Opens files, and checks that they are all shards of one set. Every record is checked.
    ///
    /// # Errors
    /// A shard is missing, there twice, of another set or damaged. The message names it.
    pub fn open(paths: &[PathBuf]) -> Result<Self, Error> {
        let mut files = paths.iter().map(|path| ShardFile::open(path)).collect::<Result<Vec<_>, Error>>()?.into_iter();
        let Some(first) = files.next() else {
            return Err(Error::new(ErrorKind::Usage, "merge", "has no shard, expected all of a set"));
        };
        let set = Self { first, others: files.collect() };
        set.check_places()?;
        set.files().try_for_each(ShardFile::check)?;
        Ok(set)
    }

    /// Returns the first of its files, which messages name.
    pub fn first(&self) -> &ShardFile {
        &self.first
    }

    /// Returns its files.
    pub fn files(&self) -> impl Iterator<Item = &ShardFile> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// Returns what it is.
    pub fn set(&self) -> &ShardSet {
        &self.first.shard.set
    }

    /// Reads every item with `read`, and returns them in order; `read` returns `None` for what it cannot read.
    ///
    /// # Errors
    /// A file cannot be read, or `read` fails.
    pub fn items<T>(&self, mut read: impl FnMut(u32, &[u8]) -> Option<T>) -> Result<Vec<T>, Error> {
        let mut found = BTreeMap::new();
        for file in self.files() {
            file.each(|number, content| {
                found.insert(number, read(number, content).ok_or_else(|| file.damaged(number))?);
                Ok(())
            })?;
        }
        Ok(found.into_values().collect())
    }

    /// Checks that each shard of the first one's set is there once.
    fn check_places(&self) -> Result<(), Error> {
        let first = &self.first.shard;
        let of = first.of;
        let mut paths: BTreeMap<u32, &Path> = BTreeMap::new();
        for file in self.files() {
            let wrong = |message: String| Error::new(ErrorKind::Config, file.path.display(), message);
            let shard = &file.shard;
            if shard.set.kind != first.set.kind {
                let (found, other) = (shard.set.kind.command(), self.first.path.display());
                return Err(wrong(format!(
                    "is a shard of {found} ({:?}), expected one of the set of {other}: {} ({:?})",
                    shard.set.kind,
                    first.set.kind.command(),
                    first.set.kind
                )));
            }
            if (shard.of, &shard.set) != (of, &first.set) {
                let (found, other, expected) = (shard.name(), self.first.path.display(), first.name());
                return Err(wrong(format!("is {found}, expected one of the set of {other}: {expected}")));
            }
            if let Some(other) = paths.insert(shard.number, &file.path) {
                let (number, other) = (shard.number, other.display());
                return Err(wrong(format!("is shard {number}/{of}, as is {other}, expected each once")));
            }
        }
        let missing = u64::from(of) - paths.len() as u64;
        if missing == 0 {
            return Ok(());
        }
        let some = (1..=of).filter(|number| !paths.contains_key(number)).take(20);
        let some = some.map(|number| format!("{number}/{of}")).collect::<Vec<_>>().join(", ");
        let more = if missing > 20 { ", …" } else { "" };
        let digest = &first.set.digest;
        let message =
            format_args!("of the set {digest}, {missing} of {of} shards are missing, expected all: {some}{more}");
        Err(Error::new(ErrorKind::Config, "merge", message))
    }
}

/// Returns the versions of the program and of its data.
fn version() -> String {
    format!("{}, data {DATA_VERSION}", env!("CARGO_PKG_VERSION"))
}
