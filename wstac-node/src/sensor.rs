//! Reads one sensor.

use std::ffi::OsStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, SystemTime};

use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::{Observer, Processor, Session, Step};
use wstac_host::source::open::{OpenOptions, SourceKind, open};
use wstac_host::source::pace::Pace;
use wstac_host::source::{FramePolicy, SourceEvent};
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

use crate::arguments::Arguments;
use crate::message::Message;
use crate::note;
use crate::publisher::{Found, Queue};
use crate::ros::messages::{Header, RosMessage};

/// The kinds of sources besides files.
const KINDS: &[&dyn SourceKind] = &[&wstac_linux::source::Cameras, &wstac_scene::source::Scenes];
/// The longest sleep between two looks at the signal.
const NAP: Duration = Duration::from_millis(100);

/// A sensor that is ready for reading.
pub(crate) struct Sensor {
    name: String,
    session: Session,
    /// `None` for a camera, which has its own.
    pace: Option<Pace>,
    has_records: bool,
    /// The coordinate frame, if nodes of ROS 2 are told.
    frame_id: Option<String>,
}

impl Sensor {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(
        name: &str,
        source_name: &OsStr,
        arguments: &Arguments,
        models: &[ModelFile],
    ) -> Result<Self, Error> {
        let options = OpenOptions { delivery: FramePolicy::Newest, ..OpenOptions::default() };
        let source = open(source_name, &options, KINDS)?;
        let info = source.info().clone();
        let mut wanted = OutputOptions::default();
        (wanted.features, wanted.motion) = (true, true);
        let mut session = Session::builder(source).outputs(wanted).textures(Textures::new(models)?);
        if let Some(config) = &arguments.config {
            session = session.config(Config::read(config)?);
        }
        let pace = (!is_camera(source_name)).then(|| Pace::new(info.rate));
        note(format_args!("{name}: {}", info.about));
        let frame_id = arguments.ros.then(|| format!("{name}_frame"));
        let has_records = arguments.has_records();
        Ok(Self { name: name.to_owned(), session: session.build()?, pace, has_records, frame_id })
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    pub(crate) fn run(self, queue: Queue, ends: &AtomicBool) -> bool {
        let Self { name, mut session, pace, has_records, frame_id } = self;
        let mut reader = Reader { queue, pace, passed: 0, stamp: SystemTime::now(), has_records, frame_id };
        if let Some(pace) = &mut reader.pace {
            pace.restart();
        }
        let read = loop {
            if ends.load(Ordering::Relaxed) {
                break session.finish(&mut reader);
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
        read.is_ok()
    }
}

/// Hands everything over that a session finds.
struct Reader {
    queue: Queue,
    pace: Option<Pace>,
    /// The camera frames of the last step.
    passed: u64,
    /// The wall-clock time of the last frame: the driver's, or else when it was read.
    stamp: SystemTime,
    has_records: bool,
    /// The coordinate frame, if nodes of ROS 2 are told.
    frame_id: Option<String>,
}

impl Reader {
    /// Returns the header of messages of ROS 2, if there are any.
    fn ros_header(&self) -> Option<Header<'_>> {
        self.frame_id.as_deref().map(|frame_id| Header { stamp: self.stamp, frame_id })
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
        match event {
            SourceEvent::Frame(frame) => {
                self.passed += 1;
                self.stamp = frame.stamp.unwrap_or_else(SystemTime::now);
            }
            SourceEvent::Taxels(_) => {
                self.passed += 1;
                self.stamp = SystemTime::now();
            }
            SourceEvent::Lost { frames, .. } => {
                self.passed += frames;
                self.queue.counts.lost.fetch_add(*frames, Ordering::Relaxed);
            }
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        if let Output::Features(features) = &output {
            self.queue.counts.frames.store(features.frame + 1, Ordering::Relaxed);
        }
        if let Output::Event(_) = &output {
            self.queue.counts.events.fetch_add(1, Ordering::Relaxed);
        }
        let record = if self.has_records { Message::of(&output)? } else { None };
        let ros = self.ros_header().and_then(|header| RosMessage::of(&output, header));
        self.queue.push(Found::new(record, ros));
        Ok(())
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        let is_frame = matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_));
        if let Some(sums) = processor.taxel_sums().filter(|_| is_frame) {
            let frame = self.queue.counts.frames.load(Ordering::Relaxed).saturating_sub(1);
            let record = self.has_records.then(|| Message::of_taxels(frame, &sums));
            let ros = self.ros_header().map(|header| RosMessage::of_taxels(frame, &sums, header));
            self.queue.push(Found::new(record, ros));
        }
        true
    }
}
