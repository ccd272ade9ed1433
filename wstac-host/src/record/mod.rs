//! Recordings: a source's frames and everything that followed from them, in an MCAP file that viewers open.
//!
//! A frame is kept as its bytes, as the part of them around the taxels ([`crate::source::Crop`]), or as its taxel sums
//! ([`StreamInfo::taxels_only`](crate::source::StreamInfo::taxels_only)). All three give the same events again.
//!
//! [`Recorder`] turns events and outputs into messages, and `writer` takes them to the disk in a thread of its own.
//! [`Excerpt`] records a part of a stream that is watched.
//! `file` and `reserved` write them so that neither a killed program nor a full disk loses what was written. [`about`]
//! has a recording's description, and `sums` the checksums of its parts. `walk` goes through files, whole or not.
//! `sorted` puts the messages of other tools' files in order. [`recover`] makes whole recordings of those that are not,
//! and `reader` reads whole ones for [`crate::source::mcap`].

pub mod about;
mod bytes;
mod channels;
mod compression;
mod disk_space;
mod excerpt;
mod file;
pub(crate) mod foxglove;
pub mod labels;
mod limits;
mod ordering;
pub(crate) mod parse;
pub(crate) mod picture;
pub mod plan;
mod reader;
mod recorder;
mod recover;
mod reserved;
mod schema;
mod shared;
mod sorted;
mod summary;
mod sums;
mod walk;
mod writer;

pub use compression::Compression;
pub use disk_space::check_room;
pub use excerpt::{Excerpt, FinishedRecording, first_free_file, new_file};
pub(crate) use file::Topic;
pub(crate) use reader::RecordingReader;
pub use recorder::Recorder;
pub(crate) use recorder::{ClockLine, check_frame_bytes};
pub use recover::{Recovered, recover};
pub use schema::RECORD as RECORD_SCHEMA;
pub use shared::{RecordedSensor, SharedRecording};
pub(crate) use sums::sound_metadata;
pub use walk::Unread;
pub use writer::Written;

/// Topic of the frames.
pub(crate) const CAMERA: &str = "/camera";
/// Topic of the taxel sums of frames whose pictures are not stored.
pub(crate) const TAXEL_SUMS: &str = "/taxels/sums";
/// Topic of the wall-clock times of frames, as JSON.
pub(crate) const CLOCK: &str = "/clock/json";
/// Topic of events, as JSON.
pub(crate) const EVENTS: &str = "/events/json";
/// Topic of lost frames and of the source's faults, as JSON.
pub(crate) const FAULTS: &str = "/faults/json";
