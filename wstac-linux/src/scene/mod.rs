//! A sensor made of arithmetic (SPEC §8): whiskers that a specimen bends, light, a camera.
//!
//! What is not modelled yet: the tip's own way while it is dragged, the tip's radius, blur,
//! formats other than grey.

pub mod beam;
mod elliptic;
pub mod light;
pub mod rng;
pub mod script;
pub mod sensor;
pub mod specimen;
pub mod whisker;

use wstac_core::params::TAXELS;

use self::light::{Light, Steps};
use self::rng::Rng;
pub use self::script::{Script, Slide};
use self::sensor::{Fidelity, Sensor, SensorConfig};
use self::specimen::LENGTH_MM;
use self::whisker::{BaseStrain, PITCH_MM, Whisker, whiskers};
use crate::error::Error;

/// How far the middle whisker's tip is overlapped by a specimen's crests, in mm (a guess).
const OVERLAP_MM: f64 = 3.0;
/// Deviation of the whiskers' gains (a guess).
const GAIN_DEVIATION: f64 = 0.05;
/// Longest step of time, in s: a slide at 200 mm/s moves a fifth of a millimetre, a period is 4 mm or more.
const LONGEST_STEP_S: f64 = 1e-3;

/// Purposes of random numbers: no two depend on each other.
const PHASES: u64 = 1;
const GAINS: u64 = 2;
const NOISE: u64 = 3;

/// A slide and when it touches the first whiskers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// What slides, how fast and which way.
    pub slide: Slide,
    /// First touch, in frames from the scene's start; its fraction is random.
    pub start: f64,
    /// Last touch, likewise.
    pub end: f64,
}

impl Truth {
    /// The frame that the first touch is in.
    pub fn start_frame(&self) -> u64 {
        self.start as u64
    }
}

/// A scene that is rendered frame by frame.
#[derive(Clone, Debug)]
pub struct Scene {
    truth: Vec<Truth>,
    /// Which of them is next or under way.
    current: usize,
    whiskers: [(Whisker, Light, f64); TAXELS],
    base_strain: BaseStrain,
    sensor: Sensor,
    steps: Steps,
    steps_per_frame: u32,
    /// Length of a frame in s.
    frame_s: f64,
    /// The frame that comes next, and how many there are.
    frame: u64,
    frames: u64,
}

impl Scene {
    /// A scene at its start.
    ///
    /// # Errors
    /// Where the frame is too small for the paper's layout.
    pub fn new(script: &Script) -> Result<Self, Error> {
        let config = SensorConfig { size: script.size, rate: script.rate, ..SensorConfig::default() };
        let sensor = Sensor::new(&config, Fidelity::Rendered, 0.0, Rng::new(script.seed, NOISE))?;
        let frame_s = f64::from(script.rate.denominator()) / f64::from(script.rate.numerator());
        // At most a million steps: a camera of a frame in a thousand seconds is as good as that.
        let steps_per_frame = libm::ceil(frame_s / LONGEST_STEP_S).clamp(1.0, 1e6) as u32;
        let (truth, frames) = schedule(script, frame_s);
        let mut gains = Rng::new(script.seed, GAINS);
        Ok(Self {
            truth,
            current: 0,
            whiskers: whiskers().map(|w| (w, Light::default(), 1.0 + GAIN_DEVIATION * gains.normal())),
            base_strain: BaseStrain::new(script.beam),
            sensor,
            steps: Steps::new(frame_s / f64::from(steps_per_frame)),
            steps_per_frame,
            frame_s,
            frame: 0,
            frames,
        })
    }

    /// What really happens: the slides in the order of time.
    pub fn truth(&self) -> &[Truth] {
        &self.truth
    }

    /// How many frames the scene has.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The next frame: grey, 8 bit, rows without padding; nothing after the last one.
    pub fn next_frame(&mut self) -> Option<&[u8]> {
        if self.frame >= self.frames {
            return None;
        }
        let brightness = self.brightness();
        self.frame += 1;
        Some(self.sensor.expose(&brightness))
    }

    /// Mean light of each taxel over the next frame's exposure, which lasts the whole frame.
    fn brightness(&mut self) -> [f64; TAXELS] {
        let start = self.frame as f64;
        while self.truth.get(self.current).is_some_and(|truth| truth.end < start) {
            self.current += 1;
        }
        let slide = self.truth.get(self.current).filter(|truth| truth.start <= start + 1.0);
        let mut exposure = [0.0; TAXELS];
        for (exposure, (whisker, light, gain)) in exposure.iter_mut().zip(&mut self.whiskers) {
            for step in 1..=self.steps_per_frame {
                let now = start + f64::from(step) / f64::from(self.steps_per_frame);
                let (strain, slid) = slide.map_or((0.0, 0.0), |truth| {
                    let seconds = (now - truth.start) * self.frame_s;
                    let slid = truth.slide.speed_mm_s * self.frame_s / f64::from(self.steps_per_frame);
                    (strain(&self.base_strain, whisker, &truth.slide, seconds), slid)
                });
                *exposure += light.step(self.steps, strain, slid);
            }
            *exposure *= *gain / self.frame_s;
        }
        exposure
    }
}

/// Strain at a whisker's base, `seconds` after the slide's first touch.
fn strain(base_strain: &BaseStrain, whisker: &Whisker, slide: &Slide, seconds: f64) -> f64 {
    // The block's leading end starts at the first whiskers.
    let passed = slide.speed_mm_s * seconds - (whisker.along(slide.heading) + span_mm() / 2.0);
    base_strain.at(OVERLAP_MM - whisker.lowered - slide.specimen.drop_mm(passed))
}

/// Distance of the first and last whiskers, in mm.
fn span_mm() -> f64 {
    PITCH_MM * (wstac_core::params::COLUMNS - 1) as f64
}

/// When the slides happen, and how many frames the scene has.
fn schedule(script: &Script, frame_s: f64) -> (Vec<Truth>, u64) {
    let mut phases = Rng::new(script.seed, PHASES);
    let camera_frames = |dark: u32| f64::from(dark) * f64::from(script.rate.frames_added());
    let mut free = camera_frames(script.lead_in);
    let truth = script.slides.iter().map(|&slide| {
        let start = free + phases.uniform();
        let end = start + (LENGTH_MM + span_mm()) / slide.speed_mm_s / frame_s;
        free = libm::ceil(end) + camera_frames(script.gap);
        Truth { slide, start, end }
    });
    let truth = truth.collect();
    (truth, free as u64)
}

#[cfg(test)]
mod tests;
