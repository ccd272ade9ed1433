//! The content of a handle: a session, and the data that its last record points to.

use std::ffi::{CString, OsStr};

use wstac_host::config::Config;
use wstac_host::output::{Output, OutputOptions, ReadoutUsed};
use wstac_host::session::{Poll, Session, SessionBuilder};
use wstac_host::source::{Frame, LossReason, SourceEvent, StreamInfo, config_of};
use wstac_host::texture::Textures;

use crate::options::Options;
use crate::record::{Given, WSTAC_MOST_RECORDS, WstacRecord};
use crate::status::{Failure, WstacStatus, c_string, failed, failed_by};

/// The bytes that may follow a pushed frame besides a row: drivers fill buffers up to a page of memory.
const MOST_PADDING: usize = 4096;

/// The content of a handle.
pub struct SensorSession {
    session: Session,
    /// Whether the program pushes the frames.
    takes_frames: bool,
    given: Given,
    /// One sentence per line, as `wstac_notes` returns them.
    pub(super) notes: CString,
    /// The readout that motion is computed with; NAN if it is unknown.
    pub(super) readout_ms: f64,
}

impl SensorSession {
    pub(super) fn open(source: &OsStr, options: &Options) -> Result<Self, Failure> {
        let source = wstac::open_source(source, &options.open);
        let source = source.map_err(|error| failed_by(WstacStatus::Source, &error))?;
        let config = config_of(source.info(), options.config.clone());
        let config = config.map_err(|error| failed_by(WstacStatus::Config, &error))?;
        let info = source.info().clone();
        Self::new(Session::builder(source), &info, config, options, false)
    }

    /// Creates a sensor whose frames the program pushes.
    pub(super) fn of_frames(info: &StreamInfo, options: &Options) -> Result<Self, Failure> {
        options.without_source()?;
        let config = options.config.clone().unwrap_or_default();
        Self::new(Session::of_frames(info.clone()), info, config, options, true)
    }

    fn new(
        builder: SessionBuilder,
        info: &StreamInfo,
        config: Config,
        options: &Options,
        takes_frames: bool,
    ) -> Result<Self, Failure> {
        let notes = c_string(config.notes(info).collect::<Vec<_>>().join("\n"));
        let readout_ms = ReadoutUsed::of(config.readout(info)).ms().unwrap_or(f64::NAN);
        let textures = Textures::new(&options.models).map_err(|error| failed_by(WstacStatus::Model, &error))?;
        let (features, motion) = (options.features, options.motion);
        let outputs = OutputOptions { features, samples: !options.at_once, motion, ..OutputOptions::default() };
        let builder = if info.is_board { builder } else { builder.config(config) };
        let built = builder.textures(textures).outputs(outputs).build();
        let session = built.map_err(|error| failed_by(WstacStatus::Config, &error))?;
        Ok(Self { session, takes_frames, given: Given::default(), notes, readout_ms })
    }

    /// Returns the next record. If the source failed, the end record comes with the failure.
    pub(super) fn next(&mut self) -> Result<(WstacRecord, Option<Failure>), Failure> {
        let of_source = |error| failed_by(WstacStatus::Source, &error);
        loop {
            match self.session.poll().map_err(of_source)? {
                Poll::Waiting => return Ok((self.given.waiting(), None)),
                Poll::Over => {
                    let message = "the stream has ended; call wstac_close";
                    return Err(failed(WstacStatus::State, message));
                }
                Poll::Output(output) => {
                    // The end is the last output. Only the error of a source that failed can follow it.
                    let is_end = matches!(output, Output::End(_));
                    if let Some(record) = self.given.record(output) {
                        let error = if is_end { self.session.poll().err() } else { None };
                        return Ok((record, error.map(of_source)));
                    }
                }
            }
        }
    }

    pub(super) fn push_frame(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.check_pushing()?;
        let geometry = self.session.processor().geometry();
        let (found, expected) = (bytes.len(), geometry.frame_bytes());
        if found < expected {
            let message = format_args!("frame has {found} bytes, expected at least {expected}");
            return Err(failed(WstacStatus::Frame, message));
        }
        let most = expected.saturating_add(geometry.bytes_per_row()).saturating_add(MOST_PADDING);
        if found > most {
            let message =
                format_args!("frame has {found} bytes, expected {expected} to {most}: is it of another size?");
            return Err(failed(WstacStatus::Frame, message));
        }
        self.session.push(&SourceEvent::Frame(Frame::new(bytes)));
        Ok(())
    }

    /// Counts lost frames, so that later frames keep their place in time.
    pub(super) fn push_lost(&mut self, frames: u64) -> Result<(), Failure> {
        self.check_pushing()?;
        self.session.push(&SourceEvent::Lost { frames, reason: LossReason::Reported });
        Ok(())
    }

    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        if self.session.is_over() {
            return Err(failed(WstacStatus::State, "the stream has ended already; wstac_finish is called once"));
        }
        self.session.push(&SourceEvent::End);
        Ok(())
    }

    /// Returns an error if the handle reads a source, or if the stream has ended.
    fn check_pushing(&self) -> Result<(), Failure> {
        if !self.takes_frames {
            let message = "the handle reads a source; help: wstac_open_frames opens one that takes frames";
            return Err(failed(WstacStatus::State, message));
        }
        if self.session.is_over() {
            return Err(failed(WstacStatus::State, "the stream has ended, expected frames before wstac_finish"));
        }
        if self.session.waiting() >= WSTAC_MOST_RECORDS {
            let message = format_args!("{WSTAC_MOST_RECORDS} records wait, expected wstac_next to take them");
            return Err(failed(WstacStatus::State, message));
        }
        Ok(())
    }
}
