//! The skin: 25 whiskers and the light of their bases over time. A scene moves surfaces over it; a physics engine says
//! how deep each whisker is in whatever is there.

use wstac_core::params::TAXELS;
use wstac_host::error::{Error, ErrorKind};

use super::Scene;
use super::contact::{Crossing, Passage, Rub, Tip, spring_back};
use super::keys::within;
use super::light::{Exposure, Fluctuation, LightConfig, gain};
use super::rng::Rng;
use super::script::SceneConfig;
use super::sensor::Sensor;
use super::whisker::{Bending, Bent, Whisker, WhiskerConfig};

/// Number of pieces of time in the afterglow's time constant and in the crossing of a period.
///
/// Halving the pieces changes no feature by more than 1 unit of 2^-11 (tested).
const FINENESS: f64 = 32.0;

/// Change of the overlap that is divided this way, as a fraction of a whisker's length.
const WIDEST_STEP: f64 = 0.8;

/// Time without overlap after which [`Skin::step`] takes the next overlap for another touch, in s (a guess).
const APART_S: f64 = 0.1;

/// Largest distance of an overlap or a gap, in mm, and of a speed, in mm/s. A whisker is at most 100 mm long.
const MOST_MM: f64 = 1e4;

/// Moments that are less than this apart, in s, are one: the rounding of steps that fill a frame.
const SAME_S: f64 = 1e-9;

/// Purposes of random numbers: each has an independent stream.
const GAINS: u64 = 2;
const RUNS: u64 = 4;
const FLUCTUATIONS: u64 = 5;

/// A whisker, its base and the light there.
#[derive(Clone, Debug)]
pub(crate) struct Site {
    pub whisker: Whisker,
    pub tip: Tip,
    gain: f64,
    /// Current brightness, as a fraction of full scale.
    brightness: f64,
}

/// How what is there passes the whiskers in a stretch of time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passing {
    /// See [`Passage`].
    pub speed_mm_s: f64,
    /// The part of the path that `speed_mm_s` counts, or `None` if nothing rubs.
    pub share: Option<f64>,
    /// The shortest time scale, in s ([`fastest_s`]).
    pub fastest_s: f64,
}

/// The 25 whiskers of a sensor, bent by overlaps that a program states, and the light of their bases.
///
/// A [`Scene`] moves its objects over the same whiskers, by the same arithmetic.
/// What a whisker does to the object, drag and a force that pushes it back, is not modeled.
///
/// ```
/// use wstac_scene::{SceneConfig, Skin};
///
/// let mut skin = Skin::new(&SceneConfig::new(Vec::new()));
/// // In 10 ms a plate comes down by 2 mm, and stays.
/// let flash = skin.step(&[2.0; 25], &[0.0; 25], 0.01)?;
/// let later = skin.step(&[2.0; 25], &[0.0; 25], 0.5)?;
/// assert!(flash[12] > 4.0 * later[12] && later[12] > 0.0);
/// # Ok::<(), wstac_host::error::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Skin {
    pub(crate) whisker: WhiskerConfig,
    pub(crate) light: LightConfig,
    pub(crate) sites: [Option<Site>; TAXELS],
    bending: Bending,
    seed: u64,
    noise: f64,
    fineness: f64,
    /// Gain of the light of the touch that is in progress, or that was the last.
    gain: f64,
    steps: Steps,
}

/// What [`Skin::step`] knows of the steps before.
#[derive(Clone, Copy, Debug)]
struct Steps {
    overlap_mm: [f64; TAXELS],
    /// The distances over which the touch has rubbed the tips.
    moved_mm: [f64; TAXELS],
    /// Time since the start.
    seconds: f64,
    /// Time without overlap.
    free_s: f64,
    touches: u64,
}

impl Steps {
    const NONE: Self =
        Self { overlap_mm: [0.0; TAXELS], moved_mm: [0.0; TAXELS], seconds: 0.0, free_s: f64::INFINITY, touches: 0 };
}

impl Skin {
    /// Creates the skin of a scene's sensor at rest: its `whisker`, `light`, `seed` and `noise`. The touches do not
    /// count.
    pub fn new(script: &SceneConfig) -> Self {
        Self::with_fineness(script, 1.0)
    }

    /// Creates the skin at rest with pieces of time that are `finer` times as short.
    pub(crate) fn with_fineness(script: &SceneConfig, finer: f64) -> Self {
        let (whisker, light) = (script.whisker, script.light);
        let mut gains = Rng::new(u64::from(light.unit), GAINS);
        let mut taxel = 0..;
        let sites = whisker.whiskers().map(|there| {
            // Each taxel draws its gain even if it is absent, so that its gain does not depend on which other taxels
            // are present.
            let gain = gain(light.gain_deviation, &mut gains);
            let taxel: usize = taxel.next()?;
            let gain = if light.dead.has(taxel) { 0.0 } else { gain * light.weak.gain(taxel) };
            let whisker = there?;
            // Each touch sets its own overlap.
            let tip = Tip { overlap_mm: 0.0, bent: Bent::default(), loose: false, fluctuation: Fluctuation::new(0) };
            Some(Site { whisker, tip, gain, brightness: 0.0 })
        });
        Self {
            bending: Bending::new(&whisker),
            sites,
            whisker,
            light,
            seed: script.seed,
            noise: script.noise,
            fineness: FINENESS * finer,
            // Light that still glows keeps its brightness, whatever gain the next touch has.
            gain: 1.0,
            steps: Steps::NONE,
        }
    }

    /// Returns the length of a whisker, in mm.
    pub fn length_mm(&self) -> f64 {
        self.whisker.length_mm
    }

    /// Returns the whiskers by taxel, row by row, top to bottom; `None` for a taxel without a whisker.
    pub fn whiskers(&self) -> [Option<Whisker>; TAXELS] {
        self.whisker.whiskers()
    }

    /// Advances by `seconds`, in which each whisker's overlap changes evenly to `overlap_mm`, and returns the mean
    /// light of each base, as a fraction of full scale.
    ///
    /// An overlap is the length in mm by which the upright whisker is in what is there; a gap is below 0. From 95 % of
    /// the length on, the elastica bends no further. `rubbing_mm_s` is the speed at which a surface moves sideways over
    /// each tip. Both have the taxels row by row, top to bottom. A step should be about as short as the scene needs: 1
    /// ms.
    ///
    /// # Errors
    /// An overlap is not −10 000 to 10 000 mm, a speed not 0 to 10 000 mm/s, or the time not above 0 and at most 1 s.
    /// The skin has not changed then.
    pub fn step(
        &mut self,
        overlap_mm: &[f64; TAXELS],
        rubbing_mm_s: &[f64; TAXELS],
        seconds: f64,
    ) -> Result<[f64; TAXELS], Error> {
        check(overlap_mm, rubbing_mm_s, seconds, 1.0)?;
        Ok(self.advance_to(overlap_mm, rubbing_mm_s, seconds))
    }

    fn advance_to(&mut self, overlap_mm: &[f64; TAXELS], rubbing_mm_s: &[f64; TAXELS], seconds: f64) -> [f64; TAXELS] {
        self.count_touch(overlap_mm, seconds);
        let fastest_mm_s = rubbing_mm_s.iter().copied().fold(0.0, f64::max);
        let passing = Passing {
            // Only a surface has a speed.
            speed_mm_s: 1.0,
            share: Some(1.0),
            fastest_s: fastest_s(&self.whisker, &self.light, Some(fastest_mm_s)),
        };
        let Steps { overlap_mm: before, mut moved_mm, seconds: from, .. } = self.steps;
        let light = self.advance(seconds, Some(passing), |passage, taxel, site, exposure| {
            let (ends, mm_s) = ([before[taxel], overlap_mm[taxel]], rubbing_mm_s[taxel]);
            let is_met = ends.iter().any(|overlap| *overlap > 0.0);
            if is_met {
                let rub = Rub { from_mm: moved_mm[taxel], mm_s };
                Crossing { passage, tip: &mut site.tip, rub, exposure }.approach(ends, seconds);
            }
            moved_mm[taxel] += mm_s * seconds;
            is_met
        });
        self.steps = Steps { overlap_mm: *overlap_mm, moved_mm, seconds: from + seconds, ..self.steps };
        self.seen(light, from).map(|light| light / seconds)
    }

    /// Begins a touch if these overlaps are its first.
    fn count_touch(&mut self, overlap_mm: &[f64; TAXELS], seconds: f64) {
        if overlap_mm.iter().all(|overlap| *overlap <= 0.0) {
            self.steps.free_s += seconds;
            return;
        }
        if self.steps.free_s >= APART_S {
            self.begin_touch(self.steps.touches);
            self.steps.touches += 1;
            self.steps.moved_mm = [0.0; TAXELS];
        }
        self.steps.free_s = 0.0;
    }

    /// Draws the gain of a touch's light and the fluctuation of its rubbing. Touches are counted from 0 on.
    pub(crate) fn begin_touch(&mut self, number: u64) {
        let gain = gain(self.light.run_deviation * self.noise, &mut Rng::new(self.seed, RUNS + (number << 8)));
        self.gain = gain * libm::pow(1.0 - self.light.decay, number as f64);
        let mut seeds = Rng::new(self.seed, FLUCTUATIONS + (number << 8));
        for site in &mut self.sites {
            let seed = seeds.bits();
            if let Some(site) = site {
                site.tip.fluctuation = Fluctuation::new(seed);
            }
        }
    }

    /// Advances all whiskers by `length` s, and returns the brightness of each base integrated over it, in full scales
    /// · s.
    ///
    /// `meet` advances the tip of a taxel's whisker if something meets it, and returns whether it does. Without a
    /// `passing` nothing does.
    pub(crate) fn advance(
        &mut self,
        length: f64,
        passing: Option<Passing>,
        mut meet: impl FnMut(&Passage<'_>, usize, &mut Site, &mut Exposure) -> bool,
    ) -> [f64; TAXELS] {
        let afterglow = self.light.afterglow_ms * 1e-3;
        let relaxation_s = self.whisker.relaxation_ms * 1e-3;
        let flash = self.light.flash_ms * 1e-3 * self.gain;
        let passage = passing.map(|passing| Passage {
            bending: &self.bending,
            speed_mm_s: passing.speed_mm_s,
            relaxation_s,
            step_s: passing.fastest_s / self.fineness,
            step_mm: WIDEST_STEP * self.whisker.length_mm / self.fineness,
            flash,
            rubbing: passing.share.map_or(0.0, |share| self.light.rubbing_ms * 1e-3 * self.gain / share),
            fluctuation: self.light.fluctuation * self.noise,
            fluctuation_mm: self.light.fluctuation_mm,
        });
        let mut light = [0.0; TAXELS];
        for (taxel, (light, site)) in light.iter_mut().zip(&mut self.sites).enumerate() {
            let Some(site) = site else { continue };
            let mut exposure = Exposure::new(afterglow, length);
            if !passage.as_ref().is_some_and(|passage| meet(passage, taxel, site, &mut exposure)) {
                if site.tip.bent.strain > 0.0 {
                    spring_back(&mut site.tip, relaxation_s, flash, [0.0, length], &mut exposure);
                } else if site.brightness <= 0.0 {
                    // The whisker is neither touched nor bright.
                    continue;
                }
            }
            *light = site.gain * exposure.close(&mut site.brightness, length);
        }
        light
    }

    /// Returns the light that is seen at each base `from` s after the start, if this light is emitted there.
    pub(crate) fn seen(&self, light: [f64; TAXELS], from: f64) -> [f64; TAXELS] {
        let drifted = self.light.drifted(from);
        self.light.seen(light.map(|light| light * drifted))
    }
}

/// Returns the shortest time scale of whiskers that something rubs at a speed, in s: of afterglow, spring-back or
/// rubbing.
pub(crate) fn fastest_s(whisker: &WhiskerConfig, light: &LightConfig, rubbing_mm_s: Option<f64>) -> f64 {
    let mut fastest = f64::INFINITY;
    if light.afterglow_ms > 0.0 {
        fastest = fastest.min(light.afterglow_ms * 1e-3);
    }
    if whisker.relaxation_ms > 0.0 {
        // The spring-back itself is exact; only the moments of release and contact depend on pieces.
        fastest = fastest.min(16.0 * whisker.relaxation_ms * 1e-3);
    }
    if let Some(speed) = rubbing_mm_s.filter(|_| light.rubbing_ms > 0.0 && light.fluctuation > 0.0) {
        fastest = fastest.min(3.0 * light.fluctuation_mm / speed);
    }
    fastest
}

fn check(overlap_mm: &[f64; TAXELS], rubbing_mm_s: &[f64; TAXELS], seconds: f64, most_s: f64) -> Result<(), Error> {
    let all = || {
        overlap_mm.iter().try_for_each(|overlap| within("overlap_mm", *overlap, -MOST_MM, MOST_MM))?;
        rubbing_mm_s.iter().try_for_each(|speed| within("rubbing_mm_s", *speed, 0.0, MOST_MM))?;
        if seconds > 0.0 && seconds <= most_s + SAME_S {
            return Ok(());
        }
        Err(format!("seconds is {seconds}, expected above 0 and at most {most_s:.6}"))
    };
    all().map_err(|message| Error::new(ErrorKind::Data, "skin", message))
}

/// A [`Skin`] before a camera with a global shutter: steps of time become the light and the taxel sums of frames.
///
/// ```
/// use wstac_scene::{SceneConfig, SkinCamera};
///
/// let mut camera = SkinCamera::new(&SceneConfig::new(Vec::new()))?;
/// let mut frames = 0;
/// for step in 0..1000 {
///     let overlap = if step < 900 { -1.0 } else { 3.0 };
///     if let Some(light) = camera.step(&[overlap; 25], &[0.0; 25], 1e-3)? {
///         let sums = camera.sums(&light); // for Pipeline::push_taxels
///         frames += 1;
///         assert_eq!(light[12] > 0.01, frames > 27, "{sums:?}");
///     }
/// }
/// assert_eq!(frames, 30);
/// # Ok::<(), wstac_host::error::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct SkinCamera {
    skin: Skin,
    sensor: Sensor,
    /// Lengths of a frame, and of its exposure.
    frame_s: f64,
    open_s: f64,
    /// Time since the frame's start, and its light so far in full scales · s.
    since_s: f64,
    light: [f64; TAXELS],
}

impl SkinCamera {
    /// Creates the skin and the camera of a scene's sensor. The touches do not count.
    ///
    /// # Errors
    /// [`Scene::camera`] fails, or the camera needs the future or the number of a frame: a rolling shutter, automatic
    /// exposure, dropped frames, or a growing leak.
    pub fn new(script: &SceneConfig) -> Result<Self, Error> {
        let sensor = &script.sensor;
        let keys = [
            ("[sensor] readout_ms", sensor.readout_ms),
            ("[sensor] dropped", sensor.dropped),
            ("[light] leak_per_minute", script.light.leak_per_minute),
        ];
        let key = keys.iter().find(|(_, value)| *value != 0.0);
        let key = key.map(|(key, found)| format!("{key} is {found}, expected 0"));
        let exposure = || sensor.auto_exposure.then(|| "[sensor] auto_exposure is true, expected false".to_owned());
        if let Some(wrong) = key.or_else(exposure) {
            return Err(Error::new(ErrorKind::Unsupported, "skin", format_args!("{wrong} for a skin")));
        }
        let frame_s = f64::from(sensor.rate.denominator()) / f64::from(sensor.rate.numerator());
        let open_s = frame_s * sensor.exposure;
        let (skin, sensor) = (Skin::new(script), Scene::camera(script)?);
        Ok(Self { skin, sensor, frame_s, open_s, since_s: 0.0, light: [0.0; TAXELS] })
    }

    /// Advances by `seconds`, as [`Skin::step`] does. Returns the mean light of each base over the exposure of the
    /// frame that ends in this step, or `None` if none does. Full scale is that of a shutter that is always open.
    ///
    /// # Errors
    /// Those of [`Skin::step`], or `seconds` is longer than a frame.
    pub fn step(
        &mut self,
        overlap_mm: &[f64; TAXELS],
        rubbing_mm_s: &[f64; TAXELS],
        seconds: f64,
    ) -> Result<Option<[f64; TAXELS]>, Error> {
        check(overlap_mm, rubbing_mm_s, seconds, self.frame_s)?;
        let before = self.skin.steps.overlap_mm;
        let (mut left, mut frame) = (seconds, None);
        while left > 0.0 {
            let is_open = self.since_s < self.open_s;
            let edge = if is_open { self.open_s } else { self.frame_s };
            let is_short = left < edge - self.since_s - SAME_S;
            // A rest that rounding leaves belongs to this part.
            let part = if is_short || left < edge - self.since_s + SAME_S { left } else { edge - self.since_s };
            left -= part;
            let share = left / seconds;
            let at = core::array::from_fn(|taxel| before[taxel] * share + overlap_mm[taxel] * (1.0 - share));
            let light = self.skin.advance_to(&at, rubbing_mm_s, part);
            if is_open {
                self.light.iter_mut().zip(light).for_each(|(sum, light)| *sum += light * part);
            }
            self.since_s = if is_short { self.since_s + part } else { edge };
            if self.since_s >= self.frame_s {
                frame = Some(core::mem::take(&mut self.light).map(|light| light / self.frame_s));
                self.since_s = 0.0;
            }
        }
        Ok(frame)
    }

    /// Returns the taxel sums of the next frame with this light, noise included ([`Sensor::sums`]).
    pub fn sums(&mut self, light: &[f64; TAXELS]) -> [u32; TAXELS] {
        self.sensor.sums(light)
    }

    /// Returns the camera.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Returns the skin.
    pub fn skin(&self) -> &Skin {
        &self.skin
    }
}

#[cfg(test)]
mod tests;
