//! Checks the numbers of a message: a value that nothing can have is no answer, whatever its checksum says.

use core::fmt;
use core::num::NonZeroU8;
use core::ops::RangeInclusive;

use super::{Answers, Hello, Message, SAMPLE_PART, TextureAnswer};
use crate::features::Features;
use crate::paper::direction::Direction;
use crate::paper::speed::Speed;
use crate::paper::trigger::{InterruptedSample, StreamEnd};
use crate::params::{LONGEST_FILLED_GAP, SAMPLE_FRAMES};
use crate::reason::Reason;
use crate::touch::motion::{Contact, Velocity};
use crate::touch::wave::{Extent, Measured};

/// The largest frame number and count: 2^53, the last up to which JSON's numbers are exact. At 1000 frames per second
/// it is reached after 285,000 years.
const MOST: u64 = 1 << 53;
/// The largest feature in units of 2^-11: ln 5, and one unit for rounding.
const BRIGHTEST: i16 = 3297;
/// The confidence 1 in units of 2^-15.
const CERTAIN: u16 = 1 << 15;
/// The least that a reliable speed is of its standard deviation: no law calls one reliable that is less sure.
const LEAST_SURE: f32 = 10.0;
/// The highest frame rate, in frames per second.
const FASTEST: f64 = 100_000.0;

/// The temperatures of a chip in tenths of a degree Celsius, wider than any runs at.
const TEMPERATURES: RangeInclusive<i16> = -1000..=2000;

/// A quantity of a message whose value is impossible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Quantity {
    /// The number of a frame, a count of frames of the stream, or a time.
    FrameNumber,
    /// A number of frames of a sample or a touch.
    SampleFrames,
    /// A feature.
    Feature,
    /// A speed.
    Speed,
    /// A direction.
    Direction,
    /// A standard deviation.
    Deviation,
    /// A confidence.
    Confidence,
    /// The kind of a touch, which contradicts the other answers.
    Contact,
    /// The frame rate of a camera.
    FrameRate,
    /// The number of classes of a model.
    Classes,
    /// The temperature of a chip.
    Temperature,
    /// A number of slides from which a texture is learned.
    Slides,
    /// The reliability of an event, which contradicts its other answers.
    Reliability,
    /// The strength of a slip.
    Strength,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::FrameNumber => "frame number",
            Self::SampleFrames => "number of frames",
            Self::Feature => "feature",
            Self::Speed => "speed",
            Self::Direction => "direction",
            Self::Deviation => "standard deviation",
            Self::Confidence => "confidence",
            Self::Contact => "kind of touch",
            Self::FrameRate => "frame rate",
            Self::Classes => "number of classes",
            Self::Temperature => "temperature",
            Self::Slides => "number of slides",
            Self::Reliability => "reliability",
            Self::Strength => "strength",
        })
    }
}

/// Returns the first quantity of a message that is impossible as an error.
pub(super) fn check(message: &Message<'_>) -> Result<(), Quantity> {
    match message {
        Message::Hello(hello) => check_hello(hello),
        Message::Features { frame, features } => number(*frame).and_then(|()| check_features(features)),
        Message::SamplePart { frame, first, features } => {
            number(*frame)?;
            let is_part = usize::from(*first) < SAMPLE_FRAMES && usize::from(*first).is_multiple_of(SAMPLE_PART);
            ensure(is_part, Quantity::SampleFrames)?;
            features.iter().try_for_each(check_features)
        }
        Message::Event(answers) => check_answers(answers),
        Message::Texture { frame, frames, texture } => {
            number(*frame)?;
            count(*frames, 1..=SAMPLE_FRAMES)?;
            check_texture(texture)
        }
        Message::InterruptedSample(sample) => check_interrupted(sample),
        Message::Lost { frames } => number(*frames),
        Message::Fault(_) => Ok(()),
        Message::Status { stream, dropped } | Message::End { stream, dropped } => {
            number(*dropped).and_then(|()| check_stream(stream))
        }
        Message::ContactEnd(end) => {
            number(end.frame).and_then(|()| ensure(end.event_frame <= end.frame, Quantity::FrameNumber))
        }
        Message::Slip(slip) => {
            number(slip.frame)?;
            let is_ordered = slip.held_since_frame <= slip.onset_frame && slip.onset_frame <= slip.frame;
            ensure(is_ordered, Quantity::FrameNumber)?;
            ensure(slip.strength > 0.0 && slip.strength.is_finite(), Quantity::Strength)
        }
        Message::Telemetry(telemetry) => {
            number(telemetry.uptime_ms)?;
            telemetry.last_frame.map_or(Ok(()), |last| number(last.frame).and_then(|()| number(last.board_us)))?;
            ensure(telemetry.temperature.is_none_or(|tenths| TEMPERATURES.contains(&tenths)), Quantity::Temperature)
        }
        Message::Motion { frame, velocity, .. } => number(*frame).and_then(|()| check_velocity(velocity)),
        Message::PicturePart(part) => number(part.frame),
        // The host's own time comes back as it was sent.
        Message::Time { board_us, .. } => number(*board_us),
        // The parts, which are counted where a picture is put together, show whether it is possible.
        Message::PictureEnd(_) | Message::Bootloader(_) => Ok(()),
        // Settings check themselves as they are read. Sizes and checksums may be anything: the host compares them.
        Message::Settings(_) | Message::Set(_) | Message::Model(_) => Ok(()),
        #[cfg(not(feature = "learn"))]
        Message::Learning(never) | Message::Textures(never) => match *never {},
        #[cfg(feature = "learn")]
        Message::Learning(learning) => check_learning(learning),
        #[cfg(feature = "learn")]
        Message::Textures(textures) => textures.learning.as_ref().map_or(Ok(()), check_learning),
    }
}

fn ensure(is_possible: bool, quantity: Quantity) -> Result<(), Quantity> {
    if is_possible { Ok(()) } else { Err(quantity) }
}

fn number(frame: u64) -> Result<(), Quantity> {
    ensure(frame <= MOST, Quantity::FrameNumber)
}

fn count(frames: u8, possible: RangeInclusive<usize>) -> Result<(), Quantity> {
    ensure(possible.contains(&usize::from(frames)), Quantity::SampleFrames)
}

fn speed(mm_s: f32) -> Result<(), Quantity> {
    ensure(mm_s > 0.0 && mm_s.is_finite(), Quantity::Speed)
}

fn degrees(degrees: f32) -> Result<(), Quantity> {
    ensure((0.0..360.0).contains(&degrees), Quantity::Direction)
}

fn deviation(sd: f32) -> Result<(), Quantity> {
    ensure(sd >= 0.0 && sd.is_finite(), Quantity::Deviation)
}

fn confidence(confidence: u16) -> Result<(), Quantity> {
    ensure(confidence <= CERTAIN, Quantity::Confidence)
}

fn check_hello(hello: &Hello<'_>) -> Result<(), Quantity> {
    number(hello.frame)?;
    ensure(hello.rate.per_second() <= FASTEST, Quantity::FrameRate)?;
    hello.models.iter().flatten().try_for_each(|model| {
        ensure(model.classes > 0, Quantity::Classes)?;
        count(model.frames, 1..=SAMPLE_FRAMES)
    })
}

fn check_features(features: &Features) -> Result<(), Quantity> {
    ensure(features.iter().all(|&feature| feature <= BRIGHTEST), Quantity::Feature)
}

fn check_answers(answers: &Answers<'_>) -> Result<(), Quantity> {
    number(answers.frame)?;
    if let Some(touch) = answers.touch {
        // The touch of an event that is older than an i16 can count begins at its least value.
        ensure(answers.frame.checked_add_signed(touch.into()).is_some(), Quantity::FrameNumber)?;
        ensure(i64::from(touch) <= SAMPLE_FRAMES as i64, Quantity::SampleFrames)?;
    }
    count(answers.end.unwrap_or(0), 0..=SAMPLE_FRAMES)?;
    count(answers.duration.unwrap_or(0), 0..=SAMPLE_FRAMES - 1)?;
    count(answers.frames_filled, 0..=SAMPLE_FRAMES)?;
    count(answers.frames.map_or(1, NonZeroU8::get), 1..=SAMPLE_FRAMES - 1)?;
    match answers.speed {
        Ok(Speed { mm_s, sd, .. }) => speed(mm_s).and_then(|()| deviation(sd.unwrap_or(0.0)))?,
        Err(reason) => check_reason(reason)?,
    }
    answers.doubt.map_or(Ok(()), check_reason)?;
    let Direction { degrees: angle, sd, confidence: certainty } = answers.direction;
    degrees(angle.unwrap_or(0.0))?;
    deviation(sd.unwrap_or(0.0))?;
    confidence(certainty.unwrap_or(0))?;
    if let (Some(touch), Some(end)) = (answers.touch, answers.end) {
        ensure(touch < i16::from(end), Quantity::SampleFrames)?;
    }
    ensure(
        match answers.contact {
            None => true,
            Some(Contact::Slide) => answers.speed.is_ok() == angle.is_ok(),
            Some(_) => answers.speed.is_err() && angle.is_err(),
        },
        Quantity::Contact,
    )?;
    let has_place = answers.extent.is_some_and(|extent| extent.place_mm.is_some() || extent.width_mm.is_some());
    let has_velocity = answers.speed.is_ok() && angle.is_ok();
    ensure(has_velocity || (answers.basis.is_none() && !has_place), Quantity::Contact)?;
    answers.extent.as_ref().map_or(Ok(()), check_extent)?;
    ensure(!answers.reliable || may_be_reliable(answers), Quantity::Reliability)?;
    answers.textures.iter().flatten().try_for_each(check_texture)
}

/// Returns whether nothing else in the answers says that they are not reliable.
fn may_be_reliable(answers: &Answers<'_>) -> bool {
    let is_sure = |velocity: Velocity| velocity.mm_s_sd * LEAST_SURE <= velocity.mm_s;
    let is_clear = match answers.contact {
        None | Some(Contact::Press | Contact::Poke) => true,
        Some(Contact::Slide) => answers.velocity().is_some_and(is_sure),
        Some(Contact::Unclear) => false,
    };
    is_clear && answers.doubt.is_none() && u32::from(answers.frames_filled) <= LONGEST_FILLED_GAP
}

fn check_reason(reason: Reason) -> Result<(), Quantity> {
    match reason {
        Reason::CutOff { at_most: Some(mm_s) } => speed(mm_s),
        _ => Ok(()),
    }
}

fn check_extent(extent: &Extent) -> Result<(), Quantity> {
    ensure(extent.contacts <= 2, Quantity::Contact)?;
    for Measured { value, sd } in [extent.place_mm, extent.width_mm].into_iter().flatten() {
        ensure(value.is_finite(), Quantity::Deviation)?;
        deviation(sd)?;
    }
    deviation(extent.width_mm.map_or(0.0, |width| width.value))
}

fn check_texture(texture: &TextureAnswer<'_>) -> Result<(), Quantity> {
    confidence(texture.confidence.unwrap_or(0))
}

fn check_velocity(velocity: &Velocity) -> Result<(), Quantity> {
    speed(velocity.mm_s)?;
    deviation(velocity.mm_s_sd)?;
    degrees(velocity.degrees)?;
    deviation(velocity.degrees_sd)
}

fn check_interrupted(sample: &InterruptedSample) -> Result<(), Quantity> {
    number(sample.frame)?;
    count(sample.frames, 0..=SAMPLE_FRAMES - 1)
}

#[cfg(feature = "learn")]
fn check_learning(learning: &super::Learning) -> Result<(), Quantity> {
    ensure(learning.needed > 0 && learning.slides <= learning.needed, Quantity::Slides)
}

fn check_stream(stream: &StreamEnd) -> Result<(), Quantity> {
    number(stream.frames)?;
    stream.incomplete.as_ref().map_or(Ok(()), check_interrupted)
}
