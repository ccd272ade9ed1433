//! The bytes of a file at any place of it, in little memory.

use std::fs::File;
use std::io::{self, ErrorKind as IoErrorKind};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

use crc32fast::Hasher;
use rustix::fs::{SeekFrom, seek};
use rustix::io::Errno;

use crate::error::{Error, ErrorKind};

/// Bytes of the operation code and the length of a record.
pub(super) const HEAD: u64 = 9;
/// Bytes that are read at a time.
const WINDOW: u64 = 1 << 16;

/// A file that is read.
#[derive(Clone, Debug)]
pub(super) struct FileBytes {
    subject: String,
    file: Arc<File>,
    length: u64,
    /// Some bytes of the file, and their place.
    window: Vec<u8>,
    start: u64,
    /// A chunk that was unpacked, which is read in place of the file.
    unpacked: Option<Vec<u8>>,
}

impl FileBytes {
    /// Opens a file, and never waits for the writer of a pipe.
    ///
    /// # Errors
    /// The file cannot be read, or is no regular file.
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let subject = path.display().to_string();
        let failed = |error| Error::io(&subject, error);
        // Without this flag, a pipe would be opened only when somebody writes it.
        let file = crate::files::open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if !metadata.is_file() {
            let message = "is a folder, a device or a pipe, expected an MCAP file";
            return Err(Error::new(ErrorKind::Format, &subject, message));
        }
        let length = metadata.len();
        Ok(Self { subject, file: Arc::new(file), length, window: Vec::new(), start: 0, unpacked: None })
    }

    /// Returns the error of a read that failed.
    pub(super) fn failed(&self, error: impl Into<io::Error>) -> Error {
        Error::io(&self.subject, error.into())
    }

    /// Returns the error about a file that no reader takes.
    pub(super) fn refused(&self, message: String) -> Error {
        Error::new(ErrorKind::Format, &self.subject, message)
    }

    /// Returns the size of the file when it was opened, or of the chunk that is read in its place.
    pub(super) fn length(&self) -> u64 {
        self.unpacked.as_ref().map_or(self.length, |chunk| chunk.len() as u64)
    }

    /// Reads a chunk that was unpacked in place of the file, or the file again. Returns the chunk that was read before.
    pub(super) fn set_unpacked(&mut self, chunk: Option<Vec<u8>>) -> Option<Vec<u8>> {
        std::mem::replace(&mut self.unpacked, chunk)
    }

    /// Returns bytes at a place; fewer than `count` at the end of the file, and at most 64 KiB.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn peek(&mut self, at: u64, count: usize) -> Result<&[u8], Error> {
        let count = (count as u64).min(WINDOW).min(self.length().saturating_sub(at)) as usize;
        if let Some(chunk) = &self.unpacked {
            return Ok(part(chunk, at, count as u64).unwrap_or_default());
        }
        let there = at.checked_sub(self.start).map_or(0, |from| (self.window.len() as u64).saturating_sub(from));
        if there < count as u64 {
            self.window.resize(WINDOW as usize, 0);
            let read = read_at_most(&self.file, &mut self.window, at);
            let read = read.map_err(|error| Error::io(&self.subject, error))?;
            self.window.truncate(read);
            self.start = at;
        }
        let from = (at - self.start) as usize;
        let rest = self.window.get(from..).unwrap_or_default();
        Ok(rest.get(..count).unwrap_or(rest))
    }

    /// Returns the operation code and the length of a record; `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn head(&mut self, at: u64) -> Result<Option<(u8, u64)>, Error> {
        let Some((op, length)) = self.peek(at, HEAD as usize)?.split_first() else { return Ok(None) };
        Ok(length.first_chunk().map(|length| (*op, u64::from_le_bytes(*length))))
    }

    /// Returns the first place from here on that may hold other bytes than zeros: a file's holes take no time.
    pub(super) fn next_data(&self, at: u64) -> u64 {
        if self.unpacked.is_some() {
            return at;
        }
        match seek(&self.file, SeekFrom::Data(at)) {
            Ok(next) => next.max(at),
            Err(Errno::NXIO) => self.length.max(at),
            // A file system without holes.
            Err(_) => at,
        }
    }

    /// Reads exactly this many bytes of a place.
    ///
    /// # Errors
    /// The file cannot be read or is too short, or there is not so much memory.
    pub(super) fn read(&self, at: u64, count: usize, into: &mut Vec<u8>) -> Result<(), Error> {
        into.clear();
        into.try_reserve_exact(count).map_err(|_| self.failed(IoErrorKind::OutOfMemory))?;
        if let Some(chunk) = &self.unpacked {
            let bytes = part(chunk, at, count as u64);
            into.extend_from_slice(bytes.ok_or_else(|| self.failed(IoErrorKind::UnexpectedEof))?);
            return Ok(());
        }
        into.resize(count, 0);
        self.file.read_exact_at(into, at).map_err(|error| self.failed(error))
    }

    /// Returns the checksum of the bytes from one place to another.
    ///
    /// # Errors
    /// The file cannot be read or is too short.
    pub(super) fn hash(&self, from: u64, to: u64) -> Result<Hasher, Error> {
        let mut hasher = Hasher::new();
        if let Some(chunk) = &self.unpacked {
            let bytes = part(chunk, from, to.saturating_sub(from));
            hasher.update(bytes.ok_or_else(|| self.failed(IoErrorKind::UnexpectedEof))?);
            return Ok(hasher);
        }
        let mut buffer = [0; 1 << 14];
        let mut at = from;
        while at < to {
            let wanted = (to - at).min(buffer.len() as u64);
            let bytes = buffer.get_mut(..wanted as usize).unwrap_or_default();
            self.file.read_exact_at(bytes, at).map_err(|error| self.failed(error))?;
            hasher.update(bytes);
            at += wanted;
            if bytes.iter().all(|&byte| byte == 0) {
                let next = self.next_data(at).min(to);
                hasher.combine(&of_zeros(next - at));
                at = next;
            }
        }
        Ok(hasher)
    }
}

/// Returns the checksum of so many zeros, without reading them.
fn of_zeros(mut count: u64) -> Hasher {
    let (mut all, mut some) = (Hasher::new(), Hasher::new());
    some.update(&[0]);
    while count > 0 {
        if count % 2 == 1 {
            all.combine(&some);
        }
        count /= 2;
        if count > 0 {
            some.combine(&some.clone());
        }
    }
    all
}

/// Fills as much of the buffer as the file has.
fn read_at_most(file: &File, buffer: &mut [u8], at: u64) -> io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match file.read_at(rest, at.saturating_add(filled as u64)) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Returns this many bytes of a place.
fn part(bytes: &[u8], at: u64, count: u64) -> Option<&[u8]> {
    let from = usize::try_from(at).ok()?;
    bytes.get(from..)?.get(..usize::try_from(count).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_of_zeros_is_that_of_reading_them() {
        for count in [0, 1, 2, 7, 1000, 65_537] {
            let mut read = Hasher::new();
            read.update(&vec![0; count]);
            assert_eq!(of_zeros(count as u64).finalize(), read.finalize(), "{count}");
        }
    }
}
