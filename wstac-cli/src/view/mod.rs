//! Shows a sensor on a terminal: picture, map, traces and events.
//!
//! One thread reads the sensor and keeps `state` up to date. Another one draws it at most 15 times per second and reads
//! keys, so a slow terminal never delays the reading. `source` reads the sensor, `board` takes what a board reports,
//! `draw` draws, and `screen` has the terminal.

mod board;
mod draw;
mod screen;
mod source;
mod state;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use self::screen::{Key, Screen};
pub(crate) use self::source::SourceView;
use self::state::{About, State};
use crate::commands::removed::words;
use crate::commands::signals::{Ending as SignalEnding, finishing, number};
use wstac_host::error::Error;

/// The longest wait between two checks for signals.
const WAIT: Duration = Duration::from_millis(50);

struct SharedView {
    state: Mutex<State>,
    quit: AtomicBool,
    /// The signal that requested the end; 0 for none.
    signal: Arc<AtomicUsize>,
}

impl SharedView {
    fn is_over(&self) -> bool {
        self.quit.load(Ordering::Relaxed) || self.signal.load(Ordering::Relaxed) != 0
    }
}

/// Locks the state, even if a thread that held it panicked.
fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the other thread when one of them ends, for whatever reason.
struct EndBoth<'s>(&'s SharedView);

impl Drop for EndBoth<'_> {
    fn drop(&mut self) {
        self.0.quit.store(true, Ordering::Relaxed);
    }
}

/// Shows a sensor on the terminal of this process until a key or a signal ends it. Returns the last state, and the
/// signal; `None` if a key ended it, or if the terminal is gone.
///
/// # Errors
/// Returns an error if the terminal cannot be used, or the error of the sensor after the user quits.
pub(crate) fn run(sensor: &mut SourceView) -> Result<(State, Option<u8>), Error> {
    finishing(SignalEnding::Restored);
    let shared = SharedView { state: Mutex::new(sensor.state()), quit: AtomicBool::new(false), signal: number() };
    let screen = Screen::open()?;
    let (sender, keys) = channel();
    let failure = thread::scope(|scope| {
        scope.spawn(|| {
            let _end = EndBoth(&shared);
            screen.show(&shared, &sender);
        });
        let _end = EndBoth(&shared);
        read(sensor, &shared, &keys)
    });
    let signal = u8::try_from(shared.signal.load(Ordering::Relaxed)).ok().filter(|signal| *signal != 0);
    let state = locked(&shared.state).clone();
    failure.map_or(Ok((state, signal)), Err)
}

/// Reads until the end is requested, and returns the error that the sensor ended with.
fn read(sensor: &mut SourceView, shared: &SharedView, keys: &Receiver<Key>) -> Option<Error> {
    let (mut failure, mut is_over) = (None, false);
    while !shared.is_over() {
        match keys.recv_timeout(if is_over { WAIT } else { Duration::ZERO }) {
            Ok(key) => {
                press(key, sensor, &mut locked(&shared.state), is_over);
                continue;
            }
            // The screen is gone.
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if is_over {
            continue;
        }
        match sensor.step(&shared.state) {
            Ok(goes_on) => is_over = !goes_on,
            Err(error) => {
                locked(&shared.state).say(About::Trouble, error.to_string());
                (failure, is_over) = (Some(error), true);
            }
        }
        if is_over {
            let doing = if failure.is_some() { "FAILED" } else { "ended" };
            locked(&shared.state).doing = (About::Trouble, doing.to_owned());
        }
    }
    failure
}

fn press(key: Key, sensor: &mut SourceView, state: &mut State, is_over: bool) {
    match key {
        Key::Pause if !is_over => state.paused = !state.paused,
        Key::Rezero if !is_over => sensor.rezero(state),
        Key::Removed([what, instead]) => state.say(About::Note, words(what, instead)),
        // Keys of the screen itself, and what comes too late.
        Key::Quit | Key::Pause | Key::Rezero => {}
    }
}
