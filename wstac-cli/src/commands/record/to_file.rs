//! `wstac record` writes one sensor or several to one file.

use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::SystemTime;

use super::super::files::{Outputs, check_ending};
use super::super::output::{LossReport, Stop, note, text_of};
use super::super::records::{Form, Records};
use super::super::signals::{Ending, finishing};
use super::super::source_arguments::doubts_of_textures;
use super::{Arguments, Shown, create, frame_limit, kept, labels, say};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::record::about::About;
use wstac_host::record::{RecordedSensor, Recorder, SharedRecording};
use wstac_host::session::{Observer, Processor, Session, Step};
use wstac_host::source::decorate::Limited;
use wstac_host::source::every_sensor::NamedSource;
use wstac_host::source::mcap::McapSource;
use wstac_host::source::{FramePolicy, Labels, SourceEvent};
use wstac_host::texture::Textures;

/// A sensor that is ready for recording.
struct Opened<'a> {
    /// The name of the sensor, which is empty for a single sensor without one.
    name: &'a str,
    session: Session,
    about: About,
    records: Records<'static>,
    /// If it is a recording: the wall-clock time when the driver's clock showed 0, as far as it is known.
    wall_zero: Option<SystemTime>,
}

/// The state that all sensors share while they are read.
struct StopCondition<'a> {
    /// The number of events after which the recording ends.
    limit: Option<u64>,
    events: AtomicU64,
    /// Whether another sensor has failed, or the disk is full.
    is_over: AtomicBool,
    interrupted: &'a AtomicBool,
}

pub(super) fn run(arguments: &Arguments, sensors: &[NamedSource]) -> Result<(), Stop> {
    // Before any of them is opened.
    let (found, most) = (sensors.len(), SharedRecording::MOST_SENSORS);
    if found > most {
        let message = format_args!("are {found}, expected 1 to {most} sensors in a recording");
        return Err(Error::new(ErrorKind::Usage, "sources", message).into());
    }
    let labels = labels(&arguments.labels)?;
    let outputs = sensors.iter().fold(Outputs::new(arguments.force), |outputs, sensor| outputs.source(&sensor.source));
    let outputs = outputs.reading(&arguments.config).reading(&arguments.models);
    check_ending(&arguments.output, &["mcap"])?;
    outputs.check([&arguments.output])?;
    let files = ModelFile::open_all(&arguments.models)?;
    let opened = sensors.iter().map(|sensor| open(arguments, sensor, &files, &labels));
    let opened = opened.collect::<Result<Vec<_>, _>>()?;
    let interrupted = finishing(Ending::Whole);
    let (file, new) = create(arguments, &outputs)?;
    let path = new.as_ref().map_or(&arguments.output, |new| &new.beside);
    let described: Vec<_> = opened.iter().map(Opened::described).collect();
    let compression = arguments.compress.unwrap_or_default();
    let (recording, recorders) = SharedRecording::start(file, path, &described, compression)?;
    let is_live = opened.iter().any(|sensor| sensor.session.info().is_live());
    let shared = StopCondition {
        limit: arguments.events,
        events: AtomicU64::new(0),
        is_over: AtomicBool::new(false),
        interrupted: &interrupted,
    };
    let both = opened.into_iter().zip(recorders);
    let all = &shared;
    let ended: Vec<_> = thread::scope(|scope| {
        let read_all = |(opened, recorder): (Opened<'_>, Recorder)| {
            let about: &str = &opened.session.info().about;
            let name = if opened.name.is_empty() { about } else { opened.name }.to_owned();
            whatever_happens(&name, all, || read(opened, recorder, all))
        };
        let mut both: Vec<_> = both.collect();
        // A signal ends a wait for standard input in this thread alone.
        let last = both.pop();
        let threads: Vec<_> = both.into_iter().map(|both| scope.spawn(move || read_all(both))).collect();
        let last = last.map(read_all);
        // A thread cannot panic: that was caught.
        threads.into_iter().filter_map(|thread| thread.join().ok()).chain(last).collect()
    });
    let written = recording.finish();
    let replaced = new.map_or(Ok(()), |new| new.finish(written.is_ok(), &outputs));
    let lag = ended.iter().map(|ended| ended.lag).max().unwrap_or(0);
    say(&arguments.output, written.as_ref().ok(), lag, shared.events.into_inner(), is_live);
    let mut failures: Vec<Error> = ended.into_iter().filter_map(|ended| ended.failure).collect();
    let last = failures.pop();
    // All errors matter, but an incomplete file matters more.
    failures.iter().for_each(note);
    if let (Some(error), Err(_)) = (&last, &written) {
        note(error);
    }
    written?;
    replaced?;
    Ok(last.map_or(Ok(()), Err)?)
}

fn open<'a>(
    arguments: &Arguments,
    sensor: &'a NamedSource,
    files: &[ModelFile],
    labels: &Labels,
) -> Result<Opened<'a>, Error> {
    let name = sensor.name.as_deref().unwrap_or_default();
    let records = Records::new(Form::json_if(arguments.json)).of_sensor(sensor.name.as_deref());
    let options = arguments.options.of(sensor);
    let (source, info, config) =
        options.open_configured(&sensor.source, FramePolicy::Every, arguments.config.as_deref())?;
    // A recording that ends with an event has the whole sample of it: paths are of whole samples.
    let wanted = OutputOptions { features: true, paths: arguments.events.is_some(), ..OutputOptions::default() };
    let session = Session::builder(Limited::new(source, frame_limit(arguments, &info)))
        .info(info.clone())
        .config(config.clone())
        .outputs(wanted)
        .textures(Textures::new(files)?)
        .build()?;
    let models = files.iter().map(|file| file.about().to_owned()).collect();
    // A recording that is recorded again keeps its labels.
    let mut kept_labels = info.recorded.as_ref().map(|recorded| recorded.labels.clone()).unwrap_or_default();
    kept_labels.extend(labels.clone());
    let about = About::new(&kept(arguments, &info, &config)?, &config, kept_labels, models)?;
    records.note(&info.about);
    records.assumptions(&info, &config);
    if let Some(doubt) = doubts_of_textures(&info, files) {
        records.note(doubt);
    }
    let has_others = sensor.name.is_some();
    let wall_zero = (has_others && info.recorded.is_some())
        .then(|| McapSource::wall_zero(Path::new(&sensor.source), options.sensor.as_deref()));
    Ok(Opened { name, session, about, records, wall_zero: wall_zero.and_then(Result::ok).flatten() })
}

impl Opened<'_> {
    fn described(&self) -> RecordedSensor<'_> {
        let Self { name, session, about, wall_zero, .. } = self;
        RecordedSensor { name, about, processor: session.processor(), wall_zero: *wall_zero }
    }
}

/// The end of a sensor's recording.
#[derive(Default)]
struct Ended {
    lag: u32,
    failure: Option<Error>,
}

/// Records a sensor until its source ends or fails, another one fails, a limit is reached, the disk is full, or a
/// signal asks for the end.
fn read(opened: Opened<'_>, recorder: Recorder, shared: &StopCondition<'_>) -> Ended {
    let Opened { mut session, records, .. } = opened;
    let mut observer = Recording { recorder, shown: Shown::new(records), losses: LossReport::default(), shared };
    let failure = loop {
        if shared.is_over() {
            observer.end_all();
            break session.finish(&mut observer).err();
        }
        match session.step(&mut observer) {
            Ok(Step::GoesOn) => {}
            Ok(Step::Over) => break None,
            Err(Halt::Over) => break session.finish(&mut observer).err(),
            Err(failed) => {
                observer.end_all();
                break Some(failed);
            }
        }
    };
    let failure = match failure {
        Some(Halt::Failed(error)) => Some(error),
        _ if shared.interrupted.load(Ordering::Relaxed) => None,
        _ => observer.losses.expect_a_frame(&session.info().about).err(),
    };
    let Recording { recorder, shown, losses, .. } = observer;
    losses.say(|message| shown.records.note(message));
    let lag = session.lag().most;
    // The file goes on, and its errors come when it ends.
    let _ = recorder.finish();
    Ended { lag, failure }
}

/// Reads a sensor. If that panics, the sensor has failed as by any other error, and the recording of all ends.
fn whatever_happens(name: &str, shared: &StopCondition<'_>, read: impl FnOnce() -> Ended) -> Ended {
    // The reader is not used any more after a panic.
    panic::catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| {
        shared.is_over.store(true, Ordering::Relaxed);
        let failure = Error::new(ErrorKind::Io, name, "its reading ended unexpectedly");
        Ended { failure: Some(failure), ..Ended::default() }
    })
}

impl StopCondition<'_> {
    fn has_enough(&self) -> bool {
        self.limit.is_some_and(|limit| self.events.load(Ordering::Relaxed) >= limit)
    }

    fn is_over(&self) -> bool {
        self.has_enough() || self.is_over.load(Ordering::Relaxed) || self.interrupted.load(Ordering::Relaxed)
    }
}

/// Why the session of a sensor ends before its source.
enum Halt {
    /// The recording has ended for all sensors.
    Over,
    Failed(Error),
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// Records and shows everything that passes through a sensor's session, and tells the other sensors what concerns them.
struct Recording<'a> {
    recorder: Recorder,
    shown: Shown,
    losses: LossReport,
    shared: &'a StopCondition<'a>,
}

impl Recording<'_> {
    /// Ends the recording of all sensors. Files and scenes end at the same place every time, cameras as soon as they
    /// can.
    fn end_all(&self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        self.recorder.end_all();
    }
}

impl Observer for Recording<'_> {
    type Error = Halt;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Halt> {
        if !self.recorder.wait_for_turn(event) {
            return Err(Halt::Over);
        }
        self.losses.source_event(event);
        self.recorder.source_event(event);
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Halt> {
        self.shared.events.fetch_add(u64::from(matches!(output, Output::Event(_))), Ordering::Relaxed);
        self.recorder.output(&output, &text_of(&output));
        self.shown.show(&output);
        if self.shared.has_enough() {
            self.end_all();
        }
        Ok(())
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        let goes_on = self.recorder.processed(event, processor);
        if !goes_on {
            self.end_all();
        }
        goes_on
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_whose_reading_panics_has_failed_and_ends_the_others() {
        let (limit, events, interrupted) = (None, AtomicU64::new(0), &AtomicBool::new(false));
        let shared = StopCondition { limit, events, is_over: AtomicBool::new(false), interrupted };
        assert!(whatever_happens("left", &shared, Ended::default).failure.is_none() && !shared.is_over());
        let failure = whatever_happens("left", &shared, || panic!("as a test")).failure.unwrap();
        assert_eq!(failure.to_string(), "left: its reading ended unexpectedly");
        assert!(shared.is_over());
    }
}
