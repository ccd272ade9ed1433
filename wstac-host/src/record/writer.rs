//! A recording's file in a thread of its own, behind a queue. A slow disk does not make the camera lose frames, and its
//! slowness is reported.

use std::fs::{self, File};
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

use mcap::McapError;
use mcap::write::Metadata;

use super::compression::Compression;
use super::file::{Message, RecordingFile, write_error};
use super::limits::{check_memory, has_memory};
use crate::error::{Error, ErrorKind};
use crate::files::has_name;
use crate::plural::counted;

/// Memory that frames may wait in.
const QUEUE_BYTES: usize = 256 << 20;
/// Most frames that may wait.
const QUEUE_FRAMES: usize = 256;
/// Least frames that may wait, if there is little memory.
const LEAST_FRAMES: usize = 2;
/// Frames in memory besides those that wait, without and with compression.
const BESIDES: [usize; 2] = [3, 5];

/// The result of writing a recording's file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Bytes of the file.
    pub bytes: u64,
    /// Frames in it.
    pub frames: u64,
    /// Frames that came and are not in it because the disk was full.
    pub left_out: u64,
    /// The most frames that waited for the disk.
    pub most_waiting: u64,
    /// The number of times that the queue was full and a source had to wait for the disk.
    pub waits: u64,
}

#[derive(Debug, Default)]
struct QueueState {
    waiting: AtomicU64,
    most_waiting: AtomicU64,
    waits: AtomicU64,
    is_disk_full: AtomicBool,
}

/// The end of the queue that takes messages: one for each sensor.
#[derive(Clone)]
pub(super) struct Outbox {
    queue: SyncSender<Vec<Message>>,
    state: Arc<QueueState>,
}

/// A file that is being written.
pub(super) struct Writing {
    thread: JoinHandle<Result<Written, Error>>,
    path: PathBuf,
}

/// Starts to write a file that is empty. `frame_bytes` are the approximate sizes of the sensors' frames.
pub(super) fn start(
    file: File,
    path: &Path,
    metadata: Vec<Metadata>,
    frame_bytes: &[usize],
    compression: Compression,
) -> Result<(Outbox, Writing), Error> {
    let besides = BESIDES[usize::from(compression != Compression::None)];
    let all_bytes = frame_bytes.iter().sum::<usize>();
    check_memory(&path.display(), all_bytes, LEAST_FRAMES + besides)?;
    let mut frames = (QUEUE_BYTES / all_bytes.max(1)).clamp(LEAST_FRAMES, QUEUE_FRAMES);
    while frames > LEAST_FRAMES && !has_memory(all_bytes.saturating_mul(frames + besides)) {
        frames = (frames / 2).max(LEAST_FRAMES);
    }
    let (queue, moments) = sync_channel(frames * frame_bytes.len());
    let outbox = Outbox { queue, state: Arc::default() };
    let of_thread = (path.to_owned(), Arc::clone(&outbox.state));
    let thread = std::thread::Builder::new().name("recording".into()).spawn(move || {
        let (path, state) = of_thread;
        let moments = moments.into_iter().inspect(|_| {
            state.waiting.fetch_sub(1, Ordering::Relaxed);
        });
        let written = write(file, &path, (&metadata, compression), moments, &state.is_disk_full)?;
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        Ok(Written { most_waiting: of(&state.most_waiting), waits: of(&state.waits), ..written })
    });
    let thread = thread.map_err(|error| Error::io(path.display(), error))?;
    Ok((outbox, Writing { thread, path: path.into() }))
}

impl Outbox {
    /// Gives the messages of one moment, and waits if the queue is full.
    ///
    /// It returns whether the file goes on. It does not if the disk is full or the file cannot be written.
    pub(super) fn give(&self, messages: Vec<Message>) -> bool {
        let QueueState { waiting, most_waiting, waits, is_disk_full } = &*self.state;
        most_waiting.fetch_max(waiting.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
        let sent = match self.queue.try_send(messages) {
            Ok(()) => true,
            Err(TrySendError::Full(messages)) => {
                waits.fetch_add(1, Ordering::Relaxed);
                self.queue.send(messages).is_ok()
            }
            Err(TrySendError::Disconnected(_)) => false,
        };
        sent && !is_disk_full.load(Ordering::Relaxed)
    }

    /// Returns the number of moments whose messages are not on their way to the disk yet.
    pub(super) fn waiting(&self) -> u64 {
        self.state.waiting.load(Ordering::Relaxed)
    }
}

impl Writing {
    /// Waits until all ends of the queue are gone, everything is written and the file is finished.
    pub(super) fn finish(self) -> Result<Written, Error> {
        let ended = self.thread.join();
        ended.unwrap_or_else(|_| Err(Error::new(ErrorKind::Io, self.path.display(), "its writer ended unexpectedly")))
    }
}

/// Removes the file of a recording that was not started, if it still has its name.
pub(super) fn discard(file: &File, path: &Path) {
    if has_name(file, path) {
        // If it cannot be removed, an empty file stays.
        let _ = fs::remove_file(path);
    }
}

/// Refuses the end of a recording whose file has lost its name: somebody has removed, moved or replaced it.
fn check_name(file: &File, path: &Path) -> Result<(), Error> {
    if has_name(file, path) {
        return Ok(());
    }
    let taken = if path.symlink_metadata().is_ok() { "; another file has its name now" } else { "" };
    // A file that was only moved can be found by its descriptor.
    let place = fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd())).ok();
    let has_other = file.metadata().is_ok_and(|metadata| metadata.nlink() > 0);
    let message = match place.filter(|place| has_name(file, place)) {
        Some(place) => format!("was moved while it was recorded: the recording is in {}{taken}", place.display()),
        None if has_other => format!("was moved while it was recorded: another name has the recording{taken}"),
        None => format!("was removed while it was recorded: the recording is lost{taken}"),
    };
    Err(Error::new(ErrorKind::Io, path.display(), message))
}

/// Describes an error of writing a recording, whose content is not lost.
fn in_words(path: &Path, error: McapError) -> Error {
    write_error(path, error, format_args!("; wstac recover {} -o NEW.mcap brings back what is in it", path.display()))
}

/// Writes messages until none comes any more, and finishes the file.
fn write(
    file: File,
    path: &Path,
    (metadata, compression): (&[Metadata], Compression),
    moments: impl Iterator<Item = Vec<Message>>,
    full: &AtomicBool,
) -> Result<Written, Error> {
    let failed = |error| in_words(path, error);
    let same = file.try_clone().map_err(|error| failed(error.into()))?;
    let mut file = RecordingFile::new(file, metadata, compression).map_err(|error| {
        discard(&same, path);
        write_error(path, error, "; nothing was recorded")
    })?;
    let write_all = || {
        let mut written = Written::default();
        for messages in moments {
            let frames = messages.iter().filter(|message| message.topic.is_frame()).count() as u64;
            if full.load(Ordering::Relaxed) || !file.has_room(&messages).map_err(failed)? {
                full.store(true, Ordering::Relaxed);
                written.left_out += frames;
                continue;
            }
            file.write(&messages).map_err(failed)?;
            file.flush().map_err(|error| failed(error.into()))?;
            written.frames += frames;
        }
        written.bytes = file.finish().map_err(failed)?;
        Ok(written)
    };
    let written: Result<Written, Error> = write_all();
    if full.load(Ordering::Relaxed) && written.as_ref().is_ok_and(|written| written.frames == 0) {
        discard(&same, path);
        let message = "the disk is full (or the file as large as it may get); nothing was recorded";
        return Err(Error::new(ErrorKind::Io, path.display(), message));
    }
    // Whatever else has happened: what is said of the file must be about the file of that name.
    check_name(&same, path)?;
    let written = written?;
    if full.load(Ordering::Relaxed) {
        let (frames, left_out) = (counted(written.frames, "frame"), written.left_out);
        let message = format_args!(
            "the disk is full (or the file as large as it may get): the recording ends after {frames} and is \
             finished; frames left out: {left_out}"
        );
        return Err(Error::new(ErrorKind::Io, path.display(), message));
    }
    Ok(written)
}
