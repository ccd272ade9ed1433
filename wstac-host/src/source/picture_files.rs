//! The pictures of a folder: which there are, in which order.

use std::path::{Path, PathBuf};

use super::natural;
use crate::error::{Error, ErrorKind};

/// The endings of pictures' names, without the dot and in small letters.
#[cfg(feature = "png")]
pub(super) const PNG: &[&str] = &["png"];
#[cfg(feature = "jpeg")]
pub(super) const JPEG: &[&str] = &["jpg", "jpeg"];

/// Returns the files of a folder whose names end so, in natural order.
///
/// Hidden files are passed over.
pub(super) fn list(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>, Error> {
    let unread = |error| Error::io(folder.display(), error);
    let mut files = vec![];
    for entry in std::fs::read_dir(folder).map_err(unread)? {
        let file = entry.map_err(unread)?.path();
        let ending = file.extension().unwrap_or_default().to_ascii_lowercase();
        let is_picture = ending.to_str().is_some_and(|ending| endings.contains(&ending));
        let is_hidden = file.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
        // A pipe would be waited for, and a folder has no pixels.
        if is_picture && !is_hidden && file.is_file() {
            files.push(file);
        }
    }
    files.sort_by(|a, b| natural::compare(a.as_os_str().as_encoded_bytes(), b.as_os_str().as_encoded_bytes()));
    Ok(files)
}

/// The kind of the pictures of a folder.
#[cfg(all(feature = "jpeg", feature = "png"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PictureKind {
    Png,
    Jpeg,
}

/// Returns the kind of the pictures of a folder: PNG if there are none.
///
/// # Errors
/// The folder cannot be listed, or has pictures of both kinds.
#[cfg(all(feature = "jpeg", feature = "png"))]
pub(super) fn kind(folder: &Path) -> Result<PictureKind, Error> {
    match (list(folder, PNG)?.len(), list(folder, JPEG)?.len()) {
        (_, 0) => Ok(PictureKind::Png),
        (0, _) => Ok(PictureKind::Jpeg),
        (png, jpeg) => {
            let (png, jpeg) = (crate::plural::counted(png, "PNG file"), crate::plural::counted(jpeg, "JPEG file"));
            let message = format_args!("has {png} and {jpeg}, expected pictures of one kind");
            Err(Error::new(ErrorKind::Data, folder.display(), message))
        }
    }
}

/// Returns the error of a folder without pictures.
pub(super) fn without_pictures(folder: &Path) -> Error {
    let kinds = match (cfg!(feature = "jpeg"), cfg!(feature = "png")) {
        (true, true) => ".png or .jpg",
        (true, false) => ".jpg",
        _ => ".png",
    };
    let message = format_args!("has no {kinds} file, expected at least one; a recording is named by itself, FILE.mcap");
    Error::new(ErrorKind::Data, folder.display(), message)
}
