//! A session: a source that is read to its end, as typed outputs, one by one.
//!
//! ```no_run
//! use wstac_host::{output::Output, session::Session};
//!
//! for output in Session::open("slide.mcap")? {
//!     if let Output::Event(event) = output? {
//!         println!("{:?} {:?}", event.speed, event.direction.degrees);
//!     }
//! }
//! # Ok::<(), wstac_host::error::Error>(())
//! ```

mod processor;
mod stream_config;
mod sums;

use std::collections::VecDeque;
use std::ffi::OsStr;

pub use self::processor::{Phase, Processor};
pub use self::stream_config::HostPipeline;
use crate::config::Config;
use crate::error::Error;
use crate::model_file::ModelFile;
use crate::output::{Output, OutputOptions};
use crate::source::open::{OpenOptions, SourceKind, open};
use crate::source::{Lag, Source, SourceEvent, StreamInfo, board_refusal, config_of};
use crate::texture::Textures;
#[cfg(feature = "board")]
use crate::{output::FaultReport, output::Report, source::Fault, source::FaultKind};

/// Reads a source through the core: an iterator of typed outputs.
///
/// Notes of a board's line, such as that the cable is unplugged, are [`Output::Fault`]s.
///
/// It owns its source, configuration and models, and may go to another thread. The last output of a source that does
/// not fail is [`Output::End`]. If the source fails, the outputs up to then and an [`Output::End`] come first, and the
/// error last.
pub struct Session {
    source: Box<dyn Source>,
    processor: Processor,
    /// The outputs that have not been handed out yet.
    queue: Queue,
    /// The source's error, which is handed out after them.
    error: Option<Error>,
    is_over: bool,
    lag: Lag,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("source", &self.source.info().about).finish_non_exhaustive()
    }
}

/// Looks at everything that passes through a session. [`Session::step`] calls it.
pub trait Observer {
    /// The observer's reason to end the session.
    type Error: From<Error>;

    /// Sees an event of the source before the processor takes it.
    ///
    /// # Errors
    /// The observer ends the session.
    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Self::Error> {
        let _ = event;
        Ok(())
    }

    /// Takes an output.
    ///
    /// # Errors
    /// The observer ends the session.
    fn output(&mut self, output: Output) -> Result<(), Self::Error>;

    /// Sees an event of the source after all its outputs. Returns whether the session goes on.
    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        let _ = (event, processor);
        true
    }
}

/// The state of a session after a step.
// It is exhaustive: whoever drives it must handle every case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The session goes on.
    GoesOn,
    /// The session is over: the source has ended, or the observer said so.
    Over,
}

impl Session {
    /// Starts to build a session of a source.
    pub fn builder(source: impl Source + 'static) -> SessionBuilder {
        SessionBuilder {
            source: Box::new(source),
            info: None,
            config: None,
            models: Vec::new(),
            textures: None,
            options: OutputOptions::default(),
            baseline: None,
        }
    }

    /// Starts to build a session of frames that the program pushes.
    ///
    /// [`Session::poll`] returns [`Poll::Waiting`] until there is an output. Iterate only after [`SourceEvent::End`]:
    /// before it, the iterator waits forever.
    ///
    /// ```
    /// use wstac_core::{green::any::PixelFormat, layout::FrameSize, rate::FrameRate};
    /// use wstac_host::output::Output;
    /// use wstac_host::session::Session;
    /// use wstac_host::source::{Frame, SourceEvent, StreamInfo};
    ///
    /// let info = StreamInfo::new("my camera", FrameSize::new(400, 400)?, PixelFormat::Gray, FrameRate::NOMINAL);
    /// let mut session = Session::of_frames(info).build()?;
    /// session.push(&SourceEvent::Frame(Frame::new(&[1; 160_000])));
    /// session.push(&SourceEvent::End);
    /// let outputs = session.collect::<Result<Vec<_>, _>>()?;
    /// assert!(matches!(outputs[..], [Output::End(end)] if end.frames == 1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_frames(info: StreamInfo) -> SessionBuilder {
        Self::builder(Pushed(info))
    }

    /// Opens a file, a folder of pictures, standard input or, with the feature `board`, a board, with the default
    /// options.
    ///
    /// [`open()`] has all options. It also opens cameras and scenes, if the program passes the kinds of `wstac-linux`
    /// and `wstac-scene`.
    ///
    /// # Errors
    /// The source cannot be opened, or its configuration does not fit it.
    pub fn open(name: impl AsRef<OsStr>) -> Result<Self, Error> {
        let kinds: &[&dyn SourceKind] = &[
            #[cfg(feature = "board")]
            &crate::monitor::line::Boards,
        ];
        Self::builder(open(name, &OpenOptions::default(), kinds)?).build()
    }

    /// Returns what all frames of the source have in common.
    pub fn info(&self) -> &StreamInfo {
        self.source.info()
    }

    /// Returns the processor: the taxels of the last frame, the state of the baseline, the pipeline.
    pub fn processor(&self) -> &Processor {
        &self.processor
    }

    /// Returns the processor, to gather a new baseline.
    pub fn processor_mut(&mut self) -> &mut Processor {
        &mut self.processor
    }

    /// Returns how far reading is behind a live source.
    pub fn lag(&self) -> Lag {
        self.lag
    }

    /// Returns whether the session takes no more events. There may still be outputs.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Returns how many outputs wait for [`Session::poll`].
    pub fn waiting(&self) -> usize {
        self.queue.outputs.len()
    }

    /// Takes an event that the program has, as if it came from the source. [`Session::poll`] returns its outputs.
    ///
    /// [`SourceEvent::End`] ends the session before its source ends. A session that is over ignores the event.
    pub fn push(&mut self, event: &SourceEvent<'_>) {
        if self.is_over {
            return;
        }
        let mut queue = std::mem::take(&mut self.queue);
        let goes_on = if matches!(event, SourceEvent::End) {
            self.finish(&mut queue).map(|()| false)
        } else {
            self.processor.process(event, |output| queue.output(output))
        };
        self.is_over = !matches!(goes_on, Ok(true));
        (self.queue, self.error) = (queue, goes_on.err());
    }

    /// Takes the next event of the source: hands it to `observer`, then every output that follows from it.
    ///
    /// # Errors
    /// The source fails or the observer returns an error. If the source fails, the observer first gets an
    /// [`Output::End`].
    pub fn step<O: Observer>(&mut self, observer: &mut O) -> Result<Step, O::Error> {
        if self.is_over {
            return Ok(Step::Over);
        }
        match self.source.next_event() {
            Ok(event) => {
                if let SourceEvent::Frame(frame) = &event {
                    self.lag = frame.lag;
                }
                observer.source_event(&event)?;
                let goes_on = self.processor.process(&event, |output| observer.output(output))?;
                let goes_on = observer.processed(&event, &self.processor) && goes_on;
                self.is_over = !goes_on;
                Ok(if goes_on { Step::GoesOn } else { Step::Over })
            }
            Err(error) => {
                // The source's error is the one that matters, even if the end fails, too.
                let _ = self.finish(observer);
                Err(error.into())
            }
        }
    }

    /// Ends the session before its source ends: hands what was pending and the summary to `observer`.
    ///
    /// # Errors
    /// The observer returns an error.
    pub fn finish<O: Observer>(&mut self, observer: &mut O) -> Result<(), O::Error> {
        if !self.is_over && self.source.stop() {
            while self.step(observer)? == Step::GoesOn {}
        }
        if std::mem::replace(&mut self.is_over, true) {
            return Ok(());
        }
        observer.source_event(&SourceEvent::End)?;
        self.processor.finish(|output| observer.output(output))?;
        observer.processed(&SourceEvent::End, &self.processor);
        Ok(())
    }

    /// Returns the next output if there is one, without waiting for a live source longer than a second.
    ///
    /// # Errors
    /// The source has failed. The error comes after all outputs.
    pub fn poll(&mut self) -> Result<Poll, Error> {
        loop {
            if let Some(output) = self.queue.outputs.pop_front() {
                return Ok(Poll::Output(output));
            }
            if let Some(error) = self.error.take() {
                return Err(error);
            }
            if self.is_over {
                return Ok(Poll::Over);
            }
            let mut queue = std::mem::take(&mut self.queue);
            self.error = self.step(&mut queue).err();
            self.queue = queue;
            if self.queue.was_waiting && self.queue.outputs.is_empty() {
                return Ok(Poll::Waiting);
            }
        }
    }
}

/// A source without frames: the program pushes them.
struct Pushed(StreamInfo);

impl Source for Pushed {
    fn info(&self) -> &StreamInfo {
        &self.0
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        Ok(SourceEvent::Waiting)
    }
}

/// The result of [`Session::poll`].
// It is exhaustive: whoever drives it must handle every case.
#[derive(Clone, Debug, PartialEq)]
pub enum Poll {
    /// An output.
    Output(Output),
    /// There is no output yet: a live source has no frame.
    Waiting,
    /// The session is over.
    Over,
}

/// Keeps the outputs of a step.
#[derive(Default)]
struct Queue {
    outputs: VecDeque<Output>,
    /// Whether the step read nothing that must have outputs.
    was_waiting: bool,
    /// The frames of a board so far.
    #[cfg(feature = "board")]
    frames: u64,
}

impl Observer for Queue {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        self.was_waiting = matches!(event, SourceEvent::Waiting);
        #[cfg(feature = "board")]
        if let SourceEvent::Report(report) = event {
            self.was_waiting = true;
            // Whoever iterates has no other way to hear of them.
            if let Report::Progress(stream) = report {
                self.frames = stream.frames;
            }
            self.outputs.extend(report.message().map(|message| {
                let fault = Fault::new(FaultKind::Board, message);
                Output::Fault(FaultReport { frame: self.frames, time_ns: None, stamp: None, fault })
            }));
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        self.outputs.push_back(output);
        Ok(())
    }
}

impl Iterator for Session {
    type Item = Result<Output, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.poll() {
                Ok(Poll::Output(output)) => return Some(Ok(output)),
                Ok(Poll::Waiting) => {}
                Ok(Poll::Over) => return None,
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

/// Builds a [`Session`]; [`Session::builder`] makes one.
#[must_use]
pub struct SessionBuilder {
    source: Box<dyn Source>,
    info: Option<StreamInfo>,
    config: Option<Config>,
    models: Vec<ModelFile>,
    textures: Option<Textures>,
    options: OutputOptions,
    baseline: Option<(Box<dyn Source>, f64)>,
}

impl SessionBuilder {
    /// Sets the configuration. Without it, the configuration is the one in a recording, or else the default.
    pub fn config(self, config: Config) -> Self {
        Self { config: Some(config), ..self }
    }

    /// Names textures with these models, each of another task.
    pub fn models(self, models: impl IntoIterator<Item = ModelFile>) -> Self {
        Self { models: models.into_iter().collect(), ..self }
    }

    /// Names textures with models that are shared with other sessions.
    pub fn textures(self, textures: Textures) -> Self {
        Self { textures: Some(textures), ..self }
    }

    /// Sets what the session gives besides events.
    pub fn outputs(self, options: OutputOptions) -> Self {
        Self { options, ..self }
    }

    /// Takes the baseline from the frames of another opening of the source, from this time on, in seconds from its
    /// first frame. Without it, the first frames of the source are the baseline.
    pub fn baseline_from(self, source: impl Source + 'static, seconds: f64) -> Self {
        Self { baseline: Some((Box::new(source), seconds)), ..self }
    }

    /// Replaces what the source says about its frames, such as their YCbCr encoding.
    pub fn info(self, info: StreamInfo) -> Self {
        Self { info: Some(info), ..self }
    }

    /// Builds the session.
    ///
    /// # Errors
    /// The source's own configuration or a model cannot be used, layout, format and configuration do not fit each
    /// other, or a board is given more than outputs.
    pub fn build(self) -> Result<Session, Error> {
        let Self { mut source, info, config, models, textures, options, baseline } = self;
        source.request(options);
        let info = info.as_ref().unwrap_or_else(|| source.info());
        let config = config_of(info, config)?;
        let textures = textures.map_or_else(|| Textures::new(&models), Ok)?;
        if info.is_board && (!textures.names().is_empty() || baseline.is_some()) {
            return Err(board_refusal(info));
        }
        let mut processor = Processor::new(info, &config, options)?.with_textures(textures);
        if let Some((mut source, seconds)) = baseline {
            processor.gather_baseline(&mut source, seconds)?;
        }
        let (queue, lag) = (Queue::default(), Lag::default());
        Ok(Session { source, processor, queue, error: None, is_over: false, lag })
    }
}
