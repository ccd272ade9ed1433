//! Speed and direction of anything that slides, from 25 taxels (SPEC §9, "By a wave").
//!
//! [`by_coherence`] takes a row for one line, so it needs an object as wide as the
//! sensor. A wave takes each whisker for itself: a ball, a coin, a rod or a narrow block lights some of them alike.
//!
//! Two contacts of one velocity, and a corner, have two planes of times instead.
//!
//! docs/ANSWERS.md has how often it answers, and errs, by kind of object. A slide that stops on the sensor is not
//! always refused, and then has the velocity before the stop.
//!
//! tests/firmware/budgets.toml has what it costs a board.

mod extent;
mod fit;
mod light;
mod outline;
mod pair;
mod squares;

use crate::paper::trigger::Event;
use crate::params::{PITCH_MM, SAMPLE_FRAMES, TAXELS};
use crate::reason::Reason;
use crate::touch::motion::{
    Contact, Motion, MotionConfig, Velocity, by_coherence, contact_at, degrees, length, readout, sqrt,
};
use crate::touch::taxel_ring::TaxelRing;
pub use extent::{Extent, Measured};
pub(crate) use fit::place_of;
use fit::{Wave as Fitted, Whisker, Whiskers};
use light::Lines;
use outline::{Outline, is_crossed, valley};
use pair::Pair;
pub(crate) use squares::sums;
use squares::{Fit, Normal, Polynomial, with_each};

/// What a velocity is known by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Basis {
    /// An edge that covers the sensor: only the motion across it is known.
    Edge,
    /// An object that is narrower than the sensor, two of one velocity, or a corner: the whole motion is known.
    Outline,
}

impl Basis {
    /// Returns the word of JSON and of bindings: `edge` or `outline`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Outline => "outline",
        }
    }
}

/// Fewest lit whiskers of a wave, and most of a poke.
const FEWEST: u32 = 5;
const MOST_OF_POKE: u32 = 2;
/// Fewest lit whiskers of one of two contacts.
const FEWEST_OF_CONTACT: u32 = 3;
/// A whisker is lit above an eighth of the brightest.
const LIT_SHIFT: u32 = 3;
/// Added to the slowness, in frames per pitch, where lateness is measured by it.
const LATE_FROM: f32 = 0.23;
/// Limits of the largest and the mean lateness; and those if all whiskers are lit.
const LATE: [[f32; 2]; 2] = [[0.09, 0.05], [0.12, 0.06]];
/// Most unexplained energy; and that if all whiskers are lit.
const MOST_MISS: [f32; 2] = [0.25, 0.05];
/// Slowness in frames per pitch above which a touch may be several flashes.
const SLOW: f32 = 4.0;
/// Most flashes of a slide that has one speed. More are taken for stick-slip.
const MOST_FLASHES: u32 = 6;
/// Change of slowness in frames that noise may make, if all whiskers are lit.
const NOISE_OF_CHANGE: f32 = 0.011;
/// Largest change of slowness of a third of the touch, as a fraction; and that if all whiskers are lit.
const MOST_CHANGE: [f32; 2] = [0.065, 0.025];
/// Largest change along the sensor as a fraction, in standard deviations, and as a fraction whatever these are; and
/// what is certain beyond both.
const ACCELERATION: [f32; 3] = [0.068, 2.5, 0.16];
const CERTAIN: [f32; 2] = [0.05, 5.0];
const TWIST: [f32; 2] = [0.12, 2.2];
/// Standard deviations of an outline's direction in degrees: up to the first it tells it, from the second on it does
/// not.
const OUTLINE: [f32; 2] = [8.0, 25.0];
/// Limits of the mean lateness if the velocity is to be that of the touch's end: by the slowness, if all light faded in
/// between, and in frames.
const UNEVEN: [f32; 2] = [0.012, 0.11];
/// Fewest whiskers that an edge lights, if its outline tells nothing.
const FEWEST_OF_EDGE: u32 = 19;
/// Largest lateness of such an edge, if its outline tells little.
const LATE_OF_EDGE: f32 = 0.04;
/// Largest standard deviations: of the speed as a fraction, and of the direction in radians; and the least of both.
const MOST_SD: [f32; 2] = [0.04, 0.1];
const LEAST_SD: [f32; 2] = [0.0002, 0.00053];
/// Slowness in frames per pitch below which frames are too few for a rising edge, and the part of what is missing to it
/// that is a deviation along the motion: of rods, whose edges are the sharpest.
const FEW_FRAMES: [f32; 2] = [0.3, 0.1];
/// Deviation of the slowness along the motion by a frame of the touch that was lost, in frames per pitch. That of more
/// is a root of their number higher.
const LOST: f32 = 0.005;
/// Parts of deviations along and across the motion, if whiskers are dark and if at most one is: the part of the
/// lateness; frames by which a whisker is late if nothing of its energy is explained; frames by which interpolation is
/// late where the light is between frames, which whiskers of one phase share, and do not show; times the mean square of
/// lateness without a dome, the square of the most that sharp edges are late by the phase; and frames per pitch that
/// nothing shows. Fitted on slides.
const FACTORS: [[[f32; 5]; 2]; 2] = [
    [[0.515, 0.0965, 0.0116, 0.0, 0.0], [1.08, 0.025, 0.004, 0.0, 0.0]],
    [[0.12, 0.345, 0.0047, 1.0, 0.0], [0.115, 0.182, 0.0062, 0.0, 0.00026]],
];
/// Times the square of what a flash lacks. Where this is 1, half of what is left of the lateness is by interpolation,
/// which has a term of its own.
const OF_PHASE: f32 = 600.0;
/// The deviation by which a changing speed is told: frames by which interpolation is late, and times the mean square of
/// lateness without a dome.
const BY_PHASES: [f32; 2] = [0.011, 1.5];
/// Limit of a change of slowness in a third of the touch, in these deviations; and times that of a change along the
/// sensor, without sharp edges.
const CHANGE_OF_PHASES: [f32; 2] = [2.3, 1.2];
/// How far the slowness across the motion of a third of the touch may be off, in standard deviations, if at most one
/// whisker is dark; and the parts of what is beyond that, which are deviations along and across the motion: an oblique
/// edge before ridges has two directions.
const TURN: [f32; 3] = [3.0, 0.1, 1.1];
/// Times the deviation of a corner's direction if the outline tells one, too: edges of a narrow thing are short.
const OF_NARROW: f32 = 2.0;
/// Frames by which a flash is late, times the square of what it lacks: 0.3 if it is all in one frame, about the sine in
/// a sawtooth of half a frame either way. Light that lasts until the next frame tells where in a frame it began.
const OF_FLASH: f32 = 4.1;
/// Times the deviations of speed and direction, if light of the touch is still to come.
const OF_CUT: [f32; 2] = [1.4, 1.7];
/// The variance of a slowness, in squares of that per pitch, if all whiskers have one phase: then nothing shows the
/// error.
const LOCKED: f32 = 0.06;
/// From the first to the last whisker of a row.
const SENSOR_MM: f32 = 4.0 * PITCH_MM;
/// The weight of a whisker whose gain is 1.
const ONE_WEIGHT: f32 = 4096.0;

/// The memory of a wave: about 3,900 bytes.
#[derive(Clone, Debug)]
pub struct Wave {
    lines: Lines,
    acceleration: Option<Measured>,
    /// Whether the velocity is also that of the touch's end: if light lasted, and if all of it faded in between, as it
    /// does where a slide sticks.
    pub(crate) is_even: [bool; 2],
}

impl Wave {
    /// Memory without a touch.
    pub const EMPTY: Self = Self { lines: Lines::EMPTY, acceleration: None, is_even: [false; 2] };

    /// Returns the velocity of the first touch in a sample of 25 taxels, and what it is known by.
    ///
    /// `samples` are up to 70 frames, oldest first, of which four are dark; `None` is a lost frame.
    ///
    /// # Errors
    /// Returns why there is no certain velocity.
    ///
    /// ```
    /// use wstac_core::{rate::FrameRate, touch::motion::{MotionConfig, Readout}, touch::wave::{Basis, Wave}};
    ///
    /// // A narrow flash passes from left to right, a column every two frames.
    /// let frames: Vec<[u16; 25]> = (0..40).map(|t| core::array::from_fn(|taxel| {
    ///     let (row, late) = (taxel / 5, t as f32 - 14.0 - 2.0 * (taxel % 5) as f32);
    ///     300 + (9000.0 * [0.0, 0.4, 1.0, 0.4, 0.0][row] * (-late * late / 3.0).exp()) as u16
    /// })).collect();
    /// let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    /// let mut wave = Wave::EMPTY;
    /// let (velocity, basis) = wave.fit(frames.iter().map(Some), config)?;
    /// assert_eq!(basis, Basis::Outline);
    /// assert!((velocity.mm_s - 60.0).abs() < 0.3 && velocity.degrees.min(360.0 - velocity.degrees) < 1.0);
    /// # Ok::<(), wstac_core::reason::Reason>(())
    /// ```
    pub fn fit<'a>(
        &mut self,
        samples: impl Iterator<Item = Option<&'a [u16; TAXELS]>>,
        config: MotionConfig,
    ) -> Result<(Velocity, Basis), Reason> {
        let found = self.found(samples, config);
        found.map_err(|reason| self.told(reason))
    }

    fn found<'a>(
        &mut self,
        samples: impl Iterator<Item = Option<&'a [u16; TAXELS]>>,
        config: MotionConfig,
    ) -> Result<(Velocity, Basis), Reason> {
        let answer = self.lines.read(samples).and_then(|()| self.answer(config))?;
        let (velocity, basis);
        (velocity, basis, self.acceleration, self.is_even) = answer;
        Ok((velocity, basis))
    }

    /// Returns the reason of an answer: many flashes, if a part of them is seen, are stick-slip.
    fn told(&self, reason: Reason) -> Reason {
        let sticks = self.lines.flashes > MOST_FLASHES && is_of_part(reason);
        if sticks { Reason::SpeedChanges } else { reason }
    }

    /// Returns where and how wide the touch is of which [`Wave::fit`] has just returned this velocity.
    ///
    /// A touch that was not over at the sample's end has neither a place nor a width.
    #[inline(never)]
    pub fn extent(&self, velocity: &Velocity) -> Extent {
        let extent = Extent::new(&self.lines.energies(), velocity.degrees, velocity.degrees_sd);
        if self.lines.is_cut { Extent { place_mm: None, width_mm: None, ..extent } } else { extent }
    }

    /// Returns the [acceleration](TaxelMotion::acceleration) of the touch of which [`Wave::fit`] has just returned a
    /// velocity.
    pub fn acceleration(&self) -> Option<Measured> {
        self.acceleration
    }

    /// Answers about the lines.
    #[inline(never)]
    fn answer(&self, config: MotionConfig) -> Result<Answer, Reason> {
        let peaks = &self.lines.peaks;
        let highest = peaks.iter().copied().max().unwrap_or(0);
        let is_lit = |peak: &i16| i32::from(*peak) << LIT_SHIFT > i32::from(highest);
        let lit = (0..).zip(peaks).fold(0_u32, |lit, (taxel, peak)| lit | u32::from(is_lit(peak)) << taxel);
        let count = lit.count_ones();
        if count < FEWEST {
            let is_poke = count <= MOST_OF_POKE;
            return Err(if is_poke { Reason::NoSlide(Contact::Poke) } else { Reason::FewWhiskers });
        }
        let outline = Outline::new(peaks);
        let [right, up] = extent::unit(outline.degrees);
        if let Some(side) = valley(peaks, right, up) {
            return self.of_contacts([lit & side, lit & !side], config);
        }
        let whiskers = Whiskers::new(&self.lines, lit);
        let reason = match self.of_wave(&whiskers, &outline, count, config) {
            Err(reason @ (Reason::SpeedChanges | Reason::Turning | Reason::NotAlike | Reason::NotOver)) => reason,
            // A slow edge that is nearly along a line of whiskers reaches the next line later, perhaps behind the
            // sample.
            Ok(_) if self.lines.later & !lit != 0 && is_line(lit) => return Err(Reason::NotCrossed),
            answer => {
                return answer.map(|(velocity, basis, acceleration, is_even)| {
                    (velocity, basis, acceleration, is_even.map(|is_even| is_even && !is_line(lit)))
                });
            }
        };
        let mut pair = Pair::of_corner(&whiskers, lit, delays(config)).ok_or(reason)?;
        pair.sd[1] *= if outline.degrees_sd <= OUTLINE[0] { OF_NARROW } else { 1.0 };
        let velocity = Slide::new(pair.slowness, config)?.velocity(pair.sd, self.lines.lost, config)?;
        Ok((velocity, Basis::Outline, None, [true; 2]))
    }

    /// Answers by two contacts: one wave cannot tell how far ahead of the other one is.
    #[inline(never)]
    fn of_contacts(&self, sides: [u32; 2], config: MotionConfig) -> Result<Answer, Reason> {
        if self.lines.is_cut || sides.iter().any(|side| side.count_ones() < FEWEST_OF_CONTACT) {
            return Err(Reason::TwoObjects);
        }
        let points = Whiskers::new(&self.lines, sides[0] | sides[1]).points(Whisker::middle);
        let pair = Pair::of_contacts(&points, sides, delays(config)).ok_or(Reason::TwoObjects)?;
        let slide = Slide::new(pair.slowness, config)?;
        for side in sides {
            let mut peaks = self.lines.peaks;
            for (taxel, peak) in peaks.iter_mut().enumerate() {
                *peak *= i16::from(side >> taxel & 1 == 1);
            }
            if !is_crossed(&peaks, slide.right, slide.up) {
                return Err(Reason::NotCrossed);
            }
        }
        Ok((slide.velocity(pair.sd, self.lines.lost, config)?, Basis::Outline, None, [true; 2]))
    }

    /// Answers by one wave.
    #[inline(never)]
    fn of_wave(
        &self,
        whiskers: &Whiskers<'_>,
        outline: &Outline,
        count: u32,
        config: MotionConfig,
    ) -> Result<Answer, Reason> {
        let peaks = &self.lines.peaks;
        let mut wave = Fitted::default();
        wave.slowness = whiskers.start();
        whiskers.fill(&mut wave)?;
        let [of_columns, of_rows] = delays(config);
        let slide = Slide::new([wave.slowness[0] + of_columns, wave.slowness[1] + of_rows], config)?;
        let Slide { slowness, right, up } = slide;
        // Otherwise the valley across the outline tells it.
        let is_apart = outline.degrees_sd > OUTLINE[0] && valley(peaks, right, up).is_some();
        let rest = Rest::new(&wave, slowness, right, up, count).ok_or(Reason::NotAlike)?;
        match rest.doubt(count) {
            Some(reason) if reason == Reason::SpeedChanges || !is_apart => return Err(reason),
            _ if is_apart => return Err(Reason::TwoObjects),
            _ => (),
        }
        let basis = basis(outline, count, degrees(right, up), rest.late).ok_or(Reason::NotAlike)?;
        if !is_crossed(peaks, right, up) {
            return Err(Reason::NotCrossed);
        }
        let velocity = slide.velocity(rest.sd, self.lines.lost, config)?;
        // The front of what is narrower may be round.
        let [value, sd] = rest.gain.map(|part| part * (velocity.mm_s * velocity.mm_s / SENSOR_MM));
        let acceleration = (basis == Basis::Edge).then_some(Measured { value, sd });
        let mean = rest.late[1];
        let is_even = mean * (slowness + LATE_FROM) < UNEVEN[1];
        Ok((velocity, basis, acceleration, [is_even, is_even && mean <= UNEVEN[0]]))
    }
}

/// Returns whether whiskers are one row or one column.
fn is_line(lit: u32) -> bool {
    (0..5).any(|line| lit == 0b11111 << (5 * line) || lit == 0x10_8421 << line)
}

/// A velocity, what it is known by, the acceleration, and whether it is even.
type Answer = (Velocity, Basis, Option<Measured>, [bool; 2]);

/// Returns the delays of columns and rows.
fn delays(config: MotionConfig) -> [f32; 2] {
    let [of_rows, of_columns] = config.readout().delays();
    [of_columns, of_rows]
}

/// A slide: frames to the pitch, and the direction.
#[derive(Clone, Copy)]
struct Slide {
    slowness: f32,
    right: f32,
    up: f32,
}

impl Slide {
    /// Creates the slide of a slowness along columns and rows.
    fn new(each: [f32; 2], config: MotionConfig) -> Result<Self, Reason> {
        let slowness = length(each);
        match contact_at([each[1], each[0]], slowness, config)? {
            Contact::Slide => Ok(Self { slowness, right: each[0] / slowness, up: 0.0 - each[1] / slowness }),
            contact => Err(Reason::NoSlide(contact)),
        }
    }

    /// Returns the velocity with its deviations, of the speed as a fraction and of the direction in radians, to which
    /// lost frames add.
    fn velocity(self, sd: [f32; 2], lost: u8, config: MotionConfig) -> Result<Velocity, Reason> {
        let Self { slowness, right, up } = self;
        let reach = config.readout().reach(slowness, right, up);
        if readout::is_too_far(reach) {
            return Err(Reason::ReadoutUnknown);
        }
        let few = FEW_FRAMES[1] * (FEW_FRAMES[0] - slowness).max(0.0);
        let of_frames = length([few, LOST * sqrt(f32::from(lost))]) / slowness;
        let of_speed = readout::widened(length([length([sd[0], LEAST_SD[0]]), of_frames]), reach[0]);
        let of_angle = readout::widened(length([sd[1], LEAST_SD[1]]), reach[1]);
        // What is no number is not certain.
        if !(of_speed <= MOST_SD[0] && of_angle <= MOST_SD[1]) {
            return Err(Reason::Uncertain);
        }
        let mm_s = config.pitch_per_frame() / slowness;
        Ok(Velocity::along(right, up, mm_s, [of_speed, of_angle]))
    }
}

/// Returns the velocity of slownesses of rows and columns, in their own time, that have this variance; `None` unless it
/// is that of a slide and certain.
pub(crate) fn velocity_of([of_rows, of_columns]: [f32; 2], variance: f32, config: MotionConfig) -> Option<Velocity> {
    let [columns_delay, rows_delay] = delays(config);
    let slide = Slide::new([of_columns + columns_delay, of_rows + rows_delay], config).ok()?;
    let sd = sqrt(variance) / slide.slowness;
    slide.velocity([sd, sd], 0, config).ok()
}

/// Returns what is curved alike along and across: the smaller curvature, if both have one sign.
pub(crate) fn dome(along: f32, across: f32) -> f32 {
    if along * across > 0.0 { if along.abs() < across.abs() { along } else { across } } else { 0.0 }
}

/// The motion of a touch by 25 taxels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct TaxelMotion {
    /// The motion. Its coherence is 0 if the wave tells the velocity, or that there is not one: lines were not
    /// compared.
    pub motion: Motion,
    /// What its velocity is known by; `None` unless that is reliable.
    pub basis: Option<Basis>,
    /// Where and how wide the touch is; `None` unless the wave tells the velocity, or two objects
    /// ([`Reason::TwoObjects`]), whose places and widths it does not tell.
    pub extent: Option<Extent>,
    /// The mean acceleration while an edge passes the sensor, in mm/s², below 0 if it slows down.
    ///
    /// It is there for the basis [`Edge`](Basis::Edge) of the wave alone: other fronts may be round, which looks alike.
    /// A speed that changes by more than some 7 % has no reliable velocity, and no acceleration.
    pub acceleration: Option<Measured>,
}

/// Returns the motion of an event's touch by its 25 taxels.
///
/// The wave tells the velocity, since coherence takes a narrow thing for an edge. If it refuses, coherence tells the
/// kind of touch, a doubt that the wave does not know better, and the velocity of a touch below 30 mm/s (at 30 frames
/// per second) of which the wave sees only a part, if it lights all whiskers with at most six flashes. More look like
/// stick-slip ([`Reason::SpeedChanges`]), even if they are those of a steady slow edge at an angle.
///
/// A slide that turns or changes its speed in the wave has no velocity.
///
/// It takes at most 12 KiB of stack.
#[inline(never)]
pub fn by_wave(event: &Event<'_>, taxels: &TaxelRing, config: MotionConfig) -> TaxelMotion {
    let reason = match if event.reliable { by_fit(taxels, event.frames, config) } else { Err(Reason::Baseline) } {
        Ok(answer) => return answer,
        Err(reason) => reason,
    };
    if !event.is_event() {
        // Coherence takes whole samples.
        return without_velocity(Contact::Unclear, reason);
    }
    let coherent = by_coherence(event, config);
    let is_slow = coherent.velocity.is_some_and(|velocity| velocity.mm_s * SLOW < config.pitch_per_frame());
    let basis = coherent.velocity.filter(|_| coherent.reliable).map(|_| Basis::Edge);
    let is_part = is_slow && is_of_part(reason);
    // Presses and pokes are no waves.
    let stays = coherent.doubt.is_none() && (coherent.contact != Contact::Slide || (is_part && taxels.are_all_lit()));
    if !event.reliable || stays {
        return TaxelMotion { motion: coherent, basis, extent: None, acceleration: None };
    }
    let doubt = match reason {
        Reason::Turning | Reason::TwoObjects | Reason::SpeedChanges => reason,
        Reason::NoSlide(_) => coherent.doubt.unwrap_or(Reason::NotAlike),
        _ => coherent.doubt.unwrap_or(reason),
    };
    let extent = (doubt == Reason::TwoObjects).then_some(Extent { place_mm: None, width_mm: None, contacts: 2 });
    let motion = Motion { reliable: false, doubt: Some(doubt), ..coherent };
    TaxelMotion { motion, basis: None, extent, acceleration: None }
}

fn without_velocity(contact: Contact, doubt: Reason) -> TaxelMotion {
    let motion = Motion { contact, velocity: None, coherence: 0.0, reliable: false, doubt: Some(doubt) };
    TaxelMotion { motion, basis: None, extent: None, acceleration: None }
}

/// Returns whether a wave may have seen only a part of a touch: of a slow one, the first of several flashes.
fn is_of_part(reason: Reason) -> bool {
    matches!(reason, Reason::NotCrossed | Reason::NotOver | Reason::FewWhiskers | Reason::NoSlide(_))
}

// It is not inlined: a wave does not lie on the stack of coherence.
#[inline(never)]
fn by_fit(taxels: &TaxelRing, frames: u8, config: MotionConfig) -> Result<TaxelMotion, Reason> {
    let mut wave = Wave::EMPTY;
    let (mut velocity, basis) = match wave.found(taxels.last(frames), config) {
        // It slides, but no one velocity is right: coherence has none to tell.
        Err(doubt @ (Reason::SpeedChanges | Reason::Turning)) => return Ok(without_velocity(Contact::Slide, doubt)),
        found => found.map_err(|reason| wave.told(reason))?,
    };
    if wave.lines.is_cut && usize::from(frames) < SAMPLE_FRAMES {
        velocity.mm_s_sd *= OF_CUT[0];
        velocity.degrees_sd *= OF_CUT[1];
    }
    let (basis, extent, velocity) = (Some(basis), Some(wave.extent(&velocity)), Some(velocity));
    let motion = Motion { contact: Contact::Slide, velocity, coherence: 0.0, reliable: true, doubt: None };
    Ok(TaxelMotion { motion, basis, extent, acceleration: wave.acceleration })
}

/// What a plane wave leaves over, as fractions of its slowness.
struct Rest {
    /// Largest and mean lateness. Where it is measured by the slowness, [`LATE_FROM`] is added to that.
    late: [f32; 2],
    /// The part of the energy that is not explained.
    miss: f32,
    /// Largest change of a third of the touch.
    change: f32,
    /// Changes over the sensor, along the motion and by a turn, and their standard deviations.
    faster: [f32; 2],
    twist: [f32; 2],
    /// Change of the speed over the sensor, without that of a dome, which is curved alike along and across; and its
    /// standard deviation.
    gain: [f32; 2],
    /// Standard deviations of the slowness along and across the motion.
    sd: [f32; 2],
    /// That along the motion by interpolation, if all whiskers are lit.
    of_phases: f32,
}

impl Rest {
    /// Returns what a wave leaves over; `None` if equations are singular.
    #[inline(never)]
    fn new(wave: &Fitted, slowness: f32, right: f32, up: f32, count: u32) -> Option<Self> {
        let one: Polynomial = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let along: Polynomial = [0.0, right, 0.0 - up, 0.0, 0.0, 0.0];
        let across: Polynomial = [0.0, 0.0 - up, 0.0 - right, 0.0, 0.0, 0.0];
        let along_2 = [0.0, 0.0, 0.0, right * right, -2.0 * right * up, up * up];
        let across_2 = [0.0, 0.0, 0.0, up * up, 2.0 * right * up, right * right];
        let both = [0.0, 0.0, 0.0, 0.0 - right * up, up * up - right * right, right * up];
        let (squares, count) = (wave.squares, count as usize);
        let columns = [one, along, across, along_2, across_2, both];
        let normal = Normal::new(&wave.moments.products(), &columns, &wave.late);
        let of_plane = normal.fit(&[0, 1, 2], squares, count, 1e-4)?;
        let curve = normal.fit(&[0, 1, 2, 3, 4], squares, count, 1e-3)?;
        let twist = normal.fit(&[0, 1, 2, 5], squares, count, 1e-3)?;
        let [_, _, _, u, v] = curve.coefficients;
        let dome = dome(u, v);
        let parts = wave.parts.each_ref().map(|part| with_each(columns.get(..3).unwrap_or_default(), part));
        let most = |k| parts.iter().map(|part| of_plane.of_others(k, part).abs()).fold(0.0, f32::max);
        let [change, turn] = [1, 2].map(most);
        // What is curved alike everywhere is no error of a slowness. Few whiskers cannot tell it.
        let (is_full, is_nearly) = (count == TAXELS, count + 1 >= TAXELS);
        let (left, factors) = if is_nearly { (&curve, FACTORS[1]) } else { (&of_plane, FACTORS[0]) };
        let left = left.variance / (1.0 + OF_PHASE * wave.lacks * wave.lacks);
        let unit = 1.0 / slowness;
        let flash = OF_FLASH * wave.lacks * wave.lacks;
        let [sine, cosine] = wave.locked.map(|[whole, ..]| whole / wave.moments.plane()[0].max(1.0));
        let shared = flash * flash * LOCKED * (sine * sine + cosine * cosine);
        // Over the four pitches of [`SENSOR_MM`].
        let over = 8.0 * unit;
        // By half of the squares of a sine and a cosine.
        let locked = wave.locked.each_ref().map(|sums| with_each(&columns, sums));
        let of_phases = |of: &Fit, k: usize| {
            let [sine, cosine] = locked.each_ref().map(|sums| of.of_others(k, sums));
            0.5 * (sine * sine + cosine * cosine)
        };
        let late = wave.late_without(dome);
        let curved = of_phases(&curve, 3);
        let phase = if is_full { CHANGE_OF_PHASES[1] * (BY_PHASES[0] + flash) } else { 0.0 };
        // An edge may be sharper than a rod's: the sine may be as high as whiskers are late.
        let phases = |of_phase: f32, of_edge: f32, k| {
            ((of_phase + flash) * (of_phase + flash) + of_edge * late[1] * late[1]) * of_phases(&of_plane, k)
        };
        let sds = [(1, factors[0]), (2, factors[1])].map(|(k, [of_late, of_miss, of_phase, of_edge, least])| {
            let late = of_late * of_late * left + of_miss * of_miss * ONE_WEIGHT * wave.miss;
            sqrt(of_plane.variance_of(k, late) + phases(of_phase, of_edge, k) + shared + least * least) * unit
        });
        let turn = if is_nearly { (turn * unit - TURN[0] * sds[1]).max(0.0) } else { 0.0 };
        Some(Self {
            late: late.map(|late| late / (slowness + LATE_FROM)),
            miss: wave.miss,
            change: if is_full && change <= NOISE_OF_CHANGE { 0.0 } else { change * unit },
            faster: [(dome - u).abs() * over, length([curve.deviation(3), phase * sqrt(curved)]) * over],
            twist: [twist.coefficients[3].abs() * over, twist.deviation(3) * over],
            gain: [(u - v) * over, curve.deviation_between(3, 4) * over],
            sd: [length([sds[0], TURN[1] * turn]), length([sds[1], TURN[2] * turn])],
            of_phases: if is_full { sqrt(phases(BY_PHASES[0], BY_PHASES[1], 1)) * unit } else { 0.0 },
        })
    }

    /// Returns why this is no wave of so many whiskers, or no steady one.
    fn doubt(&self, count: u32) -> Option<Reason> {
        let is_full = usize::from(count == TAXELS as u32);
        let ([late, mean], [faster, faster_sd], [twist, twist_sd]) = (LATE[is_full], self.faster, self.twist);
        let changes = self.change > MOST_CHANGE[is_full].max(CHANGE_OF_PHASES[0] * self.of_phases)
            || faster > (ACCELERATION[1] * faster_sd).clamp(ACCELERATION[0], ACCELERATION[2])
            || (faster > CERTAIN[0] && faster > CERTAIN[1] * faster_sd);
        let turns = twist > (TWIST[1] * twist_sd).max(TWIST[0]);
        let differs = self.late[0] > late || self.late[1] > mean || self.miss > MOST_MISS[is_full];
        let doubts = [(changes, Reason::SpeedChanges), (turns, Reason::Turning), (differs, Reason::NotAlike)];
        doubts.into_iter().find_map(|(holds, reason)| holds.then_some(reason))
    }
}

/// Returns what a direction is known by; `None` if the outline has another one.
fn basis(outline: &Outline, count: u32, degrees: f32, [late, _]: [f32; 2]) -> Option<Basis> {
    let sd = outline.degrees_sd;
    // Less than half a turn, either way round.
    let off = (outline.degrees - degrees).abs();
    let off = if off >= 180.0 { off - 180.0 } else { off };
    let off = if off >= 180.0 { off - 180.0 } else { off };
    let apart = off.min(180.0 - off);
    let is_full = count == TAXELS as u32;
    if !is_full && count >= FEWEST_OF_EDGE && late <= LATE_OF_EDGE {
        // Too few are dark to tell a rod that moves at an angle from one that does not.
        Some(Basis::Edge)
    } else if is_full {
        (sd >= OUTLINE[1] || apart <= 6.5 * sd + 6.0).then_some(Basis::Edge)
    } else if sd > OUTLINE[0] {
        (count >= FEWEST_OF_EDGE && sd > OUTLINE[1]).then_some(Basis::Edge)
    } else {
        (apart <= (3.2 * sd + 3.0).min(11.0)).then_some(Basis::Outline)
    }
}

#[cfg(test)]
mod event_tests;
#[cfg(test)]
mod tests;
