//! The elastomer with its whiskers: it turns slides into the light of 25 bases over time.

use wstac_core::params::TAXELS;

use super::Truth;
use super::contact::{Passage, Tip, spring_back};
use super::light::{Exposure, Fluctuation, LightConfig, gain};
use super::rng::Rng;
use super::script::{SceneConfig, Slide};
use super::surface::Surface;
use super::whisker::{Bending, Bent, Whisker, WhiskerConfig};

/// Number of pieces of time in the afterglow's time constant and in the crossing of a period.
///
/// Halving the pieces changes no feature by more than 1 unit of 2^-11 (tested).
const FINENESS: f64 = 32.0;

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

/// The slide that is next or in progress.
#[derive(Clone, Debug)]
struct Current {
    slide: Slide,
    surface: Surface,
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
    /// Index of the slide that comes after the current one.
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
            let gain = if taxel.next().is_some_and(|taxel| light.dead.has(taxel)) { 0.0 } else { gain };
            let whisker = there?;
            let overlap_mm = whisker_overlap(&script.whisker, &whisker);
            let tip = Tip { overlap_mm, bent: Bent::default(), loose: false, fluctuation: Fluctuation::new(0) };
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
        light.map(|light| light * drifted)
    }

    /// Advances by `length` s.
    fn pass(&mut self, from: f64, length: f64) -> [f64; TAXELS] {
        let afterglow = self.light.afterglow_ms * 1e-3;
        let relaxation_s = self.whisker.relaxation_ms * 1e-3;
        let half_span = self.whisker.span_mm() / 2.0;
        // Light that still glows keeps its brightness, whatever gain the next slide has.
        let gain = self.current.as_ref().map_or(1.0, |current| current.gain);
        let flash = self.light.flash_ms * 1e-3 * gain;
        let under_way = |current: &&Current| current.start < from + length && current.end > from;
        let current = self.current.as_ref().filter(under_way);
        let passage = current.map(|current| Passage {
            surface: &current.surface,
            bending: &self.bending,
            speed_mm_s: current.slide.speed_mm_s,
            relaxation_s,
            step_s: fastest_s(&self.whisker, &self.light, &current.slide) / self.fineness,
            step_mm: WIDEST_STEP * self.whisker.length_mm / self.fineness,
            flash,
            rubbing: self.light.rubbing_ms * 1e-3 * gain,
            fluctuation: self.light.fluctuation * self.noise,
            fluctuation_mm: self.light.fluctuation_mm,
        });
        let mut light = [0.0; TAXELS];
        for (light, site) in light.iter_mut().zip(&mut self.sites) {
            let Some(site) = site else { continue };
            let mut exposure = Exposure::new(afterglow, length);
            match (&passage, current) {
                (Some(passage), Some(current)) => {
                    // The leading end starts at the first whiskers.
                    let behind = half_span + site.whisker.along(current.slide.heading);
                    let passed = current.slide.speed_mm_s * (from - current.start) - behind;
                    passage.advance(&mut site.tip, passed, length, &mut exposure);
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

    /// Makes the first slide current that is not over at `from` s, if it starts before `to` s.
    fn turn_to(&mut self, truth: &[Truth], from: f64, to: f64) {
        if self.current.as_ref().is_some_and(|current| current.end > from) {
            return;
        }
        while truth.get(self.next).is_some_and(|truth| truth.end_s <= from) {
            self.next += 1;
        }
        let Some(truth) = truth.get(self.next).filter(|truth| truth.start_s < to) else { return };
        let number = self.next as u64;
        self.next += 1;
        let gain = gain(self.light.run_deviation * self.noise, &mut Rng::new(self.seed, RUNS + (number << 8)));
        let mut seeds = Rng::new(self.seed, FLUCTUATIONS + (number << 8));
        for site in &mut self.sites {
            let seed = seeds.bits();
            if let Some(site) = site {
                site.tip.fluctuation = Fluctuation::new(seed);
            }
        }
        let surface = Surface::new(&truth.slide.specimen, self.whisker.overlap_mm);
        self.current = Some(Current { slide: truth.slide, surface, start: truth.start_s, end: truth.end_s, gain });
    }
}

/// Returns the shortest time scale of a slide, in s: of texture, afterglow, spring-back or rubbing.
fn fastest_s(whisker: &WhiskerConfig, light: &LightConfig, slide: &Slide) -> f64 {
    let mut fastest = slide.specimen.finest_mm() / slide.speed_mm_s;
    if light.afterglow_ms > 0.0 {
        fastest = fastest.min(light.afterglow_ms * 1e-3);
    }
    if whisker.relaxation_ms > 0.0 {
        // The spring-back itself is exact; only the moments of release and contact depend on pieces.
        fastest = fastest.min(16.0 * whisker.relaxation_ms * 1e-3);
    }
    if light.rubbing_ms > 0.0 && light.fluctuation > 0.0 {
        fastest = fastest.min(3.0 * light.fluctuation_mm / slide.speed_mm_s);
    }
    fastest
}

/// Returns the overlap of the crests with a whisker, in mm.
fn whisker_overlap(config: &WhiskerConfig, whisker: &Whisker) -> f64 {
    config.overlap_mm - whisker.lowered
}
