#![doc = include_str!("../README.md")]
//! ## Modules
//! Data flows one way (SPEC §8): a script describes the scene, whiskers bend and glow, and a camera turns the light
//! into frames.
//!
//! | module | content |
//! | --- | --- |
//! | [`script`] | the contents of a scene's file |
//! | [`touch`] | the touches: slides, presses, pokes and holds |
//! | [`specimen`] | the specimens that slide over the sensor |
//! | [`sensor`] | the camera: noise, pixels and formats |
//! | [`source`] | scenes as sources of `wstac-host` |
//! | [`measured`] | the keys of a scene that a real sensor's slides tell |
//! | [`skin`] | whiskers and their light, for a scene or a physics engine |
//! | [`effects`] | the modeled effects, and how to switch them off |
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
pub mod measured;
mod object;
pub mod rng;
mod rolling;
pub mod script;
pub mod sensor;
pub mod skin;
pub mod source;
pub mod specimen;
mod surface;
pub mod touch;
mod touch_table;
mod whisker;

use wstac_core::params::TAXELS;

pub use self::beam::Beam;
use self::elastomer::Elastomer;
pub use self::light::{Dead, LightConfig, Weak};
use self::rng::Rng;
use self::rolling::RollingShutter;
pub use self::script::SceneConfig;
use self::sensor::auto_exposure::{AutoExposure, Interval};
use self::sensor::{Fidelity, Sensor, SensorConfig};
pub use self::skin::{Skin, SkinCamera};
pub use self::touch::{Held, Press, PressKind, Rest, Slide, SpeedProfile, Touch, Twist};
pub use self::whisker::{Present, Whisker, WhiskerConfig};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::LossReason;

/// Purposes of random numbers: each has a stream that is independent of the others and of the elastomer's.
const PHASES: u64 = 1;
const NOISE: u64 = 3;
const DROPS: u64 = 6;
const LONG_NOISE: u64 = 7;

/// A touch, and when it reaches the first and leaves the last whiskers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The touch.
    pub touch: Touch,
    /// First touch, in frames from the scene's start; its fraction is random.
    pub start: f64,
    /// First touch in s.
    pub start_s: f64,
    /// Last touch in s.
    pub end_s: f64,
}

impl Truth {
    /// Returns the number of the frame that contains the first touch.
    pub fn start_frame(&self) -> u64 {
        self.start as u64
    }
}

/// The next step of a scene.
#[derive(Debug, PartialEq, Eq)]
pub enum SimulatedFrame<'a> {
    /// The bytes of a frame, as [`Sensor::expose`] returns them.
    Frame(&'a [u8]),
    /// The bytes of a frame, and the JPEG picture from which they were decoded.
    Jpeg(&'a [u8], &'a [u8]),
    /// The taxel sums of a frame, with [`Fidelity::Taxel`].
    Taxels([u32; TAXELS]),
    /// The number of frames that are missing here, and the reason.
    Lost(u32, LossReason),
}

/// A scene that is computed frame by frame.
#[derive(Clone, Debug)]
pub struct Scene {
    truth: Vec<Truth>,
    elastomer: Elastomer,
    sensor: Sensor,
    /// The camera with long exposures, if they differ by more than their light.
    long: Option<Sensor>,
    config: SensorConfig,
    fidelity: Fidelity,
    leak: f64,
    leak_per_minute: f64,
    auto_exposure: AutoExposure,
    /// `None` for a global shutter.
    rolling: Option<RollingShutter>,
    drops: Rng,
    /// Light of the next frame, if frames before it were lost.
    pending: Option<[f64; TAXELS]>,
    /// Length of a frame in s.
    frame_s: f64,
    /// The number of the next frame, and the number of frames.
    frame: u64,
    frames: u64,
}

impl Scene {
    /// Creates a scene at its start.
    ///
    /// # Errors
    /// [`Sensor::new`] fails, or a touch changes more often within a frame than can be computed in time.
    pub fn new(script: &SceneConfig) -> Result<Self, Error> {
        let config = sensor_config(script);
        let (long, nominal) = (f64::from(Interval::Long.frames()), Self::camera(script)?);
        // Longer exposures gather more leak; without a leak, one camera serves both.
        let is_long = config.auto_exposure && script.light.leak > 0.0;
        let long = is_long.then(|| camera(script, &config, long, LONG_NOISE)).transpose()?;
        let frame_s = f64::from(config.rate.denominator()) / f64::from(config.rate.numerator());
        check_work(script, &config, frame_s)?;
        let (truth, frames) = schedule(script, frame_s);
        let readout_s = config.readout_ms * 1e-3;
        let rolling = (readout_s != 0.0).then(|| RollingShutter::new(readout_s, frame_s, nominal.layout()));
        Ok(Self {
            truth,
            elastomer: Elastomer::new(Skin::new(script)),
            sensor: nominal,
            long,
            config,
            fidelity: script.fidelity,
            leak: script.light.leak * script.sensor.exposure,
            leak_per_minute: script.light.leak_per_minute,
            auto_exposure: AutoExposure::new(),
            rolling,
            drops: Rng::new(script.seed, DROPS),
            pending: None,
            frame_s,
            frame: 0,
            frames,
        })
    }

    /// Creates a script's camera in its state at the start of the scene, with the same noise to come.
    ///
    /// It takes the light of [`next_light`](Self::next_light). The light may come from a scene that differs only in the
    /// camera's format.
    ///
    /// # Errors
    /// [`Sensor::new`] fails.
    pub fn camera(script: &SceneConfig) -> Result<Sensor, Error> {
        camera(script, &sensor_config(script), 1.0, NOISE)
    }

    /// Returns the ground truth: the touches in the order of time.
    pub fn truth(&self) -> &[Truth] {
        &self.truth
    }

    /// Returns the number of frame intervals in the scene.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the number of frame intervals that have passed.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Returns the scene's camera.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Returns the next frame, or the frames that are missing; `None` after the last one.
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

    /// Returns each taxel's mean light over the next frame's exposure, and the number of frame intervals that the frame
    /// takes.
    ///
    /// The light is a fraction of full scale. Full scale is that of a shutter that is open for one whole interval.
    /// Returns `None` after the last frame.
    pub fn next_light(&mut self) -> Option<([f64; TAXELS], u32)> {
        if self.frame >= self.frames {
            return None;
        }
        let left = u32::try_from(self.frames - self.frame).unwrap_or(u32::MAX);
        let intervals = if self.config.auto_exposure { self.auto_exposure.interval().frames().min(left) } else { 1 };
        let (from, length) = (self.frame as f64 * self.frame_s, f64::from(intervals) * self.frame_s);
        self.frame += u64::from(intervals);
        let Self { elastomer, truth, .. } = self;
        let open = self.config.exposure * length;
        let light = match &mut self.rolling {
            None => elastomer.expose(truth, from, open, length),
            Some(rolling) => rolling.expose(from, open, |from, length| elastomer.expose(truth, from, length, length)),
        };
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

/// Most times that the shortest time scale of a touch fits into a camera frame.
///
/// The work for a frame grows with this number. At the limit, a frame takes about a tenth of a second.
const MOST_PER_FRAME: f64 = 10_000.0;

/// Refuses touches that change so often within a frame that a frame would take seconds.
fn check_work(script: &SceneConfig, config: &SensorConfig, frame_s: f64) -> Result<(), Error> {
    let longest_s = if config.auto_exposure { frame_s * f64::from(Interval::Long.frames()) } else { frame_s };
    for (number, touch) in (1..).zip(&script.touches) {
        let changes = longest_s / elastomer::fastest_s(&script.whisker, &script.light, touch);
        if changes > MOST_PER_FRAME {
            let message = format_args!(
                "touch {number} changes {changes:.0} times in a frame, expected at most {MOST_PER_FRAME}: raise fps of \
                 [sensor], relaxation_ms, afterglow_ms, fluctuation_mm or period, or lower the speed"
            );
            return Err(Error::new(ErrorKind::Config, "scene", message));
        }
    }
    Ok(())
}

/// Returns the camera's configuration with the scene's noise scale applied.
fn sensor_config(script: &SceneConfig) -> SensorConfig {
    SensorConfig { noise: script.sensor.noise * script.noise, ..script.sensor.clone() }
}

/// Creates a camera whose exposures last `intervals` frames.
///
/// It takes light that is already integrated, leaks included.
fn camera(script: &SceneConfig, config: &SensorConfig, intervals: f64, purpose: u64) -> Result<Sensor, Error> {
    let leak = script.light.leak * config.exposure * intervals;
    Sensor::new(config, script.fidelity, leak, Rng::new(script.seed, purpose))
}

/// Draws the times of the touches, and returns them with the number of frames in the scene.
fn schedule(script: &SceneConfig, frame_s: f64) -> (Vec<Truth>, u64) {
    let mut phases = Rng::new(script.seed, PHASES);
    let camera_frames = |dark: u32| f64::from(dark) * f64::from(script.sensor.rate.frames_added());
    let (mut first, mut free) = (0.0, camera_frames(script.lead_in));
    let truth = script.touches.iter().map(|&touch| {
        let beside = touch.after_s().map(|after_s| first + after_s / frame_s);
        let start = beside.unwrap_or_else(|| free + phases.uniform());
        first = if beside.is_some() { first } else { start };
        let lasts_s = touch.lasts_s(&script.whisker);
        free = free.max(libm::ceil(start + lasts_s / frame_s) + camera_frames(script.gap));
        Truth { touch, start, start_s: start * frame_s, end_s: start * frame_s + lasts_s }
    });
    let truth: Vec<_> = truth.collect();
    // The last touch's sample is completed, however short gaps are.
    let rest = script::DEFAULT_GAP.saturating_sub(script.gap);
    (truth, (free + camera_frames(rest)) as u64)
}

#[cfg(test)]
mod tests;
