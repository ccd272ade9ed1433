//! Reads one sensor: a camera, a file or a scene here, or a board, which finds its events itself.

use std::os::unix::ffi::OsStrExt;
use std::sync::atomic::AtomicBool;

use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::monitor::port::port_of;

use crate::arguments::{Arguments, NamedSource};
use crate::board::ConnectedBoard;
use crate::frames::FrameSource;
use crate::publisher::PublisherHandle;

/// A sensor that is ready for reading.
pub(crate) enum ConnectedSensor {
    /// A board, which sends what it finds.
    Board(Box<ConnectedBoard>),
    Frames(Box<FrameSource>),
}

impl ConnectedSensor {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(named: &NamedSource, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
        let (name, source) = (&named.name, &*named.source);
        let Some(port) = port_of(source) else {
            return FrameSource::open(named, arguments, models).map(|frames| Self::Frames(Box::new(frames)));
        };
        // Sources of other kinds have no bits per second.
        let baud = arguments.baud.filter(|_| port.as_bytes().starts_with(b"/"));
        ConnectedBoard::open(name, port, baud).map(|board| Self::Board(Box::new(board)))
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    ///
    /// A file or a scene begins after `share` of the time between two of its frames, so that the frames of several ones
    /// do not come all at once.
    pub(crate) fn run(self, publisher: PublisherHandle, share: f64, ends: &AtomicBool) -> bool {
        match self {
            Self::Board(board) => board.run(&publisher, ends),
            Self::Frames(frames) => frames.run(publisher, share, ends),
        }
    }
}
