//! Why an event has no speed or no direction, or why its answers are not reliable.

use core::fmt;

use crate::touch::motion::Contact;

/// The reason why an event has no speed or no direction, or why its answers are not reliable.
///
/// A new reason stands at the end: the link numbers reasons in this order.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Reason {
    /// No speed by a law of durations: the baseline itself is above the threshold.
    BaselineAbove,
    /// No speed by a law of durations: no frame of the sample is above the threshold.
    NeverValid,
    /// No speed by a law of durations: the first or the last frame of the sample is valid. The slide lasted at least as
    /// long as the sample shows.
    CutOff {
        /// The law's speed for the duration that was seen, in mm/s. It is an upper bound, as good as the law is there,
        /// outside the range it was fitted on.
        at_most: Option<f32>,
    },
    /// No speed by a law of durations: the law has no finite speed for this duration.
    OutsideLaw,
    /// Neither speed nor direction: the touch is no slide, or none for certain.
    NoSlide(Contact),
    /// No direction by centroids: a row and a column never light up.
    NeverLit,
    /// No direction by centroids: rows and columns are about equally in order. The confidence is below 0.2.
    NoOrder,
    /// Not reliable: more than a tenth of the sample was lost and filled, or the filled frames hold too much of the
    /// touch.
    LostFrames,
    /// Not reliable: the frames of the sample came unevenly, or damaged. The core knows nothing of files: its caller
    /// says so.
    Uneven,
    /// Not reliable: the baseline was not quiet, or has a long gap.
    Baseline,
    /// Unclear: fewer than three rows and columns are lit, and not as by a poke.
    FewWhiskers,
    /// Unclear: the sample ends before the light has passed all whiskers alike.
    NotOver,
    /// Unclear: something slides so slowly that the sample does not show all whiskers.
    TooSlow,
    /// Unclear: the whiskers light up too nearly at once to tell a slide from a press.
    TooFast,
    /// Unclear or not reliable: the whiskers do not light up alike.
    NotAlike,
    /// Not reliable: the speed seems to change during the touch.
    SpeedChanges,
    /// Not reliable: not all whiskers are lit alike, or most are lit in the first frame.
    NotCrossed,
    /// Not reliable: a row or a column lights up too early or too late.
    OutOfLine,
    /// Not reliable: the standard deviation is too large.
    Uncertain,
    /// Unclear or not reliable: it depends on when the camera reads its rows, which nobody has stated.
    ReadoutUnknown,
    /// Not reliable: what slides also seems to turn.
    Turning,
    /// Not reliable: two objects seem to touch the sensor, and their velocity is not certain.
    TwoObjects,
    /// Not reliable: the camera takes more frames than were agreed on, so speeds are too low. Its caller says so.
    FasterCamera,
    /// Unclear: a held part seems to have slipped during the touch.
    Slips,
}

impl Reason {
    /// Returns the reason as a sentence, without the bound of [`Reason::CutOff`]. JSON output and `Display` use this
    /// sentence.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::BaselineAbove => "the baseline is above the speed threshold",
            Self::NeverValid => "no frame is above the speed threshold",
            Self::CutOff { .. } => "cut off: the sample starts or ends above the speed threshold",
            Self::OutsideLaw => "the speed law has no finite speed for this duration",
            // Not reached: a slide has speed and direction.
            Self::NoSlide(Contact::Slide) => "the touch is a slide",
            Self::NoSlide(Contact::Press) => "the touch is a press, which does not slide",
            Self::NoSlide(Contact::Poke) => "the touch is a poke, which does not slide",
            Self::NoSlide(Contact::Unclear) => "unclear: the touch is not certain to be a slide",
            Self::NeverLit => "unclear: a row and a column never light up",
            Self::NoOrder => "unclear: neither rows nor columns light up in order",
            Self::LostFrames => "too many frames of the touch were lost",
            Self::Uneven => "the frames of the touch come unevenly in the file, or are damaged there",
            Self::Baseline => "the baseline was not quiet, or frames of it were lost",
            Self::FewWhiskers => "too few whiskers are lit",
            Self::NotOver => "the sample ends during the touch: it is too slow, or it stays on the sensor",
            Self::TooSlow => "too slow: the sample does not show all whiskers",
            Self::TooFast => "too fast to tell a slide from a press",
            Self::NotAlike => "the whiskers do not light up alike: two touches, a change of speed or a tilted press",
            Self::SpeedChanges => "the speed seems to change during the touch, or the object's shape is not known",
            Self::NotCrossed => {
                "not all whiskers are lit alike: the touch starts on the sensor, or does not cross all of it"
            }
            Self::OutOfLine => "a row or a column lights up too early or too late, as by a weak whisker",
            Self::Uncertain => "the standard deviation of the speed is too large",
            Self::ReadoutUnknown => "readout unknown: it depends on [sensor] readout_ms, which is not stated",
            Self::Turning => "the object seems to turn while it slides, or its shape is not known",
            Self::TwoObjects => "two objects seem to touch the sensor, or the object's shape is not known",
            Self::Slips => "a held part seems to have slipped during the touch",
            Self::FasterCamera => "the camera takes more frames per second than were agreed on",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl core::error::Error for Reason {}

/// Numbers the reasons of a missing direction from 0, as boards and hosts do since before all reasons were of one type.
#[cfg(feature = "serde")]
pub(crate) mod of_direction {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::Reason;
    use crate::touch::motion::Contact;

    #[derive(Serialize, Deserialize)]
    enum Numbered {
        NeverLit,
        NoOrder,
        NoSlide(Contact),
    }

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives fields by reference")]
    pub(crate) fn serialize<S: Serializer>(degrees: &Result<f32, Reason>, serializer: S) -> Result<S::Ok, S::Error> {
        let numbered = degrees.map_err(|reason| match reason {
            Reason::NeverLit => Numbered::NeverLit,
            Reason::NoSlide(contact) => Numbered::NoSlide(contact),
            // By arrival times, the host gives the direction the speed's reason.
            _ => Numbered::NoOrder,
        });
        numbered.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Result<f32, Reason>, D::Error> {
        let degrees = Result::<f32, Numbered>::deserialize(deserializer)?;
        Ok(degrees.map_err(|reason| match reason {
            Numbered::NeverLit => Reason::NeverLit,
            Numbered::NoOrder => Reason::NoOrder,
            Numbered::NoSlide(contact) => Reason::NoSlide(contact),
        }))
    }
}
