//! A recording that a service starts and ends while a sensor is read.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::JsonLine;
use wstac_host::output::Output;
use wstac_host::plural::counted;
use wstac_host::record::Recorder;
use wstac_host::record::about::About;
use wstac_host::session::Processor;
use wstac_host::source::SourceEvent;

use crate::orders::path_in;

/// The number of names that are tried before the recording fails.
const MOST_NAMES: u32 = 9999;

/// A recording in progress.
pub(crate) struct Recording {
    recorder: Recorder,
    pub(crate) path: PathBuf,
    /// The number of the first feature frame.
    zero: u64,
    lost: u64,
    /// Whether more can be written.
    goes_on: bool,
}

impl Recording {
    /// Starts a recording in a new file; `processor` was just restarted.
    ///
    /// # Errors
    /// The file exists or cannot be written, or its name is invalid.
    pub(crate) fn start(
        folder: &Path,
        file: &str,
        sensor: &str,
        about: &About,
        processor: &Processor,
    ) -> Result<Self, Error> {
        let (file, path) = new_file(folder, file, sensor)?;
        let recorder = Recorder::new(file, &path, about, processor)?;
        Ok(Self { recorder, path, zero: processor.pipeline().next_frame(), lost: 0, goes_on: true })
    }

    /// Takes an event of the source before it is processed.
    pub(crate) fn source_event(&mut self, event: &SourceEvent<'_>) {
        if let SourceEvent::Lost { frames, .. } = event {
            self.lost = self.lost.saturating_add(*frames);
        }
        self.recorder.source_event(event);
    }

    /// Takes an output that followed from it.
    pub(crate) fn output(&mut self, output: &Output) {
        let mut output = output.clone().counted_from(self.zero);
        if let Output::End(end) = &mut output {
            end.dropped = self.lost;
        }
        let text = JsonLine::new(&output).and_then(|line| serde_json::to_string(&line).ok());
        self.recorder.output(&output, &text.unwrap_or_default());
    }

    /// Takes the event after its outputs. Returns whether the recording goes on.
    pub(crate) fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        self.goes_on = self.goes_on && self.recorder.processed(event, processor);
        self.goes_on
    }

    /// Ends the recording and its file. Returns a line about it.
    ///
    /// # Errors
    /// The file could not be written, or not all of it.
    pub(crate) fn finish(self) -> Result<String, Error> {
        let Self { recorder, path, .. } = self;
        let written = recorder.finish()?;
        let frames = counted(written.frames, "frame");
        Ok(format!("{}: {frames} recorded, {:.1} MB", path.display(), written.bytes as f64 / 1e6))
    }
}

/// Creates the file of this name, or the first one that is free: SENSOR-1.mcap, SENSOR-2.mcap …
fn new_file(folder: &Path, file: &str, sensor: &str) -> Result<(File, PathBuf), Error> {
    let names: Vec<PathBuf> = if file.is_empty() {
        (1..=MOST_NAMES).map(|number| folder.join(format!("{sensor}-{number}.mcap"))).collect()
    } else {
        vec![path_in(Some(folder), file)?]
    };
    let is_only = names.len() == 1;
    for path in names {
        match File::create_new(&path) {
            Ok(file) => {
                // So a recovery leaves it alone. On a system without locks the file is not locked.
                let _ = file.try_lock();
                return Ok((file, path));
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && !is_only => {}
            Err(error) => return Err(Error::io(path.display(), error)),
        }
    }
    Err(Error::new(ErrorKind::AlreadyExists, folder.display(), format_args!("has {MOST_NAMES} recordings of {sensor}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_new_ones() {
        let folder = std::env::temp_dir().join(format!("wstac-node-names-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let of = |file: &str| new_file(&folder, file, "left").map(|(_, path)| path).map_err(|error| error.to_string());
        let found = ["", "", "a.mcap", "a.mcap", "../b.mcap"].map(of);
        std::fs::remove_dir_all(&folder).unwrap();
        let expected = ["left-1.mcap", "left-2.mcap", "a.mcap"].map(|name| Ok(folder.join(name)));
        assert_eq!(found[..3], expected);
        assert!(found[3].as_ref().is_err_and(|error| error.contains("a.mcap")), "{:?}", found[3]);
        assert!(found[4].as_ref().is_err_and(|error| error.contains("without folders")), "{:?}", found[4]);
    }
}
