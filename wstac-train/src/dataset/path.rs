//! Samples along the path of random slides: of any direction, speed, length and sensor.
//!
//! Each slide is a scene of its own. Its velocity is the one that the core measures, as on a real sensor.

use std::io::{self, Seek, Write};
use std::ops::Range;

use rayon::prelude::*;
use wstac_core::features::FeatureScale;
use wstac_core::green::gray::Gray;
use wstac_core::law::{ByWave, EventLaw};
use wstac_core::layout::Layout;
use wstac_core::model::file::{INPUTS, Input, TAXEL_INPUTS};
use wstac_core::paper::trigger::TriggerConfig;
use wstac_core::params::{DEFAULT_FLOOR_LEVELS, FEATURES, SAMPLE_FRAMES};
use wstac_core::pipeline::Pipeline;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::crosstalk::Correction;
use wstac_core::touch::motion::{MotionConfig, Readout};
use wstac_core::touch::path_sample::PathSample;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::Paths;
use wstac_scene::rng::Rng;
use wstac_scene::sensor::Fidelity;
use wstac_scene::specimen::Specimen;
use wstac_scene::{Scene, SceneConfig, SimulatedFrame, Slide, Touch};

use super::npz::{Npz, SCALE};
use crate::model::trained::in_set_order;

/// Random slides.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomSlides {
    /// Their specimens, which are equally frequent.
    pub specimens: Vec<Specimen>,
    /// Number of slides.
    pub slides: u32,
    /// The seed of everything; slides of different seeds have no random number in common.
    pub seed: u64,
    /// Range of the speed in mm/s; its logarithm is even.
    pub speeds_mm_s: [f64; 2],
    /// Range of the direction in degrees.
    pub directions_deg: [f64; 2],
    /// Range of the length in mm.
    pub lengths_mm: [f64; 2],
    /// The first sensor, and the number of sensors.
    pub sensors: [u32; 2],
    /// Range of the gain of all light, that of a sensor as it is mounted for one run.
    pub gains: [f64; 2],
}

impl Default for RandomSlides {
    fn default() -> Self {
        Self {
            specimens: Specimen::ALL.to_vec(),
            slides: 1000,
            seed: 1,
            speeds_mm_s: [50.0, 300.0],
            directions_deg: [0.0, 360.0],
            lengths_mm: [60.0, 120.0],
            sensors: [0, 1000],
            gains: [0.6, 1.4],
        }
    }
}

/// The result of a slide.
#[derive(Clone, Debug)]
pub struct PathSlide {
    /// The slide.
    pub slide: Slide,
    /// Its sensor.
    pub sensor: u32,
    /// Its sample over time; zeros if there was no event.
    pub frames: [i16; INPUTS],
    /// Its samples along the path, of ten sums and of 25 taxels; `None` without a velocity.
    pub path: Option<PathSample>,
    /// Of 25 taxels.
    pub taxel_path: Option<PathSample>,
    /// Light of 25 taxels over time; `None` if there was no event.
    pub light: Option<Box<[i16; TAXEL_INPUTS]>>,
    /// The speed in mm/s and the direction in degrees by the default law; `None` if there is none.
    pub measured: Option<[f32; 2]>,
    /// Whether the touch slides, so that a host names its texture.
    pub slides: bool,
    /// Whether the event and its motion are reliable.
    pub reliable: bool,
}

impl RandomSlides {
    /// Returns the slide of a number, its sensor, and its scene.
    pub fn drawn(&self, number: u32) -> (Slide, u32, SceneConfig) {
        let mut rng = Rng::new(self.seed, 1_000_000 + u64::from(number));
        let mut between = |[from, to]: [f64; 2]| from + (to - from) * rng.uniform();
        let speed = between(self.speeds_mm_s.map(f64::ln)).exp();
        let direction = between(self.directions_deg);
        let length_mm = between(self.lengths_mm);
        let specimen = between([0.0, self.specimens.len() as f64]) as usize;
        let sensor = self.sensors[0] + between([0.0, f64::from(self.sensors[1])]) as u32;
        let gain = between(self.gains);
        let slide = Slide::new(Specimen { length_mm, ..self.specimens[specimen] }, speed, direction);
        let mut scene = SceneConfig::new(vec![Touch::Slide(slide)]);
        scene.seed = self.seed.wrapping_mul(10_000_019).wrapping_add(u64::from(number));
        scene.fidelity = Fidelity::Taxel;
        scene.light.unit = sensor;
        scene.light.flash_ms *= gain;
        scene.light.rubbing_ms *= gain;
        (slide, sensor, scene)
    }

    /// Simulates the slide of a number.
    ///
    /// # Errors
    /// Its scene is not valid.
    fn slide(&self, number: u32) -> Result<PathSlide, Error> {
        let (slide, sensor, scene) = self.drawn(number);
        let layout = Layout::paper(scene.sensor.size).map_err(|error| wrong(&error))?;
        PathSlide::of_scene(slide, sensor, &scene, layout, (Readout::GLOBAL, None), || false)
    }

    /// Simulates all slides, in parallel. They are in the order of their numbers.
    ///
    /// # Errors
    /// A scene is not valid.
    pub fn all(&self) -> Result<Vec<PathSlide>, Error> {
        self.all_while(|| true).map(Option::unwrap_or_default)
    }

    /// Simulates all slides, in parallel. They are in the order of their numbers.
    ///
    /// `goes_on` is called after each slide, by any thread. As soon as it returns `false`, the result is `None`.
    ///
    /// # Errors
    /// A scene is not valid.
    pub fn all_while(&self, goes_on: impl Fn() -> bool + Sync) -> Result<Option<Vec<PathSlide>>, Error> {
        self.some_while(0..self.slides, goes_on, |slide| slide)
    }

    /// Simulates the slides of some numbers as [`all_while`](Self::all_while) does, and returns what `keep` makes of
    /// them.
    ///
    /// # Errors
    /// A scene is not valid.
    pub fn some_while<T: Send>(
        &self,
        numbers: Range<u32>,
        goes_on: impl Fn() -> bool + Sync,
        keep: impl Fn(PathSlide) -> T + Sync,
    ) -> Result<Option<Vec<T>>, Error> {
        let each = numbers.into_par_iter().with_max_len(16).map(|number| {
            let kept = keep(self.slide(number)?);
            Ok(goes_on().then_some(kept))
        });
        each.collect()
    }
}

/// Numbers that models read, in tens, of a sample of this input: 28 mm of a path, or all frames.
pub const fn frames_of(input: Input) -> u8 {
    match input {
        Input::Path => 39,
        Input::TaxelPath => 28,
        Input::Taxels => (TAXEL_INPUTS / FEATURES) as u8,
        _ => SAMPLE_FRAMES as u8,
    }
}

fn wrong(error: &dyn std::fmt::Display) -> Error {
    Error::new(ErrorKind::Config, "random slides", error.to_string())
}

impl PathSlide {
    /// Simulates a scene until its first event, without the frames for which `is_lost` returns true.
    ///
    /// # Errors
    /// The scene is not valid, or the layout is not that of its frames.
    pub fn of_scene(
        slide: Slide,
        sensor: u32,
        script: &SceneConfig,
        layout: Layout,
        (readout, correction): (Readout, Option<Correction>),
        mut is_lost: impl FnMut() -> bool,
    ) -> Result<Self, Error> {
        let rate = script.sensor.rate;
        let geometry = FrameGeometry::new(Gray, layout, rate).map_err(|error| wrong(&error))?;
        let scale: FeatureScale = FeatureScale::of(&geometry, DEFAULT_FLOOR_LEVELS).map_err(|error| wrong(&error))?;
        let trigger = TriggerConfig::default().one_event_per_touch();
        let mut pipeline =
            Pipeline::builder(geometry).trigger(trigger).taxels().build().map_err(|error| wrong(&error))?;
        pipeline.keep_taxels();
        pipeline.set_correction(correction);
        let (config, whole) = (MotionConfig::published(rate).with_readout(readout), SAMPLE_FRAMES as u8);
        let mut scene = Scene::new(script)?;
        while let Some(frame) = scene.next_shot() {
            let update = match frame {
                _ if is_lost() => pipeline.push_lost(1),
                SimulatedFrame::Taxels(sums) => pipeline.push_taxels(&sums),
                SimulatedFrame::Frame(bytes) => pipeline.push_frame(bytes).map_err(|error| wrong(&error))?,
                _ => continue,
            };
            let Some(event) = update.event() else { continue };
            let answer = ByWave(config).answer(&event);
            let velocity = ByWave(config).path_velocity(&event, answer.velocity());
            return Ok(Self {
                slide,
                sensor,
                frames: event.sample.flat(),
                path: velocity.and_then(|velocity| PathSample::of_sums(&event, &velocity, config, whole)),
                taxel_path: velocity.and_then(|velocity| PathSample::of_touch(&event, &velocity, config, whole)),
                light: event.taxels().map(|ring| Box::new(ring.numbers(&scale))),
                measured: velocity.map(|velocity| [velocity.mm_s, velocity.degrees]),
                slides: answer.has_texture(),
                reliable: answer.reliable,
            });
        }
        let (frames, path, taxel_path, light, measured) = ([0; INPUTS], None, None, None, None);
        Ok(Self { slide, sensor, frames, path, taxel_path, light, measured, slides: false, reliable: false })
    }

    /// Returns the sample that a model of this input takes; `None` if there is none, or if it shows too little of the
    /// path.
    pub fn sample(&self, input: Input) -> Option<&[i16]> {
        if input == Input::Frames {
            return self.frames.iter().any(|number| *number != 0).then_some(&self.frames);
        }
        other_sample(self.light.as_deref(), self.path.as_ref(), self.taxel_path.as_ref(), input)
    }
}

/// Returns the sample other than ten features that a model of this input takes; `None` if there is none, or if it shows
/// too little of the path.
pub fn path_sample(paths: &Paths, input: Input) -> Option<&[i16]> {
    other_sample(paths.light.as_ref(), paths.sums.as_ref(), paths.taxels.as_ref(), input)
}

fn other_sample<'s>(
    light: Option<&'s [i16; TAXEL_INPUTS]>,
    sums: Option<&'s PathSample>,
    taxels: Option<&'s PathSample>,
    input: Input,
) -> Option<&'s [i16]> {
    if input == Input::Taxels {
        return light.map(<[i16; TAXEL_INPUTS]>::as_slice);
    }
    let path = if input == Input::TaxelPath { taxels } else { sums };
    path.filter(|path| path.covers(frames_of(input))).map(|path| path.numbers().as_slice())
}

/// A slide in a data set of one input.
#[derive(Clone, Debug, PartialEq)]
pub struct PathRow {
    /// The slide.
    pub slide: Slide,
    /// Its sensor.
    pub sensor: u32,
    /// Its sample; `None` if there is none, or if it shows too little of the path.
    pub sample: Option<Box<[i16]>>,
    /// The measured speed in mm/s and direction in degrees; `None` if there is none.
    pub measured: Option<[f32; 2]>,
    /// Whether the event and its motion are reliable.
    pub reliable: bool,
}

impl PathRow {
    /// Returns the row of a slide in a data set of this input.
    pub fn of(slide: &PathSlide, input: Input) -> Self {
        let sample = slide.sample(input).map(Box::from);
        let PathSlide { slide, sensor, measured, reliable, .. } = *slide;
        Self { slide, sensor, sample, measured, reliable }
    }
}

/// Writes the slides of a sweep as a data set of one input, with the sensors that are for tests.
///
/// # Errors
/// The file cannot be written.
pub fn write_split(
    file: impl Write + Seek,
    slides: &[PathRow],
    input: Input,
    is_for_tests: impl Fn(u32) -> bool,
) -> io::Result<()> {
    let mut npz = Npz::new(file);
    let zeros = vec![0; input.numbers()];
    let name = super::arrays::array_of(input);
    npz.samples(name, slides.iter().map(|slide| in_set_order(slide.sample.as_deref().unwrap_or(&zeros))))?;
    npz.number("scale", SCALE)?;
    npz.strings("y_specimen", slides.iter().map(|slide| super::arrays::name(&slide.slide.specimen)))?;
    let mut column = |name: &str, of: &dyn Fn(&PathRow) -> f64| npz.numbers(name, slides.iter().map(of));
    column("speed", &|slide| slide.slide.speed_mm_s)?;
    column("direction", &|slide| slide.slide.direction_deg)?;
    column("length", &|slide| slide.slide.specimen.length_mm)?;
    column("period", &|slide| slide.slide.specimen.period_mm)?;
    column("depth", &|slide| slide.slide.specimen.depth_mm)?;
    column("sensor", &|slide| f64::from(slide.sensor))?;
    column("measured_speed", &|slide| slide.measured.map_or(f64::NAN, |[mm_s, _]| mm_s.into()))?;
    column("measured_direction", &|slide| slide.measured.map_or(f64::NAN, |[_, degrees]| degrees.into()))?;
    npz.numbers("reliable", slides.iter().map(|slide| slide.reliable))?;
    npz.strings("y_pattern", slides.iter().map(|slide| slide.slide.specimen.pattern.name().to_owned()))?;
    npz.numbers("y_depth", slides.iter().map(|slide| slide.slide.specimen.depth_mm))?;
    let split = |slide: &PathRow| if is_for_tests(slide.sensor) { "test" } else { "train" }.to_owned();
    npz.strings("split", slides.iter().map(split))?;
    npz.finish().map(drop)
}

#[cfg(test)]
mod tests {
    use wstac_core::model::Model;
    use wstac_core::model::file::Task;

    use super::*;
    use crate::model::eval::answers;
    use crate::model::trained::{Kind, Linear, Row, Trained};
    use crate::model::write;

    fn few() -> RandomSlides {
        RandomSlides { slides: 12, seed: 5, ..RandomSlides::default() }
    }

    #[test]
    fn random_slides_are_within_their_ranges_and_have_a_path() {
        let slides = few().all().unwrap();
        assert_eq!(slides.len(), 12);
        assert!(slides.iter().filter(|slide| slide.reliable).count() >= 11);
        for PathSlide { slide, sensor, path, taxel_path, measured, frames, .. } in &slides {
            assert!((50.0..=300.0).contains(&slide.speed_mm_s) && (60.0..=120.0).contains(&slide.specimen.length_mm));
            assert!((0.0..360.0).contains(&slide.direction_deg) && *sensor < 1000);
            let [mm_s, degrees] = measured.unwrap().map(f64::from);
            let off = (degrees - slide.direction_deg + 180.0).rem_euclid(360.0) - 180.0;
            assert!((mm_s / slide.speed_mm_s - 1.0).abs() < 0.05 && off.abs() < 3.0, "{slide:?}");
            assert!(path.unwrap().covers(39) && taxel_path.unwrap().covers(28), "{slide:?}");
            assert!(frames.iter().any(|&feature| feature != 0));
        }
        // Numbers, not threads, decide.
        let again = RandomSlides { slides: 3, ..few() }.all().unwrap();
        for (one, other) in again.iter().zip(&slides) {
            assert_eq!((one.slide, one.path, one.taxel_path), (other.slide, other.path, other.taxel_path));
        }
        let other = RandomSlides { slides: 1, seed: 6, ..few() }.all().unwrap();
        assert_ne!(other[0].slide, slides[0].slide);
    }

    /// A model whose answer is the sign of one number of a sample.
    fn sign_of(input: Input, number: usize) -> Vec<u32> {
        let mut weights = vec![0.0; INPUTS];
        // Weights are in the order of data sets.
        weights[number % FEATURES * SAMPLE_FRAMES + number / FEATURES] = 1.0;
        let kind = Kind::Linear(Linear { pairs: false, rows: vec![Row { weights, bias: 0.0 }] });
        let labels = vec!["no".into(), "yes".into()];
        let (task, remarks) = (Task::Other, Vec::new());
        let trained = Trained { labels, task, input, inputs: INPUTS, speeds: None, kind, remarks, mean: None };
        write::write(&trained, "", write::Options::default()).unwrap().words
    }

    #[test]
    fn a_model_is_evaluated_on_the_sample_that_it_takes() {
        let slides = few().all().unwrap();
        let path = std::env::temp_dir().join(format!("wstac-path-{}.npz", std::process::id()));
        // Number 0 along a path is that of the speed, and number 1 that of the direction.
        for (input, number) in [(Input::Path, 0), (Input::TaxelPath, 0), (Input::TaxelPath, 1), (Input::Path, 500)] {
            let rows: Vec<PathRow> = slides.iter().map(|slide| PathRow::of(slide, input)).collect();
            write_split(std::fs::File::create(&path).unwrap(), &rows, input, |_| false).unwrap();
            let words = sign_of(input, number);
            let found = answers(&Model::from_words(&words).unwrap(), &path).unwrap().predictions;
            let sample = |slide: &PathSlide| if input == Input::Path { slide.path } else { slide.taxel_path };
            let expected: Vec<u8> =
                slides.iter().map(|slide| u8::from(sample(slide).unwrap().numbers()[number] > 0)).collect();
            assert_eq!(found, expected, "{input:?} {number}");
        }
        std::fs::remove_file(path).unwrap();
    }
}
