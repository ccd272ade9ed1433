//! Reads a source while nothing touches the sensor: the basis of all numbers.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

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
#[derive(Clone, Debug)]
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
    let mut processor = Processor::new(info, config, OutputOptions::default())?;
    let mut grid = if info.taxels_only { None } else { Some(PixelGrid::new(info, processor.geometry().layout())?) };
    let mut settling = limit.settling;
    let mut measured = Measured {
        moments: Vec::new(),
        pixels: None,
        pace: Pace::default(),
        lost: BTreeMap::new(),
        touched: None,
        quiet: true,
        full_scale: processor.geometry().full_scale(),
        fps: 0.0,
        frames_added: info.rate.frames_added(),
        dc_step: None,
    };
    let period = f64::from(info.rate.denominator()) / f64::from(info.rate.numerator());
    let (mut steps, mut first, mut follows) = (0_u64, None, false);
    while stop.load(Ordering::Relaxed) == 0 && limit.frames.is_none_or(|most| steps < most) {
        let item = source.next_event()?;
        // It may come back, but not as a camera that was watched all the time; and it may never.
        if let SourceEvent::Fault(Fault { kind: FaultKind::Disconnected | FaultKind::NoSignal, message, .. }) = &item {
            return Err(Error::new(
                ErrorKind::Device,
                &info.about,
                format_args!("broke off while it was measured: {message}"),
            ));
        }
        if settling > 0 && !matches!(item, SourceEvent::End) {
            settling -= u32::from(matches!(item, SourceEvent::Frame(_) | SourceEvent::Lost { .. }));
            continue;
        }
        let by_number = steps as f64 * period;
        let mut at = by_number;
        match &item {
            SourceEvent::End => break,
            SourceEvent::Lost { frames, reason } => {
                let lost = measured.lost.entry(reason.clone()).or_default();
                *lost = frames.saturating_add(*lost);
                steps = steps.saturating_add(*frames);
                follows = false;
                // If only damaged frames come, no timestamp ever ends the measurement.
                if steps as f64 * period >= 2.0 * limit.seconds {
                    break;
                }
            }
            SourceEvent::Frame(Frame { bytes, timestamp, sequence, encoded, .. }) => {
                steps += 1;
                if let Some(timestamp) = *timestamp {
                    at = timestamp.saturating_sub(*first.get_or_insert(timestamp)).as_secs_f64();
                }
                measured.pace.push(*sequence, *timestamp);
                if let Some(grid) = &mut grid {
                    grid.push(bytes, follows);
                }
                if measured.dc_step.is_none() {
                    measured.dc_step = encoded.and_then(super::mjpeg::dc_step);
                }
            }
            SourceEvent::Taxels(frame) => {
                steps += 1;
                if let Some(timestamp) = frame.timestamp {
                    at = timestamp.saturating_sub(*first.get_or_insert(timestamp)).as_secs_f64();
                }
                measured.pace.push(frame.sequence, frame.timestamp);
            }
            _ => {}
        }
        let touched = &mut measured.touched;
        processor.process(&item, |output| {
            notice(touched, &output);
            Ok::<(), Error>(())
        })?;
        if matches!(item, SourceEvent::Frame(_) | SourceEvent::Taxels(_)) {
            if let Some(shares) = processor.taxels() {
                let levels = shares.map(|share| 255.0 * f64::from(share));
                measured.moments.push(Moment { at, levels, follows });
                follows = true;
            }
            if at >= limit.seconds {
                break;
            }
        }
    }
    processor.finish(|output| {
        notice(&mut measured.touched, &output);
        Ok::<(), Error>(())
    })?;
    let pipeline = processor.pipeline();
    measured.quiet = pipeline.baseline().is_none() || pipeline.end().baseline_quiet;
    measured.fps = measured.pace.summary().map_or(1.0 / period, |pace| pace.fps);
    measured.pixels = grid.and_then(|grid| grid.summary());
    let frames = measured.moments.len();
    if frames < LEAST && stop.load(Ordering::Relaxed) == 0 {
        let lost: Vec<_> = measured.lost.iter().map(|(why, frames)| format!(" ({frames} {why})")).collect();
        let message = format!("gave {frames} frames{}, expected at least {LEAST} to measure", lost.concat());
        return Err(Error::new(ErrorKind::Data, &info.about, message));
    }
    Ok(measured)
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
