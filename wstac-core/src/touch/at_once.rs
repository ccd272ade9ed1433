//! Answers before samples are complete: as soon as the motion of a touch is certain, or the touch has ended (SPEC §9).

use crate::features::Features;
use crate::law::{Answer, EventLaw};
use crate::paper::trigger::{ContactEnd, Event};
use crate::params::{FEATURE_ONE, FEATURES, SLOW_DARK_FRAMES};
use crate::pipeline::Update;
use crate::reason::Reason;
use crate::touch::motion::{MotionConfig, Velocity};
use crate::touch::slip::SlipDetector;
use crate::touch::wave::Basis;

/// Frames from one try to the next.
const STEP: u8 = 2;
/// Two tries agree if they differ by at most so many standard deviations, or by a fraction of the speed and degrees.
const AGREE: [f32; 3] = [2.0, 0.02, 1.2];
/// So do the velocities of a block's two ends.
const ALIKE: [f32; 3] = [3.0, 0.03, 3.0];
/// The longest block whose two ends are one touch, and the most path on which one end gives light.
const LONGEST_MM: f32 = 120.0;
const OF_END_MM: f32 = 40.0;
/// The middle of a block glows if ten features together exceed those before its light by so much: 0.2 each.
const GLOWS: i32 = FEATURES as i32 * FEATURE_ONE / 5;
/// A velocity that is not reliable tells an end of a block if it is of at most so many mm per frame, with at most this
/// deviation as a fraction of it.
const SLOW: [f32; 2] = [1.0, 0.01];
/// The frames in which the default trigger fires, from the first lit frame of a touch on: its window, and a rest behind
/// the sample before.
const FIRES: u8 = 20;

/// Tries to answer the touch under way. The answers are the same on every processor.
///
/// After each frame a program asks [`answer`] about the touch or the event, and then [`end`](Self::end). Before it
/// reports an event, it reports what [`last_end`](Self::last_end) returns; behind an interrupted sample or before a new
/// baseline it calls [`restart`](Self::restart), and at the end of a stream [`finish`](Self::finish).
///
/// ```
/// use wstac_core::law::ByWave;
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{paper::trigger::TriggerConfig, taxels::FrameGeometry, touch::at_once::{AtOnce, answer}};
/// use wstac_core::touch::{motion::{MotionConfig, Readout}, slip::SlipDetector, taxel_ring::TaxelRing};
///
/// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
/// let trigger = TriggerConfig::default().one_event_per_touch();
/// let mut pipeline = Pipeline::builder(geometry).trigger(trigger).taxels::<TaxelRing>().build()?;
/// let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
/// let (law, mut at_once, mut slip) = (ByWave(config), AtOnce::new(config), SlipDetector::new(FrameRate::NOMINAL));
/// # let mut answered = Vec::new();
/// # // A narrow flash passes from left to right, a column every two frames.
/// # let frames = (0..130).map(|t| core::array::from_fn(|taxel| {
/// #     let (row, late) = (taxel / 5, t as f32 - 64.0 - 2.0 * (taxel % 5) as f32);
/// #     6000 + (180_000.0 * [0.0, 0.4, 1.0, 0.4, 0.0][row] * (-late * late / 3.0).exp()) as u32
/// # }));
/// for taxels in frames {
///     let update = pipeline.push_taxels(&taxels);
///     slip.push(&update);
///     let touch = update.touch().or(update.event());
///     let answer = touch.and_then(|touch| answer(&touch, &law, Some(&mut at_once), Some(&slip), |answer| *answer));
///     if let Some(answer) = answer {
///         // Speed, direction, …
/// #       answered.push((touch.unwrap().last_frame(), answer.velocity().unwrap().mm_s));
///         pipeline.answer_touch();
///     }
/// }
/// # assert!(matches!(answered[..], [(70..80, 59.0..61.0)]), "{answered:?}");
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AtOnce {
    seconds_per_frame: f32,
    /// The first frame of the sample that was tried last, and how many of its frames had arrived. Boards have little
    /// memory, so numbers of frames are their low bits.
    frame: u32,
    frames: u8,
    /// Whether the touch had ended at that try.
    is_over: bool,
    /// The last reliable velocity of these tries.
    found: Option<Velocity>,
    /// The slide of the sample that was tried last, if it was answered, and that of the sample before, unless the light
    /// of its other end has come.
    newest: Option<Answered>,
    slide: Option<Answered>,
    /// The first frames of the sample that shows this other end, or more light of a slow touch, and of the answered
    /// one's own.
    other_end: Option<[u32; 2]>,
    /// The first frame of the last event's sample, if its answer was not reliable, and the end of its light so far.
    slow: Option<[u32; 2]>,
    /// The end of a touch of which more light may come.
    ended: Option<ContactEnd>,
}

/// A slide that was answered.
#[derive(Clone, Copy, Debug)]
struct Answered {
    /// The first frame of its sample, and its first lit frame.
    frame: u32,
    touch_frame: u32,
    velocity: Velocity,
    /// The sum of ten features in the first frame of its sample.
    dark: i32,
}

impl Answered {
    fn glows(&self, features: Option<&Features>) -> bool {
        features.is_some_and(|features| sum(features) - self.dark > GLOWS)
    }
}

fn sum(features: &Features) -> i32 {
    features.iter().map(|&feature| i32::from(feature)).sum()
}

impl AtOnce {
    /// Creates the state before the first touch. The parameters are those of the law.
    pub const fn new(config: MotionConfig) -> Self {
        Self::of(config.pitch_mm() / config.pitch_per_frame())
    }

    const fn of(seconds_per_frame: f32) -> Self {
        Self {
            seconds_per_frame,
            frame: u32::MAX,
            frames: 0,
            is_over: false,
            found: None,
            newest: None,
            slide: None,
            other_end: None,
            slow: None,
            ended: None,
        }
    }

    /// Returns whether the law is to be asked about a touch.
    fn is_time<L: EventLaw>(&self, touch: &Event<'_>, law: &L) -> bool {
        if !L::ANSWERS_AT_ONCE || !law.answers_at_once() {
            return touch.is_event();
        }
        let frame = touch.frame as u32;
        // The light of a touch that has ended stays as it is.
        let is_early = frame == self.frame
            && (touch.frames < self.frames.saturating_add(STEP) || (self.is_over && !touch.is_under_way()));
        self.other_end.is_none_or(|[other, _]| other != frame) && (touch.is_event() || !is_early)
    }

    /// Takes the law's answer about a touch. Returns whether it is the answer about the touch.
    #[inline(never)]
    fn takes<L: EventLaw>(&mut self, touch: &Event<'_>, law: &L, answer: &Answer) -> bool {
        if !L::ANSWERS_AT_ONCE || !law.answers_at_once() {
            return true;
        }
        let frame = touch.frame as u32;
        if frame != self.frame {
            (self.slide, self.found) = (self.newest.take(), None);
        }
        let before = self.found;
        let found = answer.velocity().filter(|_| answer.reliable);
        (self.frame, self.frames, self.found) = (frame, touch.frames, found.or(before));
        self.is_over = !touch.is_under_way();
        let is_certain = self.is_over || before.zip(found).is_some_and(|(one, other)| agree(one, other, AGREE));
        if !(touch.is_event() || answer.reliable && is_certain) {
            return false;
        }
        let touch_frame = touch.touch_frame.unwrap_or(touch.frame) as u32;
        let first = touch.sample.frame(0);
        if let Some(slide) = self.slide.filter(|slide| self.path_mm(*slide, touch_frame) <= LONGEST_MM) {
            if answer.velocity().is_some_and(|of| agree(slide.velocity, of, ALIKE)) {
                return self.goes_on(frame, slide.frame);
            }
            // It may be the middle, or the other end that is cut off.
            if !answer.reliable && slide.glows(first) {
                self.goes_on(frame, slide.frame);
                self.newest = Some(slide);
                return false;
            }
        }
        if let Some([first, end]) = self.slow
            && found.is_none()
            && touch_frame.wrapping_sub(end) < u32::from(SLOW_DARK_FRAMES)
        {
            return self.goes_on(frame, first);
        }
        // A held part that slipped has no other end to wait for.
        self.slow = (!answer.reliable && answer.doubt != Some(Reason::Slips)).then_some([frame, frame]);
        // Of a slow edge the sample shows a part, which is not reliable alone.
        let is_slow = |of: &Velocity| {
            found.is_none() && of.mm_s * self.seconds_per_frame <= SLOW[0] && of.mm_s_sd <= SLOW[1] * of.mm_s
        };
        let edge = answer.velocity().filter(|of| answer.basis == Some(Basis::Edge) || is_slow(of));
        self.newest = edge.map(|velocity| Answered { frame, touch_frame, velocity, dark: first.map_or(0, sum) });
        true
    }

    /// Takes the end of light that an update brought. Returns the end of a touch, once no more light can be of it.
    ///
    /// It is to be called about every update, after its answer. An event has one end at most: that of its last light.
    // It is not inlined: what it holds would lie on the stack of the law.
    #[inline(never)]
    pub fn end(&mut self, update: &Update<'_>) -> Option<ContactEnd> {
        let now = update.number()?;
        let before = update.contact_end().and_then(|end| self.take_end(end, Some(update)));
        if before.is_some() || self.ended.is_none_or(|end| self.may_go_on(end, now, update.is_captured())) {
            return before;
        }
        self.last_end()
    }

    /// Takes the end of light that the end of a stream brought, if it did. Returns the ends of touches that are left.
    pub fn finish(&mut self, end: Option<ContactEnd>) -> [Option<ContactEnd>; 2] {
        [end.and_then(|end| self.take_end(end, None)), self.last_end()]
    }

    /// Returns the end of a touch of which more light might have come. From here on, such light is another touch.
    pub fn last_end(&mut self) -> Option<ContactEnd> {
        let end = self.ended.take()?;
        let event = end.event_frame as u32;
        for slide in [&mut self.newest, &mut self.slide] {
            slide.take_if(|slide| slide.frame == event);
        }
        self.slow.take_if(|[first, _]| *first == event);
        Some(end)
    }

    /// Forgets all touches, as behind an interrupted sample or before a new baseline. Returns the end of one of which
    /// more light might have come.
    #[must_use = "it is the end of a touch"]
    pub fn restart(&mut self) -> Option<ContactEnd> {
        let end = self.ended.take();
        *self = Self::of(self.seconds_per_frame);
        end
    }

    /// Takes note that a sample has light of the touch of an event before. Returns false.
    fn goes_on(&mut self, frame: u32, event: u32) -> bool {
        (self.newest, self.slide, self.other_end) = (None, None, Some([frame, event]));
        false
    }

    /// Takes an end of light as that of the event that was answered, and the update by which it was known. Returns the
    /// end of another event's touch.
    fn take_end(&mut self, end: ContactEnd, update: Option<&Update<'_>>) -> Option<ContactEnd> {
        let of_end = end.event_frame as u32;
        let slide = self.newest.filter(|slide| slide.frame == of_end);
        let long = slide.filter(|slide| self.path_mm(*slide, end.frame as u32) > OF_END_MM);
        // Both ends have passed if light lasts longer, unless a flat block's middle glows.
        let features = || update.and_then(Update::frame).map(|frame| frame.features);
        self.newest.take_if(|_| long.is_some_and(|slide| !slide.glows(features().as_ref())));
        let other_end = self.other_end.take_if(|other| other[0] == of_end);
        let since = other_end.map_or(0, |[_, event]| of_end.wrapping_sub(event));
        let end = ContactEnd { event_frame: end.event_frame.saturating_sub(since.into()), ..end };
        if let Some([first, last]) = &mut self.slow
            && *first == end.event_frame as u32
        {
            *last = end.frame as u32;
        }
        let before = self.ended.filter(|before| before.event_frame != end.event_frame);
        if before.is_some() {
            self.last_end();
        }
        self.ended = Some(end);
        before
    }

    /// Returns whether more light may come of a touch that has ended. Other light may have come that is not answered.
    fn may_go_on(&self, end: ContactEnd, now: u64, has_light: bool) -> bool {
        let (event, begins) = (end.event_frame as u32, now.saturating_sub(FIRES.into()));
        // The end of this light is still to come.
        if self.other_end.is_some_and(|[_, of]| of == event) {
            return true;
        }
        let goes_on =
            |slide: &Answered| slide.frame == event && (has_light || self.path_mm(*slide, begins as u32) <= LONGEST_MM);
        let is_dark = begins.saturating_sub(end.frame) >= SLOW_DARK_FRAMES.into();
        [&self.newest, &self.slide].into_iter().flatten().any(goes_on)
            || self.slow.is_some_and(|[first, _]| first == event && (has_light || !is_dark))
    }

    /// Returns how far something has slid up to a frame.
    fn path_mm(&self, slide: Answered, frame: u32) -> f32 {
        frame.wrapping_sub(slide.touch_frame) as f32 * self.seconds_per_frame * slide.velocity.mm_s
    }
}

/// Returns what `of` makes of the answer about a touch, if it is time: about one under way, if two tries found reliable
/// answers that agree; about one that has ended, if the answer is reliable; about an event in any case. It is always
/// time without `at_once`.
///
/// A touch in which the detector has reported a slip is unclear ([`Reason::Slips`]), unless it is a reliable slide. The
/// detector takes the frame's update before.
///
/// A flat block is dark while its middle is over the sensor. The light of its other end has no answer, since it is the
/// same touch: an edge or something slow, the same velocity, at most 120 mm later. Neither has light without a velocity
/// that follows an event without a reliable answer by less than 20 dark frames: a slow slide lights whiskers one by
/// one. An answer that the program does not take
/// ([`Pipeline::answer_touch`](crate::pipeline::Pipeline::answer_touch)) comes again with the next try.
///
/// Another law than that of a wave ([`EventLaw::answers_at_once`]) answers about events only, and about each.
///
/// Most frames cost nothing; a try costs what the law costs.
// `of` takes a reference, because a copy of the answer would take a board's stack.
pub fn answer<L: EventLaw, T>(
    touch: &Event<'_>,
    law: &L,
    at_once: Option<&mut AtOnce>,
    slip: Option<&SlipDetector>,
    of: impl FnOnce(&Answer) -> T,
) -> Option<T> {
    if at_once.as_ref().is_some_and(|at_once| !at_once.is_time(touch, law)) {
        return None;
    }
    let mut answer = law.answer(touch);
    if let Some(slip) = slip {
        slip.correct(touch, &mut answer);
    }
    at_once.is_none_or(|at_once| at_once.takes(touch, law, &answer)).then(|| of(&answer))
}

/// Returns whether two velocities may be one: so many standard deviations apart, or by a fraction of the speed and
/// degrees.
fn agree(one: Velocity, other: Velocity, [most, of_speed, of_angle]: [f32; 3]) -> bool {
    let turned = (one.degrees - other.degrees).abs();
    (one.mm_s - other.mm_s).abs() <= (most * one.mm_s_sd).max(of_speed * one.mm_s)
        && turned.min(360.0 - turned) <= (most * one.degrees_sd).max(of_angle)
}
