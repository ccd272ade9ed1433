//! Sets the terminal up, draws to it, reads keys from it, and always restores it.

use std::fs::File;
use std::io::{self, IsTerminal};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::getpgrp;
use rustix::termios::{OptionalActions, tcgetattr, tcgetpgrp, tcsetattr};

use super::Shared;
use super::draw::{Colors, View, draw};
use super::keys::{Key, key};
use super::player::locked;
use super::state::State;
use wstac_host::error::{Error, ErrorKind};

/// Time between two drawings: 15 per second.
const PERIOD: Duration = Duration::from_millis(67);

/// A terminal in use, with its alternate screen and raw keys. It is restored after a panic, too.
pub(super) struct Screen {
    terminal: DefaultTerminal,
    colors: Colors,
    keyboard: Keyboard,
}

impl Screen {
    /// Takes over the terminal of this process.
    pub(super) fn open() -> Result<Self, Error> {
        let keyboard = Keyboard::open().map_err(|error| Error::io("the terminal's keys", error))?;
        keyboard.check_foreground()?;
        let terminal = ratatui::try_init().map_err(|error| Error::io("the terminal", error))?;
        Ok(Self { terminal, colors: Colors::of(|name| std::env::var(name).ok()), keyboard })
    }

    /// Draws the state and passes keys on until the end, or until the terminal is gone.
    pub(super) fn show(mut self, shared: &Shared, keys: &Sender<Key>) {
        let mut with_help = false;
        while !shared.is_over() {
            if self.draw(shared, with_help).is_err() {
                return;
            }
            shared.sensors.iter().for_each(|watched| watched.picture.store(true, Ordering::Relaxed));
            match self.keyboard.pressed() {
                Ok(pressed) => {
                    for key in pressed {
                        match key {
                            Key::Quit => return,
                            Key::Help => with_help = !with_help,
                            Key::Next | Key::Previous | Key::Choose(_) => choose(shared, key),
                            key => {
                                // Nobody receives keys any more: the end is near.
                                let _ = keys.send(key);
                            }
                        }
                    }
                }
                Err(_) => return,
            }
        }
    }

    /// Draws the states. They are locked while they are drawn in memory, but not while the terminal receives the result.
    fn draw(&mut self, shared: &Shared, with_help: bool) -> io::Result<()> {
        let colors = self.colors;
        self.terminal.draw(|frame| {
            let area = frame.area();
            let states: Vec<_> = shared.sensors.iter().map(|watched| locked(&watched.state)).collect();
            let states: Vec<&State> = states.iter().map(|state| &**state).collect();
            let chosen = shared.chosen.load(Ordering::Relaxed);
            draw(&View { states: &states, chosen, with_help, colors }, area, frame.buffer_mut());
        })?;
        Ok(())
    }
}

/// Shows one of several sensors alone, or all of them.
fn choose(shared: &Shared, key: Key) {
    let (count, chosen) = (shared.sensors.len(), shared.chosen.load(Ordering::Relaxed));
    if count > 1 {
        shared.chosen.store(chosen_by(key, chosen, count), Ordering::Relaxed);
    }
}

/// Returns the number of the sensor that a key chooses of so many, or 0 for all.
fn chosen_by(key: Key, chosen: usize, count: usize) -> usize {
    match key {
        Key::Next => (chosen + 1) % (count + 1),
        Key::Previous => (chosen + count) % (count + 1),
        Key::Choose(number) if number == chosen => 0,
        Key::Choose(number) if number <= count => number,
        _ => chosen,
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A terminal that is gone needs no restoring.
        let _ = ratatui::try_restore();
    }
}

/// The source of keys: standard input, or the terminal itself if standard input is something else.
enum Keyboard {
    Input(io::Stdin),
    Terminal(File),
}

impl Keyboard {
    fn open() -> io::Result<Self> {
        let input = io::stdin();
        if input.is_terminal() { Ok(Self::Input(input)) } else { File::open("/dev/tty").map(Self::Terminal) }
    }

    fn handle(&self) -> BorrowedFd<'_> {
        match self {
            Self::Input(input) => input.as_fd(),
            Self::Terminal(file) => file.as_fd(),
        }
    }

    /// Refuses a terminal that another process group uses: the kernel would stop this process as soon as it touches the
    /// terminal, and a stopped process does not end at a signal.
    fn check_foreground(&self) -> Result<(), Error> {
        match tcgetpgrp(self.handle()) {
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

    /// Lets crossterm learn of keys again. It waits for news of the terminal, and forgets them if the size of the screen
    /// has changed before the key: without this, a key would wait for the next one. Setting what is set is such news.
    fn remind(&self) -> io::Result<()> {
        let terminal = self.handle();
        tcsetattr(terminal, OptionalActions::Now, &tcgetattr(terminal)?)?;
        Ok(())
    }

    /// Returns whether there is something to read. A terminal that is gone is an error here, because crossterm would
    /// read its end for ever.
    fn wait(&self, longest: Duration) -> io::Result<bool> {
        let longest = Timespec { tv_sec: 0, tv_nsec: longest.subsec_nanos().into() };
        let mut handles = [PollFd::from_borrowed_fd(self.handle(), PollFlags::IN)];
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
    use super::*;

    #[test]
    fn keys_choose_one_of_several_sensors_and_all_again() {
        let mut chosen = 0;
        let mut press = |key| {
            chosen = chosen_by(key, chosen, 3);
            chosen
        };
        assert_eq!([Key::Next; 5].map(&mut press), [1, 2, 3, 0, 1]);
        assert_eq!([Key::Previous; 3].map(&mut press), [0, 3, 2]);
        assert_eq!([3, 3, 1, 4, 9].map(|number| press(Key::Choose(number))), [3, 0, 1, 1, 1]);
    }
}
