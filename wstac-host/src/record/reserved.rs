//! A file that has room for its own end.
//!
//! A recording that a full disk cuts off has no index, and viewers refuse it. So room is reserved ahead of the written
//! bytes, always enough to finish the file. A full disk is noticed while there is still room.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};

/// Bytes that are reserved at a time, if there is as much room.
const STEP: u64 = 32 << 20;

/// A file without a buffer of its own, with room ahead.
#[derive(Debug)]
pub(super) struct Reserved {
    file: File,
    /// The place of the next byte.
    at: u64,
    /// The end of the file.
    pub(super) end: u64,
    /// The end of the reserved room.
    room: u64,
    /// Largest file that the process may write.
    limit: u64,
    /// Whether the file system can reserve room.
    able: bool,
}

impl Reserved {
    /// Takes a file that is empty.
    pub(super) fn new(file: File) -> Self {
        let limit = getrlimit(Resource::Fsize).current.unwrap_or(u64::MAX);
        Self { file, at: 0, end: 0, room: 0, limit, able: true }
    }

    /// Reserves room for this many bytes more at the end, and returns whether they can be written.
    ///
    /// If the file system cannot reserve room, the answer is yes.
    ///
    /// # Errors
    /// The file cannot be used.
    pub(super) fn make_room(&mut self, bytes: u64) -> io::Result<bool> {
        let wanted = self.end.saturating_add(bytes);
        if wanted > self.limit {
            return Ok(false);
        }
        if wanted <= self.room || !self.able {
            return Ok(true);
        }
        for wanted in [wanted.saturating_add(STEP).min(self.limit), wanted] {
            let more = wanted - self.end;
            match fallocate(&self.file, FallocateFlags::KEEP_SIZE, self.end, more) {
                Ok(()) => {
                    self.room = wanted;
                    return Ok(true);
                }
                Err(Errno::NOSPC | Errno::DQUOT | Errno::FBIG) => {}
                Err(Errno::OPNOTSUPP | Errno::NOSYS | Errno::INVAL | Errno::NODEV) => {
                    self.able = false;
                    return Ok(true);
                }
                Err(Errno::INTR) => return Ok(true),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(false)
    }

    /// Gives back room that was reserved and not used, and makes sure that everything is on the disk.
    ///
    /// # Errors
    /// The file cannot be used.
    pub(super) fn close(mut self) -> io::Result<()> {
        self.give_back();
        self.file.sync_all()
    }

    fn give_back(&mut self) {
        if self.room > self.end {
            // On ext4 only a new size frees room behind the end: a hole there frees nothing. It is no error if room
            // cannot be given back, because it holds no bytes of the recording.
            let _ = self.file.set_len(self.end);
            self.room = self.end;
        }
    }
}

/// A file that could not be written to its end keeps no room either.
impl Drop for Reserved {
    fn drop(&mut self) {
        self.give_back();
    }
}

/// Gives back the room of a recording whose program was killed, unless another program writes the file.
///
/// It is no error if it cannot be given back.
pub(super) fn give_back_of_killed(path: &Path) {
    let file = File::options().write(true).custom_flags(libc::O_NONBLOCK).open(path);
    let Ok(file) = file else { return };
    // Every writer of a recording holds a lock.
    if file.try_lock().is_err() {
        return;
    }
    let Ok(metadata) = file.metadata() else { return };
    let used = metadata.blocks().saturating_mul(512);
    if metadata.is_file() && used > metadata.len().saturating_add(STEP / 8) {
        let _ = file.set_len(metadata.len());
    }
}

impl Write for Reserved {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.at += written as u64;
        self.end = self.end.max(self.at);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Reserved {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.at = self.file.seek(position)?;
        Ok(self.at)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        Ok(self.at)
    }
}
