//! Reads without ever waiting longer than half a second, so that a signal is noticed.

use std::fs::File;
use std::io::{ErrorKind, Read, Result};

use crate::files::readable;

/// Longest wait, in ms.
pub(in crate::source) const WAIT_MS: libc::c_int = 500;

/// The origin of bytes.
pub(super) enum Input {
    /// A descriptor, which is polled before a read, so that the read does not block.
    Polled(File),
    /// Anything else.
    Blocking(Box<dyn Read + Send>),
}

/// The result of a read.
pub(super) enum Got {
    /// The number of bytes that were read; 0 at the end.
    Bytes(usize),
    /// No bytes in time.
    Nothing,
    /// No bytes, because a signal was handled.
    Interrupted,
}

impl Input {
    /// Reads once.
    pub(super) fn read(&mut self, room: &mut [u8]) -> Result<Got> {
        let read = match self {
            Self::Polled(file) => {
                readable(file, WAIT_MS).and_then(|ready| if ready { file.read(room).map(Some) } else { Ok(None) })
            }
            Self::Blocking(reader) => reader.read(room).map(Some),
        };
        match read {
            Ok(count) => Ok(count.map_or(Got::Nothing, Got::Bytes)),
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(Got::Interrupted),
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(Got::Nothing),
            Err(error) => Err(error),
        }
    }
}
