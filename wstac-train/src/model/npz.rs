//! Reads NumPy's `.npz`: arrays of a zip archive, stored or deflated, of any size (zip64), element by element.
//!
//! The project has its own reader, because the libraries do not limit sizes before they read, and cost too much. `npyz`
//! 0.9 allocates a header of the length that a file claims, up to 4 GiB. It brings 20 crates, among them a parser
//! generator and stack switching in assembly, and opens archives with `zip` 0.6 of 2022. `ndarray-npy` parses headers
//! with the same library. The `zip` crate itself keeps a whole directory in memory, however long it is.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Take};
use std::path::Path;

use flate2::read::DeflateDecoder;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::files::open_seekable;

/// Longest `.npy` header in bytes, and largest number of members in an archive.
const MOST: usize = 65_536;
/// Largest directory of an archive, in bytes.
const MOST_DIRECTORY: u64 = 16 << 20;

pub(crate) struct Npz<'p> {
    path: &'p Path,
    members: Vec<Member>,
}

/// A member's entry in the directory.
struct Member {
    /// The name of the array, without `.npy`.
    name: String,
    /// The compression method of the member.
    method: u16,
    /// Number of bytes in the file.
    bytes: u64,
    /// Position of the member's own header.
    at: u64,
}

/// An array that is being read.
pub(crate) struct Array {
    data: Box<dyn Read>,
    /// NumPy's type, such as `<i2`.
    pub(crate) descr: String,
    pub(crate) shape: Vec<u64>,
}

fn word(bytes: &[u8], at: usize) -> u16 {
    bytes.get(at..at + 2).map_or(0, |bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
}

fn long(bytes: &[u8], at: usize) -> u64 {
    u64::from(word(bytes, at)) | u64::from(word(bytes, at + 2)) << 16
}

fn eight(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?))
}

fn bad(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}

impl<'p> Npz<'p> {
    pub(crate) fn open(path: &'p Path) -> Result<Self, Error> {
        let failed = |error: io::Error| Error::io(path.display(), error);
        let mut file = open_seekable(path).map_err(failed)?;
        let members = directory(&mut file).map_err(failed)?;
        Ok(Self { path, members })
    }

    /// Iterates over the names of its arrays.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.members.iter().map(|member| member.name.as_str())
    }

    /// Creates an error about one of its arrays.
    pub(crate) fn error(&self, array: &str, what: impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Format, self.path.display(), format_args!("array {array}: {what}"))
    }

    /// Opens an array: its header is read, and its data can be read.
    pub(crate) fn array(&self, name: &str) -> Result<Array, Error> {
        self.open_array(name).map_err(|error| self.error(name, error))
    }

    fn open_array(&self, name: &str) -> io::Result<Array> {
        let Some(member) = self.members.iter().find(|member| member.name == name) else {
            return Err(bad(format!("is missing, found {}", self.names().collect::<Vec<_>>().join(", "))));
        };
        // The file has a position of its own, because several arrays may be read at once.
        let mut file = open_seekable(self.path)?;
        file.seek(SeekFrom::Start(member.at))?;
        let mut header = [0; 30];
        file.read_exact(&mut header)?;
        if !header.starts_with(b"PK\x03\x04") {
            return Err(bad("its place in the archive is wrong"));
        }
        let skip = i64::from(word(&header, 26)) + i64::from(word(&header, 28));
        file.seek(SeekFrom::Current(skip))?;
        let stored: Take<io::BufReader<File>> = io::BufReader::with_capacity(1 << 16, file).take(member.bytes);
        let mut data: Box<dyn Read> = match member.method {
            0 => Box::new(stored),
            8 => Box::new(DeflateDecoder::new(stored)),
            other => return Err(bad(format!("compression {other}, expected none (0) or deflate (8)"))),
        };
        let (descr, shape) = header_of(&mut data)?;
        Ok(Array { data, descr, shape })
    }
}

impl Array {
    /// Reads the next elements into all of `bytes`.
    pub(crate) fn read(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.data.read_exact(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => bad("has less data than its shape says"),
            _ => error,
        })
    }
}

fn directory(file: &mut File) -> io::Result<Vec<Member>> {
    let length = file.seek(SeekFrom::End(0))?;
    // The end record has 22 bytes, followed by up to 65 535 bytes of comment.
    let tail = length.min(22 + 65_535);
    file.seek(SeekFrom::Start(length - tail))?;
    let mut end = Vec::new();
    file.take(tail).read_to_end(&mut end)?;
    let at = (0..end.len().saturating_sub(21)).rev().find(|&at| end[at..].starts_with(b"PK\x05\x06"));
    let Some(at) = at else {
        return Err(bad("is no zip archive, expected an .npz file"));
    };
    let (mut bytes, mut start) = (long(&end, at + 12), long(&end, at + 16));
    // A large archive has a record of its own, and a locator before this record points to it.
    if let Some(locator) = at.checked_sub(20)
        && end[locator..].starts_with(b"PK\x06\x07")
    {
        let wrong = || bad("its zip64 end record is damaged");
        file.seek(SeekFrom::Start(eight(&end, locator + 8).ok_or_else(wrong)?))?;
        let mut large = [0; 56];
        file.read_exact(&mut large)?;
        if !large.starts_with(b"PK\x06\x06") {
            return Err(wrong());
        }
        (bytes, start) = eight(&large, 40).zip(eight(&large, 48)).ok_or_else(wrong)?;
    }
    if bytes > MOST_DIRECTORY {
        return Err(bad(format!("has a directory of {bytes} bytes, expected at most {MOST_DIRECTORY}")));
    }
    file.seek(SeekFrom::Start(start))?;
    let mut directory = Vec::new();
    file.take(bytes).read_to_end(&mut directory)?;
    let mut members = Vec::new();
    let mut rest = directory.as_slice();
    while rest.starts_with(b"PK\x01\x02") && members.len() < MOST {
        let (name, extra, comment) = (word(rest, 28), word(rest, 30), word(rest, 32));
        let Some(text) = rest.get(46..46 + usize::from(name)) else { break };
        if word(rest, 8) & 1 == 1 {
            return Err(bad("is encrypted, expected a plain .npz file"));
        }
        let text = String::from_utf8_lossy(text);
        let name_text = text.strip_suffix(".npy").unwrap_or(&text).to_owned();
        let extras = rest.get(46 + usize::from(name)..).and_then(|rest| rest.get(..usize::from(extra)));
        let [_, bytes, at] = sizes(rest, extras.unwrap_or_default());
        members.push(Member { name: name_text, method: word(rest, 10), bytes, at });
        rest = rest.get(46 + usize::from(name) + usize::from(extra) + usize::from(comment)..).unwrap_or_default();
    }
    Ok(members)
}

/// Returns the bytes of a member's data, its bytes in the file, and the position of its header.
///
/// They are in the directory's entry. Values that do not fit in 32 bits are in the zip64 field of its extras, in this
/// order.
fn sizes(entry: &[u8], mut extras: &[u8]) -> [u64; 3] {
    let mut sizes = [24, 20, 42].map(|at| long(entry, at));
    while extras.len() >= 4 {
        let end = (4 + usize::from(word(extras, 2))).min(extras.len());
        if word(extras, 0) == 1 {
            let mut at = 4;
            for size in sizes.iter_mut().filter(|size| **size == 0xFFFF_FFFF) {
                if let Some(large) = eight(&extras[..end], at) {
                    *size = large;
                }
                at += 8;
            }
        }
        extras = &extras[end..];
    }
    sizes
}

/// Reads the type and shape of an `.npy` of version 1 to 3.
fn header_of(data: &mut dyn Read) -> io::Result<(String, Vec<u64>)> {
    let mut start = [0; 8];
    data.read_exact(&mut start)?;
    if !start.starts_with(b"\x93NUMPY") || !(1..=3).contains(&start[6]) {
        return Err(bad("is no .npy of version 1 to 3"));
    }
    let mut length = [0; 4];
    data.read_exact(&mut length[..if start[6] == 1 { 2 } else { 4 }])?;
    let length = u32::from_le_bytes(length) as usize;
    if length > MOST {
        return Err(bad(format!("a header of {length} bytes, expected at most {MOST}")));
    }
    let mut text = vec![0; length];
    data.read_exact(&mut text)?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let after = |key: &str| text.split_once(key).map(|(_, rest)| rest.trim_start_matches(['\'', '"', ':', ' ']));
    let unreadable = || bad(format!("header {:?}, expected descr, fortran_order and shape", text.trim_end()));
    let descr = after("descr").and_then(|rest| rest.split(['\'', '"']).next()).ok_or_else(unreadable)?;
    let fortran = after("fortran_order").ok_or_else(unreadable)?;
    let shape = after("shape").and_then(|rest| rest.strip_prefix('(')).and_then(|rest| rest.split_once(')'));
    let numbers = shape.ok_or_else(unreadable)?.0.split(',').map(str::trim).filter(|number| !number.is_empty());
    let shape: Option<Vec<u64>> = numbers.map(|number| number.parse().ok()).collect();
    let shape = shape.ok_or_else(unreadable)?;
    if !fortran.starts_with("False") && shape.len() > 1 {
        return Err(bad("is in Fortran order, expected C order"));
    }
    Ok((descr.to_owned(), shape))
}
