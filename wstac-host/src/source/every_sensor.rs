//! Lists the sensors of the sources that a user names: of a recording of several, each one.

use std::ffi::OsString;

use super::names::{SensorSpec, is_name, refused};
use super::open::recorded_sensors;
use crate::error::Error;

/// A sensor, and where it is read from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedSource {
    /// The name; `None` for the only sensor of a program, if the user gave none.
    pub name: Option<String>,
    /// The source to open.
    pub source: OsString,
    /// Which sensor of a recording of several it is ([`OpenOptions::sensor`](super::open::OpenOptions::sensor));
    /// `None` for other sources.
    pub recorded: Option<String>,
}

/// Returns the sensors of all sources. A recording of several sensors has the names that are in the file; a name before
/// such a recording chooses one of them.
///
/// # Errors
/// One of several sources has no name, a name is taken, or a recording cannot be read or has no such sensor.
pub fn every_sensor(given: &[SensorSpec<'_>]) -> Result<Vec<NamedSource>, Error> {
    let mut all = Vec::new();
    for &SensorSpec { name, source } in given {
        let of = |name: Option<&str>, recorded: Option<&str>| NamedSource {
            name: name.map(str::to_owned),
            source: source.to_owned(),
            recorded: recorded.map(str::to_owned),
        };
        let recorded = recorded_sensors(source)?;
        match name {
            None if recorded.is_empty() && given.len() > 1 => {
                return Err(refused(source, "several sources need names, expected NAME=SOURCE for each"));
            }
            name if recorded.is_empty() => all.push(of(name, None)),
            Some(name) if recorded.iter().any(|known| known == name) => all.push(of(Some(name), Some(name))),
            Some(name) => {
                let known = recorded.join(", ");
                let message = format!("the recording has no sensor {name}, expected one of {known} before =");
                return Err(refused(source, message));
            }
            None => {
                // A file may say anything, and names become those of keys and files.
                if let Some(wrong) = recorded.iter().find(|name| !is_name(name)) {
                    let message = format!(
                        "the recording has a sensor {wrong:?}, which is no name of a sensor; help: --sensor NAME reads one"
                    );
                    return Err(refused(source, message));
                }
                all.extend(recorded.iter().map(|name| of(Some(name), Some(name))));
            }
        }
    }
    for (index, sensor) in all.iter().enumerate() {
        let before = &all[..index];
        if let Some(name) = sensor.name.as_ref().filter(|_| before.iter().any(|other| other.name == sensor.name)) {
            let message = format_args!("the name {name} is taken, expected another for each sensor");
            return Err(refused(&sensor.source, message));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::names::sensors;

    /// Returns each sensor as `NAME SOURCE`.
    fn listed(sources: &[&str]) -> Result<Vec<String>, String> {
        let sources: Vec<OsString> = sources.iter().map(OsString::from).collect();
        let all = sensors(&sources).and_then(|given| every_sensor(&given)).map_err(|error| error.to_string())?;
        let name = |sensor: &NamedSource| sensor.name.clone().unwrap_or_else(|| "-".into());
        Ok(all.iter().map(|sensor| format!("{} {}", name(sensor), sensor.source.display())).collect())
    }

    #[test]
    fn one_sensor_needs_no_name_and_several_do() {
        assert_eq!(listed(&["scene:Saw3@150"]).unwrap(), ["- scene:Saw3@150"]);
        assert_eq!(listed(&["a=1.y4m", "b=2.y4m"]).unwrap(), ["a 1.y4m", "b 2.y4m"]);
        let refused = listed(&["a=1.y4m", "2.y4m"]).unwrap_err();
        assert_eq!(refused, "SOURCE is \"2.y4m\": several sources need names, expected NAME=SOURCE for each");
    }
}
