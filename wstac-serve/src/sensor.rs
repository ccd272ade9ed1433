//! Reads one sensor, at its own pace.

use std::fmt;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use wstac_core::params::FEATURE_ONE;
use wstac_host::camera::CameraState;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::{JsonLine, SensorLine};
use wstac_host::output::{Elapsed, InterruptedReport, Output, OutputOptions};
use wstac_host::picture::{Picture, Sampler};
use wstac_host::session::{Observer, Processor, Session, Step};
use wstac_host::source::pace::Pace;
use wstac_host::source::{Source, SourceEvent, StreamInfo};
use wstac_host::texture::Textures;

use crate::hub::{About, Hub, News, Status};
use crate::jobs::{Jobs, Refusal};
use crate::order::Action;
use crate::tools::Tools;

/// The longest sleep between two looks at the end and at requests.
const NAP: Duration = Duration::from_millis(50);
/// Least time between two pictures: slightly less than a client's, so that none waits for one.
const BETWEEN_PICTURES: Duration = Duration::from_millis(20);

/// A sensor that is ready for reading.
pub struct Sensor {
    session: Session,
    about: About,
    sampler: Option<Sampler>,
    pace: Option<Pace>,
    textures: Textures,
    reopen: Option<Box<Reopen>>,
    repeats: bool,
    jobs: Jobs,
}

impl fmt::Debug for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sensor").field("session", &self.session).finish_non_exhaustive()
    }
}

/// A source with all that is needed to read it.
pub struct Opened {
    /// The source.
    pub source: Box<dyn Source>,
    /// The properties of its frames, as the user has them.
    pub info: StreamInfo,
    /// The configuration.
    pub config: Config,
    /// The texture models.
    pub textures: Textures,
    /// The pace of a file; `None` for a camera, which has its own.
    pub pace: Option<Pace>,
    /// Opens a file or a scene again, so that pages can go back; `None` for a source that can be read once.
    pub reopen: Option<Box<Reopen>>,
    /// Whether a source that can be opened again starts again at its end.
    pub repeats: bool,
}

/// Opens a source again, from its first frame on.
pub type Reopen = dyn Fn() -> Result<(Box<dyn Source>, StreamInfo), Error> + Send;

impl fmt::Debug for Opened {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Opened").field("info", &self.info).finish_non_exhaustive()
    }
}

impl Sensor {
    /// Creates a sensor. `name` is its name if there are several.
    ///
    /// # Errors
    /// The session cannot be built.
    pub fn new(name: Option<&str>, opened: Opened, tools: Tools) -> Result<Self, Error> {
        let Opened { source, info, config, textures, pace, reopen, repeats } = opened;
        let session = session(source, info.clone(), config.clone(), textures.clone())?;
        let layout = *session.processor().geometry().layout();
        let [record_to, calibrate_to] = Jobs::places(&tools);
        let about = About {
            name: name.map(str::to_owned),
            source: info.about.clone(),
            size: [info.size.width(), info.size.height()],
            taxel: layout.taxel(),
            corners: layout.corners().to_vec(),
            pictures: !info.taxels_only,
            rate: info.rate.per_second() / f64::from(info.rate.frames_added()),
            record_to,
            calibrate_to,
            seeks: reopen.is_some(),
        };
        let sampler = (!info.taxels_only).then(|| Sampler::new(&info));
        let jobs = Jobs::new(name, info, config, tools);
        Ok(Self { session, about, sampler, pace, textures, reopen, repeats, jobs })
    }

    pub(crate) fn about(&self) -> &About {
        &self.about
    }

    /// Reads to the end of the source, and does what pages ask until the server ends. Returns whether nothing failed.
    ///
    /// `tell` gets lines about the sensor: why its source has failed, and what was recorded. The page shows them, too.
    pub(crate) fn run(self, number: usize, hub: &Hub, tell: &dyn Fn(&str)) -> bool {
        let Self { mut session, about, sampler, pace, textures, reopen, repeats, jobs } = self;
        let mut reader = Reader {
            number,
            name: about.name,
            hub,
            sampler,
            pictured: None,
            news: News::default(),
            status: Status { phase: "baseline", ..Status::default() },
            zero: 0,
            elapsed: Elapsed::default(),
            passed: 0,
            textures,
            reopen,
            target: None,
            jobs,
            camera: None,
        };
        let mut is_good = true;
        while !hub.is_over() {
            let mut read = reader.read(&mut session, pace, tell);
            // A source without frames would start again for ever.
            let starts_again = repeats && read.is_ok() && reader.status.frame > 0 && !hub.is_over();
            if starts_again {
                read = reader.start_again(&mut session);
            }
            is_good &= read.is_ok();
            if let Err(error) = &read {
                tell(&error.to_string());
            }
            if !(hub.is_over() || starts_again && read.is_ok()) {
                reader.end(read.as_ref().err());
            }
            // A calibration may wait for a person's word, and a file or a scene may be read again. Everything else is refused.
            while reader.has_ended() && !hub.is_over() {
                reader.follow_orders(&mut session, tell);
                hub.wait(NAP);
            }
        }
        is_good && reader.jobs.failures() == 0
    }
}

/// Creates a session with all that a page shows.
fn session(source: Box<dyn Source>, info: StreamInfo, config: Config, textures: Textures) -> Result<Session, Error> {
    let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
    Session::builder(source).config(config).textures(textures).info(info).outputs(wanted).build()
}

/// Turns what a session finds into news.
struct Reader<'h> {
    number: usize,
    name: Option<String>,
    hub: &'h Hub,
    sampler: Option<Sampler>,
    /// The time of the last picture.
    pictured: Option<Instant>,
    news: News,
    status: Status,
    /// The first feature frame of the baseline.
    zero: u64,
    /// The time up to the last restart, from which the times of outputs count. Those of the page go on.
    elapsed: Elapsed,
    /// The camera frames of the last step.
    passed: u64,
    textures: Textures,
    reopen: Option<Box<Reopen>>,
    /// The frame that a file or a scene is read up to as fast as possible, because a page goes there.
    target: Option<u64>,
    jobs: Jobs,
    /// The state of the camera, while it is examined.
    camera: Option<Box<CameraState>>,
}

impl Reader<'_> {
    /// Reads to the end of the source, or until the server ends. A recording is whole then.
    fn read(&mut self, session: &mut Session, mut pace: Option<Pace>, tell: &dyn Fn(&str)) -> Result<(), Error> {
        if let Some(pace) = &mut pace {
            pace.restart();
        }
        let read = loop {
            if self.hub.is_over() {
                break session.finish(self);
            }
            self.follow_orders(session, tell);
            if self.status.paused && self.target.is_none() {
                self.hub.wait(NAP);
                continue;
            }
            if self.jobs.is_examining() {
                self.camera.clone_from(&session.info().camera);
            }
            match session.step(self) {
                Ok(Step::GoesOn) => {}
                Ok(Step::Over) => break Ok(()),
                Err(error) => break Err(error),
            }
            let passed = std::mem::take(&mut self.passed);
            if let Some(pace) = &mut pace {
                pace.advance(passed);
                if self.target.is_some() {
                    pace.restart();
                }
                while !pace.wait().is_zero() && !self.hub.is_over() {
                    thread::sleep(pace.wait().min(NAP));
                }
            }
        };
        self.jobs.end();
        self.jobs.told().iter().for_each(|line| tell(line));
        read
    }

    /// Does what pages ask for, and refuses what cannot be done now.
    fn follow_orders(&mut self, session: &mut Session, tell: &dyn Fn(&str)) {
        while let Some(order) = self.hub.take_order(self.number) {
            if let Err(why) = self.follow(order.action.clone(), session) {
                order.refuse(self.number, why);
            }
            self.publish();
        }
        self.jobs.told().iter().for_each(|line| tell(line));
    }

    fn follow(&mut self, action: Action, session: &mut Session) -> Result<(), Refusal> {
        let is_over = session.is_over() || self.status.error.is_some();
        match action {
            Action::Use { proposal } => {
                let (processor, mut incomplete) = (session.processor_mut(), None);
                let layout = self.jobs.confirm(proposal, |info, config| {
                    incomplete = processor.reconfigure(info, config)?;
                    Ok(*processor.geometry().layout())
                })?;
                self.hub.set_layout(self.number, &layout);
                self.restarted(incomplete, processor)
            }
            Action::Stop {} => self.jobs.stop(),
            Action::Find {} => self.jobs.find(),
            Action::Seek { frames, pause } => self.go(frames, session).map(|()| self.status.paused |= pause),
            _ if is_over => Err("the source has ended, expected one that is read".to_owned()),
            Action::Rezero {} => {
                self.jobs.expect_none(true)?;
                let processor = session.processor_mut();
                let incomplete = processor.rezero();
                self.restarted(incomplete, processor)
            }
            Action::Record { labels } => {
                let processor = session.processor_mut();
                let recording = self.jobs.open_recording(labels, processor)?;
                // The replay begins with a new baseline, too. The sample that this ends is not part of it.
                let incomplete = processor.restart();
                let restarted = self.restarted(incomplete, processor);
                self.jobs.record(recording);
                restarted
            }
            Action::Calibrate {} => self.jobs.calibrate(),
            Action::Examine {} => self.jobs.examine(),
            Action::Play { on } => self.seekable().map(|()| self.status.paused = !on),
        }
    }

    /// Goes to the frame that is so many frames from the one that is shown, or that is gone to now.
    fn go(&mut self, frames: i64, session: &mut Session) -> Result<(), Refusal> {
        self.seekable()?;
        self.jobs.expect_none(false)?;
        let now = session.processor().pipeline().next_frame();
        let target = self.target.unwrap_or(now).saturating_add_signed(frames).max(1);
        if target < now {
            self.start_again(session).map_err(|error| error.to_string())?;
        } else if self.has_ended() {
            return Err("the source has ended, expected a way back".to_owned());
        }
        self.target = Some(target);
        Ok(())
    }

    /// Refuses a source that can be read once.
    fn seekable(&self) -> Result<(), Refusal> {
        let refusal = || "this source can be read once, expected a file or a scene".to_owned();
        self.reopen.as_ref().map(|_| ()).ok_or_else(refusal)
    }

    /// Starts again from the first frame.
    fn start_again(&mut self, session: &mut Session) -> Result<(), Error> {
        let Some(reopen) = &self.reopen else { return Ok(()) };
        let (source, info) = reopen()?;
        *session = self::session(source, info, self.jobs.config.clone(), self.textures.clone())?;
        let (paused, starts) = (self.status.paused, self.status.starts + 1);
        self.status = Status { phase: "baseline", paused, starts, ..Status::default() };
        (self.zero, self.elapsed, self.target) = (0, Elapsed::default(), None);
        Ok(())
    }

    /// Takes the beginning of a new baseline, which ended this sample.
    fn restarted(&mut self, incomplete: Option<InterruptedReport>, processor: &Processor) -> Result<(), Refusal> {
        self.status.disturbed = false;
        self.zero = processor.pipeline().next_frame();
        // Its times are those before the restart.
        let interrupted = incomplete.map(|sample| self.output(Output::Interrupted(sample)));
        self.elapsed = processor.elapsed();
        self.look(processor);
        interrupted.unwrap_or(Ok(())).map_err(|error| error.to_string())
    }

    /// Says how the source has ended.
    fn end(&mut self, error: Option<&Error>) {
        self.status.phase = if error.is_some() { "failed" } else { "ended" };
        self.status.error = error.map(ToString::to_string);
        (self.status.progress, self.target) = (None, None);
        self.publish();
    }

    fn has_ended(&self) -> bool {
        matches!(self.status.phase, "ended" | "failed")
    }

    fn publish(&mut self) {
        self.news.jobs = self.jobs.news().or(self.news.jobs.take());
        self.news.glow = self.jobs.glow().and_then(|glow| packed(&glow));
        self.hub.publish(self.number, std::mem::take(&mut self.news), self.status.clone());
    }

    /// Returns whether it is time for a picture that somebody sees.
    fn wants_picture(&mut self) -> bool {
        let arrives = self.target.is_some_and(|target| self.status.frame + 1 >= target);
        let is_due = arrives || self.pictured.is_none_or(|at| at.elapsed() >= BETWEEN_PICTURES);
        if is_due && self.hub.is_watched() {
            self.pictured = Some(Instant::now());
            return true;
        }
        false
    }

    /// Takes the state of the trigger, unless the source is over.
    fn look(&mut self, processor: &Processor) {
        if self.has_ended() {
            return;
        }
        let pipeline = processor.pipeline();
        let window = f32::from(pipeline.trigger_config().window());
        let real = |sum: i32| sum as f32 / FEATURE_ONE as f32 / window;
        (self.status.phase, self.status.progress) = self.phase(processor);
        self.status.frame = pipeline.next_frame();
        self.status.thresholds = pipeline.thresholds().map(|thresholds| thresholds.map(real));
    }

    /// Returns what the trigger does, and how far it is.
    fn phase(&self, processor: &Processor) -> (&'static str, Option<[u64; 2]>) {
        let pipeline = processor.pipeline();
        match (pipeline.baseline(), pipeline.end().incomplete) {
            (None, _) => {
                let all = u64::from(pipeline.trigger_config().baseline_frames());
                ("baseline", Some([pipeline.next_frame().saturating_sub(self.zero).min(all), all]))
            }
            (_, Some(sample)) => {
                ("capturing", Some([u64::from(sample.frames), wstac_core::params::SAMPLE_FRAMES as u64]))
            }
            _ => ("watching", None),
        }
    }
}

impl Observer for Reader<'_> {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        self.jobs.source_event(event);
        match event {
            SourceEvent::Frame(frame) => {
                self.passed = 1;
                self.status.camera_skipped = frame.lag.skipped;
                self.status.latency_ms = frame.lag.latency.map(|latency| (latency.as_secs_f64() * 1e4).round() / 10.0);
                if let Some(sampler) = self.sampler.filter(|_| self.wants_picture()) {
                    self.news.picture = packed(&sampler.picture(frame.bytes));
                }
            }
            SourceEvent::Taxels(_) => self.passed = 1,
            SourceEvent::Lost { frames, .. } => {
                self.passed = *frames;
                self.status.dropped = self.status.dropped.saturating_add(*frames);
            }
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        self.jobs.output(&output);
        if let Output::BaselineDisturbed { .. } = output {
            self.status.disturbed = true;
        }
        let output = output.after(self.elapsed);
        let Some(line) = JsonLine::new(&output) else { return Ok(()) };
        let line = serde_json::to_string(&SensorLine { sensor: self.name.as_deref(), line })
            .map_err(|error| Error::with_cause(ErrorKind::Io, "a record", error))?;
        match output {
            Output::Features(_) => self.news.features.push(line),
            Output::Motion(_) => self.news.motion = Some(line),
            _ => self.news.records.push(line),
        }
        Ok(())
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        self.jobs.processed(event, processor, self.camera.as_deref());
        if matches!(event, SourceEvent::Waiting) {
            // Nothing has changed, besides what the page has not seen of a job yet.
            if let Some(jobs) = self.jobs.news() {
                self.news.jobs = Some(jobs);
                self.publish();
            }
            return true;
        }
        // By a driver's clock it is known from the first frame on.
        self.elapsed = processor.elapsed();
        self.look(processor);
        self.target = self.target.filter(|target| self.status.frame < *target);
        self.status.taxels = processor.taxels();
        self.publish();
        true
    }
}

/// Returns a picture as the page gets it; `None` if it is larger than pictures are.
fn packed(picture: &Picture) -> Option<Arc<[u8]>> {
    let [width, height] = picture.size.map(u16::try_from);
    let sides = [width.ok()?, height.ok()?].map(u16::to_le_bytes);
    let light = picture.light.iter().map(|light| (light.clamp(0.0, 1.0).sqrt() * 255.0).round() as u8);
    Some(sides.into_iter().flatten().chain(light).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_packed_with_their_size_and_roots() {
        let picture = Picture { size: [2, 1], light: vec![0.25, 1.0] };
        assert_eq!(packed(&picture).unwrap()[..], [2, 0, 1, 0, 128, 255]);
        assert!(packed(&Picture { size: [70_000, 1], light: vec![0.0; 70_000] }).is_none());
    }
}
