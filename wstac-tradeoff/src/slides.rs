//! The scene set: which slides the settings are judged by.
//!
//! None of them, nor any of their sensors, was there when a model was trained, chosen or judged: those were sensors
//! below 3000 and seeds below 100 000 000.

use wstac_core::direction::Heading;
use wstac_core::layout::FrameSize;

use super::parameters::Format;
use wstac_host::error::Error;
use wstac_scene::SceneConfig;
use wstac_scene::rng::Rng;
use wstac_scene::specimen::Specimen;

/// Sensors, each with whiskers of its own gains, mounted once: with a gain of its light and in one direction.
pub const SENSORS: u32 = 20;
/// The first of them.
pub const FIRST_UNIT: u32 = 3000;
/// The first of the sensors that a choice is run on besides, because it was made by what the others showed.
pub const FRESH_UNIT: u32 = 4000;
/// Seed of the first slide.
pub const FIRST_SEED: u64 = 100_000_000;
/// Seeds of a sensor's first slide and of the next sensor's.
const SEEDS_APART: u64 = 10_000;
/// Speeds in mm/s.
pub const SPEEDS: [u32; 11] = [50, 75, 100, 125, 150, 175, 200, 225, 250, 275, 300];
/// Steps from one speed of a sensor's specimen to its next: slow and fast ones take turns.
const SPEED_STEP: u32 = 3;
/// Slides of every sensor unless something else is asked for: four speeds of ten specimens.
pub const SLIDES: u32 = 40;
/// The same where a quick look is enough.
pub const QUICK_SLIDES: u32 = 10;
/// Most slides of a sensor: every specimen at every speed.
pub const MOST_SLIDES: u32 = 110;
/// Deviation of the light's gain from sensor to sensor, as a share, and what it is held within.
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
    /// The simulator's number of it.
    unit: u32,
    /// Number among the sensor's slides, from 0.
    pub number: u32,
    /// What slides.
    pub specimen: Specimen,
    /// How fast.
    pub speed_mm_s: u32,
    /// Which way.
    pub heading: Heading,
    seed: u64,
}

/// This many slides of every sensor, sensor by sensor: all specimens at one speed each, then at another.
pub fn slides(of_each: u32) -> Vec<TradeSlide> {
    from(FIRST_UNIT, of_each)
}

/// The same of sensors that nothing was chosen by.
pub fn fresh_slides(of_each: u32) -> Vec<TradeSlide> {
    from(FRESH_UNIT, of_each)
}

fn from(first: u32, of_each: u32) -> Vec<TradeSlide> {
    let of_sensor = |sensor| (0..of_each).map(move |number| slide(first, sensor, number));
    (0..SENSORS).flat_map(of_sensor).collect()
}

fn slide(first: u32, sensor: u32, number: u32) -> TradeSlide {
    let specimens = Specimen::ALL.len() as u32;
    // Where a sensor has few slides, others have the specimens that it lacks.
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
        seed: FIRST_SEED
            + SEEDS_APART * u64::from(first + sensor - FIRST_UNIT)
            + u64::from(turn * specimens + specimen),
    }
}

/// Gain of a sensor's light.
fn gain(unit: u32) -> f64 {
    let drawn = Rng::new(FIRST_SEED + u64::from(unit - FIRST_UNIT), GAIN).normal();
    (1.0 + GAIN_DEVIATION * drawn).clamp(GAINS.0, GAINS.1)
}

impl TradeSlide {
    /// The same slide over the same sensor with other noise.
    #[cfg(test)]
    pub(super) fn with_other_noise(&self) -> Self {
        Self { seed: self.seed + SEEDS_APART / 2, ..*self }
    }

    /// Its scene, `light` times as bright, seen by a camera of this format.
    ///
    /// # Errors
    /// None for the slides of [`slides`].
    pub fn script(&self, light: f64, format: Format) -> Result<SceneConfig, Error> {
        let (speed, degrees) = (self.speed_mm_s, self.heading.degrees());
        let mut script = scene(&format!("{}@{speed},{degrees}deg,seed={}", self.specimen, self.seed), format)?;
        script.light.unit = self.unit;
        brighten(&mut script, light * gain(self.unit));
        Ok(script)
    }
}

/// The slide that gray levels of peak light are measured on: without noise, over the sensor of the simulator's defaults.
///
/// # Errors
/// None.
pub fn reference(light: f64, format: Format) -> Result<SceneConfig, Error> {
    let mut script = scene("Saw3@150", format)?;
    script.noise = 0.0;
    brighten(&mut script, light);
    Ok(script)
}

fn scene(text: &str, format: Format) -> Result<SceneConfig, Error> {
    let mut script = SceneConfig::parse_short(text)?;
    script.sensor.size = FrameSize::new(SIDE, SIDE).map_err(|error| Error::new("scene", error))?;
    script.sensor.format = format.sensor();
    Ok(script)
}

fn brighten(script: &mut SceneConfig, gain: f64) {
    script.light.flash_ms *= gain;
    script.light.rubbing_ms *= gain;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sensor_has_all_specimens_and_a_spread_of_speeds() {
        let all = slides(SLIDES);
        assert_eq!(all.len(), 800);
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
        // The first ten of each are those of a quick look, seeds and all.
        let quick = slides(QUICK_SLIDES);
        assert!(quick.iter().all(|slide| all.contains(slide)));
        let seeds: std::collections::HashSet<_> = all.iter().map(|slide| slide.seed).collect();
        assert_eq!(seeds.len(), all.len());
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
        let own: Vec<_> = slides(MOST_SLIDES).into_iter().filter(|slide| slide.sensor == 3).collect();
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
