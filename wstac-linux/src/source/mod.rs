//! Where frames come from: one trait, one file a source.

pub mod camera;
pub mod open;
pub mod png_folder;
pub mod scene;
pub mod y4m;

use std::time::Duration;

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::Colour;
use wstac_core::layout::FrameSize;
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;

use crate::error::Error;

/// What all frames of a stream have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamInfo {
    /// Width and height.
    pub size: FrameSize,
    /// Pixel format of the bytes that the source hands out (of a compressed stream: as decoded).
    pub format: PixelFormat,
    /// What YCbCr numbers mean, as the source states it.
    pub colour: Colour,
    /// Bytes from row to row.
    pub bytes_per_row: u32,
    /// Frames a second.
    pub rate: FrameRate,
    /// Whether it gives taxel sums instead of bytes.
    pub taxels_only: bool,
    /// One line for a person: what the source is and what it gives.
    pub about: String,
}

/// What a source gives next.
#[derive(Debug)]
pub enum Item<'a> {
    /// A frame's bytes.
    Frame {
        /// Its bytes, laid out as the stream's information says.
        bytes: &'a [u8],
        /// When it was taken, on the driver's monotonic clock; nothing for files.
        timestamp: Option<Duration>,
    },
    /// A frame's taxel sums, of the paper's layout and every pixel: a simulated sensor that makes no pixels.
    Taxels([u32; TAXELS]),
    /// Frames that were lost (or unusable) here; why, for a person.
    Lost {
        /// How many.
        frames: u64,
        /// Dropped by the driver, corrupt, short …
        why: &'static str,
    },
    /// Nothing yet: a live source's wait ended without a frame. Ask again.
    Waiting,
    /// No more frames.
    End,
}

/// A source of frames.
pub trait Source {
    /// What all its frames have in common.
    fn info(&self) -> &StreamInfo;

    /// The next frame, gap or end. Returns at least once a second.
    ///
    /// # Errors
    /// Where the source cannot be read any further: what was read before stays valid.
    fn next(&mut self) -> Result<Item<'_>, Error>;
}
