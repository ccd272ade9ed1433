//! The answers of a pipeline: features, the event, and its motion, or its speed and direction as published. Each has
//! its own function, and a program links only those that it calls. So the function that a program calls is the law.

use wstac_core::paper::direction::direction;
use wstac_core::paper::speed;
use wstac_core::paper::trigger::Event;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::reason::Reason;
use wstac_core::touch::motion::{self, Contact, Motion, Velocity};

use crate::memory::{give, place, value, value_mut};
use crate::pipeline::{PipelineState, WstacFwPipeline};
use crate::status::{WstacFwBool, WstacFwStatus, status};

/// The number of numbers of a sample, frame by frame: feature k of frame t is number 10 t + k.
pub const WSTAC_FW_SAMPLE_NUMBERS: usize = 700;

const _: () = assert!(WSTAC_FW_SAMPLE_NUMBERS == FEATURES * SAMPLE_FRAMES);

/// A tactile event.
#[repr(C)]
pub struct WstacFwEvent {
    /// The number of the first frame of its sample. Feature frames are counted from 0.
    pub frame: u64,
    /// The number of the first lit frame of the touch; -1 if the trigger gives more than one event per touch.
    pub touch_frame: i64,
    /// The number of the first dark frame behind the touch; -1 if the light has not left, or if the trigger gives more
    /// than one event per touch.
    pub end_frame: i64,
    /// The number of frames of the sample that were lost, in whole or in part, and filled: 0 to 70.
    pub frames_filled: u8,
    /// Whether the event is reliable: the baseline was quiet and without a long gap, and at most a tenth of the sample
    /// was filled.
    pub reliable: bool,
}

/// The kind of a touch.
#[repr(i32)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum WstacFwContact {
    /// None of the others, or none for certain.
    Unclear = 0,
    /// Something slides: it arrives at one side and leaves at the other.
    Slide = 1,
    /// Something is pressed on all whiskers at once, or leaves them at once.
    Press = 2,
    /// One or two whiskers of a row and of a column are touched.
    Poke = 3,
}

/// The motion of a touch by arrival times, and its kind.
#[repr(C)]
pub struct WstacFwMotion {
    /// The kind of the touch: a WstacFwContact. Only a slide has a speed, a direction and a texture.
    pub contact: i32,
    /// Whether speed and direction mostly hold within their deviations; for a press or a poke, whether the event is
    /// reliable. wstac_fw_link_event refuses any other byte than 0 and 1.
    pub reliable: WstacFwBool,
    /// The speed in mm/s; 0 unless it slides.
    pub mm_s: f32,
    /// The standard deviation of the speed in mm/s; 0 unless it slides.
    pub mm_s_sd: f32,
    /// The direction in degrees, counterclockwise from +x: 0 to below 360; -1 unless it slides.
    pub degrees: f32,
    /// The standard deviation of the direction in degrees; 0 unless it slides.
    pub degrees_sd: f32,
    /// Why the touch is unclear, or why it is not reliable: a WstacFwWhy.
    pub why: i32,
}

/// The end of the touch of an event: its light has left.
#[repr(C)]
pub struct WstacFwContactEnd {
    /// The number of the first dark frame behind the touch.
    pub frame: u64,
    /// The number of the first frame of the event's sample.
    pub event_frame: u64,
}

/// The reason why an answer is missing or not reliable.
#[repr(i32)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum WstacFwWhy {
    /// The answer is there, and nothing is known against it.
    There = 0,
    /// The baseline itself is above the speed threshold.
    BaselineAbove = 1,
    /// No frame of the sample is above the speed threshold.
    NeverLit = 2,
    /// The sample starts or ends above the speed threshold, so the slide lasted longer.
    CutOff = 3,
    /// The speed law has no finite speed for this duration.
    OutsideLaw = 4,
    /// Neither rows nor columns light up in order.
    NoOrder = 5,
    /// Another reason, which this library has no number for.
    Other = 6,
    /// Not reliable: too many frames of the touch were lost.
    LostFrames = 7,
    /// Not reliable: the frames of the touch came unevenly, as the caller knows.
    Uneven = 8,
    /// Not reliable: the baseline was not quiet, or frames of it were lost.
    Baseline = 9,
    /// Unclear: too few whiskers are lit.
    FewWhiskers = 10,
    /// Unclear: the sample ends during the touch.
    NotOver = 11,
    /// Unclear: the sample does not show all whiskers.
    TooSlow = 12,
    /// Unclear: too fast to tell a slide from a press.
    TooFast = 13,
    /// Unclear or not reliable: the whiskers do not light up alike.
    NotAlike = 14,
    /// Not reliable: the speed seems to change during the touch.
    SpeedChanges = 15,
    /// Not reliable: the touch starts on the sensor, or does not cross all of it.
    NotCrossed = 16,
    /// Not reliable: a row or a column lights up too early or too late.
    OutOfLine = 17,
    /// Not reliable: the standard deviation of the speed is too large.
    Uncertain = 18,
    /// Unclear or not reliable: it depends on the readout, which is not known.
    ReadoutUnknown = 19,
    /// Not reliable: what slides seems to turn.
    Turning = 20,
    /// Not reliable: two objects seem to touch the sensor, and their velocity is not certain.
    TwoObjects = 21,
    /// Not reliable: the camera takes more frames than were agreed on, as the caller knows.
    FasterCamera = 22,
    /// Unclear: a held part seems to have slipped during the touch.
    Slips = 23,
}

impl WstacFwWhy {
    /// The reasons why a motion is unclear or not reliable.
    const OF_MOTION: [(Self, Reason); 17] = [
        (Self::LostFrames, Reason::LostFrames),
        (Self::Uneven, Reason::Uneven),
        (Self::Baseline, Reason::Baseline),
        (Self::FewWhiskers, Reason::FewWhiskers),
        (Self::NotOver, Reason::NotOver),
        (Self::TooSlow, Reason::TooSlow),
        (Self::TooFast, Reason::TooFast),
        (Self::NotAlike, Reason::NotAlike),
        (Self::SpeedChanges, Reason::SpeedChanges),
        (Self::NotCrossed, Reason::NotCrossed),
        (Self::OutOfLine, Reason::OutOfLine),
        (Self::Uncertain, Reason::Uncertain),
        (Self::ReadoutUnknown, Reason::ReadoutUnknown),
        (Self::Turning, Reason::Turning),
        (Self::TwoObjects, Reason::TwoObjects),
        (Self::FasterCamera, Reason::FasterCamera),
        (Self::Slips, Reason::Slips),
    ];

    fn of(doubt: Option<Reason>) -> Self {
        let Some(doubt) = doubt else { return Self::There };
        Self::OF_MOTION.iter().find(|(_, reason)| *reason == doubt).map_or(Self::Other, |(why, _)| *why)
    }

    /// Returns the reason with this number why an answer is unclear or not reliable; `None` if there is none.
    pub(crate) fn reason(number: i32) -> Option<Reason> {
        Self::OF_MOTION.iter().find(|(why, _)| *why as i32 == number).map(|(_, reason)| *reason)
    }
}

/// A sliding speed by a law of durations.
#[repr(C)]
pub struct WstacFwSpeed {
    /// Whether there is one, or the reason why not: a WstacFwWhy.
    pub why: i32,
    /// The speed in mm/s; 0 if there is none.
    pub mm_s: f32,
    /// The upper bound of the speed of a slide that is cut off, in mm/s, as far as the law is good there; 0 otherwise.
    pub at_most_mm_s: f32,
    /// The duration in frames from the first lit frame to the last: 0 to 69; -1 if no frame is lit.
    pub duration_frames: i16,
    /// Whether the speed is outside the range that the law was fitted on. wstac_fw_link_event refuses any other byte
    /// than 0 and 1.
    pub extrapolated: WstacFwBool,
}

/// A sliding direction by centroids.
#[repr(C)]
pub struct WstacFwDirection {
    /// Whether there is one, or the reason why not: a WstacFwWhy.
    pub why: i32,
    /// The direction in degrees: 0, 90, 180 or 270, counterclockwise from +x; -1 if there is none.
    pub degrees: i16,
    /// The confidence, 0 to 32768: 0 to 1 in units of 2^-15.
    pub confidence: u16,
}

/// A sample that a long gap has interrupted.
#[repr(C)]
pub struct WstacFwIncomplete {
    /// The number of its first frame.
    pub frame: u64,
    /// The number of its frames that had arrived: 1 to 69.
    pub frames: u8,
}

/// The state of a stream, or how it ended.
#[repr(C)]
pub struct WstacFwEnd {
    /// The number of feature frames on the time line, lost ones included.
    pub frames: u64,
    /// The number of the first frame of the sample that is under way.
    pub incomplete_frame: u64,
    /// The number of its frames that have arrived: 1 to 69; 0 if none is under way.
    pub incomplete_frames: u8,
    /// Whether the baseline is complete.
    pub baseline_complete: bool,
    /// Whether the baseline was quiet and without a long gap.
    pub baseline_quiet: bool,
}

/// Computes an answer for the present event and writes it.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `to` is null or memory for a `T`.
unsafe fn answer<T>(
    pipeline: *const WstacFwPipeline,
    to: *mut T,
    of: impl FnOnce(&Event<'_>, &PipelineState) -> T,
) -> WstacFwStatus {
    let answer = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { value(pipeline) }?;
        let to = place(to)?;
        let event = state.event().ok_or(WstacFwStatus::State)?;
        // SAFETY: the caller guarantees it.
        unsafe { give(to, of(&event, state)) }
    };
    status(answer())
}

/// Writes the ten features of the feature frame that the last call completed, as natural logarithms in units of 1/2048.
///
/// Returns WSTAC_FW_STATUS_NONE if the last call completed none. `frame`, which may be null, receives the frame's
/// number.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `features` is null or memory for 10 numbers; `frame` is null or memory
/// for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_features(
    pipeline: *const WstacFwPipeline,
    features: *mut i16,
    frame: *mut u64,
) -> WstacFwStatus {
    let give_features = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { value(pipeline) }?;
        let to = place(features)?.cast::<[i16; FEATURES]>();
        let Some((number, features)) = state.features else { return Ok(WstacFwStatus::None) };
        if !frame.is_null() {
            // SAFETY: the caller guarantees it.
            unsafe { give(frame, number) }?;
        }
        // SAFETY: the caller guarantees it; an array is aligned as its numbers.
        unsafe { give(to, features) }
    };
    status(give_features())
}

/// Returns the number of a frame, or -1.
fn signed(frame: Option<u64>) -> i64 {
    frame.map_or(-1, |frame| i64::try_from(frame).unwrap_or(i64::MAX))
}

/// Writes the event that the last call completed.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `event` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_event(pipeline: *const WstacFwPipeline, event: *mut WstacFwEvent) -> WstacFwStatus {
    let of = |event: &Event<'_>, _: &_| WstacFwEvent {
        frame: event.frame,
        touch_frame: signed(event.touch_frame),
        end_frame: signed(event.end_frame),
        frames_filled: event.frames_filled,
        reliable: event.reliable,
    };
    // SAFETY: the caller guarantees it.
    unsafe { answer(pipeline, event, of) }
}

/// Copies the event's sample to 700 numbers: features in units of 1/2048, frame by frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `sample` is null or memory for 700 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_sample(pipeline: *const WstacFwPipeline, sample: *mut i16) -> WstacFwStatus {
    let copy = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { value(pipeline) }?;
        let to = place(sample)?;
        let event = state.event().ok_or(WstacFwStatus::State)?;
        let frames = event.sample.frames().take(SAMPLE_FRAMES);
        for (number, feature) in frames.flatten().enumerate() {
            // SAFETY: there are 700 numbers (the caller), and no more are taken.
            let to = unsafe { to.add(number) };
            // SAFETY: the place is one of the 700 numbers.
            unsafe { to.write(*feature) };
        }
        Ok(WstacFwStatus::Ok)
    };
    status(copy())
}

/// Returns a motion as C has it.
fn in_c(event: &Event<'_>, motion: &Motion) -> WstacFwMotion {
    let (contact, reliable) = match motion.contact {
        Contact::Slide => (WstacFwContact::Slide, motion.reliable),
        Contact::Press => (WstacFwContact::Press, event.reliable),
        Contact::Poke => (WstacFwContact::Poke, event.reliable),
        _ => (WstacFwContact::Unclear, false),
    };
    let (contact, reliable, why) = (contact as i32, u8::from(reliable), WstacFwWhy::of(motion.doubt) as i32);
    let none = WstacFwMotion { contact, reliable, mm_s: 0.0, mm_s_sd: 0.0, degrees: -1.0, degrees_sd: 0.0, why };
    let Some(Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. }) = motion.velocity else { return none };
    WstacFwMotion { mm_s, mm_s_sd, degrees, degrees_sd, ..none }
}

/// Writes the event's motion by the coherence of arrival times: the law of `estimator = "coherence"`.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `motion` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_motion(
    pipeline: *const WstacFwPipeline,
    motion: *mut WstacFwMotion,
) -> WstacFwStatus {
    let of = |event: &Event<'_>, state: &PipelineState| in_c(event, &motion::by_coherence(event, state.motion));
    // SAFETY: the caller guarantees it.
    unsafe { answer(pipeline, motion, of) }
}

/// Writes the event's motion by rising edges: the law of `estimator = "edges"`. It takes fewer instructions and less
/// stack than wstac_fw_motion, and is less accurate.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `motion` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_motion_by_edges(
    pipeline: *const WstacFwPipeline,
    motion: *mut WstacFwMotion,
) -> WstacFwStatus {
    let of = |event: &Event<'_>, state: &PipelineState| in_c(event, &motion::by_edges(event, state.motion));
    // SAFETY: the caller guarantees it.
    unsafe { answer(pipeline, motion, of) }
}

/// Writes the event's sliding speed by a law of durations: the published one, or that of wstac_fw_set_speed_law. It
/// holds for specimens of one length only.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `speed` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_speed(pipeline: *const WstacFwPipeline, speed: *mut WstacFwSpeed) -> WstacFwStatus {
    let of = |event: &Event<'_>, state: &PipelineState| {
        let frames = speed::duration(event, &state.speed).map_or(-1, |duration| i16::from(duration.frames()));
        let none = WstacFwSpeed {
            why: WstacFwWhy::There as i32,
            mm_s: 0.0,
            at_most_mm_s: 0.0,
            duration_frames: frames,
            extrapolated: 0,
        };
        match speed::speed(event, &state.speed) {
            Ok(speed) => WstacFwSpeed { mm_s: speed.mm_s, extrapolated: u8::from(speed.extrapolated), ..none },
            Err(Reason::BaselineAbove) => WstacFwSpeed { why: WstacFwWhy::BaselineAbove as i32, ..none },
            Err(Reason::NeverValid) => WstacFwSpeed { why: WstacFwWhy::NeverLit as i32, ..none },
            Err(Reason::CutOff { at_most }) => {
                WstacFwSpeed { why: WstacFwWhy::CutOff as i32, at_most_mm_s: at_most.unwrap_or(0.0), ..none }
            }
            Err(Reason::OutsideLaw) => WstacFwSpeed { why: WstacFwWhy::OutsideLaw as i32, ..none },
            Err(_) => WstacFwSpeed { why: WstacFwWhy::Other as i32, ..none },
        }
    };
    // SAFETY: the caller guarantees it.
    unsafe { answer(pipeline, speed, of) }
}

/// Writes the event's sliding direction by centroids, as published: one of four.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `to` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_direction(
    pipeline: *const WstacFwPipeline,
    to: *mut WstacFwDirection,
) -> WstacFwStatus {
    let of = |event: &Event<'_>, _: &_| {
        let found = direction(event);
        let why = match found.degrees {
            Ok(_) => WstacFwWhy::There,
            Err(Reason::NeverLit) => WstacFwWhy::NeverLit,
            Err(Reason::NoOrder) => WstacFwWhy::NoOrder,
            Err(_) => WstacFwWhy::Other,
        };
        let degrees = found.heading().map_or(-1, |heading| heading.degrees().cast_signed());
        WstacFwDirection { why: why as i32, degrees, confidence: found.confidence.unwrap_or(0) }
    };
    // SAFETY: the caller guarantees it.
    unsafe { answer(pipeline, to, of) }
}

/// Writes what a pipeline gives once, if it is there.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `to` is null or memory for a `T`.
unsafe fn take<T>(
    pipeline: *mut WstacFwPipeline,
    to: *mut T,
    of: impl FnOnce(&mut PipelineState) -> Option<T>,
) -> WstacFwStatus {
    let take = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { value_mut(pipeline) }?;
        let to = place(to)?;
        let found = of(state).ok_or(WstacFwStatus::None)?;
        // SAFETY: the caller guarantees it.
        unsafe { give(to, found) }
    };
    status(take())
}

/// Writes the sample that a long gap has interrupted, once.
///
/// Returns WSTAC_FW_STATUS_NONE if there is none. A gap is known to be long when the frame behind it arrives.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `incomplete` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_take_interrupted(
    pipeline: *mut WstacFwPipeline,
    incomplete: *mut WstacFwIncomplete,
) -> WstacFwStatus {
    let of = |state: &mut PipelineState| {
        state.interrupted.take().map(|sample| WstacFwIncomplete { frame: sample.frame, frames: sample.frames })
    };
    // SAFETY: the caller guarantees it.
    unsafe { take(pipeline, incomplete, of) }
}

/// Writes the end of the touch of an event, once.
///
/// Returns WSTAC_FW_STATUS_NONE if there is none. The end of a short touch is known with its event, that of a long one
/// later. Until then no other event starts. A trigger with more than one event per touch gives none.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `to` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_take_contact_end(
    pipeline: *mut WstacFwPipeline,
    to: *mut WstacFwContactEnd,
) -> WstacFwStatus {
    let of = |state: &mut PipelineState| {
        state.contact_end.take().map(|end| WstacFwContactEnd { frame: end.frame, event_frame: end.event_frame })
    };
    // SAFETY: the caller guarantees it.
    unsafe { take(pipeline, to, of) }
}

/// Writes the state of the stream; after wstac_fw_finish, how it ended.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `end` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_end(pipeline: *const WstacFwPipeline, end: *mut WstacFwEnd) -> WstacFwStatus {
    let give_end = || {
        // SAFETY: the caller guarantees it.
        let state = unsafe { value(pipeline) }?;
        let found = state.pipeline.end();
        let given = WstacFwEnd {
            frames: found.frames,
            incomplete_frame: found.incomplete.map_or(0, |sample| sample.frame),
            incomplete_frames: found.incomplete.map_or(0, |sample| sample.frames),
            baseline_complete: found.baseline_complete,
            baseline_quiet: found.baseline_quiet,
        };
        // SAFETY: the caller guarantees it.
        unsafe { give(end, given) }
    };
    status(give_end())
}
