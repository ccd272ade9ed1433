//! Parses sources with names: `left=/dev/video0`.
//!
//! A file whose whole name reads like this is a file if it is there; `./left=a.y4m` is one in any case.
//! `cam:left=/dev/video0` is the same, as it was written first.
//!
//! ```
//! use wstac_host::source::names::sensors;
//!
//! let sources = ["left=/dev/video0".into(), "right=slides.mcap".into()];
//! let sensors = sensors(&sources)?;
//! assert_eq!(sensors[1].name, Some("right"));
//! assert_eq!(sensors[1].source, "slides.mcap");
//! # Ok::<(), wstac_host::error::Error>(())
//! ```

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use crate::error::{Error, ErrorKind};

/// The prefix that a source with a name may have.
const PREFIX: &[u8] = b"cam:";

/// A source with the name that its records have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorSpec<'a> {
    /// The name; `None` for a plain source.
    pub name: Option<&'a str>,
    /// The source to open.
    pub source: &'a OsStr,
}

/// The former name of [`SensorSpec`].
#[deprecated(since = "0.4.0", note = "use `SensorSpec`")]
pub type Sensor<'a> = SensorSpec<'a>;

/// Returns the sensors that the user names.
///
/// # Errors
/// Returns an error if a name is invalid or taken, or if two sources are standard input.
pub fn sensors(sources: &[OsString]) -> Result<Vec<SensorSpec<'_>>, Error> {
    let sensors = sources.iter().map(|source| sensor(source)).collect::<Result<Vec<_>, _>>()?;
    for (index, sensor) in sensors.iter().enumerate() {
        let before = &sensors[..index];
        if sensor.name.is_some() && before.iter().any(|other| other.name == sensor.name) {
            return Err(refused(&sources[index], "the name is taken, expected another for each source"));
        }
        if sensor.source == "-" && before.iter().any(|other| other.source == "-") {
            return Err(refused(&sources[index], "standard input is read already, and can be read only once"));
        }
    }
    Ok(sensors)
}

fn sensor(text: &OsStr) -> Result<SensorSpec<'_>, Error> {
    let Some(named) = text.as_bytes().strip_prefix(PREFIX).or_else(|| named(text)) else {
        return Ok(SensorSpec { name: None, source: text });
    };
    let at = named.iter().position(|byte| *byte == b'=');
    let Some((name, source)) = at.map(|at| (&named[..at], OsStr::from_bytes(&named[at + 1..]))) else {
        return Err(refused(text, "expected NAME=SOURCE, such as left=/dev/video0"));
    };
    let name = OsStr::from_bytes(name);
    let Some(name) = name.to_str().filter(|name| is_name(name)) else {
        let expected = "expected letters, digits, - and _, the first no -";
        return Err(refused(text, format_args!("the name is {:?}, {expected}", name.to_string_lossy())));
    };
    if source.is_empty() {
        return Err(refused(text, "there is nothing after =, expected a source such as /dev/video0"));
    }
    Ok(SensorSpec { name: Some(name), source })
}

pub(super) fn is_named(text: &OsStr) -> bool {
    text.as_bytes().starts_with(PREFIX) || named(text).is_some()
}

/// Returns the text if it begins with the name of a sensor, and is no file.
fn named(text: &OsStr) -> Option<&[u8]> {
    let bytes = text.as_bytes();
    let name = bytes.split(|byte| *byte == b'=').next().filter(|name| name.len() < bytes.len() && !name.is_empty())?;
    // A name that starts as a path, or lies in a folder that is there, is meant as a file, whatever is wrong with it.
    let folder = Path::new(OsStr::from_bytes(name)).parent().filter(|folder| folder.is_dir());
    let is_file = matches!(name[0], b'.' | b'/') || name.contains(&b':') || folder.is_some();
    (!is_file && !Path::new(text).exists()).then_some(bytes)
}

/// Returns `true` for the name of a sensor: letters, digits, `-` and `_`, and no `-` in front.
///
/// Names are parts of keys and files' names, and other programs take a word that starts with `-` for an option.
pub fn is_name(name: &str) -> bool {
    let is_of_name = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
    !name.is_empty() && !name.starts_with('-') && name.bytes().all(is_of_name)
}

pub(super) fn refused(source: &OsStr, message: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Usage, format_args!("SOURCE is {:?}", source.to_string_lossy()), message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(sources: &[&str]) -> Result<Vec<(Option<String>, String)>, String> {
        let sources: Vec<OsString> = sources.iter().map(OsString::from).collect();
        let sensors = sensors(&sources).map_err(|error| error.to_string())?;
        Ok(sensors.iter().map(|sensor| (sensor.name.map(str::to_owned), sensor.source.display().to_string())).collect())
    }

    #[test]
    fn names_go_before_any_source() {
        for prefix in ["", "cam:"] {
            let sources = [format!("{prefix}left=/dev/video0"), format!("{prefix}right_2-b=scene:Saw3@150,seed=2")];
            let two = parsed(&[&sources[0], &sources[1]]).unwrap();
            assert_eq!(two[0], (Some("left".into()), "/dev/video0".into()));
            assert_eq!(two[1], (Some("right_2-b".into()), "scene:Saw3@150,seed=2".into()));
        }
    }

    #[test]
    fn what_reads_like_a_name_and_is_none_is_a_source() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a=b.y4m");
        for plain in ["scene:Saw3@150,seed=2", "./a=b.y4m", "src/a=b.y4m", "=b.y4m", "-a=b.y4m", file.to_str().unwrap()]
        {
            let found = parsed(&[plain]);
            if plain.starts_with("-a") {
                assert!(found.unwrap_err().contains("the first no -"));
            } else {
                assert_eq!(found.unwrap(), [(None, plain.into())]);
            }
        }
        // The tests' folder has no such file. A file that is there keeps its name.
        assert_eq!(parsed(&["a=b.y4m"]).unwrap(), [(Some("a".into()), "b.y4m".into())]);
        std::fs::write(&file, "").unwrap();
        assert_eq!(named(file.as_os_str()), None);
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for (sources, part) in [
            (&["cam:left"][..], "expected NAME=SOURCE"),
            (&["cam:=/dev/video0"], "the name is \"\""),
            (&["cam:le ft=/dev/video0"], "the name is \"le ft\""),
            (&["cam:l\u{e9}=/dev/video0"], "letters, digits"),
            (&["cam:-left=/dev/video0"], "the name is \"-left\", expected letters, digits, - and _, the first no -"),
            (&["cam:le/ft=a.y4m"], "the name is \"le/ft\", expected letters, digits"),
            (&["cam:left="], "nothing after ="),
            (&["cam:a=-", "cam:a=x.y4m"], "the name is taken"),
            (&["cam:a=-", "cam:b=-"], "standard input is read already"),
        ] {
            let error = parsed(sources).unwrap_err();
            assert!(error.starts_with("SOURCE is \"cam:") && error.contains(part), "{error}");
            let without: Vec<&str> = sources.iter().map(|source| &source[4..]).collect();
            if part.starts_with("the name is \"l") {
                assert!(parsed(&without).unwrap_err().contains(part), "{without:?}");
            }
        }
    }
}
