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
use std::time::Duration;

use mcap::write::Metadata;

use super::compression::Compression;
use super::file::{Message, RecordingFile, in_words};
use super::limits::{check_memory, has_memory};
use super::merge::{Input, Merge};
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
    /// The number of times that the queue was full and the source had to wait for the disk. That it had to wait for
    /// another sensor is not counted.
    pub waits: u64,
}

/// The end of a sensor's queue that takes messages.
pub(super) struct Outbox {
    queue: Option<SyncSender<Vec<Message>>>,
    waiting: Arc<AtomicU64>,
    full: Arc<AtomicBool>,
    /// Whether the file waits for another sensor now.
    is_held_up: Arc<AtomicBool>,
    most_waiting: u64,
    waits: u64,
}

/// How long sensors that give nothing hold up the others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// The most.
    pub(super) most: Duration,
    /// The time between two frames of the fastest sensor.
    pub(super) frame: Duration,
}

impl Patience {
    /// Returns how long it is if so many frames may wait: at most half of the queues fill meanwhile, so no sensor that
    /// gives frames has to wait itself.
    fn of_queue(self, frames: usize) -> Duration {
        self.most.min(self.frame.saturating_mul(u32::try_from(frames / 2).unwrap_or(u32::MAX)))
    }
}

/// A file that is being written.
pub(super) struct Writing {
    thread: JoinHandle<Result<Written, Error>>,
    path: PathBuf,
}

/// The order in which moments are written.
#[derive(Clone, Copy, Debug)]
pub(super) enum Order {
    /// As they are given.
    Given,
    /// By their times. Sensors that give nothing hold up the others for at most so long.
    Time(Patience),
}

/// Starts to write a file that is empty, and returns a queue for each sensor. `frame_bytes` are the approximate sizes of
/// their frames.
pub(super) fn start(
    file: File,
    path: &Path,
    metadata: Vec<Metadata>,
    (frame_bytes, order): (&[usize], Order),
    compression: Compression,
) -> Result<(Vec<Outbox>, Writing), Error> {
    let besides = BESIDES[usize::from(compression != Compression::None)];
    let all_bytes = frame_bytes.iter().sum::<usize>();
    check_memory(&path.display(), all_bytes, LEAST_FRAMES + besides)?;
    let mut frames = (QUEUE_BYTES / all_bytes.max(1)).clamp(LEAST_FRAMES, QUEUE_FRAMES);
    while frames > LEAST_FRAMES && !has_memory(all_bytes.saturating_mul(frames + besides)) {
        frames = (frames / 2).max(LEAST_FRAMES);
    }
    let (full, is_held_up) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let (mut outboxes, mut inputs) = (Vec::new(), Vec::new());
    // One queue keeps the order of what is given to it.
    let (queues, of_each, patience) = match order {
        Order::Given => (1, frame_bytes.len(), None),
        Order::Time(patience) => (frame_bytes.len(), 1, Some(patience)),
    };
    for _ in 0..queues {
        let (queue, messages) = sync_channel(frames * of_each);
        let waiting = Arc::new(AtomicU64::new(0));
        inputs.push(Input::new(messages, Arc::clone(&waiting)));
        let outbox = || Outbox {
            queue: Some(queue.clone()),
            waiting: Arc::clone(&waiting),
            full: Arc::clone(&full),
            is_held_up: Arc::clone(&is_held_up),
            most_waiting: 0,
            waits: 0,
        };
        outboxes.extend((0..of_each).map(|_| outbox()));
    }
    let patience = patience.map(|patience| patience.of_queue(frames));
    let shared = (Merge::new(inputs, patience, is_held_up), full, path.to_owned());
    let thread = std::thread::Builder::new().name("recording".into()).spawn(move || {
        let (moments, full, path) = shared;
        write(file, &path, (&metadata, compression), moments, &full)
    });
    let thread = thread.map_err(|error| Error::io(path.display(), error))?;
    Ok((outboxes, Writing { thread, path: path.into() }))
}

impl Outbox {
    /// Gives the messages of one moment, and waits if the queue is full.
    ///
    /// It returns whether the file goes on. It does not if the disk is full or the file cannot be written.
    pub(super) fn give(&mut self, messages: Vec<Message>) -> bool {
        let Some(queue) = &self.queue else { return false };
        let waiting = self.waiting.fetch_add(1, Ordering::Relaxed);
        self.most_waiting = self.most_waiting.max(waiting);
        let sent = match queue.try_send(messages) {
            Ok(()) => true,
            Err(TrySendError::Full(messages)) => {
                self.waits += u64::from(!self.is_held_up.load(Ordering::Relaxed));
                queue.send(messages).is_ok()
            }
            Err(TrySendError::Disconnected(_)) => false,
        };
        sent && !self.full.load(Ordering::Relaxed)
    }

    /// Returns the number of moments whose messages are not on their way to the disk yet.
    pub(super) fn waiting(&self) -> u64 {
        self.waiting.load(Ordering::Relaxed)
    }

    /// Ends the queue, and returns what waited in it.
    pub(super) fn end(self) -> Written {
        Written { most_waiting: self.most_waiting, waits: self.waits, ..Written::default() }
    }
}

impl Writing {
    /// Waits until all queues have ended, everything is written and the file is finished.
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

/// Describes an error of writing a recording's start.
fn not_started(path: &Path, error: &mcap::McapError) -> Error {
    match error {
        mcap::McapError::Io(error) => {
            Error::new(error.kind().into(), path.display(), format_args!("{error}; nothing was recorded"))
        }
        error => Error::new(ErrorKind::Io, path.display(), format_args!("{error}; nothing was recorded")),
    }
}

/// Writes messages until none comes any more, and finishes the file.
fn write(
    file: File,
    path: &Path,
    (metadata, compression): (&[Metadata], Compression),
    moments: Merge,
    full: &AtomicBool,
) -> Result<Written, Error> {
    let failed = |error| in_words(path, error);
    let same = file.try_clone().map_err(|error| failed(error.into()))?;
    let file = RecordingFile::new(file, metadata, compression).map_err(|error| {
        discard(&same, path);
        not_started(path, &error)
    })?;
    let written = write_all(file, path, moments, full);
    // Whatever else has happened: what is said of the file must be about the file of that name.
    check_name(&same, path)?;
    written
}

/// Writes messages to a file that was started, and finishes it.
fn write_all(mut file: RecordingFile, path: &Path, moments: Merge, full: &AtomicBool) -> Result<Written, Error> {
    let failed = |error| in_words(path, error);
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
    if full.load(Ordering::Relaxed) {
        let (frames, left_out) = (counted(written.frames, "frame"), written.left_out);
        return Err(Error::new(
            ErrorKind::Io,
            path.display(),
            format_args!(
                "the disk is full (or the file as large as it may get): the recording ends after {frames} and is \
                 finished; frames left out: {left_out}"
            ),
        ));
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    #[test]
    fn a_queue_that_is_full_because_of_another_sensor_is_not_the_disks_fault() {
        for (is_held_up, expected) in [(true, 0), (false, 1)] {
            let (queue, messages) = sync_channel(1);
            let mut outbox = Outbox {
                queue: Some(queue),
                waiting: Arc::default(),
                full: Arc::default(),
                is_held_up: Arc::new(AtomicBool::new(is_held_up)),
                most_waiting: 0,
                waits: 0,
            };
            assert!(outbox.give(Vec::new()));
            let taken = thread::spawn(move || {
                thread::sleep(Duration::from_millis(50));
                messages.iter().count()
            });
            assert!(outbox.give(Vec::new()));
            assert_eq!(outbox.end().waits, expected);
            assert_eq!(taken.join().unwrap(), 2);
        }
    }

    #[test]
    fn patience_ends_before_the_queues_are_full() {
        let patience = Patience { most: Duration::from_secs(1), frame: Duration::from_secs(1) / 30 };
        // 20 cameras of 640 x 480 in YUYV.
        let frames = QUEUE_BYTES / (20 * 640 * 480 * 2);
        assert_eq!(frames, 21);
        assert_eq!(patience.of_queue(frames), patience.frame * 10);
        assert_eq!(patience.of_queue(QUEUE_FRAMES), Duration::from_secs(1));
        assert_eq!(patience.of_queue(LEAST_FRAMES), patience.frame);
    }
}
