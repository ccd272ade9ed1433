//! A scene's touches on their way over the skin.

use wstac_core::params::TAXELS;

use super::Truth;
use super::contact::{Crossing, Rub};
use super::light::LightConfig;
use super::object::{self, Object};
use super::skin::{self, Passing, Skin};
use super::surface::Surface;
use super::touch::{Slide, Touch};
use super::whisker::{Whisker, WhiskerConfig};

/// Largest time in which a changing speed counts as even, in s: at the steepest profile it changes by about 1 %.
const EVEN_S: f64 = 1e-3;

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
}

/// A skin over which a scene's touches move.
#[derive(Clone, Debug)]
pub(crate) struct Elastomer {
    skin: Skin,
    current: Option<Current>,
    /// Index of the touch that comes after the current one.
    next: usize,
}

impl Elastomer {
    /// Creates the elastomer at rest.
    pub(crate) fn new(skin: Skin) -> Self {
        Self { skin, current: None, next: 0 }
    }

    /// Returns the light of every base over the next `length` s, which start at `from` s.
    ///
    /// The shutter is open for the first `open` s. The light is the brightness integrated over these, in full scales ·
    /// s.
    pub(crate) fn expose(&mut self, truth: &[Truth], from: f64, open: f64, length: f64) -> [f64; TAXELS] {
        self.turn_to(truth, from, from + length);
        let light = self.pass(from, open);
        if open < length {
            self.pass(from + open, length - open);
        }
        self.skin.seen(light, from)
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
        let under_way = |current: &&Current| current.start < from + length && current.end > from;
        let current = self.current.as_ref().filter(under_way);
        let passing = current.map(|current| {
            let (speed_mm_s, share) = match &current.touch {
                _ if !current.objects.is_empty() => (1.0, Some(1.0)),
                Touch::Slide(slide) => {
                    let share = slide.normal_share();
                    let mean = if slide.profile.is_some() {
                        let since = (from - current.start).max(0.0);
                        let until = (from + length - current.start).max(0.0);
                        ((slide.moved_mm(until) - slide.moved_mm(since)) / (until - since)).max(f64::MIN_POSITIVE)
                    } else {
                        slide.speed_mm_s
                    };
                    (mean * share, Some(share))
                }
                // The surface of a press is a path in time.
                _ => (1.0, None),
            };
            Passing { speed_mm_s, share, fastest_s: fastest_s(&self.skin.whisker, &self.skin.light, &current.touch) }
        });
        self.skin.advance(length, passing, |passage, taxel, site, exposure| {
            let Some(current) = current.filter(|current| current.meets[taxel]) else { return false };
            let passed = passed(current, current.behind_mm[taxel], from);
            let rub = current.rub(taxel, &site.whisker, passed, passage.speed_mm_s, length);
            if let Some(surface) = current.surfaces.get(taxel).or(current.surfaces.first()) {
                Crossing { passage, tip: &mut site.tip, rub, exposure }.advance(surface, passed, length);
            }
            true
        })
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
        for (taxel, (site, meets)) in self.skin.sites.iter_mut().zip(meets).enumerate() {
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
        self.skin.begin_touch(number);
        let whisker = self.skin.whisker;
        let (mut meets, mut behind_mm) = ([false; TAXELS], [0.0; TAXELS]);
        for (taxel, site) in self.skin.sites.iter_mut().enumerate() {
            if let Some(site) = site {
                site.tip.overlap_mm = overlap_mm(&whisker, &site.whisker, &truth.touch);
                meets[taxel] = is_met(&truth.touch, taxel, &site.whisker);
                behind_mm[taxel] = truth.touch.slide().map_or(0.0, |slide| slide.behind(&site.whisker, &whisker));
            }
        }
        let mut objects = Vec::new();
        let surfaces = match &truth.touch {
            Touch::Slide(slide) if is_alone && slide.is_even_prism() => {
                vec![Surface::new(&slide.specimen, whisker.overlap_mm)]
            }
            Touch::Press(press) if is_alone => vec![Surface::plate(press.overlap_mm, press.times_s())],
            _ => {
                let after_s = |of: &Truth| of.start_s - truth.start_s;
                objects.extend(group.iter().map(|of| Object::new(&of.touch, after_s(of), &whisker)));
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
    let slide = touch.slide();
    let texture_s = slide.map_or(f64::INFINITY, |slide| slide.specimen.finest_mm() / slide.fastest_mm_s());
    skin::fastest_s(whisker, light, slide.map(Slide::fastest_mm_s)).min(texture_s)
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
