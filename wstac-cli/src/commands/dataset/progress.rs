//! The progress of a command, for a person who waits.

use std::fmt;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use crate::commands::output::note;

/// A line on a terminal that is overwritten. Where standard error is no terminal, it is one line at the start; the
/// result of the command is the line at the end.
pub(in crate::commands) struct ProgressLine {
    /// The counted things: slides or recordings.
    what: &'static str,
    /// Number of things that are done, and the final count.
    done: usize,
    count: usize,
    started: Instant,
    /// The time of the last update; `None` if standard error is no terminal.
    said: Option<Instant>,
}

impl ProgressLine {
    /// Creates a progress line that starts with 0 of `count`, and prints it at once.
    pub(in crate::commands) fn new(what: &'static str, count: usize) -> Self {
        let now = Instant::now();
        let is_terminal = std::io::stderr().is_terminal();
        let progress = Self { what, done: 0, count, started: now, said: is_terminal.then_some(now) };
        if is_terminal {
            progress.write("");
        } else {
            note(format_args!("0 of {count} {what} done"));
        }
        progress
    }

    /// Counts one more, and updates the line unless it was updated just now.
    pub(in crate::commands) fn one_more(&mut self) {
        self.done += 1;
        let Some(said) = self.said.filter(|said| said.elapsed() > Duration::from_millis(200)) else { return };
        let each = self.started.elapsed().as_secs_f64() / self.done as f64;
        let left = (each * self.count.saturating_sub(self.done) as f64).ceil();
        self.write(format_args!(", {left} s left"));
        self.said = said.checked_add(said.elapsed());
    }

    fn write(&self, left: impl fmt::Display) {
        let _ = write!(std::io::stderr(), "\r{} of {} {} done{left}\x1b[K", self.done, self.count, self.what);
    }
}

impl Drop for ProgressLine {
    /// Clears the line for the next message.
    fn drop(&mut self) {
        if self.said.is_some() {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
