//! A recording that a page has started.

use std::path::Path;

use serde::Serialize;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::output::Output;
use wstac_host::plural::counted;
use wstac_host::record::about::About;
use wstac_host::record::{Excerpt, check_room, first_free_file};
use wstac_host::session::Processor;
use wstac_host::source::{Labels, SourceEvent, StreamInfo};

/// A recording in progress.
pub(super) struct Recording {
    excerpt: Excerpt,
    labels: Labels,
    events: u64,
}

/// A recording in progress, as the page gets it.
#[derive(Debug, Serialize)]
pub(super) struct Progress {
    file: String,
    labels: Labels,
    frames: u64,
    lost: u64,
    events: u64,
    /// Frames that wait for the disk.
    waiting: u64,
}

impl Recording {
    /// Starts a recording in a new file NAME-1.mcap, NAME-2.mcap or so on in a folder; `processor` is restarted before
    /// its next frame.
    pub(super) fn start(
        folder: &Path,
        name: &str,
        labels: Labels,
        (info, config, models): (&StreamInfo, &Config, &[String]),
        processor: &Processor,
    ) -> Result<Self, Error> {
        let about = About::new(info, config, labels.clone(), models.to_vec())?;
        let (file, path) = first_free_file(|number| folder.join(format!("{name}-{number}.mcap")))?;
        check_room(&file, &path, info)?;
        Ok(Self { excerpt: Excerpt::start(file, &path, &about, processor)?, labels, events: 0 })
    }

    pub(super) fn source_event(&mut self, event: &SourceEvent<'_>) {
        self.excerpt.source_event(event);
    }

    pub(super) fn output(&mut self, output: &Output, words: fn(&Output) -> String) {
        self.events += u64::from(matches!(output, Output::Event(_)));
        self.excerpt.output(output, words);
    }

    /// Returns whether the recording goes on.
    pub(super) fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        self.excerpt.processed(event, processor) && !matches!(event, SourceEvent::End)
    }

    pub(super) fn progress(&self) -> Progress {
        let Self { excerpt, labels, events } = self;
        Progress {
            file: excerpt.path().display().to_string(),
            labels: labels.clone(),
            frames: excerpt.frames(),
            lost: excerpt.lost(),
            events: *events,
            waiting: excerpt.waiting(),
        }
    }

    /// Ends the recording and its file, and returns a line about it.
    pub(super) fn finish(self) -> Result<String, Error> {
        let (path, lost) = (self.excerpt.path().to_owned(), self.excerpt.lost());
        let written = self.excerpt.finish()?;
        let (frames, events) = (counted(written.frames, "frame"), counted(self.events, "event"));
        let lost = if lost > 0 { format!(", {} lost", counted(lost, "frame")) } else { String::new() };
        Ok(format!("{}: {frames}, {events}{lost}, {:.1} MB", path.display(), written.bytes as f64 / 1e6))
    }
}
