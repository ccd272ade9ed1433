//! What settings cost on this machine: the least time of several rounds, on one thread.

use std::hint::black_box;
use std::time::Instant;

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use wstac_core::green::any::Any;
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::model::file::INPUTS;
use wstac_core::speed::SpeedConfig;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::Camera;
use wstac_core::trigger::{Event, Trigger};
use wstac_core::{direction, speed};

use super::bank::camera;
use super::candidate::Candidate;
use super::knobs::{Format, Front};
use super::row::{Host, Row};
use super::slides::reference;
use crate::camera::mjpeg::Decoder;
use crate::config::{Config, Kernel};
use crate::error::Error;
use crate::scene::sensor::Sensor;
use crate::scene::{Scene, Script};

/// Frames of a round: those at the slide's middle.
const FRAMES: usize = 16;
/// Dark frames before them.
const BEFORE: usize = 50;
/// Rounds of frames, and of events.
const ROUNDS: usize = 7;
/// Answers of a round.
const ANSWERS: usize = 20;

/// Fills in the rows' times.
///
/// # Errors
/// Where the configuration does not fit the frames.
pub fn measure(rows: &mut [Row], models: &[Candidate], config: &Config) -> Result<(), Error> {
    let mut fronts: Vec<(Front, f64)> = Vec::new();
    let (bare, with) = events(models, config)?;
    for row in rows {
        let known = fronts.iter().find(|(front, _)| *front == row.front).map(|(_, frame_ns)| *frame_ns);
        let frame_ns = match known {
            Some(frame_ns) => frame_ns,
            None => frame(row.front, config)?,
        };
        if known.is_none() {
            fronts.push((row.front, frame_ns));
        }
        let place = models.iter().position(|model| Some(&model.name) == row.model.as_ref());
        let event_ns = bare + place.and_then(|place| with.get(place)).copied().unwrap_or(0.0);
        row.host = Some(Host { frame_ns, event_ns });
    }
    Ok(())
}

/// The least time of several rounds, each of `times` turns, in ns a turn.
fn least(times: usize, mut round: impl FnMut()) -> f64 {
    let one = |_| {
        let start = Instant::now();
        round();
        start.elapsed().as_nanos() as f64 / times.max(1) as f64
    };
    (0..ROUNDS).map(one).fold(f64::INFINITY, f64::min)
}

/// Of a frame: bytes to features and trigger; of MJPEG, the picture's decoding, too.
fn frame(front: Front, config: &Config) -> Result<f64, Error> {
    let script = reference(1.0, front.format)?;
    let sensor = Scene::camera(&script)?;
    let camera = camera(&sensor, front.format, front.stride, config)?;
    let frames = bright_frames(&script, sensor)?;
    match front.kernel {
        Kernel::Fixed => stream::<Fixed>(front.format, camera, &frames, config),
        Kernel::Libm => stream::<Libm>(front.format, camera, &frames, config),
        Kernel::Micromath => stream::<Micromath>(front.format, camera, &frames, config),
    }
}

fn stream<L: Ln>(format: Format, camera: Camera<Any>, frames: &[Vec<u8>], config: &Config) -> Result<f64, Error> {
    let size = camera.layout().frame();
    let unfit = |error| config.does_not_fit("simulated frames", "[features]", error);
    let mut stream = FeatureStream::<Any, L>::new(camera, config.features.floor_levels).map_err(unfit)?;
    let mut trigger = Trigger::new(config.trigger().map_err(unfit)?);
    let pictures: Vec<Vec<u8>> = match format {
        Format::Mjpeg => {
            frames.iter().map(|rgb| picture(rgb, size.width(), size.height())).collect::<Result<_, _>>()?
        }
        _ => Vec::new(),
    };
    let mut decoder = Decoder::new(size);
    let mut push = |bytes: &[u8]| {
        if let Ok(Some(frame)) = stream.push_frame(black_box(bytes)) {
            black_box(trigger.push(frame.features, frame.patched).is_some());
        }
    };
    Ok(least(frames.len(), || {
        if pictures.is_empty() {
            for frame in frames {
                push(frame);
            }
        }
        for picture in &pictures {
            if let Some(rgb) = decoder.decode(black_box(picture)) {
                push(rgb);
            }
        }
    }))
}

/// A frame as a camera's JPEG picture.
fn picture(rgb: &[u8], width: u16, height: u16) -> Result<Vec<u8>, Error> {
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, 85);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    encoder.encode(rgb, width, height, ColorType::Rgb).map_err(|error| Error::new("a JPEG picture", error))?;
    Ok(jpeg)
}

fn bright_frames(script: &Script, mut sensor: Sensor) -> Result<Vec<Vec<u8>>, Error> {
    let mut scene = Scene::new(script)?;
    let lights = std::iter::from_fn(|| scene.next_light());
    Ok(lights.skip(BEFORE).take(FRAMES).map(|(light, _)| sensor.expose(&light).to_vec()).collect())
}

/// Of speed and direction, and of each model's texture.
fn events(models: &[Candidate], config: &Config) -> Result<(f64, Vec<f64>), Error> {
    let script = reference(1.0, Format::Grey)?;
    let sensor = Scene::camera(&script)?;
    let unfit = |error| config.does_not_fit("simulated frames", "[trigger]", error);
    let camera = camera(&sensor, Format::Grey, Front::DEFAULT.stride, config)?;
    let speed = config.speed(camera.rate()).map_err(unfit)?;
    let mut stream = FeatureStream::<Any, Fixed>::new(camera, config.features.floor_levels).map_err(unfit)?;
    let mut trigger = Trigger::new(config.trigger().map_err(unfit)?);
    let (mut scene, mut sensor) = (Scene::new(&script)?, sensor);
    while let Some((light, _)) = scene.next_light() {
        let frame = stream.push_frame(sensor.expose(&light)).map_err(unfit)?;
        let event = frame.and_then(|frame| trigger.push(frame.features, frame.patched));
        if let Some(event) = event {
            return answers(&event, &speed, models);
        }
    }
    Err(Error::new("the reference slide", "no event with this configuration, expected one"))
}

fn answers(event: &Event<'_>, config: &SpeedConfig, models: &[Candidate]) -> Result<(f64, Vec<f64>), Error> {
    let bare = least(ANSWERS, || {
        for _ in 0..ANSWERS {
            black_box((
                speed::speed(black_box(event), config).is_ok(),
                direction::direction(black_box(event)).confidence,
            ));
        }
    });
    let sample: [i16; INPUTS] = event.sample.flat();
    let texture = |candidate: &Candidate| {
        let model = candidate.model()?;
        Ok(least(ANSWERS, || {
            for _ in 0..ANSWERS {
                black_box(model.classify(black_box(&sample)));
            }
        }))
    };
    Ok((bare, models.iter().map(texture).collect::<Result<_, Error>>()?))
}
