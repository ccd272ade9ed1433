//! The pictures of a folder: which there are, in which order, and what was reported of them.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::natural;
use super::orientation::Orientation;
use super::picture_names::{Places, in_order, several, stem};
use super::{Fault, FaultKind, LossReason, RowOrder, SourceEvent};
use crate::error::{Error, ErrorKind};
use crate::plural::counted;

/// The endings of pictures' names, without the dot and in small letters.
pub(super) const PNG: &[&str] = &["png"];
pub(super) const JPEG: &[&str] = &["jpg", "jpeg"];
/// The endings of pictures that are not read.
const OTHERS: [&str; 6] = ["tif", "tiff", "webp", "bmp", "pgm", "ppm"];

/// The pictures of a folder that are left. The first one that is turned, and the first one that is lost, have a fault
/// before their frame.
pub(super) struct Pictures {
    files: std::vec::IntoIter<PathBuf>,
    /// The places of all of them, until they are taken.
    pub(super) places: Places,
    /// The name of the first picture that can be read: all have its properties.
    pub(super) model: String,
    /// A file of which only a fault was reported yet.
    again: Option<PathBuf>,
    is_turn_reported: bool,
    is_loss_reported: bool,
}

impl Pictures {
    pub(super) fn new((files, places): (Vec<PathBuf>, Places), model: &Path) -> Self {
        let model = model.file_name().unwrap_or_default().display().to_string();
        Self { files: files.into_iter(), places, model, again: None, is_turn_reported: false, is_loss_reported: false }
    }

    pub(super) fn next(&mut self) -> Option<PathBuf> {
        self.again.take().or_else(|| self.files.next())
    }

    /// Returns the result, and leaves no picture if it is an error.
    pub(super) fn or_end<T>(&mut self, result: Result<T, Error>) -> Result<T, Error> {
        if result.is_err() {
            self.files = Vec::new().into_iter();
        }
        result
    }

    /// Refuses a picture whose rows are in another order than those of the first.
    pub(super) fn check_order(&self, file: &Path, turn: Orientation, expected: RowOrder) -> Result<(), Error> {
        if turn.row_order() == expected {
            return Ok(());
        }
        let message = format_args!("has its rows in another direction than {}, by their Exif data", self.model);
        Err(Error::new(ErrorKind::Format, file.display(), message))
    }

    /// Returns the fault about the first picture that is turned. The picture comes again after it.
    pub(super) fn turned(&mut self, file: &Path, turn: Orientation) -> Option<SourceEvent<'static>> {
        let turn = turn.turn()?;
        if std::mem::replace(&mut self.is_turn_reported, true) {
            return None;
        }
        Some(self.fault(file, FaultKind::Turned, format_args!("{turn}, as its Exif data say; others are turned, too")))
    }

    /// Returns the loss of a picture, or the fault about the first that is lost. That picture comes again after it.
    pub(super) fn lost(&mut self, file: &Path, why: impl Display, reason: LossReason) -> SourceEvent<'static> {
        if std::mem::replace(&mut self.is_loss_reported, true) {
            return SourceEvent::Lost { frames: 1, reason };
        }
        self.fault(file, FaultKind::Decoder, format_args!("cannot be decoded: {why}; others count as lost, too"))
    }

    fn fault(&mut self, file: &Path, kind: FaultKind, message: impl Display) -> SourceEvent<'static> {
        self.again = Some(file.to_owned());
        SourceEvent::Fault(Fault::new(kind, format!("{}: {message}", file.display())))
    }
}

/// Returns the files of a folder whose names end so, in natural order.
///
/// Hidden files are passed over.
fn find(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>, Error> {
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
    files.sort_by_cached_key(|file| (natural::key(stem(file)), file.clone()));
    Ok(files)
}

/// Returns the files of a folder whose names end so, in natural order or by their times, and their places.
///
/// # Errors
/// The folder cannot be listed, has no such file, or has several series of them.
pub(super) fn list(folder: &Path, endings: &[&str]) -> Result<(Vec<PathBuf>, Places), Error> {
    let files = find(folder, endings)?;
    if files.is_empty() {
        return Err(without_pictures(folder));
    }
    let (files, places) = in_order(files);
    if let Some(series) = several(&files, places.as_ref()) {
        let message = format_args!(
            "has several series of pictures ({series}); help: a folder for each camera, or one camera's names with a counter"
        );
        return Err(Error::new(ErrorKind::Data, folder.display(), message));
    }
    Ok((files, places))
}

/// Returns the first picture that can be read, and what `read` returns of it, which otherwise says why not. Others
/// before it are frames that are lost later on.
pub(super) fn first_of<T>(
    folder: &Path,
    files: &[PathBuf],
    kind: &str,
    mut read: impl FnMut(&Path) -> Result<Result<T, String>, Error>,
) -> Result<(PathBuf, T), Error> {
    let mut first = None;
    for file in files {
        match read(file)? {
            Ok(found) => return Ok((file.clone(), found)),
            Err(why) => first = first.or(Some((file, why))),
        }
    }
    let why = first.map(|(file, why)| format!("; {}: {why}", file.file_name().unwrap_or_default().display()));
    let message = format_args!("no {kind} file of {} can be read{}", files.len(), why.unwrap_or_default());
    Err(Error::new(ErrorKind::Format, folder.display(), message))
}

/// Returns whether the pictures of a folder are JPEG rather than PNG.
///
/// # Errors
/// The folder cannot be listed, or has pictures of both kinds.
pub(super) fn are_jpegs(folder: &Path) -> Result<bool, Error> {
    let [png, jpeg] = [find(folder, PNG)?.len(), find(folder, JPEG)?.len()];
    if png > 0 && jpeg > 0 {
        let (png, jpeg) = (counted(png, "PNG file"), counted(jpeg, "JPEG file"));
        let message = format_args!("has {png} and {jpeg}, expected pictures of one kind");
        return Err(Error::new(ErrorKind::Data, folder.display(), message));
    }
    Ok(jpeg > 0)
}

pub(super) fn without_pictures(folder: &Path) -> Error {
    let kinds = match (cfg!(feature = "jpeg"), cfg!(feature = "png")) {
        (true, true) => ".png or .jpg",
        (true, false) => ".jpg",
        _ => ".png",
    };
    // Shells tell small letters from capital ones.
    let found = OTHERS.into_iter().find_map(|ending| find(folder, &[ending]).ok()?.into_iter().next());
    let message = match found.as_deref().and_then(Path::extension) {
        Some(other) => {
            let other = other.display();
            format!("has .{other} files, expected {kinds}; help: mogrify -format png *.{other} makes PNG files of them")
        }
        None => format!("has no {kinds} file, expected at least one; a recording is named by itself, FILE.mcap"),
    };
    Error::new(ErrorKind::Data, folder.display(), message)
}
