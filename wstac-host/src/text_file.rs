//! Files of text that a person or a program wrote for this one.

use std::io;
use std::path::Path;

use serde::de::DeserializeOwned;

use crate::error::{Error, ErrorKind};
use crate::files;

/// Most bytes of a configuration, a scene, a plan, a sweep or a list of prices.
///
/// Parsing takes up to 100 times as much memory.
const MOST_BYTES: u64 = 1 << 20;

/// Most bytes of a map of a tradeoff, whose lines take no more memory when they are parsed.
pub const MOST_MAP_BYTES: u64 = 16 << 20;

/// Returns the content of a configuration, a scene, a plan, a sweep or a list of prices.
///
/// # Errors
/// The file cannot be read, is no text, or is larger than 1 MB.
pub fn file_text(path: &Path) -> Result<String, Error> {
    file_text_of(path, MOST_BYTES)
}

/// Returns the content of a file of text that has at most this many bytes.
///
/// # Errors
/// The file cannot be read, is no text, or is larger.
pub fn file_text_of(path: &Path, most: u64) -> Result<String, Error> {
    let failed = |error: io::Error| Error::io(path.display(), error);
    let Some(bytes) = files::content(path, most).map_err(failed)? else {
        let message = format_args!("is larger than {} MB, expected a file of text", most >> 20);
        return Err(Error::new(ErrorKind::Format, path.display(), message));
    };
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Error::new(ErrorKind::Format, path.display(), format_args!("byte {at} is no text, expected UTF-8"))
            .caused_by(error)
    })
}

/// Reads a TOML text.
///
/// # Errors
/// The text is not of this type. The message is [`toml_error`].
pub fn from_toml<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| toml_error(text, &error))
}

/// Says in one line what is wrong with a TOML text, and where.
pub fn toml_error(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().trim_end().replace('\n', ", ");
    let Some(before) = error.span().and_then(|span| text.get(..span.start)) else { return message };
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    let there = crate::visible::shortened(text.lines().nth(line - 1).unwrap_or_default().trim(), 100).into_owned();
    let there = if there.is_empty() { there } else { format!(" (in: {there})") };
    format!("TOML line {line}, column {column}: {message}{there}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_toml_is_one_line() {
        for (text, says) in [
            ("a = 1\né = 1 x", "TOML line 2, column 1: "),
            ("[t]\n\"k\\u001b\\n\" = 1\n  = 2", "TOML line 3, column 3: "),
            ("a", "TOML line 1, column "),
        ] {
            let error = toml::from_str::<toml::Table>(text).unwrap_err();
            let said = toml_error(text, &error);
            assert!(said.starts_with(says) && !said.contains('\n') && said.contains(" (in: "), "{said}");
        }
    }

    #[test]
    fn text_is_read_and_what_is_none_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "é").unwrap();
        assert_eq!(file_text(&path).unwrap(), "é");
        std::fs::write(&path, b"ab\xFF").unwrap();
        let error = file_text(&path).unwrap_err();
        assert!(error.is_format() && error.message().contains("byte 2 is no text"), "{error}");
        assert!(file_text(&folder.path().join("none")).unwrap_err().is_not_found());
        // A device that never ends takes no more memory than the largest file.
        let error = file_text(Path::new("/dev/zero")).unwrap_err();
        assert!(error.is_format() && error.message().contains("larger than 1 MB"), "{error}");
    }
}
