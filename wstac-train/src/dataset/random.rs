//! The file of a sweep of random slides, for samples along the path.
//!
//! ```toml
//! specimens = ["Fla0", "Saw3"]  # default: the ten of the paper
//! slides = 12000                # of all specimens together
//! speeds = [50, 300]            # mm/s, from and to; the logarithm is even
//! directions = [0, 360]         # degrees, from and to
//! lengths = [60, 120]           # mm, from and to
//! sensors = 500                 # number of different sensors
//! first_sensor = 0              # number of the first; another set of other sensors has another
//! seed = 1                      # by default the first sensor's number and one
//! test = 0.2                    # fraction of the sensors that is for tests
//! ```

use std::path::Path;

use serde::Deserialize;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::text_file::whole;
use wstac_scene::specimen::Specimen;

use super::path::RandomSlides;

/// Largest number of slides. Those of a part, or all without one, are in memory.
const MOST_SLIDES: i64 = 1_000_000;
const MOST_SENSORS: i64 = 100_000;
/// Largest number of the first sensor.
const MOST_FIRST: u32 = 1_000_000_000;

/// A sweep's file before it is checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RandomSlidesFile {
    specimens: Vec<String>,
    slides: i64,
    #[serde(deserialize_with = "whole")]
    speeds: [f64; 2],
    #[serde(deserialize_with = "whole")]
    directions: [f64; 2],
    #[serde(deserialize_with = "whole")]
    lengths: [f64; 2],
    sensors: i64,
    first_sensor: i64,
    seed: Option<u32>,
    test: f64,
}

impl Default for RandomSlidesFile {
    fn default() -> Self {
        let slides = RandomSlides::default();
        Self {
            specimens: slides.specimens.iter().map(ToString::to_string).collect(),
            slides: 12_000,
            speeds: slides.speeds_mm_s,
            directions: slides.directions_deg,
            lengths: slides.lengths_mm,
            sensors: 500,
            first_sensor: 0,
            seed: None,
            test: 0.2,
        }
    }
}

/// Random slides, split into some for training and some for tests by their sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomSweep {
    /// The slides.
    pub slides: RandomSlides,
    /// Number of the first sensor that is for tests.
    pub first_test_sensor: u32,
}

impl Default for RandomSweep {
    /// Returns the default: ten specimens at any speed, direction and length, on many sensors.
    fn default() -> Self {
        Self::checked(&RandomSlidesFile::default()).unwrap_or_else(|message| unreachable!("the defaults: {message}"))
    }
}

impl RandomSweep {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// The file is not valid; the message names the file, the key, the value found and the values expected.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = super::sweep::text(path)?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Reads and checks a sweep's text; `subject` names its file.
    ///
    /// # Errors
    /// The text is not valid; the message names the key, the value found and the values expected.
    pub fn parse(subject: &str, text: &str) -> Result<Self, Error> {
        let checked = wstac_host::text_file::from_toml(text).and_then(|file| Self::checked(&file));
        let wrong = |message| match text.parse::<toml::Table>() {
            Ok(table) if table.contains_key("scene") => {
                "[scene] is for --input frames; leave it out: this input has scenes of its own by chance".to_owned()
            }
            _ => message,
        };
        checked.map_err(|message| Error::new(ErrorKind::Config, subject, wrong(message)))
    }

    fn checked(file: &RandomSlidesFile) -> Result<Self, String> {
        let integer = |key: &str, value: i64, most: i64| {
            let good = u32::try_from(value).ok().filter(|_| (1..=most).contains(&value));
            good.ok_or_else(|| format!("{key} is {value}, expected 1 to {most}"))
        };
        let range = |key: &str, [from, to]: [f64; 2], [least, most]: [f64; 2], unit: &str| {
            let good = from >= least && to <= most && from <= to;
            let wrong = || format!("{key} is [{from}, {to}], expected from and to, within {least} to {most} {unit}");
            if good { Ok([from, to]) } else { Err(wrong()) }
        };
        let specimen = |name: &String| {
            let specimen = name.parse::<Specimen>();
            specimen.map_err(|error| format!("specimens has {name:?}: {error}"))
        };
        let specimens = file.specimens.iter().map(specimen).collect::<Result<Vec<_>, _>>()?;
        if specimens.is_empty() {
            return Err("specimens is empty, expected at least one specimen".into());
        }
        let sensors = integer("sensors", file.sensors, MOST_SENSORS)?;
        let first = u32::try_from(file.first_sensor).ok().filter(|first| *first <= MOST_FIRST);
        let first =
            first.ok_or_else(|| format!("first_sensor is {}, expected 0 to {MOST_FIRST}", file.first_sensor))?;
        if !(0.0..1.0).contains(&file.test) {
            return Err(format!("test is {}, expected a fraction: at least 0 and below 1", file.test));
        }
        // At least one sensor trains; at least one tests, if a test is wanted and there are two.
        let wanted = (file.test * f64::from(sensors)).round() as u32;
        let tests = if file.test > 0.0 { wanted.max(1) } else { 0 }.min(sensors - 1);
        let slides = RandomSlides {
            specimens,
            slides: integer("slides", file.slides, MOST_SLIDES)?,
            // Other sensors have other slides: a test of the same ones would tell nothing.
            seed: file.seed.map_or(u64::from(first) + 1, u64::from),
            speeds_mm_s: range("speeds", file.speeds, [10.0, 600.0], "mm/s")?,
            directions_deg: range("directions", file.directions, [-360.0, 360.0], "degrees")?,
            lengths_mm: range("lengths", file.lengths, [20.0, 200.0], "mm")?,
            sensors: [first, sensors],
            ..RandomSlides::default()
        };
        Ok(Self { slides, first_test_sensor: first + sensors - tests })
    }

    /// Returns whether the slides of a sensor are for tests.
    pub fn is_for_tests(&self, sensor: u32) -> bool {
        sensor >= self.first_test_sensor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_cover_what_models_promise() {
        let sweep = RandomSweep::parse("s", "").unwrap();
        assert_eq!(sweep, RandomSweep::default());
        assert_eq!((sweep.slides.speeds_mm_s, sweep.slides.directions_deg), ([50.0, 300.0], [0.0, 360.0]));
        assert_eq!((sweep.slides.lengths_mm, sweep.slides.specimens.len()), ([60.0, 120.0], 10));
        assert_eq!((sweep.slides.sensors, sweep.first_test_sensor), ([0, 500], 400));
        assert!(!sweep.is_for_tests(399) && sweep.is_for_tests(400));
    }

    #[test]
    fn keys_are_checked() {
        let error = |text: &str| RandomSweep::parse("s.toml", text).unwrap_err().to_string();
        assert_eq!(error("slides = 0"), "s.toml: slides is 0, expected 1 to 1000000");
        assert!(
            error("speeds = [100, 150, 200]")
                .contains("the list has 3 values, expected 2 (in: speeds = [100, 150, 200])")
                && error("speeds = [300, 50]")
                    .contains("speeds is [300, 50], expected from and to, within 10 to 600 mm/s")
        );
        assert!(error("lengths = [nan, 50]").contains("lengths is [NaN, 50]"));
        assert!(error("specimens = [\"Sew3\"]").contains("specimens has \"Sew3\""));
        assert!(error("specimens = []").contains("specimens is empty"));
        assert!(error("test = 1").contains("test is 1, expected a fraction"));
        assert!(error("[scene]\nnoise = 2").contains("[scene] is for --input frames"));
        assert!(error("sensors = 0").contains("sensors is 0"));
        assert!(error("fidelity = 1").contains("fidelity"));
    }

    #[test]
    fn sets_of_other_sensors_have_none_in_common() {
        let sensors = |text: &str| {
            let sweep = RandomSweep::parse("s", &format!("slides = 20\n{text}")).unwrap();
            let slides = sweep.slides.all().unwrap();
            (sweep.first_test_sensor, slides.iter().map(|slide| slide.sensor).collect::<Vec<_>>())
        };
        let (first_test, found) = sensors("sensors = 10\nfirst_sensor = 1000\nseed = 2");
        assert!(first_test == 1008 && found.iter().all(|sensor| (1000..1010).contains(sensor)), "{found:?}");
        let (first_test, found) = sensors("sensors = 10");
        assert!(first_test == 8 && found.iter().all(|sensor| (0..10).contains(sensor)), "{found:?}");
        // By default, they have none of the slides in common either.
        let seed = |text: &str| RandomSweep::parse("s", text).unwrap().slides.seed;
        let seeds = ["", "first_sensor = 1000", "first_sensor = 1000\nseed = 7"].map(seed);
        assert_eq!(seeds, [1, 1001, 7]);
        let error = RandomSweep::parse("s", "first_sensor = -1").unwrap_err().to_string();
        assert_eq!(error, "s: first_sensor is -1, expected 0 to 1000000000");
    }

    #[test]
    fn a_test_needs_two_sensors() {
        let first = |text: &str| RandomSweep::parse("s", text).unwrap().first_test_sensor;
        assert_eq!((first("sensors = 1"), first("sensors = 2"), first("sensors = 9\ntest = 0")), (1, 1, 9));
    }
}
