//! Recordings: a source's frames and everything that became of them, in an MCAP file that viewers open.
//!
//! [`Recorder`] turns what is read into messages, `writer` takes them to the disk in a thread of its own, `file`
//! and `reserved` write them so that neither a killed program nor a full disk loses what was written. [`about`]
//! has what a recording says of itself, `scan` reads files, whole or not, and [`recover`] makes whole ones of those that
//! are not. The way back is [`crate::source::mcap`].

pub mod about;
mod file;
pub(crate) mod foxglove;
pub(crate) mod parse;
mod picture;
pub mod plan;
mod recorder;
mod recover;
mod reserved;
pub(crate) mod scan;
mod writer;

pub use recorder::Recorder;
pub use recover::{Recovered, check_readable, recover};
pub use scan::Unread;
pub use writer::Written;

/// Topic of the frames.
pub(crate) const CAMERA: &str = "/camera";
/// Topic of events, as JSON.
pub(crate) const EVENTS: &str = "/events/json";
/// Topic of lost frames and of what happened to the source, as JSON.
pub(crate) const FAULTS: &str = "/faults/json";
