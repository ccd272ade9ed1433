//! Sets the terminal up, draws to it, reads keys from it, and always restores it.

use std::fs::File;
use std::io;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::getpgrp;
use rustix::termios::{OptionalActions, tcgetattr, tcgetpgrp, tcsetattr};

use super::draw::{Colors, draw};
use super::state::State;
use super::{SharedView, locked};
use wstac_host::error::{Error, ErrorKind};

/// Time between two drawings: 15 per second.
const PERIOD: Duration = Duration::from_millis(67);

/// A request of the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    Quit,
    /// Gather a new baseline.
    Rezero,
    /// Pause or continue.
    Pause,
    /// A key that was removed, with what to use instead.
    Removed([&'static str; 2]),
}

/// The replacements of the keys that showed another sensor, of those that went back and forth, and of the one that
/// recorded.
const SENSORS: [&str; 2] = ["key of a sensor", "wstac serve left=SOURCE right=SOURCE"];
const SEEK: [&str; 2] = ["way back and forth", "wstac serve FILE has it on its page"];
const RECORD: [&str; 2] = ["key r", "wstac record writes recordings, as does wstac serve --record-to FOLDER"];

/// Returns what an event of the terminal means, or `None` if it means nothing.
fn key(event: &Event) -> Option<Key> {
    use KeyCode::{Char, Down, Esc, Home, Left, Right, Tab, Up};
    let key = event.as_key_event().filter(|key| key.kind != KeyEventKind::Release)?;
    Some(match key.code {
        // In raw mode, Ctrl-C is a key and no signal.
        Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Key::Quit,
        Char('q' | 'Q') | Esc => Key::Quit,
        Char('z' | 'Z') => Key::Rezero,
        Char(' ') => Key::Pause,
        Char('r' | 'R') => Key::Removed(RECORD),
        Tab | Char('1'..='9') => Key::Removed(SENSORS),
        Left | Right | Up | Down | Home | Char('.' | ',' | '0') => Key::Removed(SEEK),
        _ => return None,
    })
}

/// A terminal in use, with its alternate screen and raw keys. It is restored after a panic, too.
pub(super) struct Screen {
    terminal: DefaultTerminal,
    colors: Colors,
    keyboard: Keyboard,
}

impl Screen {
    /// Takes over the terminal of this process.
    pub(super) fn open() -> Result<Self, Error> {
        let keyboard = File::open("/dev/tty").map(Keyboard).map_err(|error| Error::io("the terminal's keys", error))?;
        keyboard.check_foreground()?;
        let terminal = ratatui::try_init().map_err(|error| Error::io("the terminal", error))?;
        Ok(Self { terminal, colors: Colors::of(|name| std::env::var(name).ok()), keyboard })
    }

    /// Draws the state and passes keys on until the end, or until the terminal is gone.
    pub(super) fn show(mut self, shared: &SharedView, keys: &Sender<Key>) {
        // New frames are not drawn while the screen is paused.
        let mut frozen = None;
        while !shared.is_over() {
            if self.draw(shared, &mut frozen).is_err() {
                return;
            }
            let Ok(pressed) = self.keyboard.pressed() else { return };
            for key in pressed {
                // If nobody receives keys any more, the end is near.
                if key == Key::Quit || keys.send(key).is_err() {
                    return;
                }
            }
        }
    }

    /// Draws the state. It is locked while it is drawn in memory, but not while the terminal receives the result.
    fn draw(&mut self, shared: &SharedView, frozen: &mut Option<State>) -> io::Result<()> {
        let colors = self.colors;
        self.terminal.draw(|frame| {
            let mut state = locked(&shared.state);
            state.wants_picture = true;
            *frozen = (state.paused && state.live).then(|| frozen.take().unwrap_or_else(|| state.clone()));
            draw(frozen.as_ref().unwrap_or(&state), colors, frame.area(), frame.buffer_mut());
        })?;
        Ok(())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A terminal that is gone needs no restoring.
        let _ = ratatui::try_restore();
    }
}

/// The source of keys: the terminal of this process, whatever standard input is.
struct Keyboard(File);

impl Keyboard {
    /// Refuses a terminal that another process group uses: the kernel would stop this process as soon as it touches the
    /// terminal, and a stopped process does not end at a signal.
    fn check_foreground(&self) -> Result<(), Error> {
        match tcgetpgrp(&self.0) {
            Ok(group) if group != getpgrp() => {
                let message = "not in the foreground, expected the program that the terminal waits for; \
                               start it without & or timeout, or use timeout --foreground";
                Err(Error::new(ErrorKind::Unsupported, "the terminal", message))
            }
            // A terminal of another session has no foreground process that this one could compare with.
            _ => Ok(()),
        }
    }

    /// Waits until the next drawing, and returns the keys that were pressed meanwhile.
    fn pressed(&self) -> io::Result<Vec<Key>> {
        let started = Instant::now();
        let mut pressed = Vec::new();
        while let Some(left) = PERIOD.checked_sub(started.elapsed()) {
            if !self.wait(left)? {
                continue;
            }
            let mut has_read = false;
            while event::poll(Duration::ZERO)? {
                has_read = true;
                pressed.extend(key(&event::read()?));
            }
            if !has_read {
                self.remind()?;
            }
        }
        Ok(pressed)
    }

    /// Lets crossterm learn of keys again. It waits for news of the terminal, and forgets them if the size of the
    /// screen has changed before the key: without this, a key would wait for the next one. Setting what is set is such
    /// news.
    fn remind(&self) -> io::Result<()> {
        tcsetattr(&self.0, OptionalActions::Now, &tcgetattr(&self.0)?)?;
        Ok(())
    }

    /// Returns whether there is something to read. A terminal that is gone is an error here, because crossterm would
    /// read its end for ever.
    fn wait(&self, longest: Duration) -> io::Result<bool> {
        let longest = Timespec { tv_sec: 0, tv_nsec: longest.subsec_nanos().into() };
        let mut handles = [PollFd::new(&self.0, PollFlags::IN)];
        match poll(&mut handles, Some(&longest)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let found = handles[0].revents();
        if found.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        Ok(found.contains(PollFlags::IN))
    }
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::KeyEvent;

    use super::*;

    #[test]
    fn keys_with_and_without_capitals_and_those_that_were_removed() {
        let pressed = |code| key(&Event::Key(KeyEvent::new(code, KeyModifiers::NONE)));
        for (code, expected) in [
            (KeyCode::Char('z'), Some(Key::Rezero)),
            (KeyCode::Char('Q'), Some(Key::Quit)),
            (KeyCode::Char('R'), Some(Key::Removed(RECORD))),
            (KeyCode::Left, Some(Key::Removed(SEEK))),
            (KeyCode::Char(','), Some(Key::Removed(SEEK))),
            (KeyCode::Home, Some(Key::Removed(SEEK))),
            (KeyCode::Tab, Some(Key::Removed(SENSORS))),
            (KeyCode::Char('x'), None),
        ] {
            assert_eq!(pressed(code), expected, "{code:?}");
        }
    }
}
