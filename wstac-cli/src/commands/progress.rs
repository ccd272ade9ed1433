//! The progress of a command, for a person who waits.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use super::output::note;

/// The time between two lines if standard error is no terminal.
const BETWEEN_LINES: Duration = Duration::from_mins(1);

/// A line on standard error that is overwritten, and cleared at the end. It is shown on terminals only.
pub(super) struct OverwrittenLine {
    pub(super) is_terminal: bool,
}

impl OverwrittenLine {
    pub(super) fn new() -> Self {
        Self { is_terminal: std::io::stderr().is_terminal() }
    }

    pub(super) fn write(&self, text: impl Display) {
        if self.is_terminal {
            let _ = write!(std::io::stderr(), "\r{text}\x1b[K");
        }
    }
}

impl Drop for OverwrittenLine {
    fn drop(&mut self) {
        self.write("");
    }
}

/// The progress of counted work: an overwritten line. If standard error is no terminal, there is a line at the start
/// and one each minute; the result of the command is the line at the end.
pub(super) struct ProgressLine {
    /// The counted things: slides or recordings.
    what: &'static str,
    /// Number of things that are done, and the final count.
    done: usize,
    count: usize,
    started: Instant,
    /// The time of the last update.
    said: Instant,
    line: OverwrittenLine,
}

impl ProgressLine {
    /// Creates a progress line that starts with 0 of `count`, and prints it at once.
    pub(super) fn new(what: &'static str, count: usize) -> Self {
        let now = Instant::now();
        let progress = Self { what, done: 0, count, started: now, said: now, line: OverwrittenLine::new() };
        progress.say("");
        progress
    }

    /// Counts one more, and updates the line unless it was updated just now.
    pub(super) fn one_more(&mut self) {
        self.done += 1;
        let between = if self.line.is_terminal { Duration::from_millis(200) } else { BETWEEN_LINES };
        if self.said.elapsed() <= between {
            return;
        }
        self.said = Instant::now();
        let each = self.started.elapsed().as_secs_f64() / self.done as f64;
        let left = (each * self.count.saturating_sub(self.done) as f64).ceil();
        self.say(format_args!(", {left} s left"));
    }

    fn say(&self, left: impl Display) {
        let text = format!("{} of {} {} done{left}", self.done, self.count, self.what);
        if self.line.is_terminal { self.line.write(text) } else { note(text) }
    }
}

/// Does one long piece of work, and says every second on a terminal, otherwise every minute, that it goes on.
pub(super) fn while_working<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let line = OverwrittenLine::new();
    if !line.is_terminal {
        return while_saying(BETWEEN_LINES, what, |line: &str| note(line), work);
    }
    while_saying(Duration::from_secs(1), what, |text: &str| line.write(text), work)
}

/// Does work, and after each interval passes a line to `say`: `what`, and for how long it has gone on.
fn while_saying<T>(between: Duration, what: &str, say: impl Fn(&str) + Send, work: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let (done, waits) = channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while waits.recv_timeout(between) == Err(RecvTimeoutError::Timeout) {
                say(&format!("{what}: {} s", started.elapsed().as_secs()));
            }
        });
        let result = work();
        drop(done);
        result
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_work_says_that_it_goes_on() {
        let patience = Duration::from_mins(1);
        let (said, heard) = channel();
        let say = move |line: &str| said.send(line.to_owned()).unwrap_or_default();
        let lines = while_saying(Duration::from_millis(5), "training", say, || {
            [heard.recv_timeout(patience).unwrap(), heard.recv_timeout(patience).unwrap()]
        });
        let is_line = |line: &String| {
            line.strip_prefix("training: ").and_then(|rest| rest.strip_suffix(" s")?.parse::<u64>().ok()).is_some()
        };
        assert!(lines.iter().all(is_line), "{lines:?}");
        // Short work says nothing, and is not waited for.
        let started = Instant::now();
        assert_eq!(while_saying(patience, "training", |line| panic!("{line}"), || 7), 7);
        assert!(started.elapsed() < patience);
    }
}
