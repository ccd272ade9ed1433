//! Reads a source item by item and keeps what the screen shows.

use std::sync::{Mutex, MutexGuard, PoisonError};

use wstac_core::params::FEATURE_ONE;

use super::rate_meter::RateMeter;
use super::recording::Recordings;
use super::state::{About, HISTORY, Phase, State};
use wstac_host::camera::modes::fps;
use wstac_host::error::Error;
use wstac_host::json::real;
use wstac_host::output::{InterruptedReport, Output};
use wstac_host::picture::Sampler;
use wstac_host::session::Processor;
use wstac_host::source::{Frame, Lag, Source, SourceEvent, StreamInfo};

/// Why there is no way back.
pub(super) const READ_ONCE: &str = "no seek back: this source can be read once";

/// Locks the state, even if a thread that held it panicked.
pub(super) fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Opens a source again, from its first frame on.
pub(crate) type Reopen<'p> = &'p (dyn Fn() -> Result<(Box<dyn Source>, Processor), Error> + 'p);

/// Reads a source and keeps the state up to date.
pub(super) struct Player<'p> {
    source: &'p mut Box<dyn Source>,
    /// `None` if the source can be read once only.
    reopen: Option<Reopen<'p>>,
    /// Feature frames per second.
    second: f64,
    processor: &'p mut Processor,
    /// `None` if the source makes no pixels.
    sampler: Option<Sampler>,
    recordings: &'p mut Recordings,
    meter: RateMeter,
    /// The first feature frame of the baseline.
    zero: u64,
    lag: Lag,
    ended: bool,
}

impl<'p> Player<'p> {
    /// Creates a player and the state before the first frame. `processor` gives features.
    pub(super) fn new(
        source: &'p mut Box<dyn Source>,
        info: &StreamInfo,
        processor: &'p mut Processor,
        recordings: &'p mut Recordings,
        live: bool,
    ) -> (Self, State) {
        let sampler = (!info.taxels_only).then(|| Sampler::new(info));
        let state = Self::state(info, processor, live);
        (
            Self {
                source,
                reopen: None,
                second: info.rate.per_second() / f64::from(info.rate.frames_added()),
                processor,
                sampler,
                recordings,
                meter: RateMeter::default(),
                zero: 0,
                lag: Lag::default(),
                ended: false,
            },
            state,
        )
    }

    /// Returns the state before the first frame.
    pub(super) fn state(info: &StreamInfo, processor: &Processor, live: bool) -> State {
        State::new(info.about.clone(), live, *processor.geometry().layout(), fps(info.rate))
    }

    /// Opens the source again with `reopen` to go back.
    pub(super) fn reopened_by(self, reopen: Option<Reopen<'p>>) -> Self {
        Self { reopen, ..self }
    }

    /// Returns the number of the next feature frame.
    pub(super) fn frame(&self) -> u64 {
        self.processor.pipeline().next_frame()
    }

    /// Returns the time of the next feature frame in seconds from the first one.
    pub(super) fn due(&self) -> f64 {
        self.processor.seconds(self.frame())
    }

    /// Returns how many feature frames so many seconds are, at least one.
    pub(super) fn frames_of(&self, seconds: i64) -> i64 {
        let frames = (seconds as f64 * self.second).round() as i64;
        if frames == 0 { seconds.signum() } else { frames }
    }

    /// Prepares to go on from a frame: for an earlier one, from the first frame on. Returns whether that is possible.
    pub(super) fn can_go_to(&mut self, frame: u64, state: &Mutex<State>) -> bool {
        let is_back = frame < self.frame();
        let mut shown = locked(state);
        let why_not = match self.reopen {
            _ if shown.live => "no seek: a camera sends its frames once",
            _ if self.recordings.asked || shown.rec.is_some() => "no seek in a recording: r ends it",
            None if is_back => READ_ONCE,
            _ => {
                drop(shown);
                return !is_back || self.start_again(state);
            }
        };
        shown.say(About::Note, why_not.to_owned());
        false
    }

    /// Starts again from the first frame. Returns whether that is possible; if not, the screen shows why.
    pub(super) fn start_again(&mut self, state: &Mutex<State>) -> bool {
        let Some(reopen) = self.reopen else { return false };
        let opened = reopen();
        let mut state = locked(state);
        match opened {
            Ok((source, processor)) => {
                *self.source = source;
                *self.processor = processor;
                (self.meter, self.zero, self.lag, self.ended) = (RateMeter::default(), 0, Lag::default(), false);
                state.start_again();
                self.update(&mut state);
                true
            }
            Err(error) => {
                state.say(About::Trouble, error.to_string());
                false
            }
        }
    }

    /// Returns whether there are more items.
    pub(super) fn goes_on(&self) -> bool {
        !self.ended
    }

    /// Processes the next item and returns by how many frames time has passed. `picture` asks for its picture.
    ///
    /// # Errors
    /// Returns the error of the source. The state shows it, and there are no more items.
    pub(super) fn step(&mut self, state: &Mutex<State>, picture: bool) -> Result<u64, Error> {
        if self.ended {
            return Ok(0);
        }
        let item = match self.source.next_event() {
            Ok(item) => item,
            Err(error) => {
                self.ended = true;
                let mut state = locked(state);
                // The error of the source is shown, whatever the end of its stream was.
                let _ = self.processor.finish(|record| {
                    self.recordings.record(&record);
                    state.take(&record);
                    Ok::<(), Error>(())
                });
                state.phase = Phase::Failed(error.to_string());
                say_ended(self.recordings, &mut state);
                return Err(error);
            }
        };
        let mut notes = Vec::new();
        if self.recordings.asked && matches!(item, SourceEvent::Frame(_) | SourceEvent::Taxels(_)) {
            self.recordings.asked = false;
            // A recording that cannot be begun changes nothing.
            match self.recordings.new_file() {
                Ok(None) => {}
                Ok(Some(new)) => {
                    notes.extend(self.processor.restart().map(given_up));
                    self.zero = self.processor.pipeline().next_frame();
                    notes.extend(self.recordings.start(new, self.processor).err());
                }
                Err(why) => notes.push(why),
            }
        }
        self.recordings.item(&item);
        let mut passed = 1;
        let mut shown = None;
        match &item {
            SourceEvent::Frame(Frame { bytes, timestamp, lag, .. }) => {
                self.lag = *lag;
                self.meter.take(*timestamp);
                shown = self.sampler.filter(|_| picture).map(|sampler| sampler.picture(bytes));
            }
            SourceEvent::Taxels(frame) => self.meter.take(frame.timestamp),
            SourceEvent::Lost { frames, .. } => {
                passed = *frames;
                self.meter.lose(*frames);
            }
            _ => passed = 0,
        }
        let (before, mut features, mut records) = (self.processor.pipeline().next_frame(), Vec::new(), Vec::new());
        let mut stamp = None;
        let dropped = if let SourceEvent::Lost { frames, .. } = item { frames } else { 0 };
        let taken = self.processor.process(&item, |record| {
            self.recordings.record(&record);
            match record {
                Output::Features(frame) => {
                    stamp = frame.stamp;
                    features.push(frame.features.map(|feature| real(feature) as f32));
                }
                record => records.push(record),
            }
            Ok::<(), Error>(())
        });
        self.ended = !taken?;
        let must_end = self.recordings.must_end(&item, self.processor);
        let now = self.processor.pipeline().next_frame();
        let mut state = locked(state);
        for note in notes {
            state.say(About::Trouble, note);
        }
        state.dropped = state.dropped.saturating_add(dropped);
        if !state.frozen() && passed > 0 {
            // Frames without features.
            let lost = (now - before).saturating_sub(features.len() as u64).min(HISTORY as u64);
            (0..lost).for_each(|_| state.add_trace(None));
            for features in features {
                state.add_trace(Some(features));
            }
            state.set_taxels(self.processor.taxels());
            state.stamp = stamp.or(state.stamp);
            state.picture = shown.or(state.picture.take());
        }
        self.update(&mut state);
        for record in &records {
            state.take(record);
        }
        if must_end {
            say_ended(self.recordings, &mut state);
        }
        Ok(passed)
    }

    /// Gathers a new baseline.
    pub(super) fn rezero(&mut self, state: &Mutex<State>) {
        if self.ended {
            return;
        }
        let mut state = locked(state);
        if state.rec.is_some() {
            // A recording that is read again has no such key.
            return state
                .say(About::Note, "no re-zero in a recording: r ends it, r starts one with a new baseline".into());
        }
        if let Some(sample) = self.processor.rezero() {
            state.say(About::Trouble, given_up(sample));
        }
        self.zero = self.processor.pipeline().next_frame();
        state.say(About::Note, format!("{:>7}  re-zero: a new baseline, keep everything off the sensor", self.zero));
        self.update(&mut state);
    }

    /// Starts a recording at the next frame, or ends the one in progress.
    pub(super) fn record(&mut self, state: &Mutex<State>) {
        if locked(state).rec.is_some() {
            return self.end_recording(state);
        }
        let mut state = locked(state);
        let (about, text) = match self.recordings.why_not() {
            Some(why) => (About::Trouble, format!("no recording: {why}")),
            None if self.ended => (About::Trouble, "no recording: the source is at its end".into()),
            None => {
                self.recordings.asked = true;
                (About::Note, "recording: a new baseline, keep everything off the sensor".into())
            }
        };
        state.say(about, text);
    }

    /// Ends the recording in progress, if there is one, so that its file is complete.
    pub(super) fn end_recording(&mut self, state: &Mutex<State>) {
        self.recordings.asked = false;
        say_ended(self.recordings, &mut locked(state));
    }

    /// Updates the facts of the trigger and the source.
    fn update(&mut self, state: &mut State) {
        let pipeline = self.processor.pipeline();
        let window = f32::from(pipeline.trigger_config().window());
        let real = |sum: i32| sum as f32 / FEATURE_ONE as f32 / window;
        state.frame = pipeline.next_frame();
        state.thresholds = pipeline.thresholds().map(|thresholds| thresholds.map(real));
        state.phase = match (pipeline.baseline(), pipeline.end().incomplete) {
            (None, _) => {
                Phase::Baseline(state.frame - self.zero, Some(pipeline.trigger_config().baseline_frames().into()))
            }
            (_, Some(sample)) => Phase::Capturing(sample.frames),
            _ => Phase::Watching,
        };
        state.fps = self.meter.fps();
        state.lag = self.lag;
        state.rec = self.recordings.shown();
    }
}

/// Ends the recording in progress and shows its result.
fn say_ended(recordings: &mut Recordings, state: &mut State) {
    if let Some((whole, text)) = recordings.end() {
        state.say(if whole { About::Note } else { About::Trouble }, text);
    }
    state.rec = None;
}

/// Returns the entry for an event that a new baseline ended.
fn given_up(sample: InterruptedReport) -> String {
    format!("{:>7}  given up after {} of 70 frames", sample.frame, sample.frames)
}
