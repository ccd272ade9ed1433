//! Reads one source of frames: a camera, a file or a scene.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::{Duration, SystemTime};

use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Elapsed, FrameFeatures, InterruptedReport, Output, OutputOptions};
use wstac_host::record::Excerpt;
use wstac_host::record::about::About;
use wstac_host::session::{Observer, Processor, Session, Step};
use wstac_host::source::open::{OpenOptions, SourceKind, open};
use wstac_host::source::pace::Pace;
use wstac_host::source::{FramePolicy, SourceEvent, StreamInfo, config_of};
use wstac_host::text::text_of;
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

use crate::arguments::{Arguments, NamedSource};
use crate::note;
use crate::orders::{Action, Order, replace, shown};
use crate::publisher::PublisherHandle;
use crate::recording;
use crate::ros::picture::Shape;
use crate::sums::FrameSums;

/// The kinds of sources besides files.
const KINDS: &[&dyn SourceKind] = &[&wstac_linux::source::Cameras, &wstac_scene::source::Scenes];
/// The longest sleep between two looks at the signal.
const NAP: Duration = Duration::from_millis(100);

/// A source of frames that is ready for reading.
pub(crate) struct Frames {
    name: String,
    session: Session,
    /// `None` for a camera, which has its own.
    pace: Option<Pace>,
    /// The shape of pictures, if the source has any.
    picture: Option<Shape>,
    configured: Configured,
}

/// What services may replace.
struct Configured {
    info: StreamInfo,
    config: Config,
    /// What the models say about themselves.
    models: Vec<String>,
}

impl Frames {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(named: &NamedSource, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
        let NamedSource { name, source: source_name, recorded } = named;
        let options =
            OpenOptions { delivery: delivery(arguments), sensor: recorded.clone(), ..arguments.camera.clone() };
        let source = open(source_name, &options, KINDS)?;
        let info = source.info().clone();
        let given = arguments.config.as_deref().map(Config::read).transpose()?;
        let (config, textures) = (config_of(&info, given)?, Textures::new(models)?);
        let session = Session::builder(source).outputs(wanted()).textures(textures).config(config.clone());
        let pace = (!is_camera(source_name)).then(|| Pace::new(info.rate));
        note(format_args!("{name}: {}", info.about));
        let picture = Shape::of(&info);
        if arguments.picture && picture.is_none() {
            note(format_args!("{name}: its frames are no pictures of ROS 2; they are not published"));
        }
        let models = models.iter().map(|model| model.about().to_owned()).collect();
        let configured = Configured { info, config, models };
        Ok(Self { name: name.to_owned(), session: session.build()?, pace, picture, configured })
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    pub(crate) fn run(
        self,
        publisher: PublisherHandle,
        orders: &Receiver<Order>,
        share: f64,
        ends: &AtomicBool,
    ) -> bool {
        let Self { name, mut session, pace, picture, mut configured } = self;
        if pace.is_some() {
            // A frame of a file may last for hours.
            thread::sleep(Duration::from_secs_f64((share / session.info().rate.per_second()).min(1.0)));
        }
        let (stamp, elapsed) = (SystemTime::now(), Elapsed::default());
        let sums = FrameSums::new(session.info().rate);
        let mut reader =
            Reader { publisher, pace, picture, passed: 0, stamp, elapsed, completed: None, sums, recording: None };
        if let Some(pace) = &mut reader.pace {
            pace.restart();
        }
        let read = loop {
            if ends.load(Ordering::Relaxed) {
                break session.finish(&mut reader);
            }
            // One for each frame: whoever asks without end does not hold up the sensor.
            if let Ok(order) = orders.try_recv() {
                order.answer(|action| configured.follow(action, &name, &mut session, &mut reader));
            }
            match session.step(&mut reader) {
                Ok(Step::GoesOn) => reader.wait(ends),
                Ok(Step::Over) => break Ok(()),
                Err(error) => break Err(error),
            }
        };
        if let Err(error) = &read {
            note(format_args!("{name}: {error}"));
        }
        let recorded = reader.end_recording().inspect_err(|error| note(format_args!("{name}: {error}")));
        if let Ok(Some(line)) = &recorded {
            note(format_args!("{name}: {line}"));
        }
        read.is_ok() && recorded.is_ok()
    }
}

/// Returns which frames of a camera are read: all, if they can be recorded. Otherwise the newest one is worth more than
/// those before it.
fn delivery(arguments: &Arguments) -> FramePolicy {
    if arguments.files.is_some() { FramePolicy::Every } else { FramePolicy::Newest }
}

/// Returns the outputs that are published.
fn wanted() -> OutputOptions {
    let mut wanted = OutputOptions::default();
    (wanted.features, wanted.motion) = (true, true);
    wanted
}

impl Configured {
    /// Does what a service asks. Returns a text for people.
    ///
    /// # Errors
    /// A file cannot be used, or the sensor is in a state in which it cannot be done. Nothing has changed then.
    fn follow(
        &mut self,
        action: Action,
        name: &str,
        session: &mut Session,
        reader: &mut Reader,
    ) -> Result<String, Error> {
        let state = |why: &str| Err(Error::new(ErrorKind::Usage, name, why));
        match action {
            // Whatever else changes, a replay of the recording would not know of it.
            Action::StopRecording => match reader.end_recording()? {
                Some(line) => Ok(line),
                None => state("has no recording in progress"),
            },
            _ if reader.recording.is_some() => state("has a recording in progress, expected none: stop it first"),
            Action::RestartBaseline => {
                reader.interrupt(session.processor_mut().rezero())?;
                Ok("the baseline is gathered; leave the sensor untouched for 25 frames".to_owned())
            }
            Action::UseConfig { config, file } => {
                // What was being captured ends here. Numbers and times of frames go on.
                let interrupted = session.processor_mut().reconfigure(&self.info, &config)?;
                let interrupted = reader.restarted(interrupted, session.processor());
                self.config = *config;
                replace(&reader.publisher.settings().config, shown(&file));
                interrupted.map(|()| format!("{} is used", file.display()))
            }
            Action::UseModel { textures, about, file } => {
                session.processor_mut().set_textures(textures);
                self.models = vec![about];
                replace(&reader.publisher.settings().models, vec![shown(&file)]);
                Ok(format!("{} is used", file.display()))
            }
            Action::StartRecording { folder, file, features_only, labels } => {
                let mut kept = self.info.clone();
                if features_only {
                    (kept.taxels_only, kept.crop) = (true, None);
                } else if kept.taxels_only {
                    return state("has taxel sums and no frames, expected features_only");
                }
                let about = About::new(&kept, &self.config, labels, self.models.clone())?;
                let recording = recording::start(&folder, &file, name, &about, session.processor())?;
                let path = recording.path().display().to_string();
                // Its replay begins with a new baseline, too. The sample that this ends is not part of it.
                let interrupted = session.processor_mut().restart();
                let interrupted = reader.restarted(interrupted, session.processor());
                reader.recording = Some(recording);
                interrupted.map(|()| path)
            }
        }
    }
}

/// Hands everything over that a session finds.
struct Reader {
    publisher: PublisherHandle,
    pace: Option<Pace>,
    /// The shape of pictures, if the source has any.
    picture: Option<Shape>,
    /// The camera frames of the last step.
    passed: u64,
    /// The wall-clock time of the last frame: the driver's, or else when it was read.
    stamp: SystemTime,
    /// The time up to the last restart, from which the times of outputs count. Those that are published go on.
    elapsed: Elapsed,
    /// The features that the last event of the source has completed.
    completed: Option<FrameFeatures>,
    /// The taxel sums that the next features are made of.
    sums: FrameSums,
    recording: Option<Excerpt>,
}

impl Reader {
    /// Publishes a sample that ends early.
    fn interrupt(&mut self, sample: Option<InterruptedReport>) -> Result<(), Error> {
        sample.map_or(Ok(()), |sample| self.output(Output::Interrupted(sample)))
    }

    /// Goes on behind a restart of the processor, which ended this sample.
    fn restarted(&mut self, sample: Option<InterruptedReport>, processor: &Processor) -> Result<(), Error> {
        // Its times are those before the restart.
        let interrupted = self.interrupt(sample);
        self.elapsed = processor.elapsed();
        self.sums.restart();
        interrupted
    }

    /// Ends the recording in progress, if there is one. Returns a line about it.
    fn end_recording(&mut self) -> Result<Option<String>, Error> {
        self.recording.take().map(recording::finish).transpose()
    }

    /// Waits until the next frame of a file is due.
    fn wait(&mut self, ends: &AtomicBool) {
        let Some(pace) = &mut self.pace else { return };
        pace.advance(std::mem::take(&mut self.passed));
        while !pace.wait().is_zero() && !ends.load(Ordering::Relaxed) {
            thread::sleep(pace.wait().min(NAP));
        }
    }
}

impl Observer for Reader {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        if let Some(recording) = &mut self.recording {
            recording.source_event(event);
        }
        match event {
            SourceEvent::Frame(frame) => {
                self.passed += 1;
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
                if let Some(picture) = self.picture {
                    self.publisher.picture(picture, frame.bytes, self.stamp);
                }
            }
            SourceEvent::Taxels(frame) => {
                self.passed += 1;
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
            }
            SourceEvent::Lost { frames, .. } => {
                self.passed += frames;
                self.publisher.counts().lost.fetch_add(*frames, Ordering::Relaxed);
            }
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        if let Some(recording) = &mut self.recording {
            recording.output(&output, text_of);
        }
        let output = output.after(self.elapsed);
        if let Output::Features(features) = &output {
            self.completed = Some(*features);
        }
        self.publisher.output(&output, self.stamp)
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        // By a driver's clock it is known from the first frame on.
        self.elapsed = processor.elapsed();
        let is_frame = matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_));
        if let Some(sums) = processor.taxel_sums().filter(|_| is_frame) {
            self.sums.add(&sums);
        }
        if let Some(features) = self.completed.take()
            && let Some(sums) = self.sums.complete()
        {
            self.publisher.taxels(&features, &sums, self.stamp);
        }
        if self.recording.as_mut().is_some_and(|recording| !recording.processed(event, processor)) {
            // The disk is full. The sensor goes on without it.
            let ended = self.end_recording().map_or_else(|error| error.to_string(), Option::unwrap_or_default);
            note(ended);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::mpsc::{SyncSender, channel, sync_channel};

    use clap::Parser;

    use super::*;
    use crate::orders::Control;
    use crate::publisher::Queue;

    fn arguments(more: &[&str]) -> Arguments {
        Arguments::try_parse_from(["wstac-node", "scene:Saw3@150"].iter().chain(more)).unwrap()
    }

    #[test]
    fn every_frame_is_read_if_it_can_be_recorded() {
        assert_eq!(delivery(&arguments(&[])), FramePolicy::Newest);
        assert_eq!(delivery(&arguments(&["--ros", "--files", "."])), FramePolicy::Every);
    }

    /// Gives an order that notes the next frame and gives another one: there is always one that waits.
    fn ask(orders: &SyncSender<Order>, count: u64, done: Arc<dyn Fn(u64) + Send + Sync>) {
        let again = orders.clone();
        let answer = move |_| {
            done(count);
            if count < 9 {
                ask(&again, count + 1, done);
            }
        };
        orders.send(Order::new("sensor", Action::StopRecording, Box::new(answer))).unwrap();
    }

    #[test]
    fn cameras_are_asked_for_what_is_given() {
        let arguments = arguments(&["--size", "640x360", "--fps", "60", "--format", "YUYV"]);
        let named = arguments.sensors().unwrap().remove(0);
        let frames = Frames::open(&named, &arguments, &[]).unwrap();
        let info = frames.session.info();
        assert_eq!((info.size.width(), info.size.height(), info.rate.per_second()), (640, 360, 60.0));
        assert!(info.format.is_ycbcr());
    }

    #[test]
    fn whoever_asks_without_end_does_not_hold_up_a_sensor() {
        let arguments = arguments(&[]);
        let named = arguments.sensors().unwrap().remove(0);
        let frames = Frames::open(&named, &arguments, &[]).unwrap();
        let (control, _) = Control::new(&named.name, "", &arguments);
        let (queue, _found) = Queue::of_test();
        let counts = Arc::clone(&queue.counts);
        let publisher = PublisherHandle::new(queue, Arc::clone(&control.settings), &arguments);
        let ends = Arc::new(AtomicBool::new(false));
        let (seen, frames_seen) = channel();
        let (orders, arriving) = sync_channel(1);
        let stop = Arc::clone(&ends);
        let done = move |count| {
            seen.send(counts.frames.load(Ordering::Relaxed)).unwrap();
            stop.store(count == 9, Ordering::Relaxed);
        };
        ask(&orders, 0, Arc::new(done));
        assert!(frames.run(publisher, &arriving, 0.0, &ends));
        // One order for each frame.
        assert_eq!(frames_seen.try_iter().collect::<Vec<_>>(), (0..10).collect::<Vec<_>>());
    }
}
