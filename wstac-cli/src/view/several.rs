//! Shows several sensors: each is read in a thread of its own, so one that stalls or ends does not stop the others.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;

use super::board::{self, BoardPlayer};
use super::keys::Key;
use super::player::{Player, READ_ONCE, locked};
use super::recording::Recordings;
use super::state::{About, Phase, State};
use super::timeline::{Timeline, Track, Turn};
use super::{Ending, Shared, WAIT, show_all};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::monitor::port::Port;
use wstac_host::session::Processor;
use wstac_host::source::{Source, StreamInfo};

/// Opens a source again, from its first frame on.
pub(crate) type ReopenOwned<'a> = Box<dyn Fn() -> Result<(Box<dyn Source>, Processor), Error> + Send + 'a>;

/// A source with frames that is open.
pub(crate) struct Frames<'a> {
    pub(crate) source: Box<dyn Source>,
    pub(crate) info: StreamInfo,
    pub(crate) processor: Processor,
    /// `None` if it can be read once only.
    pub(crate) reopen: Option<ReopenOwned<'a>>,
    /// Whether it is a camera, which has a pace of its own.
    pub(crate) live: bool,
    /// The time of its first frame on the time line, in seconds.
    pub(crate) start: f64,
}

/// A sensor that is open.
pub(crate) enum Opened<'a> {
    /// A source with frames.
    Frames(Box<Frames<'a>>),
    /// A board.
    Board(Port),
}

/// A sensor with its name.
pub(crate) struct Sensor<'a> {
    pub(crate) name: String,
    pub(crate) opened: Opened<'a>,
}

impl Sensor<'_> {
    /// Returns the state before the first frame.
    fn state(&self) -> Result<State, Error> {
        let state = match &self.opened {
            Opened::Frames(frames) => Player::state(&frames.info, &frames.processor, frames.live),
            Opened::Board(port) => BoardPlayer::state(port.name())?,
        };
        Ok(state.named(&self.name))
    }

    /// Returns its track on the time line; `None` if it is live.
    fn track(&self) -> Option<Track> {
        let Opened::Frames(frames) = &self.opened else { return None };
        let rate = frames.info.rate;
        let period = f64::from(rate.frames_added()) / rate.per_second();
        (!frames.live).then_some(Track { start: frames.start, period, is_waited_for: frames.reopen.is_some() })
    }
}

/// The result for a sensor: its counts, and why it failed.
pub(crate) struct Outcome {
    pub(crate) name: String,
    pub(crate) ending: Ending,
    pub(crate) failure: Option<Error>,
}

/// Shows sensors on the terminal of this process until a key or a signal ends it.
///
/// # Errors
/// Returns an error if the terminal cannot be used. A sensor's own error is in its outcome.
pub(crate) fn run(sensors: Vec<Sensor<'_>>, fast: bool, repeats: bool) -> Result<Vec<Outcome>, Error> {
    let names: Vec<_> = sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let states = sensors.iter().map(Sensor::state).collect::<Result<Vec<_>, _>>()?;
    let shared = Shared::new(states);
    let (failures, endings) = show_all(&shared, |shared, keys| read(sensors, shared, keys, fast, repeats))?;
    let outcome = |((name, ending), failure)| Outcome { name, ending, failure };
    Ok(names.into_iter().zip(endings).zip(failures).map(outcome).collect())
}

/// Reads all sensors until the end is requested, and returns why each failed.
fn read(
    sensors: Vec<Sensor<'_>>,
    shared: &Shared,
    keys: &Receiver<Key>,
    fast: bool,
    repeats: bool,
) -> Vec<Option<Error>> {
    // The places of the sensors on the time line; `None` for live ones.
    let tracks: Vec<_> = sensors.iter().map(Sensor::track).collect();
    let mut count = 0..;
    let places: Vec<_> = tracks.iter().map(|track| track.and_then(|_| count.next())).collect();
    let timeline = Timeline::new(tracks.into_iter().flatten(), fast);
    thread::scope(|scope| {
        let mut threads = Vec::new();
        let mut senders = Vec::new();
        for (number, (sensor, place)) in sensors.into_iter().zip(&places).enumerate() {
            let (sender, own_keys) = channel();
            let (timeline, place) = (&timeline, *place);
            senders.push(sender);
            threads.push(scope.spawn(move || match sensor.opened {
                Opened::Board(mut port) => board::read(BoardPlayer::new(), &mut port, shared, number, &own_keys),
                Opened::Frames(frames) => play(*frames, shared, number, place.map(|at| (timeline, at)), &own_keys),
            }));
        }
        let conductor = Conductor { shared, timeline: &timeline, places: &places, senders: &senders };
        conductor.take_keys(keys, repeats);
        // A thread without keys ends at the next look at them.
        drop(senders);
        shared.quit.store(true, Ordering::Relaxed);
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    })
}

/// Turns keys into what all sensors do.
struct Conductor<'a> {
    shared: &'a Shared,
    timeline: &'a Timeline,
    places: &'a [Option<usize>],
    senders: &'a [Sender<Key>],
}

impl Conductor<'_> {
    /// Takes keys until the end is requested.
    fn take_keys(&self, keys: &Receiver<Key>, repeats: bool) {
        while !self.shared.is_over() {
            match keys.recv_timeout(WAIT) {
                Ok(key) => self.press(key),
                // The screen is gone.
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            // Sources without frames would start again for ever.
            if repeats && self.timeline.is_over() && self.has_frames() {
                self.timeline.restart();
            }
        }
    }

    /// Returns whether any file has given a frame and has not failed.
    fn has_frames(&self) -> bool {
        let files = self.places.iter().zip(&self.shared.sensors).filter(|(place, _)| place.is_some());
        files.into_iter().any(|(_, watched)| {
            let state = locked(&watched.state);
            state.frame > 0 && !matches!(state.phase, Phase::Failed(_))
        })
    }

    /// Returns the sensors that a key is for: the one that is shown alone, or all.
    fn chosen(&self) -> impl Iterator<Item = usize> {
        let chosen = self.shared.chosen.load(Ordering::Relaxed);
        (0..self.places.len()).filter(move |sensor| chosen == 0 || chosen == sensor + 1)
    }

    fn say(&self, text: &str) {
        self.chosen().for_each(|sensor| locked(self.shared.state(sensor)).say(About::Note, text.to_owned()));
    }

    /// Does what a key asks for.
    fn press(&self, key: Key) {
        let has_files = self.places.iter().any(Option::is_some);
        match key {
            // Nobody receives the keys of a sensor that has ended.
            Key::Rezero => {
                for sensor in self.chosen() {
                    let _ = self.senders[sensor].send(key);
                }
            }
            Key::Record => self.say("no recording of several sensors here: wstac record writes one"),
            Key::Pause => {
                let is_paused = locked(self.shared.state(0)).paused;
                self.pause(!is_paused);
            }
            Key::Seek(_) | Key::Step(_) | Key::Start if !has_files => {
                self.say("no seek: these sensors send their frames once");
            }
            Key::Seek(seconds) => self.timeline.seek(seconds),
            Key::Step(frames) => {
                self.pause(true);
                // The frames of the sensor that is shown alone, or of the first file.
                let own = self.chosen().find_map(|sensor| self.places[sensor]);
                self.timeline.step(own.unwrap_or(0), frames);
            }
            Key::Start => self.timeline.restart(),
            // Keys of the screen itself.
            Key::Quit | Key::Help | Key::Next | Key::Previous | Key::Choose(_) => {}
        }
    }

    fn pause(&self, is_paused: bool) {
        self.shared.sensors.iter().for_each(|watched| locked(&watched.state).paused = is_paused);
        self.timeline.pause(is_paused);
    }
}

/// Reads a source until the end is requested, and returns its error. A live one has no place on the time line.
fn play(
    frames: Frames<'_>,
    shared: &Shared,
    sensor: usize,
    place: Option<(&Timeline, usize)>,
    keys: &Receiver<Key>,
) -> Option<Error> {
    let Frames { mut source, info, mut processor, reopen, live, .. } = frames;
    let no_recording = Error::new(ErrorKind::Unsupported, "several sensors", "are not recorded here");
    let mut recordings = Recordings::new(Err(no_recording), None, |_| String::new());
    let (player, _) = Player::new(&mut source, &info, &mut processor, &mut recordings, live);
    let mut player = player.reopened_by(reopen.as_deref().map(|reopen| reopen as _));
    let (state, mut failure) = (shared.state(sensor), None);
    while !shared.is_over() {
        let wait = if place.is_none() && !player.goes_on() { WAIT } else { std::time::Duration::ZERO };
        match keys.recv_timeout(wait) {
            Ok(Key::Rezero) => player.rezero(state),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        let turn = place.map_or(Turn::Step { arrives: false }, |(timeline, at)| timeline.turn(at));
        match turn {
            Turn::Wait => continue,
            Turn::Step { arrives } => {
                let picture = shared.takes_picture(sensor) || arrives;
                failure = player.step(state, picture).err().or(failure);
            }
            Turn::Back => {
                if reopen.is_none() {
                    locked(state).say(About::Note, READ_ONCE.to_owned());
                }
                if !player.start_again(state) {
                    if let Some((timeline, at)) = place {
                        timeline.stays(at);
                    }
                    continue;
                }
                failure = None;
            }
        }
        if let Some((timeline, at)) = place {
            timeline.reached(at, player.due(), !player.goes_on());
        }
    }
    failure
}

#[cfg(test)]
mod tests;
