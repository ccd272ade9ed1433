//! A recording of a part of a stream that is being read.

use std::fmt;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::about::About;
use super::recorder::Recorder;
use super::writer::Written;
use crate::error::{Error, ErrorKind};
use crate::output::Output;
use crate::plural::counted;
use crate::session::{Phase, Processor};
use crate::source::{LossCounts, SourceEvent};
use crate::text::text_of;

/// The number of names that are tried for a new file.
const MOST_NAMES: u32 = 9999;

/// Creates a file that does not exist, and locks it.
///
/// # Errors
/// The file exists or cannot be created.
pub fn new_file(path: &Path) -> Result<File, Error> {
    created(path).map_err(|error| Error::io(path.display(), error))
}

/// Creates the first file whose name is free, of the names for the numbers 1, 2, 3 and so on. It is locked.
///
/// # Errors
/// A file cannot be created, or all of 9999 names are taken.
pub fn first_free_file(name: impl Fn(u32) -> PathBuf) -> Result<(File, PathBuf), Error> {
    for number in 1..=MOST_NAMES {
        let path = name(number);
        match created(&path) {
            Ok(file) => return Ok((file, path)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(Error::io(path.display(), error)),
        }
    }
    let taken = format_args!("and {MOST_NAMES} others like it exist, expected a free name");
    Err(Error::new(ErrorKind::AlreadyExists, name(1).display(), taken))
}

/// Creates a file that does not exist, and locks it, so that a recovery leaves it alone. On a system without locks the
/// file is not locked.
fn created(path: &Path) -> io::Result<File> {
    let file = File::create_new(path)?;
    let _ = file.try_lock();
    Ok(file)
}

/// A recording of a part of a stream: from a restart of its processor to any later frame.
///
/// It replays like a stream of its own: its frames, and those of its events, count from 0. Whoever shows the stream
/// meanwhile counts its times on with [`Output::after`].
pub struct Excerpt {
    recorder: Recorder,
    /// The number of the first feature frame.
    zero: u64,
    /// The path of the file.
    pub path: PathBuf,
    /// The number of camera frames so far, without lost ones.
    pub frames: u64,
    /// The number of camera frames that were lost so far.
    pub lost: u64,
    /// The number of events so far.
    pub events: u64,
    begins_in_touch: bool,
}

/// A recording that is complete. It is displayed as a line for a person.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FinishedRecording {
    /// The path of the file.
    pub path: PathBuf,
    /// The result of writing it.
    pub written: Written,
    /// The number of camera frames that were lost.
    pub lost: u64,
    /// The number of events.
    pub events: u64,
    /// Whether something touched the sensor when it began: its baseline is that of the touch.
    pub begins_in_touch: bool,
}

impl FinishedRecording {
    /// Returns what a person should know of its answers, or an empty text.
    pub fn doubt(&self) -> &'static str {
        if self.begins_in_touch {
            "; it begins in a touch, so its answers are not reliable: record it again"
        } else {
            ""
        }
    }
}

impl fmt::Display for FinishedRecording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, written, lost, events, .. } = self;
        let (frames, events) = (counted(written.frames, "frame"), counted(*events, "event"));
        let lost = if *lost > 0 { format!(", {} lost", counted(*lost, "frame")) } else { String::new() };
        let (path, megabytes, doubt) = (path.display(), written.bytes as f64 / 1e6, self.doubt());
        write!(f, "{path}: {frames}, {events}{lost}, {megabytes:.1} MB{doubt}")
    }
}

impl Excerpt {
    /// Starts a recording in an empty file. `processor` is restarted ([`Processor::restart`]) before the next event of
    /// the source: just before this, or behind it, so that a recording that is refused has changed nothing.
    ///
    /// A file whose recording cannot be started is removed.
    ///
    /// # Errors
    /// The recording cannot be started.
    pub fn start(file: File, path: &Path, about: &About, processor: &Processor) -> Result<Self, Error> {
        let recorder = Recorder::new(file, path, about, processor)?;
        Ok(Self {
            recorder,
            path: path.to_owned(),
            zero: processor.pipeline().next_frame(),
            frames: 0,
            lost: 0,
            events: 0,
            begins_in_touch: matches!(processor.phase(), Phase::Capturing { .. }),
        })
    }

    /// Returns the number of frames that wait for the disk.
    pub fn waiting(&self) -> u64 {
        self.recorder.waiting()
    }

    /// Takes an event of the source before the processor does.
    pub fn source_event(&mut self, event: &SourceEvent<'_>) {
        match event {
            SourceEvent::Frame(_) | SourceEvent::Taxels(_) => self.frames += 1,
            SourceEvent::Lost { frames, .. } => self.lost = self.lost.saturating_add(*frames),
            _ => {}
        }
        self.recorder.source_event(event);
    }

    /// Takes an output that followed from it.
    pub fn output(&mut self, output: &Output) {
        self.events += u64::from(matches!(output, Output::Event(_)));
        self.begins_in_touch |= matches!(output, Output::BaselineDisturbed { .. });
        let mut output = output.clone().counted_from(self.zero);
        if let Output::End(end) = &mut output {
            (end.dropped, end.dropped_by) = (self.lost, LossCounts::default());
        }
        self.recorder.output(&output, &text_of(&output));
    }

    /// Takes the event after its outputs, and returns whether the recording goes on. It does not if the disk is full,
    /// which [`finish`](Self::finish) reports.
    pub fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        self.recorder.processed(event, processor)
    }

    /// Ends the recording and its file.
    ///
    /// # Errors
    /// The file could not be written, or not all of it.
    pub fn finish(self) -> Result<FinishedRecording, Error> {
        let Self { recorder, path, lost, events, begins_in_touch, .. } = self;
        let written = recorder.finish()?;
        Ok(FinishedRecording { path, written, lost, events, begins_in_touch })
    }
}
