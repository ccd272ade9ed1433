//! Shows sources on a terminal: picture, map, traces and events.
//!
//! One thread reads the source and keeps `state` up to date. Another one draws it at most 15 times per second and reads
//! keys, so a slow terminal never delays the reading. `player` reads, `recording` records on request, `draw` draws,
//! `screen` has the terminal, and `board` reads a board. `several` reads several sensors, each in a thread of its own,
//! and `timeline` keeps those of files together.

pub(crate) mod board;
mod draw;
mod keys;
mod player;
mod rate_meter;
mod recording;
mod screen;
pub(crate) mod several;
mod state;
mod timeline;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use self::keys::Key;
pub(crate) use self::player::Reopen;
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
    /// Whether a file or scene starts again at its end.
    pub repeats: bool,
}

/// The result of a view of a sensor.
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

/// What the screen shows of a sensor.
#[derive(Debug)]
struct Watched {
    state: Mutex<State>,
    /// Whether the screen needs a picture.
    picture: AtomicBool,
}

/// The data that the threads share.
#[derive(Debug)]
struct Shared {
    sensors: Vec<Watched>,
    /// The number of the sensor that is shown alone, from 1 on; 0 for all of several.
    chosen: AtomicUsize,
    /// Whether the end was requested.
    quit: AtomicBool,
    /// The signal that requested the end; 0 for none.
    signal: Arc<AtomicUsize>,
}

impl Shared {
    /// Creates the data before the first frame. Signals ask for the end from now on.
    fn new(states: impl IntoIterator<Item = State>) -> Self {
        finishing(SignalEnding::Restored);
        let watched = |state| Watched { state: Mutex::new(state), picture: AtomicBool::new(true) };
        let sensors = states.into_iter().map(watched).collect();
        Self { sensors, chosen: AtomicUsize::new(0), quit: AtomicBool::new(false), signal: number() }
    }

    /// Creates the data of a single sensor.
    fn of_one(state: State) -> Self {
        Self::new([state])
    }

    /// Returns the state of a sensor.
    fn state(&self, sensor: usize) -> &Mutex<State> {
        &self.sensors[sensor].state
    }

    /// Returns whether the screen needs a picture of a sensor, which is the next one then.
    fn takes_picture(&self, sensor: usize) -> bool {
        self.sensors[sensor].picture.swap(false, Ordering::Relaxed)
    }

    /// Returns the result of the view for each sensor.
    fn endings(&self) -> Vec<Ending> {
        let signal = u8::try_from(self.signal.load(Ordering::Relaxed)).ok().filter(|signal| *signal != 0);
        let ending = |Watched { state, .. }: &Watched| {
            let state = locked(state);
            Ending { signal, frames: state.frame, dropped: state.dropped, events: state.events }
        };
        self.sensors.iter().map(ending).collect()
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
    source: &mut Box<dyn Source>,
    reopen: Option<Reopen<'_>>,
    info: &StreamInfo,
    reading: &mut Processor,
    recordings: &mut Recordings,
    options: Options,
) -> Result<Ending, Error> {
    let pace = (!options.live && !options.fast).then(|| Pace::new(info.rate));
    let (player, state) = Player::new(source, info, reading, recordings, options.live);
    let player = player.reopened_by(reopen);
    show(&Shared::of_one(state), |shared, keys| read(player, shared, keys, pace, options.repeats))
}

/// Shows a sensor on the terminal of this process while `read` keeps its state up to date.
///
/// # Errors
/// Returns an error if the terminal cannot be used, or the one that `read` returns.
fn show(shared: &Shared, read: impl FnOnce(&Shared, &Receiver<Key>) -> Option<Error>) -> Result<Ending, Error> {
    let (failure, endings) = show_all(shared, read)?;
    failure.map_or_else(|| Ok(endings[0]), Err)
}

/// Shows sensors on the terminal of this process while `read` keeps their states up to date. Returns what `read`
/// returns, and the result for each sensor.
///
/// # Errors
/// Returns an error if the terminal cannot be used.
fn show_all<R>(shared: &Shared, read: impl FnOnce(&Shared, &Receiver<Key>) -> R) -> Result<(R, Vec<Ending>), Error> {
    let screen = Screen::open()?;
    let (sender, keys) = channel();
    let result = thread::scope(|scope| {
        scope.spawn(move || {
            let _end = EndBoth(shared);
            screen.show(shared, &sender);
        });
        let _end = EndBoth(shared);
        read(shared, &keys)
    });
    Ok((result, shared.endings()))
}

/// Reads until the end is requested, and returns the error that the source ended with.
fn read(
    mut player: Player<'_>,
    shared: &Shared,
    keys: &Receiver<Key>,
    mut pace: Option<Pace>,
    repeats: bool,
) -> Option<Error> {
    let mut failure = None;
    // The frame that is gone to, as fast as possible.
    let mut target: Option<u64> = None;
    while !shared.is_over() {
        if target.is_some_and(|target| player.frame() >= target || !player.goes_on()) {
            target = None;
            restart(&mut pace);
        }
        let stands = {
            let state = locked(shared.state(0));
            state.paused && !state.live && target.is_none()
        };
        // A source without frames would start again for ever.
        if repeats && !stands && !player.goes_on() && failure.is_none() && player.frame() > 0 {
            player.end_recording(shared.state(0));
            if !player.start_again(shared.state(0)) {
                break;
            }
            restart(&mut pace);
        }
        // The wait, without keys.
        let wait = match pace {
            _ if stands || !player.goes_on() => WAIT,
            Some(pace) if target.is_none() => pace.wait().min(WAIT),
            _ => Duration::ZERO,
        };
        match keys.recv_timeout(wait) {
            Ok(key) => {
                match key {
                    Key::Rezero => player.rezero(shared.state(0)),
                    Key::Record => player.record(shared.state(0)),
                    Key::Pause => pause(shared, pace.as_mut()),
                    Key::Seek(seconds) => {
                        let frames = player.frames_of(seconds);
                        target = go_to(&mut player, shared, target, frames);
                        failure = failure.filter(|_| !player.goes_on());
                    }
                    Key::Step(frames) => {
                        if !locked(shared.state(0)).live {
                            locked(shared.state(0)).paused = true;
                        }
                        target = go_to(&mut player, shared, target, frames);
                        failure = failure.filter(|_| !player.goes_on());
                    }
                    Key::Start => {
                        target = go_to(&mut player, shared, target, i64::MIN);
                        failure = failure.filter(|_| !player.goes_on());
                    }
                    // Keys of the screen itself.
                    Key::Quit | Key::Help | Key::Next | Key::Previous | Key::Choose(_) => {}
                }
                continue;
            }
            // The screen is gone.
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        let is_early = target.is_none() && pace.is_some_and(|pace| !pace.wait().is_zero());
        if stands || !player.goes_on() || is_early {
            continue;
        }
        // The last frame of a way is shown, whatever was drawn meanwhile.
        let arrives = target.is_some_and(|target| player.frame() + 1 >= target);
        match player.step(shared.state(0), shared.takes_picture(0) || arrives) {
            Ok(passed) => {
                if let Some(pace) = &mut pace {
                    pace.advance(passed);
                }
            }
            Err(error) => failure = Some(error),
        }
    }
    // After a key, a signal or the loss of the terminal, the file of a recording is complete.
    player.end_recording(shared.state(0));
    failure
}

/// Returns the frame to go to, so many frames from where the way leads now; `None` if that is not possible.
fn go_to(player: &mut Player<'_>, shared: &Shared, target: Option<u64>, frames: i64) -> Option<u64> {
    let from = target.unwrap_or_else(|| player.frame());
    let to = from.saturating_add_signed(frames);
    player.can_go_to(to, shared.state(0)).then_some(to)
}

/// Lets the next frame be due now.
fn restart(pace: &mut Option<Pace>) {
    if let Some(pace) = pace {
        pace.restart();
    }
}

/// Pauses or continues.
fn pause(shared: &Shared, pace: Option<&mut Pace>) {
    let mut state = locked(shared.state(0));
    state.paused = !state.paused;
    if let Some(pace) = pace {
        pace.restart();
    }
}
