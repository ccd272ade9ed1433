//! Streams of 25 taxels of grasps and other touches, with what disturbs them.

use core::f64::consts::TAU;

use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_scene::rng::Rng;
use wstac_scene::sensor::Fidelity;
use wstac_scene::specimen::{Body, Specimen};
use wstac_scene::{Dead, Held, Press, PressKind, Rest, Scene, SceneConfig, Slide, Touch, Twist};

/// Seed of the streams that judge, and the numbers of their sensors. Whoever sets limits must not look at them.
pub(crate) const JUDGE: u64 = 0x0051_1B51;
const JUDGE_UNITS: [f64; 2] = [90_000.0, 91_000.0];
/// Sensors of streams with any other seed.
const OTHER_UNITS: [f64; 2] = [91_000.0, 99_000.0];
/// Fraction of frames that are lost.
const LOST: f64 = 0.05;
/// Time of a rest between two slips, and in which the light of a press has faded, in s.
const REST_S: f64 = 1.5;
const FADED_S: f64 = 1.0;
/// Time in which ambient light grows, before it falls again, in s.
const DRIFT_S: f64 = 20.0;

/// A kind of touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A part with a texture, or a flat one, is pressed on, held, and slips.
    Textured,
    Flat,
    /// It slips, rests, and slips again.
    Again,
    /// It is pressed on, held, and lifted off; so is a flat plate.
    Release,
    Plate,
    /// Touches that nothing holds: a slide that comes from the side, a short press, a poke, a twist.
    Slide,
    Press,
    Poke,
    Twist,
    /// Some of these four, one after the other.
    Row,
    /// A held part slips off the sensor; then another is held and slips, or a body slides or is pressed on.
    Two,
    Off,
    /// A part that comes along rows or columns, give or take 3°.
    Along,
}

/// A disturbance of a hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    None,
    /// Three times the noise.
    Noise,
    /// Ambient light that changes by 0.05 to 0.2 % of full scale per second.
    Drift,
    /// Light with the press's pattern from a tremor of 6 to 12 Hz: 0.1 to 0.5 % of that of the press's brightest frame.
    Tremor,
    /// Light that fades within 1 to 20 s, from 0.5 to 2 % of that of the press's brightest frame.
    Creep,
    /// The four above.
    All,
    Lost,
    Rate(u32),
    Dead,
    Gains,
    Crosstalk,
    /// A readout of 33 ms.
    Rolling,
    /// 45 frames per second with a readout of 18 ms, from above or from below, and a press at 20 to 40 mm/s.
    RollingSlow,
    /// The press comes at 8 to 30 mm/s, and not at 30 to 400.
    Slow,
    /// Parts are lifted 2 to 8 times slower than pressed on, with this readout in ms.
    Lifted(u8),
}

impl Fault {
    fn has(self, part: Self) -> bool {
        let is_part = [Self::Noise, Self::Drift, Self::Tremor, Self::Creep].contains(&part);
        self == part || self == Self::All && is_part
    }
}

/// The frames of a stream that have arrived, in the unit of a ring, and the frames in which a held part begins to move.
pub(crate) struct Stream {
    pub(crate) rate: FrameRate,
    pub(crate) frames: Vec<(u64, [u16; TAXELS])>,
    pub(crate) slips: Vec<u64>,
}

struct Draw(Rng);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.uniform()
    }

    fn log_between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.0.uniform())
    }

    fn one_in(&mut self, parts: f64) -> bool {
        self.0.uniform() * parts < 1.0
    }

    /// Returns a part that covers the middle of the sensor.
    fn part(&mut self, is_flat: bool) -> Specimen {
        let of = if is_flat { 0 } else { self.between(1.0, 10.0) as usize };
        let specimen = Specimen { length_mm: self.between(30.0, 160.0), ..Specimen::ALL[of] };
        if self.one_in(2.0) {
            return specimen;
        }
        Specimen { body: Body::Block, width_mm: self.between(10.0, 60.0), ..specimen }
    }

    /// Returns what slides over the sensor from the side.
    fn body(&mut self) -> Specimen {
        let round = Specimen::ball(self.between(5.0, 20.0));
        match self.between(0.0, 4.0) as u32 {
            0 => round,
            1 => Specimen { body: Body::Coin, ..round },
            2 => Specimen { body: Body::Rod, width_mm: f64::INFINITY, ..round },
            _ => {
                let is_flat = self.one_in(3.0);
                self.part(is_flat)
            }
        }
    }

    fn touch(&mut self, kind: Kind, fault: Fault, speed: f64) -> Touch {
        let is_held = !matches!(kind, Kind::Slide | Kind::Along | Kind::Press | Kind::Poke | Kind::Twist | Kind::Row);
        let hold_s = if is_held { self.log_between(0.3, 60.0) } else { self.between(0.02, 0.3) };
        let [slowest, fastest] = match fault {
            Fault::Slow => [8.0, 30.0],
            Fault::RollingSlow => [20.0, 40.0],
            _ => [30.0, 400.0],
        };
        let (approach_mm_s, direction_deg) = (self.log_between(slowest, fastest), self.between(0.0, 360.0));
        let held = Held { approach_mm_s, lift_mm_s: approach_mm_s, hold_s, travel_mm: None };
        match kind {
            Kind::Textured | Kind::Flat | Kind::Again | Kind::Two | Kind::Off | Kind::Release => {
                let is_flat = kind == Kind::Flat || kind != Kind::Textured && self.one_in(4.0);
                let mut specimen = self.part(is_flat);
                if kind == Kind::Again {
                    // It stays on the sensor.
                    (specimen.length_mm, specimen.body) = (self.between(120.0, 160.0), Body::Prism);
                }
                let first_mm = 0.1 * speed + self.between(2.0, 6.0);
                let way_mm = first_mm + 0.2 * speed + self.between(3.0, 30.0);
                let rest = Rest { first_mm, every_mm: f64::INFINITY, rest_s: REST_S };
                let travel_mm = match kind {
                    Kind::Release => Some(0.0),
                    Kind::Two | Kind::Off => None,
                    _ => Some(way_mm),
                };
                Touch::Slide(Slide {
                    rest: (kind == Kind::Again).then_some(rest),
                    held: Some(Held { travel_mm, ..held }),
                    ..Slide::new(specimen, speed, direction_deg)
                })
            }
            Kind::Slide => {
                let offset_mm = self.between(-6.0, 6.0);
                Touch::Slide(Slide { offset_mm, ..Slide::new(self.body(), speed, direction_deg) })
            }
            Kind::Along => {
                let along_deg = 90.0 * (direction_deg / 90.0).floor() + self.between(-3.0, 3.0);
                let is_flat = self.one_in(3.0);
                Touch::Slide(Slide::new(self.part(is_flat), speed, along_deg.rem_euclid(360.0)))
            }
            Kind::Twist => Touch::Twist(Twist {
                specimen: Specimen { body: Body::Block, width_mm: self.between(10.0, 60.0), ..self.part(false) },
                direction_deg,
                pivot_mm: [0; 2].map(|_| self.between(-8.0, 8.0)),
                by_deg: self.between(15.0, 90.0),
                speed_deg_s: self.between(30.0, 300.0),
                held: Held { hold_s: 0.0, travel_mm: Some(0.0), ..held },
            }),
            Kind::Plate | Kind::Press | Kind::Poke => Touch::Press(Press {
                kind: if kind == Kind::Poke { PressKind::Poke } else { PressKind::Hold },
                overlap_mm: self.between(1.0, 4.0),
                approach_mm_s,
                lift_mm_s: approach_mm_s,
                hold_s,
                tilt_deg: if kind == Kind::Poke { 0.0 } else { self.between(0.0, 3.0) },
                direction_deg,
                whisker: (kind == Kind::Poke).then(|| [0; 2].map(|_| self.between(1.0, 6.0) as u8)),
            }),
            Kind::Row => {
                let kind = self.other();
                self.touch(kind, fault, speed)
            }
        }
    }

    fn other(&mut self) -> Kind {
        [Kind::Slide, Kind::Press, Kind::Poke, Kind::Twist][self.between(0.0, 4.0) as usize]
    }

    fn script(&mut self, touches: Vec<Touch>, fault: Fault, seed: u64) -> SceneConfig {
        let [first, last] = if seed == JUDGE { JUDGE_UNITS } else { OTHER_UNITS };
        let gain = self.between(0.6, 1.4);
        let mut script = SceneConfig::new(touches);
        script.seed = self.0.bits();
        script.fidelity = Fidelity::Taxel;
        script.light.unit = self.between(first, last) as u32;
        script.light.flash_ms *= gain;
        script.light.rubbing_ms *= gain;
        script.sensor.size = FrameSize::new(400, 400).expect("the size is in range");
        match fault {
            Fault::Rate(fps) => script.sensor.rate = FrameRate::new(fps, 1).expect("the rate is above 0"),
            Fault::Dead => {
                let place = [0; 2].map(|_| self.between(1.0, 6.0) as i64);
                script.light.dead = Dead::try_from(vec![place]).expect("rows and columns are 1 to 5");
            }
            Fault::Gains => script.light.gain_deviation *= 3.0,
            Fault::Crosstalk => script.light.crosstalk = 0.05,
            Fault::Rolling => script.sensor.readout_ms = 33.0,
            Fault::Lifted(readout_ms) => {
                script.sensor.readout_ms = readout_ms.into();
                let slower = self.log_between(2.0, 8.0);
                for touch in &mut script.touches {
                    if let Touch::Slide(Slide { held: Some(held), .. }) = touch {
                        held.lift_mm_s /= slower;
                    }
                }
            }
            Fault::RollingSlow => {
                script.sensor.rate = FrameRate::new(45, 1).expect("the rate is above 0");
                script.sensor.readout_ms = if self.one_in(2.0) { 18.0 } else { -18.0 };
            }
            _ => {}
        }
        if fault.has(Fault::Noise) {
            script.sensor.noise *= 3.0;
        }
        script
    }
}

/// Light that is not of the touch.
struct Disturbance {
    per_s: f64,
    tremor: f64,
    hz: f64,
    slow_hz: f64,
    creep: f64,
    fades_s: f64,
    /// Each whisker's brightest light within a second of the press.
    peaks: [f64; TAXELS],
}

impl Disturbance {
    fn new(draw: &mut Draw, fault: Fault) -> Self {
        let mut of = |part, low, high| if fault.has(part) { draw.log_between(low, high) } else { 0.0 };
        let [per_s, tremor, creep] =
            [of(Fault::Drift, 5e-4, 2e-3), of(Fault::Tremor, 1e-3, 5e-3), of(Fault::Creep, 5e-3, 2e-2)];
        let [hz, slow_hz, fades_s] = [draw.between(6.0, 12.0), draw.between(0.2, 1.0), draw.log_between(1.0, 20.0)];
        Self { per_s, tremor, hz, slow_hz, creep, fades_s, peaks: [0.0; TAXELS] }
    }

    /// Adds its light to a frame at a time in s that lasts `frame_s`, `since` s after the press.
    fn add(&mut self, light: &mut [f64; TAXELS], time: f64, since: f64, frame_s: f64) {
        if (0.0..FADED_S).contains(&since) {
            self.peaks.iter_mut().zip(light.iter()).for_each(|(peak, light)| *peak = peak.max(*light));
        }
        let leg = (time / DRIFT_S).rem_euclid(2.0);
        let even = self.per_s * DRIFT_S * leg.min(2.0 - leg);
        let of_press = if since > 0.0 {
            // Light is the rate of bending, whatever its sign.
            let moment = |part: u32| (TAU * self.hz * (since + frame_s * f64::from(part) / 8.0)).cos().abs();
            let tremor = self.tremor * (0..8).map(moment).sum::<f64>() / 8.0;
            tremor * (1.0 + 0.5 * (TAU * self.slow_hz * since).sin()) + self.creep * (-since / self.fades_s).exp()
        } else {
            0.0
        };
        light.iter_mut().zip(self.peaks).for_each(|(light, peak)| *light += even + of_press * peak);
    }
}

/// Returns the frames of a script; if `hold_s` is there, of the press's light only, and of a hold of this time.
fn frames(
    draw: &mut Draw,
    script: &SceneConfig,
    fault: Fault,
    hold_s: Option<f64>,
) -> (Vec<(u64, [u16; TAXELS])>, Vec<f64>) {
    let rate = script.sensor.rate;
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let geometry = FrameGeometry::new(Gray, layout, rate).expect("sums fit 32 bits");
    let mut pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build().expect("all parameters are defaults");
    let mut scene = Scene::new(script).expect("the scene was drawn within its limits");
    let mut camera = Scene::camera(script).expect("the scene was drawn within its limits");
    let mut disturbance = Disturbance::new(draw, fault);
    let (starts, frame_s) =
        (scene.truth().iter().map(|truth| truth.start_s).collect::<Vec<_>>(), 1.0 / rate.per_second());
    let (start, end) = (starts[0], scene.truth()[0].end_s);
    let mut frames = vec![];
    for number in 0.. {
        let time = number as f64 * frame_s;
        let light = match hold_s {
            Some(hold_s) if time > start + hold_s => None,
            Some(_) if time > start + FADED_S => Some([0.0; TAXELS]),
            _ => scene.next_light().map(|(light, _)| light),
        };
        let Some(mut light) = light else { break };
        let since = if time > end && hold_s.is_none() { -1.0 } else { time - start };
        disturbance.add(&mut light, time, since, frame_s);
        let is_lost = fault == Fault::Lost && draw.0.uniform() < LOST;
        let update = if is_lost { pipeline.push_lost(1) } else { pipeline.push_taxels(&camera.sums(&light)) };
        let Some(frame) = update.frame() else { continue };
        if let Some(taxels) = pipeline.taxel_ring().and_then(|ring| ring.frames().last().flatten()) {
            frames.push((frame.number, *taxels));
        }
    }
    (frames, starts)
}

/// Draws the stream of a number. Holds last 0.3 to 60 s.
pub(crate) fn draw(kind: Kind, fault: Fault, [low, high]: [f64; 2], seed: u64, number: u64) -> Stream {
    // The touches are the same with every fault.
    let mut draw = Draw(Rng::new(seed, (kind as u64) << 32 | number));
    let kinds = match kind {
        Kind::Row => vec![kind; 4],
        Kind::Two => vec![kind, if draw.one_in(4.0) { Kind::Flat } else { Kind::Textured }],
        Kind::Off => vec![kind, if draw.one_in(2.0) { Kind::Press } else { Kind::Slide }],
        _ => vec![kind],
    };
    let touches: Vec<_> = kinds
        .into_iter()
        .map(|kind| {
            let speed = draw.log_between(low, high);
            draw.touch(kind, fault, speed)
        })
        .collect();
    let script = draw.script(touches.clone(), fault, seed);
    let (frames, starts) = frames(&mut draw, &script, fault, None);
    let rate = script.sensor.rate;
    let per_s = rate.per_second() / f64::from(rate.frames_added());
    let mut slips = vec![];
    if matches!(kind, Kind::Textured | Kind::Flat | Kind::Again | Kind::Two | Kind::Off) {
        for (touch, start) in touches.iter().zip(starts) {
            let slide = touch.slide();
            let held = slide.and_then(|slide| slide.held);
            let first = start + held.map_or(0.0, |held| script.whisker.overlap_mm / held.approach_mm_s + held.hold_s);
            let rest = slide.and_then(|slide| Some(first + slide.rest?.first_mm / slide.speed_mm_s + REST_S));
            slips.extend([first].into_iter().chain(rest).map(|time| (time * per_s) as u64));
        }
    }
    Stream { rate, frames, slips }
}

/// Draws the stream of a hold of this time in s that has no slip.
pub(crate) fn hold(fault: Fault, hold_s: f64, seed: u64, number: u64) -> Stream {
    let mut draw = Draw(Rng::new(seed, 1 << 48 | number));
    let mut touch = draw.touch(Kind::Release, fault, 1.0);
    if let Touch::Slide(slide) = &mut touch {
        slide.held = slide.held.map(|held| Held { hold_s: 2.0 * FADED_S, ..held });
    }
    let script = draw.script(vec![touch], fault, seed);
    let (frames, _) = frames(&mut draw, &script, fault, Some(hold_s));
    Stream { rate: script.sensor.rate, frames, slips: vec![] }
}
