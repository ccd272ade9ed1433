//! The file of a sweep: it selects the slides of a data set.
//!
//! ```toml
//! specimens = ["Fla0", "Saw3"]  # default: the ten of the paper
//! speeds = [100, 110]           # mm/s; default [150]
//! directions = [0, 90]          # degrees, any; default [0]
//! slides = 100                  # of every specimen; default 100
//! seed = 1                      # of the first slide; default 1
//! [scene]                       # any other key and table of a scene's file; fidelity is "taxel" by default
//! noise = 2
//! ```

use std::path::Path;

use serde::Deserialize;
use toml::{Table, Value};
use wstac_core::rate::FrameRate;

use wstac_host::error::{Error, ErrorKind};
use wstac_scene::specimen::Specimen;
use wstac_scene::{SceneConfig, Slide, Touch};

/// Largest number of slides in a data set: the file stays below the 4 GiB that a plain zip archive can hold.
const MOST_SLIDES: u64 = 1_000_000;

/// A sweep's file before it is checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SweepFile {
    specimens: Vec<String>,
    speeds: Vec<f64>,
    directions: Vec<f64>,
    slides: i64,
    seed: i64,
    scene: Table,
}

impl Default for SweepFile {
    fn default() -> Self {
        Self {
            specimens: Specimen::ALL.iter().map(ToString::to_string).collect(),
            speeds: vec![150.0],
            directions: vec![0.0],
            slides: 100,
            seed: 1,
            scene: Table::new(),
        }
    }
}

/// Keys of a scene that the sweep itself sets, and their names in the sweep.
const SET_BY_THE_SWEEP: [(&str, &str); 5] = [
    ("specimen", "specimens = […] above it"),
    ("speed", "speeds = […] above it"),
    ("direction", "directions = […] above it"),
    ("seed", "seed above it"),
    ("slide", "slides above it"),
];

/// A checked sweep: scenes of one slide each, numbered from 0, specimen by specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// The first slide's scene; the others differ in the slide and the seed.
    base: SceneConfig,
    specimens: Vec<Specimen>,
    speeds_mm_s: Vec<f64>,
    directions_deg: Vec<f64>,
    /// Number of slides of every specimen.
    slides: u32,
}

/// Returns the text of a sweep's file.
///
/// # Errors
/// The file cannot be read, or is a folder: then it may be one of recordings.
pub(super) fn text(path: &Path) -> Result<String, Error> {
    if path.is_dir() {
        let message = "is a folder, expected the file of a sweep (.toml); help: the command wstac dataset makes a set of \
                       a folder of recordings";
        return Err(Error::new(ErrorKind::Usage, path.display(), message));
    }
    wstac_host::text_file::file_text(path)
}

impl Sweep {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// The file is not valid; the message names the file, the key, the value found and the values expected.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = text(path)?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Reads and checks a sweep's text; `subject` names its file.
    ///
    /// # Errors
    /// The text is not valid; the message names the key, the value found and the values expected.
    pub fn parse(subject: &str, text: &str) -> Result<Self, Error> {
        let wrong = |message: String| Error::new(ErrorKind::Config, subject, message);
        let file: SweepFile = wstac_host::text_file::from_toml(text).map_err(wrong)?;
        let slides = checked(&file).map_err(wrong)?;
        let mut scene = file.scene;
        scene.entry("fidelity").or_insert_with(|| "taxel".into());
        scene.insert("seed".into(), file.seed.into());
        let specimens: Vec<Value> = file.specimens.into_iter().map(Value::from).collect();
        let speeds: Vec<Value> = file.speeds.into_iter().map(Value::from).collect();
        let directions: Vec<Value> = file.directions.into_iter().map(Value::from).collect();
        let firsts = [("specimen", &specimens), ("speed", &speeds), ("direction", &directions)];
        for (key, values) in firsts {
            let expected =
                || Error::new(ErrorKind::Config, subject, format_args!("{key}s is empty, expected at least one {key}"));
            scene.insert(key.into(), values.first().ok_or_else(expected)?.clone());
        }
        // Each value of a list becomes one scene. So all values go through the one reader of scenes, with all its
        // checks.
        let base = SceneConfig::from_table(subject, scene.clone())?;
        let each = |key: &str, values: &[Value]| -> Result<Vec<Slide>, Error> {
            let slides = values.iter().zip(0..).map(|(value, index)| {
                let mut scene = scene.clone();
                scene.insert(key.into(), value.clone());
                // A scene of one slide has exactly one slide.
                let slide = |script: SceneConfig| script.touches.first().and_then(Touch::slide).copied();
                let script = SceneConfig::from_table(&format!("{subject}: {key}s[{index}]"), scene);
                script.map(slide).transpose()
            });
            slides.flatten().collect()
        };
        Ok(Self {
            specimens: each("specimen", &specimens)?.into_iter().map(|slide| slide.specimen).collect(),
            speeds_mm_s: each("speed", &speeds)?.into_iter().map(|slide| slide.speed_mm_s).collect(),
            directions_deg: each("direction", &directions)?.into_iter().map(|slide| slide.direction_deg).collect(),
            base,
            slides,
        })
    }

    /// Returns the specimens.
    pub fn specimens(&self) -> &[Specimen] {
        &self.specimens
    }

    /// Returns the directions, in degrees.
    pub fn directions_deg(&self) -> &[f64] {
        &self.directions_deg
    }

    /// Returns the frames per second of their camera.
    pub fn rate(&self) -> FrameRate {
        self.base.sensor.rate
    }

    /// Returns the number of slides.
    pub fn count(&self) -> u32 {
        // The product is at most MOST_SLIDES (checked).
        self.slides * self.specimens.len() as u32
    }

    /// Returns the slide of a number below [`count`](Self::count), and its seed.
    ///
    /// The k-th slide of a specimen takes speed k mod n and direction (k / n) mod m, so that all combinations occur.
    pub fn slide(&self, number: u32) -> (Slide, u64) {
        let (specimen, k) = ((number / self.slides) as usize, (number % self.slides) as usize);
        let (speeds, directions) = (self.speeds_mm_s.len(), self.directions_deg.len());
        let specimen = self.specimens[specimen % self.specimens.len()];
        let direction_deg = self.directions_deg[(k / speeds) % directions];
        let base = self.base.touches.first().and_then(Touch::slide);
        let slide = Slide::new(specimen, self.speeds_mm_s[k % speeds], direction_deg);
        let slide = base.map_or(slide, |base| {
            let Slide { specimen, speed_mm_s, direction_deg, profile, .. } = slide;
            Slide { specimen, speed_mm_s, direction_deg, profile, ..*base }
        });
        (slide, self.base.seed.wrapping_add(u64::from(number)))
    }

    /// Returns the scene of a slide; the number is that of [`slide`](Self::slide).
    pub fn script(&self, number: u32) -> SceneConfig {
        let (slide, seed) = self.slide(number);
        SceneConfig { touches: vec![Touch::Slide(slide)], seed, ..self.base.clone() }
    }
}

/// Checks the keys that no scene has, and returns the number of slides of every specimen.
fn checked(file: &SweepFile) -> Result<u32, String> {
    for (key, instead) in SET_BY_THE_SWEEP {
        if file.scene.contains_key(key) {
            return Err(format!("[scene] has {key}, expected {instead}"));
        }
    }
    let specimens = file.specimens.len().max(1) as u64;
    let slides = u64::try_from(file.slides).ok().filter(|slides| (1..=MOST_SLIDES / specimens).contains(slides));
    let slides = slides.and_then(|slides| u32::try_from(slides).ok());
    slides.ok_or_else(|| {
        let most = MOST_SLIDES / specimens;
        format!("slides is {}, expected 1 to {most}, {MOST_SLIDES} of all {specimens} specimens", file.slides)
    })
}
