//! Keeps what the screen shows of a board: its features, events, motion, faults and its own state.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use wstac_core::layout::{FrameSize, Layout};
use wstac_core::wire::{LONGEST, Request, encode};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::real;
use wstac_host::monitor::port::{Got, Port};
use wstac_host::monitor::{Monitor, Report};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::plural::counted;

use super::keys::Key;
use super::player::locked;
use super::screen::Screen;
use super::state::{About, HISTORY, Phase, State};
use super::{EndBoth, Ending, Shared};

/// The frame that stands for that of a board, which sends no pictures while it is watched.
const FRAME: (u32, u32) = (320, 240);

/// Reads a board's messages and keeps the state up to date.
pub(super) struct BoardPlayer {
    monitor: Monitor,
    sequence: u16,
    /// The number of the frame behind the last one with features.
    next: u64,
}

impl BoardPlayer {
    pub(super) fn new() -> Self {
        let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
        Self { monitor: Monitor::new(wanted), sequence: 0, next: 0 }
    }

    /// Returns the state before the first message.
    pub(super) fn state(name: &str) -> Result<State, Error> {
        let layout = FrameSize::new(FRAME.0, FRAME.1).and_then(Layout::paper);
        let layout = layout.map_err(|error| Error::with_cause(ErrorKind::Unsupported, name, error))?;
        let mut state = State::new(format!("board at {name}"), true, layout, "–".to_owned());
        state.is_board = true;
        Ok(state)
    }

    /// Returns the frames of the requests to a board that has just been connected.
    pub(super) fn requests(&mut self) -> Vec<Vec<u8>> {
        let requests: Vec<Request> = self.monitor.requests().collect();
        requests.iter().map(|request| self.encoded(request)).collect()
    }

    fn encoded(&mut self, request: &Request) -> Vec<u8> {
        let bytes = encode(request, self.sequence, &mut [0; LONGEST]).to_vec();
        self.sequence = self.sequence.wrapping_add(1);
        bytes
    }

    /// Takes bytes of the board. Returns whether its stream goes on, and what has to be sent to it.
    ///
    /// # Errors
    /// The board speaks another version of the link. The state shows it.
    pub(super) fn take(&mut self, bytes: &[u8], state: &Mutex<State>) -> Result<(bool, Vec<Vec<u8>>), Error> {
        let mut state = locked(state);
        let (mut requests, mut next) = (Vec::new(), self.next);
        let taken = self.monitor.take(bytes, |report| {
            match report {
                Report::Output(Output::Features(frame)) => {
                    // Frames without features; fewer if the board has started again.
                    let lost = frame.frame.checked_sub(next).filter(|_| next > 0).unwrap_or(0).min(HISTORY as u64);
                    next = frame.frame.saturating_add(1);
                    if !state.frozen() {
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
        self.next = next;
        if let (Output::End(end), true) = (self.monitor.finish(), self.monitor.heard()) {
            (state.frame, state.dropped) = (end.frames, end.dropped);
            state.phase = match (&taken, end.baseline_complete) {
                (Ok(false), _) => Phase::Ended,
                (Err(error), _) => Phase::Failed(error.to_string()),
                (_, true) => Phase::Watching,
                // The board does not say how long its baseline is.
                (_, false) => Phase::Baseline(end.frames, end.frames),
            };
        } else if let Err(error) = &taken {
            state.phase = Phase::Failed(error.to_string());
        }
        drop(state);
        Ok((taken?, requests.iter().map(|request| self.encoded(request)).collect()))
    }
}

/// Shows a board on the terminal of this process until a key or a signal ends it.
///
/// # Errors
/// Returns an error if the terminal cannot be used, or the error of the port after the user quits.
pub(crate) fn run(port: &mut Port) -> Result<Ending, Error> {
    let player = BoardPlayer::new();
    let shared = Shared::new(BoardPlayer::state(port.name())?);
    let screen = Screen::open()?;
    let (sender, keys) = channel();
    let failure = thread::scope(|scope| {
        let shared = &shared;
        scope.spawn(move || {
            let _end = EndBoth(shared);
            screen.show(shared, &sender);
        });
        let _end = EndBoth(shared);
        read(player, port, shared, &keys)
    });
    failure.map_or_else(|| Ok(shared.ending()), Err)
}

/// Reads until the end is requested, and returns the error that the port ended with.
fn read(mut player: BoardPlayer, port: &mut Port, shared: &Shared, keys: &Receiver<Key>) -> Option<Error> {
    let (mut failure, mut is_over) = (None, false);
    let mut room = [0; 4096];
    send(port, &player.requests());
    while !shared.is_over() {
        let wait = if is_over { super::WAIT } else { Duration::ZERO };
        match keys.recv_timeout(wait) {
            Ok(key) => press(key, &shared.state),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if is_over {
            continue;
        }
        let taken = match port.read(&mut room) {
            Ok(Got::Bytes(count)) => player.take(&room[..count], &shared.state),
            Ok(Got::Nothing) => continue,
            Ok(Got::Gone) => {
                locked(&shared.state).say(About::Trouble, format!("{} is gone; waiting for it", port.name()));
                continue;
            }
            Ok(Got::Back) => {
                locked(&shared.state).say(About::Note, format!("{} is back", port.name()));
                Ok((true, player.requests()))
            }
            Ok(Got::Ended) => {
                locked(&shared.state).phase = Phase::Ended;
                Ok((false, Vec::new()))
            }
            Err(error) => {
                locked(&shared.state).phase = Phase::Failed(error.to_string());
                Err(error)
            }
        };
        match taken {
            Ok((goes_on, frames)) => {
                is_over = !goes_on;
                send(port, &frames);
            }
            Err(error) => (failure, is_over) = (Some(error), true),
        }
    }
    failure
}

/// Sends requests. One that the board does not take now is repeated when it says that it has not taken it.
fn send(port: &mut Port, frames: &[Vec<u8>]) {
    for frame in frames {
        port.send(frame);
    }
}

/// Does what a key asks for.
pub(super) fn press(key: Key, state: &Mutex<State>) {
    let mut state = locked(state);
    match key {
        Key::Pause => state.paused = !state.paused,
        Key::Rezero => state.say(About::Note, "a board gathers its baseline when it starts".into()),
        Key::Record => state.say(About::Note, "no recording: a board sends no frames".into()),
        // Keys of the screen itself.
        Key::Quit | Key::Help => {}
    }
}
