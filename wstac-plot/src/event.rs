//! An event, and the data of its time span.

use std::collections::VecDeque;

use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::speed::{LitSpan, ThresholdOn};
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::rate::FrameRate;

use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::real;
use wstac_host::output::{Output, TactileEvent};
use wstac_host::plural::counted;
use wstac_host::session::Processor;
use wstac_host::source::{Source, SourceEvent, StreamInfo};

/// Number of feature frames whose taxels are stored: a sample, and those of the longest gap after it.
const KEPT: usize = 2 * SAMPLE_FRAMES;
/// Fraction of full scale from which a taxel is saturated, or nearly.
const SATURATED: f32 = 0.98;

/// An event and the data for its figure.
#[derive(Clone, Debug)]
pub struct Found {
    /// The event's record, including the sample.
    pub(super) record: TactileEvent,
    /// The description of the source.
    pub(super) about: String,
    /// The number of the event in the source, from 1.
    pub(super) number: u64,
    /// Ten features over the sample, in units of a natural logarithm.
    pub(super) features: [[f64; SAMPLE_FRAMES]; FEATURES],
    /// Mean of each feature in the baseline.
    pub(super) baseline: [f64; FEATURES],
    /// Mean feature of a window above which the trigger fires.
    pub(super) thresholds: [f64; FEATURES],
    /// Light of each taxel in the sample's frames, as a fraction of full scale; `None` for lost frames.
    pub(super) taxels: Vec<Option<[f32; TAXELS]>>,
    /// The window that fired: its first frame in the sample, and its length.
    pub(super) window: [u8; 2],
    /// First and last lit frame.
    pub(super) lit: Option<LitSpan>,
    /// Length of a feature frame in s.
    pub(super) frame_s: f64,
    /// Number of frames at the nominal 30 per second in a feature frame.
    pub(super) nominal_frames: f64,
    /// `true` if the speed is that of a law of durations.
    pub(super) is_of_durations: bool,
    /// Distance between neighboring whiskers in mm.
    pub(super) pitch_mm: f64,
    /// Threshold above which a row or column is lit, and whether it applies above the baseline.
    pub(super) lit_threshold: (f64, ThresholdOn),
}

impl Found {
    /// Returns the number of taxels that come near full scale.
    pub(super) fn saturated(&self) -> usize {
        let most = |taxel: usize| self.taxels.iter().flatten().map(|taxels| taxels[taxel]).fold(0.0, f32::max);
        (0..TAXELS).filter(|taxel| most(*taxel) >= SATURATED).count()
    }
}

/// Taxels of the last feature frames: the frame's number, their sum over its camera frames, and the number of those.
#[derive(Default)]
struct Recent(VecDeque<(u64, [f32; TAXELS], u16)>);

impl Recent {
    fn add(&mut self, frame: u64, taxels: &[f32; TAXELS]) {
        if let Some((_, sums, count)) = self.0.back_mut().filter(|(last, ..)| *last == frame) {
            sums.iter_mut().zip(taxels).for_each(|(sum, taxel)| *sum += taxel);
            *count += 1;
            return;
        }
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back((frame, *taxels, 1));
    }

    /// Returns the taxels of a frame, if any part of it arrived.
    fn of(&self, frame: u64) -> Option<[f32; TAXELS]> {
        let (_, sums, count) = self.0.iter().find(|(own, ..)| *own == frame)?;
        Some(sums.map(|sum| sum / f32::from(*count)))
    }
}

/// Reads a source up to its event number `number`, counted from 1; `processor` gives samples.
///
/// # Errors
/// The source fails, or it has fewer events; the message names their number.
pub fn find(
    source: &mut dyn Source,
    info: &StreamInfo,
    processor: &mut Processor,
    config: &Config,
    number: u64,
) -> Result<Found, Error> {
    let (mut recent, mut seen) = (Recent::default(), 0);
    loop {
        let item = source.next_event()?;
        let frame = processor.pipeline().next_frame();
        let has_light = matches!(item, SourceEvent::Frame(_) | SourceEvent::Taxels(_));
        let mut events = Vec::new();
        let goes_on = processor.process(&item, |output| {
            if let Output::Event(event) = output {
                events.push(*event);
            }
            Ok::<(), Error>(())
        })?;
        if let Some(taxels) = processor.taxels().filter(|_| has_light) {
            recent.add(frame, &taxels);
        }
        for event in events {
            seen += 1;
            if seen == number {
                let found = gathered(event, seen, info, processor, config, &recent);
                return found
                    .ok_or_else(|| Error::new(ErrorKind::Data, &info.about, "the event has no sample to draw"));
            }
        }
        if !goes_on {
            let found = counted(seen, "event");
            let expected = if number == 1 { "at least one".to_owned() } else { format!("number {number}") };
            return Err(Error::new(ErrorKind::Data, &info.about, format_args!("has {found}, expected {expected}")));
        }
    }
}

fn gathered(
    record: TactileEvent,
    number: u64,
    info: &StreamInfo,
    processor: &Processor,
    config: &Config,
    recent: &Recent,
) -> Option<Found> {
    let frames = record.sample.as_deref()?;
    let mut features = [[0.0; SAMPLE_FRAMES]; FEATURES];
    for (frame, numbers) in frames.iter().enumerate() {
        for (feature, number) in features.iter_mut().zip(numbers) {
            feature[frame] = real(*number);
        }
    }
    let pipeline = processor.pipeline();
    let (baseline, thresholds) = (pipeline.baseline()?, pipeline.thresholds()?);
    let window = pipeline.trigger_config().window();
    let first = record.frame;
    Some(Found {
        lit: lit(&record),
        about: info.about.clone(),
        number,
        features,
        baseline: means(baseline),
        thresholds: thresholds.map(|sum| f64::from(sum) / f64::from(FEATURE_ONE) / f64::from(window)),
        taxels: (0..SAMPLE_FRAMES as u64).map(|frame| recent.of(first.saturating_add(frame))).collect(),
        window: [pipeline.trigger_config().backtrack(), window],
        frame_s: frame_s(info.rate),
        nominal_frames: f64::from(info.rate.nominal_frames()),
        is_of_durations: config.speed.law().is_some(),
        pitch_mm: f64::from(config.sensor.pitch_mm),
        lit_threshold: (config.speed.threshold, config.speed.threshold_on),
        record,
    })
}

/// Returns the first and last lit frame of the sample: of the touch, if the sample shows both, or above the threshold
/// of a law of durations.
fn lit(record: &TactileEvent) -> Option<LitSpan> {
    let Some(touch) = record.touch_frame else { return record.lit_span };
    let first = u8::try_from(touch.saturating_sub(record.frame)).ok()?;
    Some(LitSpan::new(first, first.saturating_add(record.lit_frames?)))
}

fn means(baseline: &Baseline) -> [f64; FEATURES] {
    baseline.totals().map(|total| f64::from(total) / f64::from(FEATURE_ONE) / f64::from(baseline.frames().max(1)))
}

fn frame_s(rate: FrameRate) -> f64 {
    f64::from(rate.frames_added()) * f64::from(rate.denominator()) / f64::from(rate.numerator())
}
