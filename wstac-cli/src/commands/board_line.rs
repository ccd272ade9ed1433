//! Reads a board and sends it what it is asked, for `wstac monitor` and `wstac view`.

use wstac_host::error::Error;
use wstac_host::monitor::port::{Got, Port, SILENT, WAIT};
use wstac_host::monitor::requests::Requests;
use wstac_host::monitor::{Monitor, Report, now};
use wstac_host::output::OutputOptions;

/// The connection to a board.
pub(crate) struct BoardLine {
    port: Port,
    monitor: Monitor,
    requests: Requests,
    /// The reads in a row that brought nothing.
    waits: u32,
}

/// How a board's stream goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LineStep {
    GoesOn,
    /// The board has ended it.
    Over,
    /// The port has ended.
    Ended,
}

impl BoardLine {
    pub(crate) fn new(port: Port, wanted: OutputOptions) -> Self {
        let monitor = Monitor::new(wanted);
        let mut requests = Requests::default();
        requests.extend(monitor.requests());
        Self { port, monitor, requests, waits: 0 }
    }

    pub(crate) fn name(&self) -> &str {
        self.port.name()
    }

    pub(crate) fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// Sends what waits to be sent, reads once, and hands on what the board reports. What people need to know of the
    /// line itself is a note.
    ///
    /// # Errors
    /// The port cannot be read, the board speaks another version of the link, or `give` returns an error.
    pub(crate) fn step<E: From<Error>>(
        &mut self,
        mut give: impl FnMut(Report) -> Result<(), E>,
    ) -> Result<LineStep, E> {
        self.match_clock();
        if let Some(reading) = self.requests.send(&mut self.port) {
            give(Report::Note(reading.in_words(self.port.name())))?;
        }
        let mut room = [0; 4096];
        let got = self.port.read(&mut room)?;
        self.waits = if got == Got::Nothing { self.waits.saturating_add(1) } else { 0 };
        match got {
            Got::Bytes(count) => {
                self.match_clock();
                let requests = &mut self.requests;
                let goes_on = self.monitor.take(&room[..count], |report| match report {
                    Report::Request(request) => {
                        requests.push(request);
                        Ok(())
                    }
                    report => give(report),
                })?;
                return Ok(if goes_on { LineStep::GoesOn } else { LineStep::Over });
            }
            Got::Nothing if self.waits == SILENT => {
                give(Report::Note(format!("no data for {} s", (WAIT * SILENT).as_secs())))?;
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
