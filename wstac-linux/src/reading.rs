//! A source read through the core: frames in, features and answers out.

use serde::Serialize;
use wstac_core::direction::{Heading, Unclear};
use wstac_core::features::Features;
use wstac_core::frame::Stride;
use wstac_core::green::any::Any;
use wstac_core::layout::Layout;
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::speed::{NoSpeed, Speed, SpeedConfig};
use wstac_core::stream::{FeatureFrame, FeatureStream, Loss};
use wstac_core::taxels::Camera;
use wstac_core::trigger::{Event, Incomplete, Trigger};
use wstac_core::wire::Answers;

use crate::config::{Config, Kernel};
use crate::error::Error;
use crate::source::{Item, Source, StreamInfo};
use crate::texture::{TextureRecord, Textures};

/// One line of output: what `--json` prints, and what the text is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Record {
    /// The features of a frame.
    Features {
        /// Number of the feature frame.
        frame: u64,
        /// Natural logarithms, exact multiples of 1/2048.
        f: [f64; FEATURES],
    },
    /// A tactile event.
    Event(Box<EventRecord>),
    /// What a model that needs no more frames says of a sample that is still being captured.
    Texture(EarlyTextureRecord),
    /// A sample that a long gap interrupted.
    Incomplete(IncompleteRecord),
    /// How the stream ended.
    End(EndRecord),
}

/// An event and its answers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// Number of the first frame of the sample.
    pub frame: u64,
    /// Frames of the sample.
    pub frames: usize,
    /// Lit frames, last less first; nothing where no frame is lit.
    pub duration_frames: Option<u8>,
    /// Sliding speed.
    pub speed: Option<SpeedRecord>,
    /// What the speed law makes of the part of a cut-off event that was seen: the slide lasted longer, so it was slower.
    /// As good as the law is there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_at_most: Option<SpeedRecord>,
    /// Sliding direction.
    pub direction: DirectionRecord,
    /// Texture: what the models say, where there are any.
    pub texture: Option<TextureRecord>,
    /// Frames of the sample that were filled.
    pub frames_filled: u8,
    /// Baseline quiet, and at most a tenth of the sample filled.
    pub reliable: bool,
    /// Why an answer is missing.
    #[serde(skip_serializing_if = "Why::is_empty")]
    pub why: Why,
    /// The sample: ten features over 70 frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<Vec<Vec<f64>>>,
}

/// A texture before its event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EarlyTextureRecord {
    /// Number of the first frame of the sample: that of the event to come.
    pub frame: u64,
    /// Frames of the sample that were looked at.
    pub frames: u8,
    /// What the model says; the event will say the same.
    pub texture: TextureRecord,
}

/// A sliding speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedRecord {
    /// mm/s: one decimal, or four significant digits where that is finer.
    pub mm_s: f64,
    /// Outside the range that the law was fitted on.
    pub extrapolated: bool,
}

impl From<Speed> for SpeedRecord {
    fn from(speed: Speed) -> Self {
        Self { mm_s: rounded(speed.mm_s), extrapolated: speed.extrapolated }
    }
}

/// A sliding direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DirectionRecord {
    /// 0, 90, 180 or 270, counter-clockwise from +x; nothing where it is unclear.
    pub deg: Option<u16>,
    /// 0 to 1, to four decimals.
    pub confidence: f64,
}

/// Why an answer is missing, by answer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Why {
    /// Why there is no speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<&'static str>,
    /// Why there is no direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
    /// Why there is no texture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texture: Option<&'static str>,
}

impl Why {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A sample that ended before it was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct IncompleteRecord {
    /// Number of its first frame.
    pub frame: u64,
    /// Frames of it that had arrived.
    pub frames: u8,
}

impl From<Incomplete> for IncompleteRecord {
    fn from(sample: Incomplete) -> Self {
        Self { frame: sample.frame, frames: sample.frames }
    }
}

/// How a stream ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct EndRecord {
    /// Feature frames on the time line, lost ones included.
    pub frames: u64,
    /// Camera frames that were lost or unusable.
    pub dropped: u64,
    /// Whether the stream was long enough for the baseline.
    pub baseline: Completeness,
    /// The sample that was under way.
    pub incomplete: Option<IncompleteRecord>,
}

/// Whether something was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Completeness {
    /// It was.
    Complete,
    /// It was not.
    Incomplete,
}

/// What of a stream is wanted beside its events.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted {
    /// A record of every frame's features.
    pub features: bool,
    /// The sample in every event.
    pub samples: bool,
}

/// [`FeatureStream`] with its kernel chosen at run time.
trait Stage {
    fn push_frame(&mut self, bytes: &[u8]) -> Result<Option<FeatureFrame>, wstac_core::error::Error>;
    fn push_taxels(&mut self, taxels: &[u32; TAXELS]) -> Option<FeatureFrame>;
    fn push_lost(&mut self, frames: u64) -> Loss;
}

impl<L: Ln> Stage for FeatureStream<Any, L> {
    fn push_frame(&mut self, bytes: &[u8]) -> Result<Option<FeatureFrame>, wstac_core::error::Error> {
        Self::push_frame(self, bytes)
    }

    fn push_taxels(&mut self, taxels: &[u32; TAXELS]) -> Option<FeatureFrame> {
        Self::push_taxels(self, taxels)
    }

    fn push_lost(&mut self, frames: u64) -> Loss {
        Self::push_lost(self, frames)
    }
}

fn boxed<L: Ln + 'static>(camera: Camera<Any>, floor_levels: f64) -> Result<Box<dyn Stage>, wstac_core::error::Error> {
    Ok(Box::new(FeatureStream::<_, L>::new(camera, floor_levels)?))
}

/// What is said of a baseline that was not quiet.
pub(crate) const BASELINE_DISTURBED: &str =
    "the baseline was not quiet: events are marked as not reliable; start again with nothing touching";

/// The core, set up for one stream.
pub struct Reading<'m> {
    stage: Box<dyn Stage>,
    textures: Textures<'m>,
    trigger: Trigger,
    speed: SpeedConfig,
    wanted: Wanted,
    dropped: u64,
    baseline_reported: bool,
}

impl<'m> Reading<'m> {
    /// Sets the core up for frames as `info` describes them.
    ///
    /// # Errors
    /// Where layout, format and configuration do not fit each other.
    pub fn new(info: &StreamInfo, config: &Config, wanted: Wanted) -> Result<Self, Error> {
        let in_table = |table| move |error| config.does_not_fit(&info.about, table, error);
        let layout = config.layout(info.size).map_err(in_table("[layout]"))?;
        if info.taxels_only && (Ok(layout) != Layout::paper(info.size) || config.green.stride != Stride::One) {
            let expected = "taxel sums are of the paper's layout and every pixel, expected no other layout or stride";
            return Err(config.does_not_fit(&info.about, "[layout], [green]", expected));
        }
        let green = Any::new(info.format, info.colour, config.green.yuv);
        let camera = Camera::with_stride(green, layout, info.rate, config.green.stride)
            .and_then(|camera| camera.with_bytes_per_row(info.bytes_per_row))
            .map_err(in_table("[layout], [green]"))?;
        let floor = config.features.floor_levels;
        let stage: Result<Box<dyn Stage>, _> = match config.features.ln {
            Kernel::Fixed => boxed::<Fixed>(camera, floor),
            Kernel::Libm => boxed::<Libm>(camera, floor),
            Kernel::Micromath => boxed::<Micromath>(camera, floor),
        };
        Ok(Self {
            stage: stage.map_err(in_table("[features]"))?,
            trigger: Trigger::new(config.trigger().map_err(in_table("[trigger]"))?),
            speed: config.speed(info.rate).map_err(in_table("[speed]"))?,
            textures: Textures::default(),
            wanted,
            dropped: 0,
            baseline_reported: false,
        })
    }

    /// The same with texture models.
    #[must_use]
    pub fn with_textures(self, textures: Textures<'m>) -> Self {
        Self { textures, ..self }
    }

    /// Takes one item of the stream; `give` gets what follows from it. Whether the stream goes on.
    ///
    /// # Errors
    /// Those of `give`.
    pub fn take<E>(&mut self, item: &Item<'_>, mut give: impl FnMut(Record) -> Result<(), E>) -> Result<bool, E> {
        match item {
            Item::Waiting => {}
            Item::End => {
                self.finish(give)?;
                return Ok(false);
            }
            Item::Taxels(sums) => {
                if let Some(frame) = self.stage.push_taxels(sums) {
                    self.push(frame, 0, &mut give)?;
                }
            }
            Item::Lost { frames, .. } => self.lose(*frames, &mut give)?,
            Item::Frame { bytes, .. } => match self.stage.push_frame(bytes) {
                Ok(Some(frame)) => self.push(frame, 0, &mut give)?,
                Ok(None) => {}
                // Too few bytes: nothing of it was taken, but its time has passed.
                Err(_) => self.lose(1, &mut give)?,
            },
        }
        Ok(true)
    }

    /// Ends the stream: what was pending, then the end record.
    ///
    /// # Errors
    /// Those of `give`.
    pub fn finish<E>(&mut self, mut give: impl FnMut(Record) -> Result<(), E>) -> Result<(), E> {
        let event = self.trigger.finish();
        let event = event.map(|event| answers(&event, &self.speed, &self.textures, self.wanted.samples));
        if let Some(event) = event {
            give(Record::Event(Box::new(event)))?;
        }
        self.give_interrupted(&mut give)?;
        let end = self.trigger.end();
        give(Record::End(EndRecord {
            frames: end.frames,
            dropped: self.dropped,
            baseline: if end.baseline_complete { Completeness::Complete } else { Completeness::Incomplete },
            incomplete: end.incomplete.map(IncompleteRecord::from),
        }))
    }

    /// Whether the baseline has just turned out not to be quiet; said once.
    pub fn baseline_disturbed(&mut self) -> bool {
        if self.baseline_reported || self.trigger.baseline().is_none() {
            return false;
        }
        self.baseline_reported = true;
        !self.trigger.end().baseline_quiet
    }

    fn lose<E>(&mut self, frames: u64, give: &mut impl FnMut(Record) -> Result<(), E>) -> Result<(), E> {
        self.dropped = self.dropped.saturating_add(frames);
        let loss = self.stage.push_lost(frames);
        if let Some(frame) = loss.patched {
            return self.push(frame, loss.frames, give);
        }
        self.trigger.push_lost(loss.frames);
        Ok(())
    }

    fn push<E>(
        &mut self,
        frame: FeatureFrame,
        lost_after: u64,
        give: &mut impl FnMut(Record) -> Result<(), E>,
    ) -> Result<(), E> {
        if self.wanted.features {
            give(Record::Features { frame: self.trigger.next_frame(), f: frame.features.map(real) })?;
        }
        let event = self.trigger.push_then_lose(frame.features, frame.patched, lost_after);
        let event = event.map(|event| answers(&event, &self.speed, &self.textures, self.wanted.samples));
        self.give_interrupted(give)?;
        if let Some(event) = event {
            return give(Record::Event(Box::new(event)));
        }
        for (frame, frames, texture) in self.textures.of_beginning(&self.trigger) {
            give(Record::Texture(EarlyTextureRecord { frame, frames, texture }))?;
        }
        Ok(())
    }

    fn give_interrupted<E>(&mut self, give: &mut impl FnMut(Record) -> Result<(), E>) -> Result<(), E> {
        let Some(sample) = self.trigger.take_interrupted() else { return Ok(()) };
        give(Record::Incomplete(sample.into()))
    }
}

/// Reads a source to its end (or to its first error), and always ends with the end record.
///
/// # Errors
/// The source's, after the end record was given; those of `give`.
pub fn read_all<E: From<Error>>(
    source: &mut dyn Source,
    reading: &mut Reading<'_>,
    mut give: impl FnMut(Record) -> Result<(), E>,
) -> Result<(), E> {
    loop {
        match source.next() {
            Ok(item) => {
                if !reading.take(&item, &mut give)? {
                    return Ok(());
                }
            }
            Err(error) => {
                reading.finish(&mut give)?;
                return Err(error.into());
            }
        }
    }
}

impl EventRecord {
    /// What is said of an event, by a source read here as by a board far away; `sample` where it is wanted.
    pub(crate) fn new(
        answers: &Answers<'_>,
        texture: Option<TextureRecord>,
        sample: Option<&[Features; SAMPLE_FRAMES]>,
    ) -> Self {
        let mut why = Why { texture: texture.is_none().then_some("no model was given"), ..Why::default() };
        let mut speed_at_most = None;
        let speed = match answers.speed {
            Ok(speed) => Some(speed.into()),
            Err(reason) => {
                if let NoSpeed::CutOff { at_most: Some(mm_s) } = reason {
                    speed_at_most = Some(Speed::new(mm_s).into());
                }
                why.speed = Some(no_speed(reason));
                None
            }
        };
        let direction = answers.direction;
        why.direction = direction.heading.err().map(|unclear| match unclear {
            Unclear::NeverLit => "unclear: a row and a column never light up",
            Unclear::NoOrder => "unclear: neither rows nor columns light up in order",
        });
        let over_time = |feature: usize| move |frame: &Features| real(frame[feature]);
        Self {
            frame: answers.frame,
            frames: SAMPLE_FRAMES,
            duration_frames: answers.duration,
            speed,
            speed_at_most,
            direction: DirectionRecord {
                deg: direction.heading.ok().map(Heading::degrees),
                confidence: (f64::from(direction.confidence()) * 1e4).round() / 1e4,
            },
            texture,
            frames_filled: answers.frames_filled,
            reliable: answers.reliable,
            why,
            sample: sample
                .map(|sample| (0..FEATURES).map(|feature| sample.iter().map(over_time(feature)).collect()).collect()),
        }
    }
}

/// An event's answers.
fn answers(event: &Event<'_>, config: &SpeedConfig, textures: &Textures, with_sample: bool) -> EventRecord {
    let flat = event.sample.flat();
    let sample = flat.as_chunks().0.as_array().filter(|_| with_sample);
    EventRecord::new(&Answers::new(event, config), textures.of_sample(&flat), sample)
}

fn no_speed(reason: NoSpeed) -> &'static str {
    match reason {
        NoSpeed::BaselineAbove => "the baseline is above the speed threshold",
        NoSpeed::NeverValid => "no frame is above the speed threshold",
        NoSpeed::CutOff { .. } => "cut off: the sample starts or ends above the speed threshold",
        NoSpeed::OutsideLaw => "the speed law has no finite speed for this duration",
    }
}

/// A feature as a real number.
pub(crate) fn real(feature: i16) -> f64 {
    f64::from(feature) / f64::from(FEATURE_ONE)
}

/// A speed for output: one decimal, or four significant digits where that is finer.
fn rounded(mm_s: f32) -> f64 {
    let tenths = (f64::from(mm_s) * 10.0).round() / 10.0;
    if tenths >= 100.0 { tenths } else { format!("{mm_s:.3e}").parse().unwrap_or(tenths) }
}
