//! Opens files without ever waiting: a named pipe without a writer, or a terminal without a carrier, blocks nobody.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

/// Opens a file, a device or a named pipe for reading, at once.
///
/// Reads of a pipe do not wait either: poll it first, as [`Waiting`] does.
///
/// # Errors
/// It does not exist, or may not be read.
pub fn open(path: &Path) -> io::Result<File> {
    File::options().read(true).custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY).open(path)
}

/// Returns whether the path itself still names this open file: neither another file nor a link has taken its name.
pub fn has_name(file: &File, path: &Path) -> bool {
    let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    let (open, named) = (file.metadata().map(identity), path.symlink_metadata().map(identity));
    matches!((open, named), (Ok(open), Ok(named)) if open == named)
}

/// Opens a file in which a program seeks, at once.
///
/// # Errors
/// It does not exist, may not be read, or is no file.
pub fn open_seekable(path: &Path) -> io::Result<File> {
    of_file(open(path)?)
}

/// Returns an open file, and an error instead of a folder, a device or a pipe.
fn of_file(file: File) -> io::Result<File> {
    let kind = file.metadata()?.file_type();
    if kind.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder, expected a file"));
    }
    if !kind.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is a device or a pipe, expected a file"));
    }
    Ok(file)
}

/// Waits until a file has bytes or has ended, at most this many milliseconds, or without end if they are -1.
pub(crate) fn readable(file: &File, wait_ms: libc::c_int) -> io::Result<bool> {
    let mut descriptor = libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    // SAFETY: `descriptor` is one valid pollfd, and its descriptor is open as long as `file` is.
    let ready = unsafe { libc::poll(&raw mut descriptor, 1, wait_ms) };
    if ready < 0 { Err(io::Error::last_os_error()) } else { Ok(ready > 0) }
}

/// Reads a file, or a pipe until its writers are gone, and waits for bytes without busy reading.
#[derive(Debug)]
pub struct Waiting(pub File);

impl io::Read for Waiting {
    fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        loop {
            // Whoever reads all of it would go on after `Interrupted`, and no signal would end the wait.
            readable(&self.0, -1).map_err(|error| match error.kind() {
                io::ErrorKind::Interrupted => io::Error::other("interrupted before its end"),
                _ => error,
            })?;
            match self.0.read(room) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                read => return read,
            }
        }
    }
}

/// Returns the content of a file or of a pipe; `None` if it has more than `most` bytes.
///
/// # Errors
/// It cannot be read.
pub fn content(path: &Path, most: u64) -> io::Result<Option<Vec<u8>>> {
    all_of(Waiting(open(path)?), most)
}

/// Returns the content of a file; `None` if it has more than `most` bytes. It never waits for a writer, and does not
/// follow a link: others may choose the name.
///
/// # Errors
/// It cannot be read, or is no file.
pub fn file_content(path: &Path, most: u64) -> io::Result<Option<Vec<u8>>> {
    let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK | libc::O_NOCTTY;
    let file =
        File::options().read(true).custom_flags(flags).open(path).map_err(|error| match error.raw_os_error() {
            Some(libc::ELOOP) => io::Error::new(io::ErrorKind::InvalidInput, "is a link, expected a file"),
            _ => error,
        })?;
    all_of(of_file(file)?, most)
}

fn all_of(content: impl io::Read, most: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    io::Read::read_to_end(&mut io::Read::take(content, most.saturating_add(1)), &mut bytes)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::os::unix::fs::symlink;
    use std::time::{Duration, Instant};
    use std::{fs, thread};

    use super::*;

    fn pipe(path: &Path) {
        let name = std::ffi::CString::new(path.as_os_str().as_encoded_bytes()).unwrap();
        // SAFETY: the name ends with a zero byte.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
    }

    #[test]
    fn a_pipe_without_a_writer_blocks_no_opening() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        pipe(&path);
        let started = Instant::now();
        drop(open(&path).unwrap());
        let error = open_seekable(&path).unwrap_err().to_string();
        assert!(error.contains("a pipe"), "{error}");
        for path in [&path, Path::new("/dev/zero")] {
            let error = file_content(path, 9).unwrap_err().to_string();
            assert!(error.contains("is a device or a pipe, expected a file"), "{error}");
        }
        assert!(started.elapsed() < Duration::from_secs(1));
    }

    #[test]
    fn a_pipe_is_read_to_its_end_even_if_the_writer_comes_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        pipe(&path);
        let writer = path.clone();
        let writer = thread::spawn(move || {
            thread::sleep(Duration::from_millis(100));
            let mut pipe = File::options().write(true).open(writer).unwrap();
            for _ in 0..3 {
                pipe.write_all(b"abc").unwrap();
                thread::sleep(Duration::from_millis(30));
            }
        });
        assert_eq!(content(&path, 9).unwrap().unwrap(), b"abcabcabc");
        writer.join().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "1234").unwrap();
        assert_eq!(content(&file, 4).unwrap().unwrap(), b"1234");
        assert_eq!(content(&file, 3).unwrap(), None);
        assert_eq!(file_content(&file, 4).unwrap().unwrap(), b"1234");
        assert_eq!(file_content(&file, 3).unwrap(), None);
        let link = folder.path().join("link");
        symlink(&file, &link).unwrap();
        assert_eq!(file_content(&link, 9).unwrap_err().to_string(), "is a link, expected a file");
    }
}
