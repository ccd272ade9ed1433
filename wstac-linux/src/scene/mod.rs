//! A sensor made of arithmetic (SPEC §8): a specimen bends whiskers, their bases glow, a camera looks on.
//!
//! Data flows one way: [`script`] says what there is, [`elastomer`] makes it light at 25 bases over time ([`surface`],
//! [`contact`], [`whisker`], [`light`]), [`sensor`] makes that the bytes of frames.

pub mod beam;
pub mod contact;
pub mod elastomer;
mod elliptic;
pub mod keys;
pub mod light;
pub mod rng;
pub mod script;
pub mod sensor;
pub mod specimen;
pub mod surface;
pub mod whisker;

use wstac_core::params::TAXELS;

use self::elastomer::Elastomer;
use self::rng::Rng;
pub use self::script::{Script, Slide};
use self::sensor::Sensor;
use crate::error::Error;

/// Purposes of random numbers: no two depend on each other, nor on those of the elastomer.
const PHASES: u64 = 1;
const NOISE: u64 = 3;

/// A slide and when it touches the first and last whiskers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// What slides, how fast and which way.
    pub slide: Slide,
    /// First touch, in frames from the scene's start; its fraction is random.
    pub start: f64,
    /// First touch in s.
    pub start_s: f64,
    /// Last touch in s.
    pub end_s: f64,
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
    elastomer: Elastomer,
    sensor: Sensor,
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
        let sensor =
            Sensor::new(script.size, Rng::new(script.seed, NOISE)).map_err(|error| Error::new("scene", error))?;
        let frame_s = f64::from(script.rate.denominator()) / f64::from(script.rate.numerator());
        let (truth, frames) = schedule(script, frame_s);
        Ok(Self { truth, elastomer: Elastomer::new(script), sensor, frame_s, frame: 0, frames })
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
        let light = self.next_light()?;
        self.sensor.expose(&light);
        Some(self.sensor.pixels())
    }

    /// Mean light of each taxel over the next frame's exposure, as a share of full scale; nothing after the last one.
    pub fn next_light(&mut self) -> Option<[f64; TAXELS]> {
        if self.frame >= self.frames {
            return None;
        }
        let from = self.frame as f64 * self.frame_s;
        self.frame += 1;
        let light = self.elastomer.expose(&self.truth, from, self.frame_s, self.frame_s);
        Some(light.map(|light| light / self.frame_s))
    }
}

/// When the slides happen, and how many frames the scene has.
fn schedule(script: &Script, frame_s: f64) -> (Vec<Truth>, u64) {
    let mut phases = Rng::new(script.seed, PHASES);
    let camera_frames = |dark: u32| f64::from(dark) * f64::from(script.rate.frames_added());
    let span_mm = script.whisker.span_mm();
    let mut free = camera_frames(script.lead_in);
    let truth = script.slides.iter().map(|&slide| {
        let start = free + phases.uniform();
        let lasts_s = (slide.specimen.length_mm + span_mm) / slide.speed_mm_s;
        free = libm::ceil(start + lasts_s / frame_s) + camera_frames(script.gap);
        Truth { slide, start, start_s: start * frame_s, end_s: start * frame_s + lasts_s }
    });
    let truth = truth.collect();
    (truth, free as u64)
}

#[cfg(test)]
mod tests;
