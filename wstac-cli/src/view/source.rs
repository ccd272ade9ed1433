//! Reads a station and keeps what the screen shows.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::Duration;

use super::state::{About, State};
use super::{board, locked};
use wstac_host::camera::modes::fps;
use wstac_host::error::Error;
use wstac_host::monitor::Report;
use wstac_host::output::Output;
use wstac_host::picture::{Picture, Sampler};
use wstac_host::session::{Observer, Phase};
use wstac_host::source::{Lag, SourceEvent};
use wstac_host::station::{Station, Turn};

/// The number of frames over which a camera's rate is measured.
const MEASURED: usize = 60;

/// A source of frames, or a board.
pub(crate) struct SourceView {
    station: Station,
    /// Whether it is a camera or a board, which is read while the screen is paused.
    live: bool,
    found: TurnObserver,
    /// The number of the frame behind the last one of a board with features.
    next: u64,
}

/// The frames and outputs of a turn of the station.
#[derive(Default)]
struct TurnObserver {
    /// `None` if the source makes no pixels.
    sampler: Option<Sampler>,
    wants_picture: bool,
    picture: Option<Picture>,
    outputs: Vec<Output>,
    report: Option<Report>,
    lag: Lag,
    lost: u64,
    /// Whether a frame has come or was lost.
    has_frame: bool,
    /// The driver's timestamps of the last frames.
    times: VecDeque<Duration>,
}

impl Observer for TurnObserver {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        match event {
            SourceEvent::Frame(frame) => {
                if std::mem::take(&mut self.wants_picture) {
                    self.picture = self.sampler.map(|sampler| sampler.picture(frame.bytes));
                }
                self.lag = frame.lag;
                self.times.extend(frame.timestamp);
            }
            SourceEvent::Taxels(frame) => self.times.extend(frame.timestamp),
            SourceEvent::Lost { frames, .. } => self.lost = *frames,
            SourceEvent::Report(report) => {
                self.report = Some(report.clone());
                return Ok(());
            }
            _ => return Ok(()),
        }
        self.has_frame = true;
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        self.outputs.push(output);
        Ok(())
    }
}

impl SourceView {
    /// Creates the sensor of a station that gives features and motion. A `live` one is a camera or a board.
    pub(crate) fn new(station: Station, live: bool) -> Self {
        let sampler = (!station.info().taxels_only).then(|| Sampler::new(station.info()));
        Self { station, live, found: TurnObserver { sampler, ..TurnObserver::default() }, next: 0 }
    }

    /// Takes the facts of the trigger.
    fn look(&self, state: &mut State) {
        if self.station.info().is_board {
            return;
        }
        let processor = self.station.processor();
        state.frame = processor.pipeline().next_frame();
        state.thresholds = processor.thresholds();
        state.doing = match processor.phase() {
            Phase::Baseline { frames, of } => (About::Trouble, format!("baseline {frames}/{of}")),
            Phase::Capturing { frames } => (About::Event, format!("event {frames}/70")),
            Phase::Watching => (About::Note, "watching".to_owned()),
        };
    }

    /// Returns the state before the first frame.
    pub(super) fn state(&self) -> State {
        let info = self.station.info();
        if info.is_board {
            return board::state(info);
        }
        let mut state = State::new(info.about.clone(), self.live, format!("{} fps, nominal", fps(info.rate)));
        state.layout = Some(*self.station.processor().geometry().layout());
        self.look(&mut state);
        self.station.config().notes(info).for_each(|note| state.say(About::Note, note.into_owned()));
        state
    }

    /// Reads or waits once, and brings the state up to date. Returns whether there is more to read.
    ///
    /// # Errors
    /// The sensor cannot be read any further.
    pub(super) fn step(&mut self, state: &Mutex<State>) -> Result<bool, Error> {
        let Self { station, live, found, next } = self;
        {
            let mut state = locked(state);
            found.wants_picture |= std::mem::take(&mut state.wants_picture);
            // A file or a scene is not read while it is paused.
            station.is_paused = state.paused && !*live;
        }
        let before = station.processor().pipeline().next_frame();
        let turn = station.advance(found);
        let mut state = locked(state);
        let lost = std::mem::take(&mut found.lost);
        if lost > 0 {
            state.dropped = state.dropped.saturating_add(lost);
            state.add_gaps(station.processor().pipeline().next_frame() - before);
        }
        if let Some(report) = found.report.take() {
            board::take(&report, station.info(), next, &mut state);
        }
        found.outputs.drain(..).for_each(|output| state.take(&output));
        if std::mem::take(&mut found.has_frame) {
            state.set_taxels(station.processor().taxels());
            state.missing = if found.sampler.is_some() { "frame lost" } else { "taxel sums only" };
        }
        state.picture = found.picture.take().or(state.picture.take());
        state.lag = found.lag;
        found.times.drain(..found.times.len().saturating_sub(MEASURED));
        if let (Some(first), Some(last)) = (found.times.front(), found.times.back())
            && last > first
        {
            let seconds = last.saturating_sub(*first).as_secs_f64();
            state.rate = format!("{:.2} fps", (found.times.len() - 1) as f64 / seconds);
        }
        if !self.station.is_over() {
            self.look(&mut state);
        }
        Ok(turn? != Turn::Over)
    }

    /// Gathers a new baseline, or says why not.
    pub(super) fn rezero(&mut self, state: &mut State) {
        if self.station.info().is_board {
            return state.say(About::Note, "a board gathers its baseline when it starts".to_owned());
        }
        self.station.rezero();
        // Keeping an output does not fail.
        let _ = self.station.deliver(&mut self.found);
        self.found.outputs.drain(..).for_each(|output| state.take(&output));
        let frame = self.station.processor().pipeline().next_frame();
        state.say(About::Note, format!("at frame {frame}: a new baseline, keep off the sensor"));
        self.look(state);
    }
}
