//! The line to a board: what it sends as reports, and what it is asked.

use super::port::{Got, Port, SILENT, WAIT};
use super::requests::Requests;
use super::{Monitor, Report, now};
use crate::error::{Error, ErrorKind};
use crate::output::OutputOptions;

/// The connection to a board.
#[derive(Debug)]
pub struct BoardLine {
    port: Port,
    monitor: Monitor,
    requests: Requests,
    /// The reads in a row that brought nothing.
    waits: u32,
    /// Whether it was reported that the port is not that of a board.
    is_foreign: bool,
}

/// The state of a line after a step.
// It is exhaustive: whoever drives it must handle every case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineStep {
    /// The board goes on.
    GoesOn,
    /// The board has ended the stream.
    Over,
    /// The port has ended.
    Ended,
}

impl BoardLine {
    /// Creates the line to the board at a port, which is asked for these outputs.
    pub fn new(port: Port, wanted: OutputOptions) -> Self {
        let monitor = Monitor::new(wanted);
        let mut requests = Requests::default();
        requests.extend(monitor.requests());
        Self { port, monitor, requests, waits: 0, is_foreign: false }
    }

    /// Returns the name of the port.
    pub fn name(&self) -> &str {
        self.port.name()
    }

    /// Returns what is known of the board.
    pub fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// Reads until the board or its port ends, or `is_over` says so, and hands on what the board reports. If the board
    /// does not say its end, the last report is an [`Output::End`](crate::output::Output::End) with what is known here.
    ///
    /// `is_over` sees what is known of the board between two reads.
    ///
    /// # Errors
    /// The port cannot be read or had no message, the board speaks another version of the link, or `give` returns an
    /// error.
    pub fn run<E: From<Error>>(
        &mut self,
        is_over: impl Fn(&Monitor) -> bool,
        mut give: impl FnMut(Report) -> Result<(), E>,
    ) -> Result<(), E> {
        let ended = loop {
            if is_over(&self.monitor) {
                break Ok(());
            }
            match self.step(&mut give) {
                Ok(LineStep::GoesOn) => {}
                Ok(LineStep::Over) => return Ok(()),
                Ok(LineStep::Ended) => {
                    break self.no_messages().map_or(Ok(()), |error| Err(error.into()));
                }
                Err(error) => break Err(error),
            }
        };
        let given = give(Report::Output(self.monitor.finish()));
        // The error of the port matters more than the end record.
        ended.and(given)
    }

    /// Returns the error of a port that has ended without a message: what came instead, and what to check. `None` if a
    /// message has arrived.
    pub fn no_messages(&self) -> Option<Error> {
        let foreign = self.monitor.foreign()?;
        Some(Error::new(ErrorKind::Data, self.port.name(), foreign.in_words()))
    }

    /// Sends what waits to be sent, reads once, and hands on what the board reports. What people need to know of the
    /// line itself is a note.
    ///
    /// # Errors
    /// The port cannot be read, the board speaks another version of the link, or `give` returns an error.
    pub fn step<E: From<Error>>(&mut self, mut give: impl FnMut(Report) -> Result<(), E>) -> Result<LineStep, E> {
        self.match_clock();
        if let Some(note) = self.requests.send(&mut self.port) {
            give(Report::Note(note))?;
        }
        if let Some(foreign) = self.monitor.foreign().filter(|foreign| !self.is_foreign && foreign.is_sure()) {
            self.is_foreign = true;
            give(Report::Note(format!("{} {}", self.port.name(), foreign.in_words())))?;
        }
        let mut room = [0; 4096];
        let got = self.port.read(&mut room)?;
        self.waits = if got == Got::Nothing { self.waits.saturating_add(1) } else { 0 };
        match got {
            Got::Bytes(count) => {
                self.match_clock();
                let (requests, was_heard) = (&mut self.requests, self.monitor.heard());
                let goes_on = self.monitor.take(&room[..count], |report| match report {
                    Report::Request(request) => {
                        requests.push(request);
                        Ok(())
                    }
                    report => give(report),
                })?;
                let is_cut = !was_heard && self.monitor.heard() && !self.monitor.board.is_described();
                if is_cut && !self.port.takes_requests() {
                    let name = self.port.name();
                    give(Report::Note(format!(
                        "{name} has lost its start: without the board's description there are no times"
                    )))?;
                }
                return Ok(if goes_on { LineStep::GoesOn } else { LineStep::Over });
            }
            Got::Nothing if self.waits == SILENT => {
                let nothing = self.monitor.foreign().filter(|foreign| foreign.count == 0);
                give(Report::Note(match nothing {
                    Some(nothing) => format!("{} {}", self.port.name(), nothing.in_words()),
                    None => format!("no data for {} s", (WAIT * SILENT).as_secs()),
                }))?;
            }
            Got::Nothing => {}
            Got::Gone => {
                // A device that is gone needs no note about its silence.
                self.waits = SILENT;
                give(Report::Note(format!("{} is gone; waiting for it", self.port.name())))?;
            }
            Got::Back => {
                give(Report::Note(format!("{} is back", self.port.name())))?;
                self.requests.extend(self.monitor.requests());
            }
            Got::Ended => return Ok(LineStep::Ended),
        }
        Ok(LineStep::GoesOn)
    }

    /// Tells the board the time. A file has the answers of a clock that is gone.
    fn match_clock(&mut self) {
        if self.port.takes_requests() {
            self.requests.extend(self.monitor.set_now(now()));
        }
    }
}
