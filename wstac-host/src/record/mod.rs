//! Recordings: a source's frames and everything that followed from them, in an MCAP file that viewers open.
//!
//! [`Recorder`] turns events and outputs into messages, and `writer` takes them to the disk in a thread of its own.
//! `file` and `reserved` write them so that neither a killed program nor a full disk loses what was written. [`about`]
//! has a recording's description, and `scan` reads files, whole or not. [`recover`] makes whole recordings of those
//! that are not. [`crate::source::mcap`] reads recordings as sources.

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
/// Topic of lost frames and of the source's faults, as JSON.
pub(crate) const FAULTS: &str = "/faults/json";
