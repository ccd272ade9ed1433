//! Sources of frames: one trait, and one file per source.

mod crop;
pub mod decorate;
pub mod every_sensor;
#[cfg(feature = "jpeg")]
pub mod jpeg_folder;
#[cfg(feature = "mcap")]
pub mod mcap;
#[cfg(any(feature = "jpeg", feature = "png"))]
mod name_times;
pub mod names;
#[cfg(any(feature = "jpeg", feature = "png"))]
mod natural;
pub mod open;
pub mod option_text;
#[cfg(any(feature = "jpeg", feature = "png"))]
mod orientation;
pub mod pace;
#[cfg(any(feature = "jpeg", feature = "png"))]
mod picture_files;
#[cfg(any(feature = "jpeg", feature = "png"))]
mod picture_names;
#[cfg(feature = "png")]
pub mod png_folder;
mod replaced_rate;
// Only recordings use all of it.
#[cfg_attr(not(feature = "mcap"), allow(dead_code))]
pub(crate) mod spacing;
pub mod video;
pub mod y4m;

use std::collections::BTreeMap;
use std::fmt;
use std::ops::DerefMut;
use std::sync::Arc;
use std::time::Duration;

use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::FrameSize;
use wstac_core::params::{COLUMNS, TAXELS};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
pub use wstac_core::touch::motion::{ReadoutTime, RowOrder};

use crate::camera::CameraState;
use crate::config::Config;
use crate::error::{Error, ErrorKind};
use crate::output::OutputOptions;
#[cfg(feature = "board")]
use crate::output::Report;

pub use self::crop::Crop;
pub use self::spacing::PushedTimes;
pub use crate::frame_clock::{Stamp, StreamClock};
pub use crate::reasons::{Fault, FaultKind, LossCounts, LossReason, Remedy};

/// The part of a rate by which another one may differ without being reported.
pub(crate) const RATE_OFF: f64 = 0.02;

/// The labels that a person gave, such as `specimen` `Saw3`.
pub type Labels = BTreeMap<String, String>;

/// The properties that all frames of a stream have in common.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StreamInfo {
    /// Width and height.
    pub size: FrameSize,
    /// Pixel format of the bytes that the source hands out. For a compressed stream it is the format of decoded frames.
    pub format: PixelFormat,
    /// The meaning of YCbCr numbers, as the source states it.
    pub color: YcbcrEncoding,
    /// Bytes from the start of a row to the start of the next.
    pub bytes_per_row: u32,
    /// Frames per second.
    pub rate: FrameRate,
    /// The clock of its frames' times. By [`StreamClock::Frames`], the default, their times do not count.
    pub clock: StreamClock,
    /// The time from the first to the last row of the picture as the sensor reads it; `None` if it is unknown.
    pub readout: Option<ReadoutTime>,
    /// Where the sensor's rows follow each other in the picture. Another order than [`RowOrder::Down`] is that of a
    /// source that turns or mirrors what the sensor reads.
    pub row_order: RowOrder,
    /// Whether its sensor is simulated, whose taxels are where the publication has them.
    pub is_simulated: bool,
    /// Whether it gives taxel sums instead of bytes.
    pub taxels_only: bool,
    /// Whether it is a board, which finds its outputs itself: it gives no frames, and their size and rate are unknown
    /// here.
    pub is_board: bool,
    /// The part of its frames that is known; `None` if all is. The rest is black, and no taxel may be there.
    pub crop: Option<Crop>,
    /// One line for a person: the source and its frames.
    pub about: String,
    /// The camera that its frames come from, now or when they were recorded; `None` if no camera is known.
    pub camera: Option<Box<CameraState>>,
    /// The parts of a recording besides frames; `None` if the source is no recording.
    pub recorded: Option<Arc<Recorded>>,
}

/// The parts of a recording besides frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Recorded {
    /// The configuration, as TOML. It holds unless the user gives another.
    pub configuration: String,
    /// The texture models of the recorded run, each by the name of its file.
    pub models: Vec<String>,
    /// The labels that a person gave, such as `specimen` `Saw3`.
    pub labels: Labels,
}

/// The choice of frames of a live source that are handed out if the program is slower than the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FramePolicy {
    /// All frames, the oldest first, as long as the driver has buffers. This is for recording.
    #[default]
    Every,
    /// The newest frame. Older ones that wait are counted as lost. This is for answers in time.
    Newest,
}

/// The lag of the program behind a live source; all 0 for files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Lag {
    /// Frames that waited behind the one handed out last.
    pub frames: u32,
    /// The most that ever waited.
    pub most: u32,
    /// Frames that were skipped for newer ones.
    pub skipped: u64,
    /// The time from the driver's timestamp of the last frame to the moment when it was handed out.
    pub latency: Option<Duration>,
}

/// A frame of a source.
// It is exhaustive: sources of others build it with `..Frame::new(bytes)`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<'a> {
    /// Its bytes, laid out as the stream's information says.
    pub bytes: &'a [u8],
    /// The time when it was taken, on the driver's monotonic clock; `None` for files that do not state it.
    pub timestamp: Option<Duration>,
    /// The wall-clock time when it was taken; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The driver's frame counter; `None` for files that do not state it.
    pub sequence: Option<u32>,
    /// The picture as the camera sent it, if that was JPEG. `bytes` is the decoded picture.
    pub encoded: Option<&'a [u8]>,
    /// The lag of reading behind the source.
    pub lag: Lag,
    /// How far the times of a file put it from its place among even frames, in steps between frames; 0 where none do.
    pub off: f32,
}

impl<'a> Frame<'a> {
    /// Creates a frame without a time, a number or a lag.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, ..Self::default() }
    }
}

/// A frame of which only the taxel sums are known.
// It is exhaustive: sources of others build it with `..SummedFrame::new(sums)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SummedFrame {
    /// The taxel sums, row by row, each from 0 to a taxel's pixels times their full scale.
    pub sums: [u32; TAXELS],
    /// The time when it was taken, on the driver's monotonic clock; `None` if nothing states it.
    pub timestamp: Option<Duration>,
    /// The wall-clock time when it was taken; `None` if nothing states it.
    pub stamp: Option<Stamp>,
    /// The driver's frame counter; `None` if nothing states it.
    pub sequence: Option<u32>,
}

impl SummedFrame {
    /// Creates a frame without a time or a number.
    pub fn new(sums: [u32; TAXELS]) -> Self {
        Self { sums, ..Self::default() }
    }

    /// Creates a frame of numbers from outside, row by row, without a time or a number.
    ///
    /// # Errors
    /// There are not 25 of them, or one is not a whole number from 0 to a taxel's pixels times their full scale.
    pub fn from_numbers(numbers: &[f64], geometry: &FrameGeometry<Any>) -> Result<Self, Error> {
        let refused = |message: &dyn fmt::Display| Error::new(ErrorKind::Frame, "sums", message);
        let most = f64::from(geometry.pixels()) * f64::from(geometry.full_scale());
        let found = numbers.len();
        let numbers = <&[f64; TAXELS]>::try_from(numbers)
            .map_err(|_| refused(&format_args!("are {found} numbers, expected {TAXELS}")))?;
        let is_wrong = |number: &f64| !(0.0..=most).contains(number) || number.fract() != 0.0;
        if let Some(taxel) = numbers.iter().position(is_wrong) {
            let (row, column, number) = (taxel / COLUMNS + 1, taxel % COLUMNS + 1, numbers[taxel]);
            let message = format_args!(
                "that of row {row}, column {column} is {number}, expected a whole number from 0 to {most}"
            );
            return Err(refused(&message));
        }
        Ok(Self::new(numbers.map(|number| number as u32)))
    }
}

/// The next thing that a source gives.
#[derive(Debug)]
#[non_exhaustive]
pub enum SourceEvent<'a> {
    /// A frame.
    Frame(Frame<'a>),
    /// A frame of which only the taxel sums are known.
    ///
    /// A simulated sensor that makes no pixels gives them, of the published layout and of every pixel. So does a
    /// recording without pictures, of the layout and the stride that it was recorded with.
    Taxels(SummedFrame),
    /// Frames that were lost or unusable here.
    Lost {
        /// The number of lost frames.
        frames: u64,
        /// Why they were lost.
        reason: LossReason,
    },
    /// A fault occurred. Frames may follow.
    Fault(Fault),
    /// A board has found something, or says something. A session hands its outputs on.
    #[cfg(feature = "board")]
    Report(Report),
    /// No event yet: a live source's wait ended without a frame. Ask again.
    Waiting,
    /// No more frames.
    End,
}

/// A source of frames, which may be read in another thread than the one that opened it.
///
/// Your own source needs two methods:
///
/// ```
/// use wstac_core::{green::any::PixelFormat, layout::FrameSize, rate::FrameRate};
/// use wstac_host::error::Error;
/// use wstac_host::output::Output;
/// use wstac_host::session::Session;
/// use wstac_host::source::{Frame, Source, SourceEvent, StreamInfo};
///
/// /// Frames of a camera of one's own: here a bright stripe that moves to the right.
/// struct Stripe {
///     info: StreamInfo,
///     bytes: Vec<u8>,
///     number: usize,
/// }
///
/// impl Source for Stripe {
///     fn info(&self) -> &StreamInfo {
///         &self.info
///     }
///
///     fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
///         self.number += 1;
///         if self.number > 120 {
///             return Ok(SourceEvent::End);
///         }
///         self.bytes.fill(1);
///         if let Some(x) = self.number.checked_sub(40).filter(|x| *x < 33) {
///             self.bytes.chunks_mut(400).for_each(|row| row[12 * x..][..12].fill(200));
///         }
///         Ok(SourceEvent::Frame(Frame::new(&self.bytes)))
///     }
/// }
///
/// let info = StreamInfo::new("a stripe", FrameSize::new(400, 400)?, PixelFormat::Gray, FrameRate::NOMINAL);
/// let session = Session::builder(Stripe { info, bytes: vec![1; 160_000], number: 0 }).build()?;
/// let outputs: Vec<Output> = session.collect::<Result<_, _>>()?;
/// assert!(matches!(&outputs[0], Output::Event(event) if event.frame == 30));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Source: Send {
    /// Returns what all frames have in common.
    fn info(&self) -> &StreamInfo;

    /// Returns the next frame, gap or end, within a second.
    ///
    /// # Errors
    /// The source cannot be read any further. What was read before stays valid.
    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error>;

    /// Asks a board for these outputs, before its first event. Other sources ignore it: a session finds them.
    fn request(&mut self, outputs: OutputOptions) {
        let _ = outputs;
    }

    /// Ends a board before it ends itself: the events that it still has follow, the last with an
    /// [`Output::End`](crate::output::Output::End). Returns false for other sources, which are just not read any more.
    /// After it, [`next_event`](Self::next_event) does not fail. A source that wraps another hands it on, and
    /// [`request`](Self::request) too.
    fn stop(&mut self) -> bool {
        false
    }
}

/// A box of a source is one, and so is a reference to one.
impl<P: DerefMut<Target: Source> + Send> Source for P {
    fn info(&self) -> &StreamInfo {
        (**self).info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        (**self).next_event()
    }

    fn request(&mut self, outputs: OutputOptions) {
        (**self).request(outputs);
    }

    fn stop(&mut self) -> bool {
        (**self).stop()
    }
}

impl StreamInfo {
    /// Returns the name that tells cameras apart: the link with the serial number, else the model; `None` of others.
    pub fn sensor(&self) -> Option<String> {
        let camera = self.camera.as_ref()?;
        let lasting = camera.links.iter().find(|link| link.starts_with("/dev/v4l/by-id"));
        Some(lasting.map_or_else(|| camera.card.clone(), |link| link.display().to_string()))
    }

    /// Returns whether its frames come from a camera now. Files, scenes and recordings wait for their reader.
    pub fn is_live(&self) -> bool {
        self.camera.is_some() && self.recorded.is_none()
    }

    /// Describes frames without padding, of a source that states nothing else.
    ///
    /// `about` is one line for a person. What would control a terminal is escaped.
    pub fn new(about: impl Into<String>, size: FrameSize, format: PixelFormat, rate: FrameRate) -> Self {
        let color = YcbcrEncoding::default();
        let bytes_per_row = Any::new(format, color, YcbcrMethod::Exact).row_bytes(size.width()) as u32;
        let about = crate::visible::line(&about.into()).into_owned();
        Self {
            size,
            format,
            color,
            bytes_per_row,
            rate,
            clock: StreamClock::Frames,
            readout: None,
            row_order: RowOrder::Down,
            is_simulated: false,
            taxels_only: false,
            is_board: false,
            crop: None,
            about,
            camera: None,
            recorded: None,
        }
    }

    /// Returns the bytes of a whole frame, with the padding of all its rows.
    pub fn frame_bytes(&self) -> usize {
        Any::new(self.format, self.color, YcbcrMethod::Exact).frame_bytes(self.size, self.bytes_per_row as usize)
    }
}

/// Returns the configuration for a source: the one that is given, else the source's own, else the default.
///
/// # Errors
/// The source's own configuration cannot be used, or one is given for a board. The error names the source.
pub fn config_of(info: &StreamInfo, given: Option<Config>) -> Result<Config, Error> {
    match (given, &info.recorded) {
        (Some(_), _) if info.is_board => Err(board_refusal(info)),
        (Some(given), _) => Ok(given),
        (None, Some(own)) => Config::parse(&own.configuration).map_err(|error| error.about(&info.about)),
        (None, None) => Ok(Config::default()),
    }
}

/// Returns the error of an order that only a source of frames can follow.
pub(crate) fn board_refusal(info: &StreamInfo) -> Error {
    let message = "is a board, which finds its events itself: it takes no configuration, model, baseline or recording \
                   here; wstac board changes its settings";
    Error::new(ErrorKind::Unsupported, &info.about, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::layout::Layout;

    #[test]
    fn numbers_from_outside_are_sums_or_refused() {
        let gray = Any::new(PixelFormat::Gray, YcbcrEncoding::default(), YcbcrMethod::Exact);
        let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
        let geometry = FrameGeometry::new(gray, layout, FrameRate::NOMINAL).unwrap();
        let most = f64::from(geometry.pixels() * geometry.full_scale());
        let numbers = |number: f64| {
            let mut all = [0.0; TAXELS];
            all[7] = number;
            all
        };
        for right in [0.0, 1.0, most] {
            let sums = SummedFrame::from_numbers(&numbers(right), &geometry).unwrap().sums;
            assert_eq!((sums[7], sums[8]), (right as u32, 0));
        }
        for wrong in [-1.0, 0.5, most + 1.0, f64::NAN, f64::INFINITY] {
            let error = SummedFrame::from_numbers(&numbers(wrong), &geometry).unwrap_err();
            assert!(error.to_string().contains(&format!("row 2, column 3 is {wrong}, expected")), "{error}");
        }
        for length in [0, 24, 26] {
            let error = SummedFrame::from_numbers(&vec![0.0; length], &geometry).unwrap_err();
            assert_eq!(error.to_string(), format!("sums: are {length} numbers, expected 25"));
        }
    }
}
