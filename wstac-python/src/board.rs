//! A board as a source: it finds events itself, and its line is read report by report.

use std::collections::VecDeque;
use std::ffi::OsStr;

use wstac_host::error::Error;
use wstac_host::monitor::Report;
use wstac_host::monitor::line::{BoardLine, LineStep};
use wstac_host::monitor::port::Port;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::plural::counted;

use crate::outputs::{Found, Gathered};

/// The reason why a board follows no order.
pub(crate) const IS_BOARD: &str = "is a board, which finds its events itself; wstac board changes its settings";

/// The most notes that are kept of a line.
const MOST_NOTES: usize = 1000;

/// A board whose port is open.
pub(crate) struct Board {
    line: BoardLine,
    /// The records that have arrived and are not handed out yet.
    waiting: VecDeque<Found>,
    /// The number of the feature frame that comes next.
    next: u64,
    is_over: bool,
    /// Why it is over, until what had arrived before is handed out.
    failure: Option<Error>,
}

impl Board {
    /// Opens a port.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub(crate) fn open(port: &OsStr, baud: Option<u32>, wanted: OutputOptions) -> Result<Self, Error> {
        let line = BoardLine::new(Port::open(port, baud)?, wanted);
        Ok(Self { line, waiting: VecDeque::new(), next: 0, is_over: false, failure: None })
    }

    pub(crate) fn name(&self) -> &str {
        self.line.name()
    }

    /// Hands out what came next, or reads once. Returns whether the board goes on. What people need to know of it is
    /// added to the notes.
    ///
    /// # Errors
    /// The port cannot be read or had no message, or the board speaks another version of the link.
    pub(crate) fn step(&mut self, gathered: &mut Gathered, notes: &mut Vec<String>) -> Result<bool, Error> {
        if let Some(found) = self.waiting.pop_front() {
            gathered.take_of_board(found);
            return Ok(true);
        }
        if self.is_over {
            return self.failure.take().map_or(Ok(false), Err);
        }
        let Self { line, waiting, next, failure, .. } = self;
        let step = line.step(|report| {
            match report {
                Report::Output(output) => {
                    if let Output::Features(features) = &output {
                        *next = features.frame + 1;
                    }
                    waiting.push_back(Found::Output(*next, output));
                }
                Report::Note(note) => {
                    notes.truncate(MOST_NOTES - 1);
                    notes.push(note);
                }
                Report::LostEvents(lost) => {
                    let message = format!("{} lost", counted(lost, "event"));
                    waiting.push_back(Found::Fault(*next, "lost_events", message));
                }
                Report::Telemetry(_) | Report::Request(_) => {}
            }
            Ok::<(), Error>(())
        });
        match step {
            Ok(LineStep::GoesOn) => return Ok(true),
            Ok(LineStep::Over) => {}
            Ok(LineStep::Ended) => match line.no_messages() {
                Some(error) => *failure = Some(error),
                None => waiting.push_back(Found::Output(*next, line.monitor().finish())),
            },
            Err(error) => *failure = Some(error),
        }
        self.is_over = true;
        Ok(true)
    }
}
