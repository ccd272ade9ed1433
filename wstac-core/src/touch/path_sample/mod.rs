//! The sample in millimeters: light along the path of a touch instead of light over time (SPEC §10).
//!
//! A texture gives another sample at every speed and in every direction. With the touch's velocity, light is read at
//! equal distances behind the specimen's leading edge, and lines are put together by their place in the motion. So one
//! texture gives similar numbers at any speed, in any direction and at any length.
//!
//! [`PathSample::of_sums`] uses the ten features of the event, and needs no memory of its own.
//! [`PathSample::of_taxels`] uses the 25 taxels that a [`TaxelRing`] keeps, which tells textures apart better above 200
//! mm/s.
//!
//! A model file says which of them it takes ([`Input`]).

mod period;
mod resample;

use crate::exp::{EXP_FRACTION_BITS, exp_of_negative, widened};
use crate::ln::Ln;
use crate::ln::fixed::Fixed;
use crate::model::file::{INPUTS, Input};
use crate::paper::trigger::Event;
use crate::params::{COLUMNS, FEATURES, ROWS, SAMPLE_FRAMES, TAXELS};
use crate::touch::motion::{MotionConfig, Velocity};
pub use crate::touch::taxel_ring::{NoTaxels, TaxelRing, TaxelStore};
pub use period::period;
use resample::{BY_COLUMNS, BY_ROWS, BY_TAXELS, Factors, Light, Plan, Track};

/// Numbers before those of the first step: the speed, the direction, and products of them.
pub const FACTS: usize = 4;
/// Speed in mm/s at which the speed's number is 0: near the geometric mean of 50 and 300.
const MIDDLE_MM_S: u32 = 120;
/// Fraction bits of a speed in mm/s of which a logarithm is taken.
const SPEED_FRACTION_BITS: u32 = 6;
/// The number one, in units of the numbers.
const ONE: i32 = 1 << 11;
/// Largest slowness, in frames per pitch: that of a slide at 9 mm/s, at a pitch of 4 mm and 30 frames per second.
const MOST_SLOWNESS: f32 = 13.5;
const FRAME_BITS: u32 = 16;
/// Frames at the start of a sample that count as dark.
const DARK_FRAMES: usize = 4;

/// The sample of a touch along its path, as a texture model takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSample {
    numbers: [i16; INPUTS],
    covered: u16,
}

impl PathSample {
    /// A sample that covers nothing, to be filled.
    pub const DARK: Self = Self { numbers: [0; INPUTS], covered: 0 };

    /// Creates the sample of an event from its ten features.
    ///
    /// It holds the numbers that a model of `frames` frames reads, in tens; all others are 0. Returns `None` for a
    /// velocity below 9 mm/s and for a dark sample.
    ///
    /// ```
    /// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
    /// use wstac_core::{touch::motion::{self, MotionConfig}, touch::path_sample::PathSample, taxels::FrameGeometry};
    ///
    /// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
    /// let mut pipeline = Pipeline::builder(geometry).build()?;
    /// let config = MotionConfig::published(FrameRate::NOMINAL);
    /// # let frames = (0..120_usize).map(|t| {
    /// #     let mut frame = vec![1; 160_000];
    /// #     if (40..73).contains(&t) { frame.chunks_mut(400).for_each(|row| row[12 * (t - 40)..][..12].fill(200)); }
    /// #     frame
    /// # });
    /// for frame in frames {
    ///     if let Some(event) = pipeline.push_frame(&frame)?.event()
    ///         && let Some(velocity) = motion::by_coherence(&event, config).velocity
    ///     {
    ///         let sample = PathSample::of_sums(&event, &velocity, config, 70);
    ///         assert!(sample.is_some());
    ///     }
    /// }
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn of_sums(event: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> Option<Self> {
        let mut sample = Self::DARK;
        sample.fill_from_sums(event, velocity, config, frames).then_some(sample)
    }

    /// Fills this sample with that of [`PathSample::of_sums`]. Returns whether there is one.
    ///
    /// A board with little stack has one sample then, and no copies.
    pub fn fill_from_sums(&mut self, event: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> bool {
        let Some(way) = Way::new(velocity, config) else { return false };
        let mut light = SumLight::DARK;
        light.fill(event);
        let by_rows = way.up.unsigned_abs() > way.right.unsigned_abs();
        let plan = if by_rows { &BY_ROWS } else { &BY_COLUMNS };
        let [up, right] = way.recorded(config);
        let delays = core::array::from_fn(|line| {
            if line < ROWS { up * (2 - line as i32) } else { right * (line as i32 - (ROWS + 2) as i32) }
        });
        let weights = core::array::from_fn(|line| if line < ROWS { way.rows } else { ONE - way.rows });
        way.sample(&light, plan, delays, weights, frames, self).is_some()
    }

    /// Creates the sample of an event from 25 taxels. The ring's last frame must be that of the event.
    ///
    /// A pipeline that keeps taxels returns such a ring with the event
    /// ([`Update::taxels`](crate::pipeline::Update::taxels)).
    ///
    /// It holds the numbers that a model of `frames` frames reads, in tens; all others are 0. Returns `None` for a
    /// velocity below 9 mm/s and for a dark sample.
    ///
    /// The first four frames count as dark: a trigger must begin its sample that long before the touch.
    pub fn of_taxels(ring: &TaxelRing, velocity: &Velocity, config: MotionConfig, frames: u8) -> Option<Self> {
        let mut sample = Self::DARK;
        sample.try_taxels(ring, SAMPLE_FRAMES as u8, velocity, config, frames)?;
        Some(sample)
    }

    /// Creates the sample of an event, or of a touch under way, from its 25 taxels, as [`PathSample::of_taxels`] does.
    ///
    /// It is `None` if the pipeline keeps no taxels or a frame of them was lost.
    pub fn of_touch(touch: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> Option<Self> {
        let mut sample = Self::DARK;
        sample.fill_from_touch(touch, velocity, config, frames).then_some(sample)
    }

    /// Fills this sample with that of [`PathSample::of_touch`]. Returns whether there is one.
    pub fn fill_from_touch(
        &mut self,
        touch: &Event<'_>,
        velocity: &Velocity,
        config: MotionConfig,
        frames: u8,
    ) -> bool {
        let ring = touch.taxels();
        ring.is_some_and(|ring| self.try_taxels(ring, touch.frames, velocity, config, frames).is_some())
    }

    fn try_taxels(
        &mut self,
        ring: &TaxelRing,
        last: u8,
        velocity: &Velocity,
        config: MotionConfig,
        frames: u8,
    ) -> Option<()> {
        let way = Way::new(velocity, config)?;
        let [up, right] = way.recorded(config);
        let delays = core::array::from_fn(|taxel| {
            let (row, column) = ((taxel / COLUMNS) as i32, (taxel % COLUMNS) as i32);
            up * (2 - row) + right * (column - 2)
        });
        way.sample(&TaxelLight::new(ring, last), &BY_TAXELS, delays, [1; TAXELS], frames, self)
    }

    /// Returns the numbers, as a texture model takes them.
    pub const fn numbers(&self) -> &[i16; INPUTS] {
        &self.numbers
    }

    /// Returns whether the touch went far enough within its 70 frames for a model of so many frames, in tens of
    /// numbers.
    pub const fn covers(&self, frames: u8) -> bool {
        frames as usize * FEATURES <= self.covered as usize
    }

    /// Creates a sample from stored numbers, all of which are there; for data sets.
    pub const fn from_numbers(numbers: [i16; INPUTS]) -> Self {
        Self { numbers, covered: INPUTS as u16 }
    }
}

impl Input {
    /// Returns the distance of two steps in mm, and the numbers of each; `None` for a sample over time.
    pub const fn steps(self) -> Option<(f32, usize)> {
        match self {
            Self::Frames | Self::Taxels => None,
            Self::Path => Some((BY_ROWS.step_mm, BY_ROWS.numbers())),
            Self::TaxelPath => Some((BY_TAXELS.step_mm, BY_TAXELS.numbers())),
        }
    }
}

/// A touch's way over the sensor, in frames.
struct Way {
    /// Frames per mm of path.
    per_mm: f32,
    /// Delay from a column to the next and from a row to the one above it, in units of 2^-16 frames.
    right: i32,
    up: i32,
    /// Weight of the rows in the motion: the square of its upward part, in units of 2^-11.
    rows: i32,
    factors: Factors,
}

impl Way {
    /// Returns the way of a velocity; `None` for one that is too slow or no number.
    fn new(velocity: &Velocity, config: MotionConfig) -> Option<Self> {
        let slowness = config.pitch_per_frame() / velocity.mm_s;
        if !(velocity.mm_s > 0.0 && slowness > 0.0 && slowness <= MOST_SLOWNESS) {
            return None;
        }
        let angle = velocity.degrees * (core::f32::consts::PI / 180.0);
        let (right, up) = (libm::cosf(angle), libm::sinf(angle));
        let (rows, columns) = (up * up, right * right);
        let ln = |x: u32| Fixed::<256>.ln(x.max(1));
        let speed = (velocity.mm_s * (1 << SPEED_FRACTION_BITS) as f32) as u32;
        let speed = rounded(ln(speed) - ln(MIDDLE_MM_S << SPEED_FRACTION_BITS), 15).clamp(-ONE, ONE);
        // The cosine of four times the angle: 1 along an axis, −1 between them.
        let direction = nearest((1.0 - 8.0 * rows * columns) * ONE as f32).clamp(-ONE, ONE);
        Some(Self {
            per_mm: slowness / config.pitch_mm(),
            right: nearest(slowness * right * (1 << FRAME_BITS) as f32),
            up: nearest(slowness * up * (1 << FRAME_BITS) as f32),
            rows: nearest(rows * ONE as f32).clamp(0, ONE),
            factors: Factors { speed, direction },
        })
    }

    /// Returns the delays from a row to the one above it and from a column to the next as the camera sees them: lines
    /// that it reads later show the light sooner.
    fn recorded(&self, config: MotionConfig) -> [i32; 2] {
        let [rows, columns] = config.readout().delays().map(|delay| nearest(delay * (1 << FRAME_BITS) as f32));
        [self.up + rows, self.right - columns]
    }

    fn sample<const LINES: usize>(
        &self,
        light: &impl Light,
        plan: &Plan<LINES>,
        delays: [i32; LINES],
        weights: [i32; LINES],
        frames: u8,
        to: &mut PathSample,
    ) -> Option<()> {
        *to = PathSample::DARK;
        let step = nearest(self.per_mm * plan.step_mm * (1 << FRAME_BITS) as f32).max(1);
        let track = Track::new(light, plan, delays, weights, step)?;
        let wanted = (usize::from(frames) * FEATURES).min(INPUTS);
        let whole = track.fill(light, plan, self.factors, to.numbers.get_mut(..wanted)?)?;
        to.covered = track.covered(plan).min(whole) as u16;
        Some(())
    }
}

/// Light of ten sums over a sample, in units of 2^-16 of the brightest.
struct SumLight([[u16; FEATURES]; SAMPLE_FRAMES]);

impl SumLight {
    const DARK: Self = Self([[0; FEATURES]; SAMPLE_FRAMES]);

    /// Computes the light of an event in place of darkness. A new value would be a second one on the stack.
    #[inline(never)]
    fn fill(&mut self, event: &Event<'_>) {
        let means = event.baseline.means(EXP_FRACTION_BITS);
        let brightest = event.sample.frames().flatten().copied().max().map_or(0, widened);
        let of = |value: i32| exp_of_negative(brightest.saturating_sub(value).max(0) as u32);
        let dark = means.map(of);
        for (place, frame) in self.0.iter_mut().zip(event.sample.frames()) {
            for (((place, &value), &mean), &dark) in place.iter_mut().zip(frame).zip(&means).zip(&dark) {
                // Most frames are dark.
                let value = widened(value);
                if value > mean {
                    *place = (of(value).saturating_sub(dark) >> 15).min(u32::from(u16::MAX)) as u16;
                }
            }
        }
    }
}

impl Light for SumLight {
    fn at(&self, frame: usize, line: usize) -> u16 {
        self.0.get(frame).and_then(|frame| frame.get(line)).copied().unwrap_or(0)
    }
}

/// Light of the ring's taxels above what it was in the touch's first frames.
struct TaxelLight<'a> {
    ring: &'a TaxelRing,
    /// The age of the touch's first frame. Light before it is another touch's.
    first: usize,
    dark: [u16; TAXELS],
    has_lost: bool,
}

impl<'a> TaxelLight<'a> {
    fn new(ring: &'a TaxelRing, last: u8) -> Self {
        let first = SAMPLE_FRAMES.saturating_sub(last.into());
        let (mut sums, mut count) = ([0_u32; TAXELS], 0_u32);
        for frame in ring.last(last).flatten().take(DARK_FRAMES) {
            for (sum, &light) in sums.iter_mut().zip(frame) {
                *sum += u32::from(light);
            }
            count += 1;
        }
        let mean = |sum: u32| (sum + (count >> 1)).checked_div(count).unwrap_or(0) as u16;
        Self { ring, first, dark: sums.map(mean), has_lost: !ring.has_whole(last) }
    }
}

impl Light for TaxelLight<'_> {
    #[inline(always)]
    fn at(&self, frame: usize, line: usize) -> u16 {
        if frame < self.first {
            return 0;
        }
        let light = |frame| self.ring.light(frame, line);
        let light = if self.has_lost && self.is_lost(frame) { self.between(frame, light) } else { light(frame) };
        light.saturating_sub(self.dark.get(line).copied().unwrap_or(0))
    }

    fn is_lost(&self, frame: usize) -> bool {
        (self.first..SAMPLE_FRAMES).contains(&frame) && self.ring.is_lost(frame)
    }

    fn has_lost(&self) -> bool {
        self.has_lost
    }
}

impl TaxelLight<'_> {
    /// Returns the light of a lost frame: on a straight line between those beside it that arrived, or that of the one.
    #[inline(never)]
    fn between(&self, frame: usize, light: impl Fn(usize) -> u16) -> u16 {
        let before = (self.first..frame).rev().find(|&frame| !self.is_lost(frame));
        let after = (frame + 1..SAMPLE_FRAMES).find(|&frame| !self.is_lost(frame));
        let (Some(from), Some(to)) = (before, after) else {
            return before.or(after).map_or(0, light);
        };
        let (parts, of) = ((frame - from) as i32, (to - from) as i32);
        let [from, to] = [from, to].map(|frame| i32::from(light(frame)));
        (from + ((to - from) * parts).checked_div(of).unwrap_or(0)) as u16
    }
}

/// Returns a number without so many of its fraction bits; ties round up.
const fn rounded(value: i32, bits: u32) -> i32 {
    ((value >> (bits - 1)) + 1) >> 1
}

/// Returns the nearest integer; ties round away from zero.
fn nearest(value: f32) -> i32 {
    (if value < 0.0 { value - 0.5 } else { value + 0.5 }) as i32
}

#[cfg(test)]
mod tests;
