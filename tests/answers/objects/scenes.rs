//! Touches of objects of any shape, drawn by chance, each with what is true about it.

use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_scene::rng::Rng;
use wstac_scene::sensor::Fidelity;
use wstac_scene::specimen::{Body, Pattern, Specimen};
use wstac_scene::{Dead, Held, Rest, SceneConfig, Slide, SpeedProfile, Touch, Twist, WhiskerConfig};

/// Seed of the slides that judge, and the first number of their sensors. Whoever sets limits must not look at them.
pub(crate) const JUDGE: u64 = 0x00B1_EC75;
const JUDGE_UNITS: [f64; 2] = [90_000.0, 91_000.0];
/// Cross-talk, as a fraction of a whisker's light.
pub(crate) const CROSSTALK: f64 = 0.05;
/// Half of the distance between outer whiskers, in mm.
pub(crate) const HALF_MM: f64 = 8.0;

/// A kind of touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Wide,
    Rod,
    Ball,
    Coin,
    Block,
    Corner,
    Fingers,
    Skewed,
    Oblique,
    Textured,
    Twist,
    Stop,
    Two,
    Changing,
    Even,
    Stick,
    Turn,
    Pressed,
    /// Rods of 8 to 24 mm that move at an angle to their axis. Its number is part of the seed of its scenes.
    SkewedRod = 23,
    /// The kinds of [`MIX`], one after the other.
    Mix,
}

/// Kinds whose velocity should be known, in equal parts.
const MIX: [Kind; 8] =
    [Kind::Wide, Kind::Rod, Kind::Ball, Kind::Coin, Kind::Block, Kind::Corner, Kind::Fingers, Kind::Oblique];

/// What is wrong with the sensor or its camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    None,
    Dead,
    Gains,
    Noise,
    Lost,
    Rate(u32),
    /// Rows are read within 10 to 33 ms, and the estimator is told within which.
    KnownReadout,
    UnknownReadout,
    Decay,
    Drift,
    Crosstalk,
    /// The estimator has its matrix.
    KnownCrosstalk,
}

/// What is true about a touch.
#[derive(Clone, Debug)]
pub(crate) struct Truth {
    pub mm_s: f64,
    pub degrees: f64,
    /// Motions across its straight edges: speed in mm/s and direction in degrees.
    pub edges: Vec<[f64; 2]>,
    /// Whether it has no velocity that could be right.
    pub has_none: bool,
}

/// A scene, and what is true about its last touch.
#[derive(Clone, Debug)]
pub(crate) struct Drawn {
    pub script: SceneConfig,
    pub truth: Truth,
}

/// Draws numbers for one touch.
struct Draw {
    rng: Rng,
    speeds: [f64; 2],
}

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.rng.uniform()
    }

    fn one_in(&mut self, parts: f64) -> bool {
        self.rng.uniform() * parts < 1.0
    }

    fn either_sign(&mut self, low: f64, high: f64) -> f64 {
        let size = self.between(low, high);
        if self.one_in(2.0) { -size } else { size }
    }

    /// Returns one of the ten specimens of the paper, of a length between bounds in mm.
    fn specimen(&mut self, low: f64, high: f64) -> Specimen {
        let length_mm = self.between(low, high);
        Specimen { length_mm, ..Specimen::ALL[self.between(0.0, 10.0) as usize] }
    }

    fn slide(&mut self, specimen: Specimen, offset_mm: f64) -> Slide {
        let [low, high] = self.speeds;
        let speed = low * (high / low).powf(self.between(0.0, 1.0));
        let offset_mm = if offset_mm > 0.0 { self.between(-offset_mm, offset_mm) } else { 0.0 };
        Slide { offset_mm, ..Slide::new(specimen, speed, self.between(0.0, 360.0)) }
    }

    fn round(&mut self, body: Body, low: f64, high: f64) -> Specimen {
        Specimen { body, ..Specimen::ball(self.between(low, high)) }
    }

    fn rod(&mut self, is_long: bool) -> Specimen {
        let width_mm = if is_long { f64::INFINITY } else { self.between(8.0, 24.0) };
        Specimen { width_mm, ..self.round(Body::Rod, 3.0, 15.0) }
    }

    fn block(&mut self, low: f64, high: f64) -> Specimen {
        Specimen { body: Body::Block, width_mm: self.between(6.0, 20.0), ..self.specimen(low, high) }
    }

    /// Returns any object that slides at right angles to its edges.
    fn any(&mut self) -> Slide {
        match self.between(0.0, 5.0) as u32 {
            0 => {
                let specimen = self.specimen(20.0, 160.0);
                self.slide(specimen, 0.0)
            }
            1 => {
                let specimen = self.rod(true);
                self.slide(specimen, 0.0)
            }
            2 => {
                let specimen = self.round(Body::Ball, 5.0, 20.0);
                self.slide(specimen, 4.0)
            }
            3 => {
                let specimen = self.round(Body::Coin, 5.0, 20.0);
                self.slide(specimen, 4.0)
            }
            _ => {
                let specimen = self.block(10.0, 80.0);
                self.slide(specimen, 6.0)
            }
        }
    }

    /// Returns the touches of a kind.
    fn touches(&mut self, kind: Kind) -> (Vec<Touch>, Truth) {
        let slide = match kind {
            Kind::Wide => {
                let specimen = self.specimen(20.0, 160.0);
                self.slide(specimen, 0.0)
            }
            Kind::Rod => {
                let is_long = self.one_in(2.0);
                let specimen = self.rod(is_long);
                self.slide(specimen, if is_long { 0.0 } else { 4.0 })
            }
            Kind::Ball | Kind::Coin => {
                let body = if kind == Kind::Ball { Body::Ball } else { Body::Coin };
                let specimen = self.round(body, 5.0, 20.0);
                self.slide(specimen, 4.0)
            }
            Kind::Block => {
                let specimen = self.block(10.0, 80.0);
                self.slide(specimen, 6.0)
            }
            Kind::Skewed => {
                let specimen = self.block(15.0, 60.0);
                Slide { skew_deg: self.either_sign(3.0, 30.0), ..self.slide(specimen, 4.0) }
            }
            Kind::SkewedRod => {
                let specimen = self.rod(false);
                Slide { skew_deg: self.either_sign(3.0, 35.0), ..self.slide(specimen, 4.0) }
            }
            Kind::Corner => {
                let flat = Specimen { length_mm: self.between(30.0, 100.0), ..Specimen::ALL[0] };
                let specimen = Specimen { body: Body::Corner { degrees: 90.0 }, ..flat };
                Slide { skew_deg: self.between(-20.0, 20.0), ..self.slide(specimen, 4.0) }
            }
            Kind::Oblique => {
                let is_rod = self.one_in(2.0);
                let flat = Specimen { length_mm: self.between(20.0, 160.0), ..Specimen::ALL[0] };
                let specimen = if is_rod { self.rod(true) } else { flat };
                Slide { skew_deg: self.either_sign(5.0, 45.0), ..self.slide(specimen, 0.0) }
            }
            Kind::Textured => return self.textured(),
            Kind::Fingers => return self.fingers(),
            Kind::Two => return self.two(),
            Kind::Twist => return self.twist(),
            Kind::Stop => {
                let slide = self.any();
                let [first, last] = meets_mm(&slide);
                let first_mm = first + (last - first) * self.between(0.15, 0.85);
                Slide {
                    rest: Some(Rest { first_mm, every_mm: f64::INFINITY, rest_s: self.between(0.3, 4.0) }),
                    ..slide
                }
            }
            Kind::Stick => {
                let slide = self.any();
                let every_mm = self.between(2.0, 6.0);
                let rest_s = self.between(0.03, 0.3);
                Slide { rest: Some(Rest { first_mm: every_mm, every_mm, rest_s }), ..slide }
            }
            Kind::Changing => {
                let slide = self.any();
                let factor = if self.one_in(2.0) { self.between(1.15, 2.5) } else { self.between(0.4, 0.85) };
                Slide { profile: accelerated(&slide, factor), ..slide }
            }
            Kind::Even => {
                let slide = self.any();
                let factor = self.between(0.85, 1.15);
                Slide { profile: accelerated(&slide, factor), ..slide }
            }
            Kind::Turn => {
                let slide = self.any();
                Slide { turn_deg_mm: self.either_sign(0.2, 1.0), ..slide }
            }
            Kind::Pressed => {
                let slide = self.any();
                let held =
                    Held { approach_mm_s: 400.0, lift_mm_s: 400.0, hold_s: self.between(0.05, 1.0), travel_mm: None };
                Slide { offset_mm: 0.0, held: Some(held), ..slide }
            }
            Kind::Mix => unreachable!("a mix is of other kinds"),
        };
        let truth = truth(kind, &slide);
        (vec![Touch::Slide(slide)], truth)
    }

    /// An edge at an angle, before a texture at right angles to the motion: one side of a corner that is far away. The
    /// ridges of the texture are edges, too.
    fn textured(&mut self) -> (Vec<Touch>, Truth) {
        let degrees = self.between(100.0, 165.0);
        let textured =
            Specimen { length_mm: self.between(60.0, 160.0), ..Specimen::ALL[1 + self.between(0.0, 9.0) as usize] };
        let slide = self.slide(Specimen { body: Body::Corner { degrees }, ..textured }, 0.0);
        let slide = Slide { offset_mm: self.either_sign(13.0, 20.0), ..slide };
        let angle = (90.0 - degrees / 2.0) * -slide.offset_mm.signum();
        let truth = Truth { edges: vec![across(&slide, angle), across(&slide, 0.0)], ..Truth::of(&slide) };
        (vec![Touch::Slide(slide)], truth)
    }

    /// Two objects side by side.
    fn pair(&mut self) -> [Slide; 2] {
        let [half, middle] = [self.between(6.5, 8.0), self.between(-1.0, 1.0)];
        let specimens = [0; 2].map(|_| self.round(Body::Ball, 8.0, 12.0));
        let slide = self.slide(specimens[0], 0.0);
        let second = Slide { specimen: specimens[1], offset_mm: middle - half, ..slide };
        let behind = self.between(0.0, 8.0);
        [Slide { offset_mm: middle + half, ..slide }, Slide { after_s: Some(behind / slide.speed_mm_s), ..second }]
    }

    fn fingers(&mut self) -> (Vec<Touch>, Truth) {
        let pair = self.pair();
        (pair.map(Touch::Slide).to_vec(), Truth::of(&pair[0]))
    }

    fn two(&mut self) -> (Vec<Touch>, Truth) {
        let [first, second] = self.pair();
        let second = if self.one_in(3.0) {
            Slide { direction_deg: (first.direction_deg + self.either_sign(20.0, 90.0)).rem_euclid(360.0), ..second }
        } else {
            let factor = self.between(1.2, 2.5);
            Slide { speed_mm_s: if self.one_in(2.0) { factor } else { 1.0 / factor } * first.speed_mm_s, ..second }
        };
        ([first, second].map(Touch::Slide).to_vec(), Truth { has_none: true, ..Truth::of(&first) })
    }

    fn twist(&mut self) -> (Vec<Touch>, Truth) {
        let specimen = Specimen { body: Body::Block, width_mm: self.between(10.0, 60.0), ..self.specimen(10.0, 60.0) };
        let twist = Twist {
            specimen,
            direction_deg: self.between(0.0, 360.0),
            pivot_mm: [0; 2].map(|_| self.between(-HALF_MM, HALF_MM)),
            by_deg: self.either_sign(15.0, 90.0),
            speed_deg_s: self.between(30.0, 300.0),
            held: Held { approach_mm_s: 400.0, lift_mm_s: 400.0, hold_s: self.between(0.0, 0.3), travel_mm: Some(0.0) },
        };
        let truth = Truth { mm_s: 0.0, degrees: 0.0, edges: vec![], has_none: true };
        (vec![Touch::Twist(twist)], truth)
    }
}

impl Truth {
    fn of(slide: &Slide) -> Self {
        Self { mm_s: slide.speed_mm_s, degrees: slide.direction_deg, edges: vec![], has_none: false }
    }
}

/// Returns what is true about a slide of a kind.
fn truth(kind: Kind, slide: &Slide) -> Truth {
    let truth = Truth { has_none: kind == Kind::Stop, ..Truth::of(slide) };
    match slide.specimen.body {
        Body::Corner { degrees } => {
            // Its two edges, and its end.
            let angles = [90.0 - degrees / 2.0, degrees / 2.0 - 90.0, 0.0];
            Truth { edges: angles.map(|angle| across(slide, slide.skew_deg + angle)).to_vec(), ..truth }
        }
        _ if slide.skew_deg != 0.0 => Truth { edges: vec![across(slide, slide.skew_deg)], ..truth },
        _ => Truth { mm_s: mean_mm_s(slide), ..truth },
    }
}

/// Returns the motion across an edge that is at an angle in degrees to the right angle to a slide's motion.
fn across(slide: &Slide, angle: f64) -> [f64; 2] {
    [slide.speed_mm_s * angle.to_radians().cos(), slide.direction_deg + angle]
}

/// Returns half of the width of what a whisker reaches of a round thing that it overlaps by so much.
fn patch_mm(radius: f64, overlap: f64) -> f64 {
    (radius * radius - (radius - overlap).max(0.0).powi(2)).sqrt()
}

/// Returns the width of what the whiskers reach of a slide's object.
pub(crate) fn lit_width_mm(slide: &Slide) -> f64 {
    match slide.specimen.body {
        Body::Ball => 2.0 * patch_mm(slide.specimen.length_mm / 2.0, WhiskerConfig::default().overlap_mm),
        Body::Coin => slide.specimen.length_mm,
        _ => slide.specimen.width_mm,
    }
}

/// Returns the places on a slide's path, in mm, at which its object meets the first and the last whisker. A path begins
/// where its leading end is beside a whisker, but a round end, and the first crest of a texture, come later, and to the
/// outer whiskers, whose tips are lower, still later.
fn meets_mm(slide: &Slide) -> [f64; 2] {
    let (sine, cosine) = slide.direction_deg.to_radians().sin_cos();
    let (specimen, config) = (&slide.specimen, WhiskerConfig::default());
    let radius = specimen.length_mm / 2.0;
    let places = config.whiskers().into_iter().flatten().map(|whisker| {
        let left = whisker.y * cosine - whisker.x * sine - slide.offset_mm;
        [whisker.along(cosine, sine), left.abs(), config.overlap_mm - whisker.lowered]
    });
    // Half of the width beside a whisker, and of that which a tip reaches that overlaps by so much.
    let beside = if matches!(specimen.body, Body::Ball | Body::Coin) { radius } else { specimen.width_mm / 2.0 };
    let half = |overlap| if specimen.body == Body::Ball { patch_mm(radius, overlap) } else { beside };
    let rise = |overlap: f64| (1.0 - overlap / specimen.depth_mm).max(0.0) * specimen.period_mm;
    let behind = |left: f64, overlap: f64| match (specimen.body, specimen.pattern) {
        (Body::Ball | Body::Coin, _) => radius - (half(overlap).powi(2) - left * left).sqrt(),
        (Body::Rod, _) => radius - patch_mm(radius, overlap),
        (_, Pattern::Saw) => rise(overlap),
        (_, Pattern::Tri) => rise(overlap) / 2.0,
        // Between small lobes.
        (_, Pattern::Sinc) => 0.4 * specimen.period_mm,
        _ => 0.0,
    };
    let start =
        places.clone().filter(|[_, left, _]| *left <= beside).fold(f64::INFINITY, |first, [at, ..]| first.min(at));
    let met = places.filter(|&[_, left, overlap]| left <= half(overlap));
    let [first, last] = met.fold([f64::INFINITY, f64::NEG_INFINITY], |[first, last], [at, left, overlap]| {
        let at = at - start + behind(left, overlap);
        [first.min(at), last.max(at)]
    });
    if first < last { [first, last] } else { [0.0, 2.0 * HALF_MM] }
}

/// Returns the profile of an even acceleration by which the speed changes by a factor from the first to the last
/// whisker, and to at most three times and at least a third of what it was.
fn accelerated(slide: &Slide, factor: f64) -> Option<SpeedProfile> {
    let [first, last] = meets_mm(slide);
    let crossing = last - first;
    // Squares of speeds are straight lines over the path.
    let most = if factor > 1.0 { 9.0_f64 } else { 1.0 / 9.0 };
    let rate = (factor * factor - 1.0) / crossing;
    let end = ((most - 1.0) / rate).min(crossing + slide.specimen.length_mm);
    let points: [[f64; 2]; 8] = core::array::from_fn(|part| {
        let place = end * (part as f64 / 7.0);
        [place, slide.speed_mm_s * (1.0 + rate * place).sqrt()]
    });
    SpeedProfile::new(&points)
}

/// Returns a slide's mean speed from the first to the last whisker, in mm/s.
fn mean_mm_s(slide: &Slide) -> f64 {
    const PARTS: u32 = 1000;
    let [first, last] = meets_mm(slide);
    let whole = last - first;
    let places = (0..PARTS).map(|part| first + whole * (f64::from(part) + 0.5) / f64::from(PARTS));
    let moves: f64 = places.map(|place| whole / f64::from(PARTS) / slide.speed_at(place)).sum();
    let rests = slide.rest.filter(|rest| rest.every_mm.is_finite()).map_or(0.0, |rest| {
        let before = |place: f64| (1.0 + ((place - rest.first_mm) / rest.every_mm).floor()).max(0.0);
        (before(last) - before(first)) * rest.rest_s
    });
    whole / (moves + rests)
}

/// Draws the touch of a number.
pub(crate) fn draw(kind: Kind, fault: Fault, speeds: [f64; 2], number: u64) -> Drawn {
    let kind = if kind == Kind::Mix { MIX[number as usize % MIX.len()] } else { kind };
    // A mix has the same touches before every fault.
    let mut draw = Draw { rng: Rng::new(JUDGE, 1 << 48 | (kind as u64) << 32 | number), speeds };
    let (mut touches, truth) = draw.touches(kind);
    let unit = draw.between(JUDGE_UNITS[0], JUDGE_UNITS[1]) as u32;
    let gain = draw.between(0.6, 1.4);
    if fault == Fault::Decay {
        touches.extend(touches.clone());
    }
    let mut script = SceneConfig::new(touches);
    script.seed = JUDGE.wrapping_mul(1_000_003) + (kind as u64) * 1_000_000 + number;
    script.fidelity = Fidelity::Taxel;
    script.light.unit = unit;
    script.light.flash_ms *= gain;
    script.light.rubbing_ms *= gain;
    script.sensor.size = FrameSize::new(400, 400).expect("the size is in range");
    match fault {
        Fault::None | Fault::Lost => {}
        Fault::Dead => {
            let place = [0; 2].map(|_| 1 + draw.between(0.0, 5.0) as i64);
            script.light.dead = Dead::try_from(vec![place]).expect("rows and columns are 1 to 5");
        }
        Fault::Gains => script.light.gain_deviation *= 3.0,
        Fault::Noise => script.noise *= 3.0,
        Fault::Rate(fps) => script.sensor.rate = FrameRate::new(fps, 1).expect("the rate is above 0"),
        Fault::KnownReadout | Fault::UnknownReadout => script.sensor.readout_ms = draw.between(10.0, 33.0),
        Fault::Decay => script.light.decay = 0.5,
        Fault::Drift => {
            script.light.leak = 0.05;
            script.light.leak_per_minute = draw.between(0.03, 0.12);
        }
        Fault::Crosstalk | Fault::KnownCrosstalk => script.light.crosstalk = CROSSTALK,
    }
    Drawn { script, truth }
}
