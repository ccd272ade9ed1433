//! The core set up for one stream. It takes source events and gives typed outputs.

use std::collections::VecDeque;

use wstac_core::green::any::Any;
use wstac_core::law::{Answer, AnyLaw, EventLaw};
use wstac_core::paper::trigger::{ContactEnd, Event, InterruptedSample};
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::pipeline::Update;
use wstac_core::reason::Reason;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::at_once::{AtOnce, answer};
use wstac_core::touch::motion::{LiveWave, MotionConfig};
use wstac_core::touch::slip::SlipDetector;

use super::stream_config::HostPipeline;
use super::sums::FrameSums;
use crate::config::Config;
use crate::error::{Error, ErrorKind};
use crate::frame_clock::FrameClock;
#[cfg(feature = "board")]
use crate::output::Report;
use crate::output::{
    Answering, ContactEndReport, EarlyTexture, Elapsed, FaultReport, FrameFeatures, InterruptedReport, LostFrames,
    MotionReport, Output, OutputOptions, ReadoutUsed, RecordTimes, SlipReport, StreamSummary, TactileEvent,
};
#[cfg(feature = "board")]
use crate::source::board_refusal;
use crate::source::{FaultKind, LossCounts, LossReason, Source, SourceEvent, StreamInfo};
use crate::texture::Textures;

/// Turns source events into typed outputs.
///
/// A [`Session`](super::Session) owns one. A program that reads the source itself, to record or to show its frames,
/// owns one directly.
#[derive(Debug)]
pub struct Processor {
    pipeline: HostPipeline,
    /// Taxel sums of the last frame.
    taxels: Option<[u32; TAXELS]>,
    /// Taxel sums of the feature frame under way, if features were asked for.
    sums: FrameSums,
    answers: Answers,
    readout: ReadoutUsed,
    /// Follows motion, if it was asked for.
    live: Option<LiveWave>,
    dropped: u64,
    dropped_by: LossCounts,
    /// Whether lost JPEG pictures are such frames. A camera reports its own.
    is_of_camera: bool,
    baseline_reported: bool,
    /// The first feature frame of the baseline.
    zero: u64,
}

/// The state of a stream's trigger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The baseline is gathered.
    Baseline {
        /// Feature frames so far.
        frames: u64,
        /// All feature frames of the baseline.
        of: u64,
    },
    /// The trigger waits for a touch.
    Watching,
    /// A sample is captured.
    Capturing {
        /// Frames of the sample so far.
        frames: u8,
    },
}

/// Most parts of a stream that are kept. Those that are closest to each other in the past count as one.
const MOST_PARTS: usize = 16;

/// The largest deviation of a speed, as a part of it, that is reliable although the file leaves out frames of the
/// sample: such a frame repeats the one before it, which moves the speed by up to two deviations.
const MOST_SD_OF_GAPS: f32 = 0.01;

/// Parts of a stream: the first frame of each and the one behind it, which is `u64::MAX` while it lasts.
#[derive(Clone, Debug, Default)]
struct Parts(VecDeque<(u64, u64)>);

impl Parts {
    fn begin(&mut self, frame: u64) {
        if self.0.back().is_some_and(|(_, end)| *end == u64::MAX) {
            return;
        }
        self.0.push_back((frame, u64::MAX));
        if self.0.len() > MOST_PARTS
            && let Some((start, _)) = self.0.pop_front()
            && let Some(first) = self.0.front_mut()
        {
            first.0 = start;
        }
    }

    fn end(&mut self, frame: u64) {
        if let Some((_, end)) = self.0.back_mut() {
            *end = frame.min(*end);
        }
    }

    /// Returns whether a sample that begins at this frame has a frame of them.
    fn touch(&self, frame: u64) -> bool {
        let behind = frame.saturating_add(SAMPLE_FRAMES as u64);
        self.0.iter().any(|(start, end)| *start < behind && frame < *end)
    }
}

/// The largest error of a speed by frames that were not in their places, as a part of it, that is reliable.
const MOST_OFF: f32 = 0.03;
/// Frames of which it is known how far they were from their places: those of a sample and of as many before it.
const PLACED: usize = 2 * SAMPLE_FRAMES;

/// How far the newest frames were from their places, by the times of a file, in steps between feature frames.
#[derive(Clone, Debug, Default)]
struct Places(VecDeque<(u64, f32)>);

impl Places {
    /// Takes a camera frame of a feature frame.
    fn arrive(&mut self, frame: u64, off: f32) {
        match self.0.back_mut() {
            Some((last, most)) if *last == frame => *most = most.max(off.abs()),
            _ if off != 0.0 => {
                self.0.push_back((frame, off.abs()));
                if self.0.len() > PLACED {
                    self.0.pop_front();
                }
            }
            _ => {}
        }
    }

    /// Returns whether a speed within the sample that begins at this frame may be off by too much.
    fn doubt(&self, frame: u64, mm_s: f32, motion: MotionConfig) -> bool {
        let frames = frame..frame.saturating_add(SAMPLE_FRAMES as u64);
        let most = self.0.iter().filter(|(at, _)| frames.contains(at)).map(|(_, off)| *off).fold(0.0, f32::max);
        // An edge crosses the sensor in four pitches' frames.
        most * mm_s > MOST_OFF * 4.0 * motion.pitch_per_frame()
    }
}

/// The frames of which events are doubted.
#[derive(Clone, Debug, Default)]
struct Doubts {
    uneven: Parts,
    /// The frames of a camera that is faster than agreed on.
    fast: Parts,
    /// The frames that a file leaves out, or that cannot be decoded.
    missing: Parts,
    places: Places,
}

impl Doubts {
    /// Returns an event with its doubt, if there is one.
    fn of(&self, event: TactileEvent, motion: MotionConfig) -> TactileEvent {
        let by_arrival = event.speed.ok().and_then(|speed| Some((speed.mm_s, speed.sd?)));
        if self.uneven.touch(event.frame)
            || by_arrival.is_some_and(|(mm_s, _)| self.places.doubt(event.frame, mm_s, motion))
        {
            event.mistimed(Reason::Uneven)
        } else if self.fast.touch(event.frame) {
            event.mistimed(Reason::FasterCamera)
        } else if by_arrival.is_some_and(|(mm_s, sd)| sd > MOST_SD_OF_GAPS * mm_s) && self.missing.touch(event.frame) {
            event.missing()
        } else {
            event
        }
    }
}

impl Processor {
    /// Creates a processor for frames as `info` describes them.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other.
    pub fn new(info: &StreamInfo, config: &Config, options: OutputOptions) -> Result<Self, Error> {
        Self::starting_at(info, config, options, 0)
    }

    /// Creates a processor whose feature frames are counted from `first` on.
    fn starting_at(info: &StreamInfo, config: &Config, options: OutputOptions, first: u64) -> Result<Self, Error> {
        let in_table = |error| config.does_not_fit(&info.about, "[speed]", error);
        let mut pipeline = config.pipeline_at(info, first)?;
        let motion = config.motion_of(info)?;
        let law = config.law_of(info)?;
        if options.paths || law.takes_taxels() {
            pipeline.keep_taxels();
        }
        let context = Answering {
            durations: config.durations(info.rate).map_err(in_table)?,
            textures: Textures::default(),
            motion,
            scale: config.scale_of(pipeline.geometry(), &info.about)?,
            clock: FrameClock::new(info.rate, info.clock),
            options,
        };
        let slip = law.takes_taxels().then(|| SlipDetector::new(info.rate));
        let (doubts, at_once, outputs) = (Doubts::default(), AtOnce::new(motion), Vec::new());
        Ok(Self {
            pipeline,
            taxels: None,
            sums: FrameSums::new(info.rate),
            answers: Answers { context, law, doubts, at_once, slip, outputs },
            readout: ReadoutUsed::of(config.readout(info)),
            live: options.motion.then(|| LiveWave::new(motion)),
            dropped: 0,
            dropped_by: LossCounts::default(),
            is_of_camera: info.camera.is_some(),
            baseline_reported: false,
            zero: first,
        })
    }

    /// Adds texture models.
    #[must_use]
    pub fn with_textures(mut self, textures: Textures) -> Self {
        self.set_textures(textures);
        self
    }

    /// Replaces the texture models. The next events have the answers of the new ones.
    ///
    /// Models of 25 taxels answer for events that begin after it.
    pub fn set_textures(&mut self, textures: Textures) {
        let Answers { context: Answering { textures: own, options, .. }, law, .. } = &mut self.answers;
        if textures.needs_taxels() && !(options.paths || law.takes_taxels() || own.needs_taxels()) {
            self.pipeline.keep_taxels();
        }
        *own = textures;
    }

    /// Takes an event of the source and hands every output that follows from it to `emit`.
    ///
    /// It returns whether the stream goes on.
    ///
    /// # Errors
    /// `emit` returns an error.
    pub fn process<E>(
        &mut self,
        event: &SourceEvent<'_>,
        emit: impl FnMut(Output) -> Result<(), E>,
    ) -> Result<bool, E> {
        let frame = self.pipeline.next_frame();
        match event {
            SourceEvent::Waiting => {}
            #[cfg(feature = "board")]
            SourceEvent::Report(report) => {
                let Report::Output(output) = report else { return Ok(true) };
                let mut emit = emit;
                return emit(output.clone()).map(|()| !matches!(output, Output::End(_)));
            }
            SourceEvent::Fault(fault) => {
                let Doubts { uneven, fast, .. } = &mut self.answers.doubts;
                match fault.kind {
                    FaultKind::Uneven => uneven.begin(frame),
                    FaultKind::Even => uneven.end(frame),
                    FaultKind::Fast => fast.begin(frame),
                    FaultKind::InTime | FaultKind::Rate | FaultKind::Slow => fast.end(frame),
                    _ => {}
                }
                let RecordTimes { time_ns, stamp, .. } = self.answers.times(frame);
                self.answers.outputs.push(Output::Fault(FaultReport { frame, time_ns, stamp, fault: fault.clone() }));
            }
            SourceEvent::End => {
                self.finish(emit)?;
                return Ok(false);
            }
            SourceEvent::Taxels(taken) => {
                self.answers.context.clock.frame_arrives(frame, taken.timestamp, taken.stamp);
                let is_answered = self.answers.take(&self.pipeline.push_taxels(&taken.sums));
                self.arrive(Some(taken.sums), is_answered);
            }
            SourceEvent::Lost { frames, reason } => {
                if matches!(reason, LossReason::Missing | LossReason::MissingByTimes | LossReason::CorruptPicture)
                    || (reason.is_of_jpeg() && !self.is_of_camera)
                {
                    let added = u64::from(self.geometry().rate().frames_added());
                    self.answers.doubts.missing.begin(frame);
                    self.answers.doubts.missing.end(frame.saturating_add(frames.div_ceil(added)));
                }
                let lost = LostFrames { frame, frames: *frames, reason: reason.clone() };
                self.answers.outputs.push(Output::Lost(lost));
                self.lose(*frames, reason);
            }
            SourceEvent::Frame(taken) => {
                let added = self.geometry().rate().frames_added();
                self.answers.doubts.places.arrive(frame, taken.off / added as f32);
                self.answers.context.clock.frame_arrives(frame, taken.timestamp, taken.stamp);
                if let Ok(update) = self.pipeline.push_frame(taken.bytes) {
                    let is_answered = self.answers.take(&update);
                    self.arrive(self.pipeline.taxels(), is_answered);
                } else {
                    // The frame has too few bytes. Nothing of it was taken, but its time has passed.
                    self.lose(1, &LossReason::Short);
                }
            }
        }
        let motion = self.motion();
        self.answers.outputs.extend(motion.map(Output::Motion));
        if self.baseline_disturbed() {
            self.answers.outputs.push(Output::BaselineDisturbed { frame: self.pipeline.next_frame() });
        }
        self.answers.outputs.drain(..).try_for_each(emit)?;
        Ok(true)
    }

    /// Takes the taxel sums of a frame that was pushed, if it was not lost.
    fn arrive(&mut self, taxels: Option<[u32; TAXELS]>, is_answered: bool) {
        self.taxels = taxels;
        if self.answers.context.options.features {
            if let Some(sums) = &taxels {
                self.sums.add(sums);
            }
            let mut outputs = self.answers.outputs.iter_mut();
            let features =
                outputs.find_map(|of| if let Output::Features(features) = of { Some(features) } else { None });
            if let Some(features) = features {
                features.sums = self.sums.complete();
            }
        }
        if is_answered {
            self.pipeline.answer_touch();
        }
    }

    fn lose(&mut self, frames: u64, reason: &LossReason) {
        let is_answered = self.answers.take(&self.pipeline.push_lost(frames));
        self.arrive(None, is_answered);
        self.dropped = self.dropped.saturating_add(frames);
        self.dropped_by.add(frames, reason);
    }

    /// Ends the stream: emits what was pending, then the summary.
    ///
    /// # Errors
    /// `emit` returns an error.
    pub fn finish<E>(&mut self, emit: impl FnMut(Output) -> Result<(), E>) -> Result<(), E> {
        let (answers, finished) = (&mut self.answers, self.pipeline.finish());
        // The end of a stream completes a sample only with lost frames.
        if let Some(event) = finished.event().and_then(|event| answers.whole(&event)) {
            answers.add(event);
        }
        let ends = answers.at_once.finish(finished.contact_end()).into_iter().flatten();
        let ends: Vec<_> = ends.map(|end| answers.contact_end(end)).collect();
        let sample = finished.interrupted().map(|sample| answers.interrupted(sample));
        answers.outputs.extend(ends.into_iter().chain(sample));
        let (dropped_by, readout) = (self.dropped_by, self.readout);
        let summary = StreamSummary { dropped_by, readout, ..StreamSummary::new(finished.end(), self.dropped) };
        answers.outputs.push(Output::End(summary.by_clock(&answers.context.clock)));
        answers.outputs.drain(..).try_for_each(emit)
    }

    /// Returns the 25 taxels of the last frame, row by row, each as a fraction of full scale from 0 to 1.
    ///
    /// It is `None` before the first frame and after a lost one.
    pub fn taxels(&self) -> Option<[f32; TAXELS]> {
        let geometry = self.geometry();
        let full = geometry.pixels() as f32 * geometry.full_scale() as f32;
        self.taxels.map(|sums| sums.map(|sum| sum as f32 / full))
    }

    /// Returns the 25 taxel sums of the last frame, row by row.
    ///
    /// It is `None` before the first frame and after a lost one.
    pub fn taxel_sums(&self) -> Option<[u32; TAXELS]> {
        self.taxels
    }

    /// Returns the geometry of the frames: layout, pixels per taxel, full scale, rate.
    pub fn geometry(&self) -> &FrameGeometry<Any> {
        self.pipeline.geometry()
    }

    /// Returns the pipeline: the trigger's parameters, the baseline, the thresholds and the number of the next frame.
    pub fn pipeline(&self) -> &HostPipeline {
        &self.pipeline
    }

    /// Returns the state of the trigger.
    pub fn phase(&self) -> Phase {
        match (self.pipeline.baseline(), self.pipeline.captured_frames()) {
            (None, _) => {
                let of = u64::from(self.pipeline.trigger_config().baseline_frames());
                Phase::Baseline { frames: self.pipeline.next_frame().saturating_sub(self.zero).min(of), of }
            }
            (_, Some(frames)) => Phase::Capturing { frames },
            _ => Phase::Watching,
        }
    }

    /// Returns the mean of a window above which each feature fires, in natural logarithms; `None` before the baseline.
    pub fn thresholds(&self) -> Option<[f32; FEATURES]> {
        let window = f32::from(self.pipeline.trigger_config().window());
        let real = |sum: i32| sum as f32 / FEATURE_ONE as f32 / window;
        self.pipeline.thresholds().map(|thresholds| thresholds.map(real))
    }

    /// Returns the time of a feature frame in seconds from the first frame of the stream. Before the first frame and of
    /// frames to come, the frame rate gives it.
    pub fn seconds(&self, frame: u64) -> f64 {
        self.answers.context.clock.seconds(frame)
    }

    /// Returns the time from the stream's first frame to the frame of the last [`restart`](Self::restart), from which
    /// times count. [`Output::after`] counts them from the first frame again.
    ///
    /// By a driver's clock it is known from the first frame after the restart on; until then it is 0.
    pub fn elapsed(&self) -> Elapsed {
        self.answers.context.clock.elapsed()
    }

    /// Returns the time of a feature frame in nanoseconds on the clock of the stream, as records have it; `None` before
    /// the first frame.
    pub fn nanoseconds(&self, frame: u64) -> Option<u64> {
        self.answers.context.clock.nanoseconds(frame)
    }

    /// Gathers the baseline from the frames of a source from a time on, in seconds from its first frame. The next frame
    /// is frame 0 then.
    ///
    /// It is for a file that is touched in its first frames: `source` is the same file, opened once more.
    ///
    /// # Errors
    /// The source fails, ends before the baseline is complete, or reports that frames of the baseline are damaged or
    /// come unevenly.
    pub fn gather_baseline(&mut self, source: &mut dyn Source, from_s: f64) -> Result<(), Error> {
        let skipped = (from_s.max(0.0) * source.info().rate.per_second()).round() as u64;
        let (mut frame, mut is_doubted) = (0_u64, false);
        while self.pipeline.baseline().is_none() {
            let is_skipped = frame < skipped;
            match source.next_event()? {
                SourceEvent::Frame(_) | SourceEvent::Taxels(_) if is_skipped => {}
                SourceEvent::Frame(_) | SourceEvent::Taxels(_) if is_doubted => {
                    let message = format_args!(
                        "frames of the baseline from {from_s} s on are damaged or come unevenly; help: choose another \
                         --baseline-at"
                    );
                    return Err(Error::new(ErrorKind::Usage, &source.info().about, message));
                }
                SourceEvent::Frame(taken) if self.pipeline.push_frame(taken.bytes).is_ok() => {}
                SourceEvent::Frame(_) => {
                    self.pipeline.push_lost(1);
                }
                SourceEvent::Taxels(taken) => {
                    self.pipeline.push_taxels(&taken.sums);
                }
                SourceEvent::Lost { frames, .. } => {
                    frame = frame.saturating_add(frames);
                    if !is_skipped {
                        self.pipeline.push_lost(frames);
                    }
                    continue;
                }
                SourceEvent::Fault(fault) => {
                    is_doubted = (is_doubted || fault.kind == FaultKind::Uneven) && fault.kind != FaultKind::Even;
                    continue;
                }
                #[cfg(feature = "board")]
                SourceEvent::Report(_) => return Err(board_refusal(source.info())),
                SourceEvent::Waiting => continue,
                SourceEvent::End => {
                    let message = format_args!("ends before the baseline from {from_s} s on is complete");
                    return Err(Error::new(ErrorKind::Usage, &source.info().about, message));
                }
            }
            frame += 1;
        }
        self.pipeline.rewind();
        Ok(())
    }

    /// Gathers a new baseline from the next frame on. Returns what that ends: the end of a touch of which more light
    /// might have come, and the sample that was being captured.
    #[must_use = "the end of a touch is among it"]
    pub fn rezero(&mut self) -> Vec<Output> {
        let sample = self.pipeline.rezero();
        self.zero = self.pipeline.next_frame();
        self.forget_motion(sample)
    }

    /// Takes the next camera frame as the first of a stream, with a new baseline and without a part of a feature frame.
    ///
    /// The outputs that follow are those of a recording of the frames from here on, apart from the numbers of the
    /// frames. Returns what that ends, as [`rezero`](Self::rezero) does.
    #[must_use = "the end of a touch is among it"]
    pub fn restart(&mut self) -> Vec<Output> {
        self.sums.restart();
        let sample = self.pipeline.restart();
        self.zero = self.pipeline.next_frame();
        let ended = self.forget_motion(sample);
        self.answers.context.clock.restart(self.zero);
        ended
    }

    /// Replaces the configuration of the stream that `info` describes, and restarts as [`restart`](Self::restart) does.
    /// The numbers of frames go on.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other. Nothing has changed then.
    pub fn reconfigure(&mut self, info: &StreamInfo, config: &Config) -> Result<Vec<Output>, Error> {
        let next = self.pipeline.next_frame();
        let Answering { options, textures, .. } = &self.answers.context;
        let new = Self::starting_at(info, config, *options, next)?.with_textures(textures.clone());
        let ended = self.restart();
        let Self { answers, dropped, dropped_by, .. } = std::mem::replace(self, new);
        (self.answers.context.clock, self.answers.doubts) = (answers.context.clock, answers.doubts);
        (self.dropped, self.dropped_by) = (dropped, dropped_by);
        Ok(ended)
    }

    /// Goes on with a new baseline, which ended this sample.
    fn forget_motion(&mut self, sample: Option<InterruptedSample>) -> Vec<Output> {
        self.baseline_reported = false;
        if let Some(live) = &mut self.live {
            live.reset();
        }
        let rate = self.pipeline.geometry().rate();
        self.answers.slip = self.answers.slip.map(|_| SlipDetector::new(rate));
        self.answers.interrupt(sample).collect()
    }

    /// Returns the motion in the newest frame, if it was asked for and something slides.
    fn motion(&mut self) -> Option<MotionReport> {
        let (live, baseline) = (self.live.as_mut()?, self.pipeline.baseline()?);
        let (next_frame, recent) = self.pipeline.recent();
        let taxels = self.pipeline.taxel_ring().filter(|_| self.answers.law.takes_taxels());
        let touch = live.push(next_frame, recent, baseline, taxels)?;
        let (velocity, first) = (touch.velocity?, next_frame.saturating_sub(SAMPLE_FRAMES as u64));
        let Answers { doubts, context, .. } = &self.answers;
        if doubts.places.doubt(first, velocity.mm_s, context.motion) {
            return None;
        }
        let frame = next_frame.saturating_sub(1);
        Some(MotionReport::new(frame, velocity, touch.basis, Some(&context.clock)))
    }

    /// Returns `true` once when the baseline turns out not to be quiet.
    fn baseline_disturbed(&mut self) -> bool {
        if self.baseline_reported || self.pipeline.baseline().is_none() {
            return false;
        }
        self.baseline_reported = true;
        !self.pipeline.end().baseline_quiet
    }
}

/// Turns updates into outputs.
#[derive(Debug)]
struct Answers {
    context: Answering,
    law: AnyLaw,
    doubts: Doubts,
    at_once: AtOnce,
    /// Watches held parts, if the law takes taxels.
    slip: Option<SlipDetector>,
    /// The outputs of the source's event so far.
    outputs: Vec<Output>,
}

impl Answers {
    fn event(&self, event: &Event<'_>, answer: Answer) -> TactileEvent {
        self.doubts.of(TactileEvent::new(event, answer, &self.context), self.context.motion)
    }

    /// Returns whether all events have their whole samples, and so are those of a data set.
    fn waits(&self) -> bool {
        let Answering { options, textures, .. } = &self.context;
        options.samples || options.paths || !textures.answer_at_once()
    }

    /// Returns the answer about a touch, if it is time.
    fn answer(&mut self, touch: &Event<'_>) -> Option<Answer> {
        answer(touch, &self.law, Some(&mut self.at_once), self.slip.as_ref(), |answer| *answer)
    }

    /// Returns the event of a whole sample, if it is one of its own.
    fn whole(&mut self, event: &Event<'_>) -> Option<Output> {
        let answer = self.answer(event)?;
        Some(Output::Event(Box::new(self.event(event, answer))))
    }

    /// Returns the event of a touch under way, as soon as its motion is certain and its models have their path.
    fn at_once(&mut self, touch: &Event<'_>) -> Option<Output> {
        let first = touch.touch_frame.unwrap_or(touch.frame);
        if self.waits() || !self.context.clock.is_in_time(first, touch.last_frame()) {
            return None;
        }
        let answer = self.answer(touch)?;
        if touch.is_under_way() && self.context.textures.lack_path(touch, &answer, self.context.motion) {
            return None;
        }
        // The whole sample decides about a doubt.
        Some(self.event(touch, answer)).filter(|event| event.reliable).map(|event| Output::Event(Box::new(event)))
    }

    fn times(&self, frame: u64) -> RecordTimes {
        RecordTimes::new(frame, Some(&self.context.clock))
    }

    /// Forgets the touches so far. Returns the end of one of which more light might have come, and the sample.
    fn interrupt(&mut self, sample: Option<InterruptedSample>) -> impl Iterator<Item = Output> + use<> {
        let end = self.at_once.restart().map(|end| self.contact_end(end));
        end.into_iter().chain(sample.map(|sample| self.interrupted(sample)))
    }

    fn interrupted(&self, sample: InterruptedSample) -> Output {
        Output::Interrupted(InterruptedReport::new(sample, Some(&self.context.clock)))
    }

    /// Adds an event, behind the end of a touch before it that was not certain.
    fn add(&mut self, event: Output) {
        let end = self.at_once.last_end().map(|end| self.contact_end(end));
        self.outputs.extend(end.into_iter().chain([event]));
    }

    fn contact_end(&self, end: ContactEnd) -> Output {
        Output::ContactEnd(ContactEndReport::new(end, Some(&self.context.clock)))
    }

    /// Takes what an update brought. Returns whether it answered the touch under way.
    fn take(&mut self, update: &Update<'_>) -> bool {
        if let Some(frame) = update.frame().filter(|_| self.context.options.features) {
            let (frame, features, sums) = (frame.number, frame.features, None);
            let RecordTimes { time_ns, stamp, .. } = self.times(frame);
            self.outputs.push(Output::Features(FrameFeatures { frame, time_ns, stamp, features, sums }));
        }
        let slip = self.slip.as_mut().and_then(|slip| slip.push(update));
        self.outputs.extend(slip.map(|slip| Output::Slip(SlipReport::new(slip, Some(&self.context.clock)))));
        if let Some(sample) = update.interrupted() {
            let ended = self.interrupt(Some(sample));
            self.outputs.extend(ended);
        }
        if let Some(event) = update.event().and_then(|event| self.whole(&event)) {
            self.add(event);
        }
        let end = self.at_once.end(update).map(|end| self.contact_end(end));
        self.outputs.extend(end);
        if let Some(output) = update.touch().and_then(|touch| self.at_once(&touch)) {
            self.add(output);
            return true;
        }
        for (frame, frames, texture) in self.context.textures.of_prefixes(update) {
            let RecordTimes { time_ns, stamp, .. } = self.times(frame);
            self.outputs.push(Output::EarlyTexture(EarlyTexture { frame, time_ns, stamp, frames, texture }));
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uneven_parts_are_kept_from_their_first_frame_to_that_behind_them() {
        let sample = SAMPLE_FRAMES as u64;
        let mut uneven = Parts::default();
        uneven.end(5);
        assert!(!uneven.touch(0));
        uneven.begin(100);
        // A sample ends at the first frame of the part, or before it.
        assert!(uneven.touch(101 - sample) && !uneven.touch(100 - sample));
        assert!(uneven.touch(u64::MAX - 1));
        // The part goes on, and ends once.
        uneven.begin(150);
        uneven.end(200);
        uneven.end(300);
        assert!(uneven.touch(199) && !uneven.touch(200));
        // Another part at the frame where the last one ended.
        uneven.begin(200);
        assert!(uneven.touch(200));
    }

    #[test]
    fn frames_off_their_places_are_a_doubt_of_fast_slides() {
        let motion = MotionConfig::published(wstac_core::rate::FrameRate::NOMINAL);
        let mut places = Places::default();
        let doubts = |places: &Places, frame| {
            [10.0, 50.0, 100.0, 300.0].map(|mm_s| places.doubt(frame, mm_s, motion)).iter().filter(|is| **is).count()
        };
        for frame in 0..100 {
            places.arrive(frame, 0.0);
        }
        assert_eq!(doubts(&places, 0), 0);
        // Half a millisecond of 33, as whole milliseconds have, and an eighth and a quarter of a frame.
        for (off, expected) in [(0.015, 0), (0.125, 1), (-0.25, 2), (0.4, 3)] {
            places.arrive(200, off);
            assert_eq!(doubts(&places, 200), expected, "{off}");
            assert_eq!((doubts(&places, 130), doubts(&places, 131), doubts(&places, 201)), (0, expected, 0));
            places = Places::default();
        }
        // Two camera frames of one feature frame, and more than are kept.
        for off in [0.01, 0.4, 0.01] {
            places.arrive(7, off);
        }
        assert_eq!(doubts(&places, 0), 3);
        for frame in 8..400 {
            places.arrive(frame, 0.001);
        }
        assert_eq!((doubts(&places, 0), places.0.len()), (0, PLACED));
    }

    #[test]
    fn of_many_uneven_parts_the_first_ones_count_as_one() {
        let mut uneven = Parts::default();
        let parts = (0..20).map(|part| 1000 * part);
        for start in parts.clone() {
            uneven.begin(start);
            uneven.end(start + 10);
        }
        assert_eq!(uneven.0.len(), MOST_PARTS);
        assert!(parts.clone().all(|start| uneven.touch(start + 9)));
        // Between the first five parts nothing is reliable; between the others, all is.
        let between: Vec<_> = parts.map(|start| uneven.touch(start + 500)).collect();
        assert_eq!(between, [[true; 4].as_slice(), &[false; 16]].concat());
    }
}
