//! A source read through the core: frames in, features and answers out.

mod answers;
mod record;

use wstac_core::baseline_policy::TrackingBaseline;
use wstac_core::frame::Stride;
use wstac_core::green::any::Any;
use wstac_core::layout::Layout;
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::params::TAXELS;
use wstac_core::speed::SpeedConfig;
use wstac_core::stream::{FeatureFrame, FeatureStream, Loss};
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_core::trigger::Trigger;

use self::answers::answers;
pub(crate) use self::answers::real;
pub use self::answers::units;
pub use self::record::{
    Completeness, DirectionRecord, EarlyTextureRecord, EndRecord, EventRecord, FaultRecord, IncompleteRecord, Record,
    SpeedRecord, Why,
};
use crate::config::{Config, Kernel};
use crate::error::Error;
use crate::source::{Fault, Source, SourceEvent, StreamInfo};
use crate::texture::Textures;

/// What of a stream is wanted beside its events.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted {
    /// A record of every frame's features.
    pub features: bool,
    /// The sample in every event.
    pub samples: bool,
}

/// [`FeatureStream`] with its kernel chosen at run time; a reading may go to another thread.
trait Stage: Send {
    fn push_taxels(&mut self, taxels: &[u32; TAXELS]) -> Option<FeatureFrame>;
    fn push_lost(&mut self, frames: u64) -> Loss;
}

impl<L: Ln + Send> Stage for FeatureStream<Any, L> {
    fn push_taxels(&mut self, taxels: &[u32; TAXELS]) -> Option<FeatureFrame> {
        Self::push_taxels(self, taxels)
    }

    fn push_lost(&mut self, frames: u64) -> Loss {
        Self::push_lost(self, frames)
    }
}

fn boxed<L: Ln + Send + 'static>(
    camera: FrameGeometry<Any>,
    floor_levels: f64,
) -> Result<Box<dyn Stage>, wstac_core::error::Error> {
    Ok(Box::new(FeatureStream::<_, L>::new(camera, floor_levels)?))
}

/// The stage with this kernel.
fn stage(camera: FrameGeometry<Any>, kernel: Kernel, floor: f64) -> Result<Box<dyn Stage>, wstac_core::error::Error> {
    match kernel {
        Kernel::Fixed => boxed::<Fixed>(camera, floor),
        Kernel::Libm => boxed::<Libm>(camera, floor),
        Kernel::Micromath => boxed::<Micromath>(camera, floor),
    }
}

/// What is said of a baseline that was not quiet.
pub const BASELINE_DISTURBED: &str =
    "the baseline was not quiet: events are marked as not reliable; start again with nothing touching";

/// The core, set up for one stream.
pub struct Reading<'m> {
    /// The camera's own sums, apart from what follows, so that they can be shown and recorded.
    accumulators: TaxelSums<Any>,
    /// Taxel sums of the last frame.
    taxels: Option<[u32; TAXELS]>,
    stage: Box<dyn Stage>,
    /// What the stage is made with.
    kernel: (Kernel, f64),
    textures: Textures<'m>,
    trigger: Trigger<Option<TrackingBaseline>>,
    /// How a new baseline would be followed: as the first was.
    following: Option<TrackingBaseline>,
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
        config.layout.check_frame(info.size).map_err(|error| config.does_not_fit(&info.about, "[layout]", error))?;
        let layout = config.layout(info.size).map_err(in_table("[layout]"))?;
        if info.taxels_only && (Ok(layout) != Layout::paper(info.size) || config.green.stride != Stride::One) {
            let expected = "taxel sums are of the paper's layout and every pixel, expected no other layout or stride";
            return Err(config.does_not_fit(&info.about, "[layout], [green]", expected));
        }
        let green = Any::new(info.format, info.color, config.green.yuv);
        let camera = FrameGeometry::with_stride(green, layout, info.rate, config.green.stride)
            .and_then(|camera| camera.with_bytes_per_row(info.bytes_per_row))
            .map_err(in_table("[layout], [green]"))?;
        let kernel = (config.features.ln, config.features.floor_levels);
        let accumulators = TaxelSums::new(camera);
        let (trigger, following) =
            config.trigger().and_then(|trigger| Ok((trigger, config.following()?))).map_err(in_table("[trigger]"))?;
        Ok(Self {
            accumulators,
            taxels: None,
            stage: stage(camera, kernel.0, kernel.1).map_err(in_table("[features]"))?,
            kernel,
            trigger: Trigger::with(trigger, 0, following),
            following,
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
    pub fn take<E>(
        &mut self,
        item: &SourceEvent<'_>,
        mut give: impl FnMut(Record) -> Result<(), E>,
    ) -> Result<bool, E> {
        match item {
            SourceEvent::Waiting => {}
            SourceEvent::Fault(Fault { kind, message }) => {
                let frame = self.trigger.next_frame();
                give(Record::Fault(FaultRecord { frame, fault: kind, message: message.clone() }))?;
            }
            SourceEvent::End => {
                self.finish(give)?;
                return Ok(false);
            }
            SourceEvent::Taxels(sums) => self.push_taxels(sums, &mut give)?,
            SourceEvent::Lost { frames, .. } => self.lose(*frames, &mut give)?,
            SourceEvent::Frame { bytes, .. } => match self.accumulators.push_frame(bytes) {
                Ok(sums) => self.push_taxels(&sums, &mut give)?,
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

    /// The 25 taxels of the last frame, row by row, each a share of full scale, 0 to 1; nothing before the first, or where
    /// the last was lost.
    pub fn taxels(&self) -> Option<[f32; TAXELS]> {
        let camera = self.camera();
        let full = camera.pixels() as f32 * camera.full_scale() as f32;
        self.taxels.map(|sums| sums.map(|sum| sum as f32 / full))
    }

    /// The camera as the core sees it: layout, pixels a taxel, full scale, rate.
    pub fn camera(&self) -> &FrameGeometry<Any> {
        self.accumulators.camera()
    }

    /// The trigger: its parameters, baseline and thresholds.
    pub fn trigger(&self) -> &Trigger<Option<TrackingBaseline>> {
        &self.trigger
    }

    /// Gathers a new baseline from the next frame on. The sample that was being captured, which ends here.
    pub fn rezero(&mut self) -> Option<IncompleteRecord> {
        let end = self.trigger.end();
        self.trigger = Trigger::with(*self.trigger.config(), end.frames, self.following);
        self.baseline_reported = false;
        end.incomplete.map(IncompleteRecord::from)
    }

    /// Reads the next camera frame as a stream's first: a new baseline, and no feature frame of which a part is there. What
    /// follows is what a recording of the frames from here on gives, apart from frames' numbers. The sample that was being
    /// captured, which ends here.
    ///
    /// # Errors
    /// None where this was set up: the same once more.
    pub fn restart(&mut self) -> Result<Option<IncompleteRecord>, Error> {
        let stage = stage(*self.camera(), self.kernel.0, self.kernel.1);
        self.stage = stage.map_err(|error| Error::new("[features]", error))?;
        Ok(self.rezero())
    }

    /// Whether the baseline has just turned out not to be quiet; said once.
    pub fn baseline_disturbed(&mut self) -> bool {
        if self.baseline_reported || self.trigger.baseline().is_none() {
            return false;
        }
        self.baseline_reported = true;
        !self.trigger.end().baseline_quiet
    }

    fn push_taxels<E>(
        &mut self,
        sums: &[u32; TAXELS],
        give: &mut impl FnMut(Record) -> Result<(), E>,
    ) -> Result<(), E> {
        self.taxels = Some(*sums);
        match self.stage.push_taxels(sums) {
            Some(frame) => self.push(frame, 0, give),
            None => Ok(()),
        }
    }

    fn lose<E>(&mut self, frames: u64, give: &mut impl FnMut(Record) -> Result<(), E>) -> Result<(), E> {
        self.dropped = self.dropped.saturating_add(frames);
        self.taxels = None;
        let loss = self.stage.push_lost(frames);
        if let Some(frame) = loss.has_missing_frames {
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
        let event = self.trigger.push_then_lose(frame.features, frame.has_missing_frames, lost_after);
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
        match source.next_event() {
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
