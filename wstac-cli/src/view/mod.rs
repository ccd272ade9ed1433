//! A source on a terminal: picture, map, traces, events, as they come.
//!
//! One thread reads the source and keeps `state` up to date, another draws it at most 15 times a second and reads keys; a slow
//! terminal never holds up the reading. `player` reads, `recording` has
//! what a key starts, `draw` draws, `screen` has the terminal, and `picture` makes a frame small.

mod clock;
mod draw;
mod keys;
mod picture;
mod player;
mod recording;
mod screen;
mod state;

use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use self::clock::Pace;
use self::keys::Key;
use self::player::{Player, locked};
pub(crate) use self::recording::Recordings;
use self::screen::Screen;
use self::state::State;
use wstac_host::error::Error;
use wstac_host::session::Processor;
use wstac_host::source::{Source, StreamInfo};

/// Longest wait before signals are looked for.
const WAIT: Duration = Duration::from_millis(50);

/// How a source is shown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// It is a camera, which has a pace of its own.
    pub live: bool,
    /// A file or scene is played as fast as it can be, instead of at its own rate.
    pub fast: bool,
}

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ending {
    /// The signal that asked for it; nothing where a key did, or where the terminal is gone.
    pub signal: Option<u8>,
    /// Feature frames that were read.
    pub frames: u64,
    /// Camera frames that were lost.
    pub dropped: u64,
    /// Events that were found.
    pub events: u64,
}

/// What both threads look at.
#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// Somebody asks for the end.
    quit: AtomicBool,
    /// The screen could do with a picture.
    picture: AtomicBool,
    /// The signal that asks for the end; 0 for none.
    signal: Arc<AtomicUsize>,
}

impl Shared {
    fn is_over(&self) -> bool {
        self.quit.load(Ordering::Relaxed) || self.signal.load(Ordering::Relaxed) != 0
    }
}

/// Whatever becomes of a thread, the other one ends, too.
struct EndBoth<'s>(&'s Shared);

impl Drop for EndBoth<'_> {
    fn drop(&mut self) {
        self.0.quit.store(true, Ordering::Relaxed);
    }
}

/// Shows a source on this process's terminal until a key or a signal asks for the end. `reading` gives features.
///
/// # Errors
/// Where the terminal cannot be used; the source's own error, once a person has seen it and quit.
pub(crate) fn run(
    source: &mut dyn Source,
    info: &StreamInfo,
    reading: &mut Processor,
    recordings: &mut Recordings,
    options: Options,
) -> Result<Ending, Error> {
    let signal = Arc::new(AtomicUsize::new(0));
    for number in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register_usize(number, Arc::clone(&signal), number as usize)
            .map_err(|error| Error::new("signals", error))?;
    }
    let pace = (!options.live && !options.fast).then(|| Pace::new(info.rate));
    let (player, state) = Player::new(source, info, reading, recordings, options.live);
    let shared =
        Shared { state: Mutex::new(state), quit: AtomicBool::new(false), picture: AtomicBool::new(true), signal };
    let screen = Screen::open()?;
    let (sender, keys) = channel();
    let failure = thread::scope(|scope| {
        let shared = &shared;
        scope.spawn(move || {
            let _end = EndBoth(shared);
            screen.show(shared, &sender);
        });
        let _end = EndBoth(shared);
        read(player, shared, &keys, pace)
    });
    let state = locked(&shared.state);
    let signal = u8::try_from(shared.signal.load(Ordering::Relaxed)).ok().filter(|signal| *signal != 0);
    match failure {
        Some(error) => Err(error),
        None => Ok(Ending { signal, frames: state.frame, dropped: state.dropped, events: state.events }),
    }
}

/// Reads until somebody asks for the end; the error that the source ended with.
fn read(mut player: Player<'_>, shared: &Shared, keys: &Receiver<Key>, mut pace: Option<Pace>) -> Option<Error> {
    let mut failure = None;
    while !shared.is_over() {
        let stands = {
            let state = locked(&shared.state);
            state.paused && !state.live
        };
        // What there is to wait for, keys apart.
        let wait =
            if stands || !player.goes_on() { WAIT } else { pace.map_or(Duration::ZERO, |pace| pace.wait()).min(WAIT) };
        match keys.recv_timeout(wait) {
            Ok(key) => {
                match key {
                    Key::Rezero => player.rezero(&shared.state),
                    Key::Record => player.record(&shared.state),
                    Key::Pause => pause(shared, pace.as_mut()),
                    // The screen's own.
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
    // Key, signal or a terminal that is gone: a recording's file is whole.
    player.end_recording(&shared.state);
    failure
}

/// Stops, or goes on from here.
fn pause(shared: &Shared, pace: Option<&mut Pace>) {
    let mut state = locked(&shared.state);
    state.paused = !state.paused;
    if let Some(pace) = pace {
        pace.restart();
    }
}
