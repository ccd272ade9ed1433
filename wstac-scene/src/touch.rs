//! Touches: slides of a specimen at any angle, and presses, pokes and holds of a plate.

use core::fmt;

use libm::{cos, expm1, fabs, log1p, sin, tan};
use wstac_core::paper::direction::Heading;

use super::object::{Extent, extent};
use super::specimen::Specimen;
use super::whisker::{Whisker, WhiskerConfig};

/// Largest number of points of a speed profile.
pub const MOST_POINTS: usize = 8;

/// Largest number of rests of a slide.
const MOST_RESTS: u32 = 4096;

/// A touch of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Touch {
    /// A specimen slides over the whiskers.
    Slide(Slide),
    /// A plate or a tip comes down, stays, and leaves.
    Press(Press),
    /// A specimen is pressed on, turns about a point, and leaves.
    Twist(Twist),
}

impl Touch {
    /// Returns the slide, or `None` if it is another kind of touch.
    pub fn slide(&self) -> Option<&Slide> {
        match self {
            Self::Slide(slide) => Some(slide),
            Self::Press(_) | Self::Twist(_) => None,
        }
    }

    /// Returns the name of its kind, as a scene's file has it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Slide(_) => "slide",
            Self::Press(press) => press.kind.name(),
            Self::Twist(_) => "twist",
        }
    }

    /// Returns the time in s from the first touch before it to its own, if both are there at once.
    pub fn after_s(&self) -> Option<f64> {
        self.slide().and_then(|slide| slide.after_s)
    }

    /// Returns the time from its first to its last touch in s.
    pub(crate) fn lasts_s(&self, whisker: &WhiskerConfig) -> f64 {
        match self {
            Self::Slide(slide) => {
                let [down, lifts] = slide.held.map_or([0.0; 2], |held| held.times_s(whisker.overlap_mm));
                down + slide.time_s(slide.path_mm(whisker)) + lifts
            }
            Self::Press(press) => press.times_s().iter().sum(),
            Self::Twist(twist) => {
                let [down, lifts] = twist.held.times_s(whisker.overlap_mm);
                down + twist.turns_s() + lifts
            }
        }
    }
}

impl fmt::Display for Touch {
    /// Writes the kind, and what is needed to tell it from others.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slide(slide) => {
                write!(f, "{} at {} mm/s", slide.specimen, slide.speed_mm_s)?;
                if let Some([_, last]) = slide.profile.as_ref().and_then(|profile| profile.points().last()) {
                    write!(f, " to {last} mm/s")?;
                }
                write!(f, ", {} degrees", slide.direction_deg)?;
                if let Some(held) = &slide.held {
                    write!(f, ", held for {} s", held.hold_s)?;
                }
                if slide.turn_deg_mm != 0.0 {
                    write!(f, ", turns by {} degrees per mm", slide.turn_deg_mm)?;
                }
                if let Some(Rest { every_mm, rest_s, .. }) = slide.rest {
                    let how = if every_mm.is_finite() { "sticks" } else { "stops" };
                    write!(f, ", {how} for {rest_s} s")?;
                }
                Ok(())
            }
            Self::Twist(twist) => write!(f, "{} twists by {} degrees", twist.specimen, twist.by_deg),
            Self::Press(press) => {
                write!(f, "{} by {} mm for {} s", press.kind.name(), press.overlap_mm, press.hold_s)?;
                match press.whisker {
                    Some([row, column]) => write!(f, " on whisker [{row}, {column}]"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// One slide of a specimen over the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// The specimen.
    pub specimen: Specimen,
    /// Its speed at the first touch, in mm/s.
    pub speed_mm_s: f64,
    /// The direction of its motion in degrees, counterclockwise from the right along the sensor's rows:
    /// 0 ≤ degrees < 360.
    pub direction_deg: f64,
    /// The angle by which the block is turned against its motion, in degrees, counterclockwise: its edges and its
    /// texture arrive at that angle. 0 is at right angles to the motion.
    pub skew_deg: f64,
    /// Distance of the block's middle from the sensor's middle, across the motion, to its left, in mm.
    pub offset_mm: f64,
    /// The speed along the path, if it changes.
    pub profile: Option<SpeedProfile>,
    /// The angle in degrees by which the block and its direction turn per mm of path, counterclockwise. They are as
    /// stated when the leading end's middle passes the sensor's middle.
    pub turn_deg_mm: f64,
    /// Where it rests, if it does.
    pub rest: Option<Rest>,
    /// How it is pressed on before it slides; `None` if it comes from the side.
    pub held: Option<Held>,
    /// The time in s from the start of the first touch before it to its own start; `None` if that one ends first.
    pub after_s: Option<f64>,
}

/// Rests of a slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// The place of the first one on the path, in mm.
    pub first_mm: f64,
    /// The distance between them, in mm; infinite if there is one.
    pub every_mm: f64,
    /// The time of each in s.
    pub rest_s: f64,
}

/// How a specimen is pressed on the sensor before it moves, with its middle on the sensor's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Vertical speed in mm/s, down.
    pub approach_mm_s: f64,
    /// Vertical speed in mm/s, up.
    pub lift_mm_s: f64,
    /// Time from its lowest place to its motion, in s.
    pub hold_s: f64,
    /// Distance in mm after which it is lifted off; `None` if it slides until it has left all whiskers.
    pub travel_mm: Option<f64>,
}

impl Rest {
    /// Returns the place of a rest on the path in mm; the first one has number 0.
    fn place_mm(&self, number: u32) -> f64 {
        if number == 0 { self.first_mm } else { self.first_mm + f64::from(number) * self.every_mm }
    }
}

impl Held {
    /// Returns the times in s before it moves, and after it has moved.
    fn times_s(&self, overlap_mm: f64) -> [f64; 2] {
        let [down, up] = [self.approach_mm_s, self.lift_mm_s].map(|mm_s| overlap_mm / mm_s);
        [down + self.hold_s, if self.travel_mm.is_some() { up } else { 0.0 }]
    }

    /// Returns how far it is above its lowest place, in mm, `since` s after its first touch and `left` s before its
    /// end.
    pub(crate) fn raised_mm(&self, overlap_mm: f64, since: f64, left: f64) -> f64 {
        let up = if self.travel_mm.is_some() { self.lift_mm_s * left } else { f64::INFINITY };
        (overlap_mm - up.min(self.approach_mm_s * since)).max(0.0)
    }
}

/// A specimen that is pressed on, turns about a point, and is lifted off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// The specimen; its middle is on the sensor's middle.
    pub specimen: Specimen,
    /// The direction of its length in degrees at the start.
    pub direction_deg: f64,
    /// The point about which it turns, to the right of and above the sensor's middle, in mm.
    pub pivot_mm: [f64; 2],
    /// The angle by which it turns in degrees, counterclockwise.
    pub by_deg: f64,
    /// Its angular speed in degrees per second, above 0.
    pub speed_deg_s: f64,
    /// How it is pressed on.
    pub held: Held,
}

impl Twist {
    /// Returns the time in which it turns, in s.
    pub(crate) fn turns_s(&self) -> f64 {
        fabs(self.by_deg) / self.speed_deg_s
    }

    /// Returns a slide that has the same specimen at the same place before it moves.
    pub(crate) fn at_rest(&self) -> Slide {
        Slide { held: Some(self.held), ..Slide::new(self.specimen, 1.0, self.direction_deg) }
    }

    /// Returns where a whisker would touch the specimen `time` s after it began to turn, had it not turned.
    pub(crate) fn turned_back(&self, whisker: &Whisker, time: f64) -> Whisker {
        let angle = self.by_deg * (time / self.turns_s()).clamp(0.0, 1.0);
        let ((c, s), [px, py]) = (unit(angle), self.pivot_mm);
        let (x, y) = (whisker.x - px, whisker.y - py);
        Whisker { x: px + x * c + y * s, y: py + y * c - x * s, ..*whisker }
    }
}

impl Slide {
    /// Creates a slide at an even speed in mm/s, in a direction in degrees, across the middle, with edges at right
    /// angles to its motion.
    pub fn new(specimen: Specimen, speed_mm_s: f64, direction_deg: f64) -> Self {
        Self {
            specimen,
            speed_mm_s,
            direction_deg,
            skew_deg: 0.0,
            offset_mm: 0.0,
            profile: None,
            turn_deg_mm: 0.0,
            rest: None,
            held: None,
            after_s: None,
        }
    }

    /// Returns its heading if its direction is a multiple of 90 degrees.
    pub fn heading(&self) -> Option<Heading> {
        let all = [Heading::Right, Heading::Up, Heading::Left, Heading::Down];
        all.into_iter().find(|heading| fabs(f64::from(heading.degrees()) - self.direction_deg) < 1e-9)
    }

    /// Returns how far a whisker is behind the first touched place, in mm along the normal of the block's edge.
    pub(crate) fn behind(&self, whisker: &Whisker, config: &WhiskerConfig) -> f64 {
        let (c, s) = self.normal();
        config.span_mm() / 2.0 * (fabs(c) + fabs(s)) + whisker.along(c, s)
    }

    /// Returns whether a whisker is within the block's width.
    pub(crate) fn meets(&self, whisker: &Whisker) -> bool {
        let (c, s) = unit(self.direction_deg);
        fabs(whisker.along(-s, c) - self.offset_mm) <= self.specimen.width_mm / 2.0
    }

    /// Returns the distance in mm that the surface moves along its edge's normal per mm of motion.
    pub(crate) fn normal_share(&self) -> f64 {
        unit(self.skew_deg).0
    }

    /// Returns the distance in mm that the block moves from the first to the last touch of all whiskers.
    pub(crate) fn path_mm(&self, config: &WhiskerConfig) -> f64 {
        if !self.is_even_prism() {
            let [start, end] = self.reach_mm(config);
            return end - start;
        }
        self.straight_path_mm(config)
    }

    fn straight_path_mm(&self, config: &WhiskerConfig) -> f64 {
        let (c, s) = self.normal();
        (self.specimen.length_mm + config.span_mm() * (fabs(c) + fabs(s))) / self.normal_share()
    }

    /// Returns the first and last places of the leading end's middle along the motion, in mm from the sensor's middle.
    pub(crate) fn reach_mm(&self, config: &WhiskerConfig) -> [f64; 2] {
        let [start, end] = self.straight_reach_mm(config);
        let Some(held) = self.held else {
            // A path that turns meets whiskers earlier, or later.
            let more = if self.turn_deg_mm == 0.0 { 0.0 } else { 0.1 * (end - start) };
            return [start - more, end + more];
        };
        let [front, back] = extent(&self.specimen, self.skew_deg)
            .map_or_else(|| [0.0, -self.specimen.length_mm / self.normal_share()], |extent| extent.along);
        let start = -(front + back) / 2.0;
        [start, held.travel_mm.map_or(end, |travel| start + travel)]
    }

    fn straight_reach_mm(&self, config: &WhiskerConfig) -> [f64; 2] {
        let Some(Extent { along: [front, back], across }) = extent(&self.specimen, self.skew_deg) else {
            let ((c, s), (_, sine)) = (self.normal(), unit(self.skew_deg));
            let half = config.span_mm() / 2.0 * (fabs(c) + fabs(s));
            let start = -(half + self.offset_mm * sine) / self.normal_share();
            return [start, start + self.straight_path_mm(config)];
        };
        let (c, s) = unit(self.direction_deg);
        let [right, left] = across.map(|across| across + self.offset_mm);
        let all = config.whiskers().into_iter().flatten();
        let met = all.filter(|whisker| (right..=left).contains(&whisker.along(-s, c)));
        let places = met.map(|whisker| whisker.along(c, s));
        let [first, last] =
            places.fold([f64::INFINITY, f64::NEG_INFINITY], |[first, last], place| [first.min(place), last.max(place)]);
        // A body that passes beside all whiskers crosses the middle.
        if first > last { [-front, -back] } else { [first - front, last - back] }
    }

    /// Returns a whisker's place in mm behind the leading end and to the left of its middle.
    ///
    /// The leading end's middle is `along` mm from the sensor's middle, along the motion.
    pub(crate) fn place_of(&self, whisker: &Whisker, along: f64) -> [f64; 2] {
        let (c, s) = unit(self.direction_deg);
        let turned = self.turn_deg_mm * along;
        let (ahead, left) = if self.turn_deg_mm == 0.0 {
            (along, self.offset_mm)
        } else {
            // An arc of this radius.
            let ((c, s), radius) = (unit(turned), 1.0 / self.turn_deg_mm.to_radians());
            (radius * s, self.offset_mm + radius * (1.0 - c))
        };
        let (x, y) = (whisker.x - ahead * c + left * s, whisker.y - ahead * s - left * c);
        let (c, s) = unit(self.direction_deg + self.skew_deg + turned);
        [-(x * c + y * s), y * c - x * s]
    }

    /// Returns `true` if all whiskers meet the same cut of it, in the same way.
    pub(crate) fn is_even_prism(&self) -> bool {
        let is_straight = self.turn_deg_mm == 0.0 && self.rest.is_none() && self.held.is_none();
        is_straight && extent(&self.specimen, self.skew_deg).is_none()
    }

    /// Returns `true` if its speed or direction changes.
    pub(crate) fn changes(&self) -> bool {
        self.profile.is_some() || self.turn_deg_mm != 0.0 || self.rest.is_some() || self.held.is_some()
    }

    /// Returns the distance in mm that the block has moved `time` s after its first touch.
    pub(crate) fn moved_mm(&self, time: f64) -> f64 {
        let Some(rest) = &self.rest else { return self.moved_without_rest_mm(time) };
        // The number of rests that have begun.
        let begins = |number: u32| {
            let before = f64::from(number) * rest.rest_s;
            before + self.time_without_rest_s(rest.place_mm(number))
        };
        let (mut begun, mut most) = (0, MOST_RESTS);
        while begun < most {
            let middle = begun + (most - begun) / 2;
            if begins(middle) <= time { begun = middle + 1 } else { most = middle }
        }
        let Some(last) = begun.checked_sub(1) else { return self.moved_without_rest_mm(time) };
        let rested = (time - begins(last)).min(rest.rest_s) + f64::from(last) * rest.rest_s;
        self.moved_without_rest_mm(time - rested)
    }

    fn moved_without_rest_mm(&self, time: f64) -> f64 {
        match &self.profile {
            Some(profile) => profile.moved_mm(time),
            None => self.speed_mm_s * time,
        }
    }

    /// Returns the time in s in which the block moves `path` mm from its first touch.
    pub(crate) fn time_s(&self, path: f64) -> f64 {
        let rests = self.rest.filter(|rest| path > rest.first_mm);
        let rested = rests.map_or(0.0, |rest| {
            let number = 1.0 + libm::floor((path - rest.first_mm) / rest.every_mm);
            number.min(f64::from(MOST_RESTS)) * rest.rest_s
        });
        rested + self.time_without_rest_s(path)
    }

    fn time_without_rest_s(&self, path: f64) -> f64 {
        match &self.profile {
            Some(profile) => profile.time_s(path),
            None => path / self.speed_mm_s,
        }
    }

    /// Returns the speed in mm/s `path` mm after the first touch.
    pub fn speed_at(&self, path: f64) -> f64 {
        self.profile.as_ref().map_or(self.speed_mm_s, |profile| profile.speed_at(path))
    }

    pub(crate) fn fastest_mm_s(&self) -> f64 {
        let points = self.profile.as_ref().map_or(&[][..], SpeedProfile::points);
        points.iter().fold(self.speed_mm_s, |fastest, point| fastest.max(point[1]))
    }

    /// Returns the direction of the normal of the block's leading edge, as a unit vector.
    fn normal(&self) -> (f64, f64) {
        unit(self.direction_deg + self.skew_deg)
    }
}

/// A speed that changes along the path: straight lines between points, and even before the first and after the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedProfile {
    points: [[f64; 2]; MOST_POINTS],
    count: usize,
}

impl SpeedProfile {
    /// Creates a profile from points of a place in mm after the first touch and a speed in mm/s.
    ///
    /// Returns `None` unless there are 1 to [`MOST_POINTS`] points, with places from 0 in rising order and speeds above
    /// 0.
    pub fn new(points: &[[f64; 2]]) -> Option<Self> {
        let rising = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        let valid = points.iter().all(|[place, speed]| *place >= 0.0 && *speed > 0.0 && (place + speed).is_finite());
        let mut all = [[0.0; 2]; MOST_POINTS];
        if points.is_empty() || !rising || !valid {
            return None;
        }
        all.get_mut(..points.len())?.copy_from_slice(points);
        Some(Self { points: all, count: points.len() })
    }

    /// Returns its points.
    pub fn points(&self) -> &[[f64; 2]] {
        self.points.get(..self.count).unwrap_or_default()
    }

    /// Returns the speed in mm/s at a place in mm.
    pub fn speed_at(&self, place: f64) -> f64 {
        let [mut before, mut speed] = self.points[0];
        for &[at, then] in self.points() {
            if place <= at {
                let share = if at > before { (place - before) / (at - before) } else { 1.0 };
                return speed + (then - speed) * share;
            }
            (before, speed) = (at, then);
        }
        speed
    }

    /// Returns the time in s until a place in mm.
    fn time_s(&self, place: f64) -> f64 {
        let mut time = 0.0;
        for [from, to, speed, rate] in self.stretches() {
            let length = place.min(to) - from;
            time += time_of(speed, rate, length);
            if place <= to {
                break;
            }
        }
        time
    }

    /// Returns the place in mm after a time in s.
    fn moved_mm(&self, time: f64) -> f64 {
        let mut left = time;
        let mut place = 0.0;
        for [from, to, speed, rate] in self.stretches() {
            let needed = time_of(speed, rate, to - from);
            if left <= needed {
                return from + if rate == 0.0 { speed * left } else { speed * expm1(rate * left) / rate };
            }
            left -= needed;
            place = to;
        }
        place
    }

    /// Returns the stretches from place 0 to infinity: their start and end in mm, the speed at the start in mm/s, and
    /// its change in mm/s per mm.
    fn stretches(&self) -> impl Iterator<Item = [f64; 4]> {
        let points = self.points();
        let [mut before, mut speed] = [0.0, self.points[0][1]];
        let between = points.iter().filter_map(move |&[at, then]| {
            let (from, start) = (before, speed);
            (before, speed) = (at, then);
            (at > from).then(|| [from, at, start, (then - start) / (at - from)])
        });
        let [last, even] = points.last().copied().unwrap_or_default();
        between.chain(core::iter::once([last, f64::INFINITY, even, 0.0]))
    }
}

/// Returns the time in s of a stretch of `length` mm that starts at `speed` mm/s and changes by `rate` mm/s per mm.
fn time_of(speed: f64, rate: f64, length: f64) -> f64 {
    if rate == 0.0 { length / speed } else { log1p(rate * length / speed) / rate }
}

/// A plate or a tip that comes down on whiskers, stays for a while, and leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Its kind.
    pub kind: PressKind,
    /// Overlap of the plate with the middle whisker at its lowest, in mm.
    pub overlap_mm: f64,
    /// Vertical speed in mm/s, down.
    pub approach_mm_s: f64,
    /// Vertical speed in mm/s, up.
    pub lift_mm_s: f64,
    /// Time at its lowest, in s.
    pub hold_s: f64,
    /// Angle between the plate and the sensor in degrees. The side in `direction_deg` is the higher one; the other side
    /// comes down by `overlap_mm`.
    pub tilt_deg: f64,
    /// The direction in which a tilted plate rises, in degrees.
    pub direction_deg: f64,
    /// Row and column, 1 to 5, of the only whisker that is touched; `None` for all.
    pub whisker: Option<[u8; 2]>,
}

/// The kinds of touches that do not slide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressKind {
    /// A short press of a plate on all whiskers.
    Press,
    /// A tip on one whisker.
    Poke,
    /// A long press.
    Hold,
}

impl PressKind {
    /// Returns its name, as a scene's file has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Poke => "poke",
            Self::Hold => "hold",
        }
    }
}

impl Press {
    /// Returns how much higher than its lowest side the plate is above a whisker, in mm, because of the tilt.
    pub(crate) fn higher_mm(&self, whisker: &Whisker, config: &WhiskerConfig) -> f64 {
        let (c, s) = unit(self.direction_deg);
        tan(self.tilt_deg.to_radians()) * (config.span_mm() / 2.0 * (fabs(c) + fabs(s)) + whisker.along(c, s))
    }

    /// Returns whether a whisker, given by its taxel, is below the plate or tip.
    pub(crate) fn meets(&self, taxel: usize) -> bool {
        self.whisker.is_none_or(|[row, column]| (usize::from(row) - 1) * 5 + usize::from(column) - 1 == taxel)
    }

    /// Returns the times of the way down, of the way up, and at its lowest, in s.
    pub(crate) fn times_s(&self) -> [f64; 3] {
        [self.overlap_mm / self.approach_mm_s, self.overlap_mm / self.lift_mm_s, self.hold_s]
    }
}

/// Returns the unit vector of an angle in degrees. Multiples of 90 are exact.
pub(crate) fn unit(degrees: f64) -> (f64, f64) {
    let turn = libm::fmod(degrees, 360.0);
    let turn = if turn < 0.0 { turn + 360.0 } else { turn };
    let quarters = turn / 90.0;
    let near = libm::round(quarters);
    if fabs(quarters - near) < 1e-12 {
        return match near as u8 % 4 {
            0 => (1.0, 0.0),
            1 => (0.0, 1.0),
            2 => (-1.0, 0.0),
            _ => (0.0, -1.0),
        };
    }
    let angle = turn.to_radians();
    (cos(angle), sin(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_goes_there_and_back() {
        let profile = SpeedProfile::new(&[[0.0, 80.0], [40.0, 200.0], [60.0, 200.0], [90.0, 20.0]]).unwrap();
        for place in [0.0, 0.5, 39.9, 40.0, 55.0, 75.0, 90.0, 140.0] {
            assert!((profile.moved_mm(profile.time_s(place)) - place).abs() < 1e-9, "{place}");
        }
        assert!((profile.speed_at(20.0) - 140.0).abs() < 1e-12 && (profile.speed_at(75.0) - 110.0).abs() < 1e-12);
        assert!((profile.speed_at(1e3) - 20.0).abs() < 1e-12);
        // ∫ ds / (80 + 3 s) from 0 to 40.
        assert!((profile.time_s(40.0) - libm::log(200.0 / 80.0) / 3.0).abs() < 1e-12);
        let even = SpeedProfile::new(&[[30.0, 50.0]]).unwrap();
        assert!((even.moved_mm(1.5) - 75.0).abs() < 1e-12 && (even.time_s(10.0) - 0.2).abs() < 1e-12);
        for wrong in [&[][..], &[[0.0, 0.0]], &[[-1.0, 5.0]], &[[1.0, 5.0], [1.0, 6.0]], &[[0.0, 1.0]; 9]] {
            assert_eq!(SpeedProfile::new(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn a_turned_edge_reaches_whiskers_in_the_order_of_its_normal() {
        let config = WhiskerConfig::default();
        let at = |x: f64, y: f64| Whisker { x, y, lowered: 0.0 };
        let straight = Slide::new("Fla0".parse().unwrap(), 100.0, 90.0);
        assert!(straight.behind(&at(3.0, -8.0), &config).abs() < 1e-12);
        assert!((straight.behind(&at(3.0, 8.0), &config) - 16.0).abs() < 1e-12);
        let oblique = Slide { direction_deg: 45.0, ..straight };
        assert!(oblique.behind(&at(-8.0, -8.0), &config).abs() < 1e-12);
        let turned = Slide { skew_deg: 30.0, direction_deg: 0.0, ..straight };
        let first = turned.behind(&at(-8.0, -8.0), &config);
        assert!(first.abs() < 1e-12 && (turned.behind(&at(-8.0, 8.0), &config) - 8.0).abs() < 1e-9, "{first}");
        let narrow = Slide { specimen: Specimen { width_mm: 10.0, ..straight.specimen }, offset_mm: 4.0, ..straight };
        // Left of a motion upwards is the left of the picture.
        let met = [-8.0, -4.0, 0.0, 4.0, 8.0].map(|x| narrow.meets(&at(x, 0.0)));
        assert_eq!(met, [true, true, true, false, false]);
    }
}
