//! Speed and direction while something slides, frame by frame (SPEC §9, "Live").

mod alike;
mod arrival;
mod level;
mod light;
mod track;
mod whiskers;

use crate::paper::baseline::Baseline;
use crate::paper::sample::Sample;
use crate::params::{FEATURE_FRACTION_BITS, FEATURE_ONE, FEATURES, LONGEST_FILLED_GAP, ROWS};
use crate::touch::taxel_ring::TaxelRing;
use crate::touch::wave::Basis;

use super::edges::LINES;
use super::{Contact, MOST_SLOWNESS, MotionConfig, Readout, Velocity, contact_at, length, readout, sqrt};
use alike::Alike;
use arrival::arrival;
use level::Level;
use light::light;
use track::{Track, memory};
use whiskers::Whiskers;

/// The touch in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct LiveContact {
    /// The kind of the touch, as far as it is known.
    pub contact: Contact,
    /// Speed and direction; `None` unless it slides and they are known.
    pub velocity: Option<Velocity>,
    /// What the velocity is known by; `None` by ten sums, which cannot tell.
    pub basis: Option<Basis>,
}

impl LiveContact {
    const fn of(contact: Contact, velocity: Option<Velocity>) -> Self {
        Self { contact, velocity, basis: None }
    }
}

/// Follows speed and direction while something slides.
///
/// It is independent of the trigger's windows and costs at most some 4,000 instructions per frame on a Cortex-M4F. For
/// most slides, the first answer comes at most three frames after the leading edge has crossed all whiskers;
/// docs/ANSWERS.md says for how many.
///
/// ```
/// use wstac_core::{green::gray::Gray, layout::{FrameSize, Layout}, pipeline::Pipeline, rate::FrameRate};
/// use wstac_core::{touch::motion::{LiveMotion, MotionConfig}, taxels::FrameGeometry};
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
    /// Whether a line was lit.
    is_touched: bool,
    /// Frames since each line was first lit, and one more; 0 for a line that was not.
    ages: [u8; FEATURES],
    /// Frames since a line was lit.
    dark: u8,
    /// The feature of each line from which on it is lit.
    limits: [i16; FEATURES],
    /// The light of each line before the touch, in units of 2^-16.
    base: [i32; FEATURES],
    /// How far all lit lines have faded since one of them last grew, in units of 2^-11: at most 0.
    faded: i16,
    slide: Option<Slide>,
}

/// The slide, as far as it is known once all lines are lit.
#[derive(Clone, Copy, Debug)]
struct Slide {
    /// Rows and columns.
    tracks: [Track; 2],
    /// The slowness of the light on both together, in frames per pitch. Tracks have what rows show in their own time.
    slowness: f32,
    /// Standard deviation of both slownesses by edges that are not on a straight line.
    excess: f32,
    level: Level,
    /// Whether all lines are lit alike. Whatever is narrower than the sensor leaves some of them darker.
    alike: Alike,
    /// Deviation of the speed by a change of the light that is too small to follow, as a fraction.
    off: f32,
    /// Whether the speed was lowered with the light. Afterglow falls, too.
    is_dimmed: bool,
}

const MOST_BYTES: usize = 384;
const _: () = assert!(size_of::<LiveMotion>() <= MOST_BYTES);

/// A line is lit from this distance above the baseline's mean on: 0.2.
const LIT: i16 = (1 << FEATURE_FRACTION_BITS) / 5;
/// Frames in which all lines must be lit until their arrival is known.
const AGE: u8 = 2;
/// A touch of at most so many lines of each axis is a poke once its light has faded.
const POKE: u8 = 2;
/// Dark frames after which a touch is over. Two times the slowness is added, of which at most [`MOST_SLOWNESS`] counts.
const DARK: u8 = 2;
/// Light fades if all lines lose this in a frame; nothing slides once they have lost that. In units of 2^-11.
const FADES: [i16; 2] = [-41, -717];
/// Deviation of a speed that follows the light, as a fraction of the change's logarithm: after it, and before it
/// counts.
const BY_LIGHT: [f32; 2] = [0.06, 0.3];
/// Largest difference of the slownesses of rows and columns along a diagonal, as a fraction of their sum.
const DIAGONAL: f32 = 0.1;
/// Deviation of every slowness: in frames per pitch, as a fraction, and the slowness from which on it is even.
const LEAST: [f32; 3] = [0.001, 0.005, 1.5];
/// Largest variances: of a speed, as a fraction, and of a slowness across the motion, in frames per pitch, which grows
/// if an edge at another angle follows; and the square of the slowness above which that of a direction counts.
const MOST: [f32; 3] = [0.06 * 0.06, 0.022 * 0.022, 0.5 * 0.5];

impl LiveMotion {
    /// Creates a follower that has seen nothing.
    pub const fn new(config: MotionConfig) -> Self {
        Self {
            config,
            next_frame: 0,
            is_touched: false,
            ages: [0; FEATURES],
            dark: 0,
            limits: [0; FEATURES],
            base: [0; FEATURES],
            faded: 0,
            slide: None,
        }
    }

    /// Forgets the touch.
    pub fn reset(&mut self) {
        self.is_touched = false;
        self.ages = [0; FEATURES];
        self.dark = 0;
        self.faded = 0;
        self.slide = None;
    }

    /// Takes the newest frame, and returns what touches the sensor; `None` while nothing does.
    ///
    /// `next_frame` and `recent` are [`Pipeline::recent`](crate::pipeline::Pipeline::recent), and `baseline` is that of
    /// the pipeline. Call it once after each frame, from the complete baseline on. If more than 7 frames are missing
    /// since the last call, it begins anew. Without a new frame it returns `None` and changes nothing.
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
        let last = recent.len().checked_sub(1)?;
        let newest = recent.frame(last)?;
        if !self.is_touched {
            if !baseline.is_below(newest, LIT) {
                return None;
            }
            self.is_touched = true;
            let means = baseline.means(FEATURE_FRACTION_BITS).map(|mean| mean as i16);
            self.limits = means.map(|mean| mean.saturating_add(LIT));
            self.base = means.map(light);
        }
        let lit = age(&mut self.ages, newest, &self.limits, frames);
        let is_lit = lit != 0;
        self.dark = if is_lit { 0 } else { self.dark.saturating_add(frames) };
        // Dark frames are followed, too, so the slowness may be anything.
        let wait = self.slide.as_ref().map_or(0.0, |slide| 2.0 * slide.slowness.min(MOST_SLOWNESS));
        if self.dark > DARK.saturating_add(wait as u8) {
            self.reset();
            return None;
        }
        // An edge that crosses the sensor does not fade.
        let is_crossing = self.slide.as_ref().is_some_and(|slide| !slide.level.is_whole());
        self.faded = if is_crossing { 0 } else { fading(recent.frame(last.checked_sub(1)?)?, newest, lit, self.faded) };
        let Some(slide) = &mut self.slide else {
            let contact = self.arrive(recent);
            return is_lit.then_some(LiveContact::of(contact, None));
        };
        slide.follow(recent, &self.base, frames, self.config.readout);
        // Not in the longest frames, which catch up.
        if !slide.tracks.iter().any(|track| track.is_behind) {
            slide.alike.look(recent, &self.ages, &self.base, 1);
        }
        let slide = self.slide.as_ref().filter(|_| is_lit)?;
        Some(slide.answer(self.config, self.faded < FADES[1]))
    }

    /// Looks whether the light of a touch has arrived. Returns the kind of the touch, as far as it is known.
    fn arrive(&mut self, recent: Sample<'_>) -> Contact {
        let (rows, columns) = self.ages.split_at_checked(ROWS).unwrap_or_default();
        let lit = |ages: &[u8]| ages.iter().map(|&age| u8::from(age > 0)).sum::<u8>();
        let (rows, columns) = (lit(rows), lit(columns));
        if usize::from(rows.min(columns)) < LINES {
            let is_poke = rows.max(columns) <= POKE && rows.min(columns) > 0 && self.faded < FADES[1];
            return if is_poke { Contact::Poke } else { Contact::Unclear };
        }
        if self.ages.iter().any(|&age| age <= AGE) {
            return Contact::Unclear;
        }
        let arrived = arrival(recent, &self.ages, &self.base, self.config.readout);
        let Some((tracks, excess)) = arrived else { return Contact::Unclear };
        let slowness = slowness(&tracks, self.config.readout);
        let each = tracks.map(|track| track.slowness);
        let (level, alike) = (Level::new(each, slowness), Alike::new(each, recent, &self.ages, &self.base));
        let slide = Slide { tracks, slowness, excess, level, alike, off: 0.0, is_dimmed: false };
        self.slide.insert(slide).contact(self.config)
    }
}

/// Follows speed and direction of anything that slides, by 25 taxels.
///
/// A velocity of [`LiveMotion`] counts only if edges of light pass all whiskers as it says. Edges alone tell that of
/// rods. Of what is narrower than the sensor, [`Wave`](crate::touch::wave::Wave) tells it once, as soon as the touch
/// has ended and leaves nothing but afterglow; that frame takes as long as an event by a wave, and 13 KiB of stack.
#[derive(Clone, Debug)]
pub struct LiveWave {
    lines: LiveMotion,
    whiskers: Whiskers,
}

impl LiveWave {
    /// Creates a follower that has seen nothing.
    pub const fn new(config: MotionConfig) -> Self {
        Self { lines: LiveMotion::new(config), whiskers: Whiskers::EMPTY }
    }

    /// Forgets the touch.
    pub fn reset(&mut self) {
        self.lines.reset();
    }

    /// Returns how often the wave was asked about this touch: such a frame takes as long as an event by a wave.
    pub const fn waves(&self) -> u8 {
        self.whiskers.tries
    }

    /// Takes the newest frame as [`LiveMotion::push`] does, with its taxels, which are
    /// [`Pipeline::taxel_ring`](crate::pipeline::Pipeline::taxel_ring) after the same frame. Without them it returns
    /// what [`LiveMotion::push`] does.
    pub fn push(
        &mut self,
        next_frame: u64,
        recent: Sample<'_>,
        baseline: &Baseline,
        taxels: Option<&TaxelRing>,
    ) -> Option<LiveContact> {
        let frames = next_frame.wrapping_sub(self.lines.next_frame);
        let is_known = self.lines.is_touched && frames <= u64::from(LONGEST_FILLED_GAP) + 1;
        let lines = self.lines.push(next_frame, recent, baseline);
        let Some(ring) = taxels.filter(|_| frames > 0 && self.lines.is_touched) else { return lines };
        let (frames, config) = (frames.min(8) as u8, self.lines.config);
        if !is_known {
            self.whiskers.begin(ring, frames);
        }
        if let Some((velocity, basis)) = self.whiskers.follow(ring, frames, config) {
            return Some(LiveContact { contact: Contact::Slide, velocity: Some(velocity), basis: Some(basis) });
        }
        let lines = lines?;
        let slide = self.lines.slide.as_ref().filter(|slide| !slide.is_dimmed);
        let known =
            slide.and_then(|slide| Some((lines.velocity?, slide.tracks.each_ref().map(|track| track.slowness))));
        let velocity = self.whiskers.velocity(known, config);
        let contact = if velocity.is_some() { Contact::Slide } else { lines.contact };
        Some(LiveContact { contact, velocity, basis: velocity.map(|_| Basis::Edge) })
    }
}

impl Slide {
    fn follow(&mut self, recent: Sample<'_>, base: &[i32; FEATURES], frames: u8, readout: Readout) {
        let memory = memory(self.slowness);
        let [rows, columns] = of_light(&self.tracks, readout).map(f32::abs);
        let is_diagonal = (rows - columns).abs() < DIAGONAL * (rows + columns);
        let (number, has_changed) = self.level.push(recent, self.slowness, is_diagonal, frames);
        self.off = BY_LIGHT[1] * number;
        self.is_dimmed |= has_changed && number < 0.0;
        let factor = has_changed.then(|| light((-number * FEATURE_ONE as f32) as i16) as f32 / light::ONE as f32);
        let lines = self.tracks.iter_mut().zip(base.chunks(LINES)).zip([0, ROWS]);
        for (((track, base), first), delay) in lines.zip(readout.delays()) {
            track.pass(frames);
            if let Some(factor) = factor {
                track.scale(factor, BY_LIGHT[0] * number.abs(), delay);
            }
            track.compare(recent, first, base, memory);
        }
        self.slowness = slowness(&self.tracks, readout);
    }

    fn contact(&self, config: MotionConfig) -> Contact {
        contact_at(of_light(&self.tracks, config.readout), self.slowness, config).unwrap_or(Contact::Unclear)
    }

    fn answer(&self, config: MotionConfig, has_faded: bool) -> LiveContact {
        let contact = self.contact(config);
        let is_sliding = contact == Contact::Slide && !has_faded && self.alike.holds;
        LiveContact::of(contact, if is_sliding { self.velocity(self.slowness, config) } else { None })
    }

    /// Returns the velocity of a slowness above 0, if it is known well enough.
    fn velocity(&self, whole: f32, config: MotionConfig) -> Option<Velocity> {
        let least = LEAST[0] + LEAST[1] * whole.min(LEAST[2]);
        let always = least * least + self.excess * self.excess;
        let [up, right] = of_light(&self.tracks, config.readout).map(|slowness| slowness / whole);
        let [up_variance, right_variance] =
            self.tracks.each_ref().map(|track| (track.variance + always) / (whole * whole));
        let (upwards, rightwards) = (up * up, right * right);
        let mm_s = config.pitch_per_frame / whole;
        let variance = rightwards * right_variance + upwards * up_variance + self.off * self.off;
        let is_behind = whole < 0.6 && self.tracks.iter().any(|track| track.is_behind);
        let reach = config.readout.reach(whole, right, -up);
        let across = upwards * right_variance + rightwards * up_variance;
        let is_certain = variance <= MOST[0] && across * (whole * whole).min(MOST[2]) <= MOST[1];
        (is_certain && !is_behind && !readout::is_too_far(reach)).then(|| {
            let sd = [readout::widened(sqrt(variance), reach[0]), readout::widened(sqrt(across), reach[1])];
            Velocity::along(right, -up, mm_s, sd)
        })
    }
}

/// Lets lines grow older, and notes those above their limits. Returns these, one bit each.
#[inline(never)]
fn age(ages: &mut [u8], newest: &[i16], limits: &[i16], frames: u8) -> u16 {
    let mut lit = 0;
    for (line, ((age, feature), limit)) in ages.iter_mut().zip(newest).zip(limits).enumerate() {
        let is_lit = feature > limit;
        lit |= u16::from(is_lit) << line;
        *age = if *age > 0 { age.saturating_add(frames) } else { u8::from(is_lit) };
    }
    lit
}

/// Returns how far all lit lines have faded by the newest frame, if it was `faded` before.
#[inline(never)]
fn fading(before: &[i16], newest: &[i16], lit: u16, faded: i16) -> i16 {
    let mut growth = i16::MIN;
    for (line, (here, before)) in newest.iter().zip(before).enumerate() {
        if lit >> line & 1 == 1 {
            growth = growth.max(here.saturating_sub(*before));
        }
    }
    if growth < FADES[0] { faded.saturating_add(growth) } else { 0 }
}

/// Returns the slowness of the light along rows and columns, in frames per pitch.
fn of_light([rows, columns]: &[Track; 2], readout: Readout) -> [f32; 2] {
    let [of_rows, of_columns] = readout.delays();
    [rows.slowness + of_rows, columns.slowness + of_columns]
}

/// Returns that of both together.
fn slowness(tracks: &[Track; 2], readout: Readout) -> f32 {
    length(of_light(tracks, readout))
}

#[cfg(test)]
mod tests;
