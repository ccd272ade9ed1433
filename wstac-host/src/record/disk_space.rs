//! Whether there is room for the start of a recording.

use std::fs::File;
use std::path::Path;

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};

use super::writer::discard;
use crate::error::{Error, ErrorKind};
use crate::source::StreamInfo;

/// Bytes of a recording besides its frames: its description and its end.
const BESIDES: u64 = 1 << 20;
/// Frames that a recording has room for when it starts: a second of a camera's.
const FRAMES: u64 = 30;

/// Checks that a new file has room for the start of a recording, so that a full disk refuses it before anything has
/// changed.
///
/// The room stays reserved for the file, which is removed if there is none.
///
/// # Errors
/// The disk is full, or the file may not become as large.
pub fn check_room(file: &File, path: &Path, info: &StreamInfo) -> Result<(), Error> {
    let frame_bytes = if info.taxels_only { 0 } else { info.frame_bytes() as u64 };
    let bytes = BESIDES.saturating_add(frame_bytes.saturating_mul(FRAMES));
    let limit = getrlimit(Resource::Fsize).current.unwrap_or(u64::MAX);
    let refused = |why: &str| {
        discard(file, path);
        let message = format_args!("{why} (expected room for {} MB); nothing was recorded", bytes.div_ceil(1_000_000));
        Err(Error::new(ErrorKind::Io, path.display(), message))
    };
    if bytes > limit {
        return refused("the file may not become as large as a recording");
    }
    match fallocate(file, FallocateFlags::KEEP_SIZE, 0, bytes) {
        Err(Errno::NOSPC | Errno::DQUOT) => refused("the disk is full"),
        Err(Errno::FBIG) => refused("the file may not become as large as a recording"),
        // Where room cannot be reserved, writing shows whether there is any.
        _ => Ok(()),
    }
}
