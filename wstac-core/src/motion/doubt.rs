//! Why a touch is unclear, or its answers are not reliable.

use core::fmt;

use super::axis::{self, Axis};
use super::{
    ALIKE, BY_COHERENCE, BY_EDGES, Contact, Deviations, MOST_SLOWNESS, MotionConfig, RELIABLE, is_in_line, is_steady,
    length, motion,
};
use crate::params::{LONGEST_FILLED_GAP, ROWS};
use crate::trigger::Event;

/// The reason why a touch is unclear, or why its answers are not reliable: the first that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Doubt {
    /// More than a tenth of the sample was lost and filled, or the filled frames hold too much of the touch.
    LostFrames,
    /// The frames of the sample came unevenly. The core knows nothing of times: its caller says so.
    Uneven,
    /// The baseline was not quiet, or has a long gap.
    Baseline,
    /// Fewer than three rows and columns are lit, and not as by a poke.
    FewWhiskers,
    /// The sample ends before the light has passed all whiskers alike.
    NotOver,
    /// Something slides so slowly that the sample does not show all whiskers.
    TooSlow,
    /// The whiskers light up too nearly at once to tell a slide from a press.
    TooFast,
    /// The whiskers do not light up alike.
    NotAlike,
    /// The speed changes during the touch.
    SpeedChanges,
    /// Not all whiskers are lit alike, or most are lit in the first frame.
    NotCrossed,
    /// A row or a column lights up too early or too late.
    OutOfLine,
    /// The standard deviation is too large.
    Uncertain,
}

impl Doubt {
    /// Returns the reason as a sentence. JSON output and `Display` use this sentence.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::LostFrames => "too many frames of the touch were lost",
            Self::Uneven => "the frames of the touch come unevenly in the file",
            Self::Baseline => "the baseline was not quiet, or frames of it were lost",
            Self::FewWhiskers => "too few whiskers are lit",
            Self::NotOver => "the sample ends during the touch: it is too slow, or it stays on the sensor",
            Self::TooSlow => "too slow: the sample does not show all whiskers",
            Self::TooFast => "too fast to tell a slide from a press",
            Self::NotAlike => "the whiskers do not light up alike: two touches, a change of speed or a tilted press",
            Self::SpeedChanges => "the speed changes during the touch",
            Self::NotCrossed => {
                "not all whiskers are lit alike: the touch starts on the sensor, or does not cross all of it"
            }
            Self::OutOfLine => "a row or a column lights up too early or too late, as by a weak whisker",
            Self::Uncertain => "the standard deviation of the speed is too large",
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Returns why the answers of [`by_coherence`](super::by_coherence) about an event are not reliable; `None` if they are.
///
/// It computes them again, so that nobody who does not ask pays for it.
pub fn doubt_by_coherence(event: &Event<'_>, config: MotionConfig) -> Option<Doubt> {
    doubt(axis::by_coherence(event, 0), axis::by_coherence(event, ROWS), event, config, &BY_COHERENCE)
}

/// Returns why the answers of [`by_edges`](super::by_edges) about an event are not reliable; `None` if they are.
pub fn doubt_by_edges(event: &Event<'_>, config: MotionConfig) -> Option<Doubt> {
    doubt(axis::by_edges(event, 0), axis::by_edges(event, ROWS), event, config, &BY_EDGES)
}

fn doubt(rows: Axis, columns: Axis, event: &Event<'_>, config: MotionConfig, deviations: &Deviations) -> Option<Doubt> {
    let found = motion(rows, columns, event, config, deviations);
    if !event.reliable {
        let has_lost = u32::from(event.frames_filled) > LONGEST_FILLED_GAP;
        return Some(if has_lost { Doubt::LostFrames } else { Doubt::Baseline });
    }
    match found.contact {
        Contact::Press | Contact::Poke => None,
        Contact::Slide if found.reliable => None,
        Contact::Slide => Some(of_slide(rows, columns, event)),
        Contact::Unclear => Some(of_unclear(rows, columns, event)),
    }
}

/// Returns why a touch is neither a slide nor a press nor a poke for certain.
fn of_unclear(rows: Axis, columns: Axis, event: &Event<'_>) -> Doubt {
    // An event per touch says whether the light has left.
    let is_over = event.touch_frame.is_none() || event.end_frame.is_some();
    if rows.lit.max(columns.lit) < 3 {
        if is_over { Doubt::FewWhiskers } else { Doubt::NotOver }
    } else if rows.coherence.min(columns.coherence) < ALIKE {
        if event.touch_filled > 0 {
            Doubt::LostFrames
        } else if is_over {
            Doubt::NotAlike
        } else {
            Doubt::NotOver
        }
    } else if length(rows.slowness, columns.slowness) > MOST_SLOWNESS {
        Doubt::TooSlow
    } else {
        Doubt::TooFast
    }
}

/// Returns why speed and direction of a slide may not hold. Whatever is left is the standard deviation.
fn of_slide(rows: Axis, columns: Axis, event: &Event<'_>) -> Doubt {
    let slowness = length(rows.slowness, columns.slowness);
    if event.touch_filled > 0 {
        Doubt::LostFrames
    } else if !is_steady(rows, columns, slowness) {
        Doubt::SpeedChanges
    } else if !(rows.is_crossed && columns.is_crossed) {
        Doubt::NotCrossed
    } else if !is_in_line(rows, columns, slowness) {
        Doubt::OutOfLine
    } else if rows.coherence.min(columns.coherence) < RELIABLE {
        Doubt::NotAlike
    } else {
        Doubt::Uncertain
    }
}
