//! Reads one sensor: a camera, a file or a scene here, or a board, which finds its events itself.

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
use crate::board::{Board, PortKind};
use crate::note;
use crate::outlet::Outlet;
use crate::ros::picture::Shape;

/// The kinds of sources besides files.
const KINDS: &[&dyn SourceKind] = &[&wstac_linux::source::Cameras, &wstac_scene::source::Scenes];
/// The longest sleep between two looks at the signal.
const NAP: Duration = Duration::from_millis(100);

/// A sensor that is ready for reading.
pub(crate) enum Sensor {
    /// A board, which sends what it finds.
    Board(Box<Board>),
    /// A source of frames.
    Frames(Box<Frames>),
}

impl Sensor {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(name: &str, source: &OsStr, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
        match PortKind::of(source) {
            Some(PortKind::Serial) => {
                Board::open(name, source, arguments.baud).map(|board| Self::Board(Box::new(board)))
            }
            Some(PortKind::Tcp) => Board::open(name, source, None).map(|board| Self::Board(Box::new(board))),
            None => Frames::open(name, source, arguments, models).map(|frames| Self::Frames(Box::new(frames))),
        }
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    pub(crate) fn run(self, outlet: Outlet, ends: &AtomicBool) -> bool {
        match self {
            Self::Board(board) => board.run(&outlet, ends),
            Self::Frames(frames) => frames.run(outlet, ends),
        }
    }
}

/// A source of frames that is ready for reading.
pub(crate) struct Frames {
    name: String,
    session: Session,
    /// `None` for a camera, which has its own.
    pace: Option<Pace>,
    /// The shape of pictures, if they are published.
    picture: Option<Shape>,
}

impl Frames {
    fn open(name: &str, source_name: &OsStr, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
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
        let picture = if arguments.picture { Shape::of(&info) } else { None };
        if arguments.picture && picture.is_none() {
            note(format_args!("{name}: its frames are no pictures of ROS 2; they are not published"));
        }
        Ok(Self { name: name.to_owned(), session: session.build()?, pace, picture })
    }

    fn run(self, outlet: Outlet, ends: &AtomicBool) -> bool {
        let Self { name, mut session, pace, picture } = self;
        let mut reader = Reader { outlet, pace, picture, passed: 0, stamp: SystemTime::now() };
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
    outlet: Outlet,
    pace: Option<Pace>,
    /// The shape of pictures, if they are published.
    picture: Option<Shape>,
    /// The camera frames of the last step.
    passed: u64,
    /// The wall-clock time of the last frame: the driver's, or else when it was read.
    stamp: SystemTime,
}

impl Reader {
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
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
                if let Some(picture) = self.picture {
                    self.outlet.picture(picture, frame.bytes, self.stamp);
                }
            }
            SourceEvent::Taxels(frame) => {
                self.passed += 1;
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
            }
            SourceEvent::Lost { frames, .. } => {
                self.passed += frames;
                self.outlet.counts().lost.fetch_add(*frames, Ordering::Relaxed);
            }
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        self.outlet.output(&output, self.stamp)
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        let is_frame = matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_));
        if let Some(sums) = processor.taxel_sums().filter(|_| is_frame) {
            self.outlet.taxels(&sums, self.stamp);
        }
        true
    }
}
