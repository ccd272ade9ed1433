//! Processes the frames of one camera with several settings at once. Pixels are summed once per stride, and the
//! logarithm kernels share the sums.

use wstac_core::frame::Stride;
use wstac_core::green::any::Any;
use wstac_core::law::{Answer, AnyLaw, EventLaw};
use wstac_core::model::Model;
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::paper::trigger::Event;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_core::touch::at_once::{AtOnce, answer};
use wstac_core::touch::motion::MotionConfig;
use wstac_core::touch::path_sample::PathSample;

use super::float64::{FeatureError, Float64};
use super::parameters::{Format, Setting};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::session::HostPipeline;
use wstac_host::source::{ReadoutTime, StreamInfo};
use wstac_scene::sensor::Sensor;

/// A slide's first event, or what is known of it at once.
#[derive(Clone, Debug)]
pub(super) struct FirstEvent {
    /// Number of the first frame of its sample.
    pub(super) frame: u64,
    /// Frames of the sample that have arrived.
    pub(super) frames: u8,
    /// Speed in mm/s, if there is one.
    pub(super) speed: Option<f32>,
    /// Direction in degrees, if it is clear.
    pub(super) degrees: Option<f32>,
    /// Whether the answers are reliable.
    pub(super) is_reliable: bool,
    /// The sample over time of a complete event.
    pub(super) sample: Option<Box<[i16; INPUTS]>>,
    /// The samples along the path, of ten sums if the event is complete, and of 25 taxels, if there is a velocity.
    path: [Option<Box<PathSample>>; 2],
}

impl FirstEvent {
    /// Returns the class of a model; `None` if the event has not the sample that it takes.
    pub(super) fn class(&self, model: &Model<'_>) -> Option<u8> {
        let [sums, taxels] = &self.path;
        let path = match model.input() {
            Input::Frames => return self.sample.as_ref().map(|sample| model.classify(sample)),
            Input::Path => sums,
            _ => taxels,
        };
        let path = path.as_ref().filter(|path| path.covers(model.frames()))?;
        Some(model.classify(path.numbers()))
    }
}

/// One setting that waits for its first event.
#[derive(Clone, Debug)]
pub(super) struct SettingStream {
    /// The position of the setting among all requested settings.
    pub(super) place: usize,
    /// The first event, once it is complete.
    pub(super) first: Option<FirstEvent>,
    /// Its answers at once, one for each wanted number of frames along the path.
    pub(super) early: Vec<(u8, FirstEvent)>,
    wanted: Vec<u8>,
    at_once: AtOnce,
    /// The deviation of its features from the reference, over all frames until then.
    pub(super) error: FeatureError,
    pipeline: HostPipeline,
    law: AnyLaw,
    motion: MotionConfig,
}

impl SettingStream {
    fn push(&mut self, taxels: &[u32; TAXELS], expected: &[f64; FEATURES], float64: &Float64) {
        if self.first.is_some() {
            return;
        }
        let update = self.pipeline.push_taxels(taxels);
        if let Some(frame) = update.frame() {
            self.error.add(&frame.features, expected, float64);
        }
        let early = update.touch().filter(|_| self.law.answers_at_once() && self.early.len() < self.wanted.len());
        let of = |touch| answer(&touch, &self.law, Some(&mut self.at_once), None, |answer| (touch, *answer));
        if let Some((touch, answer)) = early.and_then(of) {
            let found = first_event(&touch, &answer, &self.law, self.motion);
            for frames in &self.wanted {
                let is_new = self.early.iter().all(|(known, _)| known != frames);
                // A touch that has ended has no more path to wait for.
                let has_path = found.path[1].as_ref().is_some_and(|path| path.covers(*frames));
                if is_new && (*frames == 0 || has_path || !touch.is_under_way()) {
                    self.early.push((*frames, found.clone()));
                }
            }
        }
        self.first = update.event().map(|event| first_event(&event, &self.law.answer(&event), &self.law, self.motion));
    }
}

fn first_event(event: &Event<'_>, answer: &Answer, law: &AnyLaw, motion: MotionConfig) -> FirstEvent {
    // A model of fewer frames reads the first numbers of these samples.
    let whole = SAMPLE_FRAMES as u8;
    let path = law.path_velocity(event, answer.velocity()).map(|velocity| {
        let sums = event.is_event().then(|| PathSample::of_sums(event, &velocity, motion, whole));
        [sums.flatten(), PathSample::of_touch(event, &velocity, motion, whole)].map(|sample| sample.map(Box::new))
    });
    FirstEvent {
        frame: event.frame,
        frames: event.frames,
        speed: answer.speed.ok().map(|speed| speed.mm_s),
        degrees: answer.direction.degrees.ok(),
        is_reliable: answer.reliable,
        sample: event.is_event().then(|| Box::new(event.sample.flat())),
        path: path.unwrap_or_default(),
    }
}

/// The sums of one format and stride.
#[derive(Clone, Debug)]
struct StrideSums {
    accumulators: TaxelSums<Any>,
    streams: Vec<SettingStream>,
}

/// A camera, and all settings that read its frames.
pub(super) struct EvaluatedCamera {
    sensor: Sensor,
    format: Format,
    /// Sums of every pixel in the format's exact method, for the reference.
    whole: TaxelSums<Any>,
    float64: Float64,
    sums: Vec<StrideSums>,
}

impl EvaluatedCamera {
    /// Creates a simulated camera with a stream for each of `settings` that reads its format. `wanted` are numbers of
    /// frames along the path after which an answer at once counts: 0, and those of models of 25 taxels.
    ///
    /// # Errors
    /// The configuration does not fit the camera.
    pub(super) fn new(
        sensor: Sensor,
        format: Format,
        settings: &[Setting],
        wanted: &[u8],
        config: &Config,
    ) -> Result<Self, Error> {
        let own = |(_, setting): &(usize, &Setting)| setting.format.code() == format.code();
        let mut sums: Vec<(Format, Stride, StrideSums)> = Vec::new();
        let mut info = StreamInfo::new("simulated frames", sensor.layout().frame(), sensor.format(), sensor.rate());
        // A simulated camera has a global shutter.
        info.readout = Some(ReadoutTime::GLOBAL);
        for (place, setting) in settings.iter().enumerate().filter(own) {
            let known =
                sums.iter().position(|(format, stride, _)| (*format, *stride) == (setting.format, setting.stride));
            let at = known.unwrap_or(sums.len());
            if known.is_none() {
                let camera = camera(&sensor, setting.format, setting.stride, config)?;
                let own = StrideSums { accumulators: TaxelSums::new(camera), streams: Vec::new() };
                sums.push((setting.format, setting.stride, own));
            }
            let sums = &mut sums[at].2;
            sums.streams.push(stream(place, *setting, wanted, sums.accumulators.camera(), config, &info)?);
        }
        let whole = camera(&sensor, format, Stride::One, config)?;
        let (floor, threshold) = (config.features.floor_levels, config.speed.threshold);
        Ok(Self {
            float64: Float64::new(whole.pixels(), whole.full_scale(), floor, threshold),
            whole: TaxelSums::new(whole),
            sums: sums.into_iter().map(|(_, _, sums)| sums).collect(),
            format,
            sensor,
        })
    }

    /// Takes a frame of this light, and returns the 64-bit reference of this camera's own frame.
    ///
    /// `colored` is the 64-bit reference of the same shot in R, G, B, for formats that lost a part of it.
    pub(super) fn expose(
        &mut self,
        light: &[f64; TAXELS],
        colored: Option<&[f64; FEATURES]>,
    ) -> Result<[f64; FEATURES], wstac_core::error::FrameError> {
        let bytes = self.sensor.expose(light);
        let own = self.float64.features(&self.whole.push_frame(bytes)?);
        let expected = colored.filter(|_| self.format.is_colored()).unwrap_or(&own);
        for sums in &mut self.sums {
            let taxels = sums.accumulators.push_frame(bytes)?;
            for stream in &mut sums.streams {
                stream.push(&taxels, expected, &self.float64);
            }
        }
        Ok(own)
    }

    /// Returns `true` if all settings have an event.
    pub(super) fn is_done(&self) -> bool {
        self.sums.iter().flat_map(|sums| &sums.streams).all(|stream| stream.first.is_some())
    }

    /// Returns all settings, with their events.
    pub(super) fn into_streams(self) -> impl Iterator<Item = SettingStream> {
        self.sums.into_iter().flat_map(|sums| sums.streams)
    }
}

/// Returns the sums of a simulated camera's frames for one setting.
pub(super) fn camera(
    sensor: &Sensor,
    format: Format,
    stride: Stride,
    config: &Config,
) -> Result<FrameGeometry<Any>, Error> {
    let about = format_args!("frames of {}", format.name()).to_string();
    let frame = sensor.layout().frame();
    config.layout.check_frame(frame).map_err(|error| config.does_not_fit(&about, "[layout]", error))?;
    let layout = config.layout(frame);
    let layout = layout.map_err(|error| config.does_not_fit(&about, "[layout]", error))?;
    let green = Any::new(sensor.format(), sensor.color(), format.method());
    FrameGeometry::with_stride(green, layout, sensor.rate(), stride)
        .and_then(|camera| camera.with_bytes_per_row(sensor.bytes_per_row() as u32))
        .map_err(|error| config.does_not_fit(&about, "[layout], [green]", error))
}

fn stream(
    place: usize,
    setting: Setting,
    wanted: &[u8],
    geometry: &FrameGeometry<Any>,
    config: &Config,
    info: &StreamInfo,
) -> Result<SettingStream, Error> {
    let config = setting.configured(config);
    let mut pipeline = config.pipeline_of(*geometry, &info.about)?;
    let law = config.law_of(info)?;
    if law.takes_taxels() || (wanted.len() > 1 && setting.law.is_with(Input::TaxelPath)) {
        pipeline.keep_taxels();
    }
    let motion = config.motion_of(info)?;
    Ok(SettingStream {
        place,
        first: None,
        early: Vec::new(),
        wanted: wanted.to_vec(),
        at_once: AtOnce::new(motion),
        error: FeatureError::default(),
        pipeline,
        law,
        motion,
    })
}
