//! Objects of any outline and path: their overlap with every whisker over time.
//!
//! A specimen that is the same over its width and moves evenly needs none of this: all whiskers meet one [`Surface`].
//! Any other touch becomes a surface in time for each whisker, as that of a press. Two objects at once are one such
//! surface: a whisker is bent by the object that bends it most.

use core::f64::consts::SQRT_2;

use libm::{ceil, cos, fabs, hypot, sin, sqrt, tan};

use super::specimen::{Body, Specimen};
use super::surface::Surface;
use super::touch::{Held, Slide, Touch, Twist, unit};
use super::whisker::{Whisker, WhiskerConfig};

/// Distance in mm between places at which an overlap is looked up, at the most: finer shapes are not seen.
const WIDEST_MM: f64 = 0.25;

/// A touch, and all that its overlap with a whisker needs.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    touch: Touch,
    /// Its first touch, in s after that of its group.
    after_s: f64,
    lasts_s: f64,
    /// The place of its leading end along its motion when it starts, in mm from the sensor's middle.
    start_mm: f64,
    /// Its cut along the middle, as a block of this texture has it; only that of a prism has sloping ends.
    profile: Surface,
    whisker: WhiskerConfig,
}

impl Object {
    /// Creates the object of a touch that starts `after_s` s after the first touch of its group.
    pub(crate) fn new(touch: &Touch, after_s: f64, whisker: &WhiskerConfig) -> Self {
        let specimen = match touch {
            Touch::Slide(slide) => slide.specimen,
            Touch::Twist(twist) => twist.specimen,
            Touch::Press(_) => Specimen::ALL[0],
        };
        let edge_degrees = if specimen.body == Body::Prism { specimen.edge_degrees } else { 90.0 };
        let profile = Surface::new(&Specimen { edge_degrees, ..specimen }, whisker.overlap_mm);
        let start_mm = match touch {
            Touch::Slide(slide) => slide.reach_mm(whisker)[0],
            Touch::Twist(twist) => twist.at_rest().reach_mm(whisker)[0],
            Touch::Press(_) => 0.0,
        };
        Self { touch: *touch, after_s, lasts_s: touch.lasts_s(whisker), start_mm, profile, whisker: *whisker }
    }

    /// Returns the overlap with a whisker in mm, `time` s after the group's first touch; `−∞` beside the object.
    pub(crate) fn overlap_mm(&self, taxel: usize, whisker: &Whisker, time: f64) -> f64 {
        let since = time - self.after_s;
        if since < 0.0 || since > self.lasts_s {
            return f64::NEG_INFINITY;
        }
        match &self.touch {
            Touch::Slide(slide) => {
                let place = slide.place_of(whisker, self.start_mm + self.path_mm(slide, since));
                self.below_mm(slide, whisker, place, since)
            }
            Touch::Twist(twist) => {
                let (slide, turning) = (twist.at_rest(), since - self.down_s(&twist.held));
                let place = slide.place_of(&twist.turned_back(whisker, turning), self.start_mm);
                self.below_mm(&slide, whisker, place, since)
            }
            Touch::Press(press) => {
                if !press.meets(taxel) {
                    return f64::NEG_INFINITY;
                }
                let lowest = press.overlap_mm - whisker.lowered - press.higher_mm(whisker, &self.whisker);
                let [down, up, _] = press.times_s();
                let rises = press.lift_mm_s * (up - (self.lasts_s - since));
                lowest - rises.max(press.approach_mm_s * (down - since)).max(0.0)
            }
        }
    }

    /// Returns the overlap of a place of a body with a whisker, in mm.
    fn below_mm(&self, slide: &Slide, whisker: &Whisker, place: [f64; 2], since: f64) -> f64 {
        let overlap_mm = self.whisker.overlap_mm;
        let raised = slide.held.map_or(0.0, |held| held.raised_mm(overlap_mm, since, self.lasts_s - since));
        overlap_mm - whisker.lowered - raised - drop_mm(slide, &self.profile, place, overlap_mm)
    }

    /// Returns the time in s from its first touch to its motion.
    fn down_s(&self, held: &Held) -> f64 {
        self.whisker.overlap_mm / held.approach_mm_s + held.hold_s
    }

    /// Returns how far a slide has moved in mm, `since` s after its first touch.
    fn path_mm(&self, slide: &Slide, since: f64) -> f64 {
        let Some(held) = &slide.held else { return slide.moved_mm(since) };
        let moved = slide.moved_mm((since - self.down_s(held)).max(0.0));
        held.travel_mm.map_or(moved, |travel| moved.min(travel))
    }

    /// Returns the distance in mm that the surface has moved below a whisker, `time` s after the group's first touch.
    pub(crate) fn moved_mm(&self, whisker: &Whisker, time: f64) -> f64 {
        let since = time - self.after_s;
        match &self.touch {
            Touch::Slide(slide) => self.path_mm(slide, since),
            Touch::Press(_) => 0.0,
            Touch::Twist(twist) => {
                let ([x, y], turning) = (twist.pivot_mm, since - self.down_s(&twist.held));
                let radius = hypot(whisker.x - x, whisker.y - y);
                radius * (turning.clamp(0.0, twist.turns_s()) * twist.speed_deg_s).to_radians()
            }
        }
    }

    /// Returns the farthest that a point of a specimen that a whisker meets moves in a twist, in mm.
    fn widest_mm(&self, twist: &Twist) -> f64 {
        let [x, y] = twist.pivot_mm;
        (self.whisker.span_mm() / SQRT_2 + hypot(x, y)) * fabs(twist.by_deg).to_radians()
    }

    /// Adds the moments at which a touch that is pressed on starts, is at its lowest, rises again, and ends.
    fn ends(&self, held: Option<&Held>, moments: &mut Vec<f64>) {
        let Some(held) = held else { return };
        let [down, up] = [held.approach_mm_s, held.lift_mm_s].map(|mm_s| self.whisker.overlap_mm / mm_s);
        moments.extend([0.0, down, self.lasts_s - up, self.lasts_s].map(|moment| self.after_s + moment));
    }

    /// Adds moments, in s after the group's first touch, between which nothing changes that they do not show.
    fn moments(&self, moments: &mut Vec<f64>) {
        match &self.touch {
            Touch::Slide(slide) => {
                let path = slide.path_mm(&self.whisker);
                let down = slide.held.map_or(0.0, |held| self.down_s(&held));
                let places = places(path, &slide.specimen);
                moments.extend(places.map(|place| self.after_s + down + slide.time_s(place)));
                self.ends(slide.held.as_ref(), moments);
            }
            Touch::Twist(twist) => {
                let widest = self.widest_mm(twist);
                let (down, mm_s) = (self.down_s(&twist.held), widest / twist.turns_s());
                moments.extend(places(widest, &twist.specimen).map(|place| self.after_s + down + place / mm_s));
                self.ends(Some(&twist.held), moments);
            }
            Touch::Press(press) => {
                let [down, up, hold] = press.times_s();
                moments.extend([0.0, down, down + hold, down + hold + up].map(|moment| self.after_s + moment));
            }
        }
    }
}

/// Returns places on a path at which a specimen must be looked up, in mm.
fn places(path: f64, specimen: &Specimen) -> impl Iterator<Item = f64> {
    let parts = ceil(path / specimen.coarsest_mm().min(WIDEST_MM)).max(1.0) as u32;
    (0..=parts).map(move |part| path * f64::from(part) / f64::from(parts))
}

/// Returns the surface in time that a whisker meets of some objects.
pub(crate) fn surface(objects: &[Object], taxel: usize, whisker: &Whisker) -> Surface {
    let mut moments = Vec::new();
    for object in objects {
        object.moments(&mut moments);
    }
    moments.sort_by(f64::total_cmp);
    Surface::in_time(&moments, |time| {
        let overlaps = objects.iter().map(|object| object.overlap_mm(taxel, whisker, time));
        -overlaps.fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Returns how far a body's top is below its crests at a place, in mm behind its leading end and to the left of its
/// middle; infinite beside it.
fn drop_mm(slide: &Slide, profile: &Surface, [behind, left]: [f64; 2], overlap_mm: f64) -> f64 {
    let specimen = &slide.specimen;
    let (length, half) = (specimen.length_mm, specimen.width_mm / 2.0);
    let top = |behind: f64| {
        let found = profile.segments_from(behind).first().filter(|segment| behind >= segment.from);
        found.map_or(f64::INFINITY, |segment| segment.drop_mm(behind))
    };
    let radius = length / 2.0;
    let away = behind - radius;
    // Distance to the nearest side, inwards.
    let inside = match specimen.body {
        Body::Prism => {
            // Its sides are parallel to its motion.
            let (c, s) = unit(slide.skew_deg);
            return if fabs(behind * -s + left * c) <= half { top(behind) } else { f64::INFINITY };
        }
        Body::Rod => return if fabs(left) <= half { top(behind) } else { f64::INFINITY },
        Body::Ball => {
            let below = radius * radius - away * away - left * left;
            return if below >= 0.0 { radius - sqrt(below) } else { f64::INFINITY };
        }
        Body::Block => behind.min(length - behind).min(half - fabs(left)),
        Body::Coin => radius - sqrt(away * away + left * left),
        Body::Corner { degrees } => {
            let half = degrees.to_radians() / 2.0;
            (behind * sin(half) - fabs(left) * cos(half)).min(length - behind)
        }
    };
    if inside < 0.0 {
        return f64::INFINITY;
    }
    let upright = specimen.edge_degrees >= 90.0;
    let side = if upright { 0.0 } else { overlap_mm - tan(specimen.edge_degrees.to_radians()) * inside };
    top(behind).max(side).max(0.0)
}

/// The extent of a body, in mm from its leading end's middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Its foremost and rearmost points along the motion.
    pub along: [f64; 2],
    /// Its rightmost and leftmost points across the motion.
    pub across: [f64; 2],
}

/// Returns the extent of a body that is turned against its motion; `None` if it has no end across.
pub(crate) fn extent(specimen: &Specimen, skew_deg: f64) -> Option<Extent> {
    let (length, half) = (specimen.length_mm, specimen.width_mm / 2.0);
    let (c, s) = unit(skew_deg);
    let (wide, points): (f64, [[f64; 2]; 4]) = match specimen.body {
        Body::Prism => return None,
        Body::Rod | Body::Block if half.is_infinite() => return None,
        Body::Rod | Body::Block => (0.0, [[0.0, half], [0.0, -half], [length, half], [length, -half]]),
        Body::Ball | Body::Coin => (length / 2.0, [[length / 2.0, 0.0]; 4]),
        Body::Corner { degrees } => {
            let half = length * tan(degrees.to_radians() / 2.0);
            (0.0, [[0.0, 0.0], [0.0, 0.0], [length, half], [length, -half]])
        }
    };
    let along = points.map(|[behind, left]| -behind * c - left * s);
    let across = points.map(|[behind, left]| -behind * s + left * c);
    let most = |all: [f64; 4]| all.into_iter().fold(f64::NEG_INFINITY, f64::max) + wide;
    let least = |all: [f64; 4]| all.into_iter().fold(f64::INFINITY, f64::min) - wide;
    Some(Extent { along: [most(along), least(along)], across: [least(across), most(across)] })
}
