//! Reads one sensor, at its own pace.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use wstac_core::params::SAMPLE_FRAMES;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::{JsonLine, SensorLine};
use wstac_host::output::Output;
use wstac_host::picture::{Picture, Sampler};
use wstac_host::session::{Observer, Phase};
use wstac_host::source::SourceEvent;
use wstac_host::station::{Station, Turn};

use crate::hub::{About, Hub, News, Status};
use crate::jobs::{JobRefusal, Jobs};
use crate::order::Action;
use crate::tools::Tools;

/// Least time between two pictures: slightly less than a client's, so that none waits for one.
const BETWEEN_PICTURES: Duration = Duration::from_millis(20);

/// A sensor that is ready for reading.
pub struct ServedSensor {
    station: Station,
    pub(crate) about: About,
    jobs: Jobs,
}

impl fmt::Debug for ServedSensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServedSensor").field("station", &self.station).finish_non_exhaustive()
    }
}

impl ServedSensor {
    /// Creates a sensor. `name` is its name if there are several. `station` gives the outputs [`OutputOptions::LIVE`].
    ///
    /// [`OutputOptions::LIVE`]: wstac_host::output::OutputOptions::LIVE
    pub fn new(name: Option<&str>, station: Station, tools: Tools) -> Self {
        let (info, layout) = (station.info(), station.processor().geometry().layout());
        let about = About {
            name: name.map(str::to_owned),
            source: info.about.clone(),
            notes: station.config().notes(info).collect(),
            size: [info.size.width(), info.size.height()],
            taxel: layout.taxel(),
            corners: layout.corners().to_vec(),
            pictures: !info.taxels_only,
            rate: info.rate.per_second() / f64::from(info.rate.frames_added()),
            record_to: tools.record_to.as_ref().map(|folder| folder.display().to_string()),
            calibrate_to: tools.calibrate_to.as_ref().map(|file| file.name.clone()),
            seeks: station.can_reopen(),
        };
        Self { station, about, jobs: Jobs::new(name, tools) }
    }

    /// Reads to the end of the source, and does what pages ask until the server ends. A file or a scene is read from
    /// the first page on. Returns whether nothing failed.
    ///
    /// `tell` gets lines about the sensor: why its source has failed, and what was recorded. The page shows them, too.
    pub(crate) fn run(self, number: usize, hub: &Hub, tell: &dyn Fn(&str)) -> bool {
        let Self { mut station, about, jobs } = self;
        let mut waits = about.seeks;
        let sampler = about.pictures.then(|| Sampler::new(station.info()));
        let mut reader = NewsObserver {
            number,
            name: about.name,
            hub,
            sampler,
            pictured: None,
            news: News::default(),
            status: Status { phase: "baseline", ..Status::default() },
            was_waiting: false,
            target: None,
            jobs,
        };
        let mut is_good = true;
        while !hub.is_over() {
            // A calibration may wait for a person's word at the end, and a file or a scene may be read again.
            reader.follow_orders(&mut station, tell);
            // A file or a scene begins when somebody sees it.
            waits &= !hub.is_watched();
            if waits {
                std::thread::sleep(BETWEEN_PICTURES);
                continue;
            }
            let was_over = station.is_over();
            let turn = station.advance(&mut reader);
            reader.jobs.look(&mut station, tell);
            if let Err(error) = &turn {
                is_good = false;
                tell(&error.to_string());
            }
            if !was_over && station.is_over() {
                reader.end(&station, turn.as_ref().err());
            } else if matches!(turn, Ok(Turn::Read)) {
                reader.show(&station);
            }
        }
        if let Err(error) = station.finish(&mut reader) {
            is_good = false;
            tell(&error.to_string());
        }
        reader.jobs.look(&mut station, tell);
        is_good && reader.jobs.failures == 0
    }
}

/// Turns what a station finds into news.
struct NewsObserver<'h> {
    number: usize,
    name: Option<String>,
    hub: &'h Hub,
    sampler: Option<Sampler>,
    /// The time of the last picture.
    pictured: Option<Instant>,
    news: News,
    status: Status,
    /// Whether the last event of the source was that there is none.
    was_waiting: bool,
    /// The frame that a file or a scene is read up to as fast as possible, because a page goes there.
    target: Option<u64>,
    jobs: Jobs,
}

impl NewsObserver<'_> {
    /// Does what pages ask for, and refuses what cannot be done now.
    fn follow_orders(&mut self, station: &mut Station, tell: &dyn Fn(&str)) {
        while let Some(order) = self.hub.take_order(self.number) {
            let followed = self.follow(order.action.clone(), station);
            let delivered = station.deliver(self).map_err(|error| error.to_string());
            if let Err(why) = followed.and(delivered) {
                order.refuse(self.number, why);
            }
            self.jobs.look(station, tell);
            self.look(station);
            self.publish(station);
        }
    }

    fn follow(&mut self, action: Action, station: &mut Station) -> Result<(), JobRefusal> {
        match action {
            Action::Use { proposal } => {
                self.jobs.confirm(proposal, station)?;
                let notes = station.config().notes(station.info()).collect();
                self.hub.set_layout(self.number, station.processor().geometry().layout(), notes);
                self.status.disturbed = false;
            }
            Action::Stop {} => self.jobs.stop(station)?,
            Action::Find {} => self.jobs.find()?,
            Action::Seek { frames, pause } => {
                seekable(station)?;
                self.jobs.expect_none(false)?;
                let starts = station.starts();
                if !station.go(frames).map_err(|error| error.to_string())? {
                    return Err("the source has ended; help: go back, or play it again".to_owned());
                }
                self.status.backs += station.starts() - starts;
                station.is_paused |= pause;
            }
            Action::Play { on } | Action::Loop { on } => {
                seekable(station)?;
                if on && station.is_over() {
                    station.start_again().map_err(|error| error.to_string())?;
                }
                match action {
                    Action::Loop { .. } => station.repeats = on,
                    _ => station.is_paused = !on,
                }
            }
            _ if station.is_over() => return Err("the source has ended, so nothing can be done with it".to_owned()),
            Action::Rezero {} => {
                self.jobs.expect_none(true)?;
                station.rezero();
                self.status.disturbed = false;
            }
            Action::Record { labels } => {
                self.jobs.record(labels, station)?;
                self.status.disturbed = false;
            }
            Action::Calibrate {} => self.jobs.calibrate(station)?,
            Action::Examine {} => self.jobs.examine(station)?,
        }
        Ok(())
    }

    /// Says how the source has ended.
    fn end(&mut self, station: &Station, error: Option<&Error>) {
        self.jobs.end();
        self.look(station);
        self.status.phase = if error.is_some() { "failed" } else { "ended" };
        self.status.error = error.map(ToString::to_string);
        self.status.progress = None;
        self.publish(station);
    }

    /// Shows what a turn of the station has brought.
    fn show(&mut self, station: &Station) {
        if self.was_waiting {
            // Nothing has changed, besides what the page has not seen of a job yet.
            if let Some(jobs) = self.jobs.news(station) {
                self.news.jobs = Some(jobs);
                self.publish(station);
            }
            return;
        }
        self.look(station);
        self.status.taxels = station.processor().taxels();
        self.publish(station);
    }

    fn publish(&mut self, station: &Station) {
        self.news.jobs = self.jobs.news(station).or(self.news.jobs.take());
        self.news.glow = self.jobs.glow.take().and_then(|glow| packed(&glow));
        self.hub.publish(self.number, std::mem::take(&mut self.news), self.status.clone());
    }

    /// Returns whether it is time for a picture that somebody sees.
    fn wants_picture(&mut self) -> bool {
        let arrives = self.target.is_some_and(|target| self.status.frame + 1 >= target);
        let is_due = arrives || self.pictured.is_none_or(|at| at.elapsed() >= BETWEEN_PICTURES);
        let wants = is_due && self.hub.is_watched();
        self.pictured = if wants { Some(Instant::now()) } else { self.pictured };
        wants
    }

    /// Takes the state of the station, unless the source is over.
    fn look(&mut self, station: &Station) {
        self.status.loops = station.repeats;
        if self.status.starts != station.starts() {
            let Status { loops, backs, .. } = self.status;
            self.status = Status { loops, backs, starts: station.starts(), ..Status::default() };
        } else if matches!(self.status.phase, "ended" | "failed") {
            return;
        }
        let processor = station.processor();
        (self.status.phase, self.status.progress) = match processor.phase() {
            Phase::Baseline { frames, of } => ("baseline", Some([frames, of])),
            Phase::Watching => ("watching", None),
            Phase::Capturing { frames } => ("capturing", Some([frames.into(), SAMPLE_FRAMES as u64])),
        };
        self.status.frame = processor.pipeline().next_frame();
        self.status.thresholds = processor.thresholds();
        (self.status.paused, self.target) = (station.is_paused, station.target());
    }
}

/// Refuses a source that can be read once.
fn seekable(station: &Station) -> Result<(), JobRefusal> {
    let refusal = || "this source can be read once, expected a file or a scene".to_owned();
    station.can_reopen().then_some(()).ok_or_else(refusal)
}

impl Observer for NewsObserver<'_> {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        self.jobs.source_event(event);
        self.was_waiting = matches!(event, SourceEvent::Waiting);
        match event {
            SourceEvent::Frame(frame) => {
                self.status.camera_skipped = frame.lag.skipped;
                self.status.latency_ms = frame.lag.latency.map(|latency| (latency.as_secs_f64() * 1e4).round() / 10.0);
                if let Some(sampler) = self.sampler.filter(|_| self.wants_picture()) {
                    self.news.picture = packed(&sampler.picture(frame.bytes));
                }
            }
            SourceEvent::Lost { frames, .. } => {
                self.status.dropped = self.status.dropped.saturating_add(*frames);
            }
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        if let Output::BaselineDisturbed { .. } = output {
            self.status.disturbed = true;
        }
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
