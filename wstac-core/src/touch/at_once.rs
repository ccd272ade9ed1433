//! Answers before samples are complete: as soon as the motion of a touch is certain, or the touch has ended (SPEC §9).

use crate::law::{Answer, EventLaw};
use crate::paper::trigger::Event;
use crate::touch::motion::Velocity;

/// Frames from one try to the next.
const STEP: u8 = 2;
/// Two tries agree if they differ by at most so many standard deviations, or by the second number: a fraction of the speed,
/// and degrees.
const AGREE: [f32; 3] = [2.0, 0.02, 1.2];

/// Tries to answer the touch under way. The answers are the same on every processor.
///
/// ```
/// use wstac_core::law::{ByWave, EventLaw};
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{paper::trigger::TriggerConfig, taxels::FrameGeometry, touch::at_once::AtOnce};
/// use wstac_core::touch::{motion::{MotionConfig, Readout}, taxel_ring::TaxelRing};
///
/// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
/// let trigger = TriggerConfig::default().one_event_per_touch();
/// let mut pipeline = Pipeline::builder(geometry).trigger(trigger).taxels::<TaxelRing>().build()?;
/// let law = ByWave(MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL));
/// let mut at_once = AtOnce::NEW;
/// # let mut answered = Vec::new();
/// # // A narrow flash passes from left to right, a column every two frames.
/// # let frames = (0..130).map(|t| core::array::from_fn(|taxel| {
/// #     let (row, late) = (taxel / 5, t as f32 - 64.0 - 2.0 * (taxel % 5) as f32);
/// #     6000 + (180_000.0 * [0.0, 0.4, 1.0, 0.4, 0.0][row] * (-late * late / 3.0).exp()) as u32
/// # }));
/// for taxels in frames {
///     let update = pipeline.push_taxels(&taxels);
///     let touch = update.touch().or(update.event());
///     if let Some(answer) = touch.and_then(|touch| at_once.answer(&touch, &law)) {
///         // Speed, direction, …
/// #       answered.push((touch.unwrap().last_frame(), answer.velocity().unwrap().mm_s));
///         pipeline.answer_touch();
///     }
/// }
/// # assert!(matches!(answered[..], [(80..90, 59.0..61.0)]), "{answered:?}");
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AtOnce {
    /// The first frame of the sample that was tried last, and how many of its frames had arrived.
    frame: u64,
    frames: u8,
    /// What that try found.
    found: Option<Velocity>,
}

impl AtOnce {
    /// No touch was tried.
    pub const NEW: Self = Self { frame: u64::MAX, frames: 0, found: None };

    /// Returns the answer about a touch, if it is time: about one under way, if two tries in a row found reliable answers that
    /// agree; about one that has ended, if the answer is reliable; about an event in any case.
    ///
    /// Most frames cost nothing; a try costs what the law costs.
    pub fn answer(&mut self, touch: &Event<'_>, law: &impl EventLaw) -> Option<Answer> {
        if touch.is_event() {
            return Some(law.answer(touch));
        }
        let is_new = touch.frame != self.frame;
        if !law.answers_at_once() || (!is_new && touch.frames < self.frames.saturating_add(STEP)) {
            return None;
        }
        let before = self.found.filter(|_| !is_new);
        let answer = law.answer(touch);
        let found = answer.velocity().filter(|_| answer.reliable);
        (self.frame, self.frames, self.found) = (touch.frame, touch.frames, found);
        let is_certain = !touch.is_under_way() || before.zip(found).is_some_and(|(one, other)| agree(one, other));
        (answer.reliable && is_certain).then_some(answer)
    }
}

/// Returns whether two velocities may be one.
fn agree(one: Velocity, other: Velocity) -> bool {
    let [most, of_speed, of_angle] = AGREE;
    let turned = (one.degrees - other.degrees).abs();
    (one.mm_s - other.mm_s).abs() <= (most * one.mm_s_sd).max(of_speed * one.mm_s)
        && turned.min(360.0 - turned) <= (most * one.degrees_sd).max(of_angle)
}
