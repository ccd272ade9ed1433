//! How far a command got, for whoever waits.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// How far it got: a line on a terminal that is written over and over.
pub(super) struct Progress {
    /// Of what: slides or recordings.
    what: &'static str,
    /// How many there were at the start, and how many there will be.
    there: u32,
    count: u32,
    started: Instant,
    /// When it was said last; nothing where nobody reads it.
    said: Option<Instant>,
}

impl Progress {
    /// Counts from what is there at the start.
    pub(super) fn new(what: &'static str, there: u32, count: u32) -> Self {
        let now = Instant::now();
        Self { what, there, count, started: now, said: std::io::stderr().is_terminal().then_some(now) }
    }

    /// Says it, if it was not said just now.
    pub(super) fn say(&mut self, done: u32) {
        let Some(said) = self.said.filter(|said| said.elapsed() > Duration::from_millis(200)) else { return };
        let each = self.started.elapsed().as_secs_f64() / f64::from(done.saturating_sub(self.there).max(1));
        let left = (each * f64::from(self.count.saturating_sub(done))).ceil();
        let _ = write!(std::io::stderr(), "\r{done} of {} {}, {left} s left\x1b[K", self.count, self.what);
        self.said = said.checked_add(said.elapsed());
    }
}

impl Drop for Progress {
    /// The line makes room for what is said next.
    fn drop(&mut self) {
        if self.said.is_some() {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
