//! Keeps what the screen shows of a board: its features, events, motion, faults and its own state.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use wstac_core::layout::{FrameSize, Layout};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::real;
use wstac_host::monitor::port::{self, Got, Port, SILENT};
use wstac_host::monitor::requests::Requests;
use wstac_host::monitor::{Monitor, Report, now};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::plural::counted;

use super::keys::Key;
use super::player::locked;
use super::state::{About, HISTORY, Phase, State};
use super::{Ending, Shared, WAIT, show};

/// The frame that stands for that of a board, which sends no pictures while it is watched.
const FRAME: (u32, u32) = (320, 240);

/// Reads a board's messages and keeps the state up to date.
pub(super) struct BoardPlayer {
    monitor: Monitor,
    requests: Requests,
    /// The reads in a row that brought nothing.
    waits: u32,
    /// The number of the frame behind the last one with features.
    next: u64,
}

impl BoardPlayer {
    pub(super) fn new() -> Self {
        let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
        let monitor = Monitor::new(wanted);
        let mut requests = Requests::default();
        requests.extend(monitor.requests());
        Self { monitor, requests, waits: 0, next: 0 }
    }

    /// Returns the state before the first message.
    pub(super) fn state(name: &str) -> Result<State, Error> {
        let layout = FrameSize::new(FRAME.0, FRAME.1).and_then(Layout::paper);
        let layout = layout.map_err(|error| Error::with_cause(ErrorKind::Unsupported, name, error))?;
        let mut state = State::new(format!("board at {name}"), true, layout, "–".to_owned());
        state.is_board = true;
        Ok(state)
    }

    /// Sends what waits to be sent and reads once. Returns whether the stream goes on.
    ///
    /// # Errors
    /// The port cannot be read, or the board speaks another version of the link.
    pub(super) fn step(&mut self, port: &mut Port, state: &Mutex<State>) -> Result<bool, Error> {
        let say = |about, text| locked(state).say(about, text);
        // A file has the answers of a clock that is gone.
        if port.takes_requests() {
            self.requests.extend(self.monitor.set_now(now()));
        }
        if let Some(reading) = self.requests.send(port) {
            say(About::Trouble, reading.in_words(port.name()));
        }
        let mut room = [0; 4096];
        let got = port.read(&mut room)?;
        self.waits = if got == Got::Nothing { self.waits.saturating_add(1) } else { 0 };
        match got {
            Got::Bytes(count) => {
                if port.takes_requests() {
                    self.requests.extend(self.monitor.set_now(now()));
                }
                return self.take(&room[..count], state);
            }
            Got::Nothing if self.waits == SILENT => {
                say(About::Trouble, format!("no data for {} s", (port::WAIT * SILENT).as_secs()));
            }
            Got::Nothing => {}
            Got::Gone => {
                // A device that is gone needs no note about its silence.
                self.waits = SILENT;
                say(About::Trouble, format!("{} is gone; waiting for it", port.name()));
            }
            Got::Back => {
                say(About::Note, format!("{} is back", port.name()));
                self.requests.extend(self.monitor.requests());
            }
            Got::Ended => {
                locked(state).phase = Phase::Ended;
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Takes bytes of the board. Returns whether its stream goes on.
    ///
    /// # Errors
    /// The board speaks another version of the link. The state shows it.
    pub(super) fn take(&mut self, bytes: &[u8], state: &Mutex<State>) -> Result<bool, Error> {
        let mut state = locked(state);
        let Self { monitor, requests, next, .. } = self;
        let taken = monitor.take(bytes, |report| {
            match report {
                Report::Output(Output::Features(frame)) => {
                    // Frames without features; fewer if the board has started again.
                    let lost = frame.frame.checked_sub(*next).filter(|_| *next > 0).unwrap_or(0).min(HISTORY as u64);
                    *next = frame.frame.saturating_add(1);
                    if !state.frozen() {
                        state.stamp = frame.stamp;
                        (0..lost).for_each(|_| state.add_trace(None));
                        state.add_trace(Some(frame.features.map(|feature| real(feature) as f32)));
                    }
                }
                Report::Output(output) => state.take(&output),
                Report::Note(text) => state.say(About::Trouble, text),
                Report::Request(request) => requests.push(request),
                Report::LostEvents(lost) => state.say(About::Trouble, format!("{} lost", counted(lost, "event"))),
                Report::Telemetry(telemetry) => state.telemetry = Some(telemetry),
            }
            Ok::<(), Error>(())
        });
        state.clock_within_ms = monitor.clock_match().map(|clock| clock.within_ms);
        if let (Output::End(end), true) = (monitor.finish(), monitor.heard()) {
            (state.frame, state.dropped) = (end.frames, end.dropped);
            state.phase = match (&taken, end.baseline_complete) {
                (Ok(false), _) => Phase::Ended,
                (Err(error), _) => Phase::Failed(error.to_string()),
                (_, true) => Phase::Watching,
                (_, false) => Phase::Baseline(end.frames, None),
            };
        } else if let Err(error) = &taken {
            state.phase = Phase::Failed(error.to_string());
        }
        taken
    }
}

/// Shows a board on the terminal of this process until a key or a signal ends it.
///
/// # Errors
/// Returns an error if the terminal cannot be used, or the error of the port after the user quits.
pub(crate) fn run(port: &mut Port) -> Result<Ending, Error> {
    let state = BoardPlayer::state(port.name())?;
    show(&Shared::of_one(state), |shared, keys| read(BoardPlayer::new(), port, shared, 0, keys))
}

/// Reads until the end is requested, and returns the error that the port ended with. The state is that of this sensor.
pub(super) fn read(
    mut player: BoardPlayer,
    port: &mut Port,
    shared: &Shared,
    sensor: usize,
    keys: &Receiver<Key>,
) -> Option<Error> {
    let state = shared.state(sensor);
    let (mut failure, mut is_over) = (None, false);
    while !shared.is_over() {
        let wait = if is_over { WAIT } else { Duration::ZERO };
        match keys.recv_timeout(wait) {
            Ok(key) => press(key, state),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if !is_over {
            match player.step(port, state) {
                Ok(goes_on) => is_over = !goes_on,
                Err(error) => {
                    locked(state).phase = Phase::Failed(error.to_string());
                    (failure, is_over) = (Some(error), true);
                }
            }
        }
    }
    failure
}

/// Does what a key asks for.
pub(super) fn press(key: Key, state: &Mutex<State>) {
    let mut state = locked(state);
    match key {
        Key::Pause => state.paused = !state.paused,
        Key::Rezero => state.say(About::Note, "a board gathers its baseline when it starts".into()),
        Key::Record => state.say(About::Note, "no recording: a board sends no frames".into()),
        // Keys of the screen itself.
        Key::Seek(_) | Key::Step(_) | Key::Start => {
            state.say(About::Note, "no seek: a board sends its frames once".into());
        }
        Key::Quit | Key::Help | Key::Next | Key::Previous | Key::Choose(_) => {}
    }
}
