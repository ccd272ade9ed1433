//! Budgets: `M4F<60000,flash<64K` and the like.

mod choice;

use std::collections::BTreeMap;
use std::str::FromStr;

pub use self::choice::{By, Choice, best};
use super::candidate::{NONE, short};
use super::parameters::{AnswerLaw, Format, KERNELS, STRIDES, kernel_name};
use super::prices::Core;
use super::row::Row;
use wstac_core::params::NOMINAL_FRAME_RATE;

/// The quantity of a term.
#[derive(Clone, Debug, PartialEq)]
enum What {
    /// Instructions per frame on a core.
    Frame(Core),
    /// Instructions per event on a core.
    Event(Core),
    /// Bytes of flash, on the cores that other terms name.
    Flash,
    /// Bytes of RAM, on the cores that other terms name.
    Ram,
    /// Frames from the first touch to the answer.
    Frames,
}

#[derive(Clone, Debug, PartialEq)]
struct Limit {
    term: String,
    what: What,
    most: f64,
    /// `true` if a value equal to the limit still fits.
    or_equal: bool,
}

/// Limits, and fixed parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Budget {
    limits: Vec<Limit>,
    /// Fixed parameters: format, stride, ln, law and model.
    fixed: BTreeMap<String, String>,
}

const EXPECTED: &str = "M0, M3, M4F or M7 (instructions per frame), the same with .event, flash, ram, frames or latency with < or <=, \
    or format, stride, ln, law or model with =";

impl FromStr for Budget {
    type Err = String;

    /// Reads terms between commas; an error names the term, the value found and the values expected.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut budget = Self::default();
        for term in text.split(',').map(str::trim) {
            let at = term.find(['<', '=']).ok_or_else(|| no_limit(term))?;
            let (name, rest) = term.split_at(at);
            let name = name.trim();
            if let Some(value) = rest.strip_prefix('<') {
                let or_equal = value.starts_with('=');
                let value = value.strip_prefix('=').unwrap_or(value).trim();
                let what = what(name).ok_or_else(|| match name {
                    "host" | "host.event" => {
                        format!("term {term:?}: was removed; help: ci/bench measures times on a machine")
                    }
                    _ => format!("term {term:?}: {name:?}, expected {EXPECTED}{}", help(name)),
                })?;
                let units = if name.eq_ignore_ascii_case("latency") { TIMES } else { units(&what) };
                let most = number(value, units).map_err(|error| format!("term {term:?}: {error}"))?;
                budget.limits.push(Limit { term: term.to_owned(), what, most, or_equal });
            } else {
                let value = rest.strip_prefix('=').unwrap_or(rest).trim();
                budget.fix(name, value).map_err(|error| format!("term {term:?}: {error}"))?;
            }
        }
        Ok(budget)
    }
}

/// Describes the error in a term that has neither `<` nor `=`.
fn no_limit(term: &str) -> String {
    if term.is_empty() {
        return format!("term \"\": nothing between commas, expected {EXPECTED}");
    }
    if term.bytes().all(|byte| byte.is_ascii_digit()) {
        return format!("term {term:?}: a comma begins a term, expected numbers without: 60000 or 60k");
    }
    if term.contains('>') {
        return format!("term {term:?}: a limit from below, expected < or <=: what may be spent at most");
    }
    format!("term {term:?}: no limit, expected {EXPECTED}")
}

/// Returns what to write in place of a chip, or of a core with its clock.
fn help(name: &str) -> &'static str {
    if name.contains('@') || name.to_ascii_lowercase().contains("mhz") {
        return "; help: name the core alone: 1 MHz is some 1,900 instructions per frame, if they take 10 % of the time (30 \
                frames per second, 1.75 cycles per instruction)";
    }
    let is_chip = ["m", "rp", "stm"].iter().any(|head| name.to_ascii_lowercase().starts_with(head));
    if is_chip { "; help: an RP2040 is an M0, an M4 with floating point an M4F; an M33 was not counted" } else { "" }
}

fn what(name: &str) -> Option<What> {
    let name = name.to_ascii_lowercase().replace("m0+", "m0");
    let core = |name: &str| Core::ALL.into_iter().find(|core| core.name().eq_ignore_ascii_case(name));
    if let Some((name, what)) = name.split_once('.') {
        let of_core = |core| if what == "event" { Some(What::Event(core)) } else { None };
        return core(name).and_then(of_core);
    }
    match name.as_str() {
        "flash" => Some(What::Flash),
        "ram" => Some(What::Ram),
        "frames" | "latency" => Some(What::Frames),
        name => core(name).map(What::Frame),
    }
}

/// Units of bytes.
const BYTES: &[(&str, f64)] = &[
    ("K", 1024.0),
    ("k", 1024.0),
    ("M", 1_048_576.0),
    ("KB", 1024.0),
    ("kB", 1024.0),
    ("KiB", 1024.0),
    ("MB", 1_048_576.0),
    ("MiB", 1_048_576.0),
    ("", 1.0),
];

/// Units of time, in frames.
const TIMES: &[(&str, f64)] = &[("ms", NOMINAL_FRAME_RATE as f64 / 1e3), ("s", NOMINAL_FRAME_RATE as f64)];

/// Returns the units of a quantity: bytes in K of 1024, instructions in k or M.
fn units(what: &What) -> &'static [(&'static str, f64)] {
    match what {
        What::Flash | What::Ram => BYTES,
        What::Frames => &[("", 1.0)],
        What::Frame(_) | What::Event(_) => &[("k", 1e3), ("K", 1e3), ("M", 1e6), ("", 1.0)],
    }
}

/// Reads a number above 0.
fn number(text: &str, units: &[(&str, f64)]) -> Result<f64, String> {
    let read = units.iter().find_map(|(unit, scale)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        let scaled = number * scale;
        (scaled > 0.0 && scaled.is_finite()).then_some(scaled)
    });
    let names: Vec<&str> = units.iter().map(|(unit, _)| *unit).filter(|unit| !unit.is_empty()).collect();
    read.ok_or_else(|| match names[..] {
        [] => format!("{text:?}, expected a number above 0"),
        _ if names.contains(&"s") => {
            format!("{text:?}, expected a number above 0 with its unit, as in 0.6s or 600ms")
        }
        _ => format!("{text:?}, expected a number above 0, with or without {}", names.join(", ")),
    })
}

impl Budget {
    fn fix(&mut self, name: &str, value: &str) -> Result<(), String> {
        let lower = name.to_ascii_lowercase();
        let values = match lower.as_str() {
            "format" => Format::ALL.iter().map(|format| format.name()).chain(["YUYV"]).map(String::from).collect(),
            "stride" => STRIDES.map(|stride| stride.get().to_string()).to_vec(),
            "ln" => KERNELS.map(|kernel| kernel_name(kernel).to_owned()).to_vec(),
            "law" => AnswerLaw::ALL.map(|law| law.name().to_owned()).to_vec(),
            "model" if value.is_empty() => return Err("a name is missing, expected a model's, or none".to_owned()),
            "model" => vec![value.to_owned()],
            other if what(other).is_some() => return Err(format!("{name} with =, expected < or <=")),
            _ => return Err(format!("{name:?}, expected {EXPECTED}")),
        };
        let Some(known) = values.iter().find(|known| known.eq_ignore_ascii_case(value)) else {
            return Err(format!("{value:?}, expected one of {}", values.join(", ")));
        };
        match self.fixed.insert(lower, known.clone()) {
            Some(_) => Err(format!("{name} stands twice, expected once")),
            None => Ok(()),
        }
    }

    /// Checks that the requested model, if there is one, occurs in these rows.
    ///
    /// # Errors
    /// The model does not occur; the message names the term, the value found and the models' names.
    pub fn check_model(&self, rows: &[Row]) -> Result<(), String> {
        let Some(asked) = self.fixed.get("model") else { return Ok(()) };
        let mut names: Vec<&str> = vec![NONE];
        for name in rows.iter().filter_map(|row| row.model.as_deref().map(short)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        if names.contains(&short(asked)) {
            return Ok(());
        }
        Err(format!("term \"model={asked}\": {asked:?}, expected one of {}", names.join(", ")))
    }

    /// Returns the cores that are named, or else `default`.
    pub fn cores(&self, default: Core) -> Vec<Core> {
        let of = |limit: &Limit| match limit.what {
            What::Frame(core) | What::Event(core) => Some(core),
            _ => None,
        };
        let mut cores: Vec<Core> = Vec::new();
        for core in self.limits.iter().filter_map(of) {
            if !cores.contains(&core) {
                cores.push(core);
            }
        }
        if cores.is_empty() {
            cores.push(default);
        }
        cores
    }

    /// Returns `true` if a row has the fixed parameters.
    fn is_of(&self, row: &Row) -> bool {
        let [format, stride, ln, law] = row.setting.names();
        self.fixed.iter().all(|(name, value)| match name.as_str() {
            "format" => *value == format || row.setting.format.pixels() == Some(value),
            "stride" => *value == stride,
            "ln" => *value == ln,
            "law" => *value == law,
            _ => short(value) == short(row.model.as_deref().unwrap_or(NONE)),
        })
    }
}

#[cfg(test)]
mod tests;
