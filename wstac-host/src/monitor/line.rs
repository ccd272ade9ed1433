//! A board as a source: the line to it, what it sends as reports, and what it is asked.

use std::collections::VecDeque;
use std::ffi::OsStr;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::port::{Got, Port, SILENT, WAIT, port_of};
use super::requests::Requests;
use super::{Monitor, Report, now};
use crate::error::{Error, ErrorKind};
use crate::output::{OutputOptions, StreamSummary};
use crate::source::open::{OpenOptions, SourceKind};
use crate::source::{Source, SourceEvent, StreamClock, StreamInfo};

/// Boards as sources by name ([`port_of`]). They take no option but bits per second, which others do not.
///
/// It stands before the kinds of other devices in a list.
#[derive(Clone, Copy, Debug)]
pub struct Boards;

impl SourceKind for Boards {
    fn open(&self, name: &OsStr, options: &OpenOptions) -> Option<Result<Box<dyn Source>, Error>> {
        let OpenOptions { baud, delivery, .. } = *options;
        let refused = |message| Some(Err(Error::new(ErrorKind::Usage, name.display(), message)));
        match port_of(name) {
            None if baud.is_some() => refused("is no board; leave --baud out"),
            None => None,
            Some(_) if *options != (OpenOptions { baud, delivery, ..OpenOptions::default() }) => {
                refused("is a board, whose firmware sets the camera up; leave options of a camera out")
            }
            Some(port) => Some(BoardLine::open(port, baud).map(|board| Box::new(board) as Box<dyn Source>)),
        }
    }
}

/// The connection to a board, as a source that finds its outputs itself. It gives [`SourceEvent::Report`]s, and no
/// frames.
///
/// ```
/// use wstac_host::{output::Output, session::Session};
///
/// let outputs = Session::open("examples/board.bin")?.collect::<Result<Vec<_>, _>>()?;
/// assert!(outputs.iter().any(|output| matches!(output, Output::Event(event) if event.speed.is_ok())));
/// assert!(matches!(outputs.last(), Some(Output::End(end)) if end.frames > 0));
/// # Ok::<(), wstac_host::error::Error>(())
/// ```
#[derive(Debug)]
pub struct BoardLine {
    port: Port,
    monitor: Monitor,
    requests: Requests,
    info: StreamInfo,
    /// The reports that have not been handed out yet, and the error that follows them.
    reports: VecDeque<Report>,
    failure: Option<Error>,
    /// The state of the board's stream that was reported last.
    progress: StreamSummary,
    /// Whether all reports are there, with an end record as the last output.
    is_over: bool,
    /// The reads in a row that brought nothing.
    waits: u32,
    /// Whether it was reported that the port is not that of a board.
    is_foreign: bool,
}

impl BoardLine {
    /// Opens the port of a board: a serial device, `tcp:HOST:PORT`, `-` for standard input, or a file.
    ///
    /// # Errors
    /// As [`Port::open`].
    pub fn open(port: impl AsRef<OsStr>, baud: Option<u32>) -> Result<Self, Error> {
        let port = Port::open(port, baud)?;
        // The board describes itself later, for people.
        let size = FrameSize::new(400, 400).map_err(|error| Error::new(ErrorKind::Format, port.name(), error))?;
        let mut info =
            StreamInfo::new(format!("a board at {}", port.name()), size, PixelFormat::Gray, FrameRate::NOMINAL);
        (info.is_board, info.clock) = (true, StreamClock::Board);
        let mut line = Self {
            port,
            monitor: Monitor::new(OutputOptions::default()),
            requests: Requests::default(),
            info,
            reports: VecDeque::new(),
            failure: None,
            progress: StreamSummary::default(),
            is_over: false,
            waits: 0,
            is_foreign: false,
        };
        line.request(OutputOptions::default());
        Ok(line)
    }

    /// Sends what waits to be sent, reads once, and takes what the board reports. What people need to know of the line
    /// itself is a note.
    fn read(&mut self) -> Result<(), Error> {
        self.match_clock();
        self.reports.extend(self.requests.send(&mut self.port).map(Report::Note));
        if let Some(foreign) = self.monitor.foreign().filter(|foreign| !self.is_foreign && foreign.is_sure()) {
            self.is_foreign = true;
            self.reports.push_back(Report::Note(format!("{} {}", self.port.name(), foreign.in_words())));
        }
        let mut room = [0; 4096];
        let got = self.port.read(&mut room)?;
        self.waits = if got == Got::Nothing { self.waits.saturating_add(1) } else { 0 };
        let name = self.port.name();
        let note = match got {
            Got::Bytes(count) => return self.take(&room[..count]),
            Got::Nothing if self.waits == SILENT => {
                let nothing = self.monitor.foreign().filter(|foreign| foreign.count == 0);
                Some(match nothing {
                    Some(nothing) => format!("{name} {}", nothing.in_words()),
                    None => format!("no data for {} s", (WAIT * SILENT).as_secs()),
                })
            }
            Got::Nothing => None,
            Got::Gone => {
                // A device that is gone needs no note about its silence.
                self.waits = SILENT;
                Some(format!("{name} is gone; waiting for it"))
            }
            Got::Back => {
                self.requests.extend(self.monitor.requests());
                Some(format!("{name} is back"))
            }
            Got::Ended => {
                if let Some(foreign) = self.monitor.foreign() {
                    return Err(Error::new(ErrorKind::Data, name, foreign.in_words()));
                }
                self.stop();
                None
            }
        };
        self.reports.extend(note.map(Report::Note));
        Ok(())
    }

    fn take(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.match_clock();
        let (requests, reports, was_heard) = (&mut self.requests, &mut self.reports, self.monitor.heard());
        let goes_on = self.monitor.take(bytes, |report| match report {
            Report::Request(request) => requests.push(request),
            report => reports.push_back(report),
        })?;
        self.is_over = !goes_on;
        if !was_heard && self.monitor.heard() && !self.monitor.board.is_described() && !self.port.takes_requests() {
            let name = self.port.name();
            let note = format!("{name} has lost its start: without the board's description there are no times");
            self.reports.push_front(Report::Note(note));
        }
        let progress = self.monitor.board.finish();
        if goes_on && std::mem::replace(&mut self.progress, progress) != progress {
            self.reports.push_back(Report::Progress(progress));
        }
        Ok(())
    }

    /// Tells the board the time. A file has the answers of a clock that is gone.
    fn match_clock(&mut self) {
        if self.port.takes_requests() {
            self.requests.extend(self.monitor.set_now(now()));
        }
    }
}

impl Source for BoardLine {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.reports.is_empty() && !self.is_over {
            self.failure.take().map_or(Ok(()), Err)?;
            self.failure = self.read().err();
        }
        Ok(match self.reports.pop_front() {
            Some(report) => SourceEvent::Report(report),
            None if self.is_over => SourceEvent::End,
            None => SourceEvent::Waiting,
        })
    }

    fn request(&mut self, outputs: OutputOptions) {
        self.monitor = Monitor::new(outputs);
        self.requests = Requests::default();
        self.requests.extend(self.monitor.requests());
    }

    fn stop(&mut self) -> bool {
        if !std::mem::replace(&mut self.is_over, true) {
            self.reports.push_back(Report::Output(self.monitor.finish()));
        }
        true
    }
}
