//! What a configuration means for the frames of one source: geometry, readout, law, pipeline, and notes for a person.

use std::borrow::Cow;

use wstac_core::features::FeatureScale;
use wstac_core::fixed::Q16;
use wstac_core::frame::Stride;
use wstac_core::green::any::Any;
use wstac_core::law::AnyLaw;
use wstac_core::layout::Layout;
use wstac_core::ln::any::AnyLn;
use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::trigger::{Rule, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime};
use wstac_core::touch::taxel_ring::ChosenTaxels;

use crate::config::{Config, Estimator, Kernel};
use crate::error::Error;
use crate::source::{RATE_OFF, StreamInfo};

/// Milliseconds by which a readout may be off that presses tell.
const READOUT_OFF: f32 = 1.5;

/// The pipeline of a host: format, log kernel, baseline policy and whether taxels are kept are chosen at run time.
pub type HostPipeline = Pipeline<Any, AnyLn, Option<TrackingBaseline>, ChosenTaxels>;

fn kernel(kernel: Kernel) -> AnyLn {
    match kernel {
        Kernel::Fixed => AnyLn::Fixed,
        Kernel::Libm => AnyLn::Libm,
        Kernel::Micromath => AnyLn::Micromath,
    }
}

impl Config {
    /// Returns the geometry of a stream's frames: pixel format, layout, stride and rate.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other.
    pub fn geometry(&self, info: &StreamInfo) -> Result<FrameGeometry<Any>, Error> {
        let in_table = |table| move |error| self.does_not_fit(&info.about, table, error);
        self.layout.check_frame(info.size).map_err(|error| self.does_not_fit(&info.about, "[layout]", error))?;
        let layout = self.layout(info.size).map_err(in_table("[layout]"))?;
        let green = Any::new(info.format, info.color, self.green.yuv);
        let geometry = FrameGeometry::with_stride(green, layout, info.rate, self.green.stride)
            .and_then(|geometry| geometry.with_bytes_per_row(info.bytes_per_row))
            .map_err(in_table("[layout], [green]"))?;
        if let Some(crop) = &info.crop
            && let Some(taxel) = crop.first_outside(geometry.layout())
        {
            let ([x, y], size) = (crop.at(), crop.size());
            let (width, height) = (size.width(), size.height());
            let message = format!(
                "taxel {taxel} lies outside of what was recorded: {width} x {height} pixels at ({x}, {y}); expected \
                 taxels inside, or a recording without --crop"
            );
            return Err(self.does_not_fit(&info.about, "[layout]", message));
        }
        Ok(geometry)
    }

    /// Returns the readout that holds for a source: the configuration's, else the source's own. `None` is unknown.
    pub fn readout(&self, info: &StreamInfo) -> Option<ReadoutTime> {
        self.sensor.readout.or(info.readout)
    }

    /// Returns a note for a person if nothing states where the taxels of a source are. In a scene they are where the
    /// publication has them, and of a recording it was said when it was made.
    pub fn layout_note(&self, info: &StreamInfo) -> Option<&'static str> {
        let is_known = self.layout.is_stated() || info.recorded.is_some() || info.is_simulated;
        (!is_known).then_some(
            "no [layout] is given, so taxels are where the sensor of the publication has them; help: run wstac \
             calibrate, and give its [layout]",
        )
    }

    /// Returns a note for a person about what an unknown readout does to the answers, or that the source states another
    /// one than the configuration.
    pub fn readout_note(&self, info: &StreamInfo) -> Option<&'static str> {
        if self.speed.law().is_some() {
            return None;
        }
        match [self.sensor.readout, info.readout].map(|time| time.map(ReadoutTime::ms)) {
            [None, None] => Some(
                "readout unknown: deviations allow for a rolling shutter, and fast slides are not reliable; \
                 state [sensor] readout_ms (0: global shutter)",
            ),
            [Some(own), Some(stated)] if (own - stated).abs() > READOUT_OFF => Some(
                "the source states another readout than [sensor] readout_ms or --readout, which holds; a wrong one gives \
                 wrong speeds",
            ),
            _ => None,
        }
    }

    /// Returns a note for a person if frames come at another rate than that at which the published law was fitted.
    pub fn rate_note(&self, info: &StreamInfo) -> Option<String> {
        let nominal = FrameRate::NOMINAL.per_second();
        let found = info.rate.per_second() / f64::from(info.rate.frames_added());
        let is_off = self.speed.law().is_some() && (found / nominal - 1.0).abs() > RATE_OFF;
        is_off.then(|| {
            format!(
                "features come {found:.2} times per second, and law = \"published\" counts frames at {nominal}: its \
                 durations are multiplied by {:.3}",
                nominal / found
            )
        })
    }

    /// Returns a note for a person if the law does not use the matrix of cross-talk that is stated.
    pub fn crosstalk_note(&self) -> Option<&'static str> {
        let is_unused = self.layout.correction().is_some() && self.speed.estimator() != Some(Estimator::Wave);
        is_unused.then_some("[layout] crosstalk corrects no speeds but those of estimator = \"wave\"")
    }

    /// Returns a note for a person if the trigger takes frames without a touch for lit.
    pub fn trigger_note(&self) -> Option<&'static str> {
        let is_lit = |trigger: TriggerConfig| trigger.rule() == Rule::Literal && trigger.multiplier() >= Q16::ONE;
        self.trigger().is_ok_and(is_lit).then_some(
            "[trigger] rule = \"literal\" with a multiplier of 1 or more takes dark frames for lit, so touches are lost; help: \
             rule = \"signed\", or a multiplier below 1",
        )
    }

    /// Returns a note for a person if two taxels are stated to be at one place.
    pub fn places_note(&self) -> Option<&'static str> {
        let (_, mut corners) = self.layout.explicit()?;
        corners.sort_unstable();
        (!corners.is_sorted_by(|a, b| a < b)).then_some(
            "[layout] corners has two taxels at one place, so answers are wrong; help: run wstac calibrate, and give its \
             [layout]",
        )
    }

    /// Returns the notes for a person about what the configuration itself has wrong, whatever the source is.
    pub fn doubts(&self) -> impl Iterator<Item = &'static str> {
        self.places_note().into_iter().chain(self.crosstalk_note()).chain(self.trigger_note())
    }

    /// Returns the notes for a person about what nothing states of a source, about its rate and the trigger, and about
    /// what is not used.
    pub fn notes(&self, info: &StreamInfo) -> impl Iterator<Item = Cow<'static, str>> {
        let stated = self.layout_note(info).into_iter().chain(self.readout_note(info)).chain(self.doubts());
        let notes = stated.map(Cow::Borrowed).chain(self.rate_note(info).map(Cow::Owned));
        notes.filter(|_| !info.is_board)
    }

    /// Returns the parameters of motion by arrival times for the frames of a source, whatever the law is.
    ///
    /// # Errors
    /// The readout is longer than a frame, or the errors of [`Config::layout`] and of [`MotionConfig::new`].
    pub fn motion_of(&self, info: &StreamInfo) -> Result<MotionConfig, Error> {
        let time = self.readout(info);
        // Rows are read within a frame; a rate may be a little off.
        let most = 1050.0 / info.rate.per_second();
        if let Some(ms) = time.map(ReadoutTime::ms).filter(|ms| f64::from(ms.abs()) > most) {
            let message = format!(
                "readout_ms is {ms}, as it or --readout states, expected at most {most:.1}: 1.05 times a frame's time"
            );
            return Err(self.does_not_fit(&info.about, "[sensor]", message));
        }
        let layout = self.layout(info.size).map_err(|error| self.does_not_fit(&info.about, "[layout]", error))?;
        let motion = MotionConfig::new(self.sensor.pitch_mm, info.rate);
        let motion = motion.map_err(|error| self.does_not_fit(&info.about, "[sensor]", error))?;
        Ok(motion.with_readout(Readout::of_layout(time, info.row_order, &layout, info.rate)))
    }

    /// Returns the law from an event to its answers for the frames of a source.
    ///
    /// # Errors
    /// The errors of [`Config::motion_of`] and [`Config::durations`].
    pub fn law_of(&self, info: &StreamInfo) -> Result<AnyLaw, Error> {
        let law = self.speed.in_force(self.motion_of(info)?, info.rate);
        law.map_err(|error| self.does_not_fit(&info.about, "[speed]", error))
    }

    /// Builds the pipeline of a stream.
    ///
    /// # Errors
    /// Layout, format and configuration do not fit each other.
    pub fn pipeline(&self, info: &StreamInfo) -> Result<HostPipeline, Error> {
        self.pipeline_at(info, 0)
    }

    /// Builds the pipeline of a stream. Its feature frames are counted from `first` on.
    pub(super) fn pipeline_at(&self, info: &StreamInfo, first: u64) -> Result<HostPipeline, Error> {
        let geometry = self.geometry(info)?;
        if info.taxels_only {
            self.check_sums(info, &geometry)?;
        }
        self.pipeline_from(geometry, &info.about, first)
    }

    /// Refuses another layout, stride or method than those that a stream's taxel sums were made with.
    fn check_sums(&self, info: &StreamInfo, geometry: &FrameGeometry<Any>) -> Result<(), Error> {
        let wrong = |expected: &str| Err(self.does_not_fit(&info.about, "[layout], [green]", expected));
        let Some(recorded) = &info.recorded else {
            let is_published = Ok(*geometry.layout()) == Layout::paper(info.size);
            if is_published && self.green.stride == Stride::One {
                return Ok(());
            }
            return wrong("taxel sums are of the paper's layout and every pixel; leave [layout] and stride out");
        };
        let own = Self::parse_recorded(&recorded.configuration).map_err(|error| error.about(&info.about))?;
        let is_same = own.geometry(info)?.layout() == geometry.layout()
            && own.green.stride == self.green.stride
            && (own.green.yuv == self.green.yuv || !info.format.is_ycbcr());
        if is_same {
            return Ok(());
        }
        wrong(
            "are not those of the recording, which has no pictures, only taxel sums: expected its own [layout], stride \
             and yuv, or a recording without --features-only",
        )
    }

    /// Builds the pipeline of frames of this geometry. `about` names their source in errors.
    ///
    /// # Errors
    /// `[features]` or `[trigger]` does not fit the geometry.
    pub fn pipeline_of(&self, geometry: FrameGeometry<Any>, about: &str) -> Result<HostPipeline, Error> {
        self.pipeline_from(geometry, about, 0)
    }

    /// Returns the scale of taxels in a sample.
    ///
    /// # Errors
    /// `[features]` does not fit the geometry.
    pub(crate) fn scale_of(&self, geometry: &FrameGeometry<Any>, about: &str) -> Result<FeatureScale, Error> {
        FeatureScale::of(geometry, self.features.floor_levels)
            .map_err(|error| self.does_not_fit(about, "[features]", error))
    }

    /// Builds the pipeline of frames of this geometry. Its feature frames are counted from `first` on.
    fn pipeline_from(&self, geometry: FrameGeometry<Any>, about: &str, first: u64) -> Result<HostPipeline, Error> {
        let in_table = |table| move |error| self.does_not_fit(about, table, error);
        let trigger = self.trigger().and_then(|trigger| Ok((trigger, self.following()?)));
        let (trigger, baseline) = trigger.map_err(in_table("[trigger]"))?;
        let pipeline = Pipeline::builder(geometry)
            .floor_levels(self.features.floor_levels)
            .ln(kernel(self.features.ln))
            .trigger(trigger)
            .baseline(baseline)
            .taxels()
            .starting_at(first)
            .build();
        let mut pipeline = pipeline.map_err(in_table("[features]"))?;
        pipeline.set_correction(self.layout.correction());
        Ok(pipeline)
    }
}
