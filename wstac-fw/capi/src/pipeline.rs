//! A pipeline in the caller's memory, which takes frames or stripes.

use wstac_core::error::FrameError;
use wstac_core::features::Features;
use wstac_core::frame::Stride;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::speed::SpeedConfig;
use wstac_core::paper::trigger::{ContactEnd, Event, InterruptedSample, TriggerConfig};
use wstac_core::params::{PITCH_MM, TAXELS};
use wstac_core::pipeline::{Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder};

use crate::format::{Chosen, WstacFwFormat};
use crate::memory::{Memory, borrowed, bytes, fits, set_up, value_mut};
use crate::status::{WstacFwBool, WstacFwStatus, choice, status};

/// Bytes of a pipeline.
pub const WSTAC_FW_PIPELINE_SIZE: usize = 2528;
/// The alignment of a pipeline in memory, in bytes.
pub const WSTAC_FW_PIPELINE_ALIGN: usize = 8;

/// A pipeline, in memory that the program provides: `static WstacFwPipeline pipeline;`.
///
/// wstac_fw_init sets it up. A copied or moved pipeline is another one in the same state. Nothing has to be freed.
#[repr(C)]
pub struct WstacFwPipeline {
    /// The library's own.
    opaque: [u64; 316],
}

const _: () = assert!(size_of::<WstacFwPipeline>() == WSTAC_FW_PIPELINE_SIZE);
const _: () = assert!(align_of::<WstacFwPipeline>() == WSTAC_FW_PIPELINE_ALIGN);
// On a 64-bit machine, where tests run, pointers are larger.
const _: () = assert!(fits::<WstacFwPipeline, PipelineState>(if cfg!(target_pointer_width = "32") { 24 } else { 0 }));

// SAFETY: it consists of numbers, as large and aligned as asserted above.
unsafe impl Memory for WstacFwPipeline {
    type Value = PipelineState;
    const MARK: u32 = u32::from_le_bytes(*b"WSpl");
}

/// The state of a pipeline.
pub(crate) struct PipelineState {
    pub(crate) pipeline: Pipeline<Chosen, Fixed, Option<TrackingBaseline>>,
    /// The law of durations.
    pub(crate) speed: SpeedConfig,
    /// The parameters of arrival times.
    pub(crate) motion: MotionConfig,
    /// The number and the features of the feature frame that the last call completed.
    pub(crate) features: Option<(u64, Features)>,
    /// The event that the last call completed, whose sample the pipeline still holds.
    seen: Option<Seen>,
    /// The sample that a long gap has interrupted, until a program asks for it.
    pub(crate) interrupted: Option<InterruptedSample>,
    /// The end of an event's touch, until a program asks for it.
    pub(crate) contact_end: Option<ContactEnd>,
    phase: Phase,
}

/// The phase of a stream.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    SetUp,
    Started,
    Ended,
}

/// The part of an event that the pipeline does not keep.
#[derive(Clone, Copy)]
struct Seen {
    frame: u64,
    frames_filled: u8,
    reliable: bool,
    touch_frame: Option<u64>,
    end_frame: Option<u64>,
}

impl From<Event<'_>> for Seen {
    fn from(event: Event<'_>) -> Self {
        let Event { frame, frames_filled, reliable, touch_frame, end_frame, .. } = event;
        Self { frame, frames_filled, reliable, touch_frame, end_frame }
    }
}

impl PipelineState {
    fn new(options: &WstacFwOptions, format: &'static WstacFwFormat) -> Result<Self, WstacFwStatus> {
        let size = FrameSize::new(options.width, options.height)?;
        let layout = if options.corners.is_null() {
            Layout::paper(size)?
        } else {
            // SAFETY: the caller guarantees 25 corners.
            let corners = unsafe { borrowed(options.corners.cast::<[WstacFwCorner; TAXELS]>()) }?;
            Layout::new(size, options.taxel, corners.each_ref().map(|corner| [corner.left, corner.top]))?
        };
        let rate = match (options.fps_numerator, options.fps_denominator) {
            (0, 0) => FrameRate::NOMINAL,
            (numerator, denominator) => FrameRate::new(numerator, denominator)?,
        };
        let color = YcbcrEncoding {
            matrix: if choice(options.bt709)? { YcbcrMatrix::Bt709 } else { YcbcrMatrix::Bt601 },
            range: if choice(options.full_range)? { QuantizationRange::Full } else { QuantizationRange::Limited },
        };
        let stride = Stride::try_from(options.stride.max(1))?;
        let mut camera = FrameGeometry::with_stride(Chosen { format, color }, layout, rate, stride)?;
        if options.bytes_per_row != 0 {
            camera = camera.with_bytes_per_row(options.bytes_per_row)?;
        }
        let pitch = if options.pitch_mm == 0.0 { PITCH_MM } else { options.pitch_mm };
        let stated = choice(options.readout_known)?.then_some(options.readout_ms);
        let readout = Readout::of_layout(stated.and_then(ReadoutTime::from_ms), RowOrder::Down, &layout, rate);
        let trigger = TriggerConfig::default().one_event_per_touch();
        let builder = Pipeline::builder(camera).floor(format.floor).trigger(trigger).baseline(None);
        // All that can fail comes first, so that the pipeline is built in its place.
        let (builder, motion) = (builder.check()?, MotionConfig::new(pitch, rate)?.with_readout(readout));
        Ok(Self {
            pipeline: builder.build(),
            speed: SpeedConfig::published(rate),
            motion,
            features: None,
            seen: None,
            interrupted: None,
            contact_end: None,
            phase: Phase::SetUp,
        })
    }

    /// Returns whether parameters can still be changed.
    pub(crate) fn is_fresh(&self) -> bool {
        self.phase == Phase::SetUp
    }

    /// Returns the event that the last call completed.
    pub(crate) fn event(&self) -> Option<Event<'_>> {
        let Seen { frame, frames_filled, reliable, touch_frame, end_frame } = self.seen?;
        let (_, sample) = self.pipeline.recent();
        let mut event = Event::new(frame, sample, self.pipeline.baseline()?);
        (event.frames_filled, event.reliable) = (frames_filled, reliable);
        (event.touch_frame, event.end_frame) = (touch_frame, end_frame);
        Some(event)
    }

    /// Pushes frames or losses if the stream has not ended. From then on it has started.
    fn push(
        &mut self,
        push: impl FnOnce(&mut Pipeline<Chosen, Fixed, Option<TrackingBaseline>>) -> Result<Update<'_>, FrameError>,
    ) -> Result<WstacFwStatus, WstacFwStatus> {
        if self.phase == Phase::Ended {
            return Err(WstacFwStatus::State);
        }
        let update = push(&mut self.pipeline)?;
        self.phase = Phase::Started;
        self.features = update.frame().map(|frame| (frame.number, frame.features));
        self.seen = update.event().map(Seen::from);
        self.interrupted = update.interrupted().or(self.interrupted);
        self.contact_end = update.contact_end().or(self.contact_end);
        Ok(if self.seen.is_some() { WstacFwStatus::Event } else { WstacFwStatus::Ok })
    }

    fn finish(&mut self) -> Result<WstacFwStatus, WstacFwStatus> {
        if self.phase == Phase::Ended {
            return Err(WstacFwStatus::State);
        }
        self.phase = Phase::Ended;
        self.features = None;
        let finished = self.pipeline.finish();
        self.seen = finished.event().map(Seen::from);
        self.interrupted = finished.interrupted().or(self.interrupted);
        self.contact_end = finished.contact_end().or(self.contact_end);
        Ok(if self.seen.is_some() { WstacFwStatus::Event } else { WstacFwStatus::Ok })
    }
}

/// A taxel's corner in a frame, in pixels.
#[repr(C)]
pub struct WstacFwCorner {
    /// The first column.
    pub left: u16,
    /// The first row.
    pub top: u16,
}

/// The description of a camera's frames. Zeros in all fields except format, width and height are the defaults.
#[repr(C)]
pub struct WstacFwOptions {
    /// The pixel format, such as &WSTAC_FW_GREY.
    pub format: *const WstacFwFormat,
    /// The number of pixels of a row, 1 to 16384.
    pub width: u32,
    /// The number of rows of a frame, 1 to 16384.
    pub height: u32,
    /// The number of bytes from row to row; 0 for rows without padding.
    pub bytes_per_row: u32,
    /// The numerator of the frames per second. If it and the denominator are 0, the rate is 30 per second. Above 45 per
    /// second, frames are added up to about 30.
    pub fps_numerator: u32,
    /// The denominator of the frames per second.
    pub fps_denominator: u32,
    /// The stride: one of so many pixels of a taxel is counted, in both directions. It is 1, 2, 3 or 5; 0 means 1.
    pub stride: u32,
    /// Whether Y Cb Cr are of ITU-R BT.709 instead of BT.601.
    pub bt709: WstacFwBool,
    /// Whether Y Cb Cr are of full range instead of limited.
    pub full_range: WstacFwBool,
    /// The width and height of every taxel in pixels. They count only with corners.
    pub taxel: [u16; 2],
    /// The corners of 25 taxels, row by row; null for the paper's layout in the centered largest square.
    pub corners: *const WstacFwCorner,
    /// The distance between neighboring whiskers in mm: `[sensor] pitch_mm`, above 0 and at most 1000; 0 means 4.
    pub pitch_mm: f32,
    /// Whether `readout_ms` is known. Otherwise standard deviations cover a rolling shutter, and fast slides are not
    /// reliable.
    pub readout_known: WstacFwBool,
    /// The time in ms from the first to the last row of the picture: 0 for a global shutter, below 0 if the last row
    /// comes first. Beyond 1000 it counts as unknown.
    pub readout_ms: f32,
}

/// Sets up a pipeline with the default trigger and laws, in `size` bytes of memory: sizeof(WstacFwPipeline).
///
/// The memory may have been in use before. The baseline is the first 25 feature frames, during which nothing may touch
/// the sensor.
///
/// # Safety
/// `pipeline` is null or that memory; `options` is null or options. Their format is null or one of the WSTAC_FW_
/// constants, and their corners are null or 25.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_init(
    pipeline: *mut WstacFwPipeline,
    size: usize,
    options: *const WstacFwOptions,
) -> WstacFwStatus {
    let make = || {
        // SAFETY: the caller guarantees it.
        let options = unsafe { borrowed(options) }?;
        // SAFETY: the caller guarantees it.
        let format = unsafe { WstacFwFormat::checked(options.format) }?;
        PipelineState::new(options, format)
    };
    // SAFETY: the caller guarantees it.
    status(unsafe { set_up(pipeline, size, make) })
}

/// Runs a call on a pipeline.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
#[inline]
pub(crate) unsafe fn with(
    pipeline: *mut WstacFwPipeline,
    call: impl FnOnce(&mut PipelineState) -> Result<WstacFwStatus, WstacFwStatus>,
) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    status(unsafe { value_mut(pipeline) }.and_then(call))
}

/// Takes a whole frame. Returns WSTAC_FW_STATUS_EVENT if it completes an event.
///
/// A frame that is refused has not been taken: wstac_fw_push_lost keeps its place in time.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `frame` is null or `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_push_frame(
    pipeline: *mut WstacFwPipeline,
    frame: *const u8,
    length: usize,
) -> WstacFwStatus {
    let push = |state: &mut PipelineState| {
        // SAFETY: the caller guarantees it.
        let frame = unsafe { bytes(frame, length) }?;
        state.push(|pipeline| pipeline.push_frame(frame))
    };
    // SAFETY: the caller guarantees it.
    unsafe { with(pipeline, push) }
}

/// Takes the next rows of a frame, as a DMA delivers them. Returns WSTAC_FW_STATUS_EVENT if they complete an event.
///
/// The event is bit-identical to that of the whole frame. A stripe that is refused has not been taken.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `rows` is null or `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_push_stripe(
    pipeline: *mut WstacFwPipeline,
    rows: *const u8,
    length: usize,
) -> WstacFwStatus {
    let push = |state: &mut PipelineState| {
        // SAFETY: the caller guarantees it.
        let rows = unsafe { bytes(rows, length) }?;
        state.push(|pipeline| pipeline.push_stripe(rows))
    };
    // SAFETY: the caller guarantees it.
    unsafe { with(pipeline, push) }
}

/// Forgets the rows of a frame whose rest will not arrive, and counts it as lost.
///
/// It counts one frame, whether or not any of its rows had arrived.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_abandon_frame(pipeline: *mut WstacFwPipeline) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    unsafe { with(pipeline, |state| state.push(|pipeline| Ok(pipeline.abandon_frame()))) }
}

/// Keeps the place of lost camera frames in time.
///
/// A short gap is filled. A gap of more than 7 feature frames ends what was under way. A frame that is under way in
/// stripes stays so.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_push_lost(pipeline: *mut WstacFwPipeline, frames: u64) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    unsafe { with(pipeline, |state| state.push(|pipeline| Ok(pipeline.push_lost(frames)))) }
}

/// Ends the stream. Returns WSTAC_FW_STATUS_EVENT if frames that were lost at its very end complete an event.
///
/// Nothing can be pushed after it until wstac_fw_init.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_finish(pipeline: *mut WstacFwPipeline) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    unsafe { with(pipeline, PipelineState::finish) }
}
