//! Textures under conditions that no model was trained in, and objects that have none of the ten textures.

use std::fmt::Write as _;

use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::crosstalk::Correction;
use wstac_core::touch::motion::{Readout, ReadoutTime, RowOrder};
use wstac_host::config::Config;
use wstac_host::model_file::ModelFile;
use wstac_host::source::{Source, SourceEvent};
use wstac_scene::rng::Rng;
use wstac_scene::sensor::{Fidelity, Pose};
use wstac_scene::source::SceneSource;
use wstac_scene::specimen::{Pattern, Specimen};
use wstac_scene::{Dead, SceneConfig, Slide, Touch, Weak};
use wstac_setup::calibrate::Watch;
use wstac_setup::gains::{self, GainsWatch};
use wstac_train::dataset::path::{PathSlide, RandomSlides};

use super::{FIRST_SENSOR, Said, is_right, said};
use crate::objects::scenes::{self, Fault, Kind};
use crate::touches::each;
use crate::{at_least, interval, share};

/// The models of the table, of ten sums and of 25 taxels.
const MODELS: [&str; 2] = ["path-svm", "taxel-path-svm"];
/// Light of a weak whisker, as a fraction.
const WEAK: f64 = 0.15;
/// Speeds at which a slide moves at most 5 mm per frame, at 30 frames per second, and all.
const TO_5_MM: [f64; 2] = [50.0, 150.0];
const ALL: [f64; 2] = [50.0, 300.0];
const BEYOND: [f64; 2] = [150.0, 300.0];

/// Faults of the sensor and its camera, under which slides are named.
#[derive(Clone, Copy)]
struct Condition {
    speeds: [f64; 2],
    fps: u32,
    slides: u64,
    /// Fraction of frames after which some are lost, and how many at most.
    lost: (f64, u64),
    /// Numbers of dead and weak whiskers.
    dead: u8,
    weak: u8,
    /// Most ms from the first to the last row, which is known.
    readout_ms: f64,
    /// Factor of the spread of gains.
    gains: f64,
    /// Whether the camera has a pose.
    posed: bool,
    /// Whether gains were calibrated.
    calibrated: bool,
    /// Whether slides go along a row or a column, half a pitch or one in a frame: all whiskers see the same places.
    in_step: bool,
}

const USUAL: Condition = Condition {
    speeds: TO_5_MM,
    fps: 30,
    slides: 600,
    lost: (0.0, 1),
    dead: 0,
    weak: 0,
    readout_ms: 0.0,
    gains: 1.0,
    posed: false,
    calibrated: false,
    in_step: false,
};

const GAINS: Condition = Condition { gains: 3.0, ..USUAL };
const POSED: Condition = Condition { posed: true, slides: 150, ..USUAL };
const CALIBRATED: Condition = Condition { calibrated: true, ..USUAL };
const LOST: Condition = Condition { lost: (0.05, 1), ..USUAL };

/// Conditions with their names, and the goal of right answers in percent.
const CONDITIONS: [(&str, Condition, Option<f64>); 21] = [
    ("no fault", USUAL, Some(98.0)),
    ("60 frames per second", Condition { fps: 60, speeds: ALL, ..USUAL }, Some(98.0)),
    ("readout of up to 33 ms, known", Condition { readout_ms: 33.0, ..USUAL }, Some(98.0)),
    ("gains spread three times", GAINS, None),
    ("gains spread three times, gains measured", Condition { gains: 3.0, ..CALIBRATED }, Some(98.0)),
    ("oblique cameras", POSED, None),
    ("oblique cameras, gains measured", Condition { calibrated: true, ..POSED }, Some(98.0)),
    (
        "oblique cameras, gains spread three times, gains measured",
        Condition { gains: 3.0, calibrated: true, ..POSED },
        Some(98.0),
    ),
    ("one weak whisker", Condition { weak: 1, ..USUAL }, None),
    ("one weak whisker, gains measured", Condition { weak: 1, ..CALIBRATED }, None),
    ("one dead whisker", Condition { dead: 1, ..USUAL }, Some(85.0)),
    ("one dead whisker, three weak ones", Condition { dead: 1, weak: 3, ..USUAL }, None),
    ("5 % of the frames lost", LOST, Some(85.0)),
    ("5 % of the frames lost, in runs of 1 to 4", Condition { lost: (0.02, 4), ..USUAL }, None),
    ("5 % of the frames lost, 5 to 10 mm per frame", Condition { speeds: BEYOND, ..LOST }, None),
    ("5 to 10 mm per frame", Condition { speeds: BEYOND, ..USUAL }, None),
    (
        "5 to 10 mm per frame, readout, gains spread three times",
        Condition { speeds: BEYOND, readout_ms: 33.0, ..GAINS },
        None,
    ),
    ("25 frames per second, 50 to 300 mm/s", Condition { fps: 25, speeds: ALL, ..USUAL }, None),
    ("15 frames per second, 50 to 300 mm/s", Condition { fps: 15, speeds: ALL, ..USUAL }, None),
    (
        "readout of 33 ms, gains spread three times, gains measured",
        Condition { gains: 3.0, readout_ms: 33.0, ..CALIBRATED },
        Some(98.0),
    ),
    ("60 or 120 mm/s along a row or a column", Condition { in_step: true, ..USUAL }, Some(98.0)),
];

/// Objects. Blocks have one of the ten textures, all others none.
pub(super) const OBJECTS: [(&str, Kind); 6] = [
    ("rods", Kind::Rod),
    ("balls", Kind::Ball),
    ("coins", Kind::Coin),
    ("two fingers", Kind::Fingers),
    ("corners", Kind::Corner),
    ("blocks of 6 to 20 mm", Kind::Block),
];
const TOUCHES: u64 = 500;
const OBJECT_SPEEDS: [f64; 2] = [30.0, 300.0];

/// Returns the layout that calibration finds before a camera; `None` if it refuses.
fn calibrated(script: &SceneConfig) -> Option<Layout> {
    let flat = Touch::Slide(Slide::new(Specimen::ALL[0], 150.0, 0.0));
    let script = SceneConfig { touches: vec![flat], lead_in: 27, ..script.clone() };
    let mut source = SceneSource::new(&script).expect("the scene is valid");
    let mut watch = Watch::new(source.info()).expect("frames are gray");
    let last = source.truth().last().expect("a touch").end_s * script.sensor.rate.per_second() + 12.0;
    for _ in 0..last as u32 {
        let Ok(SourceEvent::Frame(frame)) = source.next_event() else { break };
        watch.take(frame.bytes);
    }
    watch.calibrate().result.ok().map(|calibration| calibration.layout)
}

/// Returns the correction of gains that three slides of `Saw4` tell before a camera, as a configuration has it.
fn calibrated_gains(script: &SceneConfig, layout: Layout, rng: &mut Rng) -> Option<Correction> {
    let specimen = Specimen::block(Pattern::Saw, 4.0);
    let slide = |_| Touch::Slide(Slide::new(specimen, 60.0 + 60.0 * rng.uniform(), 360.0 * rng.uniform()));
    let script = SceneConfig { touches: (0..3).map(slide).collect(), lead_in: 27, ..script.clone() };
    let mut source = SceneSource::new(&script).expect("the scene is valid");
    let geometry = FrameGeometry::new(
        Any::new(source.info().format, source.info().color, YcbcrMethod::default()),
        layout,
        script.sensor.rate,
    )
    .expect("sums fit");
    let mut watch = GainsWatch::new(geometry);
    while let Ok(event) = source.next_event() {
        if matches!(event, SourceEvent::End) {
            break;
        }
        watch.take(&event);
    }
    let gains = watch.gains().ok()?;
    let text = gains::written_to(&gains, "").expect("it is valid");
    Config::parse(&text).expect("it is valid").layout.correction()
}

impl Condition {
    /// Changes the scene of a slide. Returns its layout; `None` if calibration refuses.
    fn alter(&self, script: &mut SceneConfig, rng: &mut Rng) -> Option<Layout> {
        let mut places = |count: u8| -> Vec<[i64; 2]> {
            (0..count).map(|_| [1 + rng.below(5) as i64, 1 + rng.below(5) as i64]).collect()
        };
        let (dead, weak) = (places(self.dead), places(self.weak));
        script.light.dead = Dead::try_from(dead).expect("rows and columns are 1 to 5");
        let weak: Vec<(i64, i64, f64)> = weak.into_iter().map(|[row, column]| (row, column, WEAK)).collect();
        script.light.weak = Weak::try_from(weak).expect("rows and columns are 1 to 5");
        script.light.gain_deviation *= self.gains;
        script.sensor.rate = FrameRate::new(self.fps, 1).expect("a rate");
        script.sensor.readout_ms = self.readout_ms * rng.uniform();
        if !self.posed {
            return Some(Layout::paper(script.sensor.size).expect("a layout"));
        }
        script.fidelity = Fidelity::Rendered;
        script.sensor.size = FrameSize::new(400, 400).expect("a size");
        script.sensor.pose = Some(Pose::random(rng, script.sensor.size));
        calibrated(script)
    }

    /// Returns the slides under this condition, drawn by a seed.
    fn slides(&self, seed: u64) -> Vec<PathSlide> {
        let slides = RandomSlides {
            seed,
            speeds_mm_s: self.speeds,
            sensors: [FIRST_SENSOR + 3000, 1000],
            ..RandomSlides::default()
        };
        let of = |number: u64| {
            let (mut slide, sensor, mut script) = slides.drawn(number as u32);
            let mut rng = Rng::new(seed, 3_000_000_000 + number);
            if self.in_step {
                (slide.speed_mm_s, slide.direction_deg) =
                    (60.0 * (1 + rng.below(2)) as f64, 90.0 * rng.below(4) as f64);
                script.touches = vec![Touch::Slide(slide)];
            }
            let layout = self.alter(&mut script, &mut rng)?;
            let correction = if self.calibrated { Some(calibrated_gains(&script, layout, &mut rng)?) } else { None };
            let mut run = 0;
            let is_lost = || {
                if run == 0 && rng.uniform() < self.lost.0 {
                    run = 1 + rng.below(self.lost.1 as usize);
                }
                let is_lost = run > 0;
                run = run.saturating_sub(1);
                is_lost
            };
            Some(of_scene(&slide, sensor, &script, (layout, correction), is_lost))
        };
        each(self.slides, of).into_iter().flatten().collect()
    }
}

/// Returns the slide of a scene whose readout is known.
fn of_scene(
    slide: &Slide,
    sensor: u32,
    script: &SceneConfig,
    (layout, correction): (Layout, Option<Correction>),
    is_lost: impl FnMut() -> bool,
) -> PathSlide {
    let time = ReadoutTime::from_ms(script.sensor.readout_ms as f32);
    let readout = Readout::of_layout(time, RowOrder::Down, &layout, script.sensor.rate);
    PathSlide::of_scene(*slide, sensor, script, layout, (readout, correction), is_lost).expect("the scene is valid")
}

/// Returns the table of conditions, and the objects that have names.
pub(crate) fn section() -> String {
    let models = MODELS.map(|name| ModelFile::open(format!("builtin:{name}").as_ref()).expect("a shipped model"));
    let models = models.each_ref().map(|file| file.model().expect("a shipped model"));
    let [sums, taxels] = MODELS;
    let mut page = format!("\n{ABOUT}\n\n| condition | `{sums}` | `{taxels}` | wrong |\n");
    page += "| --- | ---: | ---: | ---: |\n";
    for (number, (name, condition, goal)) in CONDITIONS.into_iter().enumerate() {
        let slides = condition.slides(88_100 + number as u64);
        let [sums, taxels] = models.each_ref().map(|model| said(model, &slides));
        let right = |all: &[Option<Said>]| all.iter().filter(|said| is_right(said.as_ref())).count();
        let wrong = taxels.iter().flatten().filter(|said| said.known && !said.right).count();
        let judged = |right, of| at_least(right, of, goal.unwrap_or(0.0));
        let (count, goal) = (slides.len(), goal.map_or(String::new(), |goal| format!(" ≥{goal}")));
        let (sums, taxels, wrong) = (share(right(&sums), count), judged(right(&taxels), count), interval(wrong, count));
        let refused = condition.slides - count as u64;
        let is_said = condition.posed || refused > 0;
        let name = if is_said { format!("{name}; {refused} refused") } else { name.into() };
        let _ = writeln!(page, "| {name} | {sums} | {taxels}{goal} | {wrong} |");
    }
    let of_objects = OBJECTS.into_iter().map(|(name, kind)| {
        let slides = each(TOUCHES, |number| {
            let script = scenes::draw(kind, Fault::None, OBJECT_SPEEDS, number).script;
            let slide = script.touches.last().and_then(Touch::slide).copied().expect("it slides");
            let layout = Layout::paper(script.sensor.size).expect("a layout");
            of_scene(&slide, script.light.unit, &script, (layout, None), || false)
        });
        let named = said(&models[1], &slides).iter().flatten().filter(|said| said.known).count();
        format!("{name} {}", interval(named, slides.len()))
    });
    let _ = writeln!(page, "\n{OF_OBJECTS}\n{}.", of_objects.collect::<Vec<_>>().join(", "));
    page
}

const ABOUT: &str = "Right answers in percent, and wrong names of `taxel-path-svm` (goal: ≤1), under conditions that no model was trained in: of 600 slides each, 150 with oblique cameras.
Slides move at most 5 mm per frame if the row does not say otherwise.
Oblique cameras are those of `ci/long poses` after `wstac calibrate`, and gains are measured by `--gains` with three slides, where calibration is not refused:";

const OF_OBJECTS: &str = "Of 500 objects of each kind at 30 to 300 mm/s, `taxel-path-svm` names so many, in percent (goal: ≤1, but blocks have a texture):";
