//! Shows a source on a terminal: picture, map, traces and events.
//!
//! One thread reads the source and keeps `state` up to date. Another one draws it at most 15 times per second and reads
//! keys, so a slow terminal never delays the reading. `player` reads, `recording` records on request, `draw` draws,
//! `screen` has the terminal, and `board` reads a board.

pub(crate) mod board;
mod draw;
mod keys;
mod player;
mod rate_meter;
mod recording;
mod screen;
mod state;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use self::keys::Key;
use self::player::{Player, locked};
pub(crate) use self::recording::Recordings;
use self::screen::Screen;
use self::state::State;
use crate::commands::signals::{Ending as SignalEnding, finishing, number};
use wstac_host::error::Error;
use wstac_host::session::Processor;
use wstac_host::source::pace::Pace;
use wstac_host::source::{Source, StreamInfo};

/// The longest wait between two checks for signals.
const WAIT: Duration = Duration::from_millis(50);

/// The options of the view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// Whether it is a camera, which has a pace of its own.
    pub live: bool,
    /// Whether a file or scene is played as fast as possible.
    pub fast: bool,
}

/// The result of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ending {
    /// The signal that ended it; `None` if a key did, or if the terminal is gone.
    pub signal: Option<u8>,
    /// Feature frames that were read.
    pub frames: u64,
    /// Camera frames that were lost.
    pub dropped: u64,
    /// Events that were found.
    pub events: u64,
}

/// The data that both threads share.
#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// Whether the end was requested.
    quit: AtomicBool,
    /// Whether the screen needs a picture.
    picture: AtomicBool,
    /// The signal that requested the end; 0 for none.
    signal: Arc<AtomicUsize>,
}

impl Shared {
    /// Creates the data before the first frame. Signals ask for the end from now on.
    fn new(state: State) -> Self {
        finishing(SignalEnding::Restored);
        let signal = number();
        Self { state: Mutex::new(state), quit: AtomicBool::new(false), picture: AtomicBool::new(true), signal }
    }

    /// Returns the result of the view.
    fn ending(&self) -> Ending {
        let state = locked(&self.state);
        let signal = u8::try_from(self.signal.load(Ordering::Relaxed)).ok().filter(|signal| *signal != 0);
        Ending { signal, frames: state.frame, dropped: state.dropped, events: state.events }
    }

    fn is_over(&self) -> bool {
        self.quit.load(Ordering::Relaxed) || self.signal.load(Ordering::Relaxed) != 0
    }
}

/// Ends the other thread when one of them ends, for whatever reason.
struct EndBoth<'s>(&'s Shared);

impl Drop for EndBoth<'_> {
    fn drop(&mut self) {
        self.0.quit.store(true, Ordering::Relaxed);
    }
}

/// Shows a source on the terminal of this process until a key or a signal ends it. `reading` gives features.
///
/// # Errors
/// Returns an error if the terminal cannot be used, or the error of the source after the user quits.
pub(crate) fn run(
    source: &mut dyn Source,
    info: &StreamInfo,
    reading: &mut Processor,
    recordings: &mut Recordings,
    options: Options,
) -> Result<Ending, Error> {
    let pace = (!options.live && !options.fast).then(|| Pace::new(info.rate));
    let (player, state) = Player::new(source, info, reading, recordings, options.live);
    show(state, |shared, keys| read(player, shared, keys, pace))
}

/// Shows a state on the terminal of this process while `read` keeps it up to date.
///
/// # Errors
/// Returns an error if the terminal cannot be used, or the one that `read` returns.
fn show(state: State, read: impl FnOnce(&Shared, &Receiver<Key>) -> Option<Error>) -> Result<Ending, Error> {
    let shared = Shared::new(state);
    let screen = Screen::open()?;
    let (sender, keys) = channel();
    let failure = thread::scope(|scope| {
        let shared = &shared;
        scope.spawn(move || {
            let _end = EndBoth(shared);
            screen.show(shared, &sender);
        });
        let _end = EndBoth(shared);
        read(shared, &keys)
    });
    failure.map_or_else(|| Ok(shared.ending()), Err)
}

/// Reads until the end is requested, and returns the error that the source ended with.
fn read(mut player: Player<'_>, shared: &Shared, keys: &Receiver<Key>, mut pace: Option<Pace>) -> Option<Error> {
    let mut failure = None;
    while !shared.is_over() {
        let stands = {
            let state = locked(&shared.state);
            state.paused && !state.live
        };
        // The wait, without keys.
        let wait =
            if stands || !player.goes_on() { WAIT } else { pace.map_or(Duration::ZERO, |pace| pace.wait()).min(WAIT) };
        match keys.recv_timeout(wait) {
            Ok(key) => {
                match key {
                    Key::Rezero => player.rezero(&shared.state),
                    Key::Record => player.record(&shared.state),
                    Key::Pause => pause(shared, pace.as_mut()),
                    // Keys of the screen itself.
                    Key::Quit | Key::Help => {}
                }
                continue;
            }
            // The screen is gone.
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if stands || !player.goes_on() || pace.is_some_and(|pace| !pace.wait().is_zero()) {
            continue;
        }
        match player.step(&shared.state, shared.picture.swap(false, Ordering::Relaxed)) {
            Ok(passed) => {
                if let Some(pace) = &mut pace {
                    pace.advance(passed);
                }
            }
            Err(error) => failure = Some(error),
        }
    }
    // After a key, a signal or the loss of the terminal, the file of a recording is complete.
    player.end_recording(&shared.state);
    failure
}

/// Pauses or continues.
fn pause(shared: &Shared, pace: Option<&mut Pace>) {
    let mut state = locked(&shared.state);
    state.paused = !state.paused;
    if let Some(pace) = pace {
        pace.restart();
    }
}
