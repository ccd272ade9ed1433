#![doc = include_str!("../README.md")]
//! ## Modules
//! Data flows one way (SPEC §8): a script says what there is, whiskers bend and glow, and a camera makes frames of the light.
//!
//! | module | what it has |
//! | --- | --- |
//! | [`script`] | what a scene's file says |
//! | [`specimen`] | what slides over the sensor |
//! | [`sensor`] | the camera: noise, pixels and formats |
//! | [`source`] | scenes as sources of `wstac-host` |
//! | [`effects`] | what is modeled, and how to switch it off |
//! | [`along`] | the strain along one whisker |
//! | [`rng`] | random numbers that are the same on every machine |

pub mod along;
mod beam;
mod contact;
pub mod effects;
mod elastomer;
mod elliptic;
mod keys;
mod light;
pub mod rng;
pub mod script;
pub mod sensor;
pub mod source;
pub mod specimen;
mod surface;
mod whisker;

use wstac_core::params::TAXELS;

pub use self::beam::Beam;
use self::elastomer::Elastomer;
pub use self::light::{Dead, LightConfig};
use self::rng::Rng;
pub use self::script::{SceneConfig, Slide};
use self::sensor::auto_exposure::{AutoExposure, Interval};
use self::sensor::{Fidelity, Sensor, SensorConfig};
pub use self::whisker::{Present, WhiskerConfig};
use wstac_host::error::Error;
use wstac_host::source::LossReason;

/// Purposes of random numbers: no two depend on each other, nor on those of the elastomer.
const PHASES: u64 = 1;
const NOISE: u64 = 3;
const DROPS: u64 = 6;
const LONG_NOISE: u64 = 7;

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

/// What a scene gives next.
#[derive(Debug, PartialEq, Eq)]
pub enum SimulatedFrame<'a> {
    /// A frame's bytes, as [`Sensor::expose`] gives them.
    Frame(&'a [u8]),
    /// The same, and the JPEG picture that they were decoded from.
    Jpeg(&'a [u8], &'a [u8]),
    /// The taxel sums of a frame, with [`Fidelity::Taxel`].
    Taxels([u32; TAXELS]),
    /// Frames that are missing here; why, for a person.
    Lost(u32, LossReason),
}

/// A scene that is made frame by frame.
#[derive(Clone, Debug)]
pub struct Scene {
    truth: Vec<Truth>,
    elastomer: Elastomer,
    sensor: Sensor,
    /// The same camera in long exposures, where they differ by more than their light.
    long: Option<Sensor>,
    config: SensorConfig,
    fidelity: Fidelity,
    leak: f64,
    leak_per_minute: f64,
    auto_exposure: AutoExposure,
    drops: Rng,
    /// Light of a frame that comes next, after frames that were lost for it.
    pending: Option<[f64; TAXELS]>,
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
    /// As [`Sensor::new`].
    pub fn new(script: &SceneConfig) -> Result<Self, Error> {
        let config = sensor_config(script);
        let (long, nominal) = (f64::from(Interval::Long.frames()), Self::camera(script)?);
        // Longer exposures gather more leak: where there is none, one camera does.
        let is_long = config.auto_exposure && script.light.leak > 0.0;
        let long = is_long.then(|| camera(script, &config, long, LONG_NOISE)).transpose()?;
        let frame_s = f64::from(config.rate.denominator()) / f64::from(config.rate.numerator());
        let (truth, frames) = schedule(script, frame_s);
        Ok(Self {
            truth,
            elastomer: Elastomer::new(script),
            sensor: nominal,
            long,
            config,
            fidelity: script.fidelity,
            leak: script.light.leak * script.sensor.exposure,
            leak_per_minute: script.light.leak_per_minute,
            auto_exposure: AutoExposure::new(),
            drops: Rng::new(script.seed, DROPS),
            pending: None,
            frame_s,
            frame: 0,
            frames,
        })
    }

    /// A script's camera as it is when the scene starts, with the same noise to come. It takes the light of
    /// [`next_light`](Self::next_light), also that of a scene that differs in the camera's format alone.
    ///
    /// # Errors
    /// As [`Sensor::new`].
    pub fn camera(script: &SceneConfig) -> Result<Sensor, Error> {
        camera(script, &sensor_config(script), 1.0, NOISE)
    }

    /// What really happens: the slides in the order of time.
    pub fn truth(&self) -> &[Truth] {
        &self.truth
    }

    /// How many frame intervals the scene has.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// How many frame intervals have passed.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// The camera that looks on.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// The next frame, or frames that are missing; nothing after the last one.
    pub fn next_shot(&mut self) -> Option<SimulatedFrame<'_>> {
        if let Some(light) = self.pending.take() {
            return Some(self.shot(&light, true));
        }
        let (light, intervals) = self.next_light()?;
        if self.config.dropped > 0.0 && self.drops.uniform() < self.config.dropped {
            return Some(SimulatedFrame::Lost(intervals, LossReason::SimulatedDrop));
        }
        if intervals > 1 {
            self.pending = Some(light);
            return Some(SimulatedFrame::Lost(intervals - 1, LossReason::SimulatedExposure));
        }
        Some(self.shot(&light, false))
    }

    fn shot(&mut self, light: &[f64; TAXELS], long: bool) -> SimulatedFrame<'_> {
        let sensor = self.long.as_mut().filter(|_| long).unwrap_or(&mut self.sensor);
        match self.fidelity {
            Fidelity::Rendered => match sensor.expose_encoded(light) {
                (bytes, Some(jpeg)) => SimulatedFrame::Jpeg(bytes, jpeg),
                (bytes, None) => SimulatedFrame::Frame(bytes),
            },
            Fidelity::Taxel => SimulatedFrame::Taxels(sensor.sums(light)),
        }
    }

    /// Mean light of each taxel over the next frame's exposure, as a share of full scale, and how many frame intervals
    /// it takes; nothing after the last one. Full scale is that of a shutter open for one whole interval.
    pub fn next_light(&mut self) -> Option<([f64; TAXELS], u32)> {
        if self.frame >= self.frames {
            return None;
        }
        let left = u32::try_from(self.frames - self.frame).unwrap_or(u32::MAX);
        let intervals = if self.config.auto_exposure { self.auto_exposure.interval().frames().min(left) } else { 1 };
        let (from, length) = (self.frame as f64 * self.frame_s, f64::from(intervals) * self.frame_s);
        self.frame += u64::from(intervals);
        let light = self.elastomer.expose(&self.truth, from, self.config.exposure * length, length);
        let mut light = light.map(|light| light / self.frame_s);
        if self.leak_per_minute > 0.0 {
            let more = self.leak_per_minute * from / 60.0 * self.config.exposure * f64::from(intervals);
            light = light.map(|light| light + more);
        }
        if self.config.auto_exposure {
            let leak = self.leak * f64::from(intervals);
            let level = |light: &f64| (self.config.gain * (light + leak) + self.config.black_level / 255.0).min(1.0);
            self.auto_exposure.next(light.iter().map(level).sum::<f64>() / TAXELS as f64);
        }
        Some((light, intervals))
    }
}

/// The camera with the scale of all noise in its own.
fn sensor_config(script: &SceneConfig) -> SensorConfig {
    SensorConfig { noise: script.sensor.noise * script.noise, ..script.sensor.clone() }
}

/// A camera whose exposures last `intervals` frames. It takes light that is integrated already, leaks included.
fn camera(script: &SceneConfig, config: &SensorConfig, intervals: f64, purpose: u64) -> Result<Sensor, Error> {
    let leak = script.light.leak * config.exposure * intervals;
    Sensor::new(config, script.fidelity, leak, Rng::new(script.seed, purpose))
}

/// When the slides happen, and how many frames the scene has.
fn schedule(script: &SceneConfig, frame_s: f64) -> (Vec<Truth>, u64) {
    let mut phases = Rng::new(script.seed, PHASES);
    let camera_frames = |dark: u32| f64::from(dark) * f64::from(script.sensor.rate.frames_added());
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
