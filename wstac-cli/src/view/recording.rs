//! Recordings that a key starts and ends while a source is watched.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::state::Rec;
use wstac_host::error::Error;
use wstac_host::output::Output;
use wstac_host::plural::counted;
use wstac_host::record::about::About;
use wstac_host::record::{Excerpt, first_free_file};
use wstac_host::session::Processor;
use wstac_host::source::SourceEvent;

/// The settings of recordings, and the recording in progress.
pub(crate) struct Recordings {
    /// The description in a recording, or the reason why there can be none.
    about: Result<About, Error>,
    named: Option<PathBuf>,
    words: fn(&Output) -> String,
    running: Option<Excerpt>,
    /// Whether the next frame is the first of a recording.
    pub(super) asked: bool,
    said: Vec<String>,
}

impl Recordings {
    /// Creates recordings that describe themselves by `about`, which is an error if there can be none. `named` is the
    /// file of the first one, otherwise it is `wstac-N.mcap`. `words` turns a record into text.
    pub(crate) fn new(about: Result<About, Error>, named: Option<PathBuf>, words: fn(&Output) -> String) -> Self {
        Self { about, named, words, running: None, asked: false, said: Vec::new() }
    }

    /// Returns the results of the recordings, one line each.
    pub(crate) fn said(&self) -> &[String] {
        &self.said
    }

    /// Returns why there can be no recording.
    pub(super) fn why_not(&self) -> Option<String> {
        self.about.as_ref().err().map(ToString::to_string)
    }

    /// Returns what the screen shows about the recording in progress.
    pub(super) fn shown(&self) -> Option<Rec> {
        self.running.as_ref().map(|running| Rec {
            name: running.path().display().to_string(),
            frames: running.frames(),
            waiting: running.waiting(),
        })
    }

    /// Returns the new file of a recording, with its name; `None` if there can be no recording.
    pub(super) fn new_file(&self) -> Result<Option<(File, PathBuf)>, String> {
        if self.about.is_err() {
            return Ok(None);
        }
        let new = first_free_file(|number| name(self.named.as_deref(), number));
        new.map(Some).map_err(|error| error.to_string())
    }

    /// Starts a recording in a new file; `processor` was just restarted.
    pub(super) fn start(&mut self, (file, path): (File, PathBuf), processor: &Processor) -> Result<(), String> {
        let Ok(about) = &self.about else { return Ok(()) };
        let started = Excerpt::start(file, &path, about, processor);
        self.running = Some(started.map_err(|error| error.to_string())?);
        Ok(())
    }

    /// Records an item before it is processed.
    pub(super) fn item(&mut self, item: &SourceEvent<'_>) {
        if let Some(running) = &mut self.running {
            running.source_event(item);
        }
    }

    /// Records an output of the processor.
    pub(super) fn record(&mut self, record: &Output) {
        if let Some(running) = &mut self.running {
            running.output(record, self.words);
        }
    }

    /// Returns whether a recording must end after this item, because it is the last one or because no more can be
    /// written.
    pub(super) fn must_end(&mut self, item: &SourceEvent<'_>, processor: &Processor) -> bool {
        let Some(running) = &mut self.running else { return false };
        let goes_on = running.processed(item, processor);
        !goes_on || matches!(item, SourceEvent::End)
    }

    /// Ends the recording in progress, and returns whether it is complete, with its description.
    pub(super) fn end(&mut self) -> Option<(bool, String)> {
        let running = self.running.take()?;
        let path = running.path().to_owned();
        let (whole, text) = match running.finish() {
            Ok(written) => {
                let megabytes = written.bytes as f64 / 1e6;
                let frames = counted(written.frames, "frame");
                (true, format!("{}: {frames} recorded, {megabytes:.1} MB", path.display()))
            }
            Err(error) => (false, error.to_string()),
        };
        self.said.push(text.clone());
        Some((whole, text))
    }
}

/// Returns the name of a recording: FILE.mcap, FILE-2.mcap …, or wstac-1.mcap, wstac-2.mcap …
fn name(named: Option<&Path>, number: u32) -> PathBuf {
    match named {
        None => format!("wstac-{number}.mcap").into(),
        Some(path) if number == 1 => path.to_owned(),
        Some(path) => {
            let mut name = path.file_stem().unwrap_or_default().to_owned();
            name.push(format!("-{number}"));
            if let Some(extension) = path.extension() {
                name.push(".");
                name.push(extension);
            }
            path.with_file_name(name)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_new_ones() {
        let folder = std::env::temp_dir().join(format!("wstac-names-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let first = folder.join("slide.mcap");
        let names: Vec<PathBuf> =
            (0..3).map(|_| first_free_file(|number| name(Some(&first), number)).unwrap().1).collect();
        let nowhere =
            first_free_file(|number| name(Some(&folder.join("none/slide.mcap")), number)).unwrap_err().to_string();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(names, ["slide.mcap", "slide-2.mcap", "slide-3.mcap"].map(|name| folder.join(name)));
        assert!(nowhere.contains("none/slide.mcap"), "{nowhere}");
    }
}
