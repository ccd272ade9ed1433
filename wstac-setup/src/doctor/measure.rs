//! Reads a source while nothing touches the sensor: the basis of all numbers.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use wstac_core::params::TAXELS;

use super::pace::Pace;
use super::pixels::{PixelGrid, Pixels};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::Processor;
use wstac_host::source::{Fault, FaultKind, Frame, LossReason, Source, SourceEvent, StreamInfo};

/// Number of frames in which a camera settles after its start; they are not measured.
pub const SETTLING: u32 = 15;
/// Smallest number of frames for a measurement.
const LEAST: usize = 10;

/// One frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Its time in s since the first frame: by the driver's timestamps, else by its number.
    pub at: f64,
    /// Mean of each taxel, in gray levels of 255.
    pub levels: [f64; TAXELS],
    /// `true` if no frame was lost between it and the one before it here.
    pub follows: bool,
}

/// The measurement of a source.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Its frames, at least ten.
    pub moments: Vec<Moment>,
    /// The statistics of single pixels, or `None` if a source has none.
    pub pixels: Option<Pixels>,
    /// The times at which frames came.
    pub pace: Pace,
    /// Frames that were lost, by reason.
    pub lost: BTreeMap<LossReason, u64>,
    /// Feature frame of the first event, counted from the first measured frame: an object touched the sensor.
    pub touched: Option<u64>,
    /// `true` if the trigger's baseline, the first frames, was quiet or is not complete.
    pub quiet: bool,
    /// Full scale of the format, in its own steps.
    pub full_scale: u32,
    /// Frames per second: measured, else as stated.
    pub fps: f64,
    /// Number of camera frames that are added up to one feature frame.
    pub frames_added: u32,
    /// Smallest step of a block's mean in gray levels, if the pictures are JPEG and state it.
    pub dc_step: Option<f64>,
    /// The bytes of the last frame; empty if there are none.
    pub last: Vec<u8>,
}

impl Measured {
    /// Returns the time from the first frame to the last, in s.
    pub fn seconds(&self) -> f64 {
        self.moments.last().map_or(0.0, |moment| moment.at)
    }
}

/// Limits of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Number of first frames that are not measured: [`SETTLING`] for a camera that has just been started, otherwise 0.
    pub settling: u32,
    /// Duration in s, by the driver's timestamps or else by the frame rate.
    pub seconds: f64,
    /// Number of frames, lost ones included, if that limit comes earlier.
    pub frames: Option<u64>,
}

/// A measurement in progress, of a source that somebody else reads.
#[derive(Debug)]
pub struct Measurement {
    info: StreamInfo,
    limit: Limit,
    processor: Processor,
    grid: Option<PixelGrid>,
    measured: Measured,
    /// Frames that are still left out, because the camera settles.
    settling: u32,
    /// Frames so far, lost ones included.
    steps: u64,
    /// The time of the first frame.
    first: Option<Duration>,
    /// Whether the next frame follows one that was measured.
    follows: bool,
    goes_on: bool,
}

impl Measurement {
    /// Starts a measurement of a stream, which `info` describes as the user has it.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other.
    pub fn new(info: &StreamInfo, config: &Config, limit: Limit) -> Result<Self, Error> {
        let processor = Processor::new(info, config, OutputOptions::default())?;
        let grid = if info.taxels_only { None } else { Some(PixelGrid::new(info, processor.geometry().layout())?) };
        let (full_scale, frames_added) = (processor.geometry().full_scale(), info.rate.frames_added());
        let measured = Measured { quiet: true, full_scale, frames_added, ..Measured::default() };
        let (settling, goes_on) = (limit.settling, limit.frames.is_none_or(|most| most > 0));
        let info = info.clone();
        Ok(Self { info, limit, processor, grid, measured, settling, steps: 0, first: None, follows: false, goes_on })
    }

    /// Returns whether more is to be measured.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Returns the measured time so far, in s.
    pub fn seconds(&self) -> f64 {
        self.measured.seconds()
    }

    /// Counts a frame. Returns its time in s: by its timestamp, else by its number.
    fn arrive(&mut self, sequence: Option<u32>, timestamp: Option<Duration>, by_number: f64) -> f64 {
        self.steps += 1;
        self.measured.pace.push(sequence, timestamp);
        let since = |timestamp: Duration| timestamp.saturating_sub(*self.first.get_or_insert(timestamp)).as_secs_f64();
        timestamp.map_or(by_number, since)
    }

    /// Takes the next event of the source. After the limit, or the source's end, it changes nothing.
    ///
    /// # Errors
    /// The source was unplugged or lost its signal.
    pub fn take(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        if !self.goes_on {
            return Ok(());
        }
        // It may come back, but not as a camera that was watched all the time; and it may never.
        if let SourceEvent::Fault(Fault { kind: FaultKind::Disconnected | FaultKind::NoSignal, message, .. }) = event {
            let message = format_args!("broke off while it was measured: {message}");
            return Err(Error::new(ErrorKind::Device, &self.info.about, message));
        }
        if self.settling > 0 && !matches!(event, SourceEvent::End) {
            self.settling -= u32::from(matches!(event, SourceEvent::Frame(_) | SourceEvent::Lost { .. }));
            return Ok(());
        }
        let period = self.period();
        let by_number = self.steps as f64 * period;
        let mut at = by_number;
        match event {
            SourceEvent::End => {
                self.goes_on = false;
                return Ok(());
            }
            SourceEvent::Lost { frames, reason } => {
                let lost = self.measured.lost.entry(reason.clone()).or_default();
                *lost = frames.saturating_add(*lost);
                self.steps = self.steps.saturating_add(*frames);
                self.follows = false;
                // If only damaged frames come, no timestamp ever ends the measurement.
                if self.steps as f64 * period >= 2.0 * self.limit.seconds {
                    self.goes_on = false;
                    return Ok(());
                }
            }
            SourceEvent::Frame(Frame { bytes, timestamp, sequence, encoded, .. }) => {
                at = self.arrive(*sequence, *timestamp, by_number);
                if let Some(grid) = &mut self.grid {
                    grid.push(bytes, self.follows);
                }
                self.measured.last.clear();
                self.measured.last.extend_from_slice(bytes);
                if self.measured.dc_step.is_none() {
                    self.measured.dc_step = encoded.and_then(super::mjpeg::dc_step);
                }
            }
            SourceEvent::Taxels(frame) => at = self.arrive(frame.sequence, frame.timestamp, by_number),
            _ => {}
        }
        let touched = &mut self.measured.touched;
        self.processor.process(event, |output| {
            notice(touched, &output);
            Ok::<(), Error>(())
        })?;
        if matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_)) {
            if let Some(shares) = self.processor.taxels() {
                let levels = shares.map(|share| 255.0 * f64::from(share));
                self.measured.moments.push(Moment { at, levels, follows: self.follows });
                self.follows = true;
            }
            self.goes_on = at < self.limit.seconds;
        }
        self.goes_on = self.goes_on && self.limit.frames.is_none_or(|most| self.steps < most);
        Ok(())
    }

    /// Returns the time from one camera frame to the next in s, as the source states it.
    fn period(&self) -> f64 {
        f64::from(self.info.rate.denominator()) / f64::from(self.info.rate.numerator())
    }

    /// Ends the measurement.
    ///
    /// # Errors
    /// The source delivered fewer than ten frames.
    pub fn finish(self) -> Result<Measured, Error> {
        let about = self.info.about.clone();
        let measured = self.so_far()?;
        let frames = measured.moments.len();
        if frames < LEAST {
            let lost: Vec<_> = measured.lost.iter().map(|(why, frames)| format!(" ({frames} {why})")).collect();
            let message = format!("gave {frames} frames{}, expected at least {LEAST} to measure", lost.concat());
            return Err(Error::new(ErrorKind::Data, about, message));
        }
        Ok(measured)
    }

    /// Ends the measurement, however short it is.
    fn so_far(mut self) -> Result<Measured, Error> {
        let touched = &mut self.measured.touched;
        self.processor.finish(|output| {
            notice(touched, &output);
            Ok::<(), Error>(())
        })?;
        let period = self.period();
        let (pipeline, mut measured) = (self.processor.pipeline(), self.measured);
        measured.quiet = pipeline.baseline().is_none() || pipeline.end().baseline_quiet;
        measured.fps = measured.pace.summary().map_or(1.0 / period, |pace| pace.fps);
        measured.pixels = self.grid.and_then(|grid| grid.summary());
        Ok(measured)
    }
}

/// Reads a source until a limit, its end, or until `stop` holds a signal's number.
///
/// `info` describes the source as the user has it.
///
/// # Errors
/// - Layout, format and configuration do not fit each other.
/// - The source fails, is unplugged, falls silent or loses its signal.
/// - The source delivers fewer than ten frames.
pub fn measure(
    source: &mut dyn Source,
    info: &StreamInfo,
    config: &Config,
    limit: Limit,
    stop: &AtomicUsize,
) -> Result<Measured, Error> {
    let mut measurement = Measurement::new(info, config, limit)?;
    while stop.load(Ordering::Relaxed) == 0 && measurement.goes_on() {
        measurement.take(&source.next_event()?)?;
    }
    if stop.load(Ordering::Relaxed) == 0 { measurement.finish() } else { measurement.so_far() }
}

/// Stores the first frame of the first event, complete or not.
fn notice(touched: &mut Option<u64>, output: &Output) {
    let frame = match output {
        Output::Event(event) => Some(event.frame),
        Output::Interrupted(sample) => Some(sample.frame),
        Output::End(end) => end.incomplete.map(|sample| sample.frame),
        _ => None,
    };
    *touched = touched.or(frame);
}
