//! Reads one sensor, at its own pace.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use wstac_core::params::FEATURE_ONE;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::{JsonLine, SensorLine};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::picture::{Picture, Sampler};
use wstac_host::session::{Observer, Processor, Session, SessionBuilder, Step};
use wstac_host::source::pace::Pace;
use wstac_host::source::{SourceEvent, StreamInfo};

use crate::hub::{About, Hub, News, Status};

/// The longest sleep between two looks at the end and at requests.
const NAP: Duration = Duration::from_millis(50);
/// Least time between two pictures: slightly less than a client's, so that none waits for one.
const BETWEEN_PICTURES: Duration = Duration::from_millis(20);

/// A sensor that is ready for reading.
#[derive(Debug)]
pub struct Sensor {
    session: Session,
    about: About,
    sampler: Option<Sampler>,
    pace: Option<Pace>,
}

impl Sensor {
    /// Creates a sensor of a session that is not built yet.
    ///
    /// `name` is the sensor's name if there are several. `pace` is `None` for a camera, which has its own.
    ///
    /// # Errors
    /// The session cannot be built.
    pub fn new(
        name: Option<&str>,
        session: SessionBuilder,
        info: &StreamInfo,
        pace: Option<Pace>,
    ) -> Result<Self, Error> {
        let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
        let session = session.info(info.clone()).outputs(wanted).build()?;
        let layout = *session.processor().geometry().layout();
        let about = About {
            name: name.map(str::to_owned),
            source: info.about.clone(),
            size: [info.size.width(), info.size.height()],
            taxel: layout.taxel(),
            corners: layout.corners().to_vec(),
            pictures: !info.taxels_only,
            rate: info.rate.per_second() / f64::from(info.rate.frames_added()),
        };
        let sampler = (!info.taxels_only).then(|| Sampler::new(info));
        Ok(Self { session, about, sampler, pace })
    }

    pub(crate) fn about(&self) -> &About {
        &self.about
    }

    /// Reads to the end of the source, or until the server ends.
    ///
    /// # Errors
    /// The source fails. The page shows the error.
    pub(crate) fn run(self, number: usize, hub: &Hub) -> Result<(), Error> {
        let Self { mut session, about, sampler, pace } = self;
        let mut reader = Reader {
            number,
            name: about.name,
            hub,
            sampler,
            pictured: None,
            news: News::default(),
            status: Status { phase: "baseline", ..Status::default() },
            zero: 0,
            passed: 0,
        };
        let mut pace = pace;
        if let Some(pace) = &mut pace {
            pace.restart();
        }
        let read = loop {
            if hub.is_over() {
                return Ok(());
            }
            if hub.take_rezero(number) {
                reader.rezero(session.processor_mut())?;
            }
            match session.step(&mut reader) {
                Ok(Step::GoesOn) => {}
                Ok(Step::Over) => break Ok(()),
                Err(error) => break Err(error),
            }
            let passed = std::mem::take(&mut reader.passed);
            if let Some(pace) = &mut pace {
                pace.advance(passed);
                while !pace.wait().is_zero() && !hub.is_over() {
                    thread::sleep(pace.wait().min(NAP));
                }
            }
        };
        reader.end(read.as_ref().err());
        read
    }
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
    /// The camera frames of the last step.
    passed: u64,
}

impl Reader<'_> {
    /// Gathers a new baseline.
    fn rezero(&mut self, processor: &mut Processor) -> Result<(), Error> {
        if let Some(sample) = processor.rezero() {
            self.output(Output::Interrupted(sample))?;
        }
        self.status.disturbed = false;
        self.zero = processor.pipeline().next_frame();
        Ok(())
    }

    /// Says how the source has ended.
    fn end(mut self, error: Option<&Error>) {
        self.status.phase = if error.is_some() { "failed" } else { "ended" };
        self.status.error = error.map(ToString::to_string);
        self.status.progress = None;
        self.publish();
    }

    fn publish(&mut self) {
        self.hub.publish(self.number, std::mem::take(&mut self.news), self.status.clone());
    }

    /// Returns whether it is time for a picture that somebody sees.
    fn wants_picture(&mut self) -> bool {
        let is_due = self.pictured.is_none_or(|at| at.elapsed() >= BETWEEN_PICTURES);
        if is_due && self.hub.is_watched() {
            self.pictured = Some(Instant::now());
            return true;
        }
        false
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

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        // Nothing has changed.
        if matches!(event, SourceEvent::Waiting) {
            return true;
        }
        let pipeline = processor.pipeline();
        let window = f32::from(pipeline.trigger_config().window());
        let real = |sum: i32| sum as f32 / FEATURE_ONE as f32 / window;
        (self.status.phase, self.status.progress) = self.phase(processor);
        self.status.frame = pipeline.next_frame();
        self.status.taxels = processor.taxels();
        self.status.thresholds = pipeline.thresholds().map(|thresholds| thresholds.map(real));
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
