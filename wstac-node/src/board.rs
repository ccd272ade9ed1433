//! Reads a board, which has found its events itself.

use std::ffi::OsStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use wstac_host::error::Error;
use wstac_host::monitor::line::BoardLine;
use wstac_host::monitor::port::Port;
use wstac_host::monitor::{Monitor, Report};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::plural::counted;

use crate::note;
use crate::publisher::PublisherHandle;

/// A board whose port is open.
pub(crate) struct ConnectedBoard {
    name: String,
    line: BoardLine,
}

impl ConnectedBoard {
    /// Opens the port of a board.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub(crate) fn open(name: &str, source: &OsStr, baud: Option<u32>) -> Result<Self, Error> {
        let line = BoardLine::new(Port::open(source, baud)?, OutputOptions::LIVE);
        note(format_args!("{name}: a board at {}", line.name()));
        Ok(Self { name: name.to_owned(), line })
    }

    /// Reads until the board or its connection ends, or until `ends` is set. Returns whether it did not fail.
    pub(crate) fn run(self, publisher: &PublisherHandle, ends: &AtomicBool) -> bool {
        let Self { name, mut line } = self;
        let count = |output: &Output| {
            if let Output::End(end) = output {
                publisher.counts().frames.store(end.frames, Ordering::Relaxed);
                publisher.counts().lost.store(end.dropped, Ordering::Relaxed);
            }
        };
        let is_over = |monitor: &Monitor| {
            count(&monitor.finish());
            ends.load(Ordering::Relaxed)
        };
        let read = line.run(is_over, |report| {
            match report {
                Report::Output(output) => {
                    count(&output);
                    publisher.output(&output, SystemTime::now())?;
                }
                Report::Note(text) => note(format_args!("{name}: {text}")),
                Report::LostEvents(lost) => {
                    publisher.counts().lost_events.fetch_add(lost, Ordering::Relaxed);
                    note(format_args!("{name}: {} lost", counted(lost, "event")));
                }
                // The clock of the board is used, and the rest of its state is for wstac monitor --status.
                Report::Telemetry(_) | Report::Request(_) => {}
            }
            Ok::<(), Error>(())
        });
        if let Err(error) = &read {
            note(format_args!("{name}: {error}"));
        }
        read.is_ok()
    }
}
