//! Reads a source of frames and keeps what the screen shows.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::Duration;

use wstac_core::params::FEATURE_ONE;

use super::state::{About, State};
use super::{Sensor, locked};
use wstac_host::camera::modes::fps;
use wstac_host::error::Error;
use wstac_host::output::Output;
use wstac_host::picture::Sampler;
use wstac_host::session::Processor;
use wstac_host::source::pace::Pace;
use wstac_host::source::{Source, SourceEvent, StreamInfo};

/// The number of frames over which a camera's rate is measured.
const MEASURED: usize = 60;

/// A source of frames.
pub(crate) struct Frames {
    source: Box<dyn Source>,
    processor: Processor,
    /// `None` if the source makes no pixels.
    sampler: Option<Sampler>,
    /// `None` for a camera, which has its own pace.
    pace: Option<Pace>,
    about: String,
    /// The driver's timestamps of the last frames.
    times: VecDeque<Duration>,
    /// The first feature frame of the baseline.
    zero: u64,
}

impl Frames {
    /// Creates the sensor of a source. `processor` gives features and motion.
    pub(crate) fn new(source: Box<dyn Source>, info: &StreamInfo, processor: Processor, live: bool) -> Self {
        let sampler = (!info.taxels_only).then(|| Sampler::new(info));
        let pace = (!live).then(|| Pace::new(info.rate));
        Self { source, processor, sampler, pace, about: info.about.clone(), times: VecDeque::new(), zero: 0 }
    }

    /// Takes the facts of the trigger.
    fn look(&self, state: &mut State) {
        let pipeline = self.processor.pipeline();
        let window = f32::from(pipeline.trigger_config().window());
        let real = |sum: i32| sum as f32 / FEATURE_ONE as f32 / window;
        state.frame = pipeline.next_frame();
        state.thresholds = pipeline.thresholds().map(|thresholds| thresholds.map(real));
        let (done, of) = (state.frame - self.zero, pipeline.trigger_config().baseline_frames());
        state.doing = match (pipeline.baseline(), pipeline.end().incomplete) {
            (None, _) => (About::Trouble, format!("baseline {done}/{of}")),
            (_, Some(sample)) => (About::Event, format!("event {}/70", sample.frames)),
            _ => (About::Note, "watching".to_owned()),
        };
    }
}

impl Sensor for Frames {
    fn state(&self) -> State {
        let rate = format!("{} fps, nominal", fps(self.source.info().rate));
        let mut state = State::new(self.about.clone(), self.pace.is_none(), rate);
        state.layout = Some(*self.processor.geometry().layout());
        self.look(&mut state);
        state
    }

    fn wait(&self) -> Duration {
        self.pace.as_ref().map_or(Duration::ZERO, Pace::wait)
    }

    fn step(&mut self, state: &Mutex<State>) -> Result<bool, Error> {
        let event = match self.source.next_event() {
            Ok(event) => event,
            Err(error) => {
                let mut state = locked(state);
                self.processor.finish(|output| {
                    state.take(&output);
                    Ok::<(), Error>(())
                })?;
                return Err(error);
            }
        };
        let (mut passed, mut picture) = (1, None);
        match &event {
            SourceEvent::Frame(frame) => {
                let is_wanted = std::mem::take(&mut locked(state).wants_picture);
                picture = self.sampler.filter(|_| is_wanted).map(|sampler| sampler.picture(frame.bytes));
                locked(state).lag = frame.lag;
                self.times.extend(frame.timestamp);
            }
            SourceEvent::Taxels(frame) => self.times.extend(frame.timestamp),
            SourceEvent::Lost { frames, .. } => passed = *frames,
            _ => passed = 0,
        }
        let before = self.processor.pipeline().next_frame();
        let mut outputs = Vec::new();
        let goes_on = self.processor.process(&event, |output| {
            outputs.push(output);
            Ok::<(), Error>(())
        })?;
        let mut state = locked(state);
        if let SourceEvent::Lost { frames, .. } = event {
            state.dropped = state.dropped.saturating_add(frames);
            state.add_gaps(self.processor.pipeline().next_frame() - before);
        }
        for output in &outputs {
            state.take(output);
        }
        if passed > 0 {
            state.set_taxels(self.processor.taxels());
            state.missing = if self.sampler.is_some() { "frame lost" } else { "taxel sums only" };
        }
        state.picture = picture.or(state.picture.take());
        if goes_on {
            self.look(&mut state);
        }
        if let Some(pace) = &mut self.pace {
            pace.advance(passed);
        }
        self.times.drain(..self.times.len().saturating_sub(MEASURED));
        if let (Some(first), Some(last)) = (self.times.front(), self.times.back())
            && last > first
        {
            let seconds = last.saturating_sub(*first).as_secs_f64();
            state.rate = format!("{:.2} fps", (self.times.len() - 1) as f64 / seconds);
        }
        Ok(goes_on)
    }

    fn rezero(&mut self, state: &mut State) {
        if let Some(sample) = self.processor.rezero() {
            state.take(&Output::Interrupted(sample));
        }
        self.zero = self.processor.pipeline().next_frame();
        state.say(About::Note, format!("at frame {}: a new baseline, keep off the sensor", self.zero));
        self.look(state);
    }
}
