//! The parameters of the node, as the services of `rcl_interfaces` read and change them.

use std::sync::atomic::Ordering;
use std::time::SystemTime;

use wstac_host::visible;

use super::cdr::{Cdr, CdrReader};
use crate::orders::{Control, copy_of, replace};

/// The longest name of a coordinate frame.
const MOST_FRAME_ID: usize = 255;
/// The parameters that a request may always name, besides as many as there are.
const MOST_NAMED: usize = 64;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// There is no such parameter.
    NotSet,
    Bool(bool),
    Integer(i64),
    Text(String),
    Texts(Vec<String>),
    /// A value of a type that no parameter here has, with that type.
    Other(u8),
}

impl Value {
    /// Returns the number of the type, as `rcl_interfaces/ParameterType` has it.
    fn kind(&self) -> u8 {
        match self {
            Self::NotSet => 0,
            Self::Bool(_) => 1,
            Self::Integer(_) => 2,
            Self::Text(_) => 4,
            Self::Texts(_) => 9,
            Self::Other(kind) => *kind,
        }
    }

    /// Writes `rcl_interfaces/ParameterValue`: its type, and one field for each type.
    fn write(&self, cdr: Cdr) -> Cdr {
        let (flag, integer) = match self {
            Self::Bool(flag) => (*flag, 0),
            Self::Integer(integer) => (false, *integer),
            _ => (false, 0),
        };
        let text = if let Self::Text(text) = self { text } else { "" };
        let texts = if let Self::Texts(texts) = self { &texts[..] } else { &[] };
        let cdr = cdr.u8(self.kind()).bool(flag).i64(integer).f64(0.0).text(text);
        // Lists of bytes, flags, integers and numbers.
        let cdr = cdr.u32(0).u32(0).u32(0).u32(0).u32(texts.len() as u32);
        texts.iter().fold(cdr, |cdr, text| cdr.text(text))
    }

    fn read(reader: &mut CdrReader<'_>) -> Option<Self> {
        let (kind, flag, integer) = (reader.u8()?, reader.bool()?, reader.u64()?.cast_signed());
        // A number, which no parameter is.
        reader.u64()?;
        let text = reader.text()?.to_owned();
        [1, 1, 8, 8].into_iter().try_for_each(|size| reader.skip_list(size))?;
        let texts = reader.list(|reader| reader.text().map(str::to_owned))?;
        Some(match kind {
            0 => Self::NotSet,
            1 => Self::Bool(flag),
            2 => Self::Integer(integer),
            4 => Self::Text(text),
            9 => Self::Texts(texts),
            kind => Self::Other(kind),
        })
    }
}

/// Parameters that have changed at once, with their values.
pub(super) type Changes = Vec<(String, Value)>;

/// The parameters of the node and its sensors.
pub(super) struct Parameters {
    /// The name of the node, with the slash in front.
    pub(super) node: String,
    pub(super) namespace: String,
    pub(super) domain: u32,
    pub(super) controls: Vec<Control>,
}

/// The names of a sensor's parameters, whether they are read-only, and what they are.
const OF_SENSORS: [(&str, bool, &str); 5] = [
    ("configuration", true, "The file of the configuration; the service load_configuration replaces it."),
    ("frame_id", false, "The coordinate frame of the sensor's messages."),
    ("models", true, "The files of the texture models; the service load_model replaces them."),
    ("picture", false, "Whether frames are published under the topic picture."),
    ("source", true, "The camera, board, recording or scene."),
];
/// The names of the node's own parameters, whether they are read-only, and what they are.
const OF_NODE: [(&str, bool, &str); 2] =
    [("domain", true, "The domain of ROS 2."), ("namespace", true, "The beginning of all topics and services.")];

impl Parameters {
    fn names(&self) -> impl Iterator<Item = String> {
        let of_sensor = |control: &Control| OF_SENSORS.map(|(name, ..)| format!("{}.{name}", control.name));
        let of_node = OF_NODE.iter().map(|(name, ..)| (*name).to_owned());
        of_node.chain(self.controls.iter().flat_map(of_sensor))
    }

    /// Refuses more names than there can be in one request, whose answer nobody needs.
    fn few<T>(&self, named: Vec<T>) -> Option<Vec<T>> {
        let all = OF_NODE.len() + OF_SENSORS.len() * self.controls.len();
        (named.len() <= all.max(MOST_NAMED)).then_some(named)
    }

    /// Returns the sensor of a name, and the name without it.
    fn of_sensor<'n>(&self, name: &'n str) -> Option<(&Control, &'n str)> {
        let (sensor, last) = name.split_once('.')?;
        self.controls.iter().find(|control| control.name == sensor).map(|control| (control, last))
    }

    fn get(&self, name: &str) -> Value {
        match (name, self.of_sensor(name)) {
            ("domain", _) => Value::Integer(self.domain.into()),
            ("namespace", _) => Value::Text(self.namespace.clone()),
            (_, Some((control, last))) => {
                let settings = &control.settings;
                match last {
                    "configuration" => Value::Text(copy_of(&settings.config)),
                    "frame_id" => Value::Text(copy_of(&settings.frame_id).to_string()),
                    "models" => Value::Texts(copy_of(&settings.models)),
                    "picture" => Value::Bool(settings.picture.load(Ordering::Relaxed)),
                    "source" => Value::Text(settings.source.clone()),
                    _ => Value::NotSet,
                }
            }
            _ => Value::NotSet,
        }
    }

    /// Changes a parameter, or only checks whether it could be.
    ///
    /// # Errors
    /// There is no such parameter, it is read-only, or the value is of another type. The text says so.
    fn set(&self, name: &str, value: &Value, is_check: bool) -> Result<(), String> {
        if let Some((control, last)) = self.of_sensor(name) {
            match (last, value) {
                ("frame_id", Value::Text(text)) => {
                    if text.is_empty() || text.len() > MOST_FRAME_ID || visible::line(text) != *text {
                        return Err(format!("{name}: expected 1 to {MOST_FRAME_ID} visible characters"));
                    }
                    if !is_check {
                        replace(&control.settings.frame_id, text.as_str().into());
                    }
                    return Ok(());
                }
                ("picture", Value::Bool(flag)) => {
                    if !is_check {
                        control.settings.picture.store(*flag, Ordering::Relaxed);
                    }
                    return Ok(());
                }
                _ => {}
            }
        }
        Err(match (described(name, self), self.get(name).kind()) {
            (None, _) => format!("{name}: there is no such parameter"),
            (Some((true, _)), _) => format!("{name}: the parameter is read-only"),
            (_, kind) => format!("{name}: the type is {}, expected {kind}", value.kind()),
        })
    }

    /// Answers `GetParameters`.
    pub(super) fn get_all(&self, request: &[u8]) -> Option<Cdr> {
        let names = self.few(CdrReader::new(request)?.list(CdrReader::text)?)?;
        let cdr = Cdr::new().u32(names.len() as u32);
        Some(names.iter().fold(cdr, |cdr, name| self.get(name).write(cdr)))
    }

    /// Answers `GetParameterTypes`.
    pub(super) fn types(&self, request: &[u8]) -> Option<Cdr> {
        let names = self.few(CdrReader::new(request)?.list(CdrReader::text)?)?;
        let types: Vec<u8> = names.iter().map(|name| self.get(name).kind()).collect();
        Some(Cdr::new().bytes(&types))
    }

    /// Answers `DescribeParameters`.
    pub(super) fn describe(&self, request: &[u8]) -> Option<Cdr> {
        let names = self.few(CdrReader::new(request)?.list(CdrReader::text)?)?;
        let write = |cdr: Cdr, name: &&str| {
            let (is_read_only, about) = described(name, self).unwrap_or((false, ""));
            let cdr = cdr.text(name).u8(self.get(name).kind()).text(about).text("").bool(is_read_only);
            // The type is fixed, and no number has a range.
            cdr.bool(false).u32(0).u32(0)
        };
        Some(names.iter().fold(Cdr::new().u32(names.len() as u32), write))
    }

    /// Answers `ListParameters`.
    pub(super) fn list(&self, request: &[u8]) -> Option<Cdr> {
        let mut reader = CdrReader::new(request)?;
        let (wanted, depth) = (reader.list(CdrReader::text)?, reader.u64()?);
        let is_near = |rest: &str| depth == 0 || (rest.matches('.').count() as u64) < depth;
        let is_wanted = |name: &String| {
            (wanted.is_empty() && is_near(name))
                || wanted.iter().any(|wanted| match name.strip_prefix(wanted) {
                    Some("") => true,
                    Some(rest) => rest.strip_prefix('.').is_some_and(is_near),
                    None => false,
                })
        };
        let names: Vec<String> = self.names().filter(is_wanted).collect();
        let mut prefixes: Vec<&str> =
            names.iter().filter_map(|name| name.rsplit_once('.').map(|(prefix, _)| prefix)).collect();
        prefixes.dedup();
        let cdr = names.iter().fold(Cdr::new().u32(names.len() as u32), |cdr, name| cdr.text(name));
        Some(prefixes.iter().fold(cdr.u32(prefixes.len() as u32), |cdr, prefix| cdr.text(prefix)))
    }

    /// Answers `SetParameters`: each one is changed or not. The changes go to `changed`, each of its own.
    pub(super) fn set_all(&self, request: &[u8], changed: &mut Vec<Changes>) -> Option<Cdr> {
        let wanted = self.few(read_parameters(request)?)?;
        let mut cdr = Cdr::new().u32(wanted.len() as u32);
        for (name, value) in wanted {
            let set = self.set(name, &value, false);
            cdr = result(cdr, &set);
            if set.is_ok() {
                changed.push(vec![(name.to_owned(), value)]);
            }
        }
        Some(cdr)
    }

    /// Answers `SetParametersAtomically`: all are changed, or none. The changes go to `changed`, all at once.
    pub(super) fn set_atomically(&self, request: &[u8], changed: &mut Vec<Changes>) -> Option<Cdr> {
        let wanted = self.few(read_parameters(request)?)?;
        let set = |is_check| wanted.iter().try_for_each(|(name, value)| self.set(name, value, is_check));
        let set = set(true).and_then(|()| set(false));
        let cdr = result(Cdr::new(), &set);
        if set.is_ok() && !wanted.is_empty() {
            changed.push(wanted.into_iter().map(|(name, value)| (name.to_owned(), value)).collect());
        }
        Some(cdr)
    }

    /// Returns the change of a sensor's parameter that a service has made.
    pub(super) fn changed(&self, sensor: &Control, last: &str) -> Changes {
        let name = format!("{}.{last}", sensor.name);
        let value = self.get(&name);
        vec![(name, value)]
    }

    /// Returns `rcl_interfaces/ParameterEvent` of changes.
    pub(super) fn event(&self, changed: &Changes) -> Vec<u8> {
        let cdr = Cdr::new().time(SystemTime::now()).text(&self.node);
        // None is new, and none is gone.
        let cdr = cdr.u32(0).u32(changed.len() as u32);
        changed.iter().fold(cdr, |cdr, (name, value)| value.write(cdr.text(name))).u32(0).finish()
    }
}

/// Returns whether a parameter is read-only, and what it is; `None` if there is no such parameter.
fn described(name: &str, parameters: &Parameters) -> Option<(bool, &'static str)> {
    let (of_all, last) = match parameters.of_sensor(name) {
        Some((_, last)) => (&OF_SENSORS[..], last),
        None => (&OF_NODE[..], name),
    };
    of_all.iter().find(|(known, ..)| *known == last).map(|(_, is_read_only, about)| (*is_read_only, *about))
}

/// Reads a list of `rcl_interfaces/Parameter`.
fn read_parameters(request: &[u8]) -> Option<Vec<(&str, Value)>> {
    CdrReader::new(request)?.list(|reader| Some((reader.text()?, Value::read(reader)?)))
}

/// Writes `rcl_interfaces/SetParametersResult`.
fn result(cdr: Cdr, result: &Result<(), String>) -> Cdr {
    cdr.bool(result.is_ok()).text(result.as_ref().err().map_or("", String::as_str))
}
