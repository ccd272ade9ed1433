//! A handle's inside: a source or frames that are pushed, the core, models, and records that wait to be asked for.

use std::collections::VecDeque;

use super::options::Options;
use super::record::{Given, WstacRecord};
use super::status::{Failure, WstacStatus, failed};
use crate::open_source;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::reading::{Reading, Record, Wanted};
use wstac_host::source::{Source, SourceEvent, StreamInfo, config_of};
use wstac_host::texture::Textures;

/// Model files at a place that does not move, so that a reading may borrow them from beside it.
struct Models(*mut Vec<ModelFile>);

impl Models {
    fn new(files: Vec<ModelFile>) -> Self {
        Self(Box::into_raw(Box::new(files)))
    }

    /// The files.
    ///
    /// # Safety
    /// What is given does not outlive `self`.
    unsafe fn files(&self) -> &'static [ModelFile] {
        // SAFETY: `new` has made it, and only the drop frees it.
        let files: &'static Vec<ModelFile> = unsafe { &*self.0 };
        files
    }
}

impl Drop for Models {
    fn drop(&mut self) {
        // SAFETY: `new` has made it of a box, and nobody borrows it any more (`files`).
        drop(unsafe { Box::from_raw(self.0) });
    }
}

/// Where a stream stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Frames come.
    Running,
    /// The end record waits to be asked for.
    Ending,
    /// The end record is out.
    Ended,
}

/// What a handle is.
pub struct Sensor {
    /// Dropped before the models that it borrows: fields are dropped in order.
    reading: Reading<'static>,
    _models: Models,
    /// Nothing where frames are pushed.
    source: Option<Box<dyn Source>>,
    waiting: VecDeque<Record>,
    /// Why the source cannot be read any further.
    error: Option<Error>,
    phase: Phase,
    /// What the last record points to.
    given: Given,
}

impl Sensor {
    /// Opens a source.
    pub(super) fn open(source: &str, options: Options) -> Result<Self, Failure> {
        let source = open_source(source, &options.open).map_err(|error| failed(WstacStatus::Source, error))?;
        let info = source.info().clone();
        let config = config_of(source.as_ref(), options.config.clone());
        let config = config.map_err(|error| failed(WstacStatus::Config, error))?;
        Self::new(&info, &config, options, Some(source))
    }

    /// A sensor whose frames are pushed.
    pub(super) fn of_frames(info: &StreamInfo, options: Options) -> Result<Self, Failure> {
        options.without_source()?;
        let config = options.config.clone().unwrap_or_default();
        Self::new(info, &config, options, None)
    }

    fn new(
        info: &StreamInfo,
        config: &Config,
        options: Options,
        source: Option<Box<dyn Source>>,
    ) -> Result<Self, Failure> {
        let models = Models::new(options.models);
        // SAFETY: the reading that borrows them is dropped before them.
        let textures = Textures::new(unsafe { models.files() }).map_err(|error| failed(WstacStatus::Model, error))?;
        let wanted = Wanted { features: options.features, samples: true };
        let reading = Reading::new(info, config, wanted).map_err(|error| failed(WstacStatus::Config, error))?;
        Ok(Self {
            reading: reading.with_textures(textures),
            _models: models,
            source,
            waiting: VecDeque::new(),
            error: None,
            phase: Phase::Running,
            given: Given::default(),
        })
    }

    /// The next record; with the end of a source that failed, why.
    pub(super) fn next(&mut self) -> Result<(WstacRecord, Option<Failure>), Failure> {
        loop {
            if let Some(record) = self.waiting.pop_front() {
                let mut error = None;
                if matches!(record, Record::End(_)) {
                    self.phase = Phase::Ended;
                    error = self.error.take().map(|error| failed(WstacStatus::Source, error));
                }
                return Ok((self.given.record(&record), error));
            }
            if self.phase != Phase::Running {
                return Err(failed(WstacStatus::State, "the stream has ended, expected no more calls but wstac_close"));
            }
            let Some(source) = &mut self.source else { return Ok((self.given.waiting(), None)) };
            let waiting = &mut self.waiting;
            let mut give = |record| -> Result<(), Failure> {
                waiting.push_back(record);
                Ok(())
            };
            match source.next_event() {
                Ok(SourceEvent::Waiting) => return Ok((self.given.waiting(), None)),
                Ok(item) => {
                    if !self.reading.take(&item, give)? {
                        self.phase = Phase::Ending;
                    }
                }
                Err(error) => {
                    self.reading.finish(&mut give)?;
                    self.phase = Phase::Ending;
                    self.error = Some(error);
                }
            }
        }
    }

    /// Takes a frame that is pushed.
    pub(super) fn push_frame(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.takes_frames()?;
        let expected = self.reading.camera().frame_bytes();
        if bytes.len() < expected {
            let message = format_args!("frame has {} bytes, expected at least {expected}", bytes.len());
            return Err(failed(WstacStatus::Frame, message));
        }
        self.take(&SourceEvent::Frame { bytes, timestamp: None, sequence: None, encoded: None })
    }

    /// Keeps the place of lost frames.
    pub(super) fn push_lost(&mut self, frames: u64) -> Result<(), Failure> {
        self.takes_frames()?;
        self.take(&SourceEvent::Lost { frames, why: "said to be lost" })
    }

    /// Ends the stream.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        if self.phase != Phase::Running {
            return Err(failed(WstacStatus::State, "the stream has ended already, expected one that has not"));
        }
        self.take(&SourceEvent::End)
    }

    fn take(&mut self, item: &SourceEvent<'_>) -> Result<(), Failure> {
        let waiting = &mut self.waiting;
        let goes_on = self.reading.take(item, |record| -> Result<(), Failure> {
            waiting.push_back(record);
            Ok(())
        })?;
        if !goes_on {
            self.phase = Phase::Ending;
        }
        Ok(())
    }

    fn takes_frames(&self) -> Result<(), Failure> {
        if self.source.is_some() {
            let message = "the handle reads a source, expected one of wstac_open_frames";
            return Err(failed(WstacStatus::State, message));
        }
        if self.phase != Phase::Running {
            return Err(failed(WstacStatus::State, "the stream has ended, expected frames before wstac_finish"));
        }
        Ok(())
    }
}
