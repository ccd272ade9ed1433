//! Reads a board, which finds its events itself.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

use super::super::output::Stop;
use super::super::records::Records;
use super::no_event::Reason;
use super::read::lacks_model;
use wstac_host::monitor::line::BoardLine;
use wstac_host::monitor::{Monitor, Report, telemetry};
use wstac_host::output::Output;
use wstac_host::plural::counted;

/// A board that is ready for reading.
pub(in crate::commands) struct OpenBoard<'a> {
    pub(in crate::commands) line: BoardLine,
    pub(in crate::commands) records: Records<'a>,
    /// Whether the state of the board is reported.
    pub(in crate::commands) has_status: bool,
    /// Requests the end.
    pub(in crate::commands) interrupted: &'a AtomicBool,
}

impl OpenBoard<'_> {
    /// Reads until the board or its port ends, or a signal requests the end. The end record is always written.
    ///
    /// # Errors
    /// Returns the error of the port, or of writing.
    pub(in crate::commands) fn read(self) -> Result<(), Stop> {
        let Self { mut line, mut records, has_status, interrupted } = self;
        let (mut lost_events, mut has_events, mut has_hint, clock) = (0, false, false, Cell::new(None));
        let is_over = |monitor: &Monitor| {
            clock.set(monitor.clock_match());
            interrupted.load(Ordering::Relaxed)
        };
        line.run(is_over, |report| {
            match report {
                Report::Output(output) => {
                    records.write(&output)?;
                    if !has_hint && lacks_model(&output) {
                        has_hint = true;
                        records.note("no model was given: wstac board --model builtin sends one to firmware with the feature models");
                    }
                    has_events |= matches!(output, Output::Event(_));
                    if !has_events && matches!(&output, Output::End(end) if end.frames > 0 && !end.baseline_complete) {
                        records.note(Reason::TooShort);
                    }
                }
                Report::Note(text) => records.note(text),
                Report::LostEvents(lost) => {
                    lost_events += lost;
                    records.note(format_args!("{} lost, {lost_events} since the start", counted(lost, "event")));
                }
                Report::Telemetry(telemetry) if has_status => {
                    records.note(format_args!("the board: {}", telemetry::in_words(&telemetry, clock.get())));
                }
                Report::Telemetry(_) | Report::Request(_) => {}
            }
            Ok(())
        })
    }
}
