//! Parses sources with names: `cam:left=/dev/video0`.
//!
//! ```
//! use wstac_host::source::names::sensors;
//!
//! let sources = ["cam:left=/dev/video0".into(), "cam:right=slides.mcap".into()];
//! let sensors = sensors(&sources)?;
//! assert_eq!(sensors[1].name, Some("right"));
//! assert_eq!(sensors[1].source, "slides.mcap");
//! # Ok::<(), wstac_host::error::Error>(())
//! ```

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;

use crate::error::{Error, ErrorKind};

/// A source with the name that its records have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensor<'a> {
    /// The name; `None` for a plain source.
    pub name: Option<&'a str>,
    /// The source to open.
    pub source: &'a OsStr,
}

/// Returns the sensors that the user names.
///
/// # Errors
/// Returns an error if a name is invalid or taken, or if two sources are standard input.
pub fn sensors(sources: &[OsString]) -> Result<Vec<Sensor<'_>>, Error> {
    let sensors = sources.iter().map(|source| sensor(source)).collect::<Result<Vec<_>, _>>()?;
    for (index, sensor) in sensors.iter().enumerate() {
        let before = &sensors[..index];
        if sensor.name.is_some() && before.iter().any(|other| other.name == sensor.name) {
            return Err(refused(&sources[index], "the name is taken, expected another for each source"));
        }
        if sensor.source == "-" && before.iter().any(|other| other.source == "-") {
            return Err(refused(&sources[index], "standard input is read already, expected it once"));
        }
    }
    Ok(sensors)
}

fn sensor(text: &OsStr) -> Result<Sensor<'_>, Error> {
    let Some(named) = text.as_bytes().strip_prefix(b"cam:") else { return Ok(Sensor { name: None, source: text }) };
    let at = named.iter().position(|byte| *byte == b'=');
    let Some((name, source)) = at.map(|at| (&named[..at], OsStr::from_bytes(&named[at + 1..]))) else {
        return Err(refused(text, "expected cam:NAME=SOURCE, such as cam:left=/dev/video0"));
    };
    let is_letter = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
    let name = OsStr::from_bytes(name);
    // Programs take a word that starts with - for an option.
    let is_name = |name: &&str| !name.is_empty() && !name.starts_with('-') && name.bytes().all(is_letter);
    let Some(name) = name.to_str().filter(is_name) else {
        let expected = "expected letters, digits, - and _, the first no -";
        return Err(refused(text, format_args!("the name is {:?}, {expected}", name.to_string_lossy())));
    };
    if source.is_empty() {
        return Err(refused(text, "there is nothing after =, expected a source such as /dev/video0"));
    }
    Ok(Sensor { name: Some(name), source })
}

fn refused(source: &OsStr, message: impl std::fmt::Display) -> Error {
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
        let two = parsed(&["cam:left=/dev/video0", "cam:right_2-b=scene:Saw3@150,seed=2"]).unwrap();
        assert_eq!(two[0], (Some("left".into()), "/dev/video0".into()));
        assert_eq!(two[1], (Some("right_2-b".into()), "scene:Saw3@150,seed=2".into()));
        assert_eq!(parsed(&["a=b.y4m"]).unwrap(), [(None, "a=b.y4m".into())]);
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for (sources, part) in [
            (&["cam:left"][..], "expected cam:NAME=SOURCE"),
            (&["cam:=/dev/video0"], "the name is \"\""),
            (&["cam:le ft=/dev/video0"], "the name is \"le ft\""),
            (&["cam:l\u{e9}=/dev/video0"], "letters, digits"),
            (&["cam:-left=/dev/video0"], "the name is \"-left\", expected letters, digits, - and _, the first no -"),
            (&["cam:left="], "nothing after ="),
            (&["cam:a=-", "cam:a=x.y4m"], "the name is taken"),
            (&["cam:a=-", "cam:b=-"], "standard input is read already"),
        ] {
            let error = parsed(sources).unwrap_err();
            assert!(error.starts_with("SOURCE is \"cam:") && error.contains(part), "{error}");
        }
    }
}
