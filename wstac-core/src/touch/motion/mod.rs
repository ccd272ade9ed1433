//! Speed and direction of anything that slides, from arrival times, and the kind of a touch (SPEC §9).
//!
//! Whiskers stand a pitch apart. The same light passes the five rows, and the five columns, one after the other. The
//! slowness, in frames per pitch along either axis, gives speed and direction: no specimen length and no fitted law.
//! Two estimators differ in cost and accuracy. [`by_coherence`] finds the slowness at which the five signals of an
//! axis, shifted back, are most alike. [`by_edges`] fits a straight line through five rising edges.
//!
//! A straight edge that is not at right angles to its motion gives only the motion across the edge.

mod axis;
mod contact;
mod edges;
mod live;
pub(crate) mod readout;
mod shape;
mod shift;
mod smooth;
mod sqrt;

use crate::error::ConfigError;
use crate::paper::trigger::Event;
use crate::params::{LONGEST_FILLED_GAP, NOMINAL_FRAME_RATE, PITCH_MM, ROWS};
use crate::rate::FrameRate;
use crate::reason::Reason;
use axis::Axis;
pub use contact::Contact;
pub use live::{LiveContact, LiveMotion, LiveWave};
pub use readout::{Readout, ReadoutTime, RowOrder};
pub(crate) use smooth::smooth;
pub(crate) use sqrt::sqrt;

/// A speed and a direction, each with its standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Velocity {
    /// Speed in mm/s.
    pub mm_s: f32,
    /// Standard deviation of the speed, in mm/s.
    pub mm_s_sd: f32,
    /// Direction in degrees, counterclockwise from the right along the sensor's rows: 0 ≤ degrees < 360.
    pub degrees: f32,
    /// Standard deviation of the direction, in degrees.
    pub degrees_sd: f32,
}

impl Velocity {
    /// Returns the standard deviation of the speed, in mm/s, as [`Speed`](crate::paper::speed::Speed) calls it.
    pub const fn sd(&self) -> f32 {
        self.mm_s_sd
    }

    /// Returns a velocity along a unit vector, with the deviations of the speed as a fraction and of the angle in
    /// radians.
    pub(crate) fn along(right: f32, up: f32, mm_s: f32, [of_speed, of_angle]: [f32; 2]) -> Self {
        let degrees_sd = of_angle * (180.0 / core::f32::consts::PI);
        Self { mm_s, mm_s_sd: mm_s * of_speed, degrees: degrees(right, up), degrees_sd }
    }
}

/// The motion of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Motion {
    /// The kind of the touch.
    pub contact: Contact,
    /// Speed and direction; `None` unless it slides, and by a wave if they change.
    pub velocity: Option<Velocity>,
    /// How well one shape and one slowness explain the lines of the worse axis, 0 to 1. 0 if fewer than three lines of
    /// an axis are lit.
    ///
    /// By coherence it is the explained part of the lines' energy. By edges it is 1 less the mean square deviation of
    /// the arrival times from their straight line, in units of (1 + |slowness|)² frames². By a wave it is 0.
    pub coherence: f32,
    /// Whether speed and direction mostly hold within their standard deviations.
    pub reliable: bool,
    /// Why the touch is unclear, or why its answers are not reliable: the first reason that holds; `None`
    /// if they are, and of a press or a poke, which is clear without them.
    pub doubt: Option<Reason>,
}

/// The parameters of the motion estimators.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionConfig {
    /// Distance between neighboring whiskers in mm.
    pitch_mm: f32,
    /// Speed in mm/s of a slowness of one frame per pitch.
    pitch_per_frame: f32,
    readout: Readout,
}

/// Slowness in frames per pitch below which a touch is a press: all whiskers are reached at once. From the second
/// number on it is a slide. At a pitch of 4 mm and 30 frames per second they are 1,200 and 706 mm/s. With fewer frames
/// per second, a press is still above 300 pitches per second: slides may be faster than frames tell.
const LEAST_SLIDE: [f32; 2] = [0.1, 0.17];
const LEAST_PRESS: f32 = 300.0;
/// Most slowness that a press may have by some readout, if that is unknown: 545 mm/s.
const MOST_PRESS: f32 = 0.22;
/// Slowness in frames per pitch above which a sample does not show all whiskers.
const MOST_SLOWNESS: f32 = 13.0;
/// Coherence from which a touch has one shape, and from which its velocity is reliable.
const ALIKE: f32 = 0.9;
const RELIABLE: f32 = 0.97;

/// How standard deviations follow from what a fit leaves over, and how large they may be. Fitted on simulated slides.
struct Deviations {
    /// Points of slowness in frames per pitch and factor.
    factors: &'static [[f32; 2]],
    /// Points of slowness, and how much smaller the deviation across the motion is than along it.
    across: &'static [[f32; 2]],
    /// Deviation of the slowness that every slide has, in frames per pitch.
    least: f32,
    /// Largest deviation of a reliable speed, as a fraction of it.
    most: f32,
}

/// Deviations of [`by_coherence`].
const BY_COHERENCE: Deviations = Deviations {
    factors: &[[0.2, 0.95], [0.27, 0.6], [4.0, 0.58], [8.0, 0.22]],
    across: &[[1.5, 0.82], [3.0, 0.71]],
    least: 0.0,
    most: 0.06,
};
/// Deviations of [`by_edges`].
const BY_EDGES: Deviations =
    Deviations { factors: &[[5.0, 0.62], [10.0, 0.5]], across: &[[1.5, 0.92], [3.0, 0.8]], least: 0.008, most: 0.03 };
/// Largest distance of a line's arrival time from the straight line of a reliable velocity: as a fraction of the
/// slowness, and in frames. A dead whisker moves its row or column by up to half the slowness.
const FARTHEST: [f32; 2] = [0.16, 0.01];
/// Deviation of the slowness by one filled frame, in frames per pitch. That of more is a root of their number higher.
const FILLED: f32 = 0.02;
/// Largest change of a reliable slowness within a touch: as a fraction of it, and in frames. Whatever stops, changes
/// its speed or is two touches changes more.
const CHANGE: [f32; 2] = [0.04, 0.004];

impl MotionConfig {
    /// Creates the parameters from the distance between neighboring whiskers in mm and the camera's frame rate.
    ///
    /// The readout is unknown, since most cameras have a rolling shutter: see [`MotionConfig::with_readout`].
    ///
    /// # Errors
    /// Returns [`ConfigError::Pitch`] unless the pitch is above 0 and at most 1000 mm.
    pub const fn new(pitch_mm: f32, rate: FrameRate) -> Result<Self, ConfigError> {
        if !(pitch_mm > 0.0 && pitch_mm <= 1000.0) {
            return Err(ConfigError::Pitch(pitch_mm));
        }
        Ok(Self::of_pitch(pitch_mm, rate))
    }

    /// Creates the parameters for the paper's sensor: a pitch of 4 mm, and an unknown readout.
    pub const fn published(rate: FrameRate) -> Self {
        Self::of_pitch(PITCH_MM, rate)
    }

    const fn of_pitch(pitch_mm: f32, rate: FrameRate) -> Self {
        let pitch_per_frame = pitch_mm * NOMINAL_FRAME_RATE as f32 / rate.nominal_frames();
        Self { pitch_mm, pitch_per_frame, readout: Readout::unknown(rate) }
    }

    /// Returns these parameters with another readout.
    ///
    /// With a known one, slides on a rolling shutter have the velocity of the light. With an unknown one, standard
    /// deviations cover what is possible, and a velocity that depends on it by more than 9 % or 9° is not reliable.
    #[must_use]
    pub const fn with_readout(self, readout: Readout) -> Self {
        Self { readout, ..self }
    }

    /// Returns the readout.
    pub const fn readout(self) -> Readout {
        self.readout
    }

    pub(crate) const fn pitch_mm(self) -> f32 {
        self.pitch_mm
    }

    /// Returns the speed in mm/s at which an edge takes one frame from a whisker to the next.
    pub const fn pitch_per_frame(self) -> f32 {
        self.pitch_per_frame
    }
}

/// Returns the motion of an event's touch by the coherence of its lines' signals.
///
/// Each line's light above the baseline is smoothed by a binomial filter of nine taps and scaled to its peak. From the
/// slowness of the rising edges, Gauss-Newton steps lead to the slowness at which the lines are most alike: they
/// minimize Σ_k Σ_t (x_k(t + k s) − g_k m(t))², with the mean shape m and the gain g_k of each line.
///
/// All sums are integers. The few operations after them are IEEE operations in 32 bits, which every processor rounds
/// alike.
///
/// ```
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{touch::motion::{self, Contact, MotionConfig}, taxels::FrameGeometry};
///
/// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
/// let mut pipeline = Pipeline::builder(geometry).build()?;
/// let config = MotionConfig::published(FrameRate::NOMINAL);
/// # let frames = (0..120).map(|t| vec![if t == 40 { 200 } else { 3_u8 }; 160_000]);
/// for frame in frames {
///     if let Some(event) = pipeline.push_frame(&frame)?.event() {
///         let motion = motion::by_coherence(&event, config);
///         // All taxels flashed at once.
///         assert_eq!((motion.contact, motion.velocity), (Contact::Press, None));
///     }
/// }
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
pub fn by_coherence(event: &Event<'_>, config: MotionConfig) -> Motion {
    motion(axis::by_coherence(event, 0), axis::by_coherence(event, ROWS), event, config, &BY_COHERENCE)
}

/// Returns the motion of an event's touch by the rising edges of its lines' signals.
///
/// An edge is where a line's light above the baseline first exceeds 30 % of its peak. A straight line through the edges
/// of the lit lines gives the slowness. It costs an eighth of [`by_coherence`], and errs more (docs/TRADE.md).
pub fn by_edges(event: &Event<'_>, config: MotionConfig) -> Motion {
    motion(axis::by_edges(event, 0), axis::by_edges(event, ROWS), event, config, &BY_EDGES)
}

// Small code counts here: it runs once per event.
#[inline(never)]
pub(crate) fn length(of: [f32; 2]) -> f32 {
    sqrt(squares(of))
}

fn squares([a, b]: [f32; 2]) -> f32 {
    a * a + b * b
}

/// Returns the factor at a slowness: on straight lines between the points, and even beyond them.
#[inline(never)]
fn between(points: &[[f32; 2]], slowness: f32) -> f32 {
    let Some(&[mut before, mut factor]) = points.first() else { return 1.0 };
    for &[at, then] in points {
        if slowness <= at {
            let share = if at > before { (slowness - before) / (at - before) } else { 1.0 };
            return factor + (then - factor) * share;
        }
        (before, factor) = (at, then);
    }
    factor
}

/// Returns what slownesses of rows, columns and both are, as far as the readout tells; or why that is unclear.
pub(crate) fn contact_at(each: [f32; 2], slowness: f32, config: MotionConfig) -> Result<Contact, Reason> {
    let [least, most] = config.readout.bounds(each, slowness);
    if least > MOST_SLOWNESS {
        Err(Reason::TooSlow)
    } else if least >= LEAST_SLIDE[1] {
        Ok(Contact::Slide)
    } else if most >= MOST_PRESS && !config.readout.is_known() {
        Err(Reason::ReadoutUnknown)
    } else if least < LEAST_SLIDE[0].min(config.pitch_per_frame / (LEAST_PRESS * config.pitch_mm)) {
        Ok(Contact::Press)
    } else {
        Err(Reason::TooFast)
    }
}

/// Puts both axes together.
fn motion(
    mut rows: Axis,
    mut columns: Axis,
    event: &Event<'_>,
    config: MotionConfig,
    deviations: &Deviations,
) -> Motion {
    let coherence = rows.coherence.min(columns.coherence);
    let readout = config.readout;
    let [of_rows, of_columns] = readout.delays();
    rows.slowness += of_rows;
    columns.slowness += of_columns;
    let each = [rows.slowness, columns.slowness];
    let slowness = length([rows.slowness, columns.slowness]);
    // An event per touch says whether the light has left.
    let is_over = event.touch_frame.is_none() || event.end_frame.is_some();
    let contact = if rows.lit.max(columns.lit) < 3 {
        if rows.lit.min(columns.lit) > 0 {
            Ok(Contact::Poke)
        } else {
            Err(if is_over { Reason::FewWhiskers } else { Reason::NotOver })
        }
    } else if coherence < ALIKE {
        Err(if event.touch_filled > 0 {
            Reason::LostFrames
        } else if is_over {
            Reason::NotAlike
        } else {
            Reason::NotOver
        })
    } else {
        contact_at(each, slowness, config)
    };
    let doubt = doubt_of_event(event).or(contact.err());
    let contact = contact.unwrap_or(Contact::Unclear);
    if contact != Contact::Slide {
        return Motion { contact, velocity: None, coherence, reliable: false, doubt };
    }
    // Each filled frame repeats the one before it, which moves edges.
    let least = length([deviations.least, FILLED * sqrt(f32::from(event.touch_filled))]);
    let (velocity, reach) = velocity(rows, columns, slowness, config, &Deviations { least, ..*deviations });
    let of_slide = if !is_steady(rows, columns, slowness) {
        Some(Reason::SpeedChanges)
    } else if !(rows.is_crossed && columns.is_crossed) {
        Some(Reason::NotCrossed)
    } else if !is_in_line(rows, columns, slowness) {
        Some(Reason::OutOfLine)
    } else if coherence < RELIABLE {
        Some(Reason::NotAlike)
    } else if readout::is_too_far(reach) {
        Some(Reason::ReadoutUnknown)
    } else if velocity.mm_s_sd < deviations.most * velocity.mm_s {
        None
    } else {
        Some(Reason::Uncertain)
    };
    let of_slide = of_slide.map(|reason| if event.touch_filled > 0 { Reason::LostFrames } else { reason });
    let doubt = doubt.or(of_slide);
    Motion { contact, velocity: Some(velocity), coherence, reliable: doubt.is_none(), doubt }
}

/// Returns why no answer about an event is reliable, whatever its touch is.
fn doubt_of_event(event: &Event<'_>) -> Option<Reason> {
    if event.reliable {
        return None;
    }
    let has_lost = u32::from(event.frames_filled) > LONGEST_FILLED_GAP;
    Some(if has_lost { Reason::LostFrames } else { Reason::Baseline })
}

/// Returns whether all lines light up in the order of a straight line, as far as a reliable velocity needs it.
#[inline(always)]
fn is_in_line(rows: Axis, columns: Axis, slowness: f32) -> bool {
    rows.farthest.max(columns.farthest) <= FARTHEST[0] * slowness + FARTHEST[1]
}

/// Returns whether the slowness changes so little within the touch as a reliable velocity needs it.
#[inline(always)]
fn is_steady(rows: Axis, columns: Axis, slowness: f32) -> bool {
    rows.change.max(columns.change) <= CHANGE[0] * slowness + CHANGE[1]
}

/// Returns speed and direction of a slowness above 0, in frames per pitch, and how far an unknown readout may move
/// them.
fn velocity(
    rows: Axis,
    columns: Axis,
    slowness: f32,
    config: MotionConfig,
    deviations: &Deviations,
) -> (Velocity, [f32; 2]) {
    // A difference, because the negative of 0 would give an angle of -0.
    let (right, up) = (columns.slowness / slowness, 0.0 - rows.slowness / slowness);
    let factor = between(deviations.factors, slowness);
    let sd = |axis: Axis| length([factor * length([axis.scatter, 2.0 * axis.sd]), deviations.least]) / slowness;
    let (right_sd, up_sd) = (sd(columns), sd(rows));
    let mm_s = config.pitch_per_frame / slowness;
    let reach = config.readout.reach(slowness, right, up);
    let along = length([right * right_sd, up * up_sd]);
    let across = length([up * right_sd, right * up_sd]) * between(deviations.across, slowness);
    let sd = [readout::widened(along, reach[0]), readout::widened(across, reach[1])];
    (Velocity::along(right, up, mm_s, sd), reach)
}

/// Returns the angle of a vector in degrees, counterclockwise from the right: 0 ≤ degrees < 360.
pub(crate) fn degrees(right: f32, up: f32) -> f32 {
    let degrees = libm::atan2f(up, right) * (180.0 / core::f32::consts::PI);
    let turned = if degrees < 0.0 { degrees + 360.0 } else { degrees };
    // A tiny negative angle rounds to a whole turn, and a negative zero is no angle.
    if turned >= 360.0 { 0.0 } else { turned + 0.0 }
}

#[cfg(test)]
mod tests;
