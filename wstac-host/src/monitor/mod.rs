//! A board's messages as outputs, which are those that a [`Session`](crate::session::Session) gives of a source here.

mod board;
pub mod clock;
mod delivery;
mod foreign;
pub mod learning;
pub mod line;
pub mod models;
pub mod pictures;
pub mod port;
pub mod requests;
pub mod settings;
pub mod telemetry;

use std::time::{Duration, SystemTime};

use rustix::time::{ClockId, clock_gettime};
use wstac_core::wire::{DecodeError, Decoder, Message, Request, VERSION};

use self::board::BoardState;
use self::foreign::Foreign;
use crate::error::{Error, ErrorKind};
pub use crate::output::Report;
use crate::output::{Output, OutputOptions};
use crate::plural::counted;

/// Turns a link's bytes into reports.
#[derive(Clone, Debug)]
pub struct Monitor {
    decoder: Decoder,
    board: BoardState,
    /// Whether a message has arrived.
    heard: bool,
    foreign: Foreign,
    /// Damaged messages since the last whole one.
    damaged: u64,
    /// Whether unknown messages were reported.
    unknown_said: bool,
    /// The messages that were refused because of an impossible number.
    refused: u64,
}

impl Monitor {
    /// Creates a monitor before the first byte.
    pub fn new(wanted: OutputOptions) -> Self {
        Self {
            decoder: Decoder::new(),
            board: BoardState::new(wanted),
            heard: false,
            foreign: Foreign::default(),
            damaged: 0,
            unknown_said: false,
            refused: 0,
        }
    }

    /// Returns the requests to a board that has just been connected: its description, and the outputs that are wanted.
    pub fn requests(&self) -> impl Iterator<Item = Request> + use<> {
        std::iter::once(Request::Hello).chain(self.board.requests())
    }

    /// Takes this machine's time, which is that of the next bytes. Returns a request for the board's clock if one is
    /// due.
    ///
    /// Once the board has answered, times of records are those of this machine's clocks. Before that, records have no
    /// times. Without this call, times are counted by the frame rate.
    pub fn set_now(&mut self, (monotonic, wall): (Duration, SystemTime)) -> Option<Request> {
        self.board.own_clock.set_now(monotonic, wall)
    }

    /// Returns whether any message has arrived.
    pub fn heard(&self) -> bool {
        self.heard
    }

    /// Returns what has come instead of messages; `None` if a message has arrived.
    fn foreign(&self) -> Option<&Foreign> {
        (!self.heard).then_some(&self.foreign)
    }

    /// Returns the number of messages that were refused because of an impossible number.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Takes the next bytes and hands everything that follows from them to `give`.
    ///
    /// It returns whether the stream goes on.
    ///
    /// # Errors
    /// The board speaks another version of the link.
    pub fn take(&mut self, bytes: &[u8], mut give: impl FnMut(Report)) -> Result<bool, Error> {
        for (at, &byte) in bytes.iter().enumerate() {
            let is_echo = !self.heard && self.foreign.take(byte);
            match self.decoder.push::<Message>(byte) {
                None => {}
                Some(Err(_)) if is_echo => {}
                Some(Ok(received)) => {
                    // Before the first message there is the end of one that was being sent.
                    let damaged = std::mem::take(&mut self.damaged);
                    if self.heard && (damaged > 0 || received.lost > 0) {
                        give(gap(damaged, received.lost));
                    }
                    self.heard = true;
                    let mut reports = Vec::new();
                    self.board.take(&received.message, received.first, &mut reports);
                    if self.board.ended && bytes[at + 1..].iter().any(|byte| !b"\0\r\n".contains(byte)) {
                        give(Report::Note("bytes after the end of the board's stream are not read".to_owned()));
                    }
                    // The end record is the last report.
                    reports.into_iter().for_each(&mut give);
                    if self.board.ended {
                        return Ok(false);
                    }
                }
                Some(Err(DecodeError::Version(version))) => {
                    let age = if version > VERSION { "newer" } else { "older" };
                    let expected = format!("expected {VERSION}: it is {age} than this wstac");
                    let message = format!("speaks version {version} of the link, {expected}");
                    return Err(Error::new(ErrorKind::Unsupported, "the board's firmware", message));
                }
                Some(Err(DecodeError::Unknown)) => {
                    if !std::mem::replace(&mut self.unknown_said, true) {
                        give(Report::Note("messages of a newer firmware are passed over".to_owned()));
                    }
                    self.heard = true;
                }
                Some(Err(DecodeError::Impossible(quantity))) => {
                    self.heard = true;
                    self.refused += 1;
                    // The first one is reported, then the tenth, the hundredth and so on.
                    if self.refused == 10_u64.pow(self.refused.ilog10()) {
                        let refused = counted(self.refused, "message");
                        give(Report::Note(format!("{refused} of the board refused: impossible {quantity}")));
                    }
                }
                // Damaged, or of a reason that is newer than this code.
                Some(Err(_)) => self.damaged += 1,
            }
        }
        Ok(true)
    }

    /// Ends the stream if the board does not, and returns the end record as far as it is known here.
    pub fn finish(&self) -> Output {
        Output::End(self.board.finish())
    }
}

/// Returns this machine's time: by its monotonic clock, which drivers of cameras use, too, and by its wall clock.
pub fn now() -> (Duration, SystemTime) {
    (Duration::try_from(clock_gettime(ClockId::Monotonic)).unwrap_or_default(), SystemTime::now())
}

fn gap(damaged: u64, lost: u16) -> Report {
    let damaged = (damaged > 0).then(|| counted(damaged, "damaged message"));
    let lost = (lost > 0).then(|| counted(lost, "message") + " lost");
    Report::Note(damaged.into_iter().chain(lost).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod time_tests;
