//! Touches drawn by chance, and what the core answers to them.

use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::Event;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{Motion, MotionConfig, Readout};
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_core::touch::wave::by_wave;
use wstac_scene::rng::Rng;
use wstac_scene::sensor::Fidelity;
use wstac_scene::specimen::Specimen;
use wstac_scene::{Dead, Press, PressKind, Scene, SceneConfig, SimulatedFrame, Slide, Touch, Weak};

/// Speeds of slides, in mm/s: log-uniform between these.
const SPEEDS: (f64, f64) = (10.0, 600.0);
/// Lengths of specimens, in mm.
const LENGTHS: (f64, f64) = (20.0, 160.0);
/// First number of the sensor units. No other part of the project uses them.
const FIRST_UNIT: u32 = 80_000;
const SENSORS: f64 = 1000.0;
/// Seed of all touches: none was used while the estimators were built.
const SEED: u64 = 0x0DDB_A115;

/// A kind of touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Ten specimens at any angle, of any length, at any speed.
    Slide,
    /// Slides along rows and columns only.
    Straight,
    /// A plate on all whiskers within 5 ms, then away.
    Press,
    /// A tip on one whisker.
    Poke,
    /// A plate that stays for seconds.
    Hold,
    /// Slides with a fifth of the light.
    Dim,
    /// Slides with four times the light.
    Bright,
    /// Slides with two and a half times the noise, and three times the spread of whiskers' gains.
    Noisy,
    /// One whisker is dead and up to three are weak.
    Dead,
    /// Textures whose period is the distance between whiskers. Its number, as those of others, draws its touches.
    Pitch = 11,
    /// Speeds below the range: 1 to 9 mm/s.
    Slow = 15,
    /// Two slides of 30 mm at 60 to 400 mm/s, at most 45 frames apart; compared with the first.
    Two,
    /// One whisker has 15 % of its light.
    OneWeak = 20,
    /// Slides before a camera that reads its rows one after the other.
    Readout,
}

/// A touch, and the answers to its first event.
#[derive(Clone, Debug)]
pub(crate) struct Answered {
    pub touch: Touch,
    /// Number of events.
    pub events: usize,
    /// Motion by the default estimator; `None` without an event.
    pub motion: Option<Motion>,
}

impl Answered {
    /// Returns the slide; `None` for other touches.
    pub(crate) fn slide(&self) -> Option<&Slide> {
        self.touch.slide()
    }
}

/// Draws the touch of a number, its sensor, and everything else about its scene.
pub(crate) fn script(kind: Kind, number: u64) -> SceneConfig {
    let mut rng = Rng::new(SEED, (kind as u64) << 32 | number);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.uniform();
    let speed = SPEEDS.0 * (SPEEDS.1 / SPEEDS.0).powf(between(0.0, 1.0));
    let degrees = between(0.0, 360.0);
    let length = between(LENGTHS.0, LENGTHS.1);
    let mut specimen = Specimen { length_mm: length, ..Specimen::ALL[between(0.0, 10.0) as usize] };
    let unit = FIRST_UNIT + between(0.0, SENSORS) as u32;
    let gain = between(0.6, 1.4);
    let press = |kind, overlap_mm, approach_mm_s, hold_s, whisker| {
        let (lift_mm_s, [tilt_deg, direction_deg]) = (approach_mm_s, [0.0; 2]);
        Touch::Press(Press { kind, overlap_mm, approach_mm_s, lift_mm_s, hold_s, tilt_deg, direction_deg, whisker })
    };
    if kind == Kind::Pitch {
        specimen = Specimen { period_mm: 4.0, length_mm: length, ..Specimen::ALL[1 + between(0.0, 9.0) as usize] };
    }
    let slide = Slide::new(specimen, speed, degrees);
    let touch = match kind {
        Kind::Press => press(PressKind::Press, between(1.0, 3.5), between(500.0, 2000.0), between(0.05, 0.5), None),
        Kind::Hold => press(PressKind::Hold, between(1.0, 3.5), between(500.0, 2000.0), between(1.0, 7.0), None),
        Kind::Poke => {
            let whisker = Some([1 + between(0.0, 5.0) as u8, 1 + between(0.0, 5.0) as u8]);
            // A whisker at a corner of the dome stands 1.5 mm lower.
            press(PressKind::Poke, between(2.5, 4.0), between(500.0, 2000.0), between(0.05, 0.5), whisker)
        }
        Kind::Straight => Touch::Slide(Slide { direction_deg: 90.0 * (degrees / 90.0).floor(), ..slide }),
        Kind::Slow => Touch::Slide(Slide { speed_mm_s: between(1.0, 9.0), ..slide }),
        Kind::Two => {
            let specimen = Specimen { length_mm: 30.0, ..specimen };
            Touch::Slide(Slide::new(specimen, 60.0 * (20.0_f64 / 3.0).powf(between(0.0, 1.0)), degrees))
        }
        _ => Touch::Slide(slide),
    };
    let mut script = SceneConfig::new(vec![touch]);
    script.seed = SEED + number;
    script.light.unit = unit;
    script.fidelity = Fidelity::Taxel;
    let light = match kind {
        Kind::Dim => 0.2,
        Kind::Bright => 4.0,
        _ => 1.0,
    };
    script.light.flash_ms *= gain * light;
    script.light.rubbing_ms *= gain * light;
    if kind == Kind::Noisy {
        script.noise = 2.0;
        script.light.gain_deviation *= 3.0;
    }
    if kind == Kind::Dead {
        let mut place = || (1 + between(0.0, 5.0) as i64, 1 + between(0.0, 5.0) as i64);
        let (dead, weak) = (place(), [place(), place(), place()]);
        script.light.dead = Dead::try_from(vec![[dead.0, dead.1]]).expect("rows and columns are 1 to 5");
        let weak = weak.map(|(row, column)| (row, column, 0.15)).to_vec();
        script.light.weak = Weak::try_from(weak).expect("rows and columns are 1 to 5");
    }
    if kind == Kind::Two {
        let specimen = Specimen { length_mm: 30.0, ..Specimen::ALL[between(0.0, 10.0) as usize] };
        let speed = 60.0 * (20.0_f64 / 3.0).powf(between(0.0, 1.0));
        script.touches.push(Touch::Slide(Slide::new(specimen, speed, between(0.0, 360.0))));
        script.gap = between(1.0, 46.0) as u32;
    }
    if kind == Kind::OneWeak {
        let weak = (1 + between(0.0, 5.0) as i64, 1 + between(0.0, 5.0) as i64, 0.15);
        script.light.weak = Weak::try_from(vec![weak]).expect("rows and columns are 1 to 5");
    }
    script.sensor.size = FrameSize::new(400, 400).expect("the size is in range");
    script
}

/// Computes the scene of a number with the whole core, and the motion of its first event.
fn answer(kind: Kind, number: u64) -> Answered {
    let script = script(kind, number);
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).expect("sums fit 32 bits");
    let pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build();
    let mut pipeline = pipeline.expect("all parameters are defaults");
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let mut scene = Scene::new(&script).expect("the scene was drawn within its limits");
    let (mut events, mut motion) = (0, None);
    while let Some(SimulatedFrame::Taxels(sums)) = scene.next_shot() {
        if let Some(event) = pipeline.push_taxels(&sums).event() {
            events += 1;
            motion = motion.or_else(|| Some(by_default(&event, config)));
        }
    }
    Answered { touch: script.touches[0], events, motion }
}

/// Returns the motion of an event by the default estimator.
pub(crate) fn by_default(event: &Event<'_>, config: MotionConfig) -> Motion {
    by_wave(event, event.taxels().expect("no frame was lost"), config).motion
}

/// Answers `count` touches of a kind, on all processors.
pub(crate) fn answers(kind: Kind, count: u64) -> Vec<Answered> {
    each(count, |number| answer(kind, number))
}

/// Returns what a function returns for each number below `count`, computed on all processors.
pub(crate) fn each<T: Send>(count: u64, of: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    let of = &of;
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..workers)
            .map(|worker| {
                let numbers = count * worker / workers..count * (worker + 1) / workers;
                scope.spawn(move || numbers.map(of).collect::<Vec<_>>())
            })
            .collect();
        parts.into_iter().flat_map(|part| part.join().expect("a worker returns")).collect()
    })
}
