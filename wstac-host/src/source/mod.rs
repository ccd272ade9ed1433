//! Where frames come from: one trait, one file a source.

#[cfg(feature = "mcap")]
pub mod mcap;
pub mod open;
#[cfg(feature = "png")]
pub mod png_folder;
pub mod y4m;

use std::collections::BTreeMap;
use std::time::Duration;

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::FrameSize;
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;

use crate::camera::CameraState;
use crate::config::Config;
use crate::error::Error;

/// What a person says of a recording, such as `specimen` `Saw3`.
pub type Labels = BTreeMap<String, String>;

/// What all frames of a stream have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamInfo {
    /// Width and height.
    pub size: FrameSize,
    /// Pixel format of the bytes that the source hands out (of a compressed stream: as decoded).
    pub format: PixelFormat,
    /// What YCbCr numbers mean, as the source states it.
    pub color: YcbcrEncoding,
    /// Bytes from row to row.
    pub bytes_per_row: u32,
    /// Frames a second.
    pub rate: FrameRate,
    /// Whether it gives taxel sums instead of bytes.
    pub taxels_only: bool,
    /// One line for a person: what the source is and what it gives.
    pub about: String,
    /// The camera that its frames come from, now or when they were recorded; nothing where none is known.
    pub camera: Option<Box<CameraState>>,
}

/// Which frames of a live source are handed out where the program is slower than the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FramePolicy {
    /// All of them, the oldest first, as long as the driver has buffers: for recording.
    #[default]
    Every,
    /// The newest; older ones that wait are counted as lost: for answers in time.
    Newest,
}

/// How far the program is behind a live source; all 0 for files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lag {
    /// Frames that waited behind the one handed out last.
    pub frames: u32,
    /// The most that ever waited.
    pub most: u32,
    /// Frames that were skipped for newer ones.
    pub skipped: u64,
    /// From the driver's timestamp of the frame handed out last to its handing out.
    pub latency: Option<Duration>,
}

/// Something that happened to a source, which goes on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Its kind in a word, such as `disconnected`, `reconnected` or `slow`.
    pub kind: &'static str,
    /// What happened, for a person.
    pub message: String,
}

/// What a source gives next.
#[derive(Debug)]
pub enum SourceEvent<'a> {
    /// A frame's bytes.
    Frame {
        /// Its bytes, laid out as the stream's information says.
        bytes: &'a [u8],
        /// When it was taken, on the driver's monotonic clock; nothing for files that do not say.
        timestamp: Option<Duration>,
        /// The driver's frame counter; nothing for files that do not say.
        sequence: Option<u32>,
        /// The picture as the camera sent it, where that was JPEG: `bytes` is what it decodes to.
        encoded: Option<&'a [u8]>,
    },
    /// A frame's taxel sums, row by row, each 0 to a taxel's pixels times their full scale; of the paper's layout and every
    /// pixel: a simulated sensor that makes no pixels.
    Taxels([u32; TAXELS]),
    /// Frames that were lost (or unusable) here; why, for a person.
    Lost {
        /// How many.
        frames: u64,
        /// Dropped by the driver, corrupt, short …
        why: &'static str,
    },
    /// Something happened; frames may follow.
    Fault(Fault),
    /// Nothing yet: a live source's wait ended without a frame. Ask again.
    Waiting,
    /// No more frames.
    End,
}

/// A source of frames, which may be read in another thread than the one that opened it.
pub trait Source: Send {
    /// What all its frames have in common.
    fn info(&self) -> &StreamInfo;

    /// The next frame, gap or end. Returns at least once a second.
    ///
    /// # Errors
    /// Where the source cannot be read any further: what was read before stays valid.
    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error>;

    /// How far reading is behind the source.
    fn behind(&self) -> Lag {
        Lag::default()
    }

    /// The configuration, as TOML, that the source was recorded with: it holds where the user gives none.
    fn configuration(&self) -> Option<&str> {
        None
    }

    /// The texture models that the source was recorded with, each as its file says it.
    fn models(&self) -> &[String] {
        &[]
    }

    /// What a person said of the source when it was recorded, such as `specimen` `Saw3`; nothing where it is no recording.
    fn labels(&self) -> Option<&Labels> {
        None
    }
}

/// The configuration to read a source with: the one that is given, else the source's own, else the default.
///
/// # Errors
/// Where the source's own cannot be used: names the source.
pub fn config_of(source: &dyn Source, given: Option<Config>) -> Result<Config, Error> {
    match (given, source.configuration()) {
        (Some(given), _) => Ok(given),
        (None, Some(own)) => Config::parse(own).map_err(|error| Error::new(&source.info().about, error)),
        (None, None) => Ok(Config::default()),
    }
}
