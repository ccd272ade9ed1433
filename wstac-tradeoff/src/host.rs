//! The cost of settings on this machine: the shortest time of several rounds, on one thread.

use std::hint::black_box;
use std::time::Instant;

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use wstac_core::green::any::Any;
use wstac_core::law::{AnyLaw, EventLaw};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::paper::trigger::Event;
use wstac_core::pipeline::Pipeline;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, by_coherence};
use wstac_core::touch::path_sample::{PathSample, TaxelRing};

use super::candidate::Candidate;
use super::parameters::{AnswerLaw, Format, Setting};
use super::row::{Host, Row};
use super::slides::reference;
use super::streams::camera;
use wstac_host::camera::mjpeg::Decoder;
use wstac_host::config::{Config, Kernel};
use wstac_host::error::{Error, ErrorKind};
use wstac_scene::sensor::Sensor;
use wstac_scene::{Scene, SceneConfig};

/// Number of frames in a round: those at the slide's middle.
const FRAMES: usize = 4;
/// Number of dark frames before them.
const BEFORE: usize = 56;
/// Number of rounds of all settings, one after the other.
///
/// A busy moment of the machine then spoils one round of all settings, not all rounds of one setting.
const ROUNDS: usize = 60;
/// Number of answers in a round.
const ANSWERS: usize = 20;

/// A timed function: the number of turns in a round, and the round.
type Round<'a> = (usize, Box<dyn FnMut() + 'a>);

/// Fills in the rows' times.
///
/// # Errors
/// The configuration does not fit the frames.
pub fn measure(rows: &mut [Row], models: &[Candidate], config: &Config) -> Result<(), Error> {
    let mut settings: Vec<Setting> = Vec::new();
    // A law takes no part in a frame.
    let of_frame = |row: &Row| Setting { law: Setting::DEFAULT.law, ..row.setting };
    for row in rows.iter() {
        if !settings.contains(&of_frame(row)) {
            settings.push(of_frame(row));
        }
    }
    let frames = frames(&settings, config)?;
    let (laws, with) = events(models, config)?;
    for row in rows {
        let place = settings.iter().position(|setting| *setting == of_frame(row));
        let frame_ns = place.and_then(|place| frames.get(place)).copied().unwrap_or(f64::INFINITY);
        let place = models.iter().position(|model| Some(&model.name) == row.model.as_ref());
        let law = AnswerLaw::ALL.iter().position(|law| *law == row.setting.law);
        let bare = law.and_then(|law| laws.get(law)).copied().unwrap_or(f64::INFINITY);
        let event_ns = bare + place.and_then(|place| with.get(place)).copied().unwrap_or(0.0);
        row.host = Some(Host { frame_ns, event_ns });
    }
    Ok(())
}

/// Returns the shortest time of each over all rounds, in ns per turn.
fn least(mut all: Vec<Round<'_>>) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; all.len()];
    for _ in 0..ROUNDS {
        for (least, (turns, round)) in least.iter_mut().zip(&mut all) {
            // Run once untimed: otherwise settings that read the same frames find them in the cache, except for the
            // first setting.
            round();
            let start = Instant::now();
            round();
            *least = least.min(start.elapsed().as_nanos() as f64 / (*turns).max(1) as f64);
        }
    }
    least
}

/// Returns the time per frame of each setting: from bytes to features and trigger.
///
/// For MJPEG it includes the decoding of the picture.
fn frames(settings: &[Setting], config: &Config) -> Result<Vec<f64>, Error> {
    let shots = |format| Ok((format, shots(format)?));
    let shots = Format::ALL.into_iter().map(shots).collect::<Result<Vec<(Format, Vec<Vec<u8>>)>, Error>>()?;
    let mut all: Vec<Round> = Vec::new();
    for setting in settings {
        let sensor = Scene::camera(&reference(1.0, setting.format)?)?;
        let camera = camera(&sensor, setting.format, setting.stride, config)?;
        let frames = shots.iter().find(|(format, _)| *format == setting.format).map_or(&[][..], |(_, frames)| frames);
        all.push(match setting.kernel {
            Kernel::Fixed => stream(Fixed::<256>, setting.format, camera, frames, config),
            Kernel::Libm => stream(Libm, setting.format, camera, frames, config),
            Kernel::Micromath => stream(Micromath, setting.format, camera, frames, config),
        }?);
    }
    Ok(least(all))
}

fn stream<'a, L: Ln + 'a>(
    ln: L,
    format: Format,
    camera: FrameGeometry<Any>,
    frames: &'a [Vec<u8>],
    config: &Config,
) -> Result<Round<'a>, Error> {
    let mut decoder = (format == Format::Mjpeg).then(|| Decoder::new(camera.layout().frame()));
    let unfit = |error| config.does_not_fit("simulated frames", "[features], [trigger]", error);
    let mut pipeline = Pipeline::builder(camera)
        .floor_levels(config.features.floor_levels)
        .ln(ln)
        .trigger(config.trigger().map_err(unfit)?)
        .baseline(config.following().map_err(unfit)?)
        .build()
        .map_err(unfit)?;
    let round = move || {
        for frame in frames {
            let bytes = match &mut decoder {
                Some(decoder) => decoder.decode(black_box(frame)).unwrap_or_default(),
                None => frame,
            };
            if let Ok(update) = pipeline.push_frame(black_box(bytes)) {
                black_box(update.event().is_some());
            }
        }
    };
    Ok((frames.len(), Box::new(round)))
}

/// Returns the bytes that a camera of this format sends of the reference slide.
fn shots(format: Format) -> Result<Vec<Vec<u8>>, Error> {
    let script = reference(1.0, format)?;
    let sensor = Scene::camera(&script)?;
    let size = sensor.layout().frame();
    let frames = bright_frames(&script, sensor)?;
    if format != Format::Mjpeg {
        return Ok(frames);
    }
    frames.iter().map(|rgb| picture(rgb, size.width(), size.height())).collect()
}

/// Encodes a frame as a camera's JPEG picture.
fn picture(rgb: &[u8], width: u16, height: u16) -> Result<Vec<u8>, Error> {
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, 85);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    encoder
        .encode(rgb, width, height, ColorType::Rgb)
        .map_err(|error| Error::with_cause(ErrorKind::Unsupported, "a JPEG picture", error))?;
    Ok(jpeg)
}

fn bright_frames(script: &SceneConfig, mut sensor: Sensor) -> Result<Vec<Vec<u8>>, Error> {
    let mut scene = Scene::new(script)?;
    let lights = std::iter::from_fn(|| scene.next_light());
    Ok(lights.skip(BEFORE).take(FRAMES).map(|(light, _)| sensor.expose(&light).to_vec()).collect())
}

/// Returns the time of each law, and of each model's texture with the sample that it takes.
fn events(models: &[Candidate], config: &Config) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let script = reference(1.0, Format::Gray)?;
    let sensor = Scene::camera(&script)?;
    let unfit = |error| config.does_not_fit("simulated frames", "[trigger]", error);
    let camera = camera(&sensor, Format::Gray, Setting::DEFAULT.stride, config)?;
    let of_law = |law: AnswerLaw| Setting { law, ..Setting::DEFAULT }.configured(config).law(camera.rate());
    let laws = AnswerLaw::ALL.into_iter().map(of_law).collect::<Result<Vec<_>, _>>().map_err(unfit)?;
    let motion = config.motion(camera.rate()).map_err(unfit)?;
    let mut pipeline = Setting::DEFAULT.configured(config).pipeline_of(camera, "simulated frames")?;
    pipeline.keep_taxels();
    let (mut scene, mut sensor) = (Scene::new(&script)?, sensor);
    while let Some((light, _)) = scene.next_light() {
        let frame = sensor.expose(&light);
        let update = pipeline.push_frame(frame).map_err(|error| Error::frame("simulated frames", error))?;
        if let Some(event) = update.event() {
            return answers(&event, update.taxels(), &laws, motion, models);
        }
    }
    Err(Error::new(ErrorKind::Data, "the reference slide", "no event with this configuration, expected one"))
}

fn answers(
    event: &Event<'_>,
    taxels: Option<&TaxelRing>,
    laws: &[AnyLaw],
    motion: MotionConfig,
    models: &[Candidate],
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let velocity = by_coherence(event, motion).velocity;
    let velocity = velocity.ok_or_else(|| {
        Error::new(ErrorKind::Data, "the reference slide", "no velocity with this configuration, expected one")
    })?;
    let sample: [i16; INPUTS] = event.sample.flat();
    let mut all: Vec<Round> = Vec::new();
    for law in laws {
        let round = move || {
            for _ in 0..ANSWERS {
                black_box(law.answer(black_box(event)).speed.is_ok());
            }
        };
        all.push((ANSWERS, Box::new(round)));
    }
    for candidate in models {
        let (model, sample) = (candidate.model()?, &sample);
        let frames = candidate.about.frames;
        let texture = move || {
            for _ in 0..ANSWERS {
                let path = match model.input() {
                    Input::Frames => None,
                    Input::Path => PathSample::of_sums(black_box(event), &velocity, motion, frames),
                    _ => taxels.and_then(|taxels| PathSample::of_taxels(black_box(taxels), &velocity, motion, frames)),
                };
                let sample = path.as_ref().map_or(sample, PathSample::numbers);
                black_box(model.classify(black_box(sample)));
            }
        };
        all.push((ANSWERS, Box::new(texture)));
    }
    let mut laws_then_models = least(all);
    let with = laws_then_models.split_off(laws.len());
    Ok((laws_then_models, with))
}
