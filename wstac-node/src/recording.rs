//! A recording that a service starts and ends while a sensor is read.

use std::fs::File;
use std::path::{Path, PathBuf};

use wstac_host::error::Error;
use wstac_host::plural::counted;
use wstac_host::record::about::About;
use wstac_host::record::{Excerpt, check_room, first_free_file, new_file};
use wstac_host::session::Processor;

use crate::orders::path_in;

/// Starts a recording in a new file: of this name in the folder, or of the first that is free; `processor` is restarted
/// before its next frame.
///
/// # Errors
/// The file exists or cannot be written, the disk is full, or its name is invalid.
pub(crate) fn start(
    folder: &Path,
    file: &str,
    sensor: &str,
    about: &About,
    processor: &Processor,
) -> Result<Excerpt, Error> {
    let (file, path) = file_of(folder, file, sensor)?;
    check_room(&file, &path, &about.info)?;
    Excerpt::start(file, &path, about, processor)
}

/// Ends a recording and its file. Returns a line about it.
///
/// # Errors
/// The file could not be written, or not all of it.
pub(crate) fn finish(recording: Excerpt) -> Result<String, Error> {
    let path = recording.path().to_owned();
    let written = recording.finish()?;
    let frames = counted(written.frames, "frame");
    Ok(format!("{}: {frames} recorded, {:.1} MB", path.display(), written.bytes as f64 / 1e6))
}

/// Creates the file of this name, or the first one that is free: SENSOR-1.mcap, SENSOR-2.mcap …
fn file_of(folder: &Path, file: &str, sensor: &str) -> Result<(File, PathBuf), Error> {
    if file.is_empty() {
        return first_free_file(|number| folder.join(format!("{sensor}-{number}.mcap")));
    }
    let path = path_in(Some(folder), file)?;
    Ok((new_file(&path)?, path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_new_ones() {
        let folder = std::env::temp_dir().join(format!("wstac-node-names-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let of = |file: &str| file_of(&folder, file, "left").map(|(_, path)| path).map_err(|error| error.to_string());
        let found = ["", "", "a.mcap", "a.mcap", "../b.mcap"].map(of);
        std::fs::remove_dir_all(&folder).unwrap();
        let expected = ["left-1.mcap", "left-2.mcap", "a.mcap"].map(|name| Ok(folder.join(name)));
        assert_eq!(found[..3], expected);
        assert!(found[3].as_ref().is_err_and(|error| error.contains("a.mcap")), "{:?}", found[3]);
        assert!(found[4].as_ref().is_err_and(|error| error.contains("without folders")), "{:?}", found[4]);
    }
}
