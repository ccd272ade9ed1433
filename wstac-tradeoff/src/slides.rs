//! The scene set: the slides on which the settings are evaluated.
//!
//! Besides slides of specimens that are wider than the sensor there are touches of rods, balls, coins, corners and
//! narrow blocks. None of them, nor any of their sensors, was used when a model was trained, chosen or judged. Those
//! used sensors below 3000 and seeds below 100 000 000.

use wstac_core::layout::FrameSize;
use wstac_core::paper::direction::Heading;

use super::parameters::Format;
use wstac_host::error::Error;
use wstac_scene::rng::Rng;
use wstac_scene::specimen::{Body, Specimen};
use wstac_scene::{SceneConfig, Slide, Touch};

/// Number of sensors.
///
/// Each has whiskers of its own gains and is mounted once: with a gain of its light and in one direction.
pub const SENSORS: u32 = 20;
/// Number of the first of these sensors.
pub const FIRST_UNIT: u32 = 3000;
/// Number of the first additional sensor on which a choice is run, because the choice was made from the others'
/// results.
pub const FRESH_UNIT: u32 = 4000;
/// Seed of the first slide.
pub const FIRST_SEED: u64 = 100_000_000;
/// Distance between the seeds of a sensor's first slide and of the next sensor's.
const SEEDS_APART: u64 = 10_000;
/// Speeds in mm/s.
pub const SPEEDS: [u32; 11] = [50, 75, 100, 125, 150, 175, 200, 225, 250, 275, 300];
/// Distance from one speed of a sensor's specimen to its next: slow and fast speeds alternate.
const SPEED_STEP: u32 = 3;
/// Default number of slides of every sensor: four speeds of ten specimens.
pub const SLIDES: u32 = 40;
/// Number of slides of every sensor for a quick look.
pub const QUICK_SLIDES: u32 = 10;
/// Largest number of slides of a sensor: every specimen at every speed.
pub const MOST_SLIDES: u32 = 110;
/// Slides of specimens for each touch of another object.
const PER_OBJECT: u32 = 4;
/// Purpose of the random numbers of objects: not one of a scene's.
const OBJECT: u64 = 101;
/// Standard deviation of the light's gain from sensor to sensor, as a fraction; its limits follow.
const GAIN_DEVIATION: f64 = 0.2;
const GAINS: (f64, f64) = (0.5, 1.5);
/// Purpose of the random numbers of gains: not one of a scene's.
const GAIN: u64 = 100;
/// Side of the frames in pixels.
pub const SIDE: u32 = 400;

/// One slide over one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TradeSlide {
    /// Number of the sensor, from 0.
    pub sensor: u32,
    /// The simulator's number of the sensor.
    unit: u32,
    /// Number among the sensor's slides, from 0.
    pub number: u32,
    /// The specimen.
    pub specimen: Specimen,
    /// Its speed, in mm/s.
    pub speed_mm_s: u32,
    /// Its direction.
    pub heading: Heading,
    /// A touch of another object instead of the specimen, in any direction.
    pub object: Option<Slide>,
    seed: u64,
}

/// Returns this many slides of every sensor, and a quarter as many touches of other objects, sensor by sensor: all
/// specimens at one speed each, then at another.
pub fn slides(of_each: u32) -> Vec<TradeSlide> {
    from(FIRST_UNIT, of_each)
}

/// Returns this many slides of every sensor of a fresh set, which no choice was based on.
pub fn fresh_slides(of_each: u32) -> Vec<TradeSlide> {
    from(FRESH_UNIT, of_each)
}

fn from(first: u32, of_each: u32) -> Vec<TradeSlide> {
    let of_sensor = |sensor| {
        let touches = (0..of_each / PER_OBJECT).map(move |number| object(first, sensor, MOST_SLIDES + number));
        (0..of_each).map(move |number| slide(first, sensor, number)).chain(touches)
    };
    (0..SENSORS).flat_map(of_sensor).collect()
}

fn slide(first: u32, sensor: u32, number: u32) -> TradeSlide {
    let specimens = Specimen::ALL.len() as u32;
    // If a sensor has few slides, other sensors have the specimens that it lacks.
    let (specimen, turn) = ((number + sensor) % specimens, number / specimens);
    let speed = (sensor + specimen + SPEED_STEP * turn) as usize % SPEEDS.len();
    let headings = [Heading::Right, Heading::Up, Heading::Left, Heading::Down];
    TradeSlide {
        sensor,
        unit: first + sensor,
        number,
        specimen: Specimen::ALL[specimen as usize],
        speed_mm_s: SPEEDS[speed],
        heading: headings[sensor as usize % headings.len()],
        object: None,
        seed: FIRST_SEED
            + SEEDS_APART * u64::from(first + sensor - FIRST_UNIT)
            + u64::from(turn * specimens + specimen),
    }
}

/// Returns a touch of a rod, ball, coin, block or corner, at 50 to 300 mm/s in any direction.
fn object(first: u32, sensor: u32, number: u32) -> TradeSlide {
    let own = slide(first, sensor, number);
    let mut rng = Rng::new(own.seed, OBJECT);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.uniform();
    let bodies = [Body::Rod, Body::Ball, Body::Coin, Body::Block, Body::Corner { degrees: 90.0 }];
    let body = bodies[(number + sensor) as usize % bodies.len()];
    let (size, width) = (between(5.0, 20.0), between(6.0, 20.0));
    let specimen = match body {
        Body::Rod => Specimen { body, width_mm: f64::INFINITY, ..Specimen::ball(size) },
        Body::Block | Body::Corner { .. } => {
            Specimen { body, length_mm: 4.0 * size, width_mm: width, ..Specimen::ALL[0] }
        }
        _ => Specimen { body, ..Specimen::ball(size) },
    };
    let offset_mm = if body == Body::Rod { 0.0 } else { between(-4.0, 4.0) };
    let slide = Slide::new(specimen, between(50.0, 300.0), between(0.0, 360.0));
    TradeSlide { object: Some(Slide { offset_mm, ..slide }), ..own }
}

/// Returns the gain of a sensor's light.
fn gain(unit: u32) -> f64 {
    let drawn = Rng::new(FIRST_SEED + u64::from(unit - FIRST_UNIT), GAIN).normal();
    (1.0 + GAIN_DEVIATION * drawn).clamp(GAINS.0, GAINS.1)
}

impl TradeSlide {
    /// Returns the same slide over the same sensor with other noise.
    #[cfg(test)]
    pub(super) fn with_other_noise(&self) -> Self {
        Self { seed: self.seed + SEEDS_APART / 2, ..*self }
    }

    /// Returns its scene, seen by a camera of this format.
    ///
    /// # Errors
    /// This does not fail for the slides of [`slides`].
    pub fn script(&self, format: Format) -> Result<SceneConfig, Error> {
        let (speed, degrees) = (self.speed_mm_s, self.heading.degrees());
        let text = format!("{}@{speed},{degrees}deg,seed={}", self.specimen, self.seed);
        let mut script = SceneConfig::parse_short(&text)?;
        if let Some(object) = self.object {
            script.touches = vec![Touch::Slide(object)];
        }
        script.sensor.size = FrameSize::new(SIDE, SIDE).map_err(|error| Error::config("scene", error))?;
        script.sensor.format = format.sensor();
        script.light.unit = self.unit;
        script.light.flash_ms *= gain(self.unit);
        script.light.rubbing_ms *= gain(self.unit);
        Ok(script)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sensor_has_all_specimens_and_a_spread_of_speeds() {
        let (all, objects): (Vec<_>, Vec<_>) = slides(SLIDES).into_iter().partition(|slide| slide.object.is_none());
        assert_eq!((all.len(), objects.len()), (800, 200));
        for sensor in 0..SENSORS {
            let own: Vec<_> = all.iter().filter(|slide| slide.sensor == sensor).collect();
            for specimen in Specimen::ALL {
                let mut speeds: Vec<_> =
                    own.iter().filter(|slide| slide.specimen == specimen).map(|slide| slide.speed_mm_s).collect();
                speeds.sort_unstable();
                speeds.dedup();
                assert_eq!(speeds.len(), 4, "sensor {sensor}, {specimen}");
            }
            assert!(own.iter().all(|slide| slide.heading == own[0].heading));
        }
        // The first ten slides of each sensor are those of a quick look, including their seeds.
        let quick = slides(QUICK_SLIDES);
        assert!(quick.iter().all(|slide| all.contains(slide) || objects.contains(slide)));
        let seeds: std::collections::HashSet<_> = all.iter().chain(&objects).map(|slide| slide.seed).collect();
        assert_eq!(seeds.len(), all.len() + objects.len());
        assert!(fresh_slides(MOST_SLIDES).iter().all(|slide| !seeds.contains(&slide.seed) && slide.unit >= FRESH_UNIT));
    }

    #[test]
    fn few_slides_are_of_all_specimens() {
        let few = slides(1);
        for specimen in Specimen::ALL {
            assert_eq!(few.iter().filter(|slide| slide.specimen == specimen).count(), 2, "{specimen}");
        }
    }

    #[test]
    fn the_most_slides_are_every_specimen_at_every_speed() {
        let own: Vec<_> =
            slides(MOST_SLIDES).into_iter().filter(|slide| slide.sensor == 3 && slide.object.is_none()).collect();
        for specimen in Specimen::ALL {
            let mut speeds: Vec<_> =
                own.iter().filter(|slide| slide.specimen == specimen).map(|slide| slide.speed_mm_s).collect();
            speeds.sort_unstable();
            assert_eq!(speeds, SPEEDS);
        }
    }

    #[test]
    fn gains_are_spread_around_one() {
        let gains: Vec<f64> = (FIRST_UNIT..FIRST_UNIT + SENSORS).map(gain).collect();
        let mean = gains.iter().sum::<f64>() / f64::from(SENSORS);
        assert!((mean - 1.0).abs() < 0.15, "{mean}");
        assert!(gains.iter().any(|gain| *gain < 0.9) && gains.iter().any(|gain| *gain > 1.1), "{gains:?}");
    }
}
