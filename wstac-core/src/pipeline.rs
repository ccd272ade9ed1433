//! The whole way from a camera's bytes to events.

use crate::baseline_policy::{BaselinePolicy, FixedBaseline};
use crate::error::Error;
use crate::features::Floor;
use crate::green::{GreenChannel, gray::Gray};
use crate::ln::{Ln, fixed::Fixed};
use crate::stream::{FeatureStream, Loss};
use crate::taxels::FrameGeometry;
use crate::trigger::{Event, InterruptedSample, StreamEnd, Trigger, TriggerConfig};

/// Frames or stripes in, events out: [`FeatureStream`], then [`Trigger`]. Everything is checked when it is built.
///
/// ```
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{speed::{self, SpeedConfig}, direction, taxels::FrameGeometry, trigger::TriggerConfig};
///
/// let layout = Layout::paper(FrameSize::new(400, 400)?)?;
/// let camera = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?;
/// let mut pipeline: Pipeline = Pipeline::new(camera, 0.5, TriggerConfig::default())?;
/// let speed_config = SpeedConfig::published(FrameRate::NOMINAL);
/// # let frames = (0..120).map(|t| vec![if t == 40 { 200 } else { 3_u8 }; 160_000]);
/// # let mut events = 0;
/// for frame in frames {
///     if let Some(event) = pipeline.push_frame(&frame)? {
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
pub struct Pipeline<G: GreenChannel = Gray, L = Fixed, B = FixedBaseline> {
    stream: FeatureStream<G, L>,
    trigger: Trigger<B>,
}

/// What a default pipeline may take, ring included.
const MOST_BYTES: usize = 2048;
const _: () = assert!(size_of::<Pipeline>() < MOST_BYTES);

impl<G: GreenChannel, L: Ln> Pipeline<G, L> {
    /// A pipeline from this camera, with features floored at `floor_levels` gray levels a taxel.
    ///
    /// # Errors
    /// [`Error::FloorLevels`] where that is not 0 to the green full scale.
    pub fn new(camera: FrameGeometry<G>, floor_levels: f64, trigger: TriggerConfig) -> Result<Self, Error> {
        Ok(Self { stream: FeatureStream::new(camera, floor_levels)?, trigger: Trigger::new(trigger) })
    }

    /// The same with a floor that has been worked out.
    ///
    /// # Errors
    /// [`Error::FloorFullScale`] where it is for pixels of another full scale.
    pub fn with_floor(camera: FrameGeometry<G>, floor: Floor, trigger: TriggerConfig) -> Result<Self, Error> {
        Self::with_following(camera, floor, trigger, FixedBaseline)
    }
}

impl<G: GreenChannel, L: Ln, B: BaselinePolicy> Pipeline<G, L, B> {
    /// The same with what becomes of the baseline after its 5m frames.
    ///
    /// # Errors
    /// As [`Pipeline::with_floor`].
    pub fn with_following(
        camera: FrameGeometry<G>,
        floor: Floor,
        trigger: TriggerConfig,
        following: B,
    ) -> Result<Self, Error> {
        Ok(Self { stream: FeatureStream::with_floor(camera, floor)?, trigger: Trigger::with(trigger, 0, following) })
    }

    /// Takes a whole frame; an event, if it completes one.
    ///
    /// # Errors
    /// [`Error::FrameTooShort`]: the frame was not taken; count it with [`Pipeline::push_lost`] to keep time.
    /// [`Error::FrameUnderWay`]: a frame in stripes is not complete; give it up with [`Pipeline::abandon_frame`],
    /// which counts it as lost, and push again.
    pub fn push_frame(&mut self, bytes: &[u8]) -> Result<Option<Event<'_>>, Error> {
        let Some(frame) = self.stream.push_frame(bytes)? else { return Ok(None) };
        Ok(self.trigger.push(frame.features, frame.has_missing_frames))
    }

    /// Takes the next rows of a frame, as a DMA delivers them; an event, if they complete one. The event is
    /// bit-identical to that of the whole frame.
    ///
    /// # Errors
    /// [`Error::StripeNotWholeRows`], [`Error::StripeTooLong`], [`Error::StripeOfPlanar`]: the stripe was not taken.
    pub fn push_stripe(&mut self, bytes: &[u8]) -> Result<Option<Event<'_>>, Error> {
        let Some(frame) = self.stream.push_stripe(bytes)? else { return Ok(None) };
        Ok(self.trigger.push(frame.features, frame.has_missing_frames))
    }

    /// Forgets the rows of a frame whose rest will not arrive, and counts it as lost.
    pub fn abandon_frame(&mut self) -> Option<Event<'_>> {
        let loss = self.stream.abandon_frame();
        self.lose(loss)
    }

    /// Keeps the place of lost camera frames in time. A frame that is under way in stripes stays so.
    pub fn push_lost(&mut self, frames: u64) -> Option<Event<'_>> {
        let loss = self.stream.push_lost(frames);
        self.lose(loss)
    }

    /// Settles what is pending at the end of a stream.
    pub fn finish(&mut self) -> Option<Event<'_>> {
        self.trigger.finish()
    }

    /// How the stream stands; after [`Pipeline::finish`], how it ended.
    pub fn end(&self) -> StreamEnd {
        self.trigger.end()
    }

    /// The sample that a long gap has interrupted, once.
    pub fn take_interrupted(&mut self) -> Option<InterruptedSample> {
        self.trigger.take_interrupted()
    }

    /// What finds the events.
    pub fn trigger(&self) -> &Trigger<B> {
        &self.trigger
    }

    fn lose(&mut self, loss: Loss) -> Option<Event<'_>> {
        if let Some(frame) = loss.has_missing_frames {
            return self.trigger.push_then_lose(frame.features, frame.has_missing_frames, loss.frames);
        }
        self.trigger.push_lost(loss.frames);
        None
    }
}
