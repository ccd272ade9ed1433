//! A station: a session that takes orders while it is read, such as a recording, a new baseline or a pause.
//!
//! ```no_run
//! use wstac_host::error::Error;
//! use wstac_host::output::{Output, OutputOptions};
//! use wstac_host::session::Observer;
//! use wstac_host::source::open::{OpenOptions, open};
//! use wstac_host::source::{Labels, config_of};
//! use wstac_host::station::{Station, Turn};
//! use wstac_host::record::first_free_file;
//! use wstac_host::texture::Textures;
//!
//! struct Print;
//!
//! impl Observer for Print {
//!     type Error = Error;
//!
//!     fn output(&mut self, output: Output) -> Result<(), Error> {
//!         println!("{output:?}");
//!         Ok(())
//!     }
//! }
//!
//! let source = open("slide.y4m", &OpenOptions::default(), &[])?;
//! let (info, config) = (source.info().clone(), config_of(source.info(), None)?);
//! let mut station = Station::new(source, info, config, Textures::default(), OutputOptions::default())?.paced();
//! station.record(|| first_free_file(|number| format!("slide-{number}.mcap").into()), Labels::new(), false)?;
//! while station.advance(&mut Print)? != Turn::Over {}
//! println!("{}", station.take_recorded().expect("the end of the source ends the recording")?);
//! # Ok::<(), Error>(())
//! ```

use std::fs::File;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use crate::config::Config;
use crate::error::Error;
use crate::output::{Elapsed, Output, OutputOptions};
use crate::record::about::About;
use crate::record::{Excerpt, FinishedRecording, check_room};
use crate::session::{Observer, Processor, Session, Step};
use crate::source::pace::Pace;
use crate::source::{Labels, Source, SourceEvent, StreamInfo, board_refusal};
use crate::texture::Textures;

/// The longest sleep of [`Station::advance`], so that orders and the end are not held up.
const NAP: Duration = Duration::from_millis(50);

/// Opens a source again, from its first frame on.
pub type Reopen = dyn Fn() -> Result<(Box<dyn Source>, StreamInfo), Error> + Send;

/// A session that takes orders while it is read.
///
/// Orders are methods. Between them, [`advance`](Self::advance) reads the source and hands everything to an observer.
pub struct Station {
    session: Session,
    /// The frames as the user has them; the session's source may say something else about their color.
    info: StreamInfo,
    config: Config,
    textures: Textures,
    options: OutputOptions,
    is_paced: bool,
    /// The pace of a file, from its first frame on.
    pace: Option<Pace>,
    reopen: Option<Box<Reopen>>,
    /// Whether the source starts again at its end.
    pub repeats: bool,
    /// Whether the source is paused.
    pub is_paused: bool,
    /// The frame up to which the source is read as fast as possible.
    target: Option<u64>,
    starts: u64,
    recording: Option<Excerpt>,
    recorded: Option<Result<FinishedRecording, Error>>,
    /// Outputs of orders, for the next turn.
    waiting: Vec<Output>,
    /// The time up to the last restart of the processor, from which the times of outputs count. Those of observers go
    /// on.
    elapsed: Elapsed,
}

impl std::fmt::Debug for Station {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Station").field("session", &self.session).finish_non_exhaustive()
    }
}

/// The outcome of [`Station::advance`].
// It is exhaustive: whoever drives it must handle every case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// It has read an event of the source.
    Read,
    /// It has waited: it is paused, or the next frame of a file is not due yet.
    Waited,
    /// The source has ended.
    Over,
}

impl Station {
    /// Creates a station. `info` describes the frames of the source, as the user has them.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other.
    pub fn new(
        source: Box<dyn Source>,
        info: StreamInfo,
        config: Config,
        textures: Textures,
        options: OutputOptions,
    ) -> Result<Self, Error> {
        Ok(Self {
            session: session(source, &info, &config, &textures, options)?,
            info,
            config,
            textures,
            options,
            is_paced: false,
            pace: None,
            reopen: None,
            repeats: false,
            is_paused: false,
            target: None,
            starts: 0,
            recording: None,
            recorded: None,
            waiting: Vec::new(),
            elapsed: Elapsed::default(),
        })
    }

    /// Reads the source at the rate of its frames. A camera has its own pace.
    #[must_use]
    pub fn paced(self) -> Self {
        Self { is_paced: true, ..self }
    }

    /// Allows to pause the source and to go back in it: `reopen` opens it again. If it `repeats`, it starts again at
    /// its end.
    #[must_use]
    pub fn reopened_by(self, reopen: Box<Reopen>, repeats: bool) -> Self {
        Self { reopen: Some(reopen), repeats, ..self }
    }

    /// Returns what all frames have in common.
    pub fn info(&self) -> &StreamInfo {
        &self.info
    }

    /// Returns the configuration in use.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Returns the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the processor of the session.
    pub fn processor(&self) -> &Processor {
        self.session.processor()
    }

    /// Returns whether the source has ended or failed.
    pub fn is_over(&self) -> bool {
        self.session.is_over()
    }

    /// Returns the recording in progress.
    pub fn recording(&self) -> Option<&Excerpt> {
        self.recording.as_ref()
    }

    /// Returns whether the source can be paused and opened again.
    pub fn can_reopen(&self) -> bool {
        self.reopen.is_some()
    }

    /// Returns the frame that the source is on its way to, after [`go`](Self::go).
    pub fn target(&self) -> Option<u64> {
        self.target
    }

    /// Returns how often the source has started again.
    pub fn starts(&self) -> u64 {
        self.starts
    }

    /// Does what is next: hands the outputs of orders to the observer, waits for at most 50 ms, or reads an event of
    /// the source. The end of the source ends a recording.
    ///
    /// # Errors
    /// The source fails, it cannot be opened again, or the observer returns an error. The session is over then.
    pub fn advance<O: Observer>(&mut self, observer: &mut O) -> Result<Turn, O::Error> {
        let turn = self.turn(observer);
        if turn.is_err() {
            // The first error is the one that matters.
            let _ = self.finish(observer);
        }
        turn
    }

    fn turn<O: Observer>(&mut self, observer: &mut O) -> Result<Turn, O::Error> {
        self.deliver(observer)?;
        let wait = if self.is_over() { NAP } else { self.wait() };
        if !wait.is_zero() {
            thread::sleep(wait.min(NAP));
            return Ok(if self.is_over() { Turn::Over } else { Turn::Waited });
        }
        let (session, mut between) = self.between(observer);
        let step = session.step(&mut between)?;
        let passed = between.passed;
        if step == Step::Over {
            // A source without frames would start again for ever.
            if !self.repeats || self.processor().pipeline().next_frame() == 0 {
                self.target = None;
                return Ok(Turn::Over);
            }
            self.start_again()?;
            return Ok(Turn::Read);
        }
        let frame = self.processor().pipeline().next_frame();
        if let Some(pace) = &mut self.pace {
            pace.advance(passed);
            if self.target.is_some() {
                pace.restart();
            }
        }
        self.target = self.target.filter(|target| frame < *target);
        Ok(Turn::Read)
    }

    /// Ends the session before its source ends. A recording is complete then.
    ///
    /// # Errors
    /// The observer returns an error.
    pub fn finish<O: Observer>(&mut self, observer: &mut O) -> Result<(), O::Error> {
        self.target = None;
        self.deliver(observer)?;
        let (session, mut between) = self.between(observer);
        session.finish(&mut between)
    }

    /// Hands the outputs of orders to the observer, without a turn.
    ///
    /// # Errors
    /// The observer returns an error.
    pub fn deliver<O: Observer>(&mut self, observer: &mut O) -> Result<(), O::Error> {
        self.waiting.drain(..).try_for_each(|output| observer.output(output))
    }

    /// Returns how long to wait until the next frame.
    fn wait(&mut self) -> Duration {
        if self.target.is_some() {
            return Duration::ZERO;
        }
        if self.is_paused {
            return NAP;
        }
        let rate = self.info.rate;
        let pace = self.is_paced.then(|| self.pace.get_or_insert_with(|| Pace::new(rate)).wait());
        pace.unwrap_or_default()
    }

    fn between<'s, O>(&'s mut self, observer: &'s mut O) -> (&'s mut Session, Between<'s, O>) {
        let Self { session, recording, recorded, elapsed, .. } = self;
        (session, Between { observer, recording, recorded, elapsed, passed: 0 })
    }

    /// Gathers a new baseline from the next frame on. A recording in progress would not know of it.
    pub fn rezero(&mut self) {
        let ended = self.session.processor_mut().rezero();
        self.wait_with(ended);
    }

    /// Uses another configuration from the next frame on, with a new baseline. The numbers and times of frames go on.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other. Nothing has changed then.
    pub fn reconfigure(&mut self, config: Config) -> Result<(), Error> {
        if self.info.is_board {
            return Err(board_refusal(&self.info));
        }
        let ended = self.session.processor_mut().reconfigure(&self.info, &config)?;
        self.config = config;
        self.restarted(ended);
        Ok(())
    }

    /// Replaces the texture models.
    pub fn set_textures(&mut self, textures: Textures) {
        self.session.processor_mut().set_textures(textures.clone());
        self.textures = textures;
    }

    /// Starts a recording with the next frame, and with a new baseline, in the new file that `create` gives. If
    /// `features_only` is set, it has taxel sums and no pictures.
    ///
    /// # Errors
    /// The file cannot be created, or the disk is full. Nothing has changed then.
    pub fn record(
        &mut self,
        create: impl FnOnce() -> Result<(File, PathBuf), Error>,
        labels: Labels,
        features_only: bool,
    ) -> Result<(), Error> {
        if self.info.is_board {
            return Err(board_refusal(&self.info));
        }
        let mut kept = self.info.clone();
        if features_only {
            (kept.taxels_only, kept.crop) = (true, None);
        }
        let about = About::new(&kept, &self.config, labels, self.textures.names().to_vec())?;
        let (file, path) = create()?;
        check_room(&file, &path, &kept)?;
        let recording = Excerpt::start(file, &path, &about, self.processor())?;
        // The replay begins with a new baseline, too. The sample that this ends is not part of it.
        let ended = self.session.processor_mut().restart();
        self.restarted(ended);
        self.recording = Some(recording);
        Ok(())
    }

    /// Ends the recording in progress.
    ///
    /// # Errors
    /// The file could not be written, or not all of it.
    pub fn end_recording(&mut self) -> Result<Option<FinishedRecording>, Error> {
        self.recording.take().map(Excerpt::finish).transpose()
    }

    /// Returns the result of a recording that has ended without an order: the source has ended, or the disk is full.
    pub fn take_recorded(&mut self) -> Option<Result<FinishedRecording, Error>> {
        self.recorded.take()
    }

    /// Goes so many frames forward or back, as fast as possible. Returns whether there is a way: there is none forward
    /// at the end, and none back if the source cannot be opened again.
    ///
    /// # Errors
    /// The source cannot be opened again.
    pub fn go(&mut self, frames: i64) -> Result<bool, Error> {
        let now = self.processor().pipeline().next_frame();
        let target = self.target.unwrap_or(now).saturating_add_signed(frames).max(1);
        if target < now {
            if self.reopen.is_none() {
                return Ok(false);
            }
            self.start_again()?;
        } else if self.is_over() {
            return Ok(false);
        }
        self.target = Some(target);
        Ok(true)
    }

    /// Starts again from the first frame, unless the source cannot be opened again.
    ///
    /// # Errors
    /// It cannot be opened now.
    pub fn start_again(&mut self) -> Result<(), Error> {
        let Some(reopen) = &self.reopen else { return Ok(()) };
        let (source, info) = reopen()?;
        self.session = session(source, &info, &self.config, &self.textures, self.options)?;
        (self.pace, self.target, self.elapsed) = (None, None, Elapsed::default());
        self.starts += 1;
        self.waiting.clear();
        Ok(())
    }

    /// Takes what an order has ended. Its times are those before a restart.
    fn wait_with(&mut self, ended: Vec<Output>) {
        self.waiting.extend(ended.into_iter().map(|output| output.after(self.elapsed)));
    }

    /// Goes on behind a restart of the processor, which ended this.
    fn restarted(&mut self, ended: Vec<Output>) {
        self.wait_with(ended);
        self.elapsed = self.processor().elapsed();
    }
}

fn session(
    source: Box<dyn Source>,
    info: &StreamInfo,
    config: &Config,
    textures: &Textures,
    options: OutputOptions,
) -> Result<Session, Error> {
    let mut builder = Session::builder(source).info(info.clone());
    if !info.is_board {
        builder = builder.config(config.clone());
    }
    builder.textures(textures.clone()).outputs(options).build()
}

/// Stands between a session and an observer: records, and counts times on.
struct Between<'s, O> {
    observer: &'s mut O,
    recording: &'s mut Option<Excerpt>,
    recorded: &'s mut Option<Result<FinishedRecording, Error>>,
    elapsed: &'s mut Elapsed,
    /// The camera frames of the event.
    passed: u64,
}

impl<O: Observer> Observer for Between<'_, O> {
    type Error = O::Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), O::Error> {
        if let Some(recording) = self.recording {
            recording.source_event(event);
        }
        self.passed = match event {
            SourceEvent::Frame(_) | SourceEvent::Taxels(_) => 1,
            SourceEvent::Lost { frames, .. } => *frames,
            _ => 0,
        };
        self.observer.source_event(event)
    }

    fn output(&mut self, output: Output) -> Result<(), O::Error> {
        if let Some(recording) = self.recording {
            recording.output(&output);
        }
        self.observer.output(output.after(*self.elapsed))
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        // By a driver's clock it is known from the first frame on.
        *self.elapsed = processor.elapsed();
        let ends = |recording: &mut Excerpt| {
            let has_room = recording.processed(event, processor);
            !has_room || matches!(event, SourceEvent::End)
        };
        if let Some(ended) = self.recording.take_if(ends) {
            *self.recorded = Some(ended.finish());
        }
        self.observer.processed(event, processor)
    }
}
