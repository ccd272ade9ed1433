//! Standard output and standard error, which may be closed, full or a terminal.

use std::fmt;
use std::io::{self, StdoutLock, Write};

use std::path::Path;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Serialize;

use super::signals::is_readers_time_over;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::source::{LossReason, SourceEvent};
pub(super) use wstac_host::text::{text, text_of};
use wstac_host::visible;

/// Why a command ends early.
#[derive(Debug)]
pub(super) enum Stop {
    /// Nobody reads the output any more, which is no error.
    OutputClosed,
    /// Something cannot be used.
    Failed(Error),
    /// A signal with this number asked for the end before there was a result.
    Interrupted(u8),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::OutputClosed,
            _ => Self::Failed(Error::io("standard output", error)),
        }
    }
}

/// Standard output for text or JSON, without characters that control a terminal.
///
/// Whoever writes must not divide a character between two writes: `write!` never does.
pub(super) struct Visible<W>(W);

/// Returns standard output for text or JSON.
pub(super) fn stdout() -> Visible<StdoutLock<'static>> {
    Visible(io::stdout().lock())
}

impl<W: Write> Write for Visible<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // A pipe that can be written takes this much at once, and what waits in the buffer.
        for part in visible::lines(&String::from_utf8_lossy(bytes)).as_bytes().chunks(2048) {
            wait_for_reader()?;
            self.0.write_all(part)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Waits until standard output can be written. After a signal, a reader that takes nothing is waited for no longer.
fn wait_for_reader() -> io::Result<()> {
    let out = io::stdout();
    let longest = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
    loop {
        match poll(&mut [PollFd::new(&out, PollFlags::OUT)], Some(&longest)) {
            Ok(0) | Err(rustix::io::Errno::INTR) if is_readers_time_over() => {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            Ok(0) | Err(rustix::io::Errno::INTR) => {}
            // Writing says what is wrong.
            Ok(_) | Err(_) => return Ok(()),
        }
    }
}

/// Prints a value as one line of JSON.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), Stop> {
    Ok(writeln!(stdout(), "{}", json(value)?)?)
}

/// Returns a value as JSON, for standard output.
pub(super) fn json(value: &impl Serialize) -> Result<String, Error> {
    serde_json::to_string(value).map_err(|error| Error::with_cause(ErrorKind::Io, "standard output", error))
}

/// The frames of a source that were lost, by reason, and whether there were others.
#[derive(Default)]
pub(super) struct LossReport {
    lost: Vec<(LossReason, u64)>,
    has_frame: bool,
}

impl LossReport {
    pub(super) fn source_event(&mut self, event: &SourceEvent<'_>) {
        match event {
            SourceEvent::Frame(_) | SourceEvent::Taxels(_) => self.has_frame = true,
            SourceEvent::Lost { frames, reason } => match self.lost.iter_mut().find(|(known, _)| known == reason) {
                Some((_, count)) => *count = count.saturating_add(*frames),
                None => self.lost.push((reason.clone(), *frames)),
            },
            _ => {}
        }
    }

    /// Returns an error if a source that has ended had frames, and all of them were lost.
    pub(super) fn expect_a_frame(&self, about: &str) -> Result<(), Error> {
        if self.has_frame || self.lost.is_empty() {
            return Ok(());
        }
        let message = "all frames that were read are lost, expected at least one that can be used";
        Err(Error::new(ErrorKind::Data, about, message))
    }

    /// Reports one line per reason.
    pub(super) fn say(&self, note: impl Fn(String)) {
        for (reason, count) in &self.lost {
            note(format!("{} lost: {reason}", counted(*count, "frame")));
        }
    }
}

/// Refuses to overwrite a file without `force`, and always refuses a path that is no file or in no folder.
pub(super) fn check_new(path: &Path, force: bool) -> Result<(), Error> {
    let refused = |kind, message: &str| Err(Error::new(kind, path.display(), message));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if folder.is_some_and(|folder| !folder.is_dir()) {
        return refused(ErrorKind::NotFound, "is in a folder that does not exist, expected an existing one");
    }
    // Checks the path itself: links are refused, wherever they lead.
    match path.symlink_metadata() {
        Err(_) => Ok(()),
        Ok(there) if there.is_dir() => refused(ErrorKind::Io, "is a folder, expected a new file"),
        Ok(there) if !there.is_file() => refused(ErrorKind::Io, "is a device, a pipe or a link, expected a new file"),
        Ok(_) if force => Ok(()),
        Ok(_) => refused(ErrorKind::AlreadyExists, "exists already, expected a new file, or --force to overwrite it"),
    }
}

/// Writes a note of one line to standard error, which may be closed.
pub(super) fn note(message: impl fmt::Display) {
    // A single write, because several threads may write notes.
    let _ = io::stderr().write_all(format!("wstac: {}\n", visible::OneLine(message)).as_bytes());
}
