//! The pictures of a folder: which there are, in which order.

use std::path::{Path, PathBuf};

use super::natural;
use crate::error::{Error, ErrorKind};

/// The endings of pictures' names, without the dot and in small letters.
#[cfg(feature = "png")]
pub(super) const PNG: &[&str] = &["png"];
#[cfg(feature = "jpeg")]
pub(super) const JPEG: &[&str] = &["jpg", "jpeg"];

/// Returns the files of a folder whose names end so, in natural order, or by their numbers if all are decimals.
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
    if files.iter().all(|file| decimal(stem(file)).is_some()) {
        files.sort_by_cached_key(|file| decimal(stem(file)));
    }
    Ok(files)
}

/// Returns the positions of pictures by the numbers in their names: the only number that differs from name to name.
/// `None` if names differ by something else.
pub(super) fn positions(files: &[PathBuf]) -> Option<Vec<f64>> {
    let decimals: Option<Vec<i128>> = files.iter().map(|file| decimal(stem(file))).collect();
    let numbers = decimals.or_else(|| only_numbers(files))?;
    let first = *numbers.first()?;
    // Large numbers keep their differences.
    Some(numbers.into_iter().map(|number| number.saturating_sub(first) as f64).collect())
}

/// Returns the number of each name that differs from name to name, if nothing else does.
fn only_numbers(files: &[PathBuf]) -> Option<Vec<i128>> {
    let names: Vec<Vec<Part<'_>>> = files.iter().map(|file| parts(stem(file))).collect();
    let first = names.first()?;
    let differs = |at: &usize| names.iter().any(|name| name.get(*at) != first.get(*at));
    let [at] = (0..names.iter().map(Vec::len).max()?).filter(differs).collect::<Vec<_>>()[..] else { return None };
    let number = |name: &Vec<Part<'_>>| if let Part::Number(number) = name.get(at)? { *number } else { None };
    names.iter().map(number).collect()
}

/// A part of a name.
#[derive(PartialEq)]
enum Part<'a> {
    /// Digits, as a number; `None` if there are too many.
    Number(Option<i128>),
    Text(&'a [u8]),
}

fn parts(name: &[u8]) -> Vec<Part<'_>> {
    let is_number = |part: &[u8]| part.first().is_some_and(u8::is_ascii_digit);
    name.chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit())
        .map(|part| if is_number(part) { Part::Number(number(part)) } else { Part::Text(part) })
        .collect()
}

/// Returns a decimal such as a time of a name in parts of 10⁻⁹; `None` if the name is anything else.
fn decimal(name: &[u8]) -> Option<i128> {
    let dot = name.iter().position(|byte| *byte == b'.')?;
    let (whole, fraction) = (name.get(..dot)?, name.get(dot + 1..)?);
    if fraction.is_empty() || !fraction.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let digits: Vec<u8> = fraction.iter().copied().chain(std::iter::repeat(b'0')).take(9).collect();
    number(whole)?.checked_mul(1_000_000_000)?.checked_add(number(&digits)?)
}

/// Returns the value of digits; `None` if there are none, other bytes or too many digits.
fn number(digits: &[u8]) -> Option<i128> {
    str::from_utf8(digits).ok().filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))?.parse().ok()
}

/// Returns a file's name without its ending.
fn stem(file: &Path) -> &[u8] {
    file.file_stem().unwrap_or_default().as_encoded_bytes()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn found(names: &[&str]) -> Option<Vec<f64>> {
        positions(&names.iter().map(PathBuf::from).collect::<Vec<_>>())
    }

    #[test]
    fn pictures_are_placed_by_the_one_number_that_differs() {
        assert_eq!(found(&["a8.png", "a09.png", "a10.png"]), Some(vec![0.0, 1.0, 2.0]));
        assert_eq!(found(&["2_frame1.png", "2_frame3_.png"]), None);
        assert_eq!(found(&["2-1.png", "3-2.png"]), None);
        assert_eq!(found(&["cam1.0007.png", "cam1.0009.png"]), Some(vec![0.0, 2.0]));
        assert_eq!(found(&["0.5.png", "0.75.png", "1.0.png"]), Some(vec![0.0, 25e7, 5e8]));
        assert_eq!(found(&["1764100000000000001.png", "1764100000000000003.png"]), Some(vec![0.0, 2.0]));
        assert_eq!(found(&["a.png", "b.png"]), None);
        assert_eq!(found(&["1.png"]), None);
        assert_eq!(found(&[&"9".repeat(99), &"8".repeat(99)]), None);
    }
}
