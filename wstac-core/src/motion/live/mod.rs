//! Speed and direction while something slides, frame by frame (SPEC §9, "Live").

mod arrival;
mod level;
mod light;
mod track;

use crate::baseline::Baseline;
use crate::features::Features;
use crate::params::{FEATURE_FRACTION_BITS, FEATURES, LONGEST_FILLED_GAP, ROWS};
use crate::sample::Sample;

use super::edges::LINES;
use super::{Contact, LEAST_SLIDE, MOST_SLOWNESS, MotionConfig, Velocity, degrees};
use arrival::arrival;
use level::{Change, Level};
use light::light;
use track::{Memory, Track};

/// What touches the sensor in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct LiveContact {
    /// The kind of the touch, as far as it is known.
    pub contact: Contact,
    /// Speed and direction; `None` unless it slides and they are known.
    pub velocity: Option<Velocity>,
}

/// Follows speed and direction while something slides.
///
/// It is independent of the trigger's windows and costs at most some 4,000 instructions per frame on a Cortex-M4F. The
/// first answer comes at most three frames after the leading edge has crossed all whiskers.
///
/// ```
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{motion::{LiveMotion, MotionConfig}, taxels::FrameGeometry};
///
/// let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
/// let mut pipeline = Pipeline::builder(geometry).build()?;
/// let mut live = LiveMotion::new(MotionConfig::published(FrameRate::NOMINAL));
/// # // A bright stripe moves to the right by 12 pixels, 0.6 mm, per frame: 18 mm/s.
/// # let frames = (0..120).map(|t| {
/// #     let mut frame = vec![1; 160_000];
/// #     let lit = 12 * usize::max(t, 40) - 480;
/// #     frame.chunks_mut(400).for_each(|row| row[lit.min(400).saturating_sub(60)..lit.min(400)].fill(200));
/// #     frame
/// # });
/// # let mut speeds = Vec::new();
/// for frame in frames {
///     pipeline.push_frame(&frame)?;
///     let (next_frame, recent) = pipeline.recent();
///     let Some(baseline) = pipeline.baseline() else { continue };
///     if let Some(velocity) = live.push(next_frame, recent, baseline).and_then(|touch| touch.velocity) {
///         // velocity.mm_s, velocity.degrees …
/// #       speeds.push(velocity.mm_s);
///     }
/// }
/// # assert!(speeds.len() > 5 && speeds.iter().all(|speed| (speed / 18.0 - 1.0).abs() < 0.05), "{speeds:?}");
/// # Ok::<(), wstac_core::error::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LiveMotion {
    config: MotionConfig,
    /// The number of the frame after the last that was taken.
    next_frame: u64,
    /// Frames since each line was first lit, and one more; 0 for a line that was not.
    ages: [u8; FEATURES],
    /// Frames since a line was lit.
    dark: u8,
    /// The light of each line before the touch, in units of 2^-16.
    base: [i32; FEATURES],
    /// How far all lit lines have faded since one of them last grew, in units of 2^-11: at most 0.
    faded: i16,
    slide: Option<Slide>,
}

/// What is known once all lines are lit.
#[derive(Clone, Copy, Debug)]
struct Slide {
    /// Rows and columns.
    tracks: [Track; 2],
    /// Standard deviation of both slownesses by edges that are not on a straight line.
    excess: f32,
    level: Level,
    /// Deviation of the speed by a change of the light that is too small to follow, as a fraction.
    off: f32,
}

/// A line is lit from this distance above the baseline's mean on: 0.2.
const LIT: i16 = (1 << FEATURE_FRACTION_BITS) / 5;
/// Frames in which all lines must be lit until their arrival is known.
const AGE: u8 = 2;
/// A touch of at most so many lines of each axis is a poke once its light has faded.
const POKE: u8 = 2;
/// Dark frames after which a touch is over. Two times the slowness is added.
const DARK: u8 = 2;
/// Most comparisons of an axis per frame.
const COMPARISONS: u8 = 3;
/// Light fades if all lines lose this in a frame; nothing slides once they have lost that. In units of 2^-11.
const FADES: [i16; 2] = [-41, -717];
/// Deviation of a speed that follows the light, as a fraction of the change's logarithm: after it, and before it counts.
const BY_LIGHT: [f32; 2] = [0.06, 0.3];
/// Deviation of every slowness: in frames per pitch, as a fraction, and the slowness from which on it is even.
const LEAST: [f32; 3] = [0.001, 0.005, 1.5];
/// Largest deviation of a speed, as a fraction of it.
const MOST_DEVIATION: f32 = 0.06;

impl LiveMotion {
    /// Creates a follower that has seen nothing.
    pub const fn new(config: MotionConfig) -> Self {
        Self { config, next_frame: 0, ages: [0; FEATURES], dark: 0, base: [0; FEATURES], faded: 0, slide: None }
    }

    /// Forgets the touch.
    pub fn reset(&mut self) {
        self.ages = [0; FEATURES];
        self.dark = 0;
        self.faded = 0;
        self.slide = None;
    }

    /// Takes the newest frame, and returns what touches the sensor; `None` while nothing does.
    ///
    /// `next_frame` and `recent` are [`Pipeline::recent`](crate::pipeline::Pipeline::recent), and `baseline` is that of
    /// the pipeline. Call it once after each frame, from the complete baseline on. If more than 7 frames are missing since
    /// the last call, it begins anew. Without a new frame it returns `None` and changes nothing.
    pub fn push(&mut self, next_frame: u64, recent: Sample<'_>, baseline: &Baseline) -> Option<LiveContact> {
        let frames = next_frame.wrapping_sub(core::mem::replace(&mut self.next_frame, next_frame));
        if frames == 0 {
            return None;
        }
        if frames > u64::from(LONGEST_FILLED_GAP) + 1 {
            self.reset();
        }
        // At most 8, or all is forgotten anyway.
        let frames = frames.min(8) as u8;
        let newest = recent.back(0)?;
        let was_dark = self.ages == [0; FEATURES];
        let lit = self.age(newest, baseline, frames);
        let is_lit = lit != 0;
        if is_lit {
            self.dark = 0;
            if was_dark {
                self.base = baseline.means(FEATURE_FRACTION_BITS).map(|mean| light(mean as i16));
            }
        } else {
            self.dark = self.dark.saturating_add(frames);
            let wait = self.slide.as_ref().map_or(0.0, |slide| 2.0 * slowness(&slide.tracks));
            if was_dark || self.dark > DARK.saturating_add(wait as u8) {
                self.reset();
                return None;
            }
        }
        self.faded = fading(recent, newest, lit, self.faded);
        let slide = match &mut self.slide {
            Some(slide) => {
                slide.tracks.iter_mut().for_each(|track| track.pass(frames));
                slide
            }
            None => match self.arrive(recent) {
                Ok(slide) => self.slide.insert(slide),
                Err(contact) => return is_lit.then_some(LiveContact { contact, velocity: None }),
            },
        };
        slide.follow(recent, newest, &self.base, frames);
        if !slide.level.is_whole() {
            self.faded = 0;
        }
        is_lit.then(|| slide.answer(self.config, self.faded < FADES[1]))
    }

    /// Lets lines grow older, and notes those that are lit. Returns these, one bit each.
    fn age(&mut self, newest: &Features, baseline: &Baseline, frames: u8) -> u16 {
        let count = i64::from(baseline.frames());
        let mut lit = 0;
        for (line, ((age, &feature), &total)) in self.ages.iter_mut().zip(newest).zip(baseline.totals()).enumerate() {
            let is_lit = (i64::from(feature) - i64::from(LIT)) * count > i64::from(total);
            lit |= u16::from(is_lit) << line;
            *age = if *age > 0 { age.saturating_add(frames) } else { u8::from(is_lit) };
        }
        lit
    }

    /// Returns what is known of a touch whose light has arrived, or the kind of one whose light has not.
    fn arrive(&self, recent: Sample<'_>) -> Result<Slide, Contact> {
        let (rows, columns) = self.ages.split_at_checked(ROWS).unwrap_or_default();
        let lit = |ages: &[u8]| ages.iter().map(|&age| u8::from(age > 0)).sum::<u8>();
        let (rows, columns) = (lit(rows), lit(columns));
        let youngest = self.ages.iter().filter(|&&age| age > 0).min().map_or(0, |age| age - 1);
        if usize::from(rows.min(columns)) < LINES {
            let is_poke = rows.max(columns) <= POKE && rows.min(columns) > 0 && self.faded < FADES[1];
            return Err(if is_poke { Contact::Poke } else { Contact::Unclear });
        }
        if youngest < AGE {
            return Err(Contact::Unclear);
        }
        let arrival = arrival(recent, &self.ages, &self.base).ok_or(Contact::Unclear)?;
        let level = Level::new(arrival.tracks.map(|track| track.slowness), slowness(&arrival.tracks));
        Ok(Slide { tracks: arrival.tracks, excess: arrival.excess, level, off: 0.0 })
    }
}

impl Slide {
    /// Takes the newest frame.
    fn follow(&mut self, recent: Sample<'_>, newest: &Features, base: &[i32; FEATURES], frames: u8) {
        let whole = slowness(&self.tracks);
        let memory = Memory::of(whole);
        let Change { number, large } = self.level.push(newest, whole, frames);
        self.off = BY_LIGHT[1] * number;
        if let Some(large) = large {
            let factor = light(large.saturating_neg()) as f32 / light::ONE as f32;
            for track in &mut self.tracks {
                track.scale(factor, BY_LIGHT[0] * number.abs(), memory);
            }
        }
        for ((track, base), first) in self.tracks.iter_mut().zip(base.as_chunks::<LINES>().0).zip([0, ROWS]) {
            for _ in 0..COMPARISONS {
                if !track.compare(recent, first, base, memory) {
                    break;
                }
            }
        }
    }

    fn answer(&self, config: MotionConfig, has_faded: bool) -> LiveContact {
        let whole = slowness(&self.tracks);
        let contact = if whole < LEAST_SLIDE[0] {
            Contact::Press
        } else if whole < LEAST_SLIDE[1] || whole > MOST_SLOWNESS {
            Contact::Unclear
        } else {
            Contact::Slide
        };
        let is_sliding = contact == Contact::Slide && !has_faded;
        LiveContact { contact, velocity: if is_sliding { self.velocity(whole, config) } else { None } }
    }

    /// Returns the velocity of a slowness above 0, if it is known well enough.
    fn velocity(&self, whole: f32, config: MotionConfig) -> Option<Velocity> {
        let memory = Memory::of(whole);
        let least = LEAST[0] + LEAST[1] * whole.min(LEAST[2]);
        let always = least * least + self.excess * self.excess;
        let [up, right] = self.tracks.map(|track| track.slowness / whole);
        let [up_sd, right_sd] = self.tracks.map(|track| libm::sqrtf(track.variance(memory) + always) / whole);
        let length = |a: f32, b: f32| libm::sqrtf(a * a + b * b);
        let mm_s = config.pitch_per_frame / whole;
        let mm_s_sd = mm_s * length(length(right * right_sd, up * up_sd), self.off);
        let is_known = mm_s_sd <= MOST_DEVIATION * mm_s;
        is_known.then(|| Velocity {
            mm_s,
            mm_s_sd,
            degrees: degrees(right, -up),
            degrees_sd: length(up * right_sd, right * up_sd) * (180.0 / core::f32::consts::PI),
        })
    }
}

/// Returns how far all lit lines have faded by the newest frame, if it was `faded` before.
fn fading(recent: Sample<'_>, newest: &Features, lit: u16, faded: i16) -> i16 {
    let Some(before) = recent.back(1) else { return 0 };
    let lines = newest.iter().zip(before).enumerate().filter(|(line, _)| lit >> line & 1 == 1);
    let growth = lines.map(|(_, (&here, &before))| here.saturating_sub(before)).max().unwrap_or(i16::MIN);
    if growth < FADES[0] { faded.saturating_add(growth) } else { 0 }
}

/// Returns the slowness of rows and columns together, in frames per pitch.
fn slowness([rows, columns]: &[Track; 2]) -> f32 {
    libm::sqrtf(rows.slowness * rows.slowness + columns.slowness * columns.slowness)
}
