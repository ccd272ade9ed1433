//! The laws from an event to its answers: speed, direction and kind of touch, behind one trait.
//!
//! [`ByWave`] measures arrival times of 25 taxels, and holds for objects of most shapes, and for two of one velocity.
//! [`ByCoherence`] and [`ByEdges`] measure those of ten sums, and hold for objects wider than the sensor.
//! [`SpeedConfig`] is a law of durations, with the direction of centroids: the published algorithm. [`AnyLaw`] chooses
//! at run time and links them all.

use crate::paper::direction::{self, Direction};
use crate::paper::speed::{self, LitSpan, Speed, SpeedConfig};
use crate::paper::trigger::Event;
use crate::reason::Reason;
use crate::touch::motion::{self, Contact, Motion, MotionConfig, Readout, Velocity};
use crate::touch::wave::{self, Basis, Extent, Measured, TaxelMotion};

/// The answers of a law about an event's touch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Answer {
    /// The kind of the touch; `None` by a law of durations, which takes every touch for a slide.
    pub contact: Option<Contact>,
    /// The duration in frames from the first lit frame to the last; `None` if no frame is lit, or if the sample does
    /// not show the touch's begin and end.
    pub duration: Option<u8>,
    /// The sliding speed, or the reason why there is none.
    pub speed: Result<Speed, Reason>,
    /// The sliding direction, or the reason why there is none.
    pub direction: Direction,
    /// What speed and direction are known by; `None` unless 25 taxels were asked ([`ByWave`]) and the answers are
    /// reliable.
    pub basis: Option<Basis>,
    /// Where and how wide the touch is across its motion; `None` unless 25 taxels tell the velocity ([`ByWave`]), or
    /// two objects.
    pub extent: Option<Extent>,
    /// The mean [acceleration](TaxelMotion::acceleration); `None` by other laws than [`ByWave`].
    pub acceleration: Option<Measured>,
    /// Whether the answers are reliable.
    ///
    /// By a law of durations it says only that the event is: see [`Event::reliable`]. By arrival times it also says
    /// that speed and direction mostly hold within their standard deviations, and that the kind of the touch is clear.
    pub reliable: bool,
    /// Why the touch is unclear, or why its answers are not reliable; `None` if they are, and by a law of durations.
    pub doubt: Option<Reason>,
}

impl Answer {
    /// Creates an answer of a law of one's own.
    pub const fn new(speed: Result<Speed, Reason>, direction: Direction, reliable: bool) -> Self {
        Self {
            contact: None,
            duration: None,
            speed,
            direction,
            basis: None,
            extent: None,
            acceleration: None,
            reliable,
            doubt: None,
        }
    }

    /// Returns the velocity by arrival times; `None` by a law of durations, or if the touch has none.
    pub fn velocity(&self) -> Option<Velocity> {
        velocity(self.speed, &self.direction)
    }

    /// Returns whether the touch has a texture: whether it slides, as far as the law tells.
    pub fn has_texture(&self) -> bool {
        has_texture(self.contact)
    }
}

/// Returns the velocity of a speed and a direction by arrival times, which have standard deviations; `None` of others.
pub(crate) fn velocity(speed: Result<Speed, Reason>, direction: &Direction) -> Option<Velocity> {
    let (speed, degrees) = (speed.ok()?, direction.degrees.ok()?);
    Some(Velocity { mm_s: speed.mm_s, mm_s_sd: speed.sd?, degrees, degrees_sd: direction.sd? })
}

pub(crate) fn has_texture(contact: Option<Contact>) -> bool {
    matches!(contact, None | Some(Contact::Slide))
}

/// A law from an event to its answers.
pub trait EventLaw {
    /// Whether some such law answers at once: without it, a program links nothing of that.
    const ANSWERS_AT_ONCE: bool = false;

    /// Returns the answers of an event.
    fn answer(&self, event: &Event<'_>) -> Answer;

    /// Returns the velocity for a sample along the path: this one of the answer, or by coherence if the law is
    /// [`ByWave`] and has none. A texture is mostly known in spite of a speed that changes a little.
    fn path_velocity(&self, _: &Event<'_>, of_answer: Option<Velocity>) -> Option<Velocity> {
        of_answer
    }

    /// Returns whether the law needs one event per touch, however long the touch is.
    ///
    /// A pipeline has that from
    /// [`TriggerConfig::one_event_per_touch`](crate::paper::trigger::TriggerConfig::one_event_per_touch).
    fn is_per_touch(&self) -> bool {
        true
    }

    /// Returns whether the law takes the taxels of an event, so that a pipeline must keep them.
    fn takes_taxels(&self) -> bool {
        false
    }

    /// Returns whether the law answers a touch before its sample is complete
    /// ([`AtOnce`](crate::touch::at_once::AtOnce)).
    fn answers_at_once(&self) -> bool {
        Self::ANSWERS_AT_ONCE
    }

    /// Returns the law for a camera with this readout. A law of durations stays as it is.
    #[must_use]
    fn with_readout(self, _: Readout) -> Self
    where
        Self: Sized,
    {
        self
    }
}

/// The law of arrival times of 25 taxels ([`wave::by_wave`]): the default of configurations.
///
/// For an event without taxels ([`Event::taxels`]) it is [`ByCoherence`], but no slide is reliable: its doubt is
/// [`Reason::LostFrames`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ByWave(pub MotionConfig);

/// The law of arrival times of ten sums by coherence ([`motion::by_coherence`]).
///
/// ```
/// use wstac_core::law::{ByCoherence, EventLaw};
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{touch::motion::{Contact, MotionConfig}, taxels::FrameGeometry, paper::trigger::TriggerConfig};
///
/// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
/// let trigger = TriggerConfig::default().one_event_per_touch();
/// let mut pipeline = Pipeline::builder(geometry).trigger(trigger).build()?;
/// let law = ByCoherence(MotionConfig::published(FrameRate::NOMINAL));
/// # let frames = (0..120).map(|t| vec![if t == 40 { 200 } else { 3_u8 }; 160_000]);
/// for frame in frames {
///     if let Some(event) = pipeline.push_frame(&frame)?.event() {
///         let answer = law.answer(&event);
///         // All taxels flashed at once.
///         assert_eq!(answer.contact, Some(Contact::Press));
///         assert_eq!((event.touch_frame, event.end_frame), (Some(40), Some(41)));
///     }
/// }
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ByCoherence(pub MotionConfig);

/// The law of arrival times by rising edges ([`motion::by_edges`]): cheaper, and less accurate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ByEdges(pub MotionConfig);

impl EventLaw for ByWave {
    const ANSWERS_AT_ONCE: bool = true;

    fn answer(&self, event: &Event<'_>) -> Answer {
        let TaxelMotion { motion, basis, extent, acceleration } = if let Some(taxels) = event.taxels() {
            wave::by_wave(event, taxels, self.0)
        } else {
            let motion = motion::by_coherence(event, self.0);
            let lost = (motion.contact == Contact::Slide).then_some(Reason::LostFrames);
            let motion = Motion { doubt: motion.doubt.or(lost), ..motion };
            TaxelMotion { motion, basis: None, extent: None, acceleration: None }
        };
        Answer { basis, extent, acceleration, ..by_arrival(event, &motion) }
    }

    fn path_velocity(&self, event: &Event<'_>, of_answer: Option<Velocity>) -> Option<Velocity> {
        of_answer.or_else(|| motion::by_coherence(event, self.0).velocity)
    }

    fn takes_taxels(&self) -> bool {
        true
    }

    fn with_readout(self, readout: Readout) -> Self {
        Self(self.0.with_readout(readout))
    }
}

impl EventLaw for ByCoherence {
    fn answer(&self, event: &Event<'_>) -> Answer {
        by_arrival(event, &motion::by_coherence(event, self.0))
    }

    fn with_readout(self, readout: Readout) -> Self {
        Self(self.0.with_readout(readout))
    }
}

impl EventLaw for ByEdges {
    fn answer(&self, event: &Event<'_>) -> Answer {
        by_arrival(event, &motion::by_edges(event, self.0))
    }

    fn with_readout(self, readout: Readout) -> Self {
        Self(self.0.with_readout(readout))
    }
}

/// The law of durations and the direction of centroids: the published algorithm.
impl EventLaw for SpeedConfig {
    fn answer(&self, event: &Event<'_>) -> Answer {
        let duration = speed::duration(event, self).map(LitSpan::frames);
        Answer { duration, ..Answer::new(speed::speed(event, self), direction::direction(event), event.reliable) }
    }

    fn is_per_touch(&self) -> bool {
        false
    }
}

/// A law that is chosen at run time.
#[derive(Clone, Copy, Debug, PartialEq)]
// It is exhaustive: whoever writes or draws a law must not miss one.
pub enum AnyLaw {
    /// Arrival times of 25 taxels.
    Wave(ByWave),
    /// Arrival times by coherence.
    Coherence(ByCoherence),
    /// Arrival times by rising edges.
    Edges(ByEdges),
    /// A law of durations.
    Duration(SpeedConfig),
}

impl EventLaw for AnyLaw {
    const ANSWERS_AT_ONCE: bool = true;

    fn answers_at_once(&self) -> bool {
        self.takes_taxels()
    }

    fn answer(&self, event: &Event<'_>) -> Answer {
        match self {
            Self::Wave(law) => law.answer(event),
            Self::Coherence(law) => law.answer(event),
            Self::Edges(law) => law.answer(event),
            Self::Duration(law) => law.answer(event),
        }
    }

    fn path_velocity(&self, event: &Event<'_>, of_answer: Option<Velocity>) -> Option<Velocity> {
        if let Self::Wave(law) = self { law.path_velocity(event, of_answer) } else { of_answer }
    }

    fn is_per_touch(&self) -> bool {
        !matches!(self, Self::Duration(_))
    }

    fn takes_taxels(&self) -> bool {
        matches!(self, Self::Wave(_))
    }

    fn with_readout(self, readout: Readout) -> Self {
        match self {
            Self::Wave(law) => Self::Wave(law.with_readout(readout)),
            Self::Coherence(law) => Self::Coherence(law.with_readout(readout)),
            Self::Edges(law) => Self::Edges(law.with_readout(readout)),
            Self::Duration(_) => self,
        }
    }
}

fn by_arrival(event: &Event<'_>, motion: &Motion) -> Answer {
    // A slide that turns or changes its speed has none.
    let doubt = motion.doubt.filter(|_| motion.contact == Contact::Slide);
    let none = doubt.unwrap_or(Reason::NoSlide(motion.contact));
    let (speed, direction) = match motion.velocity {
        Some(velocity) => {
            (Ok(Speed::by_arrival(velocity.mm_s, velocity.mm_s_sd)), Ok([velocity.degrees, velocity.degrees_sd]))
        }
        None => (Err(none), Err(none)),
    };
    Answer {
        contact: Some(motion.contact),
        duration: event.lit_frames(),
        doubt: motion.doubt,
        ..Answer::new(speed, Direction::by_arrival(direction), motion.doubt.is_none())
    }
}
