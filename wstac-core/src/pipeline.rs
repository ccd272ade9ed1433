//! The pipeline from a camera's bytes to events. Only this module knows its order: bytes, taxel sums, features,
//! trigger.

use core::marker::PhantomData;

use crate::error::{ConfigError, FrameError};
use crate::features::{Features, Floor};
use crate::green::{GreenChannel, gray::Gray};
use crate::ln::{Ln, fixed::Fixed};
use crate::paper::baseline::Baseline;
use crate::paper::baseline_policy::{BaselinePolicy, FixedBaseline};
use crate::paper::early::{self, SamplePrefix};
use crate::paper::sample::Sample;
use crate::paper::trigger::{ContactEnd, Event, InterruptedSample, StreamEnd, Trigger, TriggerConfig, TriggerState};
use crate::params::{DEFAULT_FLOOR_LEVELS, FEATURES, TAXELS};
use crate::stream::{FeatureFrame, FeatureStream, Loss};
use crate::taxels::{FrameGeometry, TaxelSums};
use crate::touch::crosstalk::Correction;
use crate::touch::taxel_ring::{ChosenTaxels, NoTaxels, TaxelRing, TaxelStore};

/// Turns frames, stripes of frames, taxel sums and lost frames into features, events and early samples.
///
/// Everything is checked when the pipeline is built.
///
/// Every push returns an [`Update`] with whatever the frame brought.
///
/// ```
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{paper::direction, paper::speed::{self, SpeedConfig}, taxels::FrameGeometry};
///
/// let layout = Layout::paper(FrameSize::new(400, 400)?)?;
/// let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?;
/// let mut pipeline = Pipeline::builder(geometry).build()?;
/// let speed_config = SpeedConfig::published(FrameRate::NOMINAL);
/// # let frames = (0..120).map(|t| vec![if t == 40 { 200 } else { 3_u8 }; 160_000]);
/// # let mut events = 0;
/// for frame in frames {
///     let update = pipeline.push_frame(&frame)?;
///     if let Some(event) = update.event() {
///         let speed = speed::speed(&event, &speed_config);
///         let direction = direction::direction(&event);
///         // …
/// #       events += 1;
/// #       assert_eq!((event.frame, event.reliable), (30, true));
///     }
/// }
/// # assert_eq!(events, 1);
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pipeline<G: GreenChannel = Gray, L = Fixed, B = FixedBaseline, T = NoTaxels> {
    stream: FeatureStream<G, L>,
    trigger: Trigger<B>,
    taxels: T,
}

/// The most bytes that a default pipeline may take, ring included.
const MOST_BYTES: usize = 2200;
const _: () = assert!(size_of::<Pipeline>() < MOST_BYTES);

/// Holds whatever one push brought. Most pushes bring only features. A stripe that does not complete its frame brings
/// nothing.
///
/// It is a view of the pipeline. Events, samples and prefixes are borrowed until the next push. Parts that are not
/// asked for cost nothing.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    completed: Option<Completed<'a>>,
}

/// The results of one feature frame.
#[derive(Clone, Copy, Debug)]
struct Completed<'a> {
    trigger: &'a TriggerState,
    taxels: Option<&'a TaxelRing>,
    /// Number of the feature frame.
    number: u64,
    /// First frame of the sample that was completed.
    event: Option<u64>,
    /// Frames of the sample under way that had arrived before this frame: 0..=68.
    before: u8,
}

impl<'a> Update<'a> {
    const NOTHING: Self = Self { completed: None };

    /// Returns the feature frame that was completed. A push completes at most one: lost frames have no feature frame of
    /// their own.
    pub fn frame(&self) -> Option<CompletedFrame> {
        let Completed { trigger, number, .. } = self.completed?;
        let (features, has_missing_frames) = trigger.newest()?;
        Some(CompletedFrame { number, features: *features, has_missing_frames })
    }

    /// Returns the event that was completed.
    pub fn event(&self) -> Option<Event<'a>> {
        let Completed { trigger, taxels, event, .. } = self.completed?;
        Some(Event { taxels, ..trigger.event(event?) })
    }

    /// Returns the touch whose sample is being captured, with the frames that have arrived, the one of this push the
    /// last.
    ///
    /// It is there only with one event per touch
    /// ([`TriggerConfig::one_event_per_touch`](crate::paper::trigger::TriggerConfig::one_event_per_touch)). A law may
    /// answer it before it is an event ([`AtOnce`](crate::touch::at_once::AtOnce)).
    pub fn touch(&self) -> Option<Event<'a>> {
        let Completed { trigger, taxels, .. } = self.completed?;
        Some(Event { taxels, ..trigger.touch()? })
    }

    /// Returns the taxels of the last 70 frames, for the sample of the event
    /// ([`PathSample::of_taxels`](crate::touch::path_sample::PathSample::of_taxels)).
    ///
    /// It is `None` if the pipeline keeps no taxels ([`PipelineBuilder::taxels`]), or if a frame of them was lost, in
    /// whole or in part.
    pub fn taxels(&self) -> Option<&'a TaxelRing> {
        self.completed?.taxels.filter(|ring| ring.is_unbroken())
    }

    /// Returns the number of the feature frame, and its taxels if the pipeline keeps them and none of its rows were
    /// lost.
    pub(crate) fn newest_taxels(&self) -> Option<(u64, &'a [u16; TAXELS])> {
        let Completed { taxels, number, .. } = self.completed?;
        Some((number, taxels?.last(1).next().flatten()?))
    }

    /// Returns the sample that a long gap interrupted. It has no event.
    pub fn interrupted(&self) -> Option<InterruptedSample> {
        self.completed?.trigger.interrupted()
    }

    /// Returns the end of the touch of an event: this one's, or that of an earlier one.
    ///
    /// It is given only by a trigger with one event per touch
    /// ([`TriggerConfig::one_event_per_touch`](crate::paper::trigger::TriggerConfig::one_event_per_touch)).
    pub fn contact_end(&self) -> Option<ContactEnd> {
        self.completed?.trigger.contact_end()
    }

    /// Returns whether a sample is being captured whose touch is not answered.
    pub(crate) fn is_captured(&self) -> bool {
        self.completed.is_some_and(|Completed { trigger, .. }| trigger.under_way().is_some())
    }

    /// Returns the number of the feature frame that was completed.
    pub(crate) fn number(&self) -> Option<u64> {
        Some(self.completed?.number)
    }

    /// Returns whether the push completed a feature frame.
    pub fn is_frame(&self) -> bool {
        self.completed.is_some()
    }

    /// Returns the first `frames` frames of the sample under way, if this push brought the last of them.
    ///
    /// It does so once per sample for each number of frames, and before the sample's event. 70 or more frames are a
    /// whole sample and never a prefix.
    ///
    /// A texture model that needs no more frames gives the same answer for the prefix as for the whole sample. By
    /// default the trigger fires when 15 frames of a sample have arrived (its backtrack and a window). Shorter prefixes
    /// are returned with the 15th frame.
    ///
    /// ```
    /// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline};
    /// use wstac_core::{rate::FrameRate, taxels::FrameGeometry};
    ///
    /// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
    /// let mut pipeline = Pipeline::builder(geometry).build()?;
    /// # let frames = (0..120).map(|t| vec![if t == 40 { 200 } else { 3_u8 }; 160_000]);
    /// # let mut given = Vec::new();
    /// for (number, frame) in frames.enumerate() {
    ///     let update = pipeline.push_frame(&frame)?;
    ///     for frames in [15, 20] { // such as the frames of two models
    ///         if let Some(prefix) = update.prefix(frames) {
    ///             // model.classify(&prefix.flat())
    /// #           given.push((number, frames, prefix.frame));
    ///         }
    ///     }
    /// }
    /// # assert_eq!(given, [(44, 15, 30), (49, 20, 30)]);
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn prefix(&self, frames: u8) -> Option<SamplePrefix<'a>> {
        let Completed { trigger, before, .. } = self.completed?;
        early::prefix(trigger, before, frames)
    }
}

/// A feature frame at its place in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct CompletedFrame {
    /// The frame's number, counted from the pipeline's first frame. Lost frames count, too.
    pub number: u64,
    /// The ten features, five rows, then five columns, in units of 2^-11.
    pub features: Features,
    /// Whether some, but not all, of its camera frames were lost. The sums of the others were scaled up to replace
    /// them.
    pub has_missing_frames: bool,
}

/// Holds whatever the end of a stream brought.
#[derive(Clone, Copy, Debug)]
pub struct Finished<'a> {
    trigger: &'a TriggerState,
    taxels: Option<&'a TaxelRing>,
    event: Option<u64>,
}

impl<'a> Finished<'a> {
    /// Returns the event that frames lost at the very end completed.
    pub fn event(&self) -> Option<Event<'a>> {
        self.event.map(|first| Event { taxels: self.taxels, ..self.trigger.event(first) })
    }

    /// Returns the sample that a long gap at the very end interrupted.
    pub fn interrupted(&self) -> Option<InterruptedSample> {
        self.trigger.interrupted()
    }

    /// Returns the end of the touch of an event.
    pub fn contact_end(&self) -> Option<ContactEnd> {
        self.trigger.contact_end()
    }

    /// Returns how the stream ended.
    pub fn end(&self) -> StreamEnd {
        self.trigger.end()
    }
}

impl Pipeline {
    /// Starts to build a pipeline for frames of this geometry: pixel format, layout, stride and rate.
    ///
    /// Without another call, the pipeline has a darkness floor of half a gray level and a fixed baseline. The trigger's
    /// parameters are the defaults, and the log kernel is [`Fixed`].
    ///
    /// ```
    /// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline};
    /// use wstac_core::{rate::FrameRate, taxels::FrameGeometry};
    /// use wstac_core::ln::any::AnyLn;
    /// use wstac_core::paper::{baseline_policy::TrackingBaseline, trigger::{Rule, TriggerConfig}};
    ///
    /// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
    /// let pipeline = Pipeline::builder(geometry)
    ///     .floor_levels(1.0)
    ///     .trigger(TriggerConfig::new(10, 1.5, 10, Rule::Signed, 0.2)?)
    ///     .baseline(Some(TrackingBaseline::new(256)?))
    ///     .ln(AnyLn::Libm)
    ///     .build()?;
    /// assert_eq!(pipeline.next_frame(), 0);
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn builder<G: GreenChannel>(geometry: FrameGeometry<G>) -> PipelineBuilder<G> {
        PipelineBuilder {
            geometry,
            floor: DEFAULT_FLOOR_LEVELS,
            ln: Fixed,
            trigger: TriggerConfig::default(),
            baseline: FixedBaseline,
            first_frame: 0,
            taxels: PhantomData,
        }
    }
}

impl<G: GreenChannel, L: Ln, B: BaselinePolicy> Pipeline<G, L, B, ChosenTaxels> {
    /// Keeps the taxels of the frames to come, for a model that needs them.
    pub fn keep_taxels(&mut self) {
        self.taxels.store.insert(TaxelRing::EMPTY).start(self.stream.camera());
    }

    /// Sets the correction of cross-talk in the taxels of the frames to come; `None` for none.
    pub fn set_correction(&mut self, correction: Option<Correction>) {
        self.taxels.correction = correction;
    }
}

impl<G: GreenChannel, L: Ln, B: BaselinePolicy, T: TaxelStore> Pipeline<G, L, B, T> {
    /// Takes a whole frame.
    ///
    /// # Errors
    /// Returns [`FrameError::FrameTooShort`] if the frame was not taken. Count it with [`Pipeline::push_lost`] to keep
    /// time.
    ///
    /// Returns [`FrameError::FrameUnderWay`] if a frame in stripes is not complete. Give it up with
    /// [`Pipeline::abandon_frame`], which counts it as lost, and push again.
    pub fn push_frame(&mut self, bytes: &[u8]) -> Result<Update<'_>, FrameError> {
        let Some(frame) = self.stream.push_frame_to(bytes, &mut self.taxels)? else { return Ok(Update::NOTHING) };
        Ok(advance(&mut self.trigger, &self.taxels, frame, 0))
    }

    /// Takes the next rows of a frame, as a DMA delivers them.
    ///
    /// The result of the last rows is bit-identical to that of the whole frame.
    ///
    /// # Errors
    /// Returns [`FrameError::StripeNotWholeRows`], [`FrameError::StripeTooLong`] or [`FrameError::StripeOfPlanar`] if
    /// the stripe was not taken.
    pub fn push_stripe(&mut self, bytes: &[u8]) -> Result<Update<'_>, FrameError> {
        // Most stripes complete no frame: the result is looked at where it is, and not copied.
        match &self.stream.push_stripe_to(bytes, &mut self.taxels) {
            Ok(Some(frame)) => Ok(advance(&mut self.trigger, &self.taxels, *frame, 0)),
            Ok(None) => Ok(Update::NOTHING),
            Err(error) => Err(*error),
        }
    }

    /// Takes the next rows of a frame, and returns what takes those of the next frame while the update is in use.
    ///
    /// A processor may need longer for an event than its camera for a stripe. An interrupt of the camera sums the rows
    /// then.
    ///
    /// # Errors
    /// Returns the errors of [`Pipeline::push_stripe`].
    ///
    /// ```
    /// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline};
    /// use wstac_core::{rate::FrameRate, taxels::FrameGeometry};
    ///
    /// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
    /// let mut pipeline = Pipeline::builder(geometry).build()?;
    /// let frame = vec![3; 160_000];
    /// let (first, last) = frame.split_at(80_000);
    /// pipeline.push_stripe(first)?;
    /// let (update, mut next) = pipeline.push_last_stripe(last)?;
    /// assert!(next.push_stripe(first)? && !next.push_stripe(last)?);
    /// assert_eq!(update.frame().map(|frame| frame.number), Some(0));
    /// assert_eq!(pipeline.push_stripe(last)?.frame().map(|frame| frame.number), Some(1));
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn push_last_stripe(&mut self, bytes: &[u8]) -> Result<(Update<'_>, NextFrame<'_, G>), FrameError> {
        let frame = self.stream.push_stripe_to(bytes, &mut self.taxels)?;
        let update = frame.map_or(Update::NOTHING, |frame| advance(&mut self.trigger, &self.taxels, frame, 0));
        Ok((update, NextFrame(self.stream.sums())))
    }

    /// Takes the 25 taxel sums of a frame that was summed elsewhere, row by row. Each is at most G · A; larger ones
    /// saturate.
    pub fn push_taxels(&mut self, taxels: &[u32; TAXELS]) -> Update<'_> {
        match self.stream.push_taxels_to(taxels, &mut self.taxels) {
            Some(frame) => advance(&mut self.trigger, &self.taxels, frame, 0),
            None => Update::NOTHING,
        }
    }

    /// Forgets the rows of a frame whose rest will not arrive, and counts it as lost.
    pub fn abandon_frame(&mut self) -> Update<'_> {
        let loss = self.stream.abandon_frame_of(&mut self.taxels);
        self.lose(loss)
    }

    /// Keeps the place of lost camera frames in time.
    ///
    /// A short gap is filled; a long one interrupts the sample under way. Frames lost before the first frame have no
    /// place. A frame that is under way in stripes stays so.
    pub fn push_lost(&mut self, frames: u64) -> Update<'_> {
        let loss = self.stream.push_lost_of(frames, &mut self.taxels);
        self.lose(loss)
    }

    /// Returns how many frames of the sample that is being captured have arrived, whether its touch is answered or not;
    /// `None` if none is.
    pub fn captured_frames(&self) -> Option<u8> {
        self.trigger.state().captured_frames()
    }

    /// Takes note that the touch under way is answered ([`Update::touch`]): no event of it follows, only its end.
    pub fn answer_touch(&mut self) {
        self.trigger.answer_touch();
    }

    /// Ends a stream: fills or ends a gap of lost frames, and returns how the stream ended.
    pub fn finish(&mut self) -> Finished<'_> {
        self.trigger.forget_last();
        let event = self.trigger.settle();
        let trigger = self.trigger.state();
        Finished { trigger, taxels: taxels_of(trigger, &self.taxels, event), event }
    }

    /// Gathers a new baseline from the next feature frame on. Returns the sample that was being captured and ends here.
    pub fn rezero(&mut self) -> Option<InterruptedSample> {
        self.trigger.rezero()
    }

    /// Takes the next camera frame as the first of a stream.
    ///
    /// A new baseline is gathered, and feature frames of which a part has arrived are dropped. From then on the results
    /// are those of a new pipeline, except that frame numbers go on. Returns the sample that was being captured and
    /// ends here.
    pub fn restart(&mut self) -> Option<InterruptedSample> {
        self.stream.restart();
        self.taxels.lose();
        self.trigger.rezero()
    }

    /// Takes the next camera frame as frame 0 of a stream, and keeps the baseline. Without a complete one, it is
    /// gathered anew.
    ///
    /// A touch in the frames that a sample has before its window is seen from behind them on.
    pub fn rewind(&mut self) {
        self.stream.restart();
        self.taxels.lose();
        self.trigger.rewind();
    }

    /// Replaces the trigger's parameters and the baseline policy, and gathers a new baseline from the next feature
    /// frame on. Returns the sample that was being captured and ends here.
    pub fn set_trigger(&mut self, config: TriggerConfig, baseline: B) -> Option<InterruptedSample> {
        self.trigger.reset(config, baseline)
    }

    /// Replaces the darkness floor of the features to come.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorFullScale`] if the floor is for pixels of another full scale; then nothing has
    /// changed.
    pub fn set_floor(&mut self, floor: Floor) -> Result<(), ConfigError> {
        self.stream.set_floor(floor)
    }

    /// Returns the geometry of the frames.
    pub fn geometry(&self) -> &FrameGeometry<G> {
        self.stream.camera()
    }

    /// Returns the 25 taxel sums of the last camera frame that was pushed as bytes, until the next frame begins or is
    /// lost.
    pub fn taxels(&self) -> Option<[u32; TAXELS]> {
        self.stream.taxels()
    }

    /// Returns the number of the next feature frame. Lost frames count, too.
    pub fn next_frame(&self) -> u64 {
        self.trigger.next_frame()
    }

    /// Returns the trigger's parameters.
    pub fn trigger_config(&self) -> &TriggerConfig {
        self.trigger.config()
    }

    /// Returns the baseline once its 5m frames have arrived. A tracking baseline is returned as it is now.
    pub fn baseline(&self) -> Option<&Baseline> {
        self.trigger.baseline()
    }

    /// Returns the highest window sum of each feature that does not fire, in units of 2^-11, once the baseline is
    /// complete.
    pub fn thresholds(&self) -> Option<&[i32; FEATURES]> {
        self.trigger.thresholds()
    }

    /// Returns the last feature frames, at most 70 with lost ones filled, and the number of the frame after the last of
    /// them.
    ///
    /// An event's sample is among them for a while: a link sends it in parts, without a copy.
    pub fn recent(&self) -> (u64, Sample<'_>) {
        self.trigger.recent()
    }

    /// Returns the taxels of the last frames, if they are kept, lost ones or not: what live motion takes
    /// ([`LiveWave::push`](crate::touch::motion::LiveWave::push)).
    pub fn taxel_ring(&self) -> Option<&TaxelRing> {
        self.taxels.ring()
    }

    /// Returns the state of the stream; after [`Pipeline::finish`], how it ended.
    pub fn end(&self) -> StreamEnd {
        self.trigger.end()
    }

    /// Returns the number of a feature frame before which nothing is left to report: samples, touches and ends of
    /// touches that are reported later begin at this frame or behind it. [`AtOnce`](crate::touch::at_once::AtOnce) may
    /// report the end of a touch later.
    ///
    /// The number never goes back. A program that needs only a part of a stream can stop reading by it.
    pub fn settled_frame(&self) -> u64 {
        self.trigger.settled_frame()
    }

    fn lose(&mut self, loss: Loss) -> Update<'_> {
        if let Some(frame) = loss.has_missing_frames {
            return advance(&mut self.trigger, &self.taxels, frame, loss.frames);
        }
        self.trigger.push_lost(loss.frames);
        Update::NOTHING
    }
}

/// Hands a feature frame and the `lost_after` lost frames behind it to the trigger.
fn advance<'a, B: BaselinePolicy>(
    trigger: &'a mut Trigger<B>,
    taxels: &'a impl TaxelStore,
    frame: FeatureFrame,
    lost_after: u64,
) -> Update<'a> {
    let state = trigger.state();
    let (number, before) = (state.next_frame(), state.under_way());
    trigger.forget_last();
    let event = trigger.advance(frame.features, frame.has_missing_frames, lost_after);
    let trigger = trigger.state();
    // An interrupted sample is not the one that is under way now.
    let before = if trigger.interrupted().is_some() { 0 } else { before.map_or(0, |before| before.frames) };
    Update { completed: Some(Completed { trigger, taxels: taxels_of(trigger, taxels, event), number, event, before }) }
}

/// Returns the taxels, which may have left the sample of an event behind.
fn taxels_of<'a>(trigger: &TriggerState, taxels: &'a impl TaxelStore, event: Option<u64>) -> Option<&'a TaxelRing> {
    let ring = taxels.ring()?;
    event.is_none_or(|first| trigger.is_recent(first)).then_some(ring)
}

/// Takes rows of the next frame while an [`Update`] is in use ([`Pipeline::push_last_stripe`]).
#[derive(Debug)]
pub struct NextFrame<'a, G: GreenChannel>(&'a mut TaxelSums<G>);

impl<G: GreenChannel> NextFrame<'_, G> {
    /// Takes the next rows of the frame, but not its last ones: returns false if these are, which are for the pipeline.
    ///
    /// # Errors
    /// Returns the errors of [`Pipeline::push_stripe`] if the rows were not taken.
    pub fn push_stripe(&mut self, bytes: &[u8]) -> Result<bool, FrameError> {
        if self.0.is_completed_by(bytes) {
            return Ok(false);
        }
        self.0.push_stripe(bytes).map(|_| true)
    }
}

/// Builds a [`Pipeline`]. [`Pipeline::builder`] creates the builder.
#[derive(Clone, Copy, Debug)]
#[must_use]
pub struct PipelineBuilder<G, L = Fixed, B = FixedBaseline, F = f64, T = NoTaxels> {
    geometry: FrameGeometry<G>,
    /// The floor in gray levels of a taxel, or computed. It is a type parameter so that a board with a computed floor
    /// needs no 64-bit floating point.
    floor: F,
    ln: L,
    trigger: TriggerConfig,
    baseline: B,
    first_frame: u64,
    taxels: PhantomData<T>,
}

impl<G: GreenChannel, L: Ln, B: BaselinePolicy, F: FloorChoice, T: TaxelStore> PipelineBuilder<G, L, B, F, T> {
    /// Sets the darkness floor to this many gray levels of a taxel, from 0 to the green full scale.
    pub fn floor_levels(self, levels: f64) -> PipelineBuilder<G, L, B, f64, T> {
        let Self { geometry, ln, trigger, baseline, first_frame, taxels, .. } = self;
        PipelineBuilder { geometry, floor: levels, ln, trigger, baseline, first_frame, taxels }
    }

    /// Sets a computed darkness floor. If it is computed in a `const`, a board needs no 64-bit floating point.
    pub fn floor(self, floor: Floor) -> PipelineBuilder<G, L, B, Floor, T> {
        let Self { geometry, ln, trigger, baseline, first_frame, taxels, .. } = self;
        PipelineBuilder { geometry, floor, ln, trigger, baseline, first_frame, taxels }
    }

    /// Sets the log kernel. A host that chooses at run time uses [`AnyLn`](crate::ln::any::AnyLn).
    pub fn ln<K: Ln>(self, ln: K) -> PipelineBuilder<G, K, B, F, T> {
        let Self { geometry, floor, trigger, baseline, first_frame, taxels, .. } = self;
        PipelineBuilder { geometry, floor, ln, trigger, baseline, first_frame, taxels }
    }

    /// Sets the trigger's parameters.
    pub fn trigger(self, trigger: TriggerConfig) -> Self {
        Self { trigger, ..self }
    }

    /// Sets the baseline policy, which applies after the baseline's 5m frames.
    ///
    /// A host that chooses at run time uses
    /// `Option<`[`TrackingBaseline`](crate::paper::baseline_policy::TrackingBaseline)`>`.
    pub fn baseline<P: BaselinePolicy>(self, baseline: P) -> PipelineBuilder<G, L, P, F, T> {
        let Self { geometry, floor, ln, trigger, first_frame, taxels, .. } = self;
        PipelineBuilder { geometry, floor, ln, trigger, baseline, first_frame, taxels }
    }

    /// Sets what keeps the taxels of the last 70 frames: [`TaxelRing`] for a model or a law that takes them.
    ///
    /// Without this call, they are not kept.
    ///
    /// ```
    /// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline};
    /// use wstac_core::touch::{motion::{self, MotionConfig}, path_sample::PathSample, taxel_ring::TaxelRing};
    /// use wstac_core::{rate::FrameRate, taxels::FrameGeometry};
    ///
    /// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
    /// let mut pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build()?;
    /// let config = MotionConfig::published(FrameRate::NOMINAL);
    /// # let mut samples = 0;
    /// # let frames = (0..120_usize).map(|t| {
    /// #     let mut frame = vec![1; 160_000];
    /// #     if (40..73).contains(&t) { frame.chunks_mut(400).for_each(|row| row[12 * (t - 40)..][..12].fill(200)); }
    /// #     frame
    /// # });
    /// for frame in frames {
    ///     let update = pipeline.push_frame(&frame)?;
    ///     if let Some(event) = update.event()
    ///         && let Some(taxels) = update.taxels()
    ///         && let Some(velocity) = motion::by_coherence(&event, config).velocity
    ///     {
    ///         let sample = PathSample::of_taxels(taxels, &velocity, config, 28);
    ///         assert!(sample.is_some());
    /// #       samples += 1;
    ///     }
    /// }
    /// # assert_eq!(samples, 1);
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn taxels<S: TaxelStore>(self) -> PipelineBuilder<G, L, B, F, S> {
        let Self { geometry, floor, ln, trigger, baseline, first_frame, .. } = self;
        PipelineBuilder { geometry, floor, ln, trigger, baseline, first_frame, taxels: PhantomData }
    }

    /// Sets the number of the first feature frame, for a recording that does not start at 0.
    pub fn starting_at(self, frame: u64) -> Self {
        Self { first_frame: frame, ..self }
    }

    /// Builds the pipeline.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorLevels`] if the floor is not 0 to the green full scale, and
    /// [`ConfigError::FloorFullScale`] if it is for pixels of another full scale.
    pub fn build(self) -> Result<Pipeline<G, L, B, T>, ConfigError> {
        Ok(self.check()?.build())
    }

    /// Checks everything, so that the pipeline can be built in its final place.
    ///
    /// This helps a board with little stack, where a `Result` of a whole pipeline would be a copy of 2 KiB.
    ///
    /// # Errors
    /// Returns the errors of [`PipelineBuilder::build`].
    pub fn check(self) -> Result<CheckedBuilder<G, L, B, T>, ConfigError> {
        let Self { geometry, floor, ln, trigger, baseline, first_frame, taxels } = self;
        let stream = FeatureStream::with_ln(geometry, floor.floor(geometry.full_scale())?, ln)?;
        Ok(CheckedBuilder { stream, trigger, baseline, first_frame, taxels })
    }
}

/// A [`PipelineBuilder`] that has been checked.
#[derive(Clone, Debug)]
#[must_use]
pub struct CheckedBuilder<G: GreenChannel, L = Fixed, B = FixedBaseline, T = NoTaxels> {
    stream: FeatureStream<G, L>,
    trigger: TriggerConfig,
    baseline: B,
    first_frame: u64,
    taxels: PhantomData<T>,
}

impl<G: GreenChannel, L: Ln, B: BaselinePolicy, T: TaxelStore> CheckedBuilder<G, L, B, T> {
    /// Builds the pipeline.
    #[inline(always)]
    pub fn build(self) -> Pipeline<G, L, B, T> {
        let Self { stream, trigger, baseline, first_frame, .. } = self;
        if !T::NEEDS_START {
            return Pipeline { stream, trigger: Trigger::with(trigger, first_frame, baseline), taxels: T::EMPTY };
        }
        let trigger = Trigger::with(trigger, first_frame, baseline);
        let mut pipeline = Pipeline { stream, trigger, taxels: T::EMPTY };
        pipeline.taxels.start(pipeline.stream.camera());
        pipeline
    }
}

/// A form in which [`PipelineBuilder`] takes a darkness floor: gray levels, or a computed [`Floor`].
pub trait FloorChoice: sealed::Sealed + Copy {
    /// Computes the floor for pixels of this full scale.
    #[doc(hidden)]
    fn floor(self, full_scale: u32) -> Result<Floor, ConfigError>;
}

impl FloorChoice for f64 {
    fn floor(self, full_scale: u32) -> Result<Floor, ConfigError> {
        Floor::new(self, full_scale)
    }
}

impl FloorChoice for Floor {
    fn floor(self, _: u32) -> Result<Floor, ConfigError> {
        Ok(self)
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for super::Floor {}
}
