//! The elastomer with its whiskers: it turns touches into the light of 25 bases over time.

use wstac_core::params::TAXELS;

use super::Truth;
use super::contact::{Passage, Rub, Tip, spring_back};
use super::light::{Exposure, Fluctuation, LightConfig, gain};
use super::object::{self, Object};
use super::rng::Rng;
use super::script::SceneConfig;
use super::surface::Surface;
use super::touch::{Slide, Touch};
use super::whisker::{Bending, Bent, Whisker, WhiskerConfig};

/// Number of pieces of time in the afterglow's time constant and in the crossing of a period.
///
/// Halving the pieces changes no feature by more than 1 unit of 2^-11 (tested).
const FINENESS: f64 = 32.0;

/// Largest time in which a changing speed counts as even, in s: at the steepest profile it changes by about 1 %.
const EVEN_S: f64 = 1e-3;

/// Change of the overlap that is divided this way, as a fraction of a whisker's length.
const WIDEST_STEP: f64 = 0.8;

/// Purposes of random numbers: each has an independent stream.
const GAINS: u64 = 2;
const RUNS: u64 = 4;
const FLUCTUATIONS: u64 = 5;

/// A whisker, its base and the light there.
#[derive(Clone, Debug)]
struct Site {
    whisker: Whisker,
    tip: Tip,
    gain: f64,
    /// Current brightness, as a fraction of full scale.
    brightness: f64,
}

/// The touch that is next or in progress.
#[derive(Clone, Debug)]
struct Current {
    touch: Touch,
    /// For each taxel, whether the touch reaches its whisker, and how far that is behind the first touched place in mm.
    /// Both stay the same for the whole touch.
    meets: [bool; TAXELS],
    behind_mm: [f64; TAXELS],
    /// What all whiskers meet, or, in time, what each of them meets of the objects.
    surfaces: Vec<Surface>,
    /// Empty if all whiskers meet the same.
    objects: Vec<Object>,
    /// First and last touch, in s.
    start: f64,
    end: f64,
    gain: f64,
}

/// All whiskers, and the light of their bases.
#[derive(Clone, Debug)]
pub(crate) struct Elastomer {
    whisker: WhiskerConfig,
    light: LightConfig,
    bending: Bending,
    sites: [Option<Site>; TAXELS],
    current: Option<Current>,
    /// Index of the touch that comes after the current one.
    next: usize,
    seed: u64,
    noise: f64,
    fineness: f64,
}

impl Elastomer {
    /// Creates the elastomer at rest.
    pub(crate) fn new(script: &SceneConfig) -> Self {
        Self::with_fineness(script, 1.0)
    }

    /// Creates the elastomer at rest with pieces of time that are `finer` times as short.
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
            current: None,
            next: 0,
            seed: script.seed,
            noise: script.noise,
            fineness: FINENESS * finer,
        }
    }

    /// Returns the light of every base over the next `length` s, which start at `from` s.
    ///
    /// The shutter is open for the first `open` s. The light is the brightness integrated over these, in full scales ·
    /// s.
    pub(crate) fn expose(&mut self, truth: &[Truth], from: f64, open: f64, length: f64) -> [f64; TAXELS] {
        self.turn_to(truth, from, from + length);
        let drifted = self.light.drifted(from);
        let light = self.pass(from, open);
        if open < length {
            self.pass(from + open, length - open);
        }
        self.light.seen(light.map(|light| light * drifted))
    }

    /// Advances by `length` s. A stretch in which the speed changes is divided into shorter ones.
    fn pass(&mut self, from: f64, length: f64) -> [f64; TAXELS] {
        if !self.current.as_ref().is_some_and(Current::changes) {
            return self.pass_evenly(from, length);
        }
        let parts = libm::ceil(length / EVEN_S).max(1.0) as u32;
        let part = length / f64::from(parts);
        let mut light = [0.0; TAXELS];
        for number in 0..parts {
            let more = self.pass_evenly(from + f64::from(number) * part, part);
            light.iter_mut().zip(more).for_each(|(light, more)| *light += more);
        }
        light
    }

    /// Advances by `length` s in which the speed does not change.
    fn pass_evenly(&mut self, from: f64, length: f64) -> [f64; TAXELS] {
        let afterglow = self.light.afterglow_ms * 1e-3;
        let relaxation_s = self.whisker.relaxation_ms * 1e-3;
        // Light that still glows keeps its brightness, whatever gain the next touch has.
        let gain = self.current.as_ref().map_or(1.0, |current| current.gain);
        let flash = self.light.flash_ms * 1e-3 * gain;
        let under_way = |current: &&Current| current.start < from + length && current.end > from;
        let current = self.current.as_ref().filter(under_way);
        let passage = current.map(|current| {
            let (speed_mm_s, rubbing) = match &current.touch {
                _ if !current.objects.is_empty() => (1.0, self.light.rubbing_ms * 1e-3 * gain),
                Touch::Slide(slide) => {
                    let share = slide.normal_share();
                    let mean = if slide.profile.is_some() {
                        let since = (from - current.start).max(0.0);
                        let until = (from + length - current.start).max(0.0);
                        ((slide.moved_mm(until) - slide.moved_mm(since)) / (until - since)).max(f64::MIN_POSITIVE)
                    } else {
                        slide.speed_mm_s
                    };
                    (mean * share, self.light.rubbing_ms * 1e-3 * gain / share)
                }
                // The surface of a press is a path in time.
                _ => (1.0, 0.0),
            };
            Passage {
                bending: &self.bending,
                speed_mm_s,
                relaxation_s,
                step_s: fastest_s(&self.whisker, &self.light, &current.touch) / self.fineness,
                step_mm: WIDEST_STEP * self.whisker.length_mm / self.fineness,
                flash,
                rubbing,
                fluctuation: self.light.fluctuation * self.noise,
                fluctuation_mm: self.light.fluctuation_mm,
            }
        });
        let mut light = [0.0; TAXELS];
        for (taxel, (light, site)) in light.iter_mut().zip(&mut self.sites).enumerate() {
            let Some(site) = site else { continue };
            let mut exposure = Exposure::new(afterglow, length);
            match (&passage, current) {
                (Some(passage), Some(current)) if current.meets[taxel] => {
                    let passed = passed(current, current.behind_mm[taxel], from);
                    let rub = current.rub(taxel, &site.whisker, passed, passage.speed_mm_s, length);
                    let surface = current.surfaces.get(taxel).or(current.surfaces.first());
                    if let Some(surface) = surface {
                        passage.advance(&mut site.tip, surface, passed, rub, length, &mut exposure);
                    }
                }
                _ if site.tip.bent.strain > 0.0 => {
                    spring_back(&mut site.tip, relaxation_s, flash, [0.0, length], &mut exposure);
                }
                // The whisker is neither touched nor bright.
                _ if site.brightness <= 0.0 => continue,
                _ => {}
            }
            *light = site.gain * exposure.close(&mut site.brightness, length);
        }
        light
    }

    /// Returns what each whisker meets of objects, in time; the overlaps of the tips with it are 0.
    fn surfaces_of(
        &mut self,
        objects: &[Object],
        meets: &mut [bool; TAXELS],
        behind_mm: &mut [f64; TAXELS],
    ) -> Vec<Surface> {
        *behind_mm = [0.0; TAXELS];
        let mut surfaces = Vec::new();
        for (taxel, (site, meets)) in self.sites.iter_mut().zip(meets).enumerate() {
            let surface = site.as_mut().map(|site| {
                site.tip.overlap_mm = 0.0;
                object::surface(objects, taxel, &site.whisker)
            });
            let surface = surface.unwrap_or_default();
            *meets = !surface.segments().is_empty();
            surfaces.push(surface);
        }
        surfaces
    }

    /// Makes the first touch current that is not over at `from` s, if it starts before `to` s.
    fn turn_to(&mut self, truth: &[Truth], from: f64, to: f64) {
        if self.current.as_ref().is_some_and(|current| current.end > from) {
            return;
        }
        while truth.get(self.next).is_some_and(|truth| truth.end_s <= from) {
            self.next += 1;
        }
        let rest = truth.get(self.next..).unwrap_or_default();
        let Some(truth) = rest.first().filter(|truth| truth.start_s < to) else { return };
        let beside = rest.iter().skip(1).take_while(|truth| truth.touch.after_s().is_some()).count();
        let (group, is_alone) = (rest.get(..=beside).unwrap_or_default(), beside == 0);
        let number = self.next as u64;
        self.next += group.len();
        let gain = gain(self.light.run_deviation * self.noise, &mut Rng::new(self.seed, RUNS + (number << 8)));
        let gain = gain * libm::pow(1.0 - self.light.decay, number as f64);
        let mut seeds = Rng::new(self.seed, FLUCTUATIONS + (number << 8));
        let (mut meets, mut behind_mm) = ([false; TAXELS], [0.0; TAXELS]);
        for (taxel, site) in self.sites.iter_mut().enumerate() {
            let seed = seeds.bits();
            if let Some(site) = site {
                site.tip.fluctuation = Fluctuation::new(seed);
                site.tip.overlap_mm = overlap_mm(&self.whisker, &site.whisker, &truth.touch);
                meets[taxel] = is_met(&truth.touch, taxel, &site.whisker);
                behind_mm[taxel] = truth.touch.slide().map_or(0.0, |slide| slide.behind(&site.whisker, &self.whisker));
            }
        }
        let mut objects = Vec::new();
        let surfaces = match &truth.touch {
            Touch::Slide(slide) if is_alone && slide.is_even_prism() => {
                vec![Surface::new(&slide.specimen, self.whisker.overlap_mm)]
            }
            Touch::Press(press) if is_alone => vec![Surface::plate(press.overlap_mm, press.approach_s(), press.hold_s)],
            _ => {
                let after_s = |of: &Truth| of.start_s - truth.start_s;
                objects.extend(group.iter().map(|of| Object::new(&of.touch, after_s(of), &self.whisker)));
                self.surfaces_of(&objects, &mut meets, &mut behind_mm)
            }
        };
        self.current = Some(Current {
            touch: truth.touch,
            meets,
            behind_mm,
            surfaces,
            objects,
            start: truth.start_s,
            end: group.iter().fold(truth.end_s, |end, truth| end.max(truth.end_s)),
            gain,
        });
    }
}

impl Current {
    /// Returns `true` if its speed changes within a frame.
    fn changes(&self) -> bool {
        self.objects.len() > 1
            || self.touch.slide().is_some_and(Slide::changes)
            || matches!(self.touch, Touch::Twist(_))
    }

    /// Returns how the surface rubs a whisker in a stretch of `length` s.
    fn rub(&self, taxel: usize, whisker: &Whisker, passed: f64, speed_mm_s: f64, length: f64) -> Rub {
        let overlap = |object: &&Object| object.overlap_mm(taxel, whisker, passed + 0.5 * length);
        let deepest = self.objects.iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b)));
        deepest.map_or(Rub { from_mm: passed, mm_s: speed_mm_s }, |object| {
            let from_mm = object.moved_mm(whisker, passed);
            Rub { from_mm, mm_s: (object.moved_mm(whisker, passed + length) - from_mm) / length }
        })
    }
}

/// Returns the shortest time scale of a touch, in s: of texture, afterglow, spring-back or rubbing.
pub(crate) fn fastest_s(whisker: &WhiskerConfig, light: &LightConfig, touch: &Touch) -> f64 {
    let mut fastest = touch.slide().map_or(f64::INFINITY, |slide| slide.specimen.finest_mm() / slide.fastest_mm_s());
    if light.afterglow_ms > 0.0 {
        fastest = fastest.min(light.afterglow_ms * 1e-3);
    }
    if whisker.relaxation_ms > 0.0 {
        // The spring-back itself is exact; only the moments of release and contact depend on pieces.
        fastest = fastest.min(16.0 * whisker.relaxation_ms * 1e-3);
    }
    if let Some(slide) = touch.slide().filter(|_| light.rubbing_ms > 0.0 && light.fluctuation > 0.0) {
        fastest = fastest.min(3.0 * light.fluctuation_mm / slide.fastest_mm_s());
    }
    fastest
}

/// Returns whether a touch reaches a whisker.
fn is_met(touch: &Touch, taxel: usize, whisker: &Whisker) -> bool {
    match touch {
        Touch::Slide(slide) => slide.meets(whisker),
        Touch::Press(press) => press.meets(taxel),
        Touch::Twist(_) => true,
    }
}

/// Returns how far the surface has passed a whisker at `from` s: in mm for a slide, in s for a press.
fn passed(current: &Current, behind_mm: f64, from: f64) -> f64 {
    let since = from - current.start;
    match &current.touch {
        // The leading end starts at the first whiskers.
        Touch::Slide(slide) if current.objects.is_empty() => {
            let moved = if since < 0.0 { slide.speed_mm_s * since } else { slide.moved_mm(since) };
            moved * slide.normal_share() - behind_mm
        }
        _ => since,
    }
}

/// Returns the overlap of a touch's crests, or of its plate at its lowest, with a whisker, in mm.
fn overlap_mm(config: &WhiskerConfig, whisker: &Whisker, touch: &Touch) -> f64 {
    match touch {
        Touch::Slide(_) | Touch::Twist(_) => config.overlap_mm - whisker.lowered,
        Touch::Press(press) => press.overlap_mm - whisker.lowered - press.higher_mm(whisker, config),
    }
}
