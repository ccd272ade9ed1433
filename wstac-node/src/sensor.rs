//! Reads one sensor: a camera, a file or a scene here, or a board, which finds its events itself.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Receiver;

use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;

use crate::arguments::{Arguments, NamedSource};
use crate::board::{Board, PortKind};
use crate::frames::Frames;
use crate::note;
use crate::orders::Order;
use crate::publisher::PublisherHandle;

/// A sensor that is ready for reading.
pub(crate) enum Sensor {
    /// A board, which sends what it finds.
    Board(Box<Board>),
    /// A source of frames.
    Frames(Box<Frames>),
}

impl Sensor {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(named: &NamedSource, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
        let (name, source) = (&named.name, &*named.source);
        let kind = PortKind::of(source);
        if kind.is_some() && arguments.picture {
            note(format_args!("{name}: a board has no pictures; none are published"));
        }
        match kind {
            Some(PortKind::Serial) => {
                Board::open(name, source, arguments.baud).map(|board| Self::Board(Box::new(board)))
            }
            Some(PortKind::Tcp) => Board::open(name, source, None).map(|board| Self::Board(Box::new(board))),
            None => Frames::open(named, arguments, models).map(|frames| Self::Frames(Box::new(frames))),
        }
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    ///
    /// A file or a scene begins after `share` of the time between two of its frames, so that the frames of several ones
    /// do not come all at once.
    pub(crate) fn run(
        self,
        publisher: PublisherHandle,
        orders: &Receiver<Order>,
        share: f64,
        ends: &AtomicBool,
    ) -> bool {
        match self {
            Self::Board(board) => board.run(&publisher, orders, ends),
            Self::Frames(frames) => frames.run(publisher, orders, share, ends),
        }
    }
}
